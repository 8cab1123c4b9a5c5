"""Where the boxes of a fault tree stand: layer by layer, each gate above the middle of its inputs.

A gate that stands under several others is drawn in full once and as a reference elsewhere, a
basic event wherever it is an input. What would not fit is folded: its deepest layers are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

from sbas.dependability.tree.model import HybridFaultTree


@dataclass(frozen=True)
class Box:
    """A box of the drawing.

    Parameters
    ----------
    name : of the event or gate.
    column, layer : its place; columns are 0 to `columns` - 1 and may lie between, layer 0 is the
        top's.
    parent : index of the box above; None for the top.
    kind : "event", "gate", "again" (a gate drawn in full elsewhere), or "folded" (a gate whose
        inputs are not drawn).
    """

    name: str
    column: float
    layer: int
    parent: int | None
    kind: str


@dataclass(frozen=True)
class Layout:
    """All boxes, parents before their inputs; `absent` are neither drawn nor folded away."""

    boxes: tuple[Box, ...]
    columns: int
    layers: int
    absent: tuple[str, ...]


def tree_layout(model: HybridFaultTree, *, most_columns: int) -> Layout | None:
    """Places of the boxes of a model's tree.

    Parameters
    ----------
    model : sound by `check_model`.
    most_columns : boxes side by side, at most.

    Returns
    -------
    Layout of as many layers as fit; None where not even the top's own inputs do.
    """
    inputs = {gate.name: gate.inputs for gate in model.gates}
    found = {model.top}
    stack = [model.top]
    while stack:
        for below in inputs.get(stack.pop(), ()):
            if below not in found:
                found.add(below)
                stack.append(below)
    absent = tuple(thing.name for kind in (model.events, model.gates) for thing in kind
                   if thing.name not in found)  # fmt: skip
    best = None
    for layers in range(1, len(inputs) + 2):
        boxes = _boxes(model.top, inputs, layers)
        columns = sum(box.kind != "gate" for box in boxes)
        if columns > most_columns and layers > 1:
            break
        best = Layout(_placed(boxes), columns, 1 + max(box.layer for box in boxes), absent)
        if not any(box.kind == "folded" for box in boxes):
            break
    return None if best is not None and inputs.get(model.top) and best.layers == 1 else best


def _boxes(top: str, inputs: dict[str, tuple[str, ...]], deepest: int) -> list[Box]:
    """Boxes in the order of a walk from the top, left to right; gates of the layer `deepest` - 1
    and below it are folded. Each gate is drawn in full where the walk meets it first."""
    boxes: list[Box] = []
    drawn: set[str] = set()
    stack: list[tuple[str, int, int | None]] = [(top, 0, None)]
    while stack:
        name, layer, parent = stack.pop()
        kind = "event"
        if name in inputs:
            kind = "again" if name in drawn else "folded" if layer >= deepest - 1 else "gate"
        if kind == "gate":
            drawn.add(name)
            own = len(boxes)
            stack += [(below, layer + 1, own) for below in reversed(inputs[name])]
        boxes.append(Box(name, 0.0, layer, parent, kind))
    return boxes


def _placed(boxes: list[Box]) -> tuple[Box, ...]:
    """The same with columns: what has nothing below takes the next free one."""
    below: dict[int, list[int]] = {}
    for i, box in enumerate(boxes):
        if box.parent is not None:
            below.setdefault(box.parent, []).append(i)
    column: dict[int, float] = {}
    free = 0
    for i in range(len(boxes)):
        if i not in below:
            column[i] = float(free)
            free += 1
    for i in reversed(range(len(boxes))):
        if i in below:
            column[i] = (column[below[i][0]] + column[below[i][-1]]) / 2
    return tuple(
        Box(box.name, column[i], box.layer, box.parent, box.kind) for i, box in enumerate(boxes)
    )
