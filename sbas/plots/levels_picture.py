"""Horizontal protection levels of several recordings over time, and when there was none."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    GREEN,
    MUTED,
    ORANGE,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    sentence,
)
from sbas.plots.time_axis import time_axis
from sbas.recording import Recording
from sbas.streaming import ThinnedSeries
from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Bools = NDArray[np.bool_]

SHEET = Sheet(FULL_WIDTH, 2.6, left=0.62, top=0.28)
BINS = 1200
FEW_BINS = 60
LOG_FROM = 6.0
"""Levels whose largest is so many times the smallest are drawn on a log scale."""
LOOKS = ((BLUE, 2.0), (ORANGE, 1.0), (GREEN, 0.8), (PURPLE, 0.8), (VERMILION, 0.8))
"""Colour and width of each recording in turn: the wider first, so that equal ones are both seen."""


def level_lines(recordings: Mapping[str, Recording], *, ax: Axes | None = None) -> Axes:
    """HPL of one to five recordings over time; epochs without a level as bars at the foot.

    Parameters
    ----------
    recordings : by the name each has in the legend, such as {"PA": pa, "NPA": npa}.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. Each stroke spans the smallest and largest level of its time bin, so that no spike
    is lost. A bar at the foot stands for epochs that were recorded and have no level.

    Raises
    ------
    ValueError : more recordings than can be told apart.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 3 (PA against NPA).
    """
    if len(recordings) > len(LOOKS):
        raise ValueError(f"at most {len(LOOKS)} recordings, not {len(recordings)}")
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_ylabel("HPL [m]")
        times = [r.time.astype(np.int64) for r in recordings.values() if len(r)]
        if not times:
            ax.set_xlabel("time")
            sentence(ax, "no epoch in these recordings")
            return ax
        begin, end = min(int(t[0]) for t in times), max(int(t[-1]) for t in times)
        unit_ns = time_axis(ax, begin, end)
        low, high = np.inf, -np.inf
        for (name, recording), (colour, width) in zip(recordings.items(), LOOKS, strict=False):
            level = _levels(recording)
            known = np.isfinite(level)
            label = f"{name}, {int(known.sum()):,} of {level.size:,} epochs"
            if not known.any():
                ax.plot([], [], color=colour, linewidth=width, label=label)
                continue
            series = _series(recording, level, begin, end)
            edges = (np.linspace(series.begin_ns, series.end_ns, series.bins + 1) - begin) / unit_ns
            _strokes(ax, edges, series, colour=colour, width=width, label=label)
            low, high = min(low, float(level[known].min())), max(high, float(level[known].max()))
        if high < low:
            sentence(ax, "no protection level in these recordings")
        elif low > 0 and high > LOG_FROM * low:
            log_axis(ax, "y", low * 0.6, high * 1.25)
        else:
            ax.set_ylim(0, high * 1.1)
        for i, (recording, (colour, _)) in enumerate(zip(recordings.values(), LOOKS, strict=False)):
            ax.broken_barh(
                [
                    ((a - begin) / unit_ns, (b - a) / unit_ns)
                    for a, b in _spans_ns(recording, ~np.isfinite(_levels(recording)))
                ],
                (0.02 + 0.05 * i, 0.035), facecolor=colour, edgecolor="none",
                transform=ax.get_xaxis_transform(), zorder=3,
            )  # fmt: skip
        if any(not np.isfinite(_levels(r)).all() for r in recordings.values()):
            ax.text(
                0.0, 1.02, "bars at the foot: epochs without a level", fontsize=7, color=MUTED,
                transform=ax.transAxes, va="bottom",
            )  # fmt: skip
        ax.legend(
            loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderaxespad=0,
            columnspacing=1.4,
        )  # fmt: skip
        return ax


def _levels(recording: Recording) -> NDArray[np.float64]:
    if "hpl_m" not in recording.table:
        return np.full(len(recording), np.nan)
    level: NDArray[np.float64] = recording.table["hpl_m"].to_numpy()
    return level


def _series(
    recording: Recording, level: NDArray[np.float64], begin_ns: int, end_ns: int
) -> ThinnedSeries:
    """Levels in bins; of few epochs each has a bin of its own and lies in its middle."""
    time = recording.time.astype(np.int64)
    usual = _usual_step_ns(time)
    bins = min(BINS, (end_ns - begin_ns) // usual + 1)
    series = ThinnedSeries(begin_ns - usual // 2, end_ns + usual // 2, ("hpl_m",), bins)
    series.update(time, {"hpl_m": level})
    return series


def _usual_step_ns(time_ns: NDArray[np.int64]) -> int:
    return max(int(np.median(np.diff(time_ns))), 1) if time_ns.size > 1 else NS_PER_S


def _strokes(
    ax: Axes,
    edges: NDArray[np.float64],
    series: ThinnedSeries,
    *,
    colour: str,
    width: float,
    label: str,
) -> None:
    low, high = series.band("hpl_m")
    known = np.isfinite(low)
    apart = np.full(int(known.sum()), np.nan)
    ax.plot(
        np.column_stack([edges[:-1][known], edges[1:][known], apart]).ravel(),
        np.column_stack([low[known], high[known], apart]).ravel(),
        color=colour, linewidth=width, solid_capstyle="projecting", label=label,
        marker="." if known.sum() < FEW_BINS else None,
    )  # fmt: skip


def _spans_ns(recording: Recording, where: Bools) -> list[tuple[int, int]]:
    """(begin, end) of each run of true epochs; an epoch lasts the usual interval, or to the
    next."""
    time = recording.time.astype(np.int64)
    if not time.size:
        return []
    step = np.diff(time)
    usual = _usual_step_ns(time)
    last = np.append(time[:-1] + np.minimum(step, usual), time[-1] + usual)
    edge = np.flatnonzero(np.diff(where.astype(np.int8), prepend=0, append=0))
    spans: list[tuple[int, int]] = []
    for first, stop in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
        # A run that holds a gap of the record is cut there: nothing is known of it.
        cuts = first + 1 + np.flatnonzero(step[first : stop - 1] > 1.5 * usual)
        bounds = [first, *cuts.tolist(), stop]
        spans += [(int(time[a]), int(last[b - 1])) for a, b in pairwise(bounds)]
    return spans
