"""How often each architecture is wrong unawares, against SIL bands and the tolerable rate."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from sbas.dependability.analysis.architectures import ArchitectureLadder, ArchitectureRow
from sbas.integrity.sil import SIL_BANDS_PER_H
from sbas.numerals import upward
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    INK,
    MUTED,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LETTERS_A_LINE = 32
_LOWEST_PER_H = 1e-15
"""Rates below this stand at the edge with their figure."""


def ladder_sheet(ladder: ArchitectureLadder) -> Sheet:
    """The sheet of the ladder: full width, as high as there are architectures."""
    rows = max(len(ladder.rows), 3)
    return Sheet(FULL_WIDTH, 0.9 + 0.36 * rows, left=2.1, bottom=0.46, top=0.44)


def architecture_ladder(ladder: ArchitectureLadder, *, ax: Axes | None = None) -> Axes:
    """Hazard rate of each architecture on a log axis, with SIL bands and the tolerable rate.

    Parameters
    ----------
    ladder : result of `sbas.dependability.analysis.architectures.compare_architectures`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes, architectures from the top in the order given. Open marks do not meet the tolerable
    rate; without one all are filled. An architecture without figures says why in its row.

    References
    ----------
    Bands: EN 50129, table A.1; IEC 61508-1, 7.6.2.
    """
    with drawing(None if ax is None else [ax], ladder_sheet(ladder)) as (ax,):
        ax.set_xlabel(f"modelled: {ladder.hazard} begins, times per hour [1/h]")
        if not ladder.rows:
            sentence(ax, "no architecture was compared")
            return ax
        names = ["\n".join(textwrap.wrap(row.name, _LETTERS_A_LINE)) for row in ladder.rows]
        ax.set_yticks(range(len(names)), names)
        ax.set_ylim(len(names) - 0.4, -0.6)
        ax.grid(visible=False, axis="y")
        low, high = _limits(ladder)
        log_axis(ax, "x", low, high)
        _bands(ax, low, high)
        if ladder.thr_per_h is not None:
            ax.axvline(ladder.thr_per_h, color=VERMILION, linewidth=1.1, linestyle=(0, (4, 2)))
            ax.annotate(
                f"THR {ladder.thr_per_h:g}/h", (ladder.thr_per_h, 1), xytext=(0, 12),
                xycoords=ax.get_xaxis_transform(), textcoords="offset points", fontsize=7,
                color=VERMILION, ha="center", va="bottom",
            )  # fmt: skip
        for i, row in enumerate(ladder.rows):
            _draw_row(ax, i, row, low, high)
        return ax


def _limits(ladder: ArchitectureLadder) -> tuple[float, float]:
    """Ends of the axis: the bands, the target and all rates, with room for the figures."""
    rates = [row.verdict.rate_per_h for row in ladder.rows if row.verdict is not None]
    shown = [rate for rate in (*rates, ladder.thr_per_h or 0.0) if rate >= _LOWEST_PER_H]
    low = min([SIL_BANDS_PER_H[0][1], *shown]) / 5
    high = max([SIL_BANDS_PER_H[-1][2], *shown])
    return low, high * (high / low) ** 0.18


def _draw_row(ax: Axes, i: int, row: ArchitectureRow, low: float, high: float) -> None:
    if row.verdict is None:
        reason = textwrap.shorten(row.refused.splitlines()[0], 70, placeholder=" …")
        note(ax, low * 1.3, i, f"no figures: {reason}", color=MUTED, ha="left")
        return
    rate = row.verdict.rate_per_h
    if rate < _LOWEST_PER_H:
        words = f"◂ {upward(rate)}" if rate else "never true in this model: no rate"
        note(ax, low * 1.3, i, words, color=MUTED if not rate else INK, ha="left")
        return
    ax.plot([low, rate], [i, i], color=BLUE, linewidth=0.8)
    ax.plot(
        [rate], [i], color=BLUE, marker="o", markersize=5.5, markeredgewidth=1.2,
        markerfacecolor="white" if row.verdict.meets is False else BLUE,
    )  # fmt: skip
    ax.annotate(
        upward(rate), (rate, i), xytext=(6, 0), textcoords="offset points", fontsize=7,
        va="center", color=INK,
    )  # fmt: skip


def _bands(ax: Axes, low: float, high: float) -> None:
    for level, start, stop in SIL_BANDS_PER_H:
        ax.axvspan(start, stop, color=SKY, alpha=0.06 + 0.07 * level, linewidth=0)
        _head(ax, (start * stop) ** 0.5, f"SIL {level}")
    worst = SIL_BANDS_PER_H[-1][2]
    if high / worst > 100:
        _head(ax, (worst * high) ** 0.5, "no SIL")


def _head(ax: Axes, x: float, words: str) -> None:
    ax.annotate(
        words, (x, 1), xytext=(0, 2), xycoords=ax.get_xaxis_transform(),
        textcoords="offset points", fontsize=7, color=MUTED, ha="center", va="bottom",
    )  # fmt: skip
