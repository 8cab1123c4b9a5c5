"""Layouts of the Septentrio SBF blocks: fields by revision, and the values that mean "no value".

Offsets count from the sync bytes `$@`. Sources: Septentrio PolaRx5TR Reference Guide, firmware
5.5.0, pages 295-300 (framing) and 383-429 (blocks); for the version 1 blocks the declarations of
Septentrio's `sbfdef.h`. Later revisions only add fields, so a layout is chosen by the revision
and the length that a block itself states, and fields that it lacks are missing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError

SYNC = b"$@"
MAX_LENGTH = 65535
TOW_MISSING = 4294967295
WEEK_MISSING = 65535

FLOAT_MISSING = -2e10
FLOAT_MISSING_BELOW = -1e10
"""Floats at or below this are the do-not-use value -2e10, whatever its rounding."""

_MISSING: dict[str, float] = {
    "f4": FLOAT_MISSING, "f8": FLOAT_MISSING,
    "u1": 255, "u2": 65535, "u4": 4294967295, "i1": -128, "i2": -32768,
}  # fmt: skip

PVT_GEODETIC, PVT_CARTESIAN = 4007, 4006
COV_GEODETIC, COV_CARTESIAN = 5906, 5905
DOP, RAIM_STATISTICS, END_OF_PVT, RECEIVER_TIME = 4001, 4011, 5921, 5914
GEO_RAW_L1, GEO_RAW_L5, ENCAPSULATED = 4020, 4021, 4097
PVT_GEODETIC_V1, PVT_CARTESIAN_V1, DOP_V1, RAIM_STATISTICS_V1 = 5904, 5903, 5909, 5915
SATELLITE_POSITIONS, RESIDUALS, GEO_CORRECTIONS = 4008, 4009, 5935


@dataclass(frozen=True)
class Field:
    """One field of a block: where it lies, its type, and the raw value that means "no value"."""

    name: str
    offset: int
    dtype: str
    missing: float
    since: int = 0

    @property
    def size(self) -> int:
        return int(np.dtype(self.dtype).itemsize)


@dataclass(frozen=True)
class Block:
    """One kind of block: its fields and its length by revision (the last for later ones)."""

    number: int
    name: str
    lengths: tuple[int, ...]
    fields: dict[str, Field]

    def length(self, revision: int) -> int:
        return self.lengths[min(revision, len(self.lengths) - 1)]


HEADER = (
    Field("sync", 0, "S2", 0), Field("crc", 2, "<u2", 0), Field("id", 4, "<u2", 0),
    Field("length", 6, "<u2", 0), Field("tow_ms", 8, "<u4", TOW_MISSING),
    Field("week", 12, "<u2", WEEK_MISSING),
)  # fmt: skip


def _block(number: int, name: str, lengths: tuple[int, ...], layout: str) -> Block:
    """Block from words `offset:type:name[=missing][@revision]`."""
    fields = {field.name: field for field in HEADER}
    for word in layout.split():
        word, _, since = word.partition("@")
        word, _, missing = word.partition("=")
        offset, kind, field_name = word.split(":")
        scalar = kind.rsplit(")", 1)[-1]
        value = float(missing) if missing else _MISSING[scalar]
        dtype = f"<{kind}" if scalar == kind else f"{kind[: -len(scalar)]}<{scalar}"
        fields[field_name] = Field(field_name, int(offset), dtype, value, int(since or 0))
    return Block(number, name, lengths, fields)


_PVT_TAIL = """
 60:f8:clock_bias 68:f4:clock_drift 72:u1:time_system 73:u1:datum 74:u1:n_sv
 75:u1:wa_corr_info=0 76:u2:reference_id 78:u2:correction_age 80:u4:signal_info=0
 84:u1:alert_flag=0 85:u1:n_bases=0@1 86:u2:ppp_info=0@1
 88:u2:latency@2 90:u2:h_accuracy@2 92:u2:v_accuracy@2 94:u1:misc=0@2"""
_PVT_TAIL_V1 = "56:f8:clock_bias 64:f4:clock_drift"
_PVT_HEAD_V1 = "14:u1:n_sv 15:u1:error=0 16:u1:mode=0 17:u1:system 18:u1:info=0 19:u1:geo_svid"

BLOCKS: dict[int, Block] = {
    block.number: block
    for block in (
        _block(PVT_GEODETIC, "PVTGeodetic", (88, 88, 96), """14:u1:mode=0 15:u1:error=0
            16:f8:lat 24:f8:lon 32:f8:height 40:f4:undulation
            44:f4:vn 48:f4:ve 52:f4:vu 56:f4:course""" + _PVT_TAIL),
        _block(PVT_CARTESIAN, "PVTCartesian", (88, 88, 96), """14:u1:mode=0 15:u1:error=0
            16:f8:x 24:f8:y 32:f8:z 40:f4:undulation
            44:f4:vx 48:f4:vy 52:f4:vz 56:f4:course""" + _PVT_TAIL),
        _block(COV_GEODETIC, "PosCovGeodetic", (56,), """14:u1:mode=0 15:u1:error=0
            16:f4:nn 20:f4:ee 24:f4:uu 28:f4:bb
            32:f4:ne 36:f4:nu 40:f4:nb 44:f4:eu 48:f4:eb 52:f4:ub"""),
        _block(COV_CARTESIAN, "PosCovCartesian", (56,), """14:u1:mode=0 15:u1:error=0
            16:f4:xx 20:f4:yy 24:f4:zz 28:f4:bb
            32:f4:xy 36:f4:xz 40:f4:xb 44:f4:yz 48:f4:yb 52:f4:zb"""),
        _block(DOP, "DOP", (32,), """14:u1:n_sv=0 15:u1:reserved=0
            16:u2:pdop=0 18:u2:tdop=0 20:u2:hdop=0 22:u2:vdop=0 24:f4:hpl 28:f4:vpl"""),
        _block(RAIM_STATISTICS, "RAIMStatistics", (36,), """14:u1:integrity_flag
            16:f4:herl 20:f4:verl 24:f4:h_velocity_erl 28:f4:v_velocity_erl
            32:u2:overall_model 34:u2:reserved=0"""),
        _block(GEO_RAW_L1, "GEORawL1", (52,), """14:u1:svid 15:u1:crc_passed=0 16:u1:viterbi=0
            17:u1:source=0 18:u1:freq_nr=0 19:u1:channel=0 20:(8,)u4:bits=0"""),
        _block(GEO_RAW_L5, "GEORawL5", (52,), """14:u1:svid 15:u1:crc_passed=0 16:u1:viterbi=0
            17:u1:source=0 18:u1:freq_nr=0 19:u1:channel=0 20:(8,)u4:bits=0"""),
        _block(RECEIVER_TIME, "ReceiverTime", (24,), """14:i1:utc_year 15:i1:utc_month
            16:i1:utc_day 17:i1:utc_hour 18:i1:utc_minute 19:i1:utc_second
            20:i1:leap_seconds 21:u1:sync_level=0"""),
        _block(END_OF_PVT, "EndOfPVT", (16,), ""),
        _block(PVT_GEODETIC_V1, "PVTGeodetic v1", (80,), _PVT_HEAD_V1 + """
            20:f8:lat 28:f8:lon 36:f8:height 44:f4:vn 48:f4:ve 52:f4:vu """ + _PVT_TAIL_V1 + """
            68:f4:undulation 72:u2:correction_age 74:u2:reference_id 76:f4:course"""),
        _block(PVT_CARTESIAN_V1, "PVTCartesian v1", (76,), _PVT_HEAD_V1 + """
            20:f8:x 28:f8:y 36:f8:z 44:f4:vx 48:f4:vy 52:f4:vz """ + _PVT_TAIL_V1 + """
            68:u2:correction_age 70:u2:reference_id 72:f4:course"""),
        _block(DOP_V1, "DOP v1", (32,), """14:u1:n_sv=0 15:u1:error=0
            16:u2:pdop=0 18:u2:tdop=0 20:u2:hdop=0 22:u2:vdop=0 24:f4:hpl 28:f4:vpl"""),
        _block(RAIM_STATISTICS_V1, "RAIMStatistics v1", (40,), """14:u1:integrity_flag
            16:f4:herl 20:f4:verl 24:f4:h_velocity_erl 28:f4:v_velocity_erl
            32:u2:position_test 34:u2:velocity_test 38:u1:n=0 39:u1:size=0"""),
        # What follows the heads of these three is in `sbf_sub_blocks`.
        _block(SATELLITE_POSITIONS, "PVTSatCartesian", (16,), "14:u1:n=0 15:u1:size=0"),
        _block(RESIDUALS, "PVTResiduals", (20,), "14:u1:n=0 15:u1:size_1=0 16:u1:size_2=0"),
        _block(GEO_CORRECTIONS, "GEOCorrections", (16,), "14:u1:n=0 15:u1:size=0"),
    )
}  # fmt: skip
"""Every block that the reader understands, by number."""


@lru_cache(maxsize=512)
def layout(number: int, revision: int, length: int) -> np.dtype[Any]:
    """Structured dtype of itemsize `length` with the fields that such a block really has."""
    fields = [
        field
        for field in BLOCKS[number].fields.values()
        if field.since <= revision and field.offset + field.size <= length
    ]
    return np.dtype(
        {
            "names": [field.name for field in fields],
            "formats": [field.dtype for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": length,
        }
    )


def read_fields(
    rows: NDArray[np.uint8], number: int, revision: int, names: Iterable[str]
) -> dict[str, NDArray[Any]]:
    """Raw values of some fields; a field that the revision or the length lacks is missing.

    Parameters
    ----------
    rows : (n, length) bytes, one block of one revision a row.
    number, revision : the kind of block, a key of `BLOCKS`, and its revision.
    names : fields of `BLOCKS[number]`.

    Returns
    -------
    name -> (n,) contiguous raw values, unscaled, missing ones still as the do-not-use value.
    """
    records = rows.view(layout(number, revision, rows.shape[1]))[:, 0]
    known = BLOCKS[number].fields
    present = records.dtype.names or ()
    return {
        name: np.ascontiguousarray(records[name])
        if name in present
        else np.full(len(rows), known[name].missing, dtype=known[name].dtype)
        for name in names
    }


def fill_blocks(
    rows: NDArray[np.uint8], number: int, revision: int, fields: Mapping[str, ArrayLike]
) -> None:
    """Write header and fields of one kind of block into rows, all but the CRC.

    Parameters
    ----------
    rows : (n, length) bytes to write to; the last axis is contiguous.
    fields : name -> (n,) raw values, or one value for all rows; a field that is not named
        gets its do-not-use value, or 0 where it has none.

    Raises
    ------
    InputError : a field that this revision does not have.
    """
    length = rows.shape[1]
    rows[:] = 0
    records = rows.view(layout(number, revision, length))[:, 0]
    names = records.dtype.names or ()
    if unknown := [name for name in fields if name not in names]:
        raise InputError(
            f"block {number} revision {revision} has no field {unknown[0]!r}",
            cure=f"known are {', '.join(names)}",
        )
    known = BLOCKS[number].fields
    header = {"sync": SYNC, "id": number | revision << 13, "length": length}
    for name in names:
        default = header.get(name, known[name].missing)
        if name != "crc" and (name in fields or default):
            records[name] = fields.get(name, default)
