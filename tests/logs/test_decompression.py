"""Compressed files: every packing, limits, damage, archives."""

from __future__ import annotations

import bz2
import contextlib
import gc
import gzip
import io
import lzma
import struct
import zipfile
import zlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs import decompression
from sbas.logs.decompression import output_limit, packing_not_read, packing_of, plain_file

TEXT = b"".join(b"2025-05-23 14:09:%02d,%d.5\n" % (k % 60, k) for k in range(5000))


def zipped(*members: tuple[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return buffer.getvalue()


def compress(data: bytes) -> bytes:
    import ncompress  # at the top, its binding would complain when Python ends

    packed: bytes = ncompress.compress(data)
    return packed


PACKERS = {
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
    "zip": lambda data: zipped(("inner/roof.csv", data)),
    "compress": compress,
}


def put(folder: Path, data: bytes, name: str = "roof.csv.gz") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("packing", PACKERS)
def test_what_was_packed_comes_back_and_goes_with_its_holder(tmp_path: Path, packing: str) -> None:
    path = put(tmp_path, PACKERS[packing](TEXT))
    plain = plain_file(path)
    assert (plain.packing, plain.given, plain.extension) == (packing, path, ".csv")
    assert plain.path.read_bytes() == TEXT
    temporary = plain.path
    del plain
    gc.collect()
    assert not temporary.exists()


def test_a_plain_file_is_itself(tmp_path: Path) -> None:
    path = put(tmp_path, TEXT, "Roof.CSV")
    plain = plain_file(path)
    assert (plain.path, plain.packing, plain.extension, plain.held) == (path, "", ".csv", None)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_zip_methods(tmp_path: Path, method: int) -> None:
    path = put(tmp_path, zipped(("../../etc/roof.pos", TEXT), method=method), "x.zip")
    plain = plain_file(path)
    assert plain.path.read_bytes() == TEXT
    assert plain.name == "roof.pos"
    assert plain.path.parent == Path(decompression.tempfile.gettempdir())


@pytest.mark.parametrize("packing", ["gzip", "bzip2", "xz"])
@pytest.mark.parametrize("between", [b"", b"\0" * 512])
def test_members_one_after_the_other_are_read_whole(
    tmp_path: Path, packing: str, between: bytes
) -> None:
    members = between.join(PACKERS[packing](piece) for piece in (TEXT, b"", TEXT[:77]))
    plain = plain_file(put(tmp_path, members + between))
    assert plain.path.read_bytes() == TEXT + TEXT[:77]


@pytest.mark.parametrize("packing", ["gzip", "bzip2", "xz"])
@given(sizes=st.lists(st.integers(0, 9000), min_size=1, max_size=5), step=st.integers(1, 700))
def test_read_size_changes_nothing(
    tmp_path_factory: pytest.TempPathFactory, packing: str, sizes: list[int], step: int
) -> None:
    pieces = [TEXT[:size] for size in sizes]
    path = put(tmp_path_factory.mktemp("steps"), b"".join(PACKERS[packing](p) for p in pieces))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decompression, "_IN_BYTES", step)
        patch.setattr(decompression, "_OUT_BYTES", 3 * step)
        if not any(sizes):
            with pytest.raises(InputError, match="E15"):
                plain_file(path)
            return
        assert plain_file(path).path.read_bytes() == b"".join(pieces)


@pytest.mark.parametrize("packing", ["gzip", "bzip2", "xz", "zip"])
def test_every_cut_is_refused(tmp_path: Path, packing: str) -> None:
    whole = PACKERS[packing](TEXT)
    for length in [*range(12, len(whole), 97), len(whole) - 1]:
        path = put(tmp_path, whole[:length])
        with pytest.raises(InputError, match="cut or damaged") as caught:
            plain_file(path)
        assert caught.value.code == "E10"
        assert f"of {length:,}" in caught.value.where
        assert "bytes came out" in caught.value.evidence
        assert caught.value.cure


@pytest.mark.parametrize("packing", ["gzip", "bzip2", "xz", "zip"])
def test_every_flipped_byte_is_refused_or_harmless(tmp_path: Path, packing: str) -> None:
    whole = PACKERS[packing](TEXT)
    refused = 0
    for at in range(14, len(whole), 61):
        damaged = bytearray(whole)
        damaged[at] ^= 0x55
        try:
            # Some bytes say nothing about the data: times and names in headers.
            assert plain_file(put(tmp_path, bytes(damaged))).path.read_bytes() == TEXT
        except InputError:
            refused += 1
    assert refused > 0.8 * len(range(14, len(whole), 61))


@pytest.mark.parametrize("packing", ["gzip", "bzip2", "xz"])
def test_garbage_behind_a_member_is_refused(tmp_path: Path, packing: str) -> None:
    # The damaged begin of a second member looks like this: nothing may be left out silently.
    with pytest.raises(InputError, match="E10"):
        plain_file(put(tmp_path, PACKERS[packing](TEXT) + b"garbage" * 9))


@pytest.mark.parametrize("packing", PACKERS)
def test_the_limit_stops_while_bytes_come_out(tmp_path: Path, packing: str) -> None:
    path = put(tmp_path, PACKERS[packing](bytes(5_000_000)))
    with pytest.raises(InputError, match="E21") as caught:
        plain_file(path, max_output=100_000)
    assert "100,000" in caught.value.evidence
    assert "--max-output" in caught.value.cure
    assert plain_file(path, max_output=5_000_000).path.stat().st_size == 5_000_000


@pytest.mark.parametrize(
    ("packing", "limit"),
    [("gzip", 5_000_000), ("xz", 5_000_000), ("zip", 5_000_000), ("bzip2", 0), ("compress", 0)],
)
def test_the_limit_that_is_named_will_do(tmp_path: Path, packing: str, limit: int) -> None:
    data = (b"".join(b"%d" % i for i in range(20_000)) * 60)[:5_000_000]
    path = put(tmp_path, PACKERS[packing](data))
    with pytest.raises(InputError, match="E21") as caught:
        plain_file(path, max_output=100_000)
    named = int(caught.value.cure.split()[1])
    if limit:
        assert named == limit
        assert plain_file(path, max_output=named).path.stat().st_size == limit
    else:
        assert "raise that until it is read" in caught.value.cure


def test_the_limit_for_members_one_after_the_other_will_do(tmp_path: Path) -> None:
    # The trailer is of the last member, 10 bytes: what deflate can become at most is named.
    packed = gzip.compress(bytes(3_000_000)) + gzip.compress(b"0123456789")
    with pytest.raises(InputError, match="E21") as caught:
        plain_file(put(tmp_path, packed), max_output=100_000)
    named = int(caught.value.cure.split()[1])
    assert 3_000_010 <= named <= 1032 * len(packed)
    assert plain_file(put(tmp_path, packed), max_output=named).path.stat().st_size == 3_000_010


def test_a_bomb_is_refused_without_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decompression, "FREE_BYTES", 1 << 16)
    bomb = gzip.compress(bytes(30_000_000))  # zlib reaches 1029:1
    with pytest.raises(InputError, match="out of proportion"):
        plain_file(put(tmp_path, bomb))
    assert plain_file(put(tmp_path, bomb), max_output=1 << 30).path.stat().st_size == 30_000_000


