"""What RAIM can do with the satellites in use, and what that makes available."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sbas.monitoring.level_comparison import LevelComparison
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    INK,
    LINE,
    ORANGE,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 3.1, left=0.62, right=2.1, bottom=0.75, top=0.15)
_KINDS = (
    ("no fix, or not known", LINE, ""),
    ("fix, no test", VERMILION, "////"),
    ("detection only", ORANGE, "...."),
    ("identification", SKY, ""),
)
_UPRIGHT = 11
"""With more columns the counts below them are turned."""


def raim_availability(comparison: LevelComparison, *, ax: Axes | None = None) -> Axes:
    """Share of epochs by what RAIM can do, for each number of satellites in use and for all.

    Parameters
    ----------
    comparison : result of `sbas.raim_against_sbas`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. The left bar of each pair: no fix (or, where the number of satellites is "unknown",
    a fix whose ranges the recording does not have), a fix without a test, a test that detects, one
    that identifies the faulty range as well; the right bar: epochs at which RAIM is available.
    Below stand satellites and epochs; the text counts epochs with SBAS, RAIM, both and neither.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4: five satellites detect, six identify.
    """
    rows = comparison.by_satellites
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_ylabel("share of epochs [%]")
        ax.set_xlabel("satellites in use, and epochs")
        if rows.empty or not rows["epochs"].sum():
            sentence(ax, "no epoch with a known number of satellites")
            return ax
        table = pd.concat([rows, rows.sum().to_frame("all").T])
        at = np.arange(len(table), dtype=float)
        at[-1] += 0.4
        epochs = table["epochs"].to_numpy(float)
        if "fix" in table:
            _stacks(ax, at, table, epochs)
        share = 100 * table["available"].to_numpy() / epochs
        ax.bar(
            at + 0.22, share, width=0.36, color=BLUE,
            label=f"RAIM available: {int(table['available'].iloc[-1]):,}",
        )  # fmt: skip
        # -1 is no number: a receiver that does not say, or ranges that are not those of the fix.
        names = [
            "all" if name == "all" else f"{name:g}" if name >= 0 else "unknown"
            for name in table.index
        ]
        turned = 90 if len(table) > _UPRIGHT else 0
        ax.set_xticks(
            at, [f"{a}\n{int(n):,}" if not turned else f"{a}: {int(n):,}"
                 for a, n in zip(names, epochs, strict=True)],
            rotation=turned, fontsize=7,
        )  # fmt: skip
        ax.set_xlim(-0.6, at[-1] + 0.6)
        ax.set_ylim(0, 104)
        ax.grid(visible=False, axis="x")
        ax.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.0), alignment="left", title="epochs in all",
            title_fontsize=7, handleheight=1.1,
        )  # fmt: skip
        ax.text(
            1.02, 0.0, _both_words(comparison), transform=ax.transAxes, fontsize=7, color=INK,
            ha="left", va="bottom", linespacing=1.35,
        )  # fmt: skip
        return ax


def _stacks(ax: Axes, at: np.ndarray, table: pd.DataFrame, epochs: np.ndarray) -> None:
    fix, tested, identifies = (table[name].to_numpy() for name in ("fix", "tested", "identifies"))
    counts = (table["epochs"].to_numpy() - fix, fix - tested, tested - identifies, identifies)
    foot = np.zeros(len(table))
    for (words, colour, hatch), count in zip(_KINDS, counts, strict=True):
        height = 100 * count / epochs
        ax.bar(
            at - 0.18, height, width=0.36, bottom=foot, color=colour, hatch=hatch,
            edgecolor="white", linewidth=0.0, label=f"{words}: {int(count[-1]):,}",
        )  # fmt: skip
        foot += height


def _both_words(comparison: LevelComparison) -> str:
    (neither, raim), (sbas, both) = comparison.both.tolist()
    limit = comparison.alert_limit_m
    below = "" if limit is None else f" below {limit:g} m"
    # HERL is no bound: RAIM that has nothing else is counted by its verdict.
    other = "its verdict" if comparison.risk is None else f"its level{below}"
    return (
        f"epochs with SBAS (HPL{below})\nand RAIM ({other})\nSBAS and RAIM: {both:,}\n"
        f"SBAS alone: {sbas:,}\nRAIM alone: {raim:,}\nneither: {neither:,}"
    )
