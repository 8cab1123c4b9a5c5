"""Files that are no log at all, or only look like one; levels that must not be joined."""

from __future__ import annotations

import io
import json

import numpy as np
import pyarrow.parquet as pq

from tests.corruption.binary_forms import ubx_epochs
from tests.corruption.damage import Damaged, Kind, file_of
from tests.corruption.good_logs import FORMS, GoodLog
from tests.input_check.journeys import moved

Rng = np.random.Generator

_WORDS = ["signal", "track", "train", "level", "error", "median", "antenna", "hour", "noise", "sky"]


def _noise_bytes(rng: Rng) -> bytes:
    return rng.bytes(int(rng.integers(100, 60_000)))


def _foreign(log: GoodLog, data: bytes, rng: Rng, *codes: str) -> Damaged:
    extension = str(rng.choice(sorted({form.extension for form in FORMS})))
    return file_of(log, data, "E16", *codes, least="error", name=f"roof{extension}")


def _noise(log: GoodLog, rng: Rng) -> Damaged:
    return _foreign(log, _noise_bytes(rng), rng)


_BEGINNINGS = (
    b"$@", b"\xb5\x62", b"PAR1", b"$GPGGA,", b"\x1f\x8b\x08", b"BZh9", b"\xfd7zXZ\x00",
    b"PK\x03\x04", b"\x1f\x9d\x90", b"\xaa\x44\x12", b"\xd3\x00\x13",
)  # fmt: skip


def _magic_before_noise(log: GoodLog, rng: Rng) -> Damaged:
    begin = _BEGINNINGS[int(rng.integers(len(_BEGINNINGS)))]
    return _foreign(log, begin + _noise_bytes(rng), rng, "E10", "E18", "E24", "E15")


def _magic_lost(log: GoodLog, rng: Rng) -> Damaged:
    """The marks by which the format is known are gone everywhere."""
    data = log.pieces.data
    for old, new in ((b"$@", b"#A"), (b"\xb5\x62", b"\xb6\x61"), (b"PAR1", b"RAP1"),
                     (b"$G", b"#G"), (b"b562", b"b661")):  # fmt: skip
        data = data.replace(old, new)
    return file_of(log, data, "E10", "E16", "E24", least="error")


def _prose(log: GoodLog, rng: Rng) -> Damaged:
    lines = [" ".join(rng.choice(_WORDS, int(rng.integers(3, 12)))) for _ in range(200)]
    return _foreign(log, "\n".join(lines).encode() + b"\n", rng)


def _other_document(log: GoodLog, rng: Rng) -> Damaged:
    rows = [{"t": i, "x": float(rng.normal())} for i in range(300)]
    documents = (
        b"%PDF-1.7\n" + _noise_bytes(rng),
        b"\x89PNG\r\n\x1a\n" + _noise_bytes(rng),
        b"<!DOCTYPE html>\n<html><body>404 Not Found</body></html>\n",
        json.dumps(rows).encode(),
        b"<?xml version='1.0'?>\n<gpx>" + b"<trkpt lat='50.03' lon='15.77'/>\n" * 300 + b"</gpx>\n",
        b"\x28\xb5\x2f\xfd" + _noise_bytes(rng),
        b"7z\xbc\xaf\x27\x1c" + _noise_bytes(rng),
        b"Rar!\x1a\x07\x01\x00" + _noise_bytes(rng),
        b"SQLite format 3\x00" + _noise_bytes(rng),
        b"     3.03           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n" * 3,
    )
    return _foreign(log, documents[int(rng.integers(len(documents)))], rng)


def _table_of_something_else(log: GoodLog, rng: Rng) -> Damaged:
    """A table with a header, but neither time nor position."""
    values = rng.normal(size=(200, 3))
    lines = ["temperature,pressure,humidity", *(",".join(f"{v:.3f}" for v in r) for r in values)]
    return file_of(log, "\n".join(lines).encode() + b"\n", "", "E16", least="error")


def _header_words_changed(log: GoodLog, rng: Rng) -> Damaged:
    """A header in another language: no column can be told."""
    head = log.pieces.head
    for old, new in ((b"GPST", b"Zeit"), (b"time", b"Zeit"), (b"utc", b"Zeit"), (b"week", b"Woche"),
                     (b"RX_TOM", b"Zeit"), (b"OUTPUT", b"AUS"), (b"HPL", b"Schutz"),
                     (b"lat", b"breite")):  # fmt: skip
        head = head.replace(old, new)
    data = head + b"".join(log.pieces.epochs)
    return file_of(log, data, "", "E16", "E10", least="error")


