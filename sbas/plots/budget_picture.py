"""The variance budget of one epoch: what makes each range, and so the level, uncertain."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.plots.style import (
    BLUE,
    GREEN,
    HALF_WIDTH,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    Sheet,
    drawing,
    note,
    sentence,
)
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

Floats = NDArray[np.float64]

SHEET = Sheet(HALF_WIDTH * 1.25, 4.3, left=0.85, right=0.15, bottom=1.62, top=0.3)
TERMS = (
    ("sigma_flt_m", "fast and long-term correction", BLUE, ""),
    ("sigma_uire_m", "ionosphere", ORANGE, "///"),
    ("sigma_tropo_m", "troposphere", GREEN, ""),
    ("sigma_air_m", "receiver and its multipath (air)", PURPLE, "xxxx"),
)
CUT_FROM = 6.0
"""A bar this many times longer than the median is cut: the others stay readable."""


def variance_budget(
    recording: Recording, time: np.datetime64 | str | None = None, *, ax: Axes | None = None
) -> Axes:
    """Variances of each range used at one epoch, stacked by source, with the total sigma.

    Parameters
    ----------
    recording : with the side table `satellites`, such as `protect` gives.
    time : GPS time of the epoch; by default that of the largest horizontal protection level.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes: a bar a satellite, the highest above. The upright stroke is the square of the total
    sigma, which is written beside it. Satellites left out are named below with their reasons.

    Raises
    ------
    InputError : the recording has no epoch at that time.

    References
    ----------
    RTCA DO-229D, J.1: sigma^2 = sigma_flt^2 + sigma_UIRE^2 + sigma_air^2 + sigma_tropo^2.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("variance of the range [m²]")
        ax.grid(visible=False, axis="y")
        table = recording.side_tables.get(SIDE_TABLE)
        if table is None or not {"satellite", "sigma_m", "used"} <= set(table):
            sentence(ax, "no variances of satellites in this recording")
            return ax
        row = _row_of(recording, time)
        if row is None:
            sentence(ax, "no protection level in this recording:\nname the time of an epoch")
            return ax
        at = recording.time[row]
        here = table[table["time"].to_numpy() == at]
        used = here[here["used"].to_numpy() & np.isfinite(here["sigma_m"].to_numpy())]
        ax.set_title(_title(recording, row, chosen=time is not None), fontsize=7.5, loc="left")
        if used.empty:
            sentence(ax, "no satellite was used at this epoch")
        else:
            _bars(ax, used)
        _left_out(ax, here)
        return ax


def _row_of(recording: Recording, time: np.datetime64 | str | None) -> int | None:
    times = recording.time
    if time is not None:
        asked = np.datetime64(str(time)).astype("M8[ns]")
        row = int(np.searchsorted(times, asked))
        if row < times.size and times[row] == asked:
            return row
        near = times[max(row - 1, 0) : row + 1]
        raise InputError(
            "the recording has no epoch at that time",
            evidence=f"{asked}; nearest {', '.join(map(str, near)) or 'none'}",
            cure="name the time of an epoch in GPS time",
        )
    if "hpl_m" not in recording.table:
        return None
    level = recording.table["hpl_m"].to_numpy()
    return int(np.nanargmax(level)) if np.isfinite(level).any() else None


def _title(recording: Recording, row: int, *, chosen: bool) -> str:
    epoch = recording.table.iloc[row]
    when = str(recording.time[row].astype("M8[ms]")).replace("T", " ").removesuffix(".000")
    mode = {"sbas_pa": ", PA", "sbas_npa": ", NPA"}.get(str(epoch.get("mode", "")), "")
    level = float(epoch.get("hpl_m", np.nan))
    words = f"HPL {level:.2f} m" if np.isfinite(level) else "no HPL"
    return f"{when} GPST{mode}: {words}{'' if chosen else ', the largest'}"


