"""A truth table as the decision tree of Railways 2014, Figure 9: a path a combination."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import DA, WORDS, N, States, U, combination_words
from sbas.plots.style import (
    FULL_WIDTH,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    VERMILION,
    Sheet,
    drawing,
    note,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_SENSORS = 4
"""81 leaves fill a page; 243 cannot be read on one."""

_COLOURS = {N: GREEN, DA: ORANGE, U: VERMILION}
_SHAPES = {N: "o", DA: "s", U: "D"}
_LABELS = {N: "N, nominal", DA: "DA, degraded but acceptable", U: "U, unacceptable"}
_ROW_IN = {1: 0.3, 2: 0.24, 3: 0.19, 4: 0.118}
_HEAD_IN, _FOOT_IN = 0.3, 0.52


def decision_tree_sheet(table: TruthTable) -> Sheet:
    """The sheet of a tree: full width, a row a combination."""
    rows = table.outcomes.size
    height = _HEAD_IN + _FOOT_IN + _ROW_IN[_drawn(table)] * rows
    return Sheet(FULL_WIDTH, height, left=0.08, right=0.08, bottom=_FOOT_IN, top=_HEAD_IN)


def decision_tree(table: TruthTable, *, ax: Axes | None = None) -> Axes:
    """A truth table of up to four sensors, branch by branch, the nominal states uppermost.

    Parameters
    ----------
    table : of 1 to 4 sensors; a column each, in the table's order.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. Each edge bears the state of the sensor above its column, each leaf its number, the
    combination and the output, in colour, shape and words. An edge is coloured where all leaves
    beyond it have one output.

    Raises
    ------
    InputError : more than four sensors.
    """
    n = _drawn(table)
    with drawing(None if ax is None else [ax], decision_tree_sheet(table)) as (ax,):
        ax.set_axis_off()
        leaves = table.outcomes.size
        ax.set_xlim(-0.1, n + 1.3)
        ax.set_ylim(leaves - 0.5, -0.5)
        size = 7.0 if n < MOST_SENSORS else 6.0
        for depth in range(n):
            _draw_level(ax, table.outcomes, depth, n, size)
        _draw_leaves(ax, table, n, size)
        for depth, name in enumerate(table.names):
            note(ax, depth + 0.55, -0.5, _short(name), va="bottom", fontsize=8, fontweight="bold")
        note(ax, n + 0.16, -0.5, "leaf, combination: output", va="bottom", ha="left", fontsize=8)
        counts = dict(zip((N, DA, U), table.counts(), strict=True))
        for level in (N, DA, U):
            ax.plot([], [], linestyle="none", marker=_SHAPES[level], color=_COLOURS[level],
                    markeredgecolor=INK, markeredgewidth=0.4,
                    label=f"{_LABELS[level]}: {counts[level]}")  # fmt: skip
        ax.legend(loc="upper left", bbox_to_anchor=(0.0, 0.0), ncols=3, borderaxespad=0.1,
                  handlelength=1.0, columnspacing=1.2)  # fmt: skip
        ax.annotate(
            _wrapped(table.provenance), (0.0, 0.0), xycoords="axes fraction", xytext=(4, -17),
            textcoords="offset points", fontsize=6.5, color=MUTED, va="top",
        )  # fmt: skip
        return ax


def _drawn(table: TruthTable) -> int:
    n = len(table.names)
    if n > MOST_SENSORS:
        raise InputError(
            f"a decision tree is drawn for at most {MOST_SENSORS} sensors",
            where="table",
            evidence=f"{n} sensors have {3**n} leaves",
            cure="table.frame() lists them, prime_implicants() says them in a few lines",
        )
    return n


def _draw_level(ax: Axes, outcomes: States, depth: int, n: int, size: float) -> None:
    """Edges from the nodes at a depth to their three children."""
    # (nodes, states, leaves below the child)
    below = outcomes.reshape(3**depth, 3, -1)
    rows = np.arange(outcomes.size, dtype=float).reshape(below.shape)
    fork = depth + 0.18
    for node in range(len(below)):
        parent = float(rows[node].mean())
        places = [float(rows[node, state].mean()) for state in (N, DA, U)]
        look = _edge(below[node])
        ax.plot([depth, fork], [parent, parent], zorder=1, **look)
        ax.plot([fork, fork], [places[0], places[-1]], zorder=1, **look)
        for state, place in zip((N, DA, U), places, strict=True):
            ax.plot([fork, depth + 1], [place, place], zorder=2, **_edge(below[node, state]))
            ax.text(
                depth + 0.55, place, WORDS[state], fontsize=size, color=INK, ha="center",
                va="center_baseline", zorder=3,
                bbox={"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": "none"},
            )  # fmt: skip


def _edge(outcomes: States) -> dict[str, Any]:
    found = np.unique(outcomes)
    if found.size > 1:
        return {"color": MUTED, "linewidth": 0.8}
    return {"color": _COLOURS[int(found[0])], "linewidth": 1.8}


def _draw_leaves(ax: Axes, table: TruthTable, n: int, size: float) -> None:
    for code, outcome in enumerate(table.outcomes.tolist()):
        ax.plot(
            [n + 0.05], [code], linestyle="none", marker=_SHAPES[outcome], markersize=size - 2.2,
            color=_COLOURS[outcome], markeredgecolor=INK, markeredgewidth=0.4, zorder=4,
        )  # fmt: skip
        ax.text(
            n + 0.16, code, f"O{code + 1}  {combination_words(code, n)}: {WORDS[outcome]}",
            fontsize=size, color=INK, ha="left", va="center_baseline", zorder=4,
        )  # fmt: skip


def _short(text: str) -> str:
    return text if len(text) <= 16 else text[:15] + "…"


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 130, max_lines=2, placeholder=" …")
