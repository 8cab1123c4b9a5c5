"""Which events and components the failure of the unit hangs on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sbas.dependability.analysis.importance import Importance, Importances
from sbas.numerals import number
from sbas.plots.style import (
    BLUE,
    HALF_WIDTH,
    INK,
    MUTED,
    ORANGE,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_ROWS = 20
_LOWEST = 1e-12
"""Shares below this leave the picture; their figure stands at the edge."""
_KINDS = {"event": (BLUE, "basic events"), "component": (ORANGE, "components")}


def importance_sheet(importances: Importances) -> Sheet:
    """The sheet of the bars: half width, as high as there are rows."""
    rows = min(max(len(importances.rows), 4), MOST_ROWS)
    return Sheet(HALF_WIDTH, 1.0 + 0.19 * rows, left=0.95, top=0.3, bottom=0.58)


def importance_bars(importances: Importances, *, ax: Axes | None = None) -> Axes:
    """Criticality of each basic event and component as a bar on a log axis, its diagnostic share.

    Parameters
    ----------
    importances : result of `sbas.dependability.analysis.importance.importance`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. Events and components apart, since a component fails all its events at once; in each
    kind the largest criticality first, 20 rows in all. Right of the line at 1 forcing an event
    for all epochs makes runs that it never makes of itself: there the diagnostic share tells.
    """
    rows = importances.rows[:MOST_ROWS]
    words = {"mean": "mean unavailability", "at_end": "probability at the end"}
    with drawing(None if ax is None else [ax], importance_sheet(importances)) as (ax,):
        ax.set_xlabel(
            f"criticality p·B/P and diagnostic share [1];\n"
            f"P: {words[importances.measure]} of {importances.of}, "
            f"{number(importances.probability, 3)}"
        )
        if not rows:
            sentence(ax, f"{importances.of} depends on no event or component")
            return ax
        ax.set_yticks(range(len(rows)), [_short(row.name) for row in rows])
        ax.set_ylim(len(rows) - 0.4, -0.6)
        ax.grid(visible=False, axis="y")
        shown = [share for row in rows for share in (row.criticality, row.diagnostic)
                 if share is not None and share >= _LOWEST]  # fmt: skip
        low = min([0.1, *shown]) / 3
        high = 1.5 * max([1.0, *shown])
        log_axis(ax, "x", low, high * (high / low) ** 0.28)
        if high > 10:
            ax.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1.5)
        for kind, (colour, label) in _KINDS.items():
            at = [i for i, row in enumerate(rows) if row.kind == kind]
            if at:
                widths = [max(rows[i].criticality or 0.0, low) for i in at]
                ax.barh(at, [w - low for w in widths], left=low, height=0.62, color=colour,
                        label=label)  # fmt: skip
        marked = [(row.diagnostic, i) for i, row in enumerate(rows)
                  if row.diagnostic is not None and row.diagnostic >= low]  # fmt: skip
        if marked:
            x, y = zip(*marked, strict=True)
            ax.plot(x, y, linestyle="none", marker="D", markersize=3.2, color="white",
                    markeredgecolor=INK, markeredgewidth=0.8, label="diagnostic")  # fmt: skip
        for i, row in enumerate(rows):
            right = max(row.criticality or 0.0, row.diagnostic or 0.0, low)
            ax.annotate(
                _figure(row), (right, i), xytext=(5, 0), textcoords="offset points", fontsize=6.5,
                va="center", color=INK,
            )  # fmt: skip
        ax.legend(loc="lower left", bbox_to_anchor=(-0.1, 1.0), ncols=3, borderaxespad=0.2,
                  handlelength=1.0, columnspacing=1.0)  # fmt: skip
        left_out = len(importances.rows) - len(rows)
        if left_out:
            note(ax, 0.99, 0.02, f"{left_out} more are not shown", transform=ax.transAxes,
                 ha="right", va="bottom", color=MUTED)  # fmt: skip
        return ax


def _figure(row: Importance) -> str:
    return "rounding only" if row.criticality is None else number(row.criticality, 3)


def _short(text: str) -> str:
    return text if len(text) <= 16 else text[:15] + "…"
