"""Times: too few, out of order, repeated, lost, at several rates (E04, E05, E14, E15, E27)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sbas.input_check.judgement import Judged, counted, judged, place, seconds, stamp
from sbas.input_check.leap_steps import MOST_LEAP_S, STAMP_TOLERANCE_NS
from sbas.recording_survey import Ints, Rows, Survey, Tail
from sbas.timescales import NS_PER_S, WEEK_S

DAY_NS, WEEK_NS = 86_400 * NS_PER_S, WEEK_S * NS_PER_S
WRAP_GAP_NS = 3600 * NS_PER_S
"""Longest gap over midnight, or the end of a week, that still shows as a wrapped time."""
MAX_STRETCHES = 100_000
"""Stretches of rising time that are told apart; beyond, no order is proposed."""
_HEAD = ("lat_deg", "lon_deg", "height_m", "hpl_m")


class TimeOrder:
    """The stretches of rising time: where each begins and ends, and with which epoch."""

    COLUMNS = _HEAD

    def __init__(self) -> None:
        self.row: list[int] = []
        self.before_ns: list[int] = []
        self.begin_ns: list[int] = []
        self.heads: list[tuple[float, ...]] = []
        self.min_ns, self.max_ns = np.iinfo(np.int64).max, np.iinfo(np.int64).min
        self._tail = Tail(1, _HEAD)

    def update(self, rows: Rows) -> None:
        joined, old = self._tail.before(rows)
        time = joined.time_ns
        if old == 0:
            self._add(joined, 0)
        for at in (np.flatnonzero(np.diff(time) < 0) + 1).tolist():
            if len(self.row) < MAX_STRETCHES:
                self._add(joined, at)
        self.min_ns = min(self.min_ns, int(time.min()))
        self.max_ns = max(self.max_ns, int(time.max()))

    def _add(self, joined: Rows, at: int) -> None:
        self.row.append(joined.first + at)
        self.begin_ns.append(int(joined.time_ns[at]))
        self.before_ns.append(int(joined.time_ns[at - 1]) if at else self.begin_ns[0])
        self.heads.append(tuple(float(joined.values[name][at]) for name in _HEAD))

    def overlap(self, end_ns: int) -> bool:
        """Whether stretches share time, so that sorting would mix them."""
        if len(self.row) >= MAX_STRETCHES:
            return True
        begin = np.array(self.begin_ns)
        end = np.array([*self.before_ns[1:], end_ns])
        order = np.argsort(begin, kind="stable")
        return bool(np.any(begin[order][1:] <= end[order][:-1]))

    def repeats(self) -> bool:
        """Whether a stretch begins with the very epoch that an earlier one began with."""
        seen = list(zip(self.begin_ns, self.heads, strict=True))
        known = [head for head in seen if not any(np.isnan(head[1][:2]))]
        return len(set(known)) < len(known)


def wraps(step_ns: Ints, period_ns: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(n,) True where a step falls back by a period, less a gap of at most an hour."""
    return (step_ns < 0) & (step_ns >= -period_ns) & (step_ns <= WRAP_GAP_NS - period_ns)


def too_few(facts: Survey) -> Iterator[Judged]:
    """E15: fewer epochs than any analysis needs."""
    if facts.epochs < 2:
        yield judged(
            "E15", "error", f"the recording has {facts.epochs or 'no'} epoch",
            evidence="two epochs are the least that any analysis can use",
            cure="record longer, or read another file; sbas.read still gives what is there",
        )  # fmt: skip


def backward(facts: Survey, order: TimeOrder, slips: frozenset[int]) -> Iterator[Judged]:
    """E14: time that decreases, or never increases; `slips` are rows that E11 explains."""
    at = [i for i, row in enumerate(order.row) if i and row not in slips]
    if at:
        yield _fallen(facts, order, at)
    if facts.interval_ns == 0:
        yield judged(
            "E14", "error", "no epoch is later than the one before it",
            cure="--sort, or read another file",
        )  # fmt: skip


def _fallen(facts: Survey, order: TimeOrder, at: list[int]) -> Judged:
    step = np.array([order.begin_ns[i] - order.before_ns[i] for i in at])
    sizes = {"day": int(wraps(step, DAY_NS).sum()), "week": int(wraps(step, WEEK_NS).sum())}
    number = facts.backward - (len(order.row) - 1 - len(at))
    kinds = [f"{n} by one {period}" for period, n in sizes.items() if n]
    if others := number - sum(sizes.values()):
        kinds.append(f"{others} otherwise (a restart, or files in another order)")
    shown = ", ".join(seconds(s) for s in step[:3])
    evidence = (
        f"{'; '.join(kinds)}; steps {shown}{', ...' if number > 3 else ''}; recording runs "
        f"{stamp(facts.begin_ns)} to {stamp(facts.end_ns)} GPST"
    )
    cure, repair = _cure_of_order(facts, order, number, sizes)
    return judged(
        "E14", "error", f"time goes backward {number} times",
        where=f"first at {place(order.row[at[0]], order.begin_ns[at[0]])}",
        evidence=evidence, cure=cure, repair=repair,
    )  # fmt: skip


