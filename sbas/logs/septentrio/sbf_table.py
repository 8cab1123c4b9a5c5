"""The columns of the epoch table from the blocks of an SBF file, joined to rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.delimited.column_map import pl_outside_sbas
from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio import sbf_decode as decode
from sbas.logs.septentrio.sbf_epochs import Epochs
from sbas.recording import COLUMNS, MODES, SBAS_MODES, Flag, missing_values, mode_categories

Raw = dict[str, NDArray[Any]]
Rows = NDArray[np.int64] | None
"""Row of each block; None where block i is row i."""

PVT = (sbf.PVT_GEODETIC, sbf.PVT_CARTESIAN, sbf.PVT_GEODETIC_V1, sbf.PVT_CARTESIAN_V1)
COVARIANCE = (sbf.COV_GEODETIC, sbf.COV_CARTESIAN)
DILUTION = (sbf.DOP, sbf.DOP_V1)
RAIM = (sbf.RAIM_STATISTICS, sbf.RAIM_STATISTICS_V1)
KINDS = (PVT, COVARIANCE, DILUTION, RAIM)
"""Block numbers that say the same, the preferred one first: each epoch takes one of each."""
_CLOSED = len(KINDS)
_COVERAGES = 1 << (_CLOSED + 1)
"""Sets of what an epoch has: a bit a kind of `KINDS`, and one for EndOfPVT."""

DO229_SIGNALS = 1 << 0 | 1 << 24
"""SignalInfo of a DO-229 L1 fix: GPS L1 C/A and SBAS L1."""
DO229_SATELLITES = 16


@dataclass(frozen=True)
class Levels:
    """How many protection levels are what: epochs with a level, and of which kind they are.

    `outside`: in a known mode that is not SBAS; `other_signals`, `many_satellites`: not outside,
    but with signals or more satellites than DO-229 knows; `certain`: SBAS with its signals only.
    """

    present: int
    outside: int
    other_signals: int
    many_satellites: int
    certain: int

    def __add__(self, other: Levels) -> Levels:
        return Levels(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))


def no_coverage() -> NDArray[np.int64]:
    """Counts of no epoch, by the set of kinds of block that an epoch has; see `kinds_of`."""
    return np.zeros(_COVERAGES, np.int64)


@dataclass
class Filled:
    """Columns by name, what was made missing, and what the epochs have.

    `has` is the set of kinds of block that each epoch has, and `coverage` counts the epochs by
    it; see `kinds_of`.
    """

    columns: dict[str, Any]
    removed: decode.Removed
    has: NDArray[np.uint8]
    levels: Levels | None = None

    @property
    def coverage(self) -> NDArray[np.int64]:
        return np.bincount(self.has, minlength=_COVERAGES)


def kinds_of(numbers: Iterable[int]) -> int:
    """The set of kinds of block that a file with these block numbers has, as bits."""
    present = set(numbers)
    bits = sum(1 << kind for kind, alike in enumerate(KINDS) if present & set(alike))
    return bits | (sbf.END_OF_PVT in present) << _CLOSED


def incomplete(has: NDArray[np.uint8], kinds: int) -> NDArray[np.bool_]:
    """(n,) whether epochs lack one of the kinds of block."""
    lacking: NDArray[np.bool_] = (has & kinds) != kinds
    return lacking


def incomplete_epochs(coverage: NDArray[np.int64], kinds: int) -> int:
    """How many epochs lack one of the kinds, by the counts of `Filled.coverage`."""
    return int(coverage[incomplete(np.arange(_COVERAGES, dtype=np.uint8), kinds)].sum())


def empty_column(name: str, rows: int) -> Any:
    """(rows,) missing values of a column that no block fills."""
    return missing_values(name, rows) if name in COLUMNS else np.full(rows, np.nan)


def fill_table(epochs: Epochs, raw: Mapping[int, Raw], want: Set[str]) -> Filled:
    """Columns of the epoch table; flags without those that depend on other parts of the file.

    Parameters
    ----------
    epochs : the rows, and the row of each block.
    raw : raw fields by block number, as many as `want` needs.
    want : columns to fill, with those that they need.
    """
    rows = len(epochs.time_ms)
    build = _Build(rows, epochs, raw, want)
    decoders = (
        build.decode_pvt, build.decode_covariance,
        lambda _, fields, __: decode.dilution(fields, want),
        lambda _, fields, __: decode.raim(fields, want),
    )  # fmt: skip
    covered = [
        build.fill_kind(numbers, decoder) for numbers, decoder in zip(KINDS, decoders, strict=True)
    ]
    closed = build.covered_by(epochs.row_of[sbf.END_OF_PVT]) if sbf.END_OF_PVT in raw else None
    has = np.zeros(rows, np.uint8)
    for kind, some in enumerate((*covered, closed)):
        if some is not None:
            has |= some.astype(np.uint8) << kind
    out = Filled(build.columns, build.removed, has)
    if "mode" in build.columns:
        out.columns["mode"] = mode_categories(build.columns["mode"])
    if want & {"hpl_m", "vpl_m"}:
        out.levels = build.levels()
    if "flags" in want:
        out.columns["flags"] = build.flags_of_rows(covered[KINDS.index(RAIM)])
    return out


class _Build:
    """The columns while blocks of one number after the other go into them."""

    def __init__(self, rows: int, epochs: Epochs, raw: Mapping[int, Raw], want: Set[str]) -> None:
        self.rows, self.epochs, self.raw, self.want = rows, epochs, raw, want
        self.columns: dict[str, Any] = {}
        self.flags = np.zeros(rows, np.uint32)
        self.signals = np.zeros(rows, np.uint32)
        self.alert = np.zeros(rows, np.uint8)
        self.removed: decode.Removed = Counter()

    def covered_by(self, row: Rows) -> NDArray[np.bool_]:
        if row is None:
            return np.ones(self.rows, np.bool_)
        covered = np.zeros(self.rows, np.bool_)
        covered[row[row >= 0]] = True
        return covered

    def fill_kind(
        self, numbers: tuple[int, ...], decoder: Callable[[int, Raw, Rows], decode.Decoded]
    ) -> NDArray[np.bool_] | None:
        """Fill from the preferred block of each epoch; which rows have one, None if no row."""
        covered: NDArray[np.bool_] | None = None
        for number in numbers:
            if number not in self.raw:
                continue
            fields, row = self.raw[number], self.epochs.row_of[number]
            if covered is not None:
                index = np.arange(self.rows) if row is None else row
                use = ~covered[index]
                if not use.any():
                    continue
                fields = {name: values[use] for name, values in fields.items()}
                row = index[use]
            self._put(decoder(number, fields, row), row)
            now = self.covered_by(row)
            covered = now if covered is None else covered | now
        return covered

    def _put(self, decoded: decode.Decoded, row: Rows) -> None:
        self.removed.update(decoded.removed)
        at: Any = slice(None) if row is None else row
        for name, values in decoded.columns.items():
            if name == "flags":
                self.flags[at] |= values
            elif name == "n_sv" and name in self.columns:
                # The count of the fix itself goes before that of the DOP block.
                known = self.columns[name][at]
                self.columns[name][at] = np.where(known < 0, values, known)
            elif row is None:
                self.columns[name] = values
            else:
                if name not in self.columns:
                    missing = empty_column(name, self.rows)
                    self.columns[name] = missing if name != "mode" else np.full(self.rows, -1, "i1")
                self.columns[name][row] = values

    def decode_pvt(self, number: int, fields: Raw, row: Rows) -> decode.Decoded:
        at: Any = slice(None) if row is None else row
        if "signal_info" in fields:
            self.signals[at] = fields["signal_info"]
        if "alert_flag" in fields:
            self.alert[at] = fields["alert_flag"]
        geodetic = number in (sbf.PVT_GEODETIC, sbf.PVT_GEODETIC_V1)
        version_1 = number in (sbf.PVT_GEODETIC_V1, sbf.PVT_CARTESIAN_V1)
        decoder = decode.pvt_geodetic if geodetic else decode.pvt_cartesian
        return decoder(fields, self.want, version_1=version_1)

    def decode_covariance(self, number: int, fields: Raw, row: Rows) -> decode.Decoded:
        if number == sbf.COV_GEODETIC:
            return decode.covariance_geodetic(fields, self.want)
        at: Any = slice(None) if row is None else row
        nowhere = np.full(len(fields["position"]), np.nan)
        lat, lon = (
            self.columns[name][at] if name in self.columns else nowhere
            for name in ("lat_deg", "lon_deg")
        )
        return decode.covariance_cartesian(fields, self.want, lat, lon)

    def levels(self) -> Levels:
        """Counts of the protection levels by what they are."""
        present = np.zeros(self.rows, np.bool_)
        for name in ("hpl_m", "vpl_m"):
            if name in self.columns:
                present |= ~np.isnan(self.columns[name])
        mode = self.columns["mode"].codes if "mode" in self.columns else np.full(self.rows, -1)
        n_sv = self.columns.get("n_sv", np.full(self.rows, -1))
        sbas = (mode >= _FIRST_SBAS) & (mode <= _LAST_SBAS)
        outside = present & (mode >= 0) & ~sbas
        inside = present & ~outside
        other = inside & ((self.signals & ~np.uint32(DO229_SIGNALS)) != 0)
        many = inside & (n_sv > DO229_SATELLITES)
        certain = inside & sbas & (self.signals != 0) & ~other & ~many
        counts = (present, outside, other, many, certain)
        return Levels(*(int(np.count_nonzero(rows)) for rows in counts))

    def flags_of_rows(self, with_raim: NDArray[np.bool_] | None) -> NDArray[np.uint32]:
        flags = self.flags
        alert = decode.ALERT_FLAGS[self.alert & 3]
        flags |= alert if with_raim is None else np.where(with_raim, np.uint32(0), alert)
        if "mode" in self.columns:
            flags |= pl_outside_sbas(self.columns)
        if self.epochs.duplicate is not None:
            flags |= self.epochs.duplicate * np.uint32(Flag.DUPLICATE_TIME)
        backward = np.flatnonzero(np.diff(self.epochs.time_ms) < 0) + 1
        flags[backward] |= np.uint32(Flag.TIME_BACKWARD)
        return flags


_FIRST_SBAS, _LAST_SBAS = MODES.index(SBAS_MODES[0]), MODES.index(SBAS_MODES[-1])