def _bars(ax: Axes, used: pd.DataFrame) -> None:
    if "elevation_deg" in used:
        used = used.sort_values("elevation_deg", kind="stable")
    total = used["sigma_m"].to_numpy() ** 2
    reach = _reach(total)
    y = np.arange(len(used))
    base = np.zeros(len(used))
    for column, words, colour, hatch in TERMS:
        if column not in used:
            continue
        width = np.nan_to_num(used[column].to_numpy() ** 2)
        if not width.any():
            continue
        ax.barh(
            y, width, left=base, height=0.68, color=colour, hatch=hatch,
            edgecolor="white", linewidth=0.4, zorder=2, label=f"{words}, {_range(used[column])}",
        )  # fmt: skip
        base = base + width
    # Terms that a recording does not give must not be mistaken for small ones.
    rest = np.maximum(total - base, 0)
    if np.any(rest > 1e-3 * total):
        ax.barh(
            y, rest, left=base, height=0.68, facecolor="white", edgecolor=MUTED, linewidth=0.6,
            label="not given by source", zorder=2,
        )  # fmt: skip
    ax.set_xlim(0, reach * 1.22)
    for place, variance in zip(y.tolist(), total.tolist(), strict=True):
        cut = variance > reach
        end = reach if cut else variance
        if not cut:
            ax.plot([end, end], [place - 0.42, place + 0.42], color=INK, linewidth=1.4, zorder=3)
        words = f"σ {np.sqrt(variance):.2f} m{' →' if cut else ''}"
        note(ax, end + 0.015 * reach, place, words, ha="left", fontsize=7, zorder=4)
    if "elevation_deg" in used:
        names = [
            f"{name} {elevation:.0f}°"
            for name, elevation in zip(used["satellite"], used["elevation_deg"], strict=True)
        ]
    else:
        names = [str(name) for name in used["satellite"]]
    ax.set_yticks(y, names)
    ax.set_ylim(-0.6, len(used) - 0.4)
    ax.legend(
        loc="upper left", bbox_to_anchor=(0.0, 0.0), bbox_transform=_below(ax, 0.36), ncols=1,
        borderaxespad=0, labelspacing=0.3, handlelength=1.3, columnspacing=1.4, fontsize=7,
    )  # fmt: skip


def _range(sigma: pd.Series[float]) -> str:
    """Smallest and largest sigma: terms too small for the picture have their size stated."""
    low, high = (f"{value:.2f}" for value in (sigma.min(), sigma.max()))
    return f"σ {low} m" if low == high else f"σ {low} to {high} m"


def _reach(variances: Floats) -> float:
    """The largest variance that is drawn whole."""
    whole = variances[variances <= CUT_FROM * np.median(variances)]
    return float(whole.max())


def _below(ax: Axes, down: float, *, left: float = 0.0) -> Transform:
    """Axes coordinates, shifted by lengths [inch] that do not depend on the picture's size."""
    from matplotlib.transforms import ScaledTranslation

    figure = ax.get_figure(root=True)
    assert figure is not None
    return ax.transAxes + ScaledTranslation(-left, -down, figure.dpi_scale_trans)


def _left_out(ax: Axes, here: pd.DataFrame) -> None:
    out = here[~here["used"].to_numpy()]
    if out.empty:
        return
    reason = out["reason"] if "reason" in out else pd.Series(np.nan, index=out.index)
    words = reason.astype(object).where(reason.notna(), "no reason given")
    groups = (
        f"{', '.join(map(str, names))} ({why})"
        for why, names in out["satellite"].astype(str).groupby(words.to_numpy(), sort=True)
    )
    text = textwrap.fill(f"Not used: {'; '.join(groups)}.", 88)
    ax.text(
        0.0, 0.0, text, transform=_below(ax, 1.04, left=0.55), fontsize=6.5, color=INK,
        ha="left", va="top", linespacing=1.25,
    )  # fmt: skip
