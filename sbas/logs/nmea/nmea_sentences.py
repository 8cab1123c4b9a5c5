"""The sentences that are read, by kind, and their fields as columns.

Fields after NMEA 0183 as described by gpsd (`www/NMEA.adoc`, `drivers/driver_nmea0183.c`) and,
for PUBX,00, the u-blox M8 protocol specification, 31.3.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Set
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.nmea.nmea_fields import NO_TIME, Fields
from sbas.logs.nmea.nmea_framing import Sentences
from sbas.recording import MODES

Columns = dict[str, NDArray[Any]]

KNOT_MPS = 1852 / 3600
KMH_MPS = 1 / 3.6

POSITIONS = ("GGA", "GNS", "PASHR", "PUBX", "RMC")
"""Kinds that carry time and position, the preferred one first: each epoch has at least one."""
TIMED = ("GST", "GBS", "ZDA")
"""Kinds that carry a time, and belong to the epoch of that time."""
UNTIMED = ("GSA", "GSV", "VTG")
"""Kinds without a time, which belong to the epoch in progress."""

_NONE, _STANDALONE, _DGNSS, _RTK, _OTHER = (
    MODES.index(name) for name in ("none", "standalone", "dgnss", "rtk", "other")
)
UNSTATED = -1
_QUALITY = np.array([_NONE, _STANDALONE, _DGNSS, _OTHER, _RTK, _RTK, _OTHER, _OTHER, _OTHER])
_ASHTECH = np.array([_STANDALONE, _DGNSS, _RTK, _RTK])
_LETTERS = {b"N": _NONE, b"A": _STANDALONE, b"D": _DGNSS, b"R": _RTK, b"F": _RTK}
_PUBX_STATUS = {
    b"NF": _NONE, b"TT": _NONE, b"DR": _OTHER, b"RK": _OTHER,
    b"G2": _STANDALONE, b"G3": _STANDALONE, b"D2": _DGNSS, b"D3": _DGNSS,
}  # fmt: skip
GSA_IDS = 12
_GSV_SATELLITES = 4
_FIRST_SBAS_ID, _LAST_SBAS_ID, SBAS_ID_TO_PRN = 33, 64, 87
_FIRST_YEAR_OF_1900S = 80
_FIRST_GPS_DAY, _LAST_YEAR = 3657, 2200
NO_DAY = np.iinfo(np.int32).min


def _mode_of_letter() -> NDArray[np.int8]:
    table = np.full(256, _OTHER, np.int8)
    table[0] = UNSTATED
    for letter, mode in _LETTERS.items():
        table[letter[0]] = mode
    return table


_MODE_OF_LETTER = _mode_of_letter()


def by_kind(found: Sentences, kinds: Set[str]) -> dict[str, NDArray[np.intp]]:
    """Rows of the sentences of each kind; kinds that do not occur are left out."""
    talker = found.address & np.uint64(0xFF)
    formatter = np.where(talker == ord("P"), 0, found.address >> np.uint64(16) & _FOUR)
    result = {}
    for kind in (*POSITIONS, *TIMED, *UNTIMED):
        if kind not in kinds:
            continue
        if kind == "PASHR":
            rows = np.flatnonzero(found.address == _number(b"PASHR,PO"))
            start = found.start[rows]
            rows = rows[(found.data[start + 9] == ord("S")) & (found.data[start + 10] == ord(","))]
        elif kind == "PUBX":
            rows = np.flatnonzero(found.address == _number(b"PUBX,00,"))
        else:
            rows = np.flatnonzero(formatter == _number(kind.encode() + b","))
        if len(rows):
            result[kind] = rows
    return result


def _number(text: bytes) -> np.uint64:
    return np.uint64(int.from_bytes(text, "little"))


_FOUR = np.uint64(0xFFFFFFFF)


def decode(
    found: Sentences, offset: int, want: Set[str], kinds: Set[str]
) -> tuple[dict[str, Columns], Counter[str]]:
    """Columns of each kind of sentence, and counts of what was odd.

    Parameters
    ----------
    found : sentences of a stretch.
    offset : place of the stretch in the file.
    want : columns of the epoch table to serve.
    kinds : kinds to read.

    Returns
    -------
    columns : by kind, each with `at`, the place in the file, and where it has one `tod_ns`.
        Sentences without a usable time are counted and dropped.
    counts : sentences by kind, "unreadable" fields, "without time" sentences.
    """
    columns: dict[str, Columns] = {}
    counts: Counter[str] = Counter()
    for kind, rows in by_kind(found, kinds).items():
        fields = Fields(found[rows])
        read = _DECODERS[kind](fields, want)
        read["at"] = fields.sentences.start + offset
        if kind == "GSA":
            read["ordinal"] = rows.astype(np.int64)
            _dilution(found, rows, want, read)
        counts[kind] = len(rows)
        counts["unreadable"] += fields.unreadable + int(fields.out_of_range.sum())
        if "tod_ns" in read:
            known = read["tod_ns"] != NO_TIME
            if not known.all():
                counts["without time"] += int(np.count_nonzero(~known))
                read = {name: values[known] for name, values in read.items()}
        if len(read["at"]):
            columns[kind] = read
    return columns, counts


def _position(fields: Fields, field: int, want: Set[str], read: Columns) -> None:
    if "lat_deg" in want or "lon_deg" in want:
        read["lat_deg"], some = fields.angle_deg(field, b"N", b"S", 90)
        read["lon_deg"], others = fields.angle_deg(field + 2, b"E", b"W", 180)
        read["decimals"] = np.minimum(some, others)
        read["out_of_range"] = fields.out_of_range.copy()


def _numbers(fields: Fields, want: Set[str], read: Columns, of: Mapping[str, int]) -> None:
    for name, field in of.items():
        if name in want:
            read[name] = fields.number(field)


def _count(fields: Fields, field: int, want: Set[str], read: Columns) -> None:
    if "n_sv" in want:
        value = fields.integer(field)
        read["n_sv"] = np.where(value < 255, value, -1)


def _speed(fields: Fields, speed: int, course: int, unit: float, want: Set[str],
           read: Columns) -> None:  # fmt: skip
    """Speed and its parts east and north by the true course."""
    if want & {"speed_mps", "vel_e_mps", "vel_n_mps"}:
        read["speed_mps"] = fields.number(speed) * unit
    if want & {"vel_e_mps", "vel_n_mps"}:
        angle = np.radians(fields.number(course))
        read["vel_e_mps"] = read["speed_mps"] * np.sin(angle)
        read["vel_n_mps"] = read["speed_mps"] * np.cos(angle)


def _altitude(fields: Fields, altitude: int, separation: int, units: tuple[int, ...],
              want: Set[str], read: Columns) -> None:  # fmt: skip
    if want & {"height_m", "x_undulation_m"}:
        read["altitude"] = fields.number(altitude)
        read["x_undulation_m"] = fields.number(separation)
        for field, name in zip(units, ("altitude", "x_undulation_m"), strict=False):
            unit = fields.letter(field)
            read[name] = np.where((unit == ord("M")) | (unit == 0), read[name], np.nan)


def _gga(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(1)}
    _position(fields, 2, want, read)
    if "mode" in want:
        quality = fields.integer(6)
        known = (quality >= 0) & (quality < len(_QUALITY))
        mode = np.where(known, _QUALITY[np.where(known, quality, 0)], _OTHER)
        read["mode"] = np.where(quality < 0, UNSTATED, mode).astype(np.int8)
        read["dead_reckoning"] = quality == 6
    _count(fields, 7, want, read)
    _altitude(fields, 9, 11, (10, 12), want, read)
    _numbers(fields, want, read, {"hdop": 8, "correction_age_s": 13, "x_station_id": 14})
    return read


def _gns(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(1)}
    _position(fields, 2, want, read)
    if "mode" in want:
        letter = first_mode_letter(fields, 6)
        read["mode"] = _MODE_OF_LETTER[letter]
        read["dead_reckoning"] = letter == ord("E")
    _count(fields, 7, want, read)
    _altitude(fields, 9, 10, (), want, read)
    _numbers(fields, want, read, {"hdop": 8, "correction_age_s": 11, "x_station_id": 12})
    return read


def first_mode_letter(fields: Fields, field: int) -> NDArray[np.uint8]:
    """(n,) the first letter, of one a system, that is not N; N where all are, 0 where none is."""
    start, end = fields.span(field)
    letter = np.where(end > start, fields.data[start], np.uint8(0))
    for step in range(1, int((end - start).max(initial=0))):
        look = (letter == ord("N")) & (start + step < end)
        if not look.any():
            break
        letter[look] = fields.data[start[look] + step]
    return letter


def _rmc(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(1), "valid": fields.letter(2) == ord("A")}
    _position(fields, 3, want, read)
    if "mode" in want:
        letter = fields.letter(12)
        mode = np.where(read["valid"], _MODE_OF_LETTER[letter], _NONE)
        read["mode"] = mode.astype(np.int8)
        read["dead_reckoning"] = (letter == ord("E")) & read["valid"]
    _speed(fields, 7, 8, KNOT_MPS, want, read)
    date = fields.integer(9)
    year = date % 100
    century = np.where(year >= _FIRST_YEAR_OF_1900S, 1900, 2000)
    day = days(century + year, date // 100 % 100, date // 10_000)
    read["day"] = np.where(date < 0, NO_DAY, day)
    return read


def _pashr(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(4)}
    _position(fields, 5, want, read)
    if "mode" in want:
        kind = fields.integer(2)
        known = (kind >= 0) & (kind < len(_ASHTECH))
        mode = np.where(known, _ASHTECH[np.where(known, kind, 0)], _OTHER)
        mode = np.where(kind < 0, UNSTATED, mode)
        # Without a fix the type stays 0 and the position empty.
        read["mode"] = np.where(fields.filled(5), mode, _NONE).astype(np.int8)
    _count(fields, 3, want, read)
    _numbers(fields, want, read, {"height_m": 9, "correction_age_s": 10, "vel_u_mps": 13,
                                  "pdop": 14, "hdop": 15, "vdop": 16})  # fmt: skip
    _speed(fields, 12, 11, KNOT_MPS, want, read)
    return read


def _pubx(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(2)}
    _position(fields, 3, want, read)
    if "mode" in want:
        start, end = fields.span(8)
        status = fields.data[start].astype(np.uint16) << 8 | fields.data[start + 1]
        mode = np.full(len(fields), UNSTATED, np.int8)
        for word, value in _PUBX_STATUS.items():
            mode[(status == int.from_bytes(word, "big")) & (end - start == 2)] = value
        read["mode"] = mode
        read["two_dimensional"] = (fields.data[start + 1] == ord("2")) & (mode != UNSTATED)
        read["dead_reckoning"] = status == int.from_bytes(b"DR", "big")
    _numbers(fields, want, read, {"height_m": 7, "x_h_accuracy_m": 9, "x_v_accuracy_m": 10,
                                  "correction_age_s": 14, "hdop": 15, "vdop": 16})  # fmt: skip
    if "vel_u_mps" in want:
        read["vel_u_mps"] = -fields.number(13)
    _count(fields, 18, want, read)
    _speed(fields, 11, 12, KMH_MPS, want, read)
    return read


def _gst(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(1)}
    _numbers(fields, want, read, {"sigma_n_m": 6, "sigma_e_m": 7, "sigma_u_m": 8})
    if "cov_en_m2" in want:
        major, minor, angle = fields.number(3), fields.number(4), np.radians(fields.number(5))
        read["cov_en_m2"] = (major**2 - minor**2) * np.sin(angle) * np.cos(angle)
    return read


GBS_COLUMNS = {
    "x_gbs_sigma_n_m": 2, "x_gbs_sigma_e_m": 3, "x_gbs_sigma_u_m": 4, "x_gbs_failed_sv": 5,
    "x_gbs_missed_detection": 6, "x_gbs_bias_m": 7, "x_gbs_bias_sigma_m": 8,
}  # fmt: skip


def _gbs(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {"tod_ns": fields.clock_ns(1)}
    _numbers(fields, want, read, GBS_COLUMNS)
    return read


def _zda(fields: Fields, want: Set[str]) -> Columns:
    day, month, year = fields.integer(2), fields.integer(3), fields.integer(4)
    return {"tod_ns": fields.clock_ns(1), "day": days(year, month, day)}


def _gsa(fields: Fields, want: Set[str]) -> Columns:
    found = fields.sentences
    steps = np.minimum(np.arange(3, 4 + GSA_IDS), found.commas[:, None] + 1)
    edge = found.marks[found.first[:, None] + steps]
    start, size = edge[:, :-1] + 1, np.diff(edge, axis=1) - 1
    read: Columns = {
        "used": (size > 0).sum(axis=1, dtype=np.int64),
        "two_dimensional": fields.letter(2) == ord("2"),
    }
    if "geo_prn" in want:
        read["geo_prn"] = _sbas_prn(fields, start, size)
    return read


def _dilution(found: Sentences, rows: NDArray[np.intp], want: Set[str], read: Columns) -> None:
    """Read the DOPs of each GSA that follows another kind, and whether they are unreadable.

    GSA that follow each other are of one cycle and tell the same: numbers take longest.
    """
    heads = np.flatnonzero(np.diff(rows, prepend=-2) != 1)
    fields = Fields(found[rows[heads]])
    odd = np.zeros(len(rows), np.bool_)
    for name, field in (("pdop", 15), ("hdop", 16), ("vdop", 17)):
        if name in want:
            read[name] = np.full(len(rows), np.nan)
            read[name][heads] = fields.number(field)
            odd[heads] |= np.isnan(read[name][heads]) & fields.filled(field)
    read["odd_dilution"] = odd


def _sbas_prn(
    fields: Fields, start: NDArray[np.int64], size: NDArray[np.int64]
) -> NDArray[np.int16]:
    """(n,) PRN of the SBAS satellite among the ids, 0 for several, -1 for none.

    Ids 33 to 64 are SBAS only where the sentence is not of another system than GPS.
    """
    found = fields.sentences
    talker = found.address & np.uint64(0xFFFF)
    system = fields.letter(18)
    gps = ((talker == _number(b"GP")) | (talker == _number(b"GN"))) & (
        (system == 0) | (system == ord("1"))
    )
    prn = np.full(len(found), -1, np.int16)
    rows = np.flatnonzero(gps)
    tens, ones = fields.data[start[rows]], fields.data[start[rows] + 1]
    number = (tens - np.uint8(48)).astype(np.int16) * 10 + (ones - np.uint8(48))
    number[size[rows] != 2] = 0
    sbas = (number >= _FIRST_SBAS_ID) & (number <= _LAST_SBAS_ID)
    several = sbas.sum(axis=1)
    only = np.where(sbas, number, 0).sum(axis=1) + SBAS_ID_TO_PRN
    prn[rows] = np.where(several == 0, -1, np.where(several == 1, only, 0))
    return prn


def _gsv(fields: Fields, want: Set[str]) -> Columns:
    found = fields.sentences
    # Three fields, then four a satellite and, from NMEA 4.1 on, the signal.
    satellites, rest = np.divmod(np.maximum(found.commas - 3, 0), 4)
    heard = np.zeros(len(found), np.int64)
    for k in range(_GSV_SATELLITES):
        start, end = fields.span(7 + 4 * k)
        silent = (fields.data[start] == ord("0")) & (fields.data[end - 1] == ord("0"))
        heard += (satellites > k) & (end > start) & ~silent
    signal = found.data[found.marks[found.first + found.commas] + 1]
    return {
        "talker": (found.address & np.uint64(0xFFFF)).astype(np.int64),
        "signal": np.where(rest == 1, signal, np.uint8(0)).astype(np.int64),
        "total": fields.integer(1, 0),
        "number": fields.integer(2, 0),
        "heard": heard,
    }


def _vtg(fields: Fields, want: Set[str]) -> Columns:
    read: Columns = {}
    _speed(fields, 7, 1, KMH_MPS, want, read)
    return read


def days(
    year: NDArray[np.int64], month: NDArray[np.int64], day: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Days since 1970 of (n,) dates; `NO_DAY` for an impossible one, or one before GPS time."""
    good = (year >= 1980) & (year <= _LAST_YEAR) & (month >= 1) & (month <= 12) & (day >= 1)
    months = np.where(good, (year - 1970) * 12 + month - 1, 120)
    first = months.astype("M8[M]").astype("M8[D]").astype(np.int64)
    following = (months + 1).astype("M8[M]").astype("M8[D]").astype(np.int64)
    value = first + np.where(good, day - 1, 0)
    good &= (value < following) & (value >= _FIRST_GPS_DAY)
    return np.where(good, value, NO_DAY)


_DECODERS: dict[str, Callable[[Fields, Set[str]], Columns]] = {
    "GGA": _gga, "GNS": _gns, "PASHR": _pashr, "PUBX": _pubx, "RMC": _rmc, "GST": _gst,
    "GBS": _gbs, "ZDA": _zda, "GSA": _gsa, "GSV": _gsv, "VTG": _vtg,
}  # fmt: skip
