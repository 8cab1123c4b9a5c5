"""Receiver states of a recording as a source of a model: a Markov chain, or semi-Markov phases.

Where runs do not last geometrically, a state is expanded into phases by age: again a finite chain,
which every solver takes as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.receiver.state_chain import StateChain, stationary_law
from sbas.dependability.receiver.state_estimation import ReceiverStates
from sbas.dependability.receiver.state_tally import STATES
from sbas.dependability.tree.model import MarkovSource, Stage
from sbas.estimate import Refusal
from sbas.exceptions import InputError

Floats = NDArray[np.float64]
EntryLaw = Literal["counts", "posterior"]
Rows = tuple[tuple[float, ...], ...]

_STEP_TOLERANCE = 1e-3
"""Receivers' clocks make the median step differ from the nominal one."""


def markov_source(
    states: ReceiverStates,
    name: str,
    *,
    step_s: float,
    guard: tuple[str, ...] = (),
    down: str = "down",
    waiting: str | None = None,
    first_fix_s: float = 0.0,
    environment: str | None = None,
    profile: Sequence[tuple[str, float]] = (),
    estimate: EntryLaw = "counts",
) -> MarkovSource:
    """The first-order chain of a recording as a source that starts correct.

    Parameters
    ----------
    states : of a recording.
    name, guard, down, waiting, first_fix_s : of the source; see MarkovSource.
    step_s : epoch of the model [s]; must be the recording's, else "consecutive" would change its
        meaning.
    environment : label of the chain to take; None for all together.
    profile : (label, seconds) of environments one after the other, instead of `environment`.
    estimate : "counts" (n_ij/n_i.) or "posterior" (mean of the Dirichlet law 1/2 + n_ij), with
        which nothing that was never seen is impossible.

    Raises
    ------
    InputError : another step, an unknown label, or a state without counts under "counts".
    """
    _check_step(states, step_s)
    if profile and environment is not None:
        raise InputError("a profile names the environments itself", where="environment")
    labels: list[str | None] = [label for label, _ in profile] or [environment]
    rows = [_rows(states.chain_of(label), estimate) for label in labels]
    return MarkovSource(
        name=name,
        states=STATES,
        rows=rows[0],
        initial=(1.0, 0.0, 0.0),
        guard=guard,
        down=down,
        waiting=waiting,
        first_fix_s=first_fix_s,
        stages=tuple(Stage(*part, rows[i]) for i, part in enumerate(profile)),
        source=_provenance(states, labels, "first-order chain"),
    )


def semi_markov_source(
    states: ReceiverStates,
    name: str,
    *,
    step_s: float,
    guard: tuple[str, ...] = (),
    down: str = "down",
    waiting: str | None = None,
    first_fix_s: float = 0.0,
    environment: str | None = None,
    ages: int = 60,
) -> MarkovSource:
    """The recording's own laws of how long each state lasts, as phases by age.

    Parameters
    ----------
    states, name, step_s, guard, down, waiting, first_fix_s, environment : as for `markov_source`.
    ages : most phases of a state; beyond, the hazard is constant. Take no fewer than the longest
        run that a gate counts.

    Returns
    -------
    MarkovSource whose phases share the names of `STATES`; starts correct at age 1, and restarts at
    age 1 by the share of time in each state.

    Raises
    ------
    InputError : another step, an unknown label, or a state entered of which no run was seen whole.

    Notes
    -----
    At age r a state is left with the hazard h(r) = runs seen to end at r / runs seen at age r and
    one epoch further (the Kaplan-Meier estimate, which counts cut runs as long as they were seen;
    without them f(r)/P(L >= r)), for the state j with n_ij / sum over k != i of n_ik.
    From the last phase R on the hazard is constant: ends at R or later / epochs at R or later.

    References
    ----------
    E. L. Kaplan, P. Meier, JASA 53 (1958) 457.
    """
    _check_step(states, step_s)
    if isinstance(ages, bool) or not isinstance(ages, int) or ages < 1:
        raise InputError("a state has at least one phase", where="ages", evidence=repr(ages))
    chain = states.chain_of(environment)
    counts = np.array(chain.counts, dtype=float)
    np.fill_diagonal(counts, 0.0)
    present = [i for i in range(3) if counts[:, i].any() or chain.epochs[i]]
    hazards = {i: sojourn_hazards(chain, i, ages) for i in present}
    if 0 not in hazards:
        raise InputError(
            "no epoch is correct: the source has no state to start in",
            cure="record where there is a fix",
        )
    jumps = {i: counts[i] / counts[i].sum() for i in present}
    start = dict(zip(present, np.cumsum([0, *(hazards[i].size for i in present)]), strict=False))
    size = sum(h.size for h in hazards.values())
    rows = np.zeros((size, size))
    for i in present:
        for age, hazard in enumerate(hazards[i].tolist()):
            at = start[i] + age
            rows[at, min(at + 1, start[i] + hazards[i].size - 1)] += 1.0 - hazard
            for j in present:
                if jumps[i][j]:
                    rows[at, start[j]] += hazard * jumps[i][j]
    begin = [0.0] * size
    begin[start[0]] = 1.0
    again = [0.0] * size
    for i, share in _time_shares(hazards, jumps).items():
        again[start[i]] = share
    return MarkovSource(
        name=name,
        states=tuple(STATES[i] for i in present for _ in hazards[i]),
        rows=tuple(tuple(row) for row in rows.tolist()),
        initial=tuple(begin),
        guard=guard,
        down=down,
        waiting=waiting,
        first_fix_s=first_fix_s,
        restart=tuple(again),
        source=_provenance(states, [environment], "semi-Markov, phases by age"),
    )


