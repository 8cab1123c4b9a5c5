"""Framing against a plain loop: damage, foreign bytes, nesting, and any size of chunks."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.logs.ublox.ubx_framing import Frames, checksums_of_spans, frame, scan
from tests.logs.ublox.ubx_samples import ITOW, NMEA, checksum, epoch, reference_frames, ubx


def as_list(frames: Frames) -> list[tuple[int, int, bytes]]:
    data, offset = frames.data, frames.offset
    spans = zip(frames.start.tolist(), frames.end.tolist(), frames.key.tolist(), strict=True)
    return [(low, key, data[low - offset : high - offset].tobytes()) for low, high, key in spans]


def framed(data: bytes) -> list[tuple[int, int, bytes]]:
    return as_list(frame(np.frombuffer(data, np.uint8)))


def scanned(path: Path, chunk_bytes: int, **options: int) -> list[tuple[int, int, bytes]]:
    parts = scan(path, as_list, chunk_bytes=chunk_bytes, **options)
    return [found for part in parts for found in part]


@pytest.fixture(scope="module")
def clean() -> bytes:
    return b"".join(epoch(ITOW + 100 * i, lat=500_000_000 + i) for i in range(2000))


@pytest.fixture(scope="module")
def damaged(clean: bytes) -> tuple[bytes, list[bytes]]:
    """A damaged file, and the frames that the damage left whole."""
    rng = np.random.default_rng(11)
    pieces: list[bytes] = []
    intact: list[bytes] = []
    for _, _, whole in reference_frames(clean):
        fate = rng.random()
        if fate < 0.01:
            hurt = bytearray(whole)
            hurt[rng.integers(len(hurt))] ^= 1 << rng.integers(8)
            pieces.append(bytes(hurt))
            continue
        if fate < 0.02:
            pieces.append(whole[: rng.integers(len(whole))])
            continue
        if fate < 0.03:
            pieces.append(NMEA)
        elif fate < 0.04:
            pieces.append(rng.bytes(int(rng.integers(1, 300))) + b"\xb5\x62")
        elif fate < 0.05:
            whole = ubx(0x0A00, whole + whole)
        pieces.append(whole)
        intact.append(whole)
    return b"".join(pieces), intact


def test_clean_file_has_every_frame(clean: bytes) -> None:
    found = framed(clean)
    assert found == reference_frames(clean)
    assert len(found) == 7 * 2000
    assert sum(len(whole) for _, _, whole in found) == len(clean)


def test_damaged_file_yields_every_intact_frame_and_no_other(
    damaged: tuple[bytes, list[bytes]],
) -> None:
    data, intact = damaged
    found = framed(data)
    assert [whole for _, _, whole in found] == intact
    assert found == reference_frames(data)


@pytest.mark.parametrize("chunk_bytes", [1, 70_000, 100_003, 1 << 20, 32 << 20])
def test_size_of_chunks_changes_nothing(
    damaged: tuple[bytes, list[bytes]], tmp_path: Path, chunk_bytes: int
) -> None:
    path = tmp_path / "damaged.ubx"
    path.write_bytes(damaged[0])
    assert scanned(path, chunk_bytes) == framed(damaged[0])


def test_frame_inside_another_does_not_count() -> None:
    inner = ubx(0x0104, bytes(18))
    assert [key for _, key, _ in framed(ubx(0x0A00, inner) + inner)] == [0x0A00, 0x0104]


def test_frame_in_the_last_one_of_the_chunk_before(tmp_path: Path) -> None:
    inner = ubx(0x0104, bytes(18)) * 300
    wrapped = ubx(0x0A00, inner)
    path = tmp_path / "seam.ubx"
    # The wrapping frame crosses the seam at 70,000 bytes, its inner frames lie on both sides.
    path.write_bytes(bytes(70_000 - len(wrapped) // 2) + wrapped + inner)
    found = scanned(path, 70_000)
    assert found == reference_frames(path.read_bytes())
    assert len(found) == 301


def test_header_across_the_seam_is_found(tmp_path: Path) -> None:
    path = tmp_path / "seam.ubx"
    for shift in range(12):
        path.write_bytes(bytes(70_000 - shift) + ubx(0x0161, bytes(4)) + bytes(9000))
        assert [at for at, _, _ in scanned(path, 70_000)] == [70_000 - shift]


@pytest.mark.parametrize(("limit", "count"), [(99, 0), (100, 1), (65535, 1)])
def test_longest_payload(tmp_path: Path, limit: int, count: int) -> None:
    path = tmp_path / "one.ubx"
    path.write_bytes(ubx(0x0A04, bytes(range(100))))
    assert len(scanned(path, 1, max_payload=limit)) == count


@pytest.mark.parametrize("unit", [b"\xb5\x62", b"\xb5\x62\x01\x07\x00\x20", bytes(8), b"\xb5"])
def test_hostile_patterns_take_no_long_time(unit: bytes) -> None:
    data = np.frombuffer((unit * (2_000_000 // len(unit) + 1))[:2_000_000], np.uint8)
    begin = time.perf_counter()
    frame(data)
    # Checking each candidate from its own first byte would take minutes.
    assert time.perf_counter() - begin < 120


SPANS = st.lists(st.tuples(st.integers(0, 299), st.integers(1, 300)), max_size=40)


@given(st.binary(min_size=4, max_size=300), SPANS)
def test_checksums_however_the_spans_overlap(data: bytes, spans: list[tuple[int, int]]) -> None:
    ends = [(low, min(low + n, len(data) - 1)) for low, n in spans if low < len(data) - 1]
    start, end = (np.array([span[i] for span in ends], np.int64) for i in (0, 1))
    if not len(start):
        return
    a, b = checksums_of_spans(np.frombuffer(data, np.uint8), start, end)
    assert [bytes(pair) for pair in zip(a, b, strict=True)] == [
        checksum(data[low:high]) for low, high in ends
    ]


@given(st.binary(max_size=400))
def test_any_bytes(data: bytes) -> None:
    assert framed(data) == reference_frames(data)


BRICKS = st.one_of(
    st.binary(max_size=30),
    st.just(b"\xb5\x62"),
    st.just(NMEA),
    st.builds(ubx, st.sampled_from([0x0107, 0x0A00, 0x0213]), st.binary(max_size=40)),
    st.builds(
        lambda inner, cut: ubx(0x0A00, ubx(0x0104, inner))[cut:],
        st.binary(max_size=20),
        st.integers(0, 30),
    ),
)


@settings(max_examples=200)
@given(st.lists(BRICKS, max_size=12))
def test_any_mixture_of_frames_and_bytes(bricks: list[bytes]) -> None:
    data = b"".join(bricks)
    assert framed(data) == reference_frames(data)


@settings(max_examples=25)
@given(st.lists(BRICKS, min_size=1, max_size=8), st.integers(0, 2**16))
def test_any_mixture_of_frames_and_bytes_at_a_seam(
    tmp_path_factory: pytest.TempPathFactory, bricks: list[bytes], shift: int
) -> None:
    data = b"".join(bricks)
    path = tmp_path_factory.mktemp("seam") / "seam.ubx"
    path.write_bytes(bytes(9000 - min(shift % (len(data) + 1), 9000)) + data + bytes(10_000))
    assert scanned(path, 9000) == reference_frames(path.read_bytes())


def test_progress_reaches_the_end(clean: bytes, tmp_path: Path) -> None:
    path = tmp_path / "clean.ubx"
    path.write_bytes(clean)
    calls: list[tuple[int, int]] = []
    for _ in scan(path, as_list, chunk_bytes=1, progress=lambda *call: calls.append(call)):
        pass
    assert calls[-1] == (len(clean), len(clean))
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
