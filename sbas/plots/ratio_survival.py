"""How often the error reaches a given share of its protection level."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.integrity.results import Evaluation
from sbas.plots.style import (
    BLUE,
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT)


def survival(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Share of judged epochs whose HPE/HPL is at or above each value, both axes log.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them.
    """
    ratio, share = evaluation.curves.ratio_grid, evaluation.curves.ratio_exceeded_fraction
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("HPE / HPL [1]")
        ax.set_ylabel("share of epochs at or above [1]")
        seen = share > 0
        if not seen.any():
            sentence(ax, "no epoch with both an error and\na protection level in this recording")
            return ax
        smallest = float(share[seen].min())
        low = smallest / 3
        from_x = float(ratio[max(int(np.argmax(share < 0.95)) - 5, 0)])
        to_x = max(float(ratio[seen][-1]) * 1.5, 4.0)
        log_axis(ax, "y", low, 2.0)
        log_axis(ax, "x", min(from_x, 0.5), to_x)
        ax.axvspan(1.0, to_x, color=VERMILION, alpha=0.08, linewidth=0)
        ax.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (4, 2)))
        bound = "; errors are a lower bound" if evaluation.errors_are_lower_bound else ""
        label = f"counted in this recording{bound}"
        # The last drop goes to the floor: beyond it no epoch was seen.
        drop = np.append(share[seen], low)
        at = np.append(ratio[seen], ratio[seen][-1])
        ax.plot(at, drop, color=BLUE, label=label)
        ax.legend(loc="lower left")
        note(
            ax, 0.985, 0.965, f"HPE ≥ HPL (MI):\n{evaluation.mi_epochs:,} epochs",
            transform=ax.transAxes, ha="right", va="top", fontsize=7,
            color=VERMILION if evaluation.mi_epochs else INK,
        )  # fmt: skip
        return ax
