"""The exact solution of a hybrid fault tree: every measure of every event and gate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.class_courses import ClassCourse, combined
from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.leaf_courses import Work, solve_leaves
from sbas.dependability.exact.long_missions import LONG_EPOCHS, long_rows
from sbas.dependability.exact.modules import MOST_OFTEN_TRUE, Course, any_passage, at_least
from sbas.dependability.exact.plan import Part, negated, split, tree_of
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.size_estimate import check_passage
from sbas.dependability.exact.solution import Solution, SolutionRow
from sbas.dependability.exact.state_space import MAX_STATES
from sbas.dependability.exact.transient import first_passage as passage_of
from sbas.dependability.exact.transitions import Floats
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError, SbasError

_ROUNDING = 1e-9
_MOST_VALUES = 200_000_000
"""Of probability at epochs, over all rows: 1.6 GB."""


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
    names : of the events and gates to solve; None is all of them, none is the top alone.
    max_states : largest chain that may be built.

    Returns
    -------
    Solution with a row for each name.

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
    1e-12 at N = 3600, at any magnitude. "Method" of a row says which way it took. Missions of
    more than a million epochs are summed by doubling (`long_missions`), unless curves are asked
    for or a source has stages.
    """
    try:
        return _solved(
            model, first_passage=first_passage, curve=curve, names=names, max_states=max_states
        )
    except RecursionError as error:
        raise InputError(
            "gates are nested too deeply for this solver",
            where="gates",
            evidence=f"{len(model.gates)} gates",
            cure="join gates of one kind; a static tree of any depth is solved from Open-PSA",
        ) from error


def _solved(
    model: HybridFaultTree,
    *,
    first_passage: bool,
    curve: bool,
    names: Iterable[str] | None,
    max_states: int,
) -> Solution:
    findings = check_model(model)
    known = [thing.name for kind in (model.events, model.gates) for thing in kind]
    wanted = known if names is None else list(dict.fromkeys(names)) or [model.top]
    unknown = sorted(set(wanted) - set(known))
    if unknown:
        raise InputError(
            "no event or gate of that name", where="names", evidence=", ".join(unknown)
        )
    work = Work(model, tree_of(model), max_states)
    staged = any(source.stages for source in model.sources)
    if model.epochs > LONG_EPOCHS and not curve and not staged:
        return Solution(model, long_rows(work, wanted, passages=first_passage), {}, {}, findings)
    if (values := model.epochs * (2 * len(wanted) + 1)) > _MOST_VALUES:
        raise InputError(
            "the mission has too many epochs to keep what happens at each",
            where="time.mission_s",
            evidence=f"{model.epochs} epochs, {len(wanted)} rows: {values:.3g} values",
            cure="curve=False, fewer names, a longer step_s or a shorter mission_s",
        )
    plans = {name: split(name, work.tree) for name in wanted}
    solve_leaves(work, [leaf for part in plans.values() for leaf in part.leaves()])
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


def _course(work: Work, part: Part) -> Course:
    if part.blocks:
        return _classes(work, part).course()
    if not part.parts:
        course = work.leaves[part.name,].course
        assert isinstance(course, Course)
        return course
    courses = [_course(work, inner) for inner in part.parts]
    if len(courses) > 1 and any(_nearly_always(course.on) for course in courses):
        # 1 - p would lose digits of the rise; with false as a class of its own it does not arise.
        return _classes(work, part).course()
    return at_least(part.k, courses)


def _classes(work: Work, part: Part) -> ClassCourse:
    """False and true as two classes, by sums of products alone."""
    if part.parts:
        counts = np.indices([2] * len(part.parts)).sum(axis=0)
        return combined(counts >= part.k, [_classes(work, inner) for inner in part.parts])
    blocks = part.blocks or ((negated(part.name, work.tree), part.name),)
    solve_leaves(work, blocks)
    courses = [work.leaves[block].course for block in blocks]
    table = np.array([False, True]) if part.table is None else part.table
    return combined(table, [course for course in courses if isinstance(course, ClassCourse)])


def _nearly_always(on: Floats) -> bool:
    return bool(np.any((on > MOST_OFTEN_TRUE) & (on < 1.0)))


def _passage(work: Work, part: Part) -> Floats:
    """First passage by each epoch: of an OR from its parts, else by the joint chain."""
    if part.parts and part.k == 1:
        return any_passage([_passage(work, inner) for inner in part.parts])
    if part.name not in work.passages:
        if part.parts or part.blocks:
            check_passage(part, work.tree, work.chain, max_states=work.max_states)
        support = work.tree.supports[part.name]
        memory = gate_memory(work.tree.below(part.name), work.model)
        chain = product_chain(
            work.chain(support), memory, max_states=work.max_states, absorbing=part.name
        ).chain
        into: NDArray[np.bool_] = chain.truth[part.name]
        work.passages[part.name] = passage_of(chain, into)
    return work.passages[part.name]


def _row(work: Work, part: Part, course: Course, passage: Floats | None) -> SolutionRow:
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
    leaves = [work.leaves[leaf] for leaf in part.leaves()]
    whole = work.leaves.get((part.name,))
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


def _mean(work: Work, course: Course) -> float:
    match work.model.options.mean_rule:
        case "left":
            return float(course.on[:-1].mean())
        case "trapezoid":
            return float(course.on[:-1].mean() + course.on[1:].mean()) / 2.0
        case "integral" if work.times is not None and course.inside is not None:
            return float((course.inside[:-1] @ work.times[1]).mean())
    return float(course.on[1:].mean())
