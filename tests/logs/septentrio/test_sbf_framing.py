"""Framing against a plain loop: damage, foreign bytes, nesting, and any size of chunks."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.logs.septentrio.sbf_framing import Frames, frame, scan
from sbas.logs.septentrio.sbf_writer import write
from tests.logs.septentrio.sbf_samples import block, opaque_block, recording, reference_blocks

NMEA = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"


def as_list(frames: Frames) -> list[tuple[int, int, bytes]]:
    found = [
        (int(at), group.number, row.tobytes())
        for group in frames.groups
        for at, row in zip(group.position, group.rows, strict=True)
    ]
    return sorted(found)


def framed(data: bytes) -> list[tuple[int, int, bytes]]:
    return as_list(frame(np.frombuffer(data, np.uint8)))


def scanned(path: Path, chunk_bytes: int) -> list[tuple[int, int, bytes]]:
    return [found for _, part in scan(path, as_list, chunk_bytes=chunk_bytes) for found in part]


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("sbf") / "clean.sbf"
    write([recording(2000, seed=3)], path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def damaged(clean: bytes) -> tuple[bytes, set[bytes]]:
    """A damaged file, and the blocks that the damage left whole (all blocks differ)."""
    rng = np.random.default_rng(11)
    pieces: list[bytes] = []
    intact: set[bytes] = set()
    for _, _, whole in reference_blocks(clean):
        fate = rng.random()
        if fate < 0.01:
            hurt = bytearray(whole)
            hurt[rng.integers(len(hurt))] ^= 1 << rng.integers(8)
            pieces.append(bytes(hurt))
        elif fate < 0.02:
            low, high = sorted(rng.integers(0, len(whole) + 1, 2))
            pieces.append(whole[:low] + whole[high:])
            if low == high:
                intact.add(whole)
        elif fate < 0.03:
            pieces += [whole, NMEA]
            intact.add(whole)
        elif fate < 0.04:
            pieces += [whole, rng.bytes(int(rng.integers(1, 300))), b"$@\xd3\0"]
            intact.add(whole)
        elif fate < 0.05:
            inner = opaque_block(4030, rng.bytes(20))
            wrapped = opaque_block(4097, b"\0\0\0\0" + inner + inner)
            pieces += [wrapped, whole]
            intact |= {whole, wrapped}
        else:
            pieces.append(whole)
            intact.add(whole)
    return b"".join(pieces)[:-5], intact - {pieces[-1]}


def test_clean_file_has_every_block(clean: bytes) -> None:
    found = framed(clean)
    assert found == reference_blocks(clean)
    assert len(found) == 6 * 2000
    assert sum(len(whole) for _, _, whole in found) == len(clean)


def test_damaged_file_yields_every_intact_block_and_no_other(
    damaged: tuple[bytes, set[bytes]],
) -> None:
    data, intact = damaged
    found = framed(data)
    assert {whole for _, _, whole in found} == intact
    assert len(found) == len(intact)
    assert found == reference_blocks(data)


@pytest.mark.parametrize("chunk_bytes", [1, 70_000, 100_003, 1 << 20, 32 << 20])
def test_size_of_chunks_changes_nothing(
    damaged: tuple[bytes, set[bytes]], tmp_path: Path, chunk_bytes: int
) -> None:
    path = tmp_path / "damaged.sbf"
    path.write_bytes(damaged[0])
    assert scanned(path, chunk_bytes) == framed(damaged[0])


def test_block_inside_another_does_not_count() -> None:
    inner = block(4001, tow_ms=1000)
    assert [number for _, number, _ in framed(opaque_block(4097, inner) + inner)] == [4097, 4001]


def test_block_that_a_chance_block_covers_does_not_count() -> None:
    # The outer block, not followed by another, is only checked after the inner, linked ones.
    inner = block(4001, tow_ms=1000) + block(5921, tow_ms=1000)
    data = opaque_block(4097, inner) + b"tail" + inner
    assert framed(data) == reference_blocks(data)


def test_candidate_uncovered_by_a_dropped_block() -> None:
    """A covers the start of B, B the start of C, and C ends the data: A and C are accepted."""
    c = opaque_block(4030, bytes(40))
    for cut in range(4, 24, 4):
        b = opaque_block(4031, bytes(8) + c[:cut])
        a = opaque_block(4032, bytes(8) + b[:8])
        data = a + b[8:] + c[cut:]
        assert framed(data) == reference_blocks(data)
        assert [number for _, number, _ in framed(data)] == [4032, 4030]


def test_block_in_the_last_one_of_the_chunk_before(tmp_path: Path) -> None:
    inner = b"".join(block(4001, tow_ms=1000 * i) for i in range(500))
    wrapped = opaque_block(4097, inner)
    path = tmp_path / "seam.sbf"
    # The wrapping block crosses the seam at 65,536 bytes, its inner blocks lie on both sides.
    path.write_bytes(bytes(65_536 - len(wrapped) // 2) + wrapped + inner)
    found = scanned(path, 65_536)
    assert found == reference_blocks(path.read_bytes())
    assert len(found) == 501


def test_header_across_the_seam_is_found(tmp_path: Path) -> None:
    one = block(5921, tow_ms=5)
    path = tmp_path / "seam.sbf"
    for shift in range(20):
        path.write_bytes(bytes(65_536 - shift) + one + bytes(70_000))
        assert [at for at, _, _ in scanned(path, 65_536)] == [65_536 - shift]


@pytest.mark.parametrize(
    "unit",
    [b"$@", b"$@\0\0\xa1\x0f\xfc\xff", opaque_block(4097, b"$@" * 40)[:60], bytes(8), b"$"],
)
def test_hostile_patterns_take_no_long_time(unit: bytes) -> None:
    data = np.frombuffer((unit * (2_000_000 // len(unit) + 1))[:2_000_000], np.uint8)
    begin = time.perf_counter()
    frame(data)
    # Checking each candidate from its own first byte would take minutes.
    assert time.perf_counter() - begin < 120


def test_false_candidates_inside_blocks_are_not_checked() -> None:
    """Heights of 10 m end in the sync bytes (0x4024 as float64): a candidate in every epoch."""
    parts = [
        block(4007, 2, tow_ms=1000 * i, height=10.0 + i * 1e-6, vn=1e-3 * i) for i in range(3000)
    ]
    assert framed(b"".join(parts)) == reference_blocks(b"".join(parts))


@given(st.binary(max_size=400))
def test_any_bytes(data: bytes) -> None:
    assert framed(data) == reference_blocks(data)


BRICKS = st.one_of(
    st.binary(max_size=30),
    st.just(b"$@"),
    st.just(NMEA),
    st.builds(opaque_block, st.sampled_from([4001, 4097, 5921]), st.binary(max_size=40)),
    st.builds(
        lambda inner, cut: opaque_block(4097, opaque_block(4001, inner))[cut:],
        st.binary(max_size=20),
        st.integers(0, 30),
    ),
)


@settings(max_examples=200)
@given(st.lists(BRICKS, max_size=12))
def test_any_mixture_of_blocks_and_bytes(bricks: list[bytes]) -> None:
    data = b"".join(bricks)
    assert framed(data) == reference_blocks(data)


@settings(max_examples=25)
@given(st.lists(BRICKS, min_size=1, max_size=8), st.integers(0, 2**16))
def test_any_mixture_of_blocks_and_bytes_at_a_seam(
    tmp_path_factory: pytest.TempPathFactory, bricks: list[bytes], shift: int
) -> None:
    data = b"".join(bricks)
    path = tmp_path_factory.mktemp("seam") / "seam.sbf"
    path.write_bytes(bytes(65_536 - min(shift % (len(data) + 1), 65_536)) + data + bytes(66_000))
    assert scanned(path, 65_536) == reference_blocks(path.read_bytes())


def test_progress_reaches_the_end(clean: bytes, tmp_path: Path) -> None:
    path = tmp_path / "clean.sbf"
    path.write_bytes(clean)
    calls: list[tuple[int, int]] = []
    for _ in scan(path, as_list, chunk_bytes=1, progress=lambda *call: calls.append(call)):
        pass
    assert calls[-1] == (len(clean), len(clean))
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
