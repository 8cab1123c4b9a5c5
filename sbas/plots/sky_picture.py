"""Where the satellites stood, and which were used, from the satellite table of a recording."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.numerals import number
from sbas.plots.reason_classes import CLASSES, USED, classes_of
from sbas.plots.style import HALF_WIDTH, INK, LINE, MUTED, Sheet, drawing, note, sentence
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHEET = Sheet(HALF_WIDTH, 4.9, left=0.12, right=0.12, bottom=0.95, top=0.12)
TRACK_POINTS = 400
"""Of longer tracks so many points are drawn, and every point at which the class changes."""
BREAK_DEG = 5.0
"""A track is not drawn across a longer way: the satellite was away, or set and rose again."""

COMPASS = (("N", 0.0, 96.0), ("E", 96.0, 0.0), ("S", 0.0, -96.0), ("W", -96.0, 0.0))
RING_DEG = 5.0
"""Outer radius of the ring round a mark [deg of the picture]."""

_MASK = re.compile(r"elevation_mask_deg=([0-9.]+)")


def sky(recording: Recording, *, ax: Axes | None = None) -> Axes:
    """Tracks of all satellites by azimuth and elevation, and why the unused were left out.

    Parameters
    ----------
    recording : with the side table `satellites`, such as `protect` gives.
    ax : Cartesian axes to draw on; a new figure without them.

    Returns
    -------
    The axes: zenith in the middle, horizon at radius 90, north up. A mark with the name shows
    where and as what a satellite was last seen. The ring round it divides all its ranges by what
    became of them, clockwise from north; the share used stands beside the name unless it is all
    or none. The dashed circle is the elevation mask that the recording states.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        _horizon(ax, _mask_deg(recording))
        table = recording.side_tables.get(SIDE_TABLE)
        if table is None or not {"satellite", "elevation_deg", "azimuth_deg"} <= set(table):
            sentence(ax, "no directions of satellites in this recording")
            return ax
        elevation = table["elevation_deg"].to_numpy()
        with np.errstate(invalid="ignore"):
            shown = np.isfinite(table["azimuth_deg"].to_numpy()) & (elevation >= 0)
        if not shown.any():
            sentence(ax, "no directions of satellites in this recording")
            return ax
        kind = classes_of(table)
        _tracks(ax, table[shown], kind[shown])
        _legend(ax, kind, int(np.count_nonzero(~shown)))
        return ax


def _mask_deg(recording: Recording) -> float | None:
    found = _MASK.search(recording.meta.options.get("protect", ""))
    return float(found[1]) if found else None


def _horizon(ax: Axes, mask_deg: float | None) -> None:
    from matplotlib.patches import Circle

    ax.set_aspect("equal")
    ax.set_xlim(-101, 101)
    ax.set_ylim(-101, 101)
    ax.grid(visible=False)
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_visible(False)
    for elevation in (0, 30, 60):
        edge = MUTED if elevation == 0 else LINE
        ax.add_patch(Circle((0, 0), 90 - elevation, fill=False, edgecolor=edge, linewidth=0.7))
        if elevation:
            note(ax, 0, 90 - elevation, f"{elevation}°", fontsize=6, color=MUTED)
    ax.plot([-90, 90, np.nan, 0, 0], [0, 0, np.nan, -90, 90], color=LINE, linewidth=0.6, zorder=0)
    for name, x, y in COMPASS:
        ax.text(x, y, name, ha="center", va="center", fontsize=7, color=INK)
    if mask_deg is not None:
        ax.add_patch(
            Circle(
                (0, 0), 90 - mask_deg, fill=False, edgecolor=INK, linewidth=0.7,
                linestyle=(0, (4, 3)),
            )
        )  # fmt: skip
        ax.plot(
            [], [], color=INK, linewidth=0.7, linestyle=(0, (4, 3)),
            label=f"elevation mask, {number(mask_deg)}°",
        )  # fmt: skip


def _tracks(ax: Axes, table: pd.DataFrame, kind: Ints) -> None:
    """Lines of every satellite by class, and its last place with its name."""
    radius = 90 - table["elevation_deg"].to_numpy()
    azimuth = np.radians(table["azimuth_deg"].to_numpy())
    x, y = radius * np.sin(azimuth), radius * np.cos(azimuth)
    time = table["time"].to_numpy()
    satellite = table["satellite"].astype("category").cat
    codes = satellite.codes.to_numpy()
    last: list[tuple[float, float, str]] = []
    for code, name in enumerate(satellite.categories):
        rows = np.flatnonzero(codes == code)
        if not rows.size:
            continue
        rows = rows[np.argsort(time[rows], kind="stable")]
        thin = _thinned(kind[rows])
        _one_track(ax, x[rows[thin]], y[rows[thin]], kind[rows[thin]])
        end = rows[-1]
        look = CLASSES[kind[end]]
        ax.plot(
            x[end], y[end], color=look.colour, marker=look.marker, markersize=4.5,
            markeredgecolor="white", markeredgewidth=0.4, linestyle="none", zorder=5,
        )  # fmt: skip
        _shares(ax, x[end], y[end], kind[rows])
        used = float(np.mean(kind[rows] == USED))
        last.append((x[end], y[end], _name(str(name), used, rows.size)))
    _names(ax, last)


