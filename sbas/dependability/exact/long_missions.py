"""Missions of a year and the long run, without a step for each epoch.

What is summed over a mission is the law of the chain that gates look back to. Its sum over 2 m
epochs is that over m and the same sum m epochs on, and the moves of 2 m epochs are the square of
those of m: 25 squarings make a year of seconds. Every power has its rows divided by their sums,
which are 1 but for rounding; without that the rounding would double with each squaring.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.leaf_courses import Work, leaf_chains, look_backs
from sbas.dependability.exact.modules import any_passage
from sbas.dependability.exact.plan import Leaf, Part, split, tree_of
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.solution import SolutionRow
from sbas.dependability.exact.state_space import MAX_STATES
from sbas.dependability.exact.transient import matrix_of
from sbas.dependability.exact.transitions import Chain, Floats, stationary_law
from sbas.dependability.exact.windows import LookBack
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError

LONG_EPOCHS = 1_000_000
"""Beyond, doubling is quicker than a step for each epoch and needs no memory for each."""
_MOST_DENSE = 2500
"""States of a full matrix: 50 MB, and a minute for a year's squarings."""
_ROUNDING = 1e-9


def long_rows(work: Work, names: Iterable[str], *, passages: bool) -> dict[str, SolutionRow]:
    """Rows of events and gates over a mission of many epochs.

    Parameters
    ----------
    work : with the model, checked.
    names : of the events and gates; each is solved whole.
    passages : also the probability of "at least once".

    Returns
    -------
    By name; method "doubling".

    Raises
    ------
    InputError : a chain of more than 2500 states; a source with stages.
    """
    leaves = [(name,) for name in names]
    rows: dict[str, SolutionRow] = {}
    for chain, members in leaf_chains(work, leaves):
        for leaf, states, back, sums in _summed(work, chain, members):
            (name,) = leaf
            once = _once(work, split(name, work.tree)) if passages else None
            rows[name] = _row(work, name, states, back, sums, once)
    return {name: rows[name] for (name,) in leaves}


@dataclass(frozen=True)
class SteadyRow:
    """Measures of an event or gate in the long run.

    Parameters
    ----------
    name : of the event or gate.
    unavailability : share of time in which it is true [1], in the long run.
    occurrences_per_h : number of times that it becomes true [1/h], in the long run.
    mean_duration_s : of an occurrence [s]; None where there is none.
    states : of the chain.
    """

    name: str
    unavailability: float
    occurrences_per_h: float
    mean_duration_s: float | None
    states: int


def steady_state(
    model: HybridFaultTree, names: Iterable[str] | None = None, *, max_states: int = MAX_STATES
) -> dict[str, SteadyRow]:
    """Long-run measures: what a mission without end would average.

    Parameters
    ----------
    model : any; its mission does not matter.
    names : of the events and gates; None is all of them.
    max_states : largest chain that may be built.

    Returns
    -------
    By name, from the stationary law of the chain. Hardware that is never repaired is failed in
    the long run.

    Raises
    ------
    ModelError : the model means nothing.
    InputError : an unknown name; no stationary law (an event drawn once, a latched PAND that may
        never come true); a source with stages; more than 2500 states.

    References
    ----------
    Grassmann, Taksar, Heyman 1985: elimination without subtractions.
    """
    check_model(model)
    known = [thing.name for kind in (model.events, model.gates) for thing in kind]
    wanted = known if names is None else list(dict.fromkeys(names))
    if unknown := sorted(set(wanted) - set(known)):
        raise InputError(
            "no event or gate of that name", where="names", evidence=", ".join(unknown)
        )
    # States that only a long mission reaches belong to the long run.
    endless = replace(model, mission_s=1e9 * model.step_s)
    work = Work(endless, tree_of(endless), max_states)
    rows: dict[str, SteadyRow] = {}
    for chain, members in leaf_chains(work, [(name,) for name in wanted]):
        found = _found(work, chain, members)
        try:
            law = stationary_law(_dense(chain, members).tolist())
        except InputError as error:
            raise InputError(
                "no stationary law", where=", ".join(name for (name,) in members),
                evidence=error.evidence or "",
                cure="solve(model) over a mission; give the event no probability of its own",
            ) from error  # fmt: skip
        for (name,), _, states, back in found:
            share, rate = float(law @ back.on[:, 0]), float(law @ back.rise[:, 0])
            rows[name] = SteadyRow(
                name,
                min(share, 1.0),
                rate * 3600.0 / model.step_s,
                share / rate * model.step_s if rate > 0.0 else None,
                states,
            )
    return {name: rows[name] for name in wanted}


def occupation(first: Floats, moves: Floats, epochs: int) -> tuple[Floats, Floats]:
    """Expected epochs in each state of a chain, and its law at the end.

    Parameters
    ----------
    first : (S,) law at epoch 0.
    moves : (S, S) probabilities, rows from, each with sum 1.
    epochs : m, 0 or more.

    Returns
    -------
    Sum of the laws at the epochs 0..m-1; law at epoch m.

    Notes
    -----
    Only sums, products and quotients of numbers that are not negative. Bits of m from the highest
    on: the sum over 2 m epochs is that over m, and that over m moved m epochs on.
    """
    from scipy.sparse import csr_array

    columns = csr_array(moves.T)
    total, law = np.zeros(len(first)), first
    power = np.eye(len(first))
    for i, bit in enumerate(f"{epochs:b}"):
        if i:
            total = total + total @ power
            law = law @ power
            power = power @ power
        if bit == "1":
            total = total + law
            law = columns @ law
            power = (columns @ power.T).T
        power = power / power.sum(axis=1, keepdims=True)
    return total, law


