"""The receiver's states along time: the worst of each bin, and the shares of all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.receiver.thinned_states import WORST_FIRST, StateStrip
from sbas.numerals import number
from sbas.plots.style import (
    BLACK,
    FULL_WIDTH,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    sentence,
)
from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 2.6, left=0.75, bottom=0.8)

_LOOKS = {
    "wrong": (VERMILION, "wrong"),
    "missing": (ORANGE, "missing"),
    "hardware": (BLACK, "hardware fault"),
    "first_fix_wait": (PURPLE, "wait for the first fix"),
    "unknown": (MUTED, "unknown"),
    "correct": ("#c9e4f5", "correct"),
}
_UNITS_S = (("s", 1.0, 600.0), ("min", 60.0, 7200.0), ("h", 3600.0, 864e3), ("d", 86400.0, np.inf))
_RIBBON = (1.08, 1.28)
"""Bottom and top of the worst states, above the shares from 0 to 1."""


def state_ribbon(strip: StateStrip, *, ax: Axes | None = None) -> Axes:
    """States of a receiver over time: the worst one of each bin above the shares of all.

    Parameters
    ----------
    strip : result of `sbas.dependability.receiver.thinned_states.state_strip`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. A single wrong epoch colours its bin in the upper band; a gap of the record stays
    white in both.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        span = (strip.end_ns - strip.begin_ns) / NS_PER_S
        unit, seconds = next((u, s) for u, s, limit in _UNITS_S if span < limit)
        begin = str(np.datetime64(strip.begin_ns, "ns").astype("M8[s]")).replace("T", " ")
        ax.set_xlabel(f"time since {begin} GPST [{unit}]")
        ax.set_ylabel("share of epochs [1]", y=0.4)
        ax.grid(visible=False)
        ax.set_ylim(0, 1.3)
        ax.set_xlim(0, span / seconds)
        bins = len(strip.counts)
        edges = np.linspace(0, span / seconds, bins + 1)
        worst = strip.worst
        if np.all(worst < 0):
            sentence(ax, "no epoch in this recording")
            return ax
        ax.set_yticks([0.0, 0.5, 1.0, sum(_RIBBON) / 2], ["0", "0.5", "1", "worst"])
        base = np.zeros(bins)
        total = sum(strip.epochs(name) for name in WORST_FIRST)
        for i, name in enumerate(WORST_FIRST):
            colour, words = _LOOKS[name]
            epochs = strip.epochs(name)
            if epochs == 0:
                continue
            top = base + np.nan_to_num(strip.share(name))
            # A bin is narrower than a pixel: its stroke in the upper band is as wide as one.
            stroke = 0.0 if name == "correct" else 0.7
            for low, high, where, width in (
                (base, top, top > base, 0.25),
                (*_RIBBON, worst == i, stroke),
            ):
                for first, stop in _stretches(where):
                    x = np.repeat(edges[first : stop + 1], 2)[1:-1]
                    bottom, upper = (
                        np.repeat(np.broadcast_to(v, bins)[first:stop], 2) for v in (low, high)
                    )
                    ax.fill_between(
                        x, bottom, upper, color=colour, linewidth=width,
                        zorder=2 - i / len(WORST_FIRST),
                    )  # fmt: skip
            base = top
            label = f"{words}: {epochs:,} ({number(100 * epochs / total, 3)} %)"
            ax.fill_between([], [], [], color=colour, label=label)
        ax.axhline(1.0, color=INK, linewidth=0.5)
        ax.legend(
            loc="upper right", bbox_to_anchor=(1.0, -0.26), ncols=3, borderaxespad=0,
            handlelength=1.0, columnspacing=1.2,
        )  # fmt: skip
        return ax


def _stretches(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, stop) of each run of true bins."""
    edge = np.flatnonzero(np.diff(where.astype(np.int8), prepend=0, append=0))
    return list(zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True))
