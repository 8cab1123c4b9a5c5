"""Compressed files as plain ones: gzip, bzip2, xz, zip and Unix compress (`.Z`).

Formats see a plain file, which they may seek in; it is temporary and lives as long as it is
needed. A few bytes can hold gigabytes, so that the limit is checked while the bytes come out.
What is cut or damaged is refused: the part before the damage would look like a whole recording.
"""

from __future__ import annotations

import bz2
import lzma
import os
import re
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO, NoReturn, Protocol

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.temporary_file import TemporaryFile

MOST_BYTES = 8 << 30
MOST_TIMES = 200
FREE_BYTES = 64 << 20
"""Without `max_output`: at most 8 GiB, and above 64 MiB at most 200 times the file."""

HEAD_BYTES = 512
_IN_BYTES, _OUT_BYTES = 1 << 18, 4 << 20
_DEFLATE_TIMES = 1032  # no deflate stream becomes more (zlib, Technical Details)
_XZ_MEMORY = 256 << 20  # xz -9 needs 65 MiB
_MAGIC = (
    # Three bytes at least, so that binary logs do not begin so by chance.
    (re.compile(rb"\x1f\x8b\x08"), "gzip"),
    (re.compile(rb"BZh[1-9](1AY&SY|\x17\x72\x45\x38\x50\x90)"), "bzip2"),
    (re.compile(rb"\xfd7zXZ\x00"), "xz"),
    (re.compile(rb"PK(\x03\x04|\x05\x06)"), "zip"),
    # Third byte: block mode in the highest bit, 9 to 16 bits a code in the lowest five.
    (re.compile(rb"\x1f\x9d[\x09-\x10\x89-\x90]"), "compress"),
)
_FURTHER = (
    (re.compile(rb"\x28\xb5\x2f\xfd"), "zstd", "zstd -d FILE"),
    (re.compile(rb"7z\xbc\xaf\x27\x1c"), "7-Zip", "7z x FILE"),
    (re.compile(rb"Rar!\x1a\x07"), "RAR", "unrar x FILE"),
    (re.compile(rb".{257}ustar", re.DOTALL), "tar", "tar -xf FILE"),
)
_SUFFIXES = (".gz", ".gzip", ".bz2", ".xz", ".zip", ".z")
_BY_HAND = {
    "gzip": "gzip -dc {0} > {1}",
    "bzip2": "bzip2recover {0}",
    "xz": "xz -dc {0} > {1}",
    "zip": "unzip {0}",
    "compress": "uncompress -c {0} > {1}",
}
_ZIP_ERRORS = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, EOFError, NotImplementedError,
    RuntimeError, ValueError,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class PlainFile:
    """A file as formats see it.

    Parameters
    ----------
    path : the plain file, temporary where the given one is compressed.
    given : the file as it was named.
    name : name without the extension of the packing: its extension is a hint at the format.
    packing : gzip, bzip2, xz, zip, compress; "" for none.
    findings : what cannot be told of a packing.
    """

    path: Path
    given: Path
    name: str
    packing: str = ""
    findings: tuple[Finding, ...] = ()
    held: TemporaryFile | None = None

    @property
    def extension(self) -> str:
        return PurePosixPath(self.name).suffix.lower()

    def renamed(self, text: str) -> str:
        """A text that may name the temporary file, naming the given one instead."""
        return text if self.held is None else text.replace(str(self.path), str(self.given))


def packing_of(head: bytes) -> str:
    """Name of the packing that the first bytes show; "" for none that is unpacked here."""
    return next((name for magic, name in _MAGIC if magic.match(head)), "")


def packing_not_read(head: bytes) -> tuple[str, str]:
    """Name of a packing that is known but not unpacked here, and the command; "" for none."""
    return next(((name, how) for magic, name, how in _FURTHER if magic.match(head)), ("", ""))


def output_limit(file_bytes: int, max_output: int | None = None) -> int:
    """Bytes that a file of `file_bytes` may become."""
    if max_output is None:
        return min(MOST_BYTES, max(MOST_TIMES * file_bytes, FREE_BYTES))
    if max_output <= 0:
        raise InputError(
            f"max_output cannot be {max_output}", where="max_output", cure="give bytes above 0"
        )
    return max_output


