"""Columns of the epoch table from the sentences of each epoch."""

from __future__ import annotations

from collections import Counter
from collections.abc import Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.nmea.nmea_cycles import Epochs
from sbas.logs.nmea.nmea_sentences import GBS_COLUMNS, POSITIONS, UNSTATED, Columns
from sbas.logs.sentinels import remove_sentinels
from sbas.recording import MODES, Flag

FILLED = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "n_sv",
    "n_sv_tracked", "mode", "geo_prn", "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2",
    "speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps", "correction_age_s", "flags",
)  # fmt: skip
"""Documented columns; the levels are there to show that NMEA has none."""

EXTRA: dict[str, tuple[str, ...]] = {
    "x_undulation_m": ("GGA", "GNS"), "x_station_id": ("GGA", "GNS"),
    "x_h_accuracy_m": ("PUBX",), "x_v_accuracy_m": ("PUBX",),
    **dict.fromkeys(GBS_COLUMNS, ("GBS",)),
}  # fmt: skip
"""Further columns, and the kinds of sentences of which one must occur."""

CAPPED_SATELLITES = 12
"""GGA often counts no more than the twelve satellites that one GSA can list."""
_UNKNOWN_AGE_S = (999.0, 999.9)
_SIGMAS = ("sigma_e_m", "sigma_n_m", "sigma_u_m")
_NONE, _DGNSS, _SBAS = (MODES.index(name) for name in ("none", "dgnss", "sbas"))
_ROUNDING = 1.001

Raw = dict[str, NDArray[Any]]


@dataclass
class Tally:
    """What was seen and done on the way through a file."""

    sentences: Counter[str] = field(default_factory=Counter)
    removed: dict[str, Counter[str]] = field(default_factory=dict)
    no_separation: int = 0
    given_separation: int = 0
    differing: int = 0
    largest_difference_deg: float = 0.0
    contradicted: int = 0
    invalid_positions: int = 0
    differential: int = 0
    more_in_gsa: int = 0
    other_groups: int = 0
    odd_ellipses: int = 0
    unattached: int = 0
    other_dates: int = 0
    damaged: int = 0


def needed(columns: Set[str]) -> set[str]:
    """The columns to decode for those asked: what decides whether a value counts."""
    want = set(columns)
    if want & {"flags", "lat_deg", "lon_deg", "height_m", "speed_mps", "vel_e_mps", "vel_n_mps",
               "vel_u_mps"}:  # fmt: skip
        want.add("mode")
    if "flags" in want:
        want |= {"lat_deg", "lon_deg", "height_m"}
    if want & {"lat_deg", "lon_deg"}:
        want |= {"lat_deg", "lon_deg"}
    if "cov_en_m2" in want:
        want |= {"sigma_e_m", "sigma_n_m"}
    return want


def kinds_for(want: Set[str]) -> set[str]:
    """Kinds of sentences to decode for some columns; those with a position make the epochs."""
    kinds = {*POSITIONS, "ZDA"}
    if want & {*_SIGMAS, "cov_en_m2"}:
        kinds.add("GST")
    if want & GBS_COLUMNS.keys():
        kinds.add("GBS")
    if want & {"hdop", "vdop", "pdop", "n_sv", "geo_prn", "flags"}:
        kinds.add("GSA")
    if "n_sv_tracked" in want:
        kinds.add("GSV")
    if want & {"speed_mps", "vel_e_mps", "vel_n_mps"}:
        kinds.add("VTG")
    return kinds


def fill(epochs: Epochs, want: Set[str], *, sbas: bool, geoid: float | None, tally: Tally) -> Raw:
    """Raw columns of some epochs: `mode` as an index into MODES, `flags` without the date's.

    Parameters
    ----------
    epochs : whole epochs.
    want : columns, as `needed` gives them.
    sbas : whether a differential fix is one with SBAS corrections.
    geoid : undulation [m] where a sentence has none.
    tally : counts, added to.
    """
    build = _Build(epochs, want, tally)
    raw = build.raw
    build.position()
    build.height(geoid)
    build.dilution()
    for name in ("correction_age_s", "vel_u_mps", "x_station_id", "x_h_accuracy_m",
                 "x_v_accuracy_m", *GBS_COLUMNS):  # fmt: skip
        if name in want:
            raw[name] = build.first_known(name, (*POSITIONS, "GBS"))
    for name in ("speed_mps", "vel_e_mps", "vel_n_mps"):
        if name in want:
            raw[name] = build.first_known(name, ("RMC", "PASHR", "PUBX", "VTG"))
    build.accuracy()
    counts, _ = remove_sentinels(raw, build.flags)
    for name, values in counts.items():
        tally.removed.setdefault(name, Counter()).update(values)
    build.satellites()
    build.mode(sbas)
    if "flags" in want:
        raw["flags"] = build.flags
    return raw


