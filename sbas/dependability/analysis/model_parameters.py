"""The continuous parameters of a model by name, and the model with other values of them.

`<component>.failure_rate_per_h`, `.repair_rate_per_h`, `.initially_failed`; `<undeveloped
event>.probability`; rows of a source as `<source>.rows`, of its stages `<source>.<label>.rows`
(numbered where stages of one label differ). Delays and counts are whole epochs: no parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sbas.dependability.tree.model import (
    Component,
    HybridFaultTree,
    MarkovSource,
    Stage,
    Undeveloped,
)
from sbas.dependability.tree.stochastic_rows import Rows
from sbas.exceptions import InputError
from sbas.integrity.allocation_tree import nearest

_OF_COMPONENTS = ("failure_rate_per_h", "repair_rate_per_h", "initially_failed")


def scalar_parameters(model: HybridFaultTree) -> dict[str, float]:
    """Rates [1/h] and probabilities [1] by name."""
    found = {
        f"{component.name}.{key}": float(getattr(component, key))
        for component in model.components
        for key in _OF_COMPONENTS
    }
    for event in model.events:
        if isinstance(event, Undeveloped):
            found[f"{event.name}.probability"] = float(event.probability)
    return found


def row_parameters(model: HybridFaultTree) -> dict[str, tuple[MarkovSource, Rows]]:
    """Transition rows by name, with the source that moves by them."""
    found: dict[str, tuple[MarkovSource, Rows]] = {}
    for source in model.sources:
        if source.stages:
            found |= {_stage_key(source, i): (source, s.rows) for i, s in enumerate(source.stages)}
        else:
            found[f"{source.name}.rows"] = source, source.rows
    return found


def _stage_key(source: MarkovSource, index: int) -> str:
    label = source.stages[index].label
    rows = {stage.rows for stage in source.stages if stage.label == label}
    return f"{source.name}.{label}{f'[{index}]' if len(rows) > 1 else ''}.rows"


def with_parameters(
    model: HybridFaultTree,
    scalars: Mapping[str, float],
    rows: Mapping[str, Rows] | None = None,
) -> HybridFaultTree:
    """The model with other values of some parameters.

    Parameters
    ----------
    model : any.
    scalars : rates [1/h] and probabilities [1] by name, as in `scalar_parameters`.
    rows : (s, s) transition probabilities by name, as in `row_parameters`.

    Raises
    ------
    InputError : an unknown name.
    """
    given = rows or {}
    known = {**scalar_parameters(model), **row_parameters(model)}
    for name in (*scalars, *given):
        check_known(name, known)
    components = tuple(_with_figures(c, scalars) for c in model.components)
    events = tuple(
        replace(e, probability=scalars.get(f"{e.name}.probability", e.probability))
        if isinstance(e, Undeveloped)
        else e
        for e in model.events
    )
    sources = tuple(_with_rows(source, given) for source in model.sources)
    return replace(model, components=components, events=events, sources=sources)


def _with_figures(component: Component, scalars: Mapping[str, float]) -> Component:
    def given(key: str) -> float:
        return float(scalars.get(f"{component.name}.{key}", getattr(component, key)))

    failure, repair, initially = (given(key) for key in _OF_COMPONENTS)
    return Component(component.name, failure, repair, initially, component.source)


def _with_rows(source: MarkovSource, rows: Mapping[str, Rows]) -> MarkovSource:
    if not source.stages:
        return replace(source, rows=rows.get(f"{source.name}.rows", source.rows))
    stages = tuple(
        Stage(stage.label, stage.seconds, rows.get(_stage_key(source, i), stage.rows))
        for i, stage in enumerate(source.stages)
    )
    return replace(source, stages=stages)


def check_known(name: str, known: Mapping[str, object]) -> None:
    """Raise InputError, with the nearest name, unless the model has such a parameter."""
    if name not in known:
        raise InputError(
            "the model has no parameter of that name",
            where=name,
            cure=nearest(name, sorted(known)),
        )