def plain_file(path: Path, *, max_output: int | None = None) -> PlainFile:
    """The file itself, or a temporary file with what is packed in it.

    Parameters
    ----------
    path : an existing file.
    max_output : bytes that may come out; by default 8 GiB, and above 64 MiB 200 times the file.

    Raises
    ------
    InputError : E21 for more than that, for packing within packing and for an archive of several
        files; E10 for a stream that is cut or damaged; E15 where nothing comes out; an archive
        that is encrypted.
    """
    limit = output_limit(path.stat().st_size, max_output)
    with open(path, "rb") as file:
        packing = packing_of(file.read(HEAD_BYTES))
        if not packing:
            return PlainFile(path, path, path.name)
        file.seek(0)
        name = path.name[: -len(path.suffix)] if path.suffix.lower() in _SUFFIXES else path.name
        held = TemporaryFile()
        sink = _Sink(path, packing, limit)
        try:
            with open(held.path, "wb") as out:
                sink.out = out
                if packing == "zip":
                    name = _unzip(file, sink)
                elif packing == "compress":
                    _uncompress(file, sink)
                else:
                    _decode(file, sink, _DECODERS[packing])
        except OSError as error:
            sink.refuse_room(error)
    if not sink.written:
        raise InputError(
            f"the {packing} file holds nothing",
            code="E15",
            where=str(path),
            cure="check that the recording was written before it was packed",
        )
    with open(held.path, "rb") as file:
        head = file.read(HEAD_BYTES)
    if inner := packing_of(head) or packing_not_read(head)[0]:
        raise InputError(
            f"{inner} within {packing}: packing within packing is not undone",
            code="E21",
            where=str(path),
            evidence=f"first bytes of what is inside: {head[:8].hex(' ')}",
            cure="unpack it yourself and give the files or their folder",
        )
    return PlainFile(held.path, path, name, packing, _findings(packing, path), held)


def _findings(packing: str, path: Path) -> tuple[Finding, ...]:
    if packing != "compress":
        return ()
    return (
        Finding(
            "E10",
            "warning",
            "a .Z file has neither length nor checksum: one that was cut or damaged looks whole",
            where=str(path),
            cure="compare the last epoch with when the recording ended; pack with gzip instead",
        ),
    )


class _Sink:
    """Where decompressed bytes go, counted; E21 once there are too many."""

    def __init__(self, path: Path, packing: str, limit: int) -> None:
        self.path, self.packing, self.limit = path, packing, limit
        self.written = 0
        self.out: BinaryIO

    def write(self, data: bytes) -> int:
        self.written += len(data)
        if self.written > self.limit:
            self.refuse_size(self.written)
        try:
            return self.out.write(data)
        except OSError as error:  # told apart here from errors of what is packed
            self.refuse_room(error)

    def refuse_room(self, error: OSError) -> NoReturn:
        raise InputError(
            "the file cannot be decompressed",
            where=str(self.path),
            evidence=f"{self.written:,} bytes written to {tempfile.gettempdir()}: {error}",
            cure="make room there, or name another folder in the variable TMPDIR",
        ) from error

    def refuse_size(self, size: int) -> NoReturn:
        file_bytes = self.path.stat().st_size
        raise InputError(
            "what is packed in the file is out of proportion to it",
            code="E21",
            where=str(self.path),
            evidence=f"{size:,} bytes or more from {file_bytes:,}; the bound is {self.limit:,} "
            f"({MOST_BYTES >> 30} GiB, and {MOST_TIMES} times the file above "
            f"{FREE_BYTES >> 20} MiB, unless stated)",
            cure=_limit_cure(self.path, self.packing, size),
        )

    def refuse_damage(self, position: int, reason: str) -> NoReturn:
        size = self.path.stat().st_size
        by_hand = _BY_HAND[self.packing].format(self.path.name, self.path.stem)
        raise InputError(
            f"the {self.packing} file is cut or damaged",
            code="E10",
            where=f"{self.path}, near byte {position:,} of {size:,}",
            evidence=f"{reason}; {self.written:,} bytes came out before",
            cure="copy the file again; or save what is sound before the damage, and give that: "
            + by_hand,
        )


