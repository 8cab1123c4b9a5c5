"""Which level of which sensor, and which parameter, the output of a fusion hangs on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sbas.fusion.fused_runs import Floats
from sbas.fusion.importance.importance_results import LAWS, Bounded, Law, StateImportances
from sbas.fusion.importance.parameter_sensitivity import ParameterSensitivity
from sbas.fusion.importance.top_shares import Top
from sbas.numerals import number
from sbas.plots.style import (
    BLUE,
    HALF_WIDTH,
    INK,
    MUTED,
    ORANGE,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_ROWS = 16
_LAW_COLOURS = {"independent": SKY, "joint": BLUE, "simulated": VERMILION}
_LAW_WORDS = {
    "independent": "table, independent", "joint": "table, joint", "simulated": "simulated",
}  # fmt: skip
_TOP_WORDS = {"isU": "output U", "notN": "output not N"}


def _sheet(rows: int, row_height: float, *, left: float, bottom: float) -> Sheet:
    return Sheet(
        HALF_WIDTH, 0.9 + row_height * min(max(rows, 3), MOST_ROWS), left=left, top=0.3,
        bottom=bottom,
    )  # fmt: skip


def state_importance_sheet(importances: StateImportances) -> Sheet:
    """The sheet of the bars: a row a level of a sensor, as high as there are laws."""
    height = 0.16 * len(_laws(importances)) + 0.1
    return _sheet(len(_keys(importances)), height, left=0.95, bottom=0.58)


def _keys(importances: StateImportances) -> list[tuple[str, str]]:
    return list(dict.fromkeys((row.sensor, row.level) for row in importances.rows))


def _laws(importances: StateImportances) -> list[Law]:
    return [law for law in LAWS if any(row.law == law for row in importances.rows)]


def state_importance_bars(
    importances: StateImportances, *, top: Top = "isU", ax: Axes | None = None
) -> Axes:
    """Birnbaum importance of each level of each sensor as bars, a colour a law.

    Parameters
    ----------
    importances : result of `importance_by_state`, or of `independent_importance`.
    top : "isU", the output is unacceptable, or "notN", it is not nominal.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. What is not estimable is written, not drawn as a bar of no length; bars with
    no interval have no whisker, and say so. At most 16 rows, the rest is counted.
    """
    keys, laws = _keys(importances), _laws(importances)
    shown = keys[:MOST_ROWS]
    with drawing(None if ax is None else [ax], state_importance_sheet(importances)) as (ax,):
        ax.set_xlabel(
            f"P({_TOP_WORDS[top]} | level) - P({_TOP_WORDS[top]} | N) [1]"
            + _under(importances)
        )  # fmt: skip
        if not shown:
            sentence(ax, "no sensor has an importance")
            return ax
        ax.set_yticks(range(len(shown)), [_short(f"{name} {level}") for name, level in shown])
        ax.set_ylim(len(shown) - 0.45, -0.55)
        ax.grid(visible=False, axis="y")
        ax.axvline(0.0, color=INK, linewidth=0.7, zorder=1.5)
        thickness = 0.8 / len(laws)
        reach = [0.0]
        for place, law in enumerate(laws):
            figures = [importances.of(law, top, *key).birnbaum for key in shown]
            at = np.arange(len(shown), dtype=float) - 0.4 + (place + 0.5) * thickness
            _bars(ax, at, figures, thickness, _LAW_COLOURS[law], _LAW_WORDS[law],
                  exact=law == "independent")  # fmt: skip
            reach += [end for f in figures for end in (f.value, f.lower, f.upper) if end == end]
        _room_for_figures(ax, min(reach), max(reach))
        _legend(ax)
        _left_out(ax, len(keys) - len(shown))
        return ax


def sensitivity_bars(sensitivity: ParameterSensitivity, *, ax: Axes | None = None) -> Axes:
    """Sobol indices of each parameter as bars with their half-widths, the largest total first.

    Parameters
    ----------
    sensitivity : result of `sensitivity_to_parameters`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes; with the reason where the figure is constant. At most 16 rows, the rest is counted.
    """
    rows = sorted(sensitivity.rows, key=lambda row: -row.total)
    shown = rows[:MOST_ROWS]
    with drawing(None if ax is None else [ax], _sheet(len(rows), 0.36, left=1.95, bottom=0.44)) as (
        ax,
    ):
        ax.set_xlabel(f"share of the variance of {sensitivity.of} [1]")
        ax.set_yticks(range(len(shown)), [_short(row.path, 36) for row in shown])
        ax.set_ylim(len(shown) - 0.45, -0.55)
        ax.grid(visible=False, axis="y")
        if sensitivity.undefined:
            sentence(ax, _wrapped(sensitivity.undefined))
            return ax
        ax.axvline(0.0, color=INK, linewidth=0.7, zorder=1.5)
        reach = [0.0]
        for place, (kind, colour, label) in enumerate(
            (("first", SKY, "first order: alone"), ("total", ORANGE, "total: in any company"))
        ):
            figures = []
            for row in shown:
                value, half = getattr(row, kind), getattr(row, f"{kind}_half_width")
                figures.append(Bounded(value, value - half, value + half))
            at = np.arange(len(shown), dtype=float) - 0.2 + 0.4 * place
            _bars(ax, at, figures, 0.4, colour, label)
            reach += [end for f in figures for end in (f.value, f.lower, f.upper) if end == end]
        _room_for_figures(ax, min(reach), max(reach))
        _legend(ax)
        _left_out(ax, len(rows) - len(shown))
        return ax


def _bars(
    ax: Axes,
    at: Floats,
    figures: list[Bounded],
    thickness: float,
    colour: str,
    label: str,
    *,
    exact: bool = False,
) -> None:
    """Bars with whiskers where bounds are known, and the figure beyond each, said if without."""
    values = [0.0 if math.isnan(figure.value) else figure.value for figure in figures]
    ax.barh(at, values, height=0.92 * thickness, color=colour, label=label)
    for y, figure in zip(at, figures, strict=True):
        beyond = max(0.0, 0.0 if math.isnan(figure.value) else figure.value)
        if figure.bounded:
            ax.plot([figure.lower, figure.upper], [y, y], color=INK, linewidth=0.8, zorder=3)
            beyond = max(beyond, figure.upper)
        text = "not estimable" if math.isnan(figure.value) else number(figure.value, 2)
        if not (exact or figure.bounded or math.isnan(figure.value)):
            text += ", no interval"
        ax.annotate(
            text, (beyond, y), xytext=(3, 0), textcoords="offset points", fontsize=6.3,
            va="center", color=INK,
        )  # fmt: skip


def _room_for_figures(ax: Axes, low: float, high: float) -> None:
    span = (high - low) or 1.0
    ax.set_xlim(low - 0.03 * span if low < 0.0 else 0.0, high + 0.3 * span)


def _legend(ax: Axes) -> None:
    ax.legend(
        loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=3, borderaxespad=0.2,
        handlelength=1.0, columnspacing=1.0, handletextpad=0.5,
    )  # fmt: skip


def _left_out(ax: Axes, count: int) -> None:
    if count:
        note(ax, 0.99, 0.02, f"{count} more are not shown", transform=ax.transAxes, ha="right",
             va="bottom", color=MUTED)  # fmt: skip


def _under(importances: StateImportances) -> str:
    if importances.runs is None:
        return ""
    return f"\n{importances.runs:,} runs; whiskers: {100 * importances.confidence:g} %, whole runs"


def _short(text: str, length: int = 15) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def _wrapped(text: str) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, 40))
