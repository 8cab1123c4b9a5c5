"""Blocks of lines from bytes of any kind, and numbers from fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs import text_input
from sbas.logs.text_input import TextBlocks, collapse_blanks, parse_lines, parse_numbers


def blocks_of(folder: Path, data: bytes) -> tuple[bytes, TextBlocks]:
    path = folder / "text"
    path.write_bytes(data)
    blocks = TextBlocks(path)
    return b"".join(blocks), blocks


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_encodings_are_told_and_counted(tmp_path: Path, encoding: str) -> None:
    text = "time,lat\n2025-01-01 00:00:00,50.5\n"
    data, blocks = blocks_of(tmp_path, text.encode(encoding))
    assert data == text.encode()
    assert [(f.code, f.severity) for f in blocks.findings()] == [("E19", "info")]


def test_plain_text_has_no_finding(tmp_path: Path) -> None:
    data, blocks = blocks_of(tmp_path, "Höhe,n\n1,2\nunfinished".encode())
    assert data == "Höhe,n\n1,2\n".encode()
    assert blocks.unfinished == b"unfinished"
    assert blocks.findings() == ()


def test_latin_1_is_read_and_said(tmp_path: Path) -> None:
    data, blocks = blocks_of(tmp_path, "Höhe\n".encode("latin-1"))
    assert data == "Höhe\n".encode()
    finding = blocks.findings()[0]
    assert (finding.code, finding.severity, finding.where) == ("E19", "warning", "from byte 1")


def test_lines_with_nul_are_left_out(tmp_path: Path) -> None:
    # What stands before and behind a hole need not belong together: 12|00|.5 is not 12.5.
    data, blocks = blocks_of(tmp_path, b"a,1\nb,12\0\0.5\nc,3\n" + b"\0" * 100 + b"\n\0\0\n")
    assert data == b"a,1\nc,3\n"
    assert blocks.nul_lines == 1
    assert "104 NUL bytes" in blocks.findings()[0].message


def test_old_mac_line_ends(tmp_path: Path) -> None:
    data, blocks = blocks_of(tmp_path, b"a,1\rb,2\r")
    assert data == b"a,1\nb,2\n"
    assert "CR" in blocks.findings()[0].message


def test_text_without_line_ends_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="E18"):
        blocks_of(tmp_path, b"1,2," * 50_000)


def test_block_size_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [f"{k},{k / 7!r}\n".encode() for k in range(5000)]
    text = b"".join(lines)
    for size in (1000, 65536):
        monkeypatch.setattr(text_input, "BLOCK_BYTES", size)
        assert blocks_of(tmp_path, text)[0] == text


@given(st.text(" a\n", max_size=60))
def test_blanks_collapse_as_split_does(text: str) -> None:
    expected = [" ".join(line.split(" ")).split() for line in text.split("\n")]
    found = [line.split(b" ") for line in collapse_blanks(text.encode() + b"\n").split(b"\n")[:-1]]
    assert [[f.decode() for f in fields if f] for fields in found] == expected
    assert all(b"" not in fields for fields in found if fields != [b""])


def test_blanks_collapse_across_pieces() -> None:
    line = b"  12   3.5  \n"
    assert collapse_blanks(line * 50_000) == b"12 3.5\n" * 50_000


def test_numbers_are_exact_and_others_are_told() -> None:
    words = ["1.5", " -0 ", "+2e3", ".5", "7.", "", "NaN", "x", "0x10", "1_0", "1,5", "inf", None]
    values, wrong, missing = parse_numbers(pa.array(words))
    np.testing.assert_equal(values[:5], [1.5, -0.0, 2000.0, 0.5, 7.0])
    assert np.isnan(values[5:]).all()
    assert wrong.tolist() == [False] * 7 + [True] * 5 + [False]
    assert missing == 1


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_both_paths_give_the_nearest_double(numbers: list[float]) -> None:
    lines = "".join(f"{n!r};x\n" for n in numbers).encode()
    options = {"texts": ["b"], "wanted": ["a", "b"], "delimiter": ";"}
    fast = parse_lines(lines, ["a", "b"], **options).numbers["a"]  # type: ignore[arg-type]
    slow = parse_lines(b"?;x\n" + lines, ["a", "b"], **options)  # type: ignore[arg-type]
    np.testing.assert_array_equal(fast, numbers)
    np.testing.assert_array_equal(slow.numbers["a"][1:], numbers)
    assert slow.unreadable["a"].tolist() == [True] + [False] * len(numbers)


def test_open_quotes_do_not_swallow_lines() -> None:
    text = b'1,"a"\n2,"b\n3,c\n4,"d,e"\n'
    fields = parse_lines(text, ["n", "t"], texts=["t"], wanted=["n", "t"], delimiter=",")
    assert fields.numbers["n"].tolist() == [1, 3, 4]
    assert fields.texts["t"].to_pylist() == ["a", "c", "d,e"]
    assert fields.bad_lines == 1
    assert "open quote" in fields.first_bad


@pytest.mark.parametrize("encoding", ["latin-1", "cp1250", "utf-16", "utf-16-le", "utf-8", "cp037"])
def test_the_encoding_is_as_asked(tmp_path: Path, encoding: str) -> None:
    text = "time,Höhe\n2025-01-01,50.5\n"
    path = tmp_path / "text"
    path.write_bytes(text.encode(encoding))
    blocks = TextBlocks(path, encoding=encoding)
    assert b"".join(blocks) == text.encode()
    assert blocks.findings() == ()
    assert blocks.unfinished == b""


def test_the_mark_is_no_text_where_the_encoding_is_asked(tmp_path: Path) -> None:
    (tmp_path / "text").write_bytes(b"\xef\xbb\xbftime\n")
    assert list(TextBlocks(tmp_path / "text", encoding="utf-8")) == [b"time\n"]


def test_what_the_asked_encoding_cannot_be_is_counted(tmp_path: Path) -> None:
    (tmp_path / "text").write_bytes("Höhe,1\n2,ö".encode("latin-1"))
    blocks = TextBlocks(tmp_path / "text", encoding="utf-8")
    assert list(blocks) == ["H\ufffdhe,1\n".encode()]
    (finding,) = blocks.findings()
    assert (finding.code, finding.severity) == ("E19", "warning")
    assert "2 characters" in finding.message


@pytest.mark.parametrize("encoding", ["base64", "rot13", "no-such", "", "idna", "hex"])
def test_no_text_encoding(tmp_path: Path, encoding: str) -> None:
    with pytest.raises(InputError, match="unknown encoding") as caught:
        TextBlocks(tmp_path / "text", encoding=encoding)
    assert "latin-1" in caught.value.cure


def test_longer_lines_as_asked(tmp_path: Path) -> None:
    (tmp_path / "text").write_bytes(b"1," * 50_000 + b"\n")
    with pytest.raises(InputError, match="E18") as caught:
        list(TextBlocks(tmp_path / "text"))
    assert "--max-line" in caught.value.cure
    assert len(b"".join(TextBlocks(tmp_path / "text", max_line=100_001))) == 100_001
    with pytest.raises(InputError, match="E18"):
        list(TextBlocks(tmp_path / "text", max_line=99_999))
    with pytest.raises(InputError, match="max_line"):
        TextBlocks(tmp_path / "text", max_line=0)