def _two_headers_alike(log: GoodLog, rng: Rng) -> Damaged:
    """Two columns of one meaning: which of them is the level?"""
    head, mark = log.pieces.head, b"vpl" if b"vpl" in log.pieces.head else b"VPL"
    data = head.replace(mark, b"hpl" if mark == b"vpl" else b"HPL") + b"".join(log.pieces.epochs)
    return file_of(log, data, "", "E16", least="error")


def _metadata_unreadable(log: GoodLog, rng: Rng) -> Damaged:
    table = pq.read_table(io.BytesIO(log.pieces.data))
    old = table.schema.metadata
    changed = {
        0: {**old, b"sbas": old[b"sbas"][: len(old[b"sbas"]) // 2]},
        1: {**old, b"sbas": b"[1, 2, 3]"},
        2: {k: v for k, v in old.items() if k != b"sbas"},
        3: {**old, b"sbas_layout": b"{}"},
    }[int(rng.integers(4))]
    out = io.BytesIO()
    pq.write_table(table.replace_schema_metadata(changed), out)
    return file_of(log, out.getvalue(), "E25", "", least="warning", keeps=False)


def _rows_taken_out(log: GoodLog, rng: Rng) -> Damaged:
    """Another program kept the metadata of a Parquet recording but not all its rows."""
    table = pq.read_table(io.BytesIO(log.pieces.data))
    out = io.BytesIO()
    pq.write_table(table.slice(0, len(table) - int(rng.integers(1, 600))), out)
    return file_of(log, out.getvalue(), "E25")


_OTHER_RISK = (1, -5)


def _ubx_file(log: GoodLog, epochs: list[bytes]) -> bytes:
    if log.form.name == "ubx":
        return b"".join(epochs)
    return b"".join(f"00:00:43.463562,U,{epoch.hex()}\n".encode() for epoch in epochs)


def _risk_changed_inside(log: GoodLog, rng: Rng) -> Damaged:
    at = int(rng.integers(400, 800))
    strict = list(ubx_epochs(log.recording, _OTHER_RISK))
    usual = list(ubx_epochs(log.recording))
    epochs = [b"".join(messages) for messages in [*usual[:at], *strict[at:]]]
    return file_of(log, _ubx_file(log, epochs), "E06", "E23", keeps=False)


def _files_of_two_risks(log: GoodLog, rng: Rng) -> Damaged:
    later = moved(log.recording, 7200)
    second = [b"".join(messages) for messages in ubx_epochs(later, _OTHER_RISK)]
    files = (
        (f"part1{log.form.extension}", log.pieces.data),
        (f"part2{log.form.extension}", _ubx_file(log, second)),
    )
    return Damaged(files, frozenset({"E06", "E23"}), "error", keeps=False)


def _some(log: GoodLog) -> bool:
    return not log.moving and log.form.name in ("csv comma", "sbf")


def _with_levels_of_its_own_risk(log: GoodLog) -> bool:
    return log.form.name in ("ubx", "ubx hex")


FOREIGN_DAMAGES = (
    Kind("noise", _noise, _some, 8),
    Kind("the first bytes of a format before noise", _magic_before_noise, _some, 16),
    Kind("marks of the format lost", _magic_lost,
         lambda log: log.form.family == "framed" or log.form.format == "parquet"),
    Kind("prose", _prose, _some, 3),
    Kind("a document of another kind", _other_document, _some, 12),
    Kind("a table of something else", _table_of_something_else, _some, 2),
    Kind("header in another language", _header_words_changed,
         lambda log: log.form.format in ("rtklib_pos", "csv", "pegasus_csv")),
    Kind("two columns of one name", _two_headers_alike,
         lambda log: log.form.format in ("csv", "pegasus_csv")
         or log.form.name in ("pos", "pos week")),
    Kind("metadata of Parquet unreadable", _metadata_unreadable,
         lambda log: log.form.name == "parquet", 4),
    Kind("rows of Parquet taken out", _rows_taken_out,
         lambda log: log.form.name == "parquet", 2),
    Kind("risk of the levels changed inside", _risk_changed_inside, _with_levels_of_its_own_risk),
    Kind("files of two risks", _files_of_two_risks, _with_levels_of_its_own_risk),
)  # fmt: skip
