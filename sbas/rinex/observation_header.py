"""The header of a RINEX observation file, versions 2 to 4.

Source: RINEX 3.05, table A2; RINEX 2.11, table A1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NoReturn

from sbas.exceptions import InputError
from sbas.rinex.observations import ObservationHeader
from sbas.rinex.version_2_codes import codes_of_version_2

SYSTEMS = "GRECJSI"
TIME_SCALES = {"GPS": "GPST", "GLO": "UTC", "GAL": "GST", "QZS": "QZSST", "BDT": "BDT",
               "BDS": "BDT", "IRN": "GPST", "UTC": "UTC"}  # fmt: skip
"""GLO means UTC there, not the system time of GLONASS, which is three hours ahead of it."""
_USUAL_SCALE = {"R": "UTC", "E": "GST", "J": "QZSST", "C": "BDT"}
_BDT_LEAPS = 14


def parse_header(lines: Sequence[str], *, where: str) -> ObservationHeader:
    """Header from its lines, the first (version and type) included.

    Raises
    ------
    InputError : no observation file, another version, no observation codes or not as many as
        announced, or a time scale that is not known.
    """
    version, kind, system = _float(lines[0][:9]), lines[0][20:21], lines[0][40:41]
    if kind != "O" or version is None or not 2 <= version < 5:
        raise InputError(
            f"this RINEX file is of type {kind!r}, version {lines[0][:9].strip()}",
            code="E16",
            where=where,
            evidence=lines[0].strip(),
            cure="give observations of version 2, 3 or 4; navigation goes to --nav",
        )
    found: dict[str, str] = {}
    for line in lines[1:]:
        found.setdefault(line[60:80].strip(), line[:60])
    codes = (
        codes_of_version_2(parse_types(lines[1:], where=where), system)
        if version < 3
        else parse_codes(lines[1:], where=where)
    )
    if not codes:
        raise InputError(
            "the header names no observation codes",
            code="E10",
            where=where,
            evidence="no line SYS / # / OBS TYPES",
            cure="get the file again",
        )
    position = _floats(found.get("APPROX POSITION XYZ", ""))
    interval = _float(found.get("INTERVAL", "")[:10])
    return ObservationHeader(
        version,
        found.get("MARKER NAME", "").strip(),
        found.get("REC # / TYPE / VERS", "").strip(),
        found.get("ANT # / TYPE", "").strip(),
        position if position and math.hypot(*position) > 1e6 else None,
        _floats(found.get("ANTENNA: DELTA H/E/N", "")) or (0.0, 0.0, 0.0),
        interval if interval and interval > 0 else None,
        _time_scale(found.get("TIME OF FIRST OBS", ""), system, where),
        _leap_seconds(found.get("LEAP SECONDS", "")),
        codes,
        parse_scale(lines[1:], codes, where=where),
        found.get("SIGNAL STRENGTH UNIT", "")[:20].strip(),
    )


def parse_codes(lines: Iterable[str], *, where: str) -> dict[str, tuple[str, ...]]:
    """Observation codes by system, of lines SYS / # / OBS TYPES (A1,2X,I3,13(1X,A3))."""
    codes: dict[str, list[str]] = {}
    stated: dict[str, str] = {}
    letter = ""
    for line in lines:
        if line[60:80].strip() != "SYS / # / OBS TYPES":
            continue
        if line[:1].strip():
            letter = line[0]
            codes[letter], stated[letter] = [], line[3:6]
        if letter:
            codes[letter] += line[6:60].split()
    for letter, names in codes.items():
        _check_names(names, stated[letter], f"system {letter}", where)
    return {letter: tuple(names) for letter, names in codes.items()}


def parse_types(lines: Iterable[str], *, where: str) -> tuple[str, ...]:
    """Observation types of version 2, of lines # / TYPES OF OBSERV (I6,9(4X,A2))."""
    names: list[str] = []
    stated = ""
    for line in lines:
        if line[60:80].strip() == "# / TYPES OF OBSERV":
            stated = line[:6] if line[:6].strip() else stated
            names += line[6:60].split()
    if names:
        _check_names(names, stated, "all systems", where)
    return tuple(names)


def _check_names(names: Sequence[str], stated: str, which: str, where: str) -> None:
    """A code lost or invented would shift every value behind it into another code's place."""
    if stated.strip() != str(len(names)) or len(set(names)) != len(names):
        raise InputError(
            f"the observation codes of {which} are not those that the header announces",
            code="E10",
            where=where,
            evidence=f"announced {stated.strip()!r}, found {len(names)}: {' '.join(names[:20])}",
            cure="get the file again",
        )


def parse_scale(
    lines: Iterable[str], codes: dict[str, tuple[str, ...]], *, where: str
) -> dict[tuple[str, str], int]:
    """What values must be divided by, by system and code (A1,1X,I4,2X,I2,12(1X,A3))."""
    scale: dict[tuple[str, str], int] = {}
    letter, factor = "", 1
    for line in lines:
        if line[60:80].strip() != "SYS / SCALE FACTOR":
            continue
        names = line[10:60].split()
        if line[:1].strip():
            letter = line[0]
            digits = line[2:6].strip()
            if digits not in ("1", "10", "100", "1000"):
                _refuse_scale(line, where)
            factor = int(digits)
            if line[8:10].strip() in ("", "0"):
                names = list(codes.get(letter, ()))
        for name in names:
            if name not in codes.get(letter, ()):
                _refuse_scale(line, where)
            scale[letter, name] = factor
    return {key: factor for key, factor in scale.items() if factor != 1}


def _refuse_scale(line: str, where: str) -> NoReturn:
    raise InputError(
        "a scale factor of the header cannot be read",
        code="E10",
        where=where,
        evidence=line[:60].strip(),
        cure="get the file again",
    )


def _time_scale(first_epoch: str, system: str, where: str) -> str:
    stated = first_epoch[48:51].strip().upper()
    if stated and stated not in TIME_SCALES:
        raise InputError(
            f"the file's time scale {stated!r} is not known",
            code="E02",
            where=where,
            evidence=first_epoch.strip(),
            cure=f"known are {', '.join(TIME_SCALES)}",
        )
    return TIME_SCALES[stated] if stated else _USUAL_SCALE.get(system, "GPST")


def _leap_seconds(text: str) -> int | None:
    """GPST - UTC; a file may count from the origin of BeiDou time instead."""
    value = _float(text[:6])
    if value is None:
        return None
    return int(value) + (_BDT_LEAPS if text[24:27] in ("BDS", "BDT") else 0)


def _float(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _floats(text: str) -> tuple[float, float, float] | None:
    x, y, z = (_float(text[14 * k : 14 * (k + 1)]) for k in range(3))
    return None if x is None or y is None or z is None else (x, y, z)
