"""The verdict of a comparison in words, and what must be known beside it."""

from __future__ import annotations

from collections.abc import Iterator

from sbas.estimate import Estimate, Refusal
from sbas.integrity.comparison.comparison_results import (
    PAPER_TAU_S,
    AvailabilityComparison,
    Comparison,
    DropOuts,
    LevelRatio,
)
from sbas.numerals import key, number, share, upward


def verdict_of(result: Comparison) -> tuple[str, ...]:
    """Sentences that say what the figures show, no more than their intervals allow."""
    return (
        _positions(result),
        *([f"Offset: {result.offset}."] if result.offset is not None else []),
        _levels(result),
        *(_availability(result, limit) for limit in result.alert_limits),
        *_drop_outs(result),
        *_errors(result),
    )


def caveats_of(result: Comparison) -> tuple[str, ...]:
    """Sentences that must travel with a comparison."""
    return tuple(_caveats(result))


def _positions(result: Comparison) -> str:
    found = result.difference
    if isinstance(found, Refusal):
        return f"Positions cannot be compared: {found.reason}."
    return (
        f"Positions: at half of {found.epochs:,} paired epochs they lie within "
        f"{found.median.value:.3f} m of each other, at 95 % within {found.p95.value:.3f} m, at "
        f"most {found.max:.3f} m apart (horizontal)."
    )


def _levels(result: Comparison) -> str:
    ratio = result.hpl_ratio
    if isinstance(ratio, Refusal):
        return f"Levels cannot be compared: {ratio.reason}."
    a, b = result.label_a, result.label_b
    text = f"Levels: HPL of {a} is {ratio.median.value:.4f} times that of {b} (median)"
    if isinstance(ratio.expected, Refusal):
        return f"{text}; {ratio.expected.reason}, so sigmas are not compared."
    return (
        f"{text}; with equal sigmas the K factors alone give {ratio.expected:.4f}. "
        f"{_sigmas(ratio, a, b)}"
    )


def _sigmas(ratio: LevelRatio, a: str, b: str) -> str:
    sigma = ratio.sigma_ratio
    assert isinstance(sigma, Estimate)
    if sigma.lower is None or sigma.upper is None:
        return f"The record is too short to tell the sigmas apart (ratio {sigma.value:.4f})."
    if sigma.lower <= 1 <= sigma.upper:
        return f"No difference of the sigmas is seen (ratio {sigma.value:.4f})."
    more, less = (a, b) if sigma.value > 1 else (b, a)
    size = max(sigma.value, 1 / sigma.value) - 1
    if size < 5e-4:
        return "The sigmas are the same to 0.05 %."
    return (
        f"{more}'s model sigma is {100 * size:.1f} % larger than {less}'s: look at ionosphere and "
        "degradation."
    )


def _availability(result: Comparison, limit: AvailabilityComparison) -> str:
    a, b = result.label_a, result.label_b
    text = (
        f"At {key(limit.alert_limit_m)} m: {a} was up {share(limit.availability_a.value)}, {b} "
        f"{share(limit.availability_b.value)} of the time; "
    )
    events_a, events_b = (_events(rate) for rate in (limit.only_a, limit.only_b))
    if events_a == events_b == 0:
        return f"{text}never was one up without the other."
    text += (
        f"{a} alone in {_counted(events_a)} ({number(limit.only_a_s)} s), {b} alone in "
        f"{_counted(events_b)} ({number(limit.only_b_s)} s). "
    )
    if isinstance(limit.difference, Estimate):
        low, high = limit.difference.lower, limit.difference.upper
        assert low is not None
        assert high is not None
        interval = f"difference {_points(limit.difference.value)} ({_points(low)} to "
        interval += f"{_points(high)}) of the time"
        if low > 0 or high < 0:
            return f"{text}{a if low > 0 else b} is available more often: {interval}."
        return f"{text}No difference is demonstrated: {interval}."
    of_a, of_b = limit.availability_a, limit.availability_b
    if _low(of_a) > _high(of_b) or _low(of_b) > _high(of_a):
        more = a if of_a.value > of_b.value else b
        return f"{text}{more} is available more often: the intervals of the two do not meet."
    # Garwood's limits of the two rates: apart only where the counts differ by far.
    if _low(limit.only_a) > _high(limit.only_b) or _low(limit.only_b) > _high(limit.only_a):
        more, other = (a, b) if events_a > events_b else (b, a)
        return (
            f"{text}{more} alone was up more often than {other} alone; too few events for shares."
        )
    return f"{text}No difference is demonstrated: too few events."


