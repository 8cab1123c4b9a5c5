"""The side table `satellites` from PVTSatCartesian, GEOCorrections and PVTResiduals.

All three blocks speak of the satellites of one solution (PolaRx5TR Reference Guide 5.5.0,
p. 406-414); what they say of one satellite at one epoch is one row. Satellite positions are those
at transmission, turned by the Earth's rotation until reception (p. 406: "corrected for the Sagnac
effect"), so that the straight line to the fix is the line of sight.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_decode import Decoded, Removed
from sbas.logs.septentrio.sbf_epochs import Epochs, Index, gps_times
from sbas.logs.septentrio.sbf_sub_blocks import CODE, DOUBLE_DIFFERENCE, PHASE, Raw, SubBlocks
from sbas.satellite_table import satellite_table

Floats = NDArray[np.float64]

_SVIDS = 256
_SYSTEMS = (
    # First and last SVID, letter, first number (guide p. 298-299).
    (1, 37, "G", 1), (38, 61, "R", 1), (63, 68, "R", 25), (71, 106, "E", 1), (120, 140, "S", 20),
    (141, 180, "C", 1), (181, 187, "J", 1), (191, 197, "I", 1), (198, 215, "S", 41),
    (216, 222, "I", 8), (223, 245, "C", 41),
)  # fmt: skip
NAMES = [""] * _SVIDS
"""RINEX 3 name of each SVID, empty where none belongs to it: 62 is a GLONASS satellite of unknown
slot, 107..119 are L-band satellites, others are not defined."""
for _first, _last, _letter, _number in _SYSTEMS:
    for _svid in range(_first, _last + 1):
        NAMES[_svid] = f"{_letter}{_number + _svid - _first:02d}"
_NAMED = np.array([bool(name) for name in NAMES])

_LEAST_RADIUS_M, _FARTHEST_M = 6.4e6, 1e9
"""No satellite is inside the Earth, nor are fixes or satellites beyond the Moon."""
_SIGMAS = ("sigma_flt_m", "sigma_uire_m", "sigma_air_m", "sigma_tropo_m")
_POSITION = ("x_ecef_m", "y_ecef_m", "z_ecef_m")
_COLUMNS = ("elevation_deg", "azimuth_deg", *_POSITION, *_SIGMAS, "sigma_m", "residual_m", "mdb_m",
            "x_w", "x_signal", "used")  # fmt: skip


@dataclass
class Satellites:
    """Satellites of a stretch of a file.

    Parameters
    ----------
    time_ms, svid : (n,) time since 1980-01-06 [ms] and SVID of each row.
    columns : name -> (n,) values; of those that no block gave, there is none.
    removed : what was made missing.
    left_out : sub-blocks that no row took, by why.
    """

    time_ms: Index = field(default_factory=lambda: np.empty(0, np.int64))
    svid: Index = field(default_factory=lambda: np.empty(0, np.int64))
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    removed: Removed = field(default_factory=Counter)
    left_out: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Fixes:
    """Where each epoch was: (rows,) geodetic, NaN where not known."""

    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats


@dataclass(frozen=True)
class _Entries:
    """Sub-blocks of one number: (m,) group (epoch) of each, and the fields."""

    group: Index
    rows: Raw

    def take(self, chosen: NDArray[Any]) -> _Entries:
        return _Entries(
            self.group[chosen], {name: values[chosen] for name, values in self.rows.items()}
        )


def satellites_of(sub: Mapping[int, SubBlocks], epochs: Epochs, fixes: Fixes) -> Satellites:
    """Satellites of a stretch of a file, in the order of its epochs, then by SVID.

    Parameters
    ----------
    sub : block number -> sub-blocks.
    epochs : rows of the epoch table; blocks of another time keep that time.
    fixes : positions of the epochs; elevation and azimuth are missing where one is missing.
    """
    out = Satellites()
    sub = {number: blocks for number, blocks in sub.items() if len(blocks.count)}
    if not sub:
        return out
    groups, group_of = _groups(sub, epochs)
    entries = {n: _entries(n, sub[n], group_of[n], out.left_out) for n in sub}
    seen = np.zeros(_SVIDS, np.bool_)
    for found in entries.values():
        seen[found.rows["svid"]] = True
    svids = np.flatnonzero(seen)
    code = np.zeros(_SVIDS, np.int64)
    code[svids] = np.arange(len(svids))
    slots = _Slots(len(groups.time_ms), len(svids))
    keys = {}
    for n, found in entries.items():
        keys[n] = found.group * len(svids) + code[found.rows["svid"]]
        chosen = slots.claim(keys[n], _preference(n, found))
        if chosen is not None:
            out.left_out[_SECOND[n]] += len(keys[n]) - len(chosen)
            entries[n], keys[n] = found.take(chosen), keys[n][chosen]
    slots.number()
    rows = {n: slots.row[keys[n]] for n in keys}
    _fill(entries, rows, slots, groups, fixes, out)
    out.time_ms, out.svid = groups.time_ms[slots.group], svids[slots.satellite]
    return out


def side_table(parts: Sequence[Satellites]) -> pd.DataFrame | None:
    """The side table of parts that follow each other; None where none has a satellite."""
    parts = [part for part in parts if len(part.svid)]
    if not parts:
        return None
    svid = np.concatenate([part.svid for part in parts])
    svids = np.unique(svid)
    code = np.zeros(_SVIDS, np.int16)
    code[svids] = np.arange(len(svids))
    satellite = pd.Categorical.from_codes(code[svid], categories=[NAMES[i] for i in svids])
    given = {name for part in parts for name in part.columns}
    columns = {name: _joined(parts, name) for name in _COLUMNS if name in given}
    times = gps_times(np.concatenate([part.time_ms for part in parts]))
    return satellite_table(times, {"satellite": satellite, **columns})


def _joined(parts: Sequence[Satellites], name: str) -> NDArray[Any]:
    if len(parts) == 1:
        return parts[0].columns[name]
    missing = {"x_signal": np.int16(-1)}.get(name, np.nan)
    return np.concatenate(
        [
            part.columns[name] if name in part.columns else np.full(len(part.svid), missing)
            for part in parts
        ]
    )


_SECOND = {
    sbf.SATELLITE_POSITIONS: "satellites named twice in PVTSatCartesian",
    sbf.GEO_CORRECTIONS: "satellites named twice in GEOCorrections",
    sbf.RESIDUALS: "residuals of further signals or base stations",
}


@dataclass(frozen=True)
class _Groups:
    """Epochs with satellites: (g,) time and row of the epoch table, -1 where it has none."""

    time_ms: Index
    row: Index


def _groups(sub: Mapping[int, SubBlocks], epochs: Epochs) -> tuple[_Groups, dict[int, Index]]:
    """The epochs with satellites in file order, and the group of each block of each number."""
    time_ms = np.concatenate([blocks.blocks["time_ms"] for blocks in sub.values()])
    position = np.concatenate([blocks.blocks["position"] for blocks in sub.values()])
    row = _rows_of_epochs(time_ms, position, epochs)
    label = row.copy()
    stray = row < 0
    if stray.any():
        label[stray] = len(epochs.time_ms) + np.unique(time_ms[stray], return_inverse=True)[1]
    labels = int(label.max(initial=0)) + 1
    first = np.full(labels, np.iinfo(np.int64).max)
    np.minimum.at(first, label, position)
    with_blocks = np.flatnonzero(first < np.iinfo(np.int64).max)
    # Epochs first by where they begin, blocks without an epoch by where they are.
    known = with_blocks < len(epochs.time_ms)
    first[with_blocks[known]] = epochs.first[with_blocks[known]]
    order = with_blocks[np.argsort(first[with_blocks], kind="stable")]
    rank = np.empty(labels, np.int64)
    rank[order] = np.arange(len(order))
    times = np.empty(labels, np.int64)
    times[label] = time_ms
    rows = np.where(order < len(epochs.time_ms), order, -1)
    ends = np.cumsum([len(blocks.count) for blocks in sub.values()])
    parts = np.split(rank[label], ends[:-1])
    return _Groups(times[order], rows), dict(zip(sub, parts, strict=True))


def _rows_of_epochs(time_ms: Index, position: Index, epochs: Epochs) -> Index:
    """(n,) row of the epoch of the same time, -1 where there is none.

    Where a time is there twice, the epoch that begins nearest in the file is meant.
    """
    if not len(epochs.time_ms):
        return np.full(len(time_ms), -1)
    order = None
    if (np.diff(epochs.time_ms) <= 0).any():
        order = np.lexsort((epochs.first, epochs.time_ms))
    times = epochs.time_ms if order is None else epochs.time_ms[order]
    low = np.searchsorted(times, time_ms)
    near = np.minimum(low, len(times) - 1)
    found = times[near] == time_ms
    if order is None:
        return np.where(found, near, -1)
    if epochs.duplicate is not None:
        # Of the epochs of one time, sorted by place, the one at or behind the block or the one
        # before it is nearest.
        width = int(max(position.max(), epochs.first.max())) + 1
        first = epochs.first[order]
        begin = np.searchsorted(times, times)
        behind = np.searchsorted(begin * width + first, near * width + position)
        last = np.searchsorted(times, time_ms, side="right") - 1
        behind = np.where(found, np.minimum(behind, last), 0)
        before = np.where(found, np.maximum(behind - 1, low), 0)
        nearer = np.abs(first[before] - position) <= np.abs(first[behind] - position)
        near = np.where(nearer, before, behind)
    return np.where(found, order[near], -1)


def _entries(number: int, sub: SubBlocks, group: Index, left_out: Counter[str]) -> _Entries:
    """The sub-blocks of satellites with a name, with their epochs; others are counted."""
    rows = sub.rows
    keep = _NAMED[rows["svid"]]
    if not keep.all():
        left_out["sub-blocks of no known satellite"] += int(np.count_nonzero(~keep))
    if number == sbf.RESIDUALS:
        main = (rows["signal"] >> 5) == 0
        if not main.all():
            left_out["residuals of other antennas"] += int(np.count_nonzero(keep & ~main))
            keep = keep & main
    owner = np.repeat(group, sub.count)
    if not keep.all():
        owner, rows = owner[keep], {name: values[keep] for name, values in rows.items()}
    return _Entries(owner, rows)


def _preference(number: int, found: _Entries) -> NDArray[np.uint8] | None:
    """(m,) the lower the better: a code residual, else one of phase, then the lower signal."""
    if number != sbf.RESIDUALS:
        return None
    info = found.rows["info"]
    lacks = np.where((info & CODE) != 0, 0, np.where((info & PHASE) != 0, 32, 64))
    return ((found.rows["signal"] & 31) + lacks).astype(np.uint8)


class _Slots:
    """Rows of the table: the pairs of epoch and satellite that any block names."""

    group: Index
    satellite: Index
    row: Index

    def __init__(self, groups: int, satellites: int) -> None:
        self.satellites = satellites
        self._named = np.zeros(groups * satellites, np.bool_)

    def claim(self, keys: Index, preference: NDArray[np.uint8] | None) -> NDArray[np.intp] | None:
        """Note (m,) pairs; which of them to take where pairs come twice, else `None` for all."""
        mine = np.zeros(len(self._named), np.bool_)
        mine[keys] = True
        self._named |= mine
        if int(np.count_nonzero(mine)) == len(keys):
            return None
        order = np.arange(len(keys))
        if preference is not None:
            order = np.argsort(preference, kind="stable")
        winner = np.full(len(self._named), -1)
        # Of equal keys the last one written stays, so the best goes last.
        winner[keys[order[::-1]]] = order[::-1]
        return np.sort(winner[winner >= 0])

    def number(self) -> None:
        """Give the pairs their rows, by epoch and then by satellite."""
        flat = np.flatnonzero(self._named)
        self.row = np.cumsum(self._named) - 1
        self.group = flat // self.satellites
        self.satellite = flat - self.group * self.satellites

    def __len__(self) -> int:
        return len(self.group)


def _fill(
    entries: Mapping[int, _Entries],
    rows: Mapping[int, Index],
    slots: _Slots,
    groups: _Groups,
    fixes: Fixes,
    out: Satellites,
) -> None:
    """Put what each number says of the satellites into the columns."""
    columns = out.columns
    columns["used"] = np.ones(len(slots), np.bool_)
    if sbf.SATELLITE_POSITIONS in entries:
        done = _positions(entries[sbf.SATELLITE_POSITIONS].rows["xyz"])
        _spread(done, rows[sbf.SATELLITE_POSITIONS], len(slots), out)
        xyz = [columns[name] for name in _POSITION]
        directions = _directions(xyz, fixes, groups.row[slots.group])
        columns["elevation_deg"], columns["azimuth_deg"] = directions
    if sbf.GEO_CORRECTIONS in entries:
        done = _sigmas(entries[sbf.GEO_CORRECTIONS].rows)
        _spread(done, rows[sbf.GEO_CORRECTIONS], len(slots), out)
    if sbf.RESIDUALS in entries:
        raw, at = entries[sbf.RESIDUALS].rows, rows[sbf.RESIDUALS]
        with_code = (raw["info"] & CODE) != 0
        own = with_code & ((raw["info"] & 3) < DOUBLE_DIFFERENCE)
        if against := int(np.count_nonzero(with_code & ~own)):
            out.left_out["residuals against another satellite"] += against
        done = _residuals({name: values[own] for name, values in raw.items()})
        _spread(done, at[own], len(slots), out)
        columns["x_signal"] = np.full(len(slots), -1, np.int16)
        columns["x_signal"][at[own]] = raw["signal"][own] & 31
        # Where an epoch has residuals, a satellite without code and phase gave velocity only.
        told = np.zeros(len(groups.time_ms), np.bool_)
        told[slots.group[at]] = True
        columns["used"] = ~told[slots.group]
        columns["used"][at] = (raw["info"] & (CODE | PHASE)) != 0


def _spread(done: Decoded, at: Index, rows: int, out: Satellites) -> None:
    """Put values into the columns at their rows, NaN elsewhere."""
    everywhere = len(at) == rows and bool((np.diff(at) == 1).all())
    for name, values in done.columns.items():
        if not everywhere:
            column = np.full(rows, np.nan)
            column[at] = values
            values = column
        out.columns[name] = values
    out.removed.update(done.removed)


def _positions(xyz: NDArray[np.float64]) -> Decoded:
    done = Decoded()
    axes = [done.floats(f"satellites.{name}", xyz[:, i]) for i, name in enumerate(_POSITION)]
    far = np.fmax.reduce([np.abs(values) for values in axes]) > _FARTHEST_M
    for name, values in zip(_POSITION, axes, strict=True):
        done.remove(f"satellites.{name}", "position beyond the Moon", far, values)
    inside = np.sqrt(axes[0] ** 2 + axes[1] ** 2 + axes[2] ** 2) < _LEAST_RADIUS_M
    for name, values in zip(_POSITION, axes, strict=True):
        done.remove(f"satellites.{name}", "position inside the Earth", inside, values)
        done.columns[name] = values
    return done


def _sigmas(raw: Raw) -> Decoded:
    """Root of each variance, and of their sum where all four are there."""
    done = Decoded()
    absent = ~raw["with_variances"]
    total = np.zeros(len(absent))
    for i, name in enumerate(_SIGMAS):
        variance = done.floats(f"satellites.{name}", raw["variances"][:, i])
        done.remove(f"satellites.{name}", "negative variance", variance < 0, variance)
        variance[absent] = np.nan
        total += variance
        done.columns[name] = np.sqrt(variance)
    done.columns["sigma_m"] = np.sqrt(total)
    return done


def _residuals(raw: Raw) -> Decoded:
    """Code residual, its minimal detectable bias and the size of its w-test statistic."""
    done = Decoded()
    done.columns = {
        "residual_m": done.floats("satellites.residual_m", raw["residual"]),
        "mdb_m": done.scaled("satellites.mdb_m", raw["mdb"], 65535, unit=0.1),
        "x_w": done.scaled("satellites.x_w", raw["w"], 65535, unit=0.001),
    }
    return done


def _directions(xyz: Sequence[Floats], fixes: Fixes, row: Index) -> tuple[Floats, Floats]:
    """(n,) elevation and azimuth [deg] of satellites as seen from the fixes of their epochs.

    The line of sight in east, north, up (Misra and Enge, Global Positioning System, 2nd ed.,
    eq. 4.26), turned from the axes of the Earth with sines and cosines taken once an epoch.
    """
    from pymap3d import geodetic2ecef  # 0.1 s to import, needed by few files

    known = np.isfinite(fixes.lat_deg + fixes.lon_deg)
    known &= np.abs(fixes.height_m) < _FARTHEST_M
    if not known.any():
        nothing = np.full(len(row), np.nan)
        return nothing, nothing.copy()
    lat, lon = np.where(known, fixes.lat_deg, 0.0), np.where(known, fixes.lon_deg, 0.0)
    height = np.where(known, fixes.height_m, 0.0)
    fix = np.array(geodetic2ecef(lat, lon, height))
    fix[:, ~known] = np.nan
    sin_lat, cos_lat = np.sin(np.radians(lat)), np.cos(np.radians(lat))
    sin_lon, cos_lon = np.sin(np.radians(lon)), np.cos(np.radians(lon))
    dx, dy, dz = (values - fix[i][row] for i, values in enumerate(xyz))
    for values in (dx, dy, dz):
        values[row < 0] = np.nan
    outward = cos_lon[row] * dx + sin_lon[row] * dy
    east = cos_lon[row] * dy - sin_lon[row] * dx
    north = cos_lat[row] * dz - sin_lat[row] * outward
    up = cos_lat[row] * outward + sin_lat[row] * dz
    elevation = np.degrees(np.arctan2(up, np.sqrt(east**2 + north**2)))
    azimuth = np.degrees(np.arctan2(east, north))
    azimuth[azimuth < 0] += 360.0
    azimuth[azimuth >= 360.0] = 0.0
    return elevation, azimuth
