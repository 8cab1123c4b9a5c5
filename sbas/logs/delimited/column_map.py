"""Foreign numbers and words to documented columns: units, sentinels, mode names, each counted.

What CSV and Parquet tables of other programs share, once their headers have names.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.delimited.column_names import HEMISPHERES
from sbas.logs.delimited.earth_fixed import EarthFixedCounts, geodetic
from sbas.logs.delimited.hemispheres import with_signs
from sbas.logs.delimited.mode_words import encoded, modes, plain_word
from sbas.logs.sentinels import remove_sentinels, sentinel_findings, wrapped_longitudes
from sbas.recording import COLUMNS, MODES, SBAS_MODES, Flag


@dataclass(frozen=True)
class ColumnCounts:
    """What was found while columns were converted, of one piece of a table or of several added.

    Parameters
    ----------
    rows : rows of the table.
    sentinels : values made missing, by column and value.
    odd_counts : values of whole-number columns that are no whole number in range, by column.
    altitudes : heights above the geoid that are there.
    lon_deg : smallest and largest longitude, before any is wrapped.
    beyond : longitudes above 180 degrees.
    letters : letters of hemispheres by column and letter.
    earth_fixed : positions from x, y, z.
    """

    rows: int = 0
    sentinels: Counter[tuple[str, str]] = field(default_factory=Counter)
    odd_counts: Counter[str] = field(default_factory=Counter)
    altitudes: int = 0
    lon_deg: tuple[float, float] = (math.inf, -math.inf)
    beyond: int = 0
    letters: Counter[tuple[str, str]] = field(default_factory=Counter)
    earth_fixed: EarthFixedCounts = field(default_factory=EarthFixedCounts)

    def __add__(self, other: ColumnCounts) -> ColumnCounts:
        return ColumnCounts(
            self.rows + other.rows,
            self.sentinels + other.sentinels,
            self.odd_counts + other.odd_counts,
            self.altitudes + other.altitudes,
            (min(self.lon_deg[0], other.lon_deg[0]), max(self.lon_deg[1], other.lon_deg[1])),
            self.beyond + other.beyond,
            self.letters + other.letters,
            self.earth_fixed + other.earth_fixed,
        )

    @property
    def wrapped(self) -> tuple[Finding, ...]:
        """E26 where the longitudes run from 0 to 360 degrees and are to be wrapped."""
        if not self.beyond:
            return ()
        _, findings = wrapped_longitudes(np.array(self.lon_deg))
        evidence = f"{self.beyond:,} of {self.rows:,} above 180"
        return tuple(replace(finding, evidence=evidence) for finding in findings)


def convert_columns(
    values: Mapping[str, NDArray[np.float64]],
    texts: Mapping[str, Any],
    *,
    rows: int,
    factors: Mapping[str, float],
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    where: str = "",
) -> tuple[dict[str, object], tuple[Finding, ...]]:
    """Documented columns from raw numbers and texts.

    Parameters
    ----------
    values : (rows,) numbers by documented name (or `altitude`, `x_...`), before unit factors.
    texts : (rows,) pyarrow strings of `mode`, `environment`, `hardware_fault` and `x_...`.
    factors : unit factor by name; 1 where absent.
    mode_map : words or numbers of the mode column to names of `MODES`.
    geoid : undulation [m] that makes altitudes heights above the ellipsoid.

    Returns
    -------
    Columns in their documented dtypes, with `flags` where a sentinel was removed; findings E07
    (sentinels), E10 (values out of range), E25 (geoid, factors), E26 (longitudes of 0..360).

    Raises
    ------
    InputError : mode words that are not known, flags that are no bits, or letters of hemispheres
        that are none or contradict a sign.
    """
    columns, counts = convert_piece(
        values, texts, rows=rows, factors=factors, mode_map=mode_map, geoid=geoid, where=where
    )
    return columns, column_findings(counts, altitude="altitude" in values, geoid=geoid)


def column_findings(
    counts: ColumnCounts, *, altitude: bool, geoid: float | None
) -> tuple[Finding, ...]:
    """Findings of a whole table; `altitude` says whether it has heights above the geoid."""
    findings = list(counted_sentinel_findings(counts.sentinels))
    if altitude:
        findings.append(geoid_finding(counts.altitudes, counts.rows, geoid))
    elif geoid is not None:
        findings.append(geoid_unused())
    findings += counts.wrapped
    findings += counts.earth_fixed.findings()
    if counts.letters:
        findings.append(
            Finding(
                "E26",
                "info",
                "latitudes and longitudes have the signs of their hemisphere columns",
                evidence=", ".join(
                    f"{HEMISPHERES[name]} {letter} {n:,}"
                    for (name, letter), n in sorted(counts.letters.items())
                ),
            )
        )
    if counts.odd_counts:
        findings.append(
            Finding(
                "E10",
                "warning",
                "counts that are no whole number in range were made missing",
                evidence=", ".join(
                    f"{name} {n:,}" for name, n in sorted(counts.odd_counts.items())
                ),
                cure="check the columns; take them out if they are not needed",
            )
        )
    return tuple(findings)


def convert_piece(
    values: Mapping[str, NDArray[np.float64]],
    texts: Mapping[str, Any],
    *,
    rows: int,
    factors: Mapping[str, float],
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    wrapped: bool | None = None,
    where: str = "",
) -> tuple[dict[str, object], ColumnCounts]:
    """As `convert_columns`, for one piece of a table: counts in place of findings.

    `wrapped` says whether the table's longitudes run from 0 to 360 degrees; None lets the piece
    decide, which is then the whole table.
    """
    raw = dict(values)
    flags = np.zeros(rows, np.uint32)
    if "flags" in raw:
        flags |= _flag_bits(raw.pop("flags"), where)
    places, earth_fixed = geodetic(raw, factors)
    raw |= places
    sentinels, flags = remove_sentinels(raw, flags)
    letters: Counter[tuple[str, str]] = Counter()
    for name, signed in HEMISPHERES.items():
        if name in texts and signed in raw:
            raw[signed], counted = with_signs(raw[signed], texts[name], name, where)
            letters += counted
    columns: dict[str, object] = {}
    altitudes = 0
    if "altitude" in raw:
        altitude = raw.pop("altitude") * factors.get("altitude", 1.0)
        altitudes = int(np.count_nonzero(~np.isnan(altitude)))
        columns["height_m"], _ = ellipsoidal(altitude, geoid)
    odd: Counter[str] = Counter()
    counts = ColumnCounts(
        rows, _by_value(sentinels), odd, altitudes, letters=letters, earth_fixed=earth_fixed
    )
    for name, array in raw.items():
        factor = factors.get(name, 1.0)
        array = array if factor == 1.0 else array * factor
        if name == "lon_deg":
            known = array[np.isfinite(array)]
            span = (float(known.min()), float(known.max())) if len(known) else counts.lon_deg
            counts = replace(counts, lon_deg=span, beyond=int(np.count_nonzero(array > 180)))
            if wrapped or (wrapped is None and counts.wrapped):
                array, _ = wrapped_longitudes(array)
        dtype = COLUMNS[name].dtype if name in COLUMNS else "f8"
        if dtype == "i2":
            whole = (array >= -1) & (array <= np.iinfo(np.int16).max) & (array == np.floor(array))
            off = ~whole & ~np.isnan(array)
            if off.any():
                odd[name] = int(np.count_nonzero(off))
            flags[off] |= np.uint32(Flag.OUT_OF_RANGE)
            columns[name] = np.where(whole, array, -1).astype(np.int16)
        elif dtype == "bool":
            columns[name] = np.nan_to_num(array) != 0
        else:
            columns[name] = array
    for name, words in texts.items():
        if name in HEMISPHERES:
            continue
        if name == "mode":
            columns[name] = modes(words, mode_map, where=where)
        elif name == "environment":
            codes, uniques = encoded(words)
            named = [i for i, word in enumerate(uniques) if word]
            lookup = np.full(len(uniques) + 1, -1)
            lookup[named] = np.arange(len(named))
            labels = pd.Index([uniques[i] for i in named], dtype="str")
            columns[name] = pd.Categorical.from_codes(lookup[codes], labels)
        elif name == "hardware_fault":
            columns[name] = _booleans(words, where)
        else:
            columns[name] = pd.array(words.to_pylist(), dtype="str")
    if "mode" in columns:
        flags |= pl_outside_sbas(columns)
    if flags.any() or "flags" in values:
        columns["flags"] = flags
    return columns, counts


def _by_value(counts: Mapping[str, Mapping[str, int]]) -> Counter[tuple[str, str]]:
    return Counter(
        {(name, value): n for name, values in counts.items() for value, n in values.items() if n}
    )


def counted_sentinel_findings(counts: Counter[tuple[str, str]]) -> tuple[Finding, ...]:
    """E07 of counts by column and value, in the order of their names."""
    by_name: dict[str, dict[str, int]] = {}
    for (name, value), number in sorted(counts.items()):
        by_name.setdefault(name, {})[value] = number
    return sentinel_findings(by_name)


def _flag_bits(given: NDArray[np.float64], where: str) -> NDArray[np.uint32]:
    """(n,) bits of (n,) numbers; missing ones are none."""
    bits = np.nan_to_num(given, nan=0.0, posinf=-1.0)
    strange = (bits < 0) | (bits >= 2**32) | (bits != np.floor(bits))
    if strange.any():
        raise InputError(
            "column flags has values that are no bits of flags",
            where=where,
            evidence=f"{np.count_nonzero(strange):,} rows, first {given[strange][0]:g}",
            cure="write bits of sbas.recording.Flag, or rename the column to 'x_flags'",
        )
    return bits.astype(np.uint32)


def word_findings(words: Mapping[str, int]) -> tuple[Finding, ...]:
    """E07 for words such as NaN in the place of numbers."""
    return sentinel_findings({name: {"NaN or a like word": n} for name, n in sorted(words.items())})


def pl_outside_sbas(columns: Mapping[str, object]) -> NDArray[np.uint32]:
    """(n,) Flag.PL_OUTSIDE_SBAS where a protection level stands beside a known other mode."""
    codes = columns["mode"].codes  # type: ignore[attr-defined]
    inside = np.isin(codes, [-1, *(MODES.index(name) for name in SBAS_MODES)])
    present = np.zeros(len(codes), bool)
    for name in ("hpl_m", "vpl_m"):
        if name in columns:
            present |= ~np.isnan(np.asarray(columns[name], np.float64))
    return np.where(present & ~inside, np.uint32(Flag.PL_OUTSIDE_SBAS), np.uint32(0))


def ellipsoidal(
    altitude: NDArray[np.float64], geoid: float | None
) -> tuple[NDArray[np.float64], tuple[Finding, ...]]:
    """(n,) heights above the ellipsoid of (n,) heights above the geoid; NaN without `geoid`."""
    known = int(np.count_nonzero(~np.isnan(altitude)))
    findings = (geoid_finding(known, len(altitude), geoid),)
    if geoid is None:
        return np.full(len(altitude), np.nan), findings
    return altitude + geoid, findings


def geoid_finding(known: int, rows: int, geoid: float | None) -> Finding:
    """E25 for `known` heights above the geoid in `rows` rows."""
    if geoid is None:
        return Finding(
            "E25",
            "warning",
            "heights are above the geoid and no undulation is given: height_m is left missing",
            evidence=f"{known:,} heights",
            cure="give the undulation in metres with --geoid (about 45 in Central Europe)",
        )
    return Finding(
        "E25",
        "info",
        f"{rows:,} heights above the geoid made ellipsoidal",
        evidence=f"undulation {geoid:g} m as given",
    )


def geoid_unused() -> Finding:
    """E25 where an undulation was given for heights that are ellipsoidal already."""
    return Finding(
        "E25",
        "warning",
        "an undulation was given but not used: no height above the geoid is in the file",
        cure="leave out --geoid; name the column 'altitude' if its heights are above the geoid",
    )


def _booleans(words: Any, where: str) -> NDArray[np.bool_]:
    codes, uniques = encoded(words)
    table = {"true": True, "1": True, "false": False, "0": False, "": False}
    plain = [plain_word(word).lower() for word in uniques]
    if unknown := [word for word in plain if word not in table]:
        raise InputError(
            "column hardware_fault has values other than true and false",
            where=where,
            evidence=", ".join(unknown[:12]),
            cure="write true or false",
        )
    chosen: NDArray[np.bool_] = np.array([table[word] for word in plain] + [False], bool)[codes]
    return chosen


@dataclass(frozen=True)
class MappedTable:
    """A foreign table with documented columns, and what a reader of it must know.

    Parameters
    ----------
    table : index `time` (GPS time), documented columns, columns `x_...`, and truth columns
        where they were asked for.
    findings : what was converted, made missing or left out.
    time_scale, leap_seconds : scale that the times were written in, GPST - UTC applied.
    options : what was taken for what, and with which options.
    geoid : undulation that was applied, in words; "" for none.
    sources : header by the name it was taken for.
    """

    table: pd.DataFrame
    findings: tuple[Finding, ...]
    time_scale: str
    leap_seconds: int | None
    options: Mapping[str, str]
    geoid: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