def _cure_of_order(
    facts: Survey, order: TimeOrder, number: int, sizes: dict[str, int]
) -> tuple[str, dict[str, object]]:
    if order.repeats():
        return "--sort --duplicates first: a stretch is there twice", {"sort": True}
    for period, n in sizes.items():
        if n == number:
            # Two records of one day begin at one time; the day after begins before the first did.
            sure = order.begin_ns[0] - max(order.begin_ns[1:]) > 60 * NS_PER_S
            cure = f"--unwrap {period}, where the date was not advanced; --sort else"
            return cure, {"unwrap": period} if sure else {}
    if not order.overlap(facts.end_ns):
        return "--sort, when one receiver's files were joined in the wrong order", {"sort": True}
    return (
        "evaluate the stretches apart: they overlap, and --sort would mix them; --sort only where "
        "they are one receiver's"
    ), {}


def repeated(facts: Survey, slips: int, alternating: bool) -> Iterator[Judged]:
    """E05: successive epochs with one time; `slips` of them are explained by E11."""
    number = facts.repeated - slips
    if number <= 0:
        return
    same = facts.repeated - facts.repeated_differing
    halves = facts.repeated_differing - facts.repeated_contradicting
    yield judged(
        "E05", "error", f"{number:,} epochs repeat the time of the epoch before",
        where=f"first at row {facts.first_repeated_row:,}",
        evidence=f"{facts.repeated_differing:,} of them with other values; {same:,} identical, "
        f"{halves:,} complete each other, {facts.repeated_contradicting:,} contradict each other"
        + ("; they alternate between two receivers, see E06" if alternating else ""),
        cure="--duplicates first, or --duplicates last",
        repair={"duplicates": "first"} if facts.repeated_contradicting == 0 else {},
    )  # fmt: skip


LEAST_STEPS = 60
"""Equal steps one behind the other, from which longer ones are a rate and no gaps."""


def rates(facts: Survey) -> Iterator[Judged]:
    """E27: epochs that do not cover the time that their median step says, or slower stretches."""
    counted_ns = facts.epochs * facts.interval_ns
    slower = _slower_steps(facts)
    if facts.interval_ns and abs(facts.covered_ns - counted_ns) > 0.01 * counted_ns:
        evidence = (
            f"{facts.epochs:,} epochs cover {facts.covered_ns / NS_PER_S:.6g} s, at the "
            f"median step they would cover {counted_ns / NS_PER_S:.6g} s"
        )
    elif slower:
        evidence = (
            f"{slower[0]:,} steps of {slower[1] / NS_PER_S:.6g} s one behind the other, each "
            f"counted as a gap beside the median step of {facts.interval_ns / NS_PER_S:.6g} s"
        )
    else:
        return
    yield judged(
        "E27", "warning", "epochs come at more than one rate",
        evidence=evidence,
        cure="hours are counted by the time covered; evaluate each rate on its own",
    )  # fmt: skip


def _slower_steps(facts: Survey) -> tuple[int, int] | None:
    """Count and length [ns] of the longest run of equal gaps without another step between."""
    gaps = facts.gaps
    if len(gaps) < LEAST_STEPS:
        return None
    step = gaps.after_ns - gaps.before_ns
    same = (np.diff(gaps.row) == 1) & (np.abs(np.diff(step)) <= STAMP_TOLERANCE_NS)
    edges = np.flatnonzero(np.diff(same, prepend=False, append=False))
    length = edges[1::2] - edges[::2] + 1
    if length.size == 0 or length.max() < LEAST_STEPS:
        return None
    longest = int(np.argmax(length))
    return int(length[longest]), int(step[edges[2 * longest]])


def lost(facts: Survey, slips: frozenset[int]) -> Iterator[Judged]:
    """E04: gaps; `slips` are rows behind steps that E11 explains."""
    missing_ns = facts.gaps.missing_ns(facts.interval_ns)
    missing_ns = missing_ns[[row not in slips for row in facts.gaps.row.tolist()]]
    if missing_ns.size == 0:
        return
    missing = missing_ns / NS_PER_S
    span_h = (facts.end_ns - facts.begin_ns) / (3600 * NS_PER_S)
    share = missing.sum() / max(span_h * 3600, 1e-9)
    whole = np.rint(missing)
    alike = (whole >= 1) & (whole <= MOST_LEAP_S)
    alike &= np.abs(missing - whole) <= STAMP_TOLERANCE_NS / NS_PER_S
    note = ""
    if facts.static and alike.any():
        note = (
            f"; {int(alike.sum())} of 1 to {MOST_LEAP_S} whole seconds: where nothing moves, a "
            "corrected leap second cannot be told from a gap"
        )
    yield judged(
        "E04", "warning",
        f"{counted(missing.size, 'gap')}: lost {missing.sum():.6g} s, {100 * share:.3g} % of the "
        "span",
        evidence=f"longest {missing.max():.6g} s; step {facts.interval_ns / NS_PER_S:.6g} s; "
        f"recorded {facts.hours:.6g} h of {span_h:.6g} h{note}",
        cure="nothing to do: availability is given with gaps as down and without them",
    )  # fmt: skip