class _Build:
    """The columns while kind after kind of sentences goes into them."""

    def __init__(self, epochs: Epochs, want: Set[str], tally: Tally) -> None:
        self.epochs, self.want, self.tally = epochs, want, tally
        self.rows = len(epochs)
        self.raw: Raw = {}
        self.flags = np.zeros(self.rows, np.uint32)
        self.flags[epochs.damaged] |= np.uint32(Flag.EPOCH_INCOMPLETE)
        tally.damaged += int(np.count_nonzero(epochs.damaged))
        tally.unattached += epochs.unattached
        tally.other_dates += epochs.other_dates

    def of(self, kind: str) -> tuple[NDArray[np.intp], Columns]:
        """Epoch and fields of the sentences of a kind, the first of an epoch last."""
        row = self.epochs.row.get(kind, np.empty(0, np.intp))[::-1]
        return row, {n: v[::-1] for n, v in self.epochs.columns.get(kind, {}).items()}

    def spread(self, kind: str, name: str, missing: Any) -> NDArray[Any]:
        """(rows,) a field of a kind by epoch."""
        row, fields = self.of(kind)
        if name not in fields:
            return np.full(self.rows, missing)
        column = np.full(self.rows, missing, fields[name].dtype)
        column[row] = fields[name]
        return column

    def first_known(self, name: str, kinds: tuple[str, ...]) -> NDArray[np.float64]:
        """(rows,) the number of the first kind that has one."""
        column = np.full(self.rows, np.nan)
        for kind in kinds:
            if name in self.epochs.columns.get(kind, {}):
                values = self.spread(kind, name, np.nan)
                column = np.where(np.isnan(column), values, column)
        return column

    def position(self) -> None:
        if "lat_deg" not in self.want:
            return
        lat, lon = np.full((2, self.rows), np.nan)
        decimals = np.zeros(self.rows, np.int64)
        odd = np.zeros(self.rows, np.bool_)
        differ = np.zeros(self.rows, np.bool_)
        for kind in POSITIONS:
            row, fields = self.of(kind)
            if not len(row):
                continue
            odd[row] |= fields["out_of_range"]
            there = ~np.isnan(fields["lat_deg"]) & ~np.isnan(fields["lon_deg"])
            row, fields = row[there], {n: v[there] for n, v in fields.items()}
            apart = np.maximum(
                np.abs(fields["lat_deg"] - lat[row]), np.abs(fields["lon_deg"] - lon[row])
            )
            apart = np.minimum(apart, np.abs(360 - apart))
            # What the coarser of the two cannot tell is no difference.
            step = 10.0 ** -np.minimum(decimals[row], fields["decimals"]) / 60
            other = apart > _ROUNDING * step
            differ[row[other]] = True
            if other.any():
                self.tally.largest_difference_deg = max(
                    self.tally.largest_difference_deg, float(apart[other].max())
                )
            new = np.isnan(lat[row])
            lat[row[new]], lon[row[new]] = fields["lat_deg"][new], fields["lon_deg"][new]
            decimals[row[new]] = fields["decimals"][new]
        self.tally.differing += int(np.count_nonzero(differ))
        self.flags[odd] |= np.uint32(Flag.OUT_OF_RANGE)
        self.raw["lat_deg"], self.raw["lon_deg"] = lat, lon

    def height(self, geoid: float | None) -> None:
        if not self.want & {"height_m", "x_undulation_m"}:
            return
        separation = self.first_known("x_undulation_m", ("GGA", "GNS"))
        altitude = self.first_known("altitude", ("GGA", "GNS"))
        if "x_undulation_m" in self.want:
            self.raw["x_undulation_m"] = separation
        if "height_m" not in self.want:
            return
        own = self.first_known("height_m", ("PASHR", "PUBX"))
        bare = ~np.isnan(altitude) & np.isnan(separation)
        height = altitude + separation
        if geoid is not None:
            height = np.where(bare, altitude + geoid, height)
            self.tally.given_separation += int(np.count_nonzero(bare))
        height = np.where(np.isnan(height), own, height)
        self.tally.no_separation += int(np.count_nonzero(bare & np.isnan(height)))
        self.raw["height_m"] = height

    def dilution(self) -> None:
        row, fields = self.groups()
        if len(row):
            self.tally.sentences["unreadable"] += int(fields["odd_dilution"].sum())
        for name in ("hdop", "vdop", "pdop"):
            if name not in self.want:
                continue
            column = self.first_known(name, ("GGA", "GNS"))
            of_gsa = np.full(self.rows, np.nan)
            if name in fields:
                of_gsa[row[::-1]] = fields[name][::-1]
            column = np.where(np.isnan(column), of_gsa, column)
            others = self.first_known(name, ("PASHR", "PUBX"))
            self.raw[name] = np.where(np.isnan(column), others, column)

    def groups(self) -> tuple[NDArray[np.intp], Columns]:
        """Epoch and fields of the GSA that follow each other at once, the first such group."""
        row = self.epochs.row.get("GSA", np.empty(0, np.intp))
        fields = self.epochs.columns.get("GSA", {})
        if not len(row):
            return row, fields
        opens = np.ones(len(row), np.bool_)
        opens[1:] = (np.diff(fields["ordinal"]) != 1) | (np.diff(row) != 0)
        group = np.cumsum(opens)
        first = group == group[np.searchsorted(row, row)]
        return row[first], {name: values[first] for name, values in fields.items()}

    def accuracy(self) -> None:
        for name in (*_SIGMAS, "cov_en_m2"):
            if name not in self.want:
                continue
            self.raw[name] = self.first_known(name, ("GST",))
            if name in _SIGMAS:
                self.remove(name, self.raw[name] == 0, "0")
        if "cov_en_m2" in self.want:
            cov = self.raw["cov_en_m2"]
            # Beyond full correlation: the ellipse and the sigmas are not of one covariance.
            odd = np.abs(cov) > self.raw["sigma_e_m"] * self.raw["sigma_n_m"]
            self.tally.odd_ellipses += int(np.count_nonzero(odd))
            self.raw["cov_en_m2"] = np.where(odd, np.nan, cov)
        if "correction_age_s" in self.want:
            for value in _UNKNOWN_AGE_S:
                age = self.raw["correction_age_s"]
                self.remove("correction_age_s", age == value, f"{value:g}")

    def remove(self, name: str, rows: NDArray[np.bool_], value: str) -> None:
        number = int(np.count_nonzero(rows))
        if number:
            self.tally.removed.setdefault(name, Counter())[value] += number
            self.raw[name] = np.where(rows, np.nan, self.raw[name])

    def satellites(self) -> None:
        row, fields = self.groups()
        self.tally.other_groups += len(self.epochs.row.get("GSA", ())) - len(row)
        if "n_sv" in self.want:
            listed = np.bincount(row, fields.get("used"), self.rows).astype(np.int64)
            count = np.full(self.rows, -1, np.int64)
            for kind in ("GNS", "GGA", "PASHR", "PUBX"):
                count = np.where(count < 0, self.spread(kind, "n_sv", -1), count)
            of_gns = self.spread("GNS", "n_sv", -1) >= 0
            more = (count == CAPPED_SATELLITES) & ~of_gns & (listed > count)
            self.tally.more_in_gsa += int(np.count_nonzero(more))
            known = np.bincount(row, minlength=self.rows) > 0
            count = np.where(more | ((count < 0) & known), listed, count)
            self.raw["n_sv"] = np.minimum(count, 254).astype(np.int16)
        if "geo_prn" in self.want:
            prn = np.full(self.rows, -1, np.int16)
            heard = fields.get("geo_prn", np.empty(0, np.int16)) >= 0
            prn[row[heard]] = fields["geo_prn"][heard] if len(row) else 0
            times = np.bincount(row[heard], minlength=self.rows)
            self.raw["geo_prn"] = np.where(times > 1, 0, prn).astype(np.int16)
        if "n_sv_tracked" in self.want:
            tracked = _tracked(*self.of("GSV"), self.rows)
            self.raw["n_sv_tracked"] = np.where(self.epochs.damaged, -1, tracked).astype(np.int16)
        two = np.zeros(self.rows, np.bool_)
        if len(row):
            two[row[fields["two_dimensional"]]] = True
        if "mode" in self.want:
            two |= self.spread("PUBX", "two_dimensional", False)
        self.flags[two] |= np.uint32(Flag.TWO_DIMENSIONAL)

    def mode(self, sbas: bool) -> None:
        if "mode" not in self.want:
            return
        mode = np.full(self.rows, UNSTATED, np.int8)
        adrift = np.zeros(self.rows, np.bool_)
        for kind in POSITIONS:
            new = mode == UNSTATED
            mode = np.where(new, self.spread(kind, "mode", UNSTATED), mode).astype(np.int8)
            adrift |= new & self.spread(kind, "dead_reckoning", False)
        self.flags[adrift] |= np.uint32(Flag.DEAD_RECKONING)
        warned = ~self.spread("RMC", "valid", True)
        contradicted = warned & (mode != _NONE)
        self.tally.contradicted += int(np.count_nonzero(contradicted))
        mode[warned] = _NONE
        differential = mode == _DGNSS
        self.tally.differential += int(np.count_nonzero(differential))
        if sbas:
            mode[differential] = _SBAS
        self.raw["mode"] = mode
        if "lat_deg" in self.raw:
            invalid = (mode == _NONE) & ~np.isnan(self.raw["lat_deg"])
            self.tally.invalid_positions += int(np.count_nonzero(invalid))
            self.flags[invalid] |= np.uint32(Flag.POSITION_SENTINEL)
        for name in ("lat_deg", "lon_deg", "height_m", "speed_mps", "vel_e_mps", "vel_n_mps",
                     "vel_u_mps"):  # fmt: skip
            if name in self.raw:
                self.raw[name] = np.where(mode == _NONE, np.nan, self.raw[name])


