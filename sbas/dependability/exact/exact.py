"""The exact solution of a hybrid fault tree: every measure of every event and gate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.gate_memory import GateMemory, gate_memory, run_epochs
from sbas.dependability.exact.modules import MOST_OFTEN_TRUE, Course, any_passage, at_least
from sbas.dependability.exact.plan import Part, Tree, split, tree_of
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.solution import Solution, SolutionRow
from sbas.dependability.exact.state_space import MAX_STATES
from sbas.dependability.exact.transient import check_mass, expectations, first_passage, matrix_of
from sbas.dependability.exact.transitions import Chain, Floats, component_chain
from sbas.dependability.exact.windows import LookBack, Run, last_runs, look_back
from sbas.dependability.exact.within_epoch import hardware_within, instants
from sbas.dependability.tree.model import CausalAnd, Con, Dur, Gate, HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError, SbasError

_ROUNDING = 1e-9
_MOST_VALUES = 200_000_000
"""Of probability at epochs, over all rows: 1.6 GB."""
_RunGate = Con | Dur | CausalAnd


def solve(
    model: HybridFaultTree,
    *,
    first_passage: bool = False,
    curve: bool = False,
    names: Iterable[str] | None = None,
    max_states: int = MAX_STATES,
) -> Solution:
    """Solve a hybrid fault tree exactly.

    Parameters
    ----------
    model : any.
    first_passage : also the probability of "at least once in the mission" (a pass for each row).
    curve : also probabilities at every epoch.
    names : of the events and gates to solve; None is all of them.
    max_states : largest chain that may be built.

    Returns
    -------
    Solution with a row for each name, the top's among them.

    Raises
    ------
    ModelError : the model means nothing.
    InputError : an unknown name; a chain of more than `max_states` states; more than 2e8 values
        over epochs and rows.
    SbasError : a measure contradicts another beyond rounding.

    Notes
    -----
    Components, sources and gate memories form a finite Markov chain on the epoch grid: gates do
    not act back. Parts that share nothing are solved alone and put together at every epoch.
    Gates of bounded memory are evaluated from the law so many epochs back; a PAND is carried.
    Only sums and products of numbers that are not negative: relative errors stay below about
    1e-12 at N = 3600, at any magnitude. "Method" of a row says which way it took.
    """
    findings = check_model(model)
    known = [thing.name for kind in (model.events, model.gates) for thing in kind]
    wanted = known if names is None else list(dict.fromkeys([*names, model.top]))
    unknown = sorted(set(wanted) - set(known))
    if unknown:
        raise InputError(
            "no event or gate of that name", where="names", evidence=", ".join(unknown)
        )
    if (values := model.epochs * (2 * len(wanted) + 1)) > _MOST_VALUES:
        raise InputError(
            "the mission has too many epochs to keep what happens at each",
            where="time.mission_s",
            evidence=f"{model.epochs} epochs, {len(wanted)} rows: {values:.3g} values",
            cure="fewer names, a longer step_s or a shorter mission_s",
        )
    work = _Work(model, tree_of(model), max_states)
    plans = {name: split(name, work.tree) for name in wanted}
    _solve_leaves(work, [leaf for part in plans.values() for leaf in part.leaves()])
    courses = {name: _course(work, part) for name, part in plans.items()}
    passages = {n: _passage(work, p) for n, p in plans.items()} if first_passage else {}
    rows = {
        name: _row(work, part, courses[name], passages.get(name)) for name, part in plans.items()
    }
    return Solution(
        model,
        rows,
        {name: course.on for name, course in courses.items()} if curve else {},
        passages if curve else {},
        findings,
    )


@dataclass
class _Leaf:
    course: Course
    method: str
    states: int


@dataclass
class _Work:
    """What has been built on the way."""

    model: HybridFaultTree
    tree: Tree
    max_states: int
    chains: dict[frozenset[str], Chain] = field(default_factory=dict)
    leaves: dict[str, _Leaf] = field(default_factory=dict)
    passages: dict[str, Floats] = field(default_factory=dict)
    times: tuple[Floats, Floats] | None = None

    def __post_init__(self) -> None:
        if self.model.options.mean_rule == "integral":
            self.times = instants(self.model)

    def chain(self, support: frozenset[str]) -> Chain:
        if support not in self.chains:
            self.chains[support] = component_chain(self.model, support, max_states=self.max_states)
        return self.chains[support]


# --- courses of what is not taken apart -------------------------------------------------------


def _solve_leaves(work: _Work, names: Sequence[str]) -> None:
    """Fill `work.leaves`; leaves with the same support share one pass over the mission."""
    groups: dict[frozenset[str], dict[str, frozenset[str]]] = {}
    for name in dict.fromkeys(names):
        if name not in work.leaves:
            group = groups.setdefault(work.tree.supports[name], {})
            group[name] = work.tree.unforgetting(name)
    for support, carried in groups.items():
        # Who carries less rides with one that carries all of it too, rather than alone.
        kinds: list[frozenset[str]] = []
        for kind in sorted(set(carried.values()), key=len, reverse=True):
            if not any(kind <= other for other in kinds):
                kinds.append(kind)
        together: dict[frozenset[str], list[str]] = {kind: [] for kind in kinds}
        for name, kind in carried.items():
            together[next(k for k in kinds if kind <= k)].append(name)
        for kind, members in together.items():
            chain = work.chain(support)
            if kind:
                gates = [g for g in _below_all(work.tree, kind) if g.name in kind]
                memory = gate_memory(gates, work.model)
                chain = product_chain(
                    chain, memory, max_states=work.max_states, from_every_state=True, trim=True
                ).chain
            if len(chain.values) == 1:
                _by_look_back(work, chain, members)
            else:
                for name in members:
                    work.leaves[name] = _over_the_mission(work, chain, name)


def _below_all(tree: Tree, names: Iterable[str]) -> list[Gate]:
    found = {gate.name: gate for name in sorted(set(names)) for gate in tree.below(name)}
    return list(found.values())


def _rest(work: _Work, chain: Chain, names: Iterable[str]) -> GateMemory:
    """Memory of what is below and not known in the states of the chain."""
    gates = _below_all(work.tree, names)
    return gate_memory(gates, work.model, without=frozenset(chain.truth))


def _columns(work: _Work, chain: Chain, name: str) -> Floats:
    """(S, 1 or 1 + Q): true at the epoch; true at instants after it."""
    on = chain.truth[name].astype(float)[:, None]
    if work.times is None:
        return on
    return np.hstack([on, hardware_within(work.tree, name, chain.truth, work.times[0])])


def _with_truth(chain: Chain, memory: GateMemory) -> Chain:
    """The chain with gates that need no memory."""
    return replace(chain, truth=memory.step([], chain.truth)[1])


def _by_look_back(work: _Work, chain: Chain, names: Sequence[str]) -> None:
    """All by one pass of the chain, each from its own number of epochs back."""
    found: list[tuple[str, str, int, LookBack]] = []
    for name in names:
        memory = _rest(work, chain, [name])
        lag = work.tree.horizon(name, chain.truth)
        if not memory.sizes:
            here = _with_truth(chain, memory)
            true = here.truth[name]
            rise = np.where(true, 0.0, matrix_of(chain) @ true.astype(float))
            columns = _columns(work, here, name)
            back = LookBack(0, columns, rise, columns[:0], rise[:0])
            found.append((name, "chain", chain.size, back))
        elif runs := _plain_runs(work, chain, memory):
            found.append((name, "window", chain.size, _by_windows(work, chain, name, runs)))
        elif 2 * lag < work.model.epochs:
            product = product_chain(
                chain, memory, max_states=work.max_states, from_every_state=True
            )
            here = product.chain
            back = look_back(
                product, chain.start, here.truth[name], _columns(work, here, name), lag
            )
            found.append((name, "look-back", here.size, back))
        else:
            work.leaves[name] = _over_the_mission(work, chain, name)
    if not found:
        return
    parts = [part for *_, back in found for part in (back.on, back.rise[:, None])]
    mass = np.ones((chain.size, 1))
    values = expectations(chain.start, [matrix_of(chain)], chain.ends, [np.hstack([*parts, mass])])
    check_mass(float(values[-1, -1]))
    at = 0
    for name, method, states, back in found:
        width = back.on.shape[1]
        on, rise = values[:, at : at + width], values[:, at + width]
        at += width + 1
        work.leaves[name] = _Leaf(_late(work, back, on, rise), method, states)


def _plain_runs(work: _Work, chain: Chain, memory: GateMemory) -> list[_RunGate]:
    """The gates that count, longest run first; none if one of them counts what another says."""
    runs = [gate for gate in memory.gates if isinstance(gate, _RunGate)]
    runs.sort(key=lambda gate: -run_epochs(gate, work.model))
    nested = _rest(work, chain, [n for gate in runs for n in gate.inputs]).sizes
    too_many = chain.size * 3 ** len(runs) > work.max_states
    return [] if nested or too_many else runs


def _by_windows(work: _Work, chain: Chain, name: str, gates: Sequence[_RunGate]) -> LookBack:
    """A boolean function of runs: `last_runs`."""
    counting = frozenset(gate.name for gate in gates)
    lower = _rest(work, chain, [n for gate in gates for n in gate.inputs])
    truth = _with_truth(chain, lower).truth
    upper = gate_memory(work.tree.below(name), work.model, without=frozenset(truth) | counting)
    runs = [
        Run(
            np.logical_and.reduce([truth[n] for n in gate.inputs]),
            run_epochs(gate, work.model),
        )
        for gate in gates
    ]

    def read(on: Sequence[NDArray[np.bool_]]) -> Floats:
        known = dict(truth)
        known.update({gate.name: true for gate, true in zip(gates, on, strict=True)})
        return _columns(work, replace(chain, truth=upper.step([], known)[1]), name)

    return last_runs(chain, runs, read)


def _late(work: _Work, back: LookBack, on: Floats, rise: Floats) -> Course:
    """Values at n from those at the epoch that they look back to."""
    epochs = work.model.epochs
    on = np.concatenate([back.early_on, on])[: epochs + 1]
    rise = np.concatenate([[0.0], back.early_rise, rise])[: epochs + 1]
    return Course(on[:, 0], rise, None if work.times is None else on[:, 1:])


def _over_the_mission(work: _Work, chain: Chain, name: str) -> _Leaf:
    """With the whole memory carried from epoch 0 on."""
    memory = _rest(work, chain, [name])
    if memory.sizes:
        here = product_chain(chain, memory, max_states=work.max_states).chain
    else:
        here = _with_truth(chain, memory)
    true = here.truth[name]
    steady = np.hstack([_columns(work, here, name), np.ones((here.size, 1))])
    matrices = [matrix_of(here, stage) for stage in range(len(here.values))]
    rises = [np.where(true, 0.0, matrix @ true.astype(float))[:, None] for matrix in matrices]
    values = expectations(
        here.start, matrices, here.ends, [np.hstack([steady, rise]) for rise in rises]
    )
    check_mass(float(values[-1, -2]))
    course = Course(
        values[:, 0],
        np.concatenate([[0.0], values[:-1, -1]]),
        None if work.times is None else values[:, 1:-2],
    )
    return _Leaf(course, "product" if memory.sizes else "chain", here.size)


# --- put together -----------------------------------------------------------------------------


def _course(work: _Work, part: Part) -> Course:
    if not part.parts:
        return work.leaves[part.name].course
    courses = [_course(work, inner) for inner in part.parts]
    if len(courses) > 1 and any(_nearly_always(course.on) for course in courses):
        # 1 - p would lose digits of the rise; solved whole it does not arise.
        if part.name not in work.leaves:
            _solve_leaves(work, [part.name])
        return work.leaves[part.name].course
    return at_least(part.k, courses)


def _nearly_always(on: Floats) -> bool:
    return bool(np.any((on > MOST_OFTEN_TRUE) & (on < 1.0)))


def _passage(work: _Work, part: Part) -> Floats:
    """First passage by each epoch: of an OR from its parts, else by the joint chain."""
    if part.parts and part.k == 1:
        return any_passage([_passage(work, inner) for inner in part.parts])
    if part.name not in work.passages:
        support = work.tree.supports[part.name]
        memory = gate_memory(work.tree.below(part.name), work.model)
        chain = product_chain(
            work.chain(support), memory, max_states=work.max_states, absorbing=part.name
        ).chain
        into: NDArray[np.bool_] = chain.truth[part.name]
        work.passages[part.name] = first_passage(chain, into)
    return work.passages[part.name]


def _row(work: _Work, part: Part, course: Course, passage: Floats | None) -> SolutionRow:
    on, model = course.on, work.model
    mean = _mean(work, course)
    occurrences = float(course.rise.sum())
    once = None if passage is None else float(passage[-1])
    if once is not None:
        bounds = float(on[1:].max()), occurrences + float(on[0])
        if not bounds[0] * (1 - _ROUNDING) <= once <= bounds[1] * (1 + _ROUNDING):
            raise SbasError(
                "measures contradict each other",
                where=part.name,
                evidence=f"largest probability at an epoch {bounds[0]!r}, at least once "
                f"{once!r}, occurrences and start {bounds[1]!r}",
                cure="report this model",
            )
    leaves = [work.leaves[name] for name in part.leaves()]
    whole = work.leaves.get(part.name)
    return SolutionRow(
        name=part.name,
        mean_unavailability=mean,
        at_start=float(on[0]),
        at_end=float(on[-1]),
        at_least_once=once,
        occurrences=occurrences,
        mean_duration_s=mean * model.mission_s / occurrences if occurrences > 0.0 else None,
        method="modules" if whole is None else whole.method,
        states=max(leaf.states for leaf in ([whole] if whole else leaves)),
    )


def _mean(work: _Work, course: Course) -> float:
    match work.model.options.mean_rule:
        case "left":
            return float(course.on[:-1].mean())
        case "trapezoid":
            return float(course.on[:-1].mean() + course.on[1:].mean()) / 2.0
        case "integral" if work.times is not None and course.inside is not None:
            return float((course.inside[:-1] @ work.times[1]).mean())
    return float(course.on[1:].mean())
