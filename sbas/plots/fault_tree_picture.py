"""A fault tree with the probability of each event and gate in its box."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Literal

from sbas.dependability.exact.solution import Solution
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Con,
    Dur,
    Event,
    Failed,
    Gate,
    HybridFaultTree,
    InState,
    Not,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError
from sbas.numerals import number
from sbas.plots.style import BLUE, FULL_WIDTH, INK, MUTED, ORANGE, Sheet, drawing, note, sentence
from sbas.plots.tree_layout import Box, Layout, tree_layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Measure = Literal["mean", "at_end", "at_least_once"]
_WORDS = {
    "mean": "mean share of the mission in which it is true",
    "at_end": "probability at the end of the mission",
    "at_least_once": "probability to be true at least once in the mission",
}

MOST_COLUMNS = 14
"""More boxes side by side cannot be read at the width of a page."""

_LAYER_IN, _BOX_WIDTH, _BOX_HEIGHT = 0.82, 0.92, 0.56
"""Height of a layer [inch]; width of a box [columns] and its height [layers]."""
_MARGIN_IN = 0.06
_STATIC, _MEMORY = "#eef1f4", "#fbe6c8"


def tree_sheet(model: HybridFaultTree) -> Sheet:
    """The sheet on which the tree of a model stands: full width, as high as it has layers."""
    layout = tree_layout(model, most_columns=MOST_COLUMNS)
    layers = 2 if layout is None else layout.layers
    return Sheet(
        FULL_WIDTH, _LAYER_IN * layers + 0.4, left=_MARGIN_IN, right=_MARGIN_IN,
        bottom=0.34, top=_MARGIN_IN,
    )  # fmt: skip


def tree_picture(
    model: HybridFaultTree,
    solution: Solution | None = None,
    *,
    measure: Measure = "mean",
    ax: Axes | None = None,
) -> Axes:
    """A fault tree, gates labelled with their kind and, where solved, their probability.

    Parameters
    ----------
    model : sound by `check_model`.
    solution : of the model; None draws the tree alone.
    measure : what the boxes say: "mean" unavailability, "at_end", or "at_least_once".
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. A gate under several others is drawn in full once and dashed elsewhere; deep layers
    that would not fit are folded, and the line below says so.

    Raises
    ------
    InputError : the solution lacks a row of the tree.
    """
    layout = tree_layout(model, most_columns=MOST_COLUMNS)
    with drawing(None if ax is None else [ax], tree_sheet(model)) as (ax,):
        ax.set_axis_off()
        if layout is None:
            sentence(ax, f"{model.name}: more than {MOST_COLUMNS} boxes side by side;\n"
                     "the text of the model shows the tree")  # fmt: skip
            return ax
        ax.set_xlim(-0.5, max(layout.columns, 5) - 0.5)
        ax.set_ylim(-layout.layers + 0.42, 0.38)
        shift = (max(layout.columns, 5) - layout.columns) / 2
        things: dict[str, Event | Gate] = {t.name: t for t in (*model.events, *model.gates)}
        values = {} if solution is None else _values(layout, solution, measure)
        for box in layout.boxes:
            if box.parent is not None:
                _draw_line(ax, layout.boxes[box.parent], box, shift)
        for box in layout.boxes:
            _draw_box(ax, box, shift, things[box.name], values.get(box.name, ""))
        note(
            ax, 0.5, 0.0, _legend(layout, measure if solution is not None else None),
            transform=ax.transAxes, color=MUTED, fontsize=6.5, va="top",
        )  # fmt: skip
        return ax


def gate_label(gate: Gate) -> str:
    """Kind of a gate with its number or time, such as "CON 6"."""
    match gate:
        case Or() | And() | Not():
            return type(gate).__name__.upper()
        case AtLeast():
            return f"{gate.k} of {len(gate.inputs)}"
        case Con():
            return f"CON {gate.count}"
        case Dur():
            return f"DUR {gate.seconds:g} s"
        case CausalAnd():
            return f"AND {gate.seconds:g} s"
        case _:
            return "PAND"


def _values(layout: Layout, solution: Solution, measure: Measure) -> dict[str, str]:
    key = "mean_unavailability" if measure == "mean" else measure
    found = {}
    for name in {box.name for box in layout.boxes}:
        if name not in solution.rows:
            raise InputError(
                "the solution lacks a row of the tree", evidence=name, cure="solve(..., names=None)"
            )
        value = getattr(solution.rows[name], key)
        found[name] = "not asked" if value is None else number(value, 3)
    return found


def _draw_line(ax: Axes, parent: Box, box: Box, shift: float) -> None:
    middle = -parent.layer - 0.64
    x, y = parent.column + shift, box.column + shift
    ax.plot([x, x, y, y], [-parent.layer, middle, middle, -box.layer], color=MUTED,
            linewidth=0.7, zorder=1)  # fmt: skip


def _draw_box(ax: Axes, box: Box, shift: float, thing: Event | Gate, value: str) -> None:
    from matplotlib.patches import Rectangle

    x, y = box.column + shift, -float(box.layer)
    gate = not isinstance(thing, Event)
    memory = gate and not isinstance(thing, Or | And | Not | AtLeast)
    ax.add_patch(
        Rectangle(
            (x - _BOX_WIDTH / 2, y - _BOX_HEIGHT / 2), _BOX_WIDTH, _BOX_HEIGHT,
            facecolor=(_MEMORY if memory else _STATIC) if gate else "white",
            edgecolor=(ORANGE if memory else INK) if gate else BLUE,
            linewidth=0.8, linestyle=(0, (2.5, 1.5)) if box.kind == "again" else "-", zorder=2,
        )
    )  # fmt: skip
    kind = gate_label(thing) if gate else _event_words(thing)  # type: ignore[arg-type]
    if box.kind == "folded":
        kind += " …"
    lines = [(_short(box.name), 7.0, "bold"), (_short(kind), 6.0, "normal")]
    lines += [(value, 6.5, "normal")] if value else []
    for i, (text, size, weight) in enumerate(lines):
        place = y + 0.17 * ((len(lines) - 1) / 2 - i)
        ax.text(x, place, text, fontsize=size, fontweight=weight, color=INK, ha="center",
                va="center_baseline", zorder=3)  # fmt: skip


def _event_words(event: Event) -> str:
    match event:
        case Failed():
            return f"{event.component} fails"
        case InState():
            return "/".join(event.states)
        case Undeveloped():
            return "not analysed"
        case _:
            return "always" if event.value else "never"


def _short(text: str) -> str:
    return text if len(text) <= 16 else text[:15] + "…"


def _legend(layout: Layout, measure: Measure | None) -> str:
    words = ["orange gates have memory, blue boxes are basic events"]
    kinds = {box.kind for box in layout.boxes}
    if "again" in kinds:
        words.append("dashed: drawn in full elsewhere")
    if "folded" in kinds:
        words.append("…: inputs not drawn")
    if layout.absent:
        words.append(f"{len(layout.absent)} without effect on the top are left out")
    numbers = [] if measure is None else [f"numbers: {_WORDS[measure]}"]
    return "\n".join([*numbers, *textwrap.wrap("; ".join(words), 120)])
