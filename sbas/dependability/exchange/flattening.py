"""What a format cannot hold, put as a basic event with its computed probability, if asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sbas.dependability.exchange.losses import (
    Format,
    Loss,
    OnLoss,
    check_on_loss,
    loss_of,
    refuse,
)
from sbas.dependability.tree.model import Failed, HybridFaultTree
from sbas.dependability.tree.model_check import check_model, supports


@dataclass(frozen=True)
class ExportPlan:
    """Which elements go into a file, and how.

    Parameters
    ----------
    flattened : probability at the end of the mission of each element written as a basic event.
    written : names of the events and gates that go into the file, flattened ones included.
    losses : what is told of it.
    """

    flattened: Mapping[str, float]
    written: frozenset[str]
    losses: tuple[Loss, ...]


def plan_export(
    model: HybridFaultTree, obstacles: Mapping[str, str], *, into: Format, on_loss: OnLoss
) -> ExportPlan:
    """Decide what becomes of the elements that a format cannot hold.

    Parameters
    ----------
    model : any hybrid fault tree.
    obstacles : construct, a key of `CAPABILITIES`, of each event or gate that cannot be held.
    into : the format.
    on_loss : "refuse", or "flatten": the uppermost of them become basic events with their
        probability at the end of the mission, and what only they use is left out.

    Returns
    -------
    ExportPlan: losses say which flattened elements share components with which others, since a
    format of independent events gets their combination wrong.

    Raises
    ------
    ModelError : an invalid model, or obstacles with on_loss="refuse"; all are named.
    """
    check_on_loss(on_loss)
    check_model(model)
    everything = frozenset(x.name for x in (*model.events, *model.gates))
    if not obstacles:
        return ExportPlan({}, everything, ())
    if on_loss == "refuse":
        refuse(
            [loss_of(name, construct, into) for name, construct in obstacles.items()],
            into,
            model=model.name,
            cure='on_loss="flatten" writes them as basic events with their probability at the '
            "end of the mission",
        )
    below = {gate.name: gate.inputs for gate in model.gates}
    written: dict[str, None] = {}
    stack = [model.top]
    while stack:
        name = stack.pop()
        if name not in written:
            written[name] = None
            if name not in obstacles:
                stack.extend(below.get(name, ()))
    chosen = [name for name in written if name in obstacles]
    points = _points(model, chosen)
    losses = [
        Loss(name, obstacles[name], "flattened", f"P = {points[name]:.17g}; {shared}")
        for name, shared in _shared(model, chosen, list(written)).items()
    ]
    losses += [
        Loss(name, obstacles.get(name, "event or gate"), "refused", "left out: no longer used")
        for name in sorted(everything - written.keys())
    ]
    return ExportPlan(points, frozenset(written), tuple(losses))


def _points(model: HybridFaultTree, names: list[str]) -> dict[str, float]:
    if not names:
        return {}
    from sbas.dependability.exact.exact import solve

    rows = solve(model, names=names, first_passage=False).rows
    return {name: rows[name].at_end for name in names}


def _shared(model: HybridFaultTree, chosen: list[str], written: list[str]) -> dict[str, str]:
    """For each flattened element, in words, what it shares with what else is written."""
    support = supports(model)
    events = {event.name for event in model.events}
    told = {}
    for name in chosen:
        others = [x for x in written if x != name and (x in chosen or x in events)]
        common = {x: support[name] & support[x] for x in others}
        common = {x: held for x, held in common.items() if held}
        if common:
            pairs = (f"{', '.join(sorted(held))} with {x}" for x, held in sorted(common.items()))
            told[name] = (
                f"it shares {'; '.join(pairs)}: taken as independent, their combination is wrong"
            )
        else:
            told[name] = "it shares no component with what else is written"
    return told


def unwatched(model: HybridFaultTree) -> list[str]:
    """Components that no event watches and no source is guarded by."""
    watched = {event.component for event in model.events if isinstance(event, Failed)}
    watched |= {name for source in model.sources for name in source.guard}
    return [c.name for c in model.components if c.name not in watched]
