"""The one figure of an event or gate that an analysis is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.plan import tree_of
from sbas.dependability.exact.state_space import MAX_STATES
from sbas.dependability.tree.model import House, HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError

Measure = Literal["mean", "at_end", "at_least_once", "occurrences_per_h"]
"""Mean unavailability, probability at the end, first passage, occurrences an hour."""


def measured(
    model: HybridFaultTree, names: Sequence[str], measure: Measure, *, max_states: int = MAX_STATES
) -> dict[str, float]:
    """A measure of some events and gates, nothing else solved.

    Parameters
    ----------
    model : any.
    names : of events and gates, one at least.
    measure : which.
    max_states : of the largest chain.

    Returns
    -------
    By name: probability [1], or occurrences [1/h].

    Raises
    ------
    InputError, ModelError : as `solve`.
    """
    if measure not in get_args(Measure):
        raise InputError(
            "no measure of that name", where="measure", evidence=repr(measure),
            cure=f"one of {', '.join(get_args(Measure))}",
        )  # fmt: skip
    # The top is always solved: it may as well be one of those asked for.
    asked = replace(model, top=names[0])
    passage = measure == "at_least_once"
    solution = solve(asked, names=names, first_passage=passage, max_states=max_states)
    values = {}
    for name in names:
        row = solution.rows[name]
        if measure == "mean":
            values[name] = row.mean_unavailability
        elif measure == "at_end":
            values[name] = row.at_end
        elif row.at_least_once is not None:
            values[name] = row.at_least_once
        else:
            values[name] = solution.occurrences_per_h(name)
    return values


def part_below(model: HybridFaultTree, of: str | None) -> HybridFaultTree:
    """The model with an event or gate as its top, and of gates and events only those below.

    Parameters
    ----------
    model : any.
    of : event or gate; None is the model's top.

    Raises
    ------
    InputError : no event or gate of that name.
    ModelError : the model means nothing.
    """
    check_model(model)
    top = model.top if of is None else of
    tree = tree_of(model)
    if top not in {thing.name for thing in (*model.events, *model.gates)}:
        raise InputError("no event or gate of that name", where="of", evidence=repr(top))
    gates = {gate.name for gate in tree.below(top)}
    read = {top}.union(*(tree.gates[name].inputs for name in gates))
    return replace(
        model,
        top=top,
        gates=tuple(gate for gate in model.gates if gate.name in gates),
        events=tuple(event for event in model.events if event.name in read),
        cases=tuple(name for name in model.cases if name in gates | read),
    )


def with_house(model: HybridFaultTree, event: str, value: bool) -> HybridFaultTree:
    """The model with an event that is true, or false, at all epochs."""
    events = tuple(House(e.name, value) if e.name == event else e for e in model.events)
    return replace(model, events=events)
