"""Hardware and Markov sources on the epoch grid, and the chain that some of them form together."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.state_space import (
    Columns,
    Ints,
    check_bound,
    reachable,
    repeat_rows,
)
from sbas.dependability.tree.durations import whole_epochs
from sbas.dependability.tree.model import (
    Component,
    Failed,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Undeveloped,
)
from sbas.dependability.tree.stochastic_rows import Rows, normalised_rows
from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Truth = Mapping[str, NDArray[np.bool_]]

_GRID = 20_000
"""Combinations up to which it costs nothing to look at those that are not reached."""


@dataclass(frozen=True)
class Chain:
    """A finite Markov chain on the epoch grid, with what is true in each state.

    Parameters
    ----------
    start : (S,) law at epoch 0.
    indptr, targets : compressed rows of moves with a probability above 0.
    values : for each stage, (moves,) probabilities.
    ends : for each stage, the epoch at which it ends; the last is N.
    truth : by name of event or gate, (S,) truth.
    """

    start: Floats
    indptr: Ints
    targets: Ints
    values: tuple[Floats, ...]
    ends: tuple[int, ...]
    truth: Truth

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.start)


# --- one component, one source ----------------------------------------------------------------


def hardware_step(component: Component, seconds: float) -> tuple[float, float]:
    """Probabilities to be failed, or up, after some time with the other at its begin.

    Parameters
    ----------
    component : rates alpha and mu [1/h].
    seconds : time [s].

    Returns
    -------
    P(up -> failed), P(failed -> up): alpha/s (1 - exp(-s t)), mu/s (1 - exp(-s t)),
    s = alpha + mu.

    References
    ----------
    Two-state Markov process; IEC 61165, annex B.
    """
    alpha, mu = float(component.failure_rate_per_h), float(component.repair_rate_per_h)
    s = alpha + mu
    if s == 0.0:
        return 0.0, 0.0
    moved = -math.expm1(-s * seconds / 3600.0)
    return alpha / s * moved, mu / s * moved


def stationary_law(rows: Rows) -> Floats:
    """Law that the rows leave as it is.

    Parameters
    ----------
    rows : (s, s) probabilities, one closed class of states.

    Returns
    -------
    (s,) law; every entry keeps its digits, also the small ones.

    Raises
    ------
    InputError : more than one stationary law.

    References
    ----------
    Grassmann, Taksar, Heyman 1985: elimination without subtractions.
    """
    from scipy.sparse.csgraph import connected_components

    p = np.array(rows, dtype=float)
    count, label = connected_components(p > 0.0, directed=True, connection="strong")
    left = np.unique(label[((p > 0.0) & (label[:, None] != label[None, :])).any(axis=1)])
    closed = np.setdiff1d(np.arange(count), left)
    if len(closed) != 1:
        raise InputError(
            "a source with more than one stationary law",
            where="restart",
            evidence=f"{len(closed)} classes of states that are never left",
            cure='restart = "first", "row1" or a law',
        )
    inside = np.flatnonzero(label == closed[0])
    p = p[np.ix_(inside, inside)]
    for k in range(len(inside) - 1, 0, -1):
        p[:k, k] /= p[k, :k].sum()
        p[:k, :k] += np.outer(p[:k, k], p[k, :k])
    weight = np.ones(len(inside))
    for k in range(1, len(inside)):
        weight[k] = weight[:k] @ p[:k, k]
    law = np.zeros(len(rows))
    law[inside] = weight / weight.sum()
    return law


def restart_law(source: MarkovSource, rows: Rows) -> Floats:
    """Law of the state after the first-fix wait, by the rows of the stage it falls in.

    Returns
    -------
    (s,) probabilities.
    """
    if source.restart == "stationary":
        return stationary_law(rows)
    if source.restart == "row1":
        return np.array(rows[0], dtype=float)
    if source.restart == "first":
        return np.array([1.0, *([0.0] * (len(source.states) - 1))])
    return np.array(normalised_rows((source.restart,))[0], dtype=float)


@dataclass(frozen=True)
class _Unit:
    """Something that moves: its phases and, by (phase, guard), its moves in each stage."""

    name: str
    guard: tuple[str, ...]
    phases: int
    initial: tuple[Floats, Floats]  # guard false, guard true
    indptr: Ints  # by 2 phase + guard
    targets: Ints
    values: tuple[Floats, ...]
    ends: tuple[int, ...]


def _unit(
    name: str,
    moves: list[list[Floats]],
    initial: tuple[Floats, Floats],
    *,
    guard: tuple[str, ...] = (),
    ends: tuple[int, ...],
) -> _Unit:
    """From dense laws, by stage and by 2 phase + guard."""
    table = np.array(moves)
    some = (table > 0.0).any(axis=0)
    key, target = np.nonzero(some)
    return _Unit(
        name,
        guard,
        table.shape[2],
        initial,
        np.concatenate([[0], np.cumsum(some.sum(axis=1))]).astype(np.int64),
        target.astype(np.int64),
        tuple(stage[key, target] for stage in table),
        ends,
    )


def _hardware(component: Component, model: HybridFaultTree) -> _Unit:
    fail, repair = hardware_step(component, model.step_s)
    up, down = np.array([1.0 - fail, fail]), np.array([repair, 1.0 - repair])
    initial = np.array([1.0 - component.initially_failed, component.initially_failed])
    return _unit(component.name, [[up, up, down, down]], (initial, initial), ends=(model.epochs,))


def _drawn_once(event: Undeveloped, model: HybridFaultTree) -> _Unit:
    off, on = np.eye(2)
    initial = np.array([1.0 - event.probability, event.probability])
    return _unit(event.name, [[off, off, on, on]], (initial, initial), ends=(model.epochs,))


def source_phases(source: MarkovSource, step_s: float) -> tuple[str, ...]:
    """Name of the state in each phase: the states, `down`, then one phase an epoch of wait."""
    wait = whole_epochs(source.first_fix_s, step_s) or 0
    waiting = source.down if source.waiting is None else source.waiting
    return (*source.states, source.down, *([waiting] * wait))


def _source(source: MarkovSource, model: HybridFaultTree) -> _Unit:
    states = len(source.states)
    phases = len(source_phases(source, model.step_s))
    basis = np.eye(phases)
    down = basis[states]
    stages, ends = _stages(source, model)
    by_stage = []
    for rows in stages:
        known = np.zeros((states, phases))
        known[:, :states] = rows
        restart = np.zeros(phases)
        restart[:states] = restart_law(source, rows) if source.guard else 0.0
        table = []
        for phase in range(phases):
            if phase < states:
                law = known[phase]
            else:
                law = basis[phase + 1] if phase + 1 < phases else restart
            table += [down, law]
        by_stage.append(table)
    initial = np.zeros(phases)
    initial[:states] = normalised_rows((tuple(source.initial),))[0]
    return _unit(source.name, by_stage, (down, initial), guard=source.guard, ends=ends)


def _stages(source: MarkovSource, model: HybridFaultTree) -> tuple[list[Rows], tuple[int, ...]]:
    """Rows of each stage within the mission, and the epochs at which they end."""
    if not source.stages:
        return [normalised_rows(source.rows)], (model.epochs,)
    stages, ends, end = [], [], 0
    for stage in source.stages:
        if end >= model.epochs:
            break
        end += whole_epochs(stage.seconds, model.step_s) or 0
        stages.append(normalised_rows(stage.rows))
        ends.append(min(end, model.epochs))
    return stages, (*ends[:-1], model.epochs)


# --- together ---------------------------------------------------------------------------------


def trimmed(chain: Chain) -> Chain:
    """The states of a chain that its law at epoch 0 leads to."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    begin = np.flatnonzero(chain.start > 0.0)
    # One more state leads to all that the law may begin in.
    indptr = np.append(chain.indptr, chain.indptr[-1] + len(begin))
    moves = np.concatenate([chain.targets, begin])
    size = chain.size + 1
    graph = csr_array((np.ones(len(moves), dtype=np.int8), moves, indptr), shape=(size, size))
    order = breadth_first_order(graph, chain.size, return_predecessors=False)
    kept = np.sort(order[order < chain.size])
    if len(kept) == chain.size:
        return chain
    number = np.zeros(chain.size, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    counts = np.diff(chain.indptr)[kept]
    _, entry = repeat_rows(counts, chain.indptr[kept])
    return Chain(
        chain.start[kept],
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        number[chain.targets[entry]],
        tuple(values[entry] for values in chain.values),
        chain.ends,
        {name: true[kept] for name, true in chain.truth.items()},
    )


def held_key(event: str) -> str:
    """Name, in `Chain.truth`, of "a CON on this event skips the epoch"."""
    return f"{event} (skipped)"


def component_chain(model: HybridFaultTree, support: Collection[str], *, max_states: int) -> Chain:
    """The chain of some components, sources and events drawn once, with the events that they set.

    Parameters
    ----------
    model : checked.
    support : names; with a source, its guards too (as `model_check.supports` gives them).
    max_states : largest number of states.

    Raises
    ------
    InputError : more than `max_states` states.

    Notes
    -----
    Hardware moves first, then a source by the new state of its guards. A stage of a source holds
    for the moves into the epochs up to its end.
    """
    units = [_hardware(c, model) for c in model.components if c.name in support]
    units += [
        _drawn_once(e, model)
        for e in model.events
        if isinstance(e, Undeveloped) and e.name in support
    ]
    units += [_source(s, model) for s in model.sources if s.name in support]
    ends = tuple(sorted({end for unit in units for end in unit.ends} | {model.epochs}))
    stage_of = [[int(np.searchsorted(u.ends, end)) for u in units] for end in ends]
    place = {unit.name: i for i, unit in enumerate(units)}

    def guarded(unit: _Unit, columns: Columns, count: int) -> Ints:
        works = np.ones(count, dtype=np.int64)
        for name in unit.guard:
            works &= columns[place[name]] == 0
        return works

    def expand(layer: Columns, _first: bool) -> tuple[Ints, Columns, list[NDArray[np.generic]]]:
        origin = np.arange(len(layer[0]))
        moved: Columns = []
        values = [np.ones(len(origin)) for _ in ends]
        for u, unit in enumerate(units):
            key = 2 * layer[u][origin] + guarded(unit, moved, len(origin))
            begin = unit.indptr[key]
            row, entry = repeat_rows(unit.indptr[key + 1] - begin, begin)
            origin, moved = origin[row], [column[row] for column in moved]
            moved.append(unit.targets[entry])
            values = [
                v[row] * unit.values[stage[u]][entry]
                for v, stage in zip(values, stage_of, strict=True)
            ]
        return origin, moved, list(values)

    first: Columns = []
    law = np.ones(1)
    for unit in units:
        works = guarded(unit, first, len(law))
        begins = np.where(works[:, None] == 1, unit.initial[1], unit.initial[0])
        row, phase = np.nonzero(begins > 0.0)
        law = law[row] * begins[row, phase]
        first = [*(column[row] for column in first), phase]
    if not units:
        return _constant(model)
    growth = f"components and sources {', '.join(place)}"
    check_bound([2] * sum(u.phases == 2 for u in units), max_states=max_states, growth=growth)
    sizes = [unit.phases for unit in units]
    everything = math.prod(sizes) <= _GRID
    if everything:
        # All combinations at once and what is not reached taken away again: layer by layer, the
        # phases of a wait would come one at a time.
        grid = np.indices(sizes).reshape(len(sizes), -1)
        seeds = [np.concatenate([a, b]) for a, b in zip(first, grid, strict=True)]
        code = np.ravel_multi_index(seeds, sizes)
        _, at = np.unique(code, return_index=True)
        seeds = [column[np.sort(at)] for column in seeds]
    else:
        seeds = first
    space = reachable(
        seeds, sizes, expand, depth=model.epochs, max_states=max_states, growth=growth
    )
    start = np.zeros(len(space.columns[0]))
    start[: len(law)] = law
    chain = Chain(
        start,
        space.indptr,
        space.targets,
        tuple(np.asarray(v, dtype=float) for v in space.payload),
        ends,
        _event_truth(model, place, space.columns),
    )
    return trimmed(chain) if everything else chain


def _constant(model: HybridFaultTree) -> Chain:
    """One state for ever: what depends on nothing."""
    one, none = np.ones(1), np.zeros(1, dtype=np.int64)
    truth = _event_truth(model, {}, [none])
    return Chain(one, np.array([0, 1]), none, (one,), (model.epochs,), truth)


def _event_truth(
    model: HybridFaultTree, place: Mapping[str, int], columns: Columns
) -> dict[str, NDArray[np.bool_]]:
    sources = {s.name: s for s in model.sources}
    skipped = model.options.hold_states if model.options.con_gap == "hold" else ()
    count = len(columns[0])
    truth: dict[str, NDArray[np.bool_]] = {}
    for event in model.events:
        match event:
            case Failed() if event.component in place:
                truth[event.name] = columns[place[event.component]] == 1
            case InState() if event.source in place:
                phases = np.array(source_phases(sources[event.source], model.step_s))
                column = columns[place[event.source]]
                truth[event.name] = np.isin(phases, event.states)[column]
                truth[held_key(event.name)] = np.isin(phases, skipped)[column]
            case House():
                truth[event.name] = np.full(count, event.value)
            case Undeveloped() if event.name in place:
                truth[event.name] = columns[place[event.name]] == 1
            case Undeveloped() if event.probability == 0.0:
                truth[event.name] = np.zeros(count, dtype=bool)
            case _:
                pass
    return truth
