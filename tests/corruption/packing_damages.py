"""Damage to what is packed, archives that are no single log, and streams that never end."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import tarfile
import zipfile
from collections.abc import Callable

import numpy as np

from tests.corruption.damage import Damaged, Kind, Make, file_of
from tests.corruption.good_logs import GoodLog

Rng = np.random.Generator

_FORMS = ("sbf", "ubx", "nmea", "pos", "glab", "pegasus", "csv comma", "parquet")
_STAMP = (2025, 6, 1, 0, 0, 0)


def _packed_alone(log: GoodLog) -> bool:
    return not log.moving and log.form.name in _FORMS


def _zip(*members: tuple[str, bytes], stored: bool = False) -> bytes:
    out = io.BytesIO()
    how = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(out, "w", how) as archive:
        for name, data in members:
            archive.writestr(zipfile.ZipInfo(name, _STAMP), data, compress_type=how)
    return out.getvalue()


def _zip_of_one(data: bytes) -> bytes:
    return _zip(("roof.csv", data))


def _compressed(data: bytes) -> bytes:
    from ncompress import compress  # a module that held it would leak it at exit, and be told so

    packed: bytes = compress(data)
    return packed


PACKINGS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": lambda data: gzip.compress(data, mtime=0),
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
    ".zip": _zip_of_one,
    ".Z": _compressed,
}
"""How each extension is made."""


def packed_file(log: GoodLog, packing: str, data: bytes) -> tuple[str, bytes]:
    """Name and bytes of a log, packed."""
    if packing == ".zip":
        return f"roof{log.form.extension}.zip", _zip((f"roof{log.form.extension}", data))
    return f"roof{log.form.extension}{packing}", PACKINGS[packing](data)


def _changed(
    packing: str, change: Callable[[bytes, Rng], bytes], *codes: str, least: str = "error"
) -> Make:
    def make(log: GoodLog, rng: Rng) -> Damaged:
        name, data = packed_file(log, packing, log.pieces.data)
        severity = "warning" if packing == ".Z" else least
        # .Z has no checksum: what comes out may differ, and a warning says so of every such file.
        return file_of(
            log, change(data, rng), *codes, name=name, least=severity, keeps=packing != ".Z"
        )

    return make


def _cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(len(data) // 10, len(data) - 4))]


def _cut_at_the_end(data: bytes, rng: Rng) -> bytes:
    return data[: -int(rng.integers(1, 9))]


def _bits_flipped(data: bytes, rng: Rng) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(len(data) // 10, 9 * len(data) // 10, 5):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _rubbish_behind(data: bytes, rng: Rng) -> bytes:
    return data + rng.bytes(300)


def _hole(data: bytes, rng: Rng) -> bytes:
    at = int(rng.integers(len(data) // 4, len(data) // 2))
    return data[:at] + bytes(64) + data[at + 64 :]


def _wrong_checksum(log: GoodLog, rng: Rng) -> Damaged:
    name, data = packed_file(log, ".gz", log.pieces.data)
    changed = bytearray(data)
    changed[-8 + int(rng.integers(8))] ^= 0x41
    return file_of(log, bytes(changed), "E10", name=name, least="error")


def _second_member_cut(log: GoodLog, rng: Rng) -> Damaged:
    packing = str(rng.choice([".gz", ".bz2", ".xz"]))
    pieces = log.pieces
    half = len(pieces.data) // 2
    first, second = (PACKINGS[packing](part) for part in (pieces.data[:half], pieces.data[half:]))
    data = first + second[: int(rng.integers(1, len(second) - 1))]
    return file_of(log, data, "E10", name=f"roof{log.form.extension}{packing}", least="error")


def _cut_before_packing(log: GoodLog, rng: Rng) -> Damaged:
    """The log was cut, and the packing of what was left is sound."""
    if log.form.family == "table":
        inner = log.pieces.data[: len(log.pieces.data) // 2]
    else:
        inner = log.pieces.data[: -len(log.pieces.epochs[-1]) // 2]
    name, data = packed_file(log, str(rng.choice([".gz", ".bz2", ".xz", ".zip"])), inner)
    return file_of(log, data, "E10", "E24", "E16", name=name)


def _packed_twice(log: GoodLog, rng: Rng) -> Damaged:
    outer, inner = (str(p) for p in rng.choice([*PACKINGS], 2))
    data = PACKINGS[outer](PACKINGS[inner](log.pieces.data))
    name = f"roof{log.form.extension}{inner}{outer}"
    return file_of(log, data, "E21", name=name, least="error")


def _archive_of_several(log: GoodLog, rng: Rng) -> Damaged:
    members = [(f"part{k}{log.form.extension}", log.pieces.data) for k in (1, 2)]
    if rng.integers(2):
        members.append(("README.txt", b"Two parts of a day\n"))
    return file_of(log, _zip(*members), "E21", name="roof.zip", least="error")


def _tar(log: GoodLog, rng: Rng) -> Damaged:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz" if rng.integers(2) else "w") as archive:
        entry = tarfile.TarInfo(f"roof{log.form.extension}")
        entry.size = len(log.pieces.data)
        archive.addfile(entry, io.BytesIO(log.pieces.data))
    return file_of(log, out.getvalue(), "E16", "E21", name="roof.tar.gz", least="error")


def _nothing_inside(log: GoodLog, rng: Rng) -> Damaged:
    packing = str(rng.choice([*PACKINGS]))
    name, data = packed_file(log, packing, b"")
    return file_of(log, data, "E15", name=name, least="error")


def _size_belied(log: GoodLog, rng: Rng) -> Damaged:
    """A zip archive whose directory states another size than comes out."""
    data = bytearray(_zip((f"roof{log.form.extension}", log.pieces.data)))
    for mark, place in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        at = data.rindex(mark) + place
        data[at : at + 4] = (len(log.pieces.data) // 3).to_bytes(4, "little")
    return file_of(log, bytes(data), "E10", "E21", name="roof.zip", least="error")


def _bomb(log: GoodLog, rng: Rng) -> Damaged:
    """A hundred megabytes of one byte behind the head of a log: far above what a log becomes."""
    packing = str(rng.choice([".gz", ".bz2", ".xz", ".zip"]))
    if packing == ".zip":
        data = _zip(("roof.csv", log.pieces.data + b"0" * (100 << 20)))
    else:
        # Members one after the other are as good as one.
        data = PACKINGS[packing](log.pieces.data) + PACKINGS[packing](b"0" * (10 << 20)) * 10
    return file_of(log, data, "E21", name=f"roof{log.form.extension}{packing}", least="error")


def _packings(name: str, change: Callable[[bytes, Rng], bytes], *codes: str) -> tuple[Kind, ...]:
    return tuple(
        Kind(f"{packing} {name}", _changed(packing, change, *codes), _packed_alone)
        for packing in PACKINGS
    )


PACKING_DAMAGES = (
    *_packings("cut", _cut, "E10"),
    *_packings("cut in its last bytes", _cut_at_the_end, "E10"),
    *_packings("with flipped bits", _bits_flipped, "E10"),
    *_packings("with a hole", _hole, "E10"),
    *(Kind(f"{p} with rubbish behind", _changed(p, _rubbish_behind, "E10"), _packed_alone)
      for p in (".gz", ".bz2", ".xz")),
    Kind(".gz with a wrong checksum", _wrong_checksum, _packed_alone, 2),
    Kind("second packed member cut", _second_member_cut, _packed_alone),
    Kind("cut before it was packed", _cut_before_packing, _packed_alone),
    Kind("packed twice", _packed_twice, _packed_alone),
    Kind("archive of several files", _archive_of_several, _packed_alone),
    Kind("tar", _tar, _packed_alone),
    Kind("nothing in the packing", _nothing_inside, _packed_alone),
    Kind("size in a zip belied", _size_belied, _packed_alone),
    Kind("a bomb", _bomb, lambda log: not log.moving and log.form.name in ("csv comma", "sbf")),
)  # fmt: skip
