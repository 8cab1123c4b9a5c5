"""Damage to the bytes of a file: cut, lost, changed, put in, written in another encoding."""

from __future__ import annotations

import re

import numpy as np

from tests.corruption.damage import Damaged, Kind, file_of
from tests.corruption.good_logs import GoodLog

Rng = np.random.Generator

LOST = ("E10", "E24")
"""Records that are cut or short, bytes that belong to none."""


def _pieced(log: GoodLog) -> bool:
    return log.form.family != "table"


def _text(log: GoodLog) -> bool:
    return log.form.family == "text"


def _framed(log: GoodLog) -> bool:
    return log.form.family == "framed"


def _binary(log: GoodLog) -> bool:
    return log.form.name in ("sbf", "ubx")


def _has_header(log: GoodLog) -> bool:
    return bool(log.pieces.head) and _pieced(log)


def _between(rng: Rng, low: int, high: int) -> int:
    return int(rng.integers(low, max(high, low + 1)))


def _epoch(log: GoodLog, rng: Rng) -> int:
    """A random epoch that is neither the first nor the last."""
    return _between(rng, 1, len(log.pieces.epochs) - 1)


def _with_epochs(log: GoodLog, epochs: list[bytes]) -> bytes:
    return log.pieces.head + b"".join(epochs) + log.pieces.foot


def _offset(log: GoodLog, epoch: int) -> int:
    return len(log.pieces.head) + sum(map(len, log.pieces.epochs[:epoch]))


def _flipped(data: bytes, places: np.ndarray, masks: np.ndarray) -> bytes:
    changed = np.frombuffer(data, np.uint8).copy()
    changed[places] ^= masks.astype(np.uint8)
    return changed.tobytes()


def _empty(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, b"", "E15", least="error")


def _header_only(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, log.pieces.head.rstrip(b"\n") + b"\n", "E15", least="error")


def _one_epoch(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, _with_epochs(log, [log.pieces.epochs[0]]), "E15", least="error")


def _cut_in_last_record(log: GoodLog, rng: Rng) -> Damaged:
    # A text without its very last line end, and a frame without a byte behind it, are whole.
    last = log.pieces.epochs[-1]
    left = _between(rng, 1, len(last) - 3)
    return file_of(log, log.pieces.data[: len(log.pieces.data) - len(last) + left], *LOST)


