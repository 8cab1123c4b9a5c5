"""Fig. 4 of the EGNOS paper: two receivers' speed, distance, HDOP and satellites over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.comparison.comparison_results import Comparison
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    INK,
    ORANGE,
    PURPLE,
    Sheet,
    drawing,
    sentence,
)
from sbas.streaming import ThinnedSeries
from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 5.6, left=0.66, right=0.15, top=0.28, rows=4)
_UNITS_S = (("s", 1.0, 600.0), ("min", 60.0, 7200.0), ("h", 3600.0, 864e3), ("d", 86400.0, np.inf))


def pair_strips(comparison: Comparison, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """Speed, distance between the two positions, HDOP and satellites of both, over time.

    Parameters
    ----------
    comparison : result of `sbas.integrity.comparison.comparison.compare`.
    axes : four axes, from top to bottom; a new figure without them.

    Returns
    -------
    (4,) the axes. Each stroke spans the smallest and largest value of its time bin, so that no
    spike is lost; a bin without a value stays empty.

    References
    ----------
    Filip, Bazant, Mocek 2010, Fig. 4.
    """
    from matplotlib.ticker import MaxNLocator

    series = comparison.strips
    span_s = (series.end_ns - series.begin_ns) / NS_PER_S
    unit, seconds = next((name, size) for name, size, limit in _UNITS_S if span_s < limit)
    a, b = comparison.label_a, comparison.label_b
    with drawing(axes, SHEET) as (speed, distance, hdop, satellites):
        x = np.linspace(0, span_s / seconds, series.bins + 1)
        for ax, name, missing in (
            (speed, "speed", "no speed in these recordings"),
            (hdop, "hdop", "no HDOP in these recordings"),
            (satellites, "n_sv", "no number of satellites in these recordings"),
        ):
            drawn = [
                _strokes(ax, x, series, f"{name}_a", BLUE, a, width=1.8),
                _strokes(ax, x, series, f"{name}_b", ORANGE, b, width=0.8),
            ]
            if not any(drawn):
                sentence(ax, missing)
            elif name == "speed":
                ax.set_ylim(0, max(ax.get_ylim()[1], 1.0))
        if _strokes(distance, x, series, "distance", PURPLE, "", width=0.9):
            distance.set_ylim(bottom=0)
            _mark_p95(distance, comparison)
        else:
            sentence(distance, "no epoch has a position in both recordings")
        satellites.yaxis.set_major_locator(MaxNLocator(4, integer=True))
        labelled = next((ax for ax in (speed, hdop, satellites) if ax.get_lines()), None)
        if labelled is not None:
            labelled.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderaxespad=0)
        names = ("(a) speed [m/s]", "(b) distance [m]", "(c) HDOP [1]", "(d) satellites [1]")
        for ax, name in zip((speed, distance, hdop, satellites), names, strict=True):
            ax.set_ylabel(name)
            ax.set_xlim(0, span_s / seconds)
        begin = str(np.datetime64(series.begin_ns, "ns").astype("M8[s]")).replace("T", " ")
        satellites.set_xlabel(f"time since {begin} GPST [{unit}]")
        return np.array([speed, distance, hdop, satellites], dtype=object)


def _strokes(
    ax: Axes,
    edges: NDArray[np.float64],
    series: ThinnedSeries,
    column: str,
    colour: str,
    label: str,
    *,
    width: float,
) -> bool:
    """A stroke from low to high in every bin that has a value; False when none has."""
    low, high = series.band(column)
    known = np.isfinite(low)
    if not known.any():
        return False
    apart = np.full(int(known.sum()), np.nan)
    ax.plot(
        np.column_stack([edges[:-1][known], edges[1:][known], apart]).ravel(),
        np.column_stack([low[known], high[known], apart]).ravel(),
        color=colour, linewidth=width, solid_capstyle="projecting", label=label,
        marker="." if known.sum() < 60 else None,
    )  # fmt: skip
    return True


def _mark_p95(ax: Axes, comparison: Comparison) -> None:
    found = comparison.difference
    if isinstance(found, Refusal):
        return
    ax.axhline(found.p95.value, color=INK, linewidth=0.7, linestyle=(0, (4, 2)), zorder=3)
    ax.text(
        0.995, 1.02, f"95 % within {found.p95.value:.3f} m, largest {found.max:.3f} m",
        transform=ax.transAxes, ha="right", va="bottom", fontsize=6.5,
    )  # fmt: skip
