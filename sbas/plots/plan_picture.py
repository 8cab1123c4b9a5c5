"""Positions of several recordings seen from above, in metres about a common point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.plots.levels_picture import LOOKS
from sbas.plots.style import HALF_WIDTH, INK, Sheet, drawing, sentence
from sbas.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, 3.9, left=0.62, top=0.35)
_MARKERS = (("o", 3.6), ("^", 2.2), ("s", 2.0), ("D", 1.8), ("P", 1.8))
MOST_POINTS = 4000
"""Of more positions evenly spaced ones are drawn."""


def ground_plan(recordings: Mapping[str, Recording], *, ax: Axes | None = None) -> Axes:
    """Positions of one to five recordings in plan, east and north of their common median.

    Parameters
    ----------
    recordings : by the name each has in the legend.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes, in equal scales. The large open marks are the medians of each recording. The origin
    is the median of all positions and no truth: a common error cannot be seen.

    Raises
    ------
    ValueError : more recordings than can be told apart.
    """
    if len(recordings) > len(LOOKS):
        raise ValueError(f"at most {len(LOOKS)} recordings, not {len(recordings)}")
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("east of the median [m]")
        ax.set_ylabel("north of the median [m]")
        ax.set_aspect("equal", adjustable="datalim")
        places = {name: _places(recording) for name, recording in recordings.items()}
        every = np.concatenate([*places.values(), np.zeros((0, 3))])
        if not every.size:
            sentence(ax, "no position in these recordings")
            return ax
        middle = np.median(every, axis=0)
        for (name, lla), (colour, _), (marker, size) in zip(
            places.items(), LOOKS, _MARKERS, strict=False
        ):
            east, north, _ = pymap3d.geodetic2enu(*lla.T, *middle)
            some = slice(None, None, max(1, -(-len(lla) // MOST_POINTS)))
            ax.plot(
                east[some], north[some], color=colour, marker=marker, markersize=size,
                linestyle="none", alpha=0.75, markeredgewidth=0,
                label=f"{name}, {len(lla):,} positions",
            )  # fmt: skip
            if len(lla):
                ax.plot(
                    np.median(east), np.median(north), color=colour, marker=marker, markersize=8,
                    markerfacecolor="none", markeredgecolor=INK, markeredgewidth=1.1,
                    linestyle="none", zorder=4,
                )  # fmt: skip
        ax.margins(0.06)
        ax.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2,
            markerscale=1.6, handlelength=0.8, columnspacing=1.2,
        )  # fmt: skip
        return ax


def _places(recording: Recording) -> NDArray[np.float64]:
    """(k, 3) known positions: latitude, longitude [deg], height [m]."""
    if not {"lat_deg", "lon_deg", "height_m"} <= set(recording.table):
        return np.zeros((0, 3))
    lla: NDArray[np.float64] = recording.table[["lat_deg", "lon_deg", "height_m"]].to_numpy(float)
    return lla[np.isfinite(lla).all(axis=1)]