def _limit_cure(path: Path, packing: str, least: int) -> str:
    """`--max-output` with what will do where that is known, of a file of `least` bytes or more."""
    size, file_bytes = 0, path.stat().st_size
    if packing == "zip":
        size = least  # as the archive's directory states it
    elif packing == "gzip":
        with open(path, "rb") as file:
            file.seek(-4, os.SEEK_END)
            size = int.from_bytes(file.read(4), "little")
        # The trailer is of the last member, and modulo 4 GiB.
        size += (1 << 32) * max(-(-(least - size) // (1 << 32)), 0)
        size = min(size, _DEFLATE_TIMES * file_bytes)
    elif packing == "xz":
        size = _xz_size(path)
    if size >= least:
        return f"--max-output {size} where you trust the file"
    return (
        f"--max-output {4 * least} where you trust the file; its size is not known before it is "
        "unpacked: raise that until it is read"
    )


def _xz_size(path: Path) -> int:
    """Bytes that the index of an xz file of one stream states; 0 where it cannot be read.

    Source: The .xz File Format 1.2.1, sections 1.2, 2.1.2 and 4.
    """
    with open(path, "rb") as file:
        file.seek(0, os.SEEK_END)
        end = file.tell()
        file.seek(max(end - 12, 0))
        footer = file.read(12)
        index_bytes = 4 * (int.from_bytes(footer[4:8], "little") + 1)
        if footer[10:] != b"YZ" or index_bytes + 24 > end or index_bytes > FREE_BYTES:
            return 0
        file.seek(end - 12 - index_bytes)
        index = file.read(index_bytes)
    numbers = _varints(index[1:-4])
    try:
        blocks = [(next(numbers), next(numbers)) for _ in range(next(numbers))]
    except StopIteration:
        return 0
    return sum(size for _, size in blocks) if index[0] == 0 else 0


def _varints(data: bytes) -> Iterator[int]:
    value = shift = 0
    for byte in data:
        value |= (byte & 0x7F) << shift
        shift += 7
        if not byte & 0x80:
            yield value
            value = shift = 0


class _Decoder(Protocol):
    """What bz2 and lzma have, and `_Inflater` gives to zlib."""

    def decompress(self, data: bytes, max_length: int) -> bytes: ...
    @property
    def eof(self) -> bool: ...
    @property
    def needs_input(self) -> bool: ...
    @property
    def unused_data(self) -> bytes: ...


class _Inflater:
    """A gzip member, with the methods of bz2's and lzma's decoders."""

    def __init__(self) -> None:
        self._decoder = zlib.decompressobj(wbits=31)

    def decompress(self, data: bytes, max_length: int) -> bytes:
        return self._decoder.decompress(self._decoder.unconsumed_tail + data, max_length)

    @property
    def eof(self) -> bool:
        return self._decoder.eof

    @property
    def needs_input(self) -> bool:
        return not self._decoder.unconsumed_tail

    @property
    def unused_data(self) -> bytes:
        return self._decoder.unused_data


_DECODERS: dict[str, Callable[[], _Decoder]] = {
    "gzip": _Inflater,
    "bzip2": bz2.BZ2Decompressor,
    "xz": lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_XZ_MEMORY),
}


def _decode(file: BinaryIO, sink: _Sink, start: Callable[[], _Decoder]) -> None:
    """All members of a stream one after the other; zeros behind a member are padding."""
    decoder: _Decoder | None = None
    while data := file.read(_IN_BYTES):
        while True:
            if decoder is None:
                if not (data := data.lstrip(b"\0")):
                    break
                decoder = start()
            try:
                piece = decoder.decompress(data, _OUT_BYTES)
            except (zlib.error, lzma.LZMAError, OSError, EOFError, ValueError) as error:
                sink.refuse_damage(file.tell(), str(error))
            data = b""
            sink.write(piece)
            if decoder.eof:
                data, decoder = decoder.unused_data, None
            elif decoder.needs_input and len(piece) < _OUT_BYTES:
                break
    if decoder is not None:
        sink.refuse_damage(file.tell(), "the stream ends before its end mark")


def _unzip(file: BinaryIO, sink: _Sink) -> str:
    """The only file in a zip archive, and its name, which is nothing but a hint at the format."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            if len(members) > 1:
                _refuse_members([member.filename for member in members], sink)
            if not members:
                return ""
            (member,) = members
            if member.flag_bits & 1:
                _refuse_encrypted(sink)
            if member.file_size > sink.limit:
                sink.refuse_size(member.file_size)
            # Of bzip2 and LZMA in a zip, all that so many bytes become comes at once.
            plain = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
            size = _IN_BYTES if plain else 1 << 12
            with archive.open(member) as stream:
                while piece := stream.read(size):
                    sink.write(piece)
            return PurePosixPath(member.filename).name
    except InputError:
        raise
    except _ZIP_ERRORS as error:
        sink.refuse_damage(file.tell(), str(error) or type(error).__name__)


def _refuse_members(names: list[str], sink: _Sink) -> NoReturn:
    raise InputError(
        f"the zip archive holds {len(names):,} files",
        code="E21",
        where=str(sink.path),
        evidence=", ".join(map(ascii, names[:5]))[:300],
        cure="unpack it and give the files or their folder",
    )


def _refuse_encrypted(sink: _Sink) -> NoReturn:
    raise InputError(
        "the zip archive is encrypted", where=str(sink.path), cure="unpack it with its password"
    )


def _uncompress(file: BinaryIO, sink: _Sink) -> None:
    from ncompress import decompress  # here, since .Z is rare

    stream: Any = sink
    try:
        # The limit's InputError passes through the decoder, which calls `write` every 512 bytes.
        decompress(file, stream)
    except InputError:
        raise
    except ValueError as error:
        sink.refuse_damage(file.tell(), str(error))