def _drop_outs(result: Comparison) -> Iterator[str]:
    for label, found in (
        (result.label_a, result.drop_outs_a),
        (result.label_b, result.drop_outs_b),
    ):
        if found is not None:
            yield f"{label} left PA {_times(found)}."


def _times(found: DropOuts) -> str:
    count = len(found.events)
    if count == 0:
        return f"never (rate below {upward(_high(found.rate))}/h)"
    seconds = float(found.events.duration_s.sum())
    times = "once" if count == 1 else f"{count} times"
    return f"{times}, for {number(seconds)} s in all ({number(found.rate.value)}/h in PA)"


def _errors(result: Comparison) -> Iterator[str]:
    for label, found in ((result.label_a, result.error_a), (result.label_b, result.error_b)):
        if found is not None:
            yield (
                f"HPE of {label}: median {found.median:.3f} m, 95 % {found.p95:.3f} m, largest "
                f"{found.max:.3f} m; {found.mi_epochs} of {found.epochs:,} epochs misleading."
            )


def _caveats(result: Comparison) -> Iterator[str]:
    yield (
        "errors that both share (signal in space, corrections) cancel: agreement is no evidence "
        "of integrity"
    )
    if result.settings.tau_s == PAPER_TAU_S:
        yield (
            f"intervals rest on tau = {PAPER_TAU_S:g} s, the paper's assumption and not measured "
            "here; a longer one makes them wider"
        )
    else:
        yield f"intervals rest on tau = {result.settings.tau_s:g} s as given"
    ratio = result.hpl_ratio
    expected = ratio.expected if isinstance(ratio, LevelRatio) else None
    other_k = isinstance(expected, float) and expected != 1
    if other_k:
        yield (
            "the K factors differ: the levels of the two modes do not bound the same risk (PA: "
            "one dimension, 150 s; NPA: two dimensions, 1 h)"
        )
    found = result.difference
    if not isinstance(found, Refusal) and found.max == 0 and not other_k:
        yield "the positions are the same at every epoch: is it one recording given twice?"
    lost = result.unpaired_a - result.between_a, result.unpaired_b - result.between_b
    for label, missing in ((result.label_b, lost[0]), (result.label_a, lost[1])):
        if missing:
            yield (
                f"{label} lacks {missing:,} epochs of the shared span; they count as down for it "
                "in the availability and are left out of the differences"
            )
    if not isinstance(found, Refusal) and found.interpolated:
        yield (
            f"{found.interpolated:,} positions were interpolated by up to "
            f"{found.max_shift_s:.3g} s, since the vehicle moves between the epochs "
            "of the two recordings"
        )
    elif result.max_offset_s > 0:
        yield f"epochs of a pair lie up to {result.max_offset_s:.3g} s apart"


def _counted(events: float) -> str:
    return f"{events:g} event" if events == 1 else f"{events:g} events"


def _events(rate: Estimate) -> float:
    events: float = getattr(rate.basis, "events", 0.0)
    return events


def _low(rate: Estimate) -> float:
    return rate.lower or 0.0


def _high(rate: Estimate) -> float:
    assert rate.upper is not None
    return rate.upper


def _points(difference: float) -> str:
    return f"{100 * difference:+.3g} %"
