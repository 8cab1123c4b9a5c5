"""RINEX navigation files, versions 2, 3 and 4: GPS, Galileo and SBAS satellites.

Records of other systems are passed over. Source of the order of numbers: RINEX 2.11, tables A4
and A16; RINEX 3.05, tables A6, A8 and A12.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.decompression import plain_file
from sbas.rinex.ephemerides import GeoEphemerides, KeplerEphemerides, Navigation
from sbas.rinex.navigation_records import Record, Seen, parse_number, parse_records
from sbas.timescales import WEEK_S

MAX_BYTES = 1 << 29
_UNKNOWN_TRANSMISSION_S = 9e8
"""Writers put 0.9999e9 for a time of transmission that they do not know."""
_BDT_LEAPS = 14


def read_navigation(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
) -> Navigation:
    """Broadcast orbits and clocks of one or more navigation files.

    Parameters
    ----------
    paths : RINEX navigation of versions 2 to 4, plain or compressed.

    Returns
    -------
    Navigation; a record that cannot be read is left out and counted (E10), one that several
    files have is there once.

    Raises
    ------
    InputError : a file that is no RINEX navigation; no record of GPS, Galileo or SBAS in any.
    """
    names = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    if not names:
        raise InputError("no navigation file was given", cure="--nav FILE.nav")
    galileo: list[dict[str, float]] = []
    gps: list[dict[str, float]] = []
    geo: list[dict[str, float]] = []
    seen = Seen()
    findings: list[Finding] = []
    for name in names:
        noted, seen.unreadable, seen.first_unreadable = 0, 0, ""
        for record in _file_records(Path(name), seen):
            row = _geo_row(record) if record.system == "S" else _kepler_row(record)
            if row is None:
                seen.note(record.line)
                continue
            {"G": gps, "E": galileo, "S": geo}[record.system].append(row)
            noted += 1
        findings += _file_findings(noted, seen, str(name))
    if not (gps or galileo or geo):
        raise InputError(
            "the navigation files have no record of GPS, Galileo or SBAS satellites",
            code="E15",
            where=", ".join(map(str, names)),
            evidence="; ".join(f.message for f in findings),
            cure="give a file with GPS navigation",
        )
    has_klobuchar = len(seen.alpha) == 4 and len(seen.beta) == 4
    return Navigation(
        _kepler(gps),
        _kepler(galileo),
        _geo(geo),
        (seen.alpha, seen.beta) if has_klobuchar else None,
        seen.leap_seconds,
        tuple(findings),
    )


def _file_findings(kept: int, seen: Seen, where: str) -> list[Finding]:
    findings = []
    if seen.unreadable:
        findings.append(
            Finding(
                "E10",
                "warning",
                f"{seen.unreadable:,} navigation records are cut, unreadable or impossible and "
                "left out",
                where=where,
                evidence=f"first {seen.first_unreadable!r}",
                cure="get the file again",
            )
        )
    if not kept:
        findings.append(
            Finding(
                "E15",
                "warning",
                "the navigation file has no record of GPS, Galileo or SBAS satellites",
                where=where,
                cure="give a file with GPS navigation",
            )
        )
    return findings


def _file_records(path: Path, seen: Seen) -> list[Record]:
    try:
        plain = plain_file(path)
        if plain.path.stat().st_size > MAX_BYTES:
            raise InputError(
                "the navigation file is larger than any such file",
                code="E21",
                where=str(path),
                evidence=f"limit {MAX_BYTES:,} bytes",
                cure="split it by days",
            )
        text = plain.path.read_bytes().decode("latin-1")
    except OSError as error:
        raise InputError(
            "the navigation file cannot be read",
            where=str(path),
            evidence=error.strerror or str(error),
            cure="check the name and the folder",
        ) from error
    lines = text.rstrip("\0\x1a").replace("\r", "").split("\n")
    last = lines.pop()  # behind the last line end there is nothing, or a line that may be cut
    lines += [last] if last else []
    first = lines[0] if lines else ""
    if "RINEX VERSION" not in first[60:80]:
        raise InputError(
            "this is no RINEX navigation file" if first else "the navigation file is empty",
            code="E16" if first else "E15",
            where=str(path),
            evidence=repr(first[:60]),
            cure="give RINEX navigation (its first line ends in RINEX VERSION / TYPE)",
        )
    version, kind = parse_number(first[:9]), first[20]
    if not 2 <= version < 5 or kind not in ("NGHL" if version < 3 else "N"):
        raise InputError(
            f"this RINEX file is of type {kind!r}, version {first[:9].strip()}",
            code="E16",
            where=str(path),
            evidence=first.strip(),
            cure="give navigation of version 2, 3 or 4; observations go to --obs",
        )
    end = next((i for i, line in enumerate(lines) if line[60:80].strip() == "END OF HEADER"), None)
    if end is None:
        raise InputError(
            "the header of the navigation file does not end",
            code="E10",
            where=str(path),
            evidence=f"{len(lines):,} lines",
            cure="get the file again",
        )
    _read_header(lines[1:end], seen)
    if version < 3 and kind not in "NH":
        return []  # of GLONASS or Galileo alone
    return list(parse_records(lines[end + 1 :], version, kind, seen, ends_whole=not last))


def _read_header(lines: Sequence[str], seen: Seen) -> None:
    for line in lines:
        label = line[60:80].strip()
        if label in ("ION ALPHA", "ION BETA"):
            _keep_klobuchar(label[4], _four(line[2:50]), seen)
        elif label == "IONOSPHERIC CORR" and line[:4] in ("GPSA", "GPSB"):
            _keep_klobuchar(line[3], _four(line[5:53]), seen)
        elif label == "LEAP SECONDS":
            value = parse_number(line[:6])
            if np.isfinite(value):
                from_bdt = line[24:27] in ("BDS", "BDT")
                seen.leap_seconds = int(value) + (_BDT_LEAPS if from_bdt else 0)


def _keep_klobuchar(which: str, values: tuple[float, ...], seen: Seen) -> None:
    if which == "A":
        seen.alpha = values or seen.alpha
    else:
        seen.beta = values or seen.beta


def _four(text: str) -> tuple[float, ...]:
    values = tuple(parse_number(text[at : at + 12]) for at in range(0, 48, 12))
    return values if np.isfinite(values).all() else ()


def _nearest_week(second_of_week: float, reference_s: float) -> float:
    """GPS seconds of a second of the week, in the week that lies nearest to a reference."""
    return second_of_week + WEEK_S * round((reference_s - second_of_week) / WEEK_S)


def _transmission_s(second_of_week: float, toe_s: float) -> float:
    """When a record was sent; its reference time, which is later, where that is not known."""
    known = math.isfinite(second_of_week) and abs(second_of_week) < _UNKNOWN_TRANSMISSION_S
    return _nearest_week(second_of_week, toe_s) if known else toe_s


_KEPLER_ORDER = (
    "af0_s", "af1", "af2", "iode", "crs_m", "delta_n", "m0", "cuc", "eccentricity", "cus",
    "sqrt_a", "toe", "cic", "omega0", "cis", "i0", "crc_m", "omega", "omega_dot", "idot",
    "source", "week", "l2p", "ura_m", "health", "tgd_s", "iodc", "transmission", "fit_h",
)  # fmt: skip
_MAY_BE_BLANK = {"source", "week", "l2p", "ura_m", "iodc", "transmission", "fit_h"}
_WHOLE = {"prn", "iode", "iodc", "health", "source", "iodn"}
_MOST = {
    "crs_m": 1024.0, "crc_m": 1024.0, "cuc": 6.11e-5, "cus": 6.11e-5, "cic": 6.11e-5,
    "cis": 6.11e-5, "delta_n": 1.18e-8, "idot": 2.94e-9, "omega_dot": 3.0e-6, "m0": 3.15,
    "omega": 3.15, "omega0": 3.15, "i0": 3.15,
}  # fmt: skip
"""Largest numbers that the fields of a broadcast message can hold (IS-GPS-200, table 20-III; the
Galileo OS SIS ICD, table 60, has the same fields): beyond them a digit was lost."""
_SQRT_A = (2530.0, 8192.0)
_MOST_ECCENTRICITY = 0.5
"""Ranges of what the messages can hold (IS-GPS-200, table 20-III; Galileo OS SIS ICD, table 43)."""
_MOST_TOE_S = 604_800.0
_MOST_WHOLE = 1 << 31


def _kepler_row(record: Record) -> dict[str, float] | None:
    """One record by names; None where a number is missing that cannot be, or is impossible."""
    galileo = record.system == "E"
    values = dict(zip(_KEPLER_ORDER, record.numbers, strict=False))
    if any(math.isnan(v) for name, v in values.items() if name not in _MAY_BE_BLANK):
        return None
    if galileo:
        values["iodc"] = values["iode"]  # there stands another group delay
    values["iodc"] = _given_or(values["iodc"], -1.0)
    values["source"] = _given_or(values["source"], 0.0) if galileo else 0.0
    possible = (
        _SQRT_A[0] <= values["sqrt_a"] <= _SQRT_A[1]
        and 0 <= values["eccentricity"] < _MOST_ECCENTRICITY
        and 0 <= values["toe"] <= _MOST_TOE_S
        and all(abs(values[name]) < _MOST_WHOLE for name in _WHOLE & values.keys())
        and record.prn > 0
        and all(abs(values[name]) <= most for name, most in _MOST.items())
    )
    if not possible:
        return None
    toe_s = _nearest_week(values["toe"], record.toc_s)
    return values | {
        "prn": record.prn,
        "toc_s": record.toc_s,
        "toe_s": toe_s,
        "transmission_s": _transmission_s(values["transmission"], toe_s),
        "fit_h": 0.0 if galileo else _fit_hours(values["fit_h"]),
    }


def _given_or(value: float, otherwise: float) -> float:
    return otherwise if math.isnan(value) else value


def _fit_hours(value: float) -> float:
    """Fit interval [h]; files that give the flag of the message instead mean 4 h or more."""
    return 0.0 if not math.isfinite(value) or value <= 1 else value


def _kepler(rows: list[dict[str, float]]) -> KeplerEphemerides:
    names = [field.name for field in fields(KeplerEphemerides)]
    return KeplerEphemerides(**_columns(_distinct(rows, names), names))


def _distinct(rows: list[dict[str, float]], names: Sequence[str]) -> list[dict[str, float]]:
    """Rows by satellite and time, each once."""
    keys = {tuple(_given_or(row[name], math.inf) for name in names): row for row in rows}
    order = [name for name in ("prn", "toe_s", "t0_s", "transmission_s") if name in names]
    return sorted(keys.values(), key=lambda row: [row[name] for name in order])


def _columns(rows: Sequence[dict[str, float]], names: Sequence[str]) -> dict[str, Any]:
    return {
        name: np.array([row[name] for row in rows], np.int64 if name in _WHOLE else np.float64)
        for name in names
    }


_GEO_ORDER = (
    "clock_s", "drift", "transmission", "x", "vx", "ax", "health", "y", "vy", "ay", "ura_m",
    "z", "vz", "az", "iodn",
)  # fmt: skip


def _geo_row(record: Record) -> dict[str, float] | None:
    values = dict(zip(_GEO_ORDER, record.numbers, strict=True))
    may_be_blank = {"transmission", "ura_m", "iodn"}
    if any(math.isnan(v) for name, v in values.items() if name not in may_be_blank):
        return None
    values["iodn"] = _given_or(values["iodn"], -1.0)
    if any(abs(values[name]) >= _MOST_WHOLE for name in ("health", "iodn")):
        return None
    return values | {
        "prn": record.prn,
        "t0_s": record.toc_s,
        "transmission_s": _transmission_s(values["transmission"], record.toc_s),
    }


def _geo(rows: list[dict[str, float]]) -> GeoEphemerides:
    """SBAS records; RINEX gives kilometres."""
    names = ["prn", "t0_s", "transmission_s", *_GEO_ORDER[:2], *_GEO_ORDER[3:]]
    c = _columns(_distinct(rows, names), names)
    return GeoEphemerides(
        c["prn"],
        c["t0_s"],
        c["transmission_s"],
        1000 * np.stack([c["x"], c["y"], c["z"]], axis=-1),
        1000 * np.stack([c["vx"], c["vy"], c["vz"]], axis=-1),
        1000 * np.stack([c["ax"], c["ay"], c["az"]], axis=-1),
        c["clock_s"],
        c["drift"],
        c["health"],
        c["ura_m"],
        c["iodn"],
    )
