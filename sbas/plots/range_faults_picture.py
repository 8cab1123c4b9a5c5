"""What became of faults put into ranges: by size of steps, growth of ramps, and two at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sbas.monitoring.range_faults import InjectedFaults
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    INK,
    LINE,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 3.4, left=0.62, right=2.05, bottom=0.55, top=0.5)
_OUTCOMES = (
    ("excluded_right", "found, all faults excluded", BLUE, ""),
    ("kept", "found, nothing excluded", SKY, ""),
    ("unavailable", "no test", LINE, ""),
    ("missed", "missed", ORANGE, "...."),
    ("excluded_part", "one fault excluded, one left in", PURPLE, "xxxx"),
    ("excluded_good", "good range excluded", VERMILION, "////"),
)
_KINDS = {
    "step": ("one step", "size_m", "[m]"),
    "two": ("two steps at once", "size_m", "[m]"),
    "ramp": ("one ramp", "rate_mps", "[m/s]"),
}
_GAP = 0.8
"""Between the kinds of faults, in bars."""


def range_faults(faults: InjectedFaults | pd.DataFrame, *, ax: Axes | None = None) -> Axes:
    """Share of simulated range faults that were excluded, found, missed or never tested.

    Parameters
    ----------
    faults : result of `sbas.monitoring.injected_faults`, or its table.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. A bar for each size or rate, in groups of steps, two steps at once, and ramps. What
    passed after an exclusion is parted into all faults excluded, one of two left in, and a good
    range excluded. Above each stand the largest horizontal error that the faults alone made in a
    fix that passed [m] (of a ramp: in the epoch before it was found), and for ramps the median
    time until found [s].

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4: six satellites identify one failure.
    """
    table = faults if isinstance(faults, pd.DataFrame) else faults.table
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_ylabel("share of trials [%]")
        if table.empty or not table["trials"].sum():
            ax.set_xlabel("size or rate of the fault")
            sentence(ax, "no fault was tried")
            return ax
        kinds = [kind for kind in _KINDS if (table["kind"] == kind).any()]
        rows = pd.concat([table[table["kind"] == kind] for kind in kinds], ignore_index=True)
        shift = rows["kind"].map({kind: _GAP * i for i, kind in enumerate(kinds)}).to_numpy(float)
        at = np.arange(len(rows)) + shift
        trials = rows["trials"].to_numpy(float)
        told = [name for name, *_ in _OUTCOMES if name != "kept"]
        rows["kept"] = rows["trials"] - rows[told].sum(axis=1)
        foot = np.zeros(len(rows))
        for name, words, colour, hatch in _OUTCOMES:
            with np.errstate(invalid="ignore"):
                height = np.where(trials > 0, 100 * rows[name].to_numpy() / trials, 0.0)
            ax.bar(
                at, height, width=0.8, bottom=foot, color=colour, hatch=hatch, edgecolor="white",
                linewidth=0.0, label=words,
            )  # fmt: skip
            foot += height
        _names(ax, rows, at, kinds)
        _figures(ax, rows, at)
        ax.set_xlim(at[0] - 0.7, at[-1] + 0.7)
        ax.set_ylim(0, 100)
        ax.grid(visible=False, axis="x")
        least, most = int(trials.min()), int(trials.max())
        counted = f"{least:,}" if least == most else f"{least:,} to {most:,}"
        ax.legend(
            *(side[::-1] for side in ax.get_legend_handles_labels()), loc="upper left",
            bbox_to_anchor=(1.01, 1.0), alignment="left", handleheight=1.1, title_fontsize=7,
            title=f"of {counted} trials each",
        )  # fmt: skip
        return ax


def _names(ax: Axes, rows: pd.DataFrame, at: np.ndarray, kinds: list[str]) -> None:
    sizes = rows["size_m"].fillna(rows["rate_mps"])
    ax.set_xticks(at, [f"{size:g}" for size in sizes], fontsize=7)
    for kind in kinds:
        words, _, unit = _KINDS[kind]
        middle = at[(rows["kind"] == kind).to_numpy()].mean()
        ax.text(
            middle, -0.115, f"{words} {unit}", transform=ax.get_xaxis_transform(), fontsize=8,
            ha="center", va="top", color=INK,
        )  # fmt: skip


def _figures(ax: Axes, rows: pd.DataFrame, at: np.ndarray) -> None:
    lines = [("error_max_m", "m: largest error that passed", 1.02)]
    if rows["delay_median_s"].notna().any():
        lines.append(("delay_median_s", "s: median until found", 1.085))
    for name, words, height in lines:
        for x, value in zip(at, rows[name], strict=True):
            if np.isfinite(value):
                ax.text(
                    x, height, f"{value:.3g}", transform=ax.get_xaxis_transform(), fontsize=6.5,
                    ha="center", va="bottom", color=INK,
                )  # fmt: skip
        ax.text(
            1.01, height, words, transform=ax.transAxes, fontsize=6.5, ha="left", va="bottom",
            color=MUTED,
        )  # fmt: skip
