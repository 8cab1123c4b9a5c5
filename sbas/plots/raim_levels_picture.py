"""Fig. 5 of the EGNOS paper, HERL and HPL over time, and beside it how often RAIM's are larger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbas.monitoring.level_comparison import LevelComparison
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    GREEN,
    HALF_HEIGHT,
    INK,
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
from sbas.streaming import ThinnedSeries
from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

SHEET = Sheet(FULL_WIDTH, 4.1, left=0.62, top=0.48, rows=2)
MOST_STEPS = 1000
RATIO_SHEET = Sheet(FULL_WIDTH, HALF_HEIGHT, left=0.62, top=0.58)
BINS = 1200
FEW_BINS = 60
LOG_FROM = 6.0
"""Levels whose largest is so many times the smallest are drawn on a log scale."""
_RATIOS = (
    ("herl_m", VERMILION, "-", "HERL (not a bound)"),
    ("hpl_slope_m", ORANGE, (0, (4, 1.5)), "RAIM HPL by the largest slope"),
    ("like_hpl_m", GREEN, "-", "RAIM HPL by solution separation"),
)


def raim_levels(comparison: LevelComparison, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """HERL of RAIM and HPL of SBAS over time, HDOP below.

    Parameters
    ----------
    comparison : result of `sbas.raim_against_sbas`.
    axes : two axes, from top to bottom; a new figure without them.

    Returns
    -------
    (2,) the axes. Each stroke spans the smallest and largest value of its time bin, so that no
    spike is lost; a bin without a value stays empty. Bars at the foot stand for bins with epochs
    at which RAIM is not available, bars at the head for bins with an infinite HERL: there a fault
    would not show, which is one of the reasons why RAIM is not available.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4 and Fig. 5.
    """
    levels = comparison.levels
    with drawing(axes, SHEET) as (upper, lower):
        upper.set_ylabel("HERL, HPL [m]")
        lower.set_ylabel("HDOP [1]")
        if levels.empty:
            lower.set_xlabel("time")
            for ax in (upper, lower):
                sentence(ax, "no epoch in this recording")
            return np.array([upper, lower], dtype=object)
        series = _series(comparison)
        begin, end = _span_ns(comparison)
        unit_ns = time_axis(lower, begin, end)
        upper.set_xlim(lower.get_xlim())
        edges = (np.linspace(series.begin_ns, series.end_ns, series.bins + 1) - begin) / unit_ns
        values = levels["hpl_m"].to_numpy(), levels["herl_m"].to_numpy()
        labels = "HPL of SBAS", _herl_words(comparison)
        drawn = False
        for name, words, all_values, colour in zip(
            ("hpl_m", "herl_m"), labels, values, (BLUE, VERMILION), strict=True
        ):
            infinite = int(np.isinf(all_values).sum())
            words += f": {int(np.isfinite(all_values).sum()):,} of {len(levels):,} epochs"
            words += f", infinite at {infinite:,}" if infinite else ""
            drawn |= _strokes(upper, edges, series, name, colour, words)
        if drawn:
            _level_scale(upper, np.concatenate(values))
        else:
            sentence(upper, "no HERL and no HPL in this recording")
        _bars(upper, edges, series, "not_available", 0.02, MUTED)
        _bars(upper, edges, series, "infinite", 0.945, VERMILION)
        if not _strokes(lower, edges, series, "hdop", PURPLE, "HDOP"):
            sentence(lower, "no HDOP in this recording")
        upper.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, labelspacing=0.2
        )
        lacking = int((~levels["available"]).sum())
        text = "HERL is not a bound"
        if lacking:
            text += f"; grey at the foot: RAIM not available ({lacking:,} epochs)"
        endless = int(np.isinf(levels["herl_m"]).sum())
        if endless:
            text += f"; red at the head: HERL infinite ({endless:,})"
        _beside_first_label(upper, text, 13)
        return np.array([upper, lower], dtype=object)


def raim_level_ratios(comparison: LevelComparison, *, ax: Axes | None = None) -> Axes:
    """Share of epochs at which each level of RAIM is at most a multiple of the HPL of SBAS.

    Parameters
    ----------
    comparison : result of `sbas.raim_against_sbas`.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes. Only epochs count at which RAIM is available and both levels are finite and above 0;
    the legend has their number. A curve right of 1 is a level larger than the HPL. The level by
    solution separation has the HPL's own risk and alone is like it.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4.
    """
    with drawing(None if ax is None else [ax], RATIO_SHEET) as (ax,):
        ax.set_xlabel("level of RAIM / HPL of SBAS [1]")
        ax.set_ylabel("share of epochs at or below [1]")
        known = []
        for name, colour, line, words in _RATIOS:
            if name not in comparison.levels:
                continue
            ratio = np.sort(comparison.ratio(name))
            if not ratio.size:
                continue
            known.append(ratio)
            if name == "like_hpl_m" and comparison.risk is not None:
                words += f", the HPL's own risk {comparison.risk:.2g} per epoch"
            words += f": larger at {int((ratio > 1).sum()):,} of {ratio.size:,}"
            # Of many epochs so many quantiles as can be told apart, both ends among them.
            place = np.unique(
                np.linspace(0, ratio.size - 1, min(ratio.size, MOST_STEPS)).astype(int)
            )
            ax.step(
                np.append(ratio[0], ratio[place]), np.append(0.0, (place + 1) / ratio.size),
                where="post", color=colour,
                linestyle=line, label=words, marker="." if ratio.size < FEW_BINS else None,
            )  # fmt: skip
            ax.plot(np.median(ratio), 0.5, "o", color=colour, markerfacecolor="white", zorder=4)
        if not known:
            sentence(ax, "no epoch with a level of RAIM and an HPL")
            return ax
        low = min(0.8, *(float(r[0]) for r in known)) * 0.9
        log_axis(ax, "x", low, max(1.25, *(float(r[-1]) for r in known)) * 1.1)
        ax.set_ylim(-0.02, 1.02)
        ax.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (4, 2)))
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, labelspacing=0.2)
        epochs = len(comparison.levels)
        _beside_first_label(ax, f"of {epochs:,} epochs those with both; rings: medians", 22)
        return ax


def _herl_words(comparison: LevelComparison) -> str:
    design = comparison.raim.design
    rates = (
        "alpha, beta not stated"
        if design is None
        else f"alpha={design.outlier_alarm:g}, beta={design.missed_detection:g}"
    )
    return f"HERL, effect of the smallest detectable error, {rates}"


def _beside_first_label(ax: Axes, text: str, above_pt: float) -> None:
    """Small text at the right, level with the first line of a legend on top of the axes."""
    ax.annotate(
        text, (1.0, 1.0), xycoords="axes fraction", xytext=(0, above_pt),
        textcoords="offset points", fontsize=7, color=MUTED, ha="right", va="bottom",
    )  # fmt: skip


def _span_ns(comparison: LevelComparison) -> tuple[int, int]:
    time = comparison.levels.index.to_numpy().astype("M8[ns]").astype(np.int64)
    return int(time.min()), int(time.max())


def _series(comparison: LevelComparison) -> ThinnedSeries:
    """Values in bins; of few epochs each has a bin of its own and lies in its middle."""
    levels = comparison.levels
    time = levels.index.to_numpy().astype("M8[ns]").astype(np.int64)
    # Records out of order are no rarity: bins are filled from times that increase.
    order = np.argsort(time, kind="stable")
    time = time[order]
    step = np.diff(time)
    usual = max(int(np.median(step)), 1) if step.size else NS_PER_S
    bins = min(BINS, (int(time[-1]) - int(time[0])) // usual + 1)
    columns = ("hpl_m", "herl_m", "hdop", "not_available", "infinite")
    series = ThinnedSeries(int(time[0]) - usual // 2, int(time[-1]) + usual // 2, columns, bins)
    values: dict[str, Floats] = {}
    for name in ("hpl_m", "herl_m", "hdop"):
        column = levels[name].to_numpy(np.float64)[order]
        values[name] = np.where(np.isfinite(column), column, np.nan)
    for name, where in (
        ("not_available", ~levels["available"].to_numpy()),
        ("infinite", np.isinf(levels["herl_m"].to_numpy())),
    ):
        values[name] = np.where(where[order], 1.0, np.nan)
    series.update(time, values)
    return series


def _strokes(
    ax: Axes, edges: Floats, series: ThinnedSeries, column: str, colour: str, label: str
) -> bool:
    """A stroke from low to high in every bin that has a value; False when none has."""
    low, high = series.band(column)
    known = np.isfinite(low)
    if not known.any():
        ax.plot([], [], color=colour, label=label)
        return False
    apart = np.full(int(known.sum()), np.nan)
    ax.plot(
        np.column_stack([edges[:-1][known], edges[1:][known], apart]).ravel(),
        np.column_stack([low[known], high[known], apart]).ravel(),
        color=colour, linewidth=1.1, solid_capstyle="projecting", label=label,
        marker="." if known.sum() < FEW_BINS else None,
    )  # fmt: skip
    return True


def _bars(
    ax: Axes, edges: Floats, series: ThinnedSeries, column: str, foot: float, colour: str
) -> None:
    some = np.isfinite(series.band(column)[0])
    if some.any():
        ax.broken_barh(
            list(zip(edges[:-1][some], np.diff(edges)[some], strict=True)), (foot, 0.035),
            facecolor=colour, edgecolor=colour, linewidth=0.4,
            transform=ax.get_xaxis_transform(), zorder=3,
        )  # fmt: skip


def _level_scale(ax: Axes, values: Floats) -> None:
    finite = values[np.isfinite(values)]
    low, high = float(finite.min()), float(finite.max())
    if low > 0 and high > LOG_FROM * low:
        log_axis(ax, "y", low * 0.6, high * 1.4)
    else:
        ax.set_ylim(0, high * 1.1 if high > 0 else 1.0)
