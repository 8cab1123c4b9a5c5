"""Foreign column headers to documented names: an alias map (docs/formats.md), units in headers."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.recording import COLUMNS

MAX_COLUMNS = 2000
"""More columns than any recording has; a file with more of them is no table of epochs."""

_LONGEST_HEADER = 200  # characters; a longer one is no name of a quantity

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
    **dict.fromkeys((
        "latdir", "latdirection", "lathem", "lathemi", "lathemisphere", "latitudedir",
        "latitudedirection", "latitudehemisphere", "latref", "latituderef", "n/s", "nsindicator",
        "northsouth",
    ), "lat_hemisphere"),
    **dict.fromkeys((
        "londir", "londirection", "lonhem", "lonhemi", "lonhemisphere", "longitudedir",
        "longitudedirection", "longitudehemisphere", "lonref", "longituderef", "e/w",
        "ewindicator", "eastwest", "ew",
    ), "lon_hemisphere"),
}  # fmt: skip
"""Names after lower-casing and taking out `_`, `-`, blanks and units; documented columns are
known by their own names as well. `altitude` is a height above the geoid; `lat_hemisphere` and
`lon_hemisphere` hold the letters N, S, E, W. `ns` beside `ew` is such a column, else satellites."""

HEMISPHERES = {"lat_hemisphere": "lat_deg", "lon_hemisphere": "lon_deg"}
"""Columns of letters, and the column whose sign they give."""
EARTH_FIXED = ("ecef_x_m", "ecef_y_m", "ecef_z_m")
"""Earth-fixed coordinates, of headers `x`, `y`, `z`, where no latitude, longitude or height is."""
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
    **dict.fromkeys(HEMISPHERES, ""),
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


@functools.cache
def _known(extra: tuple[str, ...]) -> dict[str, str]:
    names = {_squash(name): name for name in (*COLUMNS, *extra)}
    stems = {_squash(_split_unit(name)[0]): name for name in (*COLUMNS, *extra)}
    return {**names, **stems, **ALIASES}


@functools.lru_cache(MAX_COLUMNS)
def _meaning(header: str, extra: tuple[str, ...]) -> tuple[str | None, str, str | None, str]:
    """Documented name (None where there is none), stem, unit and time scale of a header."""
    if len(header) > _LONGEST_HEADER:
        return None, header, None, ""
    known = _known(extra)
    stem, unit = _split_unit(header)
    scale = ""
    if scaled := re.fullmatch(_SCALED_TIME, header, re.IGNORECASE):
        stem, unit, scale = scaled[1], None, scaled[2]
    elif _squash(stem) in ("utc", "gpst"):
        scale = _squash(stem)
    name = known.get(_squash(stem))
    if name is None and (name := known.get(_squash(header))) is not None:
        unit, stem = None, header
    if header.startswith("x_"):
        name = None
    return name, stem, unit, _SCALE_NAMES.get(scale.lower(), "")


def known_names(headers: Iterable[str], *, extra: Iterable[str] = ()) -> list[str]:
    """Documented names that the headers mean, in their order."""
    further = tuple(extra)
    return [name for header in headers if (name := _meaning(header, further)[0]) is not None]


def with_unit(header: str, unit: str) -> tuple[str, str]:
    """A header that has a unit, as `name [unit]`, and the unit or time scale it had before."""
    _, stem, said, scale = _meaning(header, tuple(TRUTH_COLUMNS))
    return f"{(stem if said else header).strip()} [{unit}]", said or scale


def refuse_too_many(columns: int, *, where: str) -> None:
    """Raise InputError where a table has more columns than a recording can have."""
    if columns > MAX_COLUMNS:
        raise InputError(
            f"more than {MAX_COLUMNS:,} columns",
            code="E18",
            where=where,
            evidence=f"{columns:,} columns",
            cure="this is no table of epochs, or its line ends are lost; keep the columns needed",
        )


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
    InputError : more than MAX_COLUMNS headers, two headers of one meaning, or a unit that does
        not belong to its column.
    """
    refuse_too_many(len(headers), where=where)
    further = tuple(extra)
    mapped: dict[str, MappedColumn] = {}
    others: dict[str, MappedColumn] = {}
    taken: dict[str, int] = {}
    letters = {_squash(header) for header in headers} >= {"ns", "ew"}
    for index, header in enumerate(headers):
        name, stem, unit, scale = _meaning(header, further)
        if letters and _squash(header) == "ns":
            name, stem, unit, scale = "lat_hemisphere", header, None, ""
        if name is None:
            base = re.sub(r"\W+", "_", header.removeprefix("x_")).strip("_") or str(index + 1)
            # No base ends in "_", so the number of those tells equal ones apart.
            taken[base] = taken.get(base, -1) + 1
            others[f"x_{base}{'_' * taken[base]}"] = MappedColumn(index, header)
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
        mapped[name] = MappedColumn(index, header, factor, scale)
    if not mapped.keys() & {"lat_deg", "lon_deg", "height_m", "altitude"}:
        for name, column in _earth_fixed(others).items():
            mapped[name] = column
            others = {n: other for n, other in others.items() if other.index != column.index}
    if "height_m" in mapped and "altitude" in mapped:
        # Both heights are there: the ellipsoidal one serves, the other is kept aside.
        others["x_altitude"] = mapped.pop("altitude")
    return mapped, others