# --- sums over the mission --------------------------------------------------------------------


@dataclass(frozen=True)
class _Sums:
    """Of the law of a chain against columns: at its epoch 0, summed from 1 on, and at the end."""

    start: Floats  # (K,)
    summed: Floats  # (D, K): over the epochs 1..c+i-1
    end: Floats  # (D, K): at the epochs c+i


def _found(
    work: Work, chain: Chain, members: Sequence[Leaf]
) -> list[tuple[Leaf, str, int, LookBack]]:
    if len(chain.values) > 1:
        raise InputError(
            "a source with stages has no long run", where=", ".join(n for (n,) in members),
            evidence=f"{len(chain.values)} stages", cure="solve(model) over a mission",
        )  # fmt: skip
    found = look_backs(work, chain, members)
    if len(found) < len(members):
        left = set(members) - {leaf for leaf, *_ in found}
        raise InputError(
            "a gate looks back over more than half of the mission",
            where=", ".join(n for (n,) in left), evidence=f"{work.model.epochs} epochs",
            cure="a shorter delay or a longer mission",
        )  # fmt: skip
    return found


def _dense(chain: Chain, members: Sequence[Leaf]) -> Floats:
    if chain.size > _MOST_DENSE:
        raise InputError(
            f"a long mission needs more than {_MOST_DENSE} states",
            where=", ".join(name for (name,) in members),
            evidence=f"{chain.size} states",
            cure=f"a mission of up to {LONG_EPOCHS} epochs; fewer names; a shorter first-fix "
            "wait; or simulation (simulate_model)",
        )
    return np.asarray(matrix_of(chain).toarray())


def _summed(
    work: Work, chain: Chain, members: Sequence[Leaf]
) -> list[tuple[Leaf, int, LookBack, _Sums]]:
    """Each leaf with the sums of its columns, inside the epoch already weighted, then rises."""
    found = _found(work, chain, members)
    moves = _dense(chain, members)
    moves /= moves.sum(axis=1, keepdims=True)
    longest = max(back.lag for *_, back in found)
    begin = work.model.epochs - longest - 1  # the last epochs one by one: lags differ
    total, law = occupation(chain.start @ moves, moves, begin - 1)
    laws = np.empty((longest + 2, chain.size))
    for i in range(len(laws)):
        laws[i] = law
        law = law @ moves
    result = []
    for leaf, _, states, back in found:
        columns = np.hstack([_weighted(work, back.on), back.rise])
        end = laws @ columns
        summed = total @ columns + np.concatenate([end[:1] * 0.0, np.cumsum(end, axis=0)[:-1]])
        result.append((leaf, states, back, _Sums(chain.start @ columns, summed, end)))
    return result


def _weighted(work: Work, on: Floats) -> Floats:
    """(., 2): truth at the epoch, and over the time to the next where that is asked for."""
    if work.times is None:
        return np.hstack([on, on])
    return np.column_stack([on[:, 0], on[:, 1:] @ work.times[1]])


def _row(
    work: Work, name: str, states: int, back: LookBack, sums: _Sums, once: float | None
) -> SolutionRow:
    model = work.model
    epochs, lag = model.epochs, back.lag
    begin = epochs - (len(sums.end) - 2) - 1
    early = _weighted(work, back.early_on)
    # p at n is read at n - lag: the first lag epochs from epoch 0, the one at the lag at the start.
    to_last = epochs - lag - begin  # index of the law that epoch N is read from
    at_start, at_end = (early[0] if lag else sums.start)[0], sums.end[to_last, 0]
    before = sums.summed[to_last, :2]  # n = lag + 1 .. N - 1
    middle = early[1:].sum(axis=0) + sums.start[:2] + before if lag else before  # n = 1..N-1
    match model.options.mean_rule:
        case "left":
            mean = (at_start + middle[0]) / epochs
        case "trapezoid":
            mean = (at_start / 2.0 + middle[0] + at_end / 2.0) / epochs
        case "integral":
            mean = ((early[0] if lag else sums.start)[1] + middle[1]) / epochs
        case _:
            mean = (middle[0] + at_end) / epochs
    occurrences = float(back.early_rise.sum() + sums.start[2] + sums.summed[to_last, 2])
    return SolutionRow(
        name=name,
        mean_unavailability=float(mean),
        at_start=float(at_start),
        at_end=float(at_end),
        at_least_once=once,
        occurrences=occurrences,
        mean_duration_s=float(mean) * model.mission_s / occurrences if occurrences > 0.0 else None,
        method="doubling",
        states=states,
    )


def _once(work: Work, part: Part) -> float:
    """First passage by the end: of an OR from its parts, else the mass in one state that takes
    all in."""
    if part.parts and part.k == 1:
        return float(any_passage([np.array(_once(work, inner)) for inner in part.parts]))
    name = part.name
    support = work.tree.supports[name]
    memory = gate_memory(work.tree.below(name), work.model)
    chain = product_chain(
        work.chain(support), memory, max_states=work.max_states, absorbing=name
    ).chain
    moves = _dense(chain, [(name,)])
    into = chain.truth[name]
    stay = np.flatnonzero(~into | (chain.start > 0.0))
    taken = np.zeros((len(stay) + 1, len(stay) + 1))
    taken[:-1, :-1] = np.where(into[stay], 0.0, moves[np.ix_(stay, stay)])
    taken[:-1, -1] = moves[stay][:, into].sum(axis=1)
    taken[-1, -1] = 1.0
    taken /= taken.sum(axis=1, keepdims=True)
    law = occupation(np.append(chain.start[stay], 0.0), taken, work.model.epochs)[1]
    return float(law[-1])