def _shares(ax: Axes, x: float, y: float, kind: Ints) -> None:
    """A ring round a mark, divided by the classes of all its satellite's ranges."""
    from matplotlib.patches import Wedge

    counts = np.bincount(kind, minlength=len(CLASSES))
    ends = 90 - 360 * np.cumsum(counts) / kind.size
    for look, count, end in zip(CLASSES, counts.tolist(), ends.tolist(), strict=True):
        if count:
            begin = end + 360 * count / kind.size
            ax.add_patch(
                Wedge(
                    (x, y), RING_DEG, end, begin, width=1.7, facecolor=look.colour,
                    edgecolor="white", linewidth=0.3, zorder=4,
                )
            )  # fmt: skip


def _name(satellite: str, used: float, ranges: int) -> str:
    """The name, and the share of ranges used unless that is all or none."""
    if used in (0.0, 1.0):
        return satellite
    # Never rounded to all or none.
    share = min(max(round(100 * used), 1), 99)
    return f"{satellite} {share} %" if ranges > 1 else satellite


def _thinned(kind: Ints) -> Ints:
    """Rows of a track that are drawn: some, and all at which the class changes."""
    n = kind.size
    keep = np.arange(n) % max(1, -(-n // TRACK_POINTS)) == 0
    change = np.flatnonzero(np.diff(kind))
    keep[change], keep[change + 1], keep[-1] = True, True, True
    return np.flatnonzero(keep)


def _one_track(ax: Axes, x: Floats, y: Floats, kind: Ints) -> None:
    whole = np.hypot(np.diff(x), np.diff(y)) <= BREAK_DEG
    for number_of, look in enumerate(CLASSES):
        # A step belongs to the class it leads to, so that one lost epoch is seen.
        step = np.flatnonzero(whole & (kind[1:] == number_of))
        if not step.size:
            continue
        apart = np.full(step.size, np.nan)
        ax.plot(
            np.column_stack([x[step], x[step + 1], apart]).ravel(),
            np.column_stack([y[step], y[step + 1], apart]).ravel(),
            color=look.colour, linewidth=1.6 if number_of == USED else 3.2,
            solid_capstyle="butt", zorder=3 if number_of == USED else 2,
        )  # fmt: skip


_PLACES: tuple[tuple[float, float, str, str], ...] = (
    (7.0, 0.0, "left", "center"), (-7.0, 0.0, "right", "center"),
    (0.0, 7.0, "center", "bottom"), (0.0, -7.0, "center", "top"),
    (5.0, 6.0, "left", "bottom"), (5.0, -6.0, "left", "top"),
    (-5.0, 6.0, "right", "bottom"), (-5.0, -6.0, "right", "top"),
)  # fmt: skip
"""Where a name may stand beside its mark: offset [deg of the picture], alignments."""


def _names(ax: Axes, last: list[tuple[float, float, str]]) -> None:
    """Write each name on the side of its mark where the most room is."""
    marks = np.array([(x, y) for x, y, _ in last])
    taken = [(x, y) for _, x, y in COMPASS]
    for x, y, text in last:
        half = 2.6 * len(text)

        def room(place: tuple[float, float, str, str], x: float = x, y: float = y,
                 half: float = half) -> float:  # fmt: skip
            dx, dy, across, _ = place
            middle = x + dx + {"left": half, "right": -half, "center": 0.0}[across]
            up = y + dy + (3.0 if dy > 0 else -3.0 if dy < 0 else 0.0)
            others = np.array([*marks[(marks != (x, y)).any(axis=1)], *taken])
            # Words are wide and low: a neighbour above is less in the way than one beside.
            apart = np.hypot((others[:, 0] - middle) / max(half / 6, 1.0), others[:, 1] - up)
            outside = max(0.0, abs(middle) + half - 96, abs(up) - 96)
            return float(min(apart.min(), 25.0)) - 5 * outside

        dx, dy, across, along = max(_PLACES, key=room)
        taken.append((x + dx + {"left": half, "right": -half, "center": 0.0}[across], y + dy))
        note(ax, x + dx, y + dy, text, fontsize=6.5, ha=across, va=along, zorder=5)


def _legend(ax: Axes, kind: Ints, hidden: int) -> None:
    """Classes with their share of all ranges; what has no direction is counted."""
    counts = np.bincount(kind, minlength=len(CLASSES))
    for count, look in zip(counts.tolist(), CLASSES, strict=True):
        if count:
            ax.plot(
                [], [], color=look.colour, marker=look.marker, markersize=5,
                markeredgecolor="white", markeredgewidth=0.4, linewidth=1.6,
                label=f"{look.words}: {count:,} ({number(100 * count / kind.size, 2)} %)",
            )  # fmt: skip
    if hidden:
        ax.plot([], [], linestyle="none",
                label=f"{hidden:,} ranges of unknown direction are not drawn")  # fmt: skip
    ax.legend(
        loc="upper left", bbox_to_anchor=(0.0, -0.005), ncols=1, borderaxespad=0, fontsize=6.5,
        labelspacing=0.3, handlelength=1.8,
        title=f"{kind.size:,} ranges", title_fontsize=6.5, alignment="left",
    )  # fmt: skip
