"""Where the fixes lie about the truth, with the ellipse of their spread."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sbas.integrity.results import Evaluation
from sbas.plots.style import (
    BLACK,
    HALF_HEIGHT,
    HALF_WIDTH,
    ORANGE,
    VERMILION,
    Sheet,
    count_image,
    drawing,
    note,
    sentence,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT, right=0.62)
K_95 = math.sqrt(-2 * math.log(0.05))
"""Semi-axes of the ellipse that holds 95 % of a two-dimensional Gauss distribution [sigma]."""


def scatter(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Density of the horizontal error, its mean, and its 1-sigma and 95 % ellipses.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them.

    References
    ----------
    The 95 % ellipse has K = sqrt(-2 ln 0.05) times the 1-sigma axes and holds 95 % of Gauss
    errors; its legend says so, since nothing here tests that they are.
    """
    grid, ellipse = evaluation.scatter, evaluation.ellipse
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("error east [m]")
        ax.set_ylabel("error north [m]")
        if ellipse is None or not grid.counts.any():
            sentence(ax, "no position error in this recording")
            return ax
        from matplotlib.patches import Ellipse

        major, minor, azimuth = ellipse.axes()
        half = grid.SIDE // 2
        rows, columns = (np.flatnonzero(grid.counts.any(axis=i)) for i in (1, 0))
        farthest = max(abs(int(i) - half) + 1 for i in (*rows[[0, -1]], *columns[[0, -1]]))
        reach = max(farthest * grid.cell, K_95 * major) * 1.05
        kept = slice(max(half - farthest, 0), half + farthest)
        side = min(farthest, half) * grid.cell
        count_image(ax, grid.counts[kept, kept], (-side, side, -side, side))
        partial = evaluation.truth is not None and evaluation.truth.lower_bound
        origin = evaluation.truth.label if partial and evaluation.truth else "truth"
        ax.axhline(0, color=BLACK, linewidth=0.5, zorder=3)
        ax.axvline(0, color=BLACK, linewidth=0.5, zorder=3)
        ax.plot([0], [0], "+", color=BLACK, markersize=9, label=origin, zorder=4)
        ax.plot(
            [ellipse.mean_e_m], [ellipse.mean_n_m], "o", color=VERMILION, markeredgecolor="white",
            markeredgewidth=0.6, label="mean", zorder=5,
        )  # fmt: skip
        for k, style, name in ((1.0, "-", "1 σ"), (K_95, "--", "95 % if Gauss")):
            patch = Ellipse(
                (ellipse.mean_e_m, ellipse.mean_n_m), 2 * k * major, 2 * k * minor,
                angle=90 - azimuth, fill=False, edgecolor=ORANGE if k == 1 else VERMILION,
                linestyle=style, linewidth=1.3, zorder=4,
            )  # fmt: skip
            ax.add_patch(patch)
            ax.plot([], [], linestyle=style, color=patch.get_edgecolor(), label=name)
        if grid.outside:
            note(ax, 0.01, 0.015, f"{grid.outside:,} epochs lie outside", transform=ax.transAxes,
                 ha="left", va="bottom", zorder=6)  # fmt: skip
        ax.set_xlim(-reach, reach)
        ax.set_ylim(-reach, reach * 1.14)
        ax.locator_params(nbins=6)
        ax.set_aspect("equal", adjustable="box", anchor="W")
        ax.legend(
            loc="upper center", ncols=4, columnspacing=0.9, handletextpad=0.35, borderaxespad=0.1,
            handlelength=1.2, fontsize=6.5,
        )  # fmt: skip
        return ax