def test_limits() -> None:
    # Methods page, section 9, E21: 8 GiB, and 200 times the input beyond 64 MiB.
    assert output_limit(1) == 64 << 20
    assert output_limit(1 << 20) == 200 << 20
    assert output_limit(1 << 40) == 8 << 30
    assert output_limit(1 << 40, 1 << 34) == 1 << 34
    with pytest.raises(InputError, match="max_output"):
        output_limit(5, 0)


@pytest.mark.parametrize("outer", PACKERS)
@pytest.mark.parametrize("inner", PACKERS)
def test_packing_within_packing_is_refused(tmp_path: Path, outer: str, inner: str) -> None:
    with pytest.raises(InputError, match=f"{inner} within {outer}") as caught:
        plain_file(put(tmp_path, PACKERS[outer](PACKERS[inner](TEXT))))
    assert caught.value.code == "E21"


def test_archives_of_several_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds 2 files") as caught:
        plain_file(put(tmp_path, zipped(("a.csv", TEXT), ("b\n.csv", TEXT))))
    assert caught.value.code == "E21"
    assert "'b\\n.csv'" in caught.value.evidence
    tar = bytearray(1024)
    tar[257:262] = b"ustar"
    with pytest.raises(InputError, match="tar within gzip"):
        plain_file(put(tmp_path, gzip.compress(bytes(tar))))