def _earth_fixed(others: Mapping[str, MappedColumn]) -> dict[str, MappedColumn]:
    """Columns EARTH_FIXED among those of no other meaning; none unless all three are there."""
    found: dict[str, MappedColumn] = {}
    for column in others.values():
        stem, unit = _split_unit(column.header)
        axis = re.sub("ecef", "", _squash(stem))
        name = f"ecef_{axis}_m"
        if name in EARTH_FIXED and name not in found and (unit or "m") in _UNITS["m"]:
            found[name] = replace(column, factor=_UNITS["m"][unit or "m"])
    return {name: found[name] for name in EARTH_FIXED} if len(found) == 3 else {}


def header_sources(
    mapped: Mapping[str, MappedColumn], others: Mapping[str, MappedColumn]
) -> dict[str, str]:
    """Header by the name it was taken for."""
    return {name: column.header.strip() for name, column in {**mapped, **others}.items()}


def map_text(mapped: Mapping[str, MappedColumn], others: Mapping[str, MappedColumn]) -> str:
    """The map in one line, for the recording's options."""
    return ", ".join(f"{n} <- {header}" for n, header in header_sources(mapped, others).items())


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
    if asked & {"lat_deg", "lon_deg", "height_m"}:
        asked |= set(EARTH_FIXED)
    asked |= {letters for letters, name in HEMISPHERES.items() if name in asked}
    return tuple(name for name in (*available, *others) if name in asked)


def no_level_finding(sources: Mapping[str, str]) -> tuple[Finding, ...]:
    """E25 where no header of a table was taken for HPL: no epoch can be available then.

    Parameters
    ----------
    sources : header by the name it was taken for.
    """
    if "hpl_m" in sources:
        return ()
    near = [h for h in sources.values() if re.search("hpl|protection", h, re.IGNORECASE)]
    return (
        Finding(
            "E25",
            "warning",
            "no column was taken for HPL: every epoch counts as without protection level",
            evidence=f"headers like it: {', '.join(map(repr, near))[:300]}"
            if near
            else f"headers: {', '.join(sources.values())[:300]}",
            cure="name the column 'hpl_m', where there is one",
        ),
    )


def applied_geoid(geoid: float | None, wanted: Collection[str]) -> str:
    """The undulation in words, where a wanted column is an altitude."""
    return f"{geoid:g} m as given" if geoid is not None and "altitude" in wanted else ""