def sojourn_hazards(chain: StateChain, state: int, ages: int) -> Floats:
    """(R,) probabilities to leave a state at ages 1..R, the last for all later ages too.

    Parameters
    ----------
    chain : counted.
    state : index in `STATES`.
    ages : largest R; less where no run was seen to end so late.

    Raises
    ------
    InputError : no run of the state was seen from its begin to its end.
    """
    runs = chain.runs[state]
    if not runs.completed:
        raise InputError(
            f"no run of {STATES[state]!r} was seen from its begin to its end",
            where=chain.label,
            cure="record longer, or take the first-order chain",
        )
    last = min(ages, runs.completed[-1][0])
    ends, at_risk = np.zeros(last), np.zeros(last)
    for lengths, seen_to_end in ((runs.completed, True), (runs.censored, False)):
        for length, count in lengths:
            # A cut run was not seen to go on or end after its last epoch.
            known = length if seen_to_end else length - 1
            at_risk[: min(known, last)] += count
            at_risk[last - 1] += count * max(known - last, 0)
            if seen_to_end:
                ends[min(length, last) - 1] += count
    hazards: Floats = ends / at_risk
    return hazards


def _time_shares(hazards: dict[int, Floats], jumps: dict[int, Floats]) -> dict[int, float]:
    """Long-run share of time in each state: entries times mean sojourn."""
    embedded = np.zeros((3, 3))
    for i in range(3):
        embedded[i] = jumps.get(i, 1.0 / 3.0)
    entries = stationary_law(embedded)
    if isinstance(entries, Refusal):
        raise InputError(entries.reason, cure=entries.cure)
    time = {}
    for i, hazard in hazards.items():
        survives = np.append(1.0, np.cumprod(1.0 - hazard[:-1]))
        time[i] = entries[i] * (survives[:-1].sum() + survives[-1] / hazard[-1])
    total = sum(time.values())
    return {i: float(t / total) for i, t in time.items()}


def _rows(chain: StateChain, estimate: EntryLaw) -> Rows:
    if estimate == "posterior":
        return tuple(tuple(a / sum(row) for a in row) for row in chain.dirichlet)
    if estimate != "counts":
        raise InputError(f"unknown estimate {estimate!r}", cure="counts or posterior")
    found = []
    for name, row in zip(STATES, chain.probabilities, strict=True):
        if row is None:
            raise InputError(
                f"{name!r} was never seen to go on: its row has no counts",
                where=chain.label,
                cure="estimate='posterior', or a longer recording",
            )
        found.append(row)
    return tuple(found)


def _check_step(states: ReceiverStates, step_s: float) -> None:
    if not abs(step_s - states.interval_s) <= _STEP_TOLERANCE * states.interval_s:
        raise InputError(
            "the model's epoch is not the recording's: consecutive epochs would mean another time",
            evidence=f"step {step_s:g} s, recording {states.interval_s:g} s",
            cure=f"step_s = {states.interval_s:g} in the model",
        )


def _provenance(states: ReceiverStates, labels: Sequence[str | None], kind: str) -> str:
    files = ", ".join(str(s.get("path", "")) for s in states.sources) or "a recording"
    known = [label for label in labels if label is not None]
    where = f", {', '.join(known)}" if known else ""
    pooled = not known and states.pooling_rejected
    warned = "; pooled although the environments differ" if pooled else ""
    return f"{kind} of {files}{where}, x = {states.threshold_m:g} m{warned}"