def _cut_half_way(log: GoodLog, rng: Rng) -> Damaged:
    if not _pieced(log):
        data = log.pieces.data
        return file_of(log, data[: _between(rng, 100, len(data) - 8)], *LOST, "E16")
    at = _between(rng, len(log.pieces.epochs) // 4, len(log.pieces.epochs) - 1)
    left = _between(rng, 1, len(log.pieces.epochs[at]) - 3)
    return file_of(log, log.pieces.data[: _offset(log, at) + left], *LOST)


def _head_lost(log: GoodLog, rng: Rng) -> Damaged:
    at = _between(rng, 0, 5)
    data = log.pieces.data[_offset(log, at) + _between(rng, 1, len(log.pieces.epochs[at]) - 3) :]
    # Of delimited text the first line is then taken for a header, which names no time.
    return file_of(log, data, *LOST, "E16", "")


def _span_lost(log: GoodLog, rng: Rng) -> Damaged:
    """Bytes lost from within one record to within a later one."""
    first = _epoch(log, rng)
    last = min(first + _between(rng, 1, 30), len(log.pieces.epochs) - 2)
    a = _offset(log, first) + _between(rng, 3, len(log.pieces.epochs[first]) - 3)
    b = _offset(log, last) + _between(rng, 3, len(log.pieces.epochs[last]) - 3)
    data = log.pieces.data
    a, b = min(a, b), max(a, b)
    if _text(log):
        # Without a checksum nobody can tell a line that is whole again from a good one.
        while _fields_at(log, data[:a] + data[b:], a) in _usual_fields(log):
            b += 1
    return file_of(log, data[:a] + data[b:], *LOST, "E04")


def _fields_at(log: GoodLog, data: bytes, place: int) -> int:
    """Fields of the line in which a place lies."""
    line = data[data.rfind(b"\n", 0, place) + 1 : data.find(b"\n", place)]
    mark = _delimiter(log)
    return len(line.split(None if mark == b" " else mark))


def _usual_fields(log: GoodLog) -> set[int]:
    mark = _delimiter(log)
    some = b"".join(log.pieces.epochs[::50]).splitlines()
    return {len(line.split(None if mark == b" " else mark)) for line in some}


def _bits_flipped(log: GoodLog, rng: Rng) -> Damaged:
    data = log.pieces.data
    number = int(rng.choice([1, 3, 20, 300]))
    payload = np.flatnonzero(~np.isin(np.frombuffer(data, np.uint8), (10, 13)))
    if log.form.name == "ubx hex":
        # The receiver's clock in front of the frames is not read; a changed digit of it is none.
        starts = np.flatnonzero(np.frombuffer(b"\n" + data[:-1], np.uint8) == 10)
        payload = payload[payload - starts[np.searchsorted(starts, payload, "right") - 1] >= 18]
    places = rng.choice(payload, number, replace=False)
    return file_of(log, _flipped(data, places, 1 << rng.integers(0, 8, number)), *LOST, "E19")


def _high_bits_set(log: GoodLog, rng: Rng) -> Damaged:
    """The eighth bit set in some bytes of the lines, as a bad serial line does."""
    begin = len(log.pieces.head)
    number = int(rng.choice([1, 5, 40]))
    places = begin + rng.choice(len(log.pieces.data) - begin, number, replace=False)
    # A mode that is no word of the format is refused without a code, with the word shown.
    codes = (*LOST, "E19", "") if log.form.format == "csv" else (*LOST, "E19")
    return file_of(log, _flipped(log.pieces.data, places, np.full(number, 128)), *codes)


def _page_bits_flipped(log: GoodLog, rng: Rng) -> Damaged:
    data = log.pieces.data
    number = int(rng.choice([1, 2, 8]))
    # The footer, from which a reader begins, is the last kilobytes.
    places = 4 + rng.choice(len(data) // 2, number, replace=False)
    return file_of(log, _flipped(data, places, 1 << rng.integers(0, 8, number)), *LOST, "E16")


def _footer_bits_flipped(log: GoodLog, rng: Rng) -> Damaged:
    data = log.pieces.data
    length = int.from_bytes(data[-8:-4], "little")
    places = len(data) - 8 - length + rng.choice(length, 40, replace=False)
    return file_of(log, _flipped(data, places, 1 << rng.integers(0, 8, 40)), *LOST, "E16", "E25")


def _hole_of_zeros(log: GoodLog, rng: Rng) -> Damaged:
    data = log.pieces.data
    length = int(rng.choice([1, 40, 512, 4096]))
    first = len(log.pieces.head) if _pieced(log) else 0
    at = _between(rng, first + 200, len(data) - length - 400)
    while data[at] == 0:  # a zero that becomes one is no damage
        at += 1
    codes = ("E19", *LOST) if _text(log) else (*LOST, "E16")
    return file_of(log, data[:at] + bytes(length) + data[at + length :], *codes)


def _garbage_put_in(log: GoodLog, rng: Rng) -> Damaged:
    """Bytes of something else between two records."""
    at = _offset(log, _epoch(log, rng))
    junk = rng.integers(0, 256, _between(rng, 20, 2000), dtype=np.uint8).tobytes()
    data = log.pieces.data
    return file_of(log, data[:at] + junk + data[at:], *LOST, "E19", "E18")


def _message_put_in(log: GoodLog, rng: Rng) -> Damaged:
    """A line that some program wrote into the log."""
    at = _offset(log, _epoch(log, rng))
    text = str(
        rng.choice(["ERROR: disk full", "*** restart, port 2 ***", "Segmentation fault (1)"])
    )
    data = log.pieces.data
    separator = "\n" if log.form.name == "ginan" else ""
    return file_of(log, data[:at] + f"{separator}{text}\n".encode() + data[at:], *LOST)


def _checksum_wrong(log: GoodLog, rng: Rng) -> Damaged:
    epochs = list(log.pieces.epochs)
    for i in rng.choice(np.arange(1, len(epochs) - 1), int(rng.choice([1, 30])), replace=False):
        text = log.form.name in ("nmea", "ubx hex")
        # The checksum of the last frame: its digits in text, its bytes in binary, CRC in SBF.
        end = epochs[i].rstrip(b"\r\n")
        place = len(end) - 1
        if log.form.name == "sbf":
            place = epochs[i].rindex(b"$@") + 2
        changed = b"0" if end[place : place + 1] != b"0" else b"1"
        if not text:
            changed = bytes([end[place] ^ 0x55])
        epochs[i] = epochs[i][:place] + changed + epochs[i][place + 1 :]
    return file_of(log, _with_epochs(log, epochs), *LOST)


def _length_wrong(log: GoodLog, rng: Rng) -> Damaged:
    """The length of a frame damaged, to more or less than there is."""
    epochs = list(log.pieces.epochs)
    i = _epoch(log, rng)
    place = 6 if log.form.name == "sbf" else 4
    length = int.from_bytes(rng.bytes(2), "little")
    epochs[i] = epochs[i][:place] + length.to_bytes(2, "little") + epochs[i][place + 2 :]
    return file_of(log, _with_epochs(log, epochs), *LOST)


def _field_too_many(log: GoodLog, rng: Rng) -> Damaged:
    return _with_fields(log, rng, more=True)


def _field_too_few(log: GoodLog, rng: Rng) -> Damaged:
    return _with_fields(log, rng, more=False)


def _delimiter(log: GoodLog) -> bytes:
    return {"csv comma": b",", "csv utc": b",", "csv semicolon": b";", "pegasus": b";",
            "csv tab": b"\t"}.get(log.form.name, b" ")  # fmt: skip


def _with_fields(log: GoodLog, rng: Rng, *, more: bool) -> Damaged:
    epochs = list(log.pieces.epochs)
    mark = _delimiter(log)
    for i in rng.choice(np.arange(1, len(epochs) - 1), int(rng.choice([1, 40])), replace=False):
        fields = epochs[i].split(mark)
        # Blanks stand in groups, so a field is taken out only where there is one.
        filled = [k for k, f in enumerate(fields) if f.strip() and k > 2][:-1]
        k = int(rng.choice(filled))
        fields[k : k + 1] = [fields[k], b"7.5"] if more else []
        epochs[i] = mark.join(fields)
    return file_of(log, _with_epochs(log, epochs), *LOST)


def _numbers_overwritten(log: GoodLog, rng: Rng) -> Damaged:
    """A spreadsheet's `#####` or an error word in the place of a number."""
    epochs = list(log.pieces.epochs)
    word = str(rng.choice(["#####", "#DIV/0!", "1.2.3", "12O.5", "0x1F", "--"])).encode()
    mark = _delimiter(log)
    for i in rng.choice(np.arange(1, len(epochs) - 1), int(rng.choice([1, 40])), replace=False):
        fields = epochs[i].split(mark)
        # The longitude, which every reader needs.
        k = next(k for k, f in enumerate(fields) if re.match(rb"\s*15[.,]\d", f))
        fields[k] = word
        epochs[i] = mark.join(fields)
    return file_of(log, _with_epochs(log, epochs), *LOST)


def _line_ends_lost(log: GoodLog, rng: Rng) -> Damaged:
    head, blank = log.pieces.head, b" " if log.form.name != "ginan" else b""
    body = b"".join(log.pieces.epochs).replace(b"\r\n", blank).replace(b"\n", blank)
    return file_of(log, head + body, "E18", *LOST, "E16", least="error")


def _utf_16(log: GoodLog, rng: Rng) -> Damaged:
    text = log.pieces.data.decode()
    encoded = text.encode("utf-16" if rng.integers(2) else "utf-16-be")
    if not encoded.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoded = b"\xfe\xff" + encoded
    return file_of(log, encoded, "E19", least="info")


def _byte_order_mark(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, b"\xef\xbb\xbf" + log.pieces.data, "E19", least="info")


def _latin_1(log: GoodLog, rng: Rng) -> Damaged:
    mark = {"rtklib_pos": "%", "csv": "#", "glab_output": "INFO"}[log.form.format]
    note = f"{mark} Zürich, Höhe geprüft\n".encode("latin-1")
    return file_of(log, note + log.pieces.data, "E19")


def _old_mac(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, log.pieces.data.replace(b"\n", b"\r"), "E19", least="info")


def _half_utf_16(log: GoodLog, rng: Rng) -> Damaged:
    """The second half appended by a program with another encoding."""
    at = len(log.pieces.epochs) // 2
    head, tail = list(log.pieces.epochs[:at]), b"".join(log.pieces.epochs[at:])
    data = log.pieces.head + b"".join(head) + tail.decode().encode("utf-16-le")
    return file_of(log, data, "E19", *LOST)


BYTE_DAMAGES = (
    Kind("empty", _empty),
    Kind("header only", _header_only, _has_header),
    Kind("one epoch", _one_epoch, _pieced),
    Kind("cut in the last record", _cut_in_last_record, _pieced, 2),
    Kind("cut half way", _cut_half_way, times=2),
    Kind("beginning lost", _head_lost, _pieced, 2),
    Kind("span of bytes lost", _span_lost, _pieced, 3),
    Kind("bits flipped in frames", _bits_flipped, _framed, 4),
    Kind("eighth bit set", _high_bits_set, _text, 2),
    Kind("bits flipped in pages", _page_bits_flipped, lambda log: log.form.name == "parquet", 4),
    Kind("bits flipped in the footer", _footer_bits_flipped,
         lambda log: log.form.family == "table", 4),
    Kind("hole of zeros", _hole_of_zeros, lambda log: log.form.name != "parquet foreign", 2),
    Kind("foreign bytes put in", _garbage_put_in, _pieced, 2),
    Kind("a message put in", _message_put_in, _pieced),
    Kind("checksum wrong", _checksum_wrong, _framed, 2),
    Kind("length of a frame wrong", _length_wrong, _binary, 3),
    Kind("a field too many", _field_too_many, _text),
    Kind("a field too few", _field_too_few, _text),
    Kind("number overwritten by a word", _numbers_overwritten, _text, 2),
    Kind("line ends lost", _line_ends_lost, _text),
    Kind("UTF-16", _utf_16, _text, 2),
    Kind("byte order mark", _byte_order_mark, _text),
    Kind("Latin-1", _latin_1, lambda log: log.form.format in ("rtklib_pos", "csv", "glab_output")),
    Kind("line ends of old Macs", _old_mac, _text),
    Kind("second half in UTF-16", _half_utf_16, _text),
)  # fmt: skip