def _tracked(row: NDArray[np.intp], fields: Columns, rows: int) -> NDArray[np.int64]:
    """(rows,) satellites with a signal strength in GSV; -1 where a sentence is missing.

    Talkers are added. Where a talker lists its satellites once for each signal, the signal with
    most of them counts.
    """
    tracked = np.full(rows, -1, np.int64)
    if not len(row):
        return tracked
    keys = np.stack([row.astype(np.int64), fields["talker"], fields["signal"]])
    order = np.lexsort(keys[::-1])
    keys = keys[:, order]
    new = np.ones(len(order), np.bool_)
    new[1:] = (np.diff(keys, axis=1) != 0).any(axis=0)
    at = np.flatnonzero(new)
    number, total = fields["number"][order], fields["total"][order]
    sent = np.diff(np.append(at, len(order)))
    most = np.maximum.reduceat(total, at)
    whole = (sent == most) & (np.minimum.reduceat(total, at) == most)
    whole &= (np.minimum.reduceat(number, at) == 1) & (np.maximum.reduceat(number, at) == most)
    whole &= np.add.reduceat(number, at) == most * (most + 1) // 2
    heard = np.add.reduceat(fields["heard"][order], at)
    of_row, talker = keys[0, at], keys[1, at]
    new_talker = np.ones(len(at), np.bool_)
    new_talker[1:] = (np.diff(of_row) != 0) | (np.diff(talker) != 0)
    by_talker = np.flatnonzero(new_talker)
    best = np.maximum.reduceat(heard, by_talker)
    sums = np.bincount(of_row[by_talker], best, rows).astype(np.int64)
    there = np.bincount(of_row, minlength=rows) > 0
    broken = np.bincount(of_row[~whole], minlength=rows) > 0
    return np.where(there & ~broken, sums, tracked)
