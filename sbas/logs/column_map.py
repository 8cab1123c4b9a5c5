"""Foreign column names, units and mode names to the documented ones.

What CSV and Parquet tables of other programs share: an alias map (docs/formats.md), units in
headers, mode names. Each conversion is counted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.sentinels import remove_sentinels, sentinel_findings
from sbas.recording import COLUMNS, MODES, SBAS_MODES, Flag, mode_categories

ALIASES: dict[str, str] = {
    "time": "time", "timestamp": "time", "gpst": "time", "utc": "time",
    "date": "date", "week": "week", "tow": "tow", "sow": "tow",
    "lat": "lat_deg", "latitude": "lat_deg",
    "lon": "lon_deg", "lng": "lon_deg", "longitude": "lon_deg",
    "height": "height_m", "h": "height_m", "hell": "height_m",
    "alt": "altitude", "altitude": "altitude", "msl": "altitude",
    "hpl": "hpl_m", "hplsbas": "hpl_m", "vpl": "vpl_m", "hdop": "hdop",
    "nsat": "n_sv", "nsv": "n_sv", "numsv": "n_sv", "ns": "n_sv", "sats": "n_sv",
    "mode": "mode", "fix": "mode", "quality": "mode", "q": "mode",
    "herl": "herl_m", "verl": "verl_m",
    "sdn": "sigma_n_m", "sde": "sigma_e_m", "sdu": "sigma_u_m",
}  # fmt: skip
"""Names after lower-casing and taking out `_`, `-`, blanks and units; documented columns are
known by their own names as well. `altitude` is a height above the geoid."""

TIME_PARTS = ("time", "date", "week", "tow")
TRUTH_COLUMNS = {"sigma_h_m": "m", "sigma_v_m": "m", "heading_deg": "deg"}
"""Further columns of a truth trajectory, with their units."""

_UNITS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "metre": 1.0, "meter": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3},
    "deg": {"deg": 1.0, "°": 1.0, "degree": 1.0, "degrees": 1.0, "rad": 180 / math.pi},
    "m/s": {"mps": 1.0, "m/s": 1.0, "kmh": 1 / 3.6, "km/h": 1 / 3.6, "kn": 1852 / 3600},
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "m2": {"m2": 1.0, "m^2": 1.0, "m²": 1.0},
    "1": {"1": 1.0, "-": 1.0, "": 1.0},
    "": {"": 1.0},
}
_DIMENSIONS = {
    **{name: column.unit for name, column in COLUMNS.items()},
    **TRUTH_COLUMNS,
    "altitude": "m", "tow": "s", "time": "", "date": "", "week": "1",
}  # fmt: skip

_SCALED_TIME = r"\s*(time|timestamp)[\s_-]*[\[(]?\s*(utc|gpst|gps)\s*[\])]?\s*"
_SCALE_NAMES = {"utc": "UTC", "gpst": "GPST", "gps": "GPST"}
TIME_CURE = (
    "write times as YYYY-MM-DD hh:mm:ss.fff, or as two columns 'week' and 'tow' (GPS week, "
    "seconds of week)"
)


@dataclass(frozen=True)
class MappedColumn:
    """Where a column comes from: position and header, factor of its unit, scale of its times."""

    index: int
    header: str
    factor: float = 1.0
    scale: str = ""


def _split_unit(header: str) -> tuple[str, str | None]:
    """Name and unit of a header; the unit is None where none is written."""
    bracket = re.fullmatch(r"\s*(.*?)[\s_]*[\[(]\s*([^\])]*?)\s*[\])]\s*", header)
    if bracket:
        return bracket[1], bracket[2].lower()
    suffix = re.fullmatch(r"\s*(.+)[_\s-]([^_\s-]+)\s*", header)
    if suffix and suffix[2].lower() in {u for units in _UNITS.values() for u in units}:
        return suffix[1], suffix[2].lower()
    return header, None


def _squash(name: str) -> str:
    return re.sub(r"[\s_\-]+", "", name).lower()


def _known(extra: Iterable[str]) -> dict[str, str]:
    names = {_squash(name): name for name in (*COLUMNS, *extra)}
    stems = {_squash(_split_unit(name)[0]): name for name in (*COLUMNS, *extra)}
    return {**names, **stems, **ALIASES}


def map_headers(
    headers: Sequence[str], *, where: str, extra: Iterable[str] = ()
) -> tuple[dict[str, MappedColumn], dict[str, MappedColumn]]:
    """Documented columns, and columns `x_...`, by name.

    Parameters
    ----------
    headers : names as written.
    where : file, for messages.
    extra : further documented names, those of `TRUTH_COLUMNS`.

    Raises
    ------
    InputError : two headers of one meaning, or a unit that does not belong to its column.
    """
    known = _known(extra)
    mapped: dict[str, MappedColumn] = {}
    others: dict[str, MappedColumn] = {}
    for index, header in enumerate(headers):
        stem, unit = _split_unit(header)
        scale = ""
        if scaled := re.fullmatch(_SCALED_TIME, header, re.IGNORECASE):
            stem, unit, scale = scaled[1], None, scaled[2]
        elif _squash(stem) in ("utc", "gpst"):
            scale = _squash(stem)
        name = known.get(_squash(stem))
        if name is None and (name := known.get(_squash(header))) is not None:
            unit, stem = None, header
        if name is None or header.startswith("x_"):
            base = re.sub(r"\W+", "_", header.removeprefix("x_")).strip("_") or str(index + 1)
            name = f"x_{base}"
            while name in others:
                name += "_"
            others[name] = MappedColumn(index, header)
            continue
        dimension = _UNITS[_DIMENSIONS[name]]
        if unit is not None and unit not in dimension:
            raise InputError(
                f"column {header!r} has a unit that {name} cannot have",
                where=where,
                evidence=f"unit {unit!r}; known are {', '.join(u for u in dimension if u)}",
                cure=TIME_CURE
                if name == "time"
                else "convert the column, or correct the unit in its header",
            )
        if name in mapped:
            raise InputError(
                f"two columns mean {name}",
                where=where,
                evidence=f"{mapped[name].header!r} and {header!r}",
                cure=f"take one out, or rename it to 'x_{_squash(stem)}' to keep it aside",
            )
        factor = 1.0 if unit is None else dimension[unit]
        mapped[name] = MappedColumn(index, header, factor, _SCALE_NAMES.get(scale.lower(), ""))
    if "height_m" in mapped and "altitude" in mapped:
        # Both heights are there: the ellipsoidal one serves, the other is kept aside.
        others["x_altitude"] = mapped.pop("altitude")
    return mapped, others


def map_text(mapped: Mapping[str, MappedColumn], others: Mapping[str, MappedColumn]) -> str:
    """The map in one line, for the recording's options."""
    pairs = {**mapped, **others}
    return ", ".join(f"{name} <- {source.header.strip()}" for name, source in pairs.items())


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
    (sentinels), E10 (values out of range), E25 (geoid, factors).
    """
    raw = dict(values)
    flags = np.zeros(rows, np.uint32)
    if "flags" in raw:
        given = raw.pop("flags")
        flags |= np.where(np.isfinite(given) & (given >= 0) & (given < 2**32), given, 0).astype(
            np.uint32
        )
    sentinels, flags = remove_sentinels(raw, flags)
    findings = list(sentinel_findings(sentinels))
    columns: dict[str, object] = {}
    if "altitude" in raw:
        altitude = raw.pop("altitude") * factors.get("altitude", 1.0)
        columns["height_m"], geoid_findings = ellipsoidal(altitude, geoid)
        findings += geoid_findings
    elif geoid is not None:
        findings.append(geoid_unused())
    wrong: dict[str, int] = {}
    for name, array in raw.items():
        factor = factors.get(name, 1.0)
        array = array if factor == 1.0 else array * factor
        dtype = COLUMNS[name].dtype if name in COLUMNS else "f8"
        if dtype == "i2":
            whole = (array >= -1) & (array <= np.iinfo(np.int16).max) & (array == np.floor(array))
            off = ~whole & ~np.isnan(array)
            wrong[name] = int(np.count_nonzero(off))
            flags[off] |= np.uint32(Flag.OUT_OF_RANGE)
            columns[name] = np.where(whole, array, -1).astype(np.int16)
        elif dtype == "bool":
            columns[name] = np.nan_to_num(array) != 0
        else:
            columns[name] = array
    if counted := ", ".join(f"{name} {n:,}" for name, n in wrong.items() if n):
        findings.append(
            Finding(
                "E10",
                "warning",
                "counts that are no whole number in range were made missing",
                evidence=counted,
                cure="check the columns; take them out if they are not needed",
            )
        )
    for name, words in texts.items():
        if name == "mode":
            columns[name] = modes(words, mode_map, where=where)
        elif name == "environment":
            codes, uniques = _encoded(words)
            named = [i for i, word in enumerate(uniques) if word]
            lookup = np.full(len(uniques) + 1, -1)
            lookup[named] = np.arange(len(named))
            columns[name] = pd.Categorical.from_codes(lookup[codes], [uniques[i] for i in named])
        elif name == "hardware_fault":
            columns[name] = _booleans(words, where)
        else:
            columns[name] = pd.array(words.to_pylist(), dtype="str")
    if "mode" in columns:
        flags |= pl_outside_sbas(columns)
    if flags.any() or "flags" in values:
        columns["flags"] = flags
    return columns, tuple(findings)


def needed_columns(
    columns: Collection[str] | None,
    mapped: Mapping[str, MappedColumn],
    others: Mapping[str, MappedColumn],
) -> tuple[str, ...]:
    """Columns of a file to decode for those asked: what judges a value comes with it.

    (0, 0) is judged on latitude and longitude together, (8000, 100) on both protection levels,
    and the flags on everything.
    """
    available = [name for name in mapped if name not in TIME_PARTS]
    if columns is None:
        return (*available, *others)
    asked = set(columns)
    if "flags" in asked:
        return (*available, *(name for name in others if name in asked))
    for pair in (("lat_deg", "lon_deg"), ("hpl_m", "vpl_m")):
        if asked & set(pair):
            asked |= set(pair)
    if "height_m" in asked:
        asked.add("altitude")
    return tuple(name for name in (*available, *others) if name in asked)


def applied_geoid(geoid: float | None, wanted: Collection[str]) -> str:
    """The undulation in words, where a wanted column is an altitude."""
    return f"{geoid:g} m as given" if geoid is not None and "altitude" in wanted else ""


def word_findings(words: Mapping[str, int]) -> tuple[Finding, ...]:
    """E07 for words such as NaN in the place of numbers."""
    return sentinel_findings({name: {"NaN or a like word": n} for name, n in words.items()})


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
    if geoid is None:
        finding = Finding(
            "E25",
            "warning",
            "heights are above the geoid and no undulation is given: height_m is left missing",
            evidence=f"{np.count_nonzero(~np.isnan(altitude)):,} heights",
            cure="give the undulation in metres with --geoid (about 45 in Central Europe)",
        )
        return np.full(len(altitude), np.nan), (finding,)
    finding = Finding(
        "E25",
        "info",
        f"{len(altitude):,} heights above the geoid made ellipsoidal",
        evidence=f"undulation {geoid:g} m as given",
    )
    return altitude + geoid, (finding,)


def geoid_unused() -> Finding:
    """E25 where an undulation was given for heights that are ellipsoidal already."""
    return Finding(
        "E25",
        "warning",
        "geoid= was given but not used: no height above the geoid is in the file",
        cure="leave out --geoid; name the column 'altitude' if its heights are above the geoid",
    )


def _encoded(words: Any) -> tuple[NDArray[np.int32], list[str]]:
    encoded = words.fill_null("").dictionary_encode()
    codes: NDArray[np.int32] = encoded.indices.to_numpy(zero_copy_only=False)
    return codes, encoded.dictionary.to_pylist()


def modes(words: Any, mode_map: Mapping[str, str] | None, *, where: str) -> pd.Categorical:
    """Column `mode` of (n,) pyarrow strings: names of `MODES`, or words that `mode_map` knows.

    Raises
    ------
    InputError : words that are neither, or a map to names that are no modes.
    """
    table = {name: name for name in MODES}
    if mode_map is not None:
        table = {_plain(str(word)): name for word, name in mode_map.items()}
        if strange := sorted(set(table.values()) - set(MODES)):
            raise InputError(
                f"mode_map names unknown modes: {', '.join(map(repr, strange))}",
                cure=f"known modes are {', '.join(MODES)}",
            )
    codes, uniques = _encoded(words)
    plain = [_plain(word) for word in uniques]
    unknown = [word for word in plain if word and word not in table]
    if unknown:
        shown = ", ".join(unknown[:12])
        raise InputError(
            "the mode column has values whose meaning is not known",
            where=where,
            evidence=shown,
            cure=f"say what they mean: mode_map={{{unknown[0]!r}: 'sbas', ...}}; "
            f"modes are {', '.join(MODES)}",
        )
    lookup = np.array([MODES.index(table[word]) if word else -1 for word in plain] + [-1], np.int8)
    return mode_categories(lookup[codes])


def _plain(word: str) -> str:
    return re.sub(r"^(\d+)\.0*$", r"\1", word.strip())


def _booleans(words: Any, where: str) -> NDArray[np.bool_]:
    codes, uniques = _encoded(words)
    table = {"true": True, "1": True, "false": False, "0": False, "": False}
    plain = [_plain(word).lower() for word in uniques]
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
    """

    table: pd.DataFrame
    findings: tuple[Finding, ...]
    time_scale: str
    leap_seconds: int | None
    options: Mapping[str, str]
    geoid: str = ""