def test_empty_archives(tmp_path: Path) -> None:
    for data in (gzip.compress(b""), zipped(), zipped(("folder/", b""))):
        with pytest.raises(InputError, match="holds nothing") as caught:
            plain_file(put(tmp_path, data))
        assert caught.value.code == "E15"


def test_encrypted_zip(tmp_path: Path) -> None:
    data = bytearray(zipped(("a.csv", TEXT)))
    for at in (6, data.rindex(b"PK\x01\x02") + 8):  # flags, local and central: bit 0
        data[at] |= 1
    with pytest.raises(InputError, match="encrypted") as caught:
        plain_file(put(tmp_path, bytes(data)))
    assert "password" in caught.value.cure


def test_a_zip_that_lies_about_its_size_is_refused(tmp_path: Path) -> None:
    data = bytearray(zipped(("a.csv", TEXT)))
    at = data.rindex(b"PK\x01\x02") + 24
    assert struct.unpack_from("<I", data, at)[0] == len(TEXT)
    struct.pack_into("<I", data, at, 1000)
    with pytest.raises(InputError, match="E10"):
        plain_file(put(tmp_path, bytes(data)))


def test_unix_compress_says_that_it_cannot_tell_a_cut(tmp_path: Path) -> None:
    plain = plain_file(put(tmp_path, compress(TEXT), "roof.csv.Z"))
    assert [(f.code, f.severity) for f in plain.findings] == [("E10", "warning")]
    damaged = bytearray(compress(TEXT))
    damaged[3:7] = b"\xff" * 4  # the first code cannot refer to one before it
    with pytest.raises(InputError, match="cut or damaged"):
        plain_file(put(tmp_path, bytes(damaged), "roof.csv.Z"))


@pytest.mark.parametrize("packing", PACKERS)
def test_disk_full_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, packing: str) -> None:
    class Full(io.BytesIO):
        def write(self, _: object) -> int:
            raise OSError(28, "No space left on device")

    path = put(tmp_path, PACKERS[packing](TEXT))
    real = open
    monkeypatch.setattr(
        "builtins.open",
        lambda name, mode="r", *rest: Full() if mode == "wb" else real(name, mode, *rest),
    )
    with pytest.raises(InputError, match="cannot be decompressed") as caught:
        plain_file(path)
    assert "No space left" in caught.value.evidence
    assert "TMPDIR" in caught.value.cure


@given(st.sampled_from(sorted(PACKERS)), st.binary(max_size=200), st.integers(0, 60))
def test_any_bytes_give_a_file_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, packing: str, data: bytes, keep: int
) -> None:
    path = put(tmp_path_factory.mktemp("fuzz"), PACKERS[packing](TEXT)[:keep] + data or b"x")
    with contextlib.suppress(InputError):
        plain_file(path)


def test_packings_are_told_by_their_first_bytes() -> None:
    for packing, pack in PACKERS.items():
        assert packing_of(pack(TEXT)[:16]) == packing
    assert packing_of(zlib.compress(TEXT)) == ""
    assert packing_of(b"BZhar text") == ""
    assert packing_of(b"\x1f\x9d\xff") == ""  # no such width of codes
    assert packing_not_read(b"\x28\xb5\x2f\xfd rest")[0] == "zstd"
    assert packing_not_read(b"7z\xbc\xaf\x27\x1c")[1].startswith("7z x")
    assert packing_not_read(TEXT) == ("", "")
