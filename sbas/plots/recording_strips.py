"""Fig. 3 of the EGNOS paper: protection level, satellites, HDOP and error over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbas.integrity.results import Evaluation
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    GREEN,
    INK,
    MUTED,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)  # fmt: skip
from sbas.streaming import ThinnedSeries
from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 5.6, left=0.62, right=0.5, rows=4)
LOG_FROM = 4.0
"""A maximum this many medians high puts HPL on a log scale: usual values stay readable."""

FEW_BINS = 60
"""Below so many bins with values each is also marked by dots."""

_UNITS_S = (("s", 1.0, 600.0), ("min", 60.0, 7200.0), ("h", 3600.0, 864e3), ("d", 86400.0, np.inf))


def strips(evaluation: Evaluation, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """HPL, satellites, HDOP, and HPE with its 1-sigma, over time; every spike is drawn.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    axes : four axes, from top to bottom; a new figure without them.

    Returns
    -------
    (4,) the axes. Each stroke spans the smallest and largest value of its time bin; a bin
    without a value stays empty, so that gaps are seen.

    References
    ----------
    Filip, Bazant, Mocek 2010, Fig. 3.
    """
    from matplotlib.ticker import MaxNLocator

    series = evaluation.strips
    unit, seconds = _time_unit(series)
    with drawing(axes, SHEET) as (level, satellites, hdop, error):
        x = np.linspace(0, _span_s(series) / seconds, series.bins + 1)
        if _band(level, x, series, "hpl_m", BLUE, "HPL"):
            _level_scale(level, evaluation)
        else:
            sentence(level, "no protection level in this recording")
        if _band(satellites, x, series, "n_sv", GREEN, "satellites"):
            low, high = series.band("n_sv")
            satellites.set_ylim(max(np.nanmin(low) - 1, 0), np.nanmax(high) + 1)
            satellites.yaxis.set_major_locator(MaxNLocator(4, integer=True))
        else:
            sentence(satellites, "no number of satellites in this recording")
        if not _band(hdop, x, series, "hdop", PURPLE, "HDOP"):
            sentence(hdop, "no HDOP in this recording")
        bound = " (lower bound)" if evaluation.errors_are_lower_bound else ""
        drawn = [
            _band(error, x, series, "hpe_m", VERMILION, f"HPE{bound}"),
            _band(error, x, series, "sigma_h_m", INK, "σ_H (d_major) reported by the receiver"),
        ]
        if any(drawn):
            error.set_ylim(bottom=0)
            error.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderaxespad=0)
        if not drawn[0]:
            text = "no position error in this recording"
            sentence(error, text) if not drawn[1] else note(
                error, 0.01, 0.9, text, transform=error.transAxes, ha="left", color=MUTED
            )
        names = ("(a) HPL [m]", "(b) satellites [1]", "(c) HDOP [1]", "(d) HPE, σ_H [m]")
        for ax, name in zip((level, satellites, hdop, error), names, strict=True):
            ax.set_ylabel(name)
            ax.set_xlim(0, _span_s(series) / seconds)
        begin = str(np.datetime64(series.begin_ns, "ns").astype("M8[s]")).replace("T", " ")
        error.set_xlabel(f"time since {begin} GPST [{unit}]")
        return np.array([level, satellites, hdop, error], dtype=object)


def _span_s(series: ThinnedSeries) -> float:
    return (series.end_ns - series.begin_ns) / NS_PER_S


def _time_unit(series: ThinnedSeries) -> tuple[str, float]:
    span = _span_s(series)
    return next((name, seconds) for name, seconds, limit in _UNITS_S if span < limit)


def _band(
    ax: Axes,
    edges: NDArray[np.float64],
    series: ThinnedSeries,
    column: str,
    colour: str,
    label: str,
) -> bool:
    """Draw a stroke from low to high in every bin that has a value; False when none has."""
    low, high = series.band(column)
    known = np.isfinite(low)
    if not known.any():
        return False
    # One path of many strokes, parted by NaN: nothing is drawn across a gap. A stroke runs from
    # low to high over the width of its bin, so that a bin of one value is seen too.
    apart = np.full(int(known.sum()), np.nan)
    ax.plot(
        np.column_stack([edges[:-1][known], edges[1:][known], apart]).ravel(),
        np.column_stack([low[known], high[known], apart]).ravel(),
        color=colour, linewidth=0.9, solid_capstyle="projecting", label=label,
        marker="." if known.sum() < FEW_BINS else None,
    )  # fmt: skip
    return True


def _level_scale(ax: Axes, evaluation: Evaluation) -> None:
    low, high = (
        f(v) for f, v in zip((np.nanmin, np.nanmax), evaluation.strips.band("hpl_m"), strict=True)
    )
    summary = evaluation.hpl_m
    if low > 0 and summary is not None and high > LOG_FROM * summary.median:
        log_axis(ax, "y", low * 0.8, high * 1.25)
    bottom, top = ax.get_ylim()
    for limit in evaluation.settings.alert_limits_m:
        if bottom < limit < top:
            ax.axhline(limit, color=INK, linewidth=0.7, linestyle=(0, (4, 2)), zorder=3)
            ax.text(
                1.005, limit, f"AL {limit:g} m", transform=ax.get_yaxis_transform(), fontsize=6.5,
                va="center",
            )  # fmt: skip
