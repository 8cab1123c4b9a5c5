"""A file read segment by segment gives what it gives read at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs.septentrio import sbf_stream
from sbas.logs.septentrio.sbf_stream import SbfEpochs
from sbas.logs.septentrio.sbf_writer import write
from sbas.logs.septentrio.septentrio_sbf import (
    FILLED,
    read,
    read_in_chunks,
    scan,
    scan_in_segments,
)
from sbas.recording import EpochSource, Flag, Recording
from tests.logs.septentrio.sbf_samples import (
    block,
    corrections_block,
    opaque_block,
    positions_block,
    recording,
    reference_blocks,
    residuals_block,
    signal,
)
from tests.logs.septentrio.test_septentrio_sbf import NMEA, epoch

CHUNK = 65_536
"""The smallest chunk; the bodies of `filler` blocks make few epochs fill many."""


def filler(size: int = 30_000) -> bytes:
    """A block that no reading keeps, to put bytes between others."""
    return opaque_block(4027, bytes(size))


def whole(source: EpochSource, columns: tuple[str, ...] = FILLED) -> pd.DataFrame:
    return pd.concat(list(source.batches(columns)))


def assert_same(path: Path, segment_bytes: int, *, streams: bool | None = True) -> EpochSource:
    """Epochs, metadata and findings of `scan` are those of `read`, be that cut or not."""
    expected = read(path)
    cut = read_in_chunks(path, CHUNK, segment_bytes)
    pd.testing.assert_frame_equal(cut.table, expected.table, check_freq=False)
    assert cut.meta == expected.meta
    for name, side in expected.side_tables.items():
        pd.testing.assert_frame_equal(cut.side_tables[name], side)
    found = scan_in_segments(path, CHUNK, segment_bytes)
    if streams is not None:
        assert isinstance(found, SbfEpochs) == streams
    assert found.meta == expected.meta
    assert found.columns == expected.columns
    pd.testing.assert_frame_equal(whole(found), expected.table, check_freq=False)
    assert len(found) == len(expected)  # type: ignore[arg-type]
    return found


def segments(source: EpochSource) -> int:
    return sum(1 for _ in source.batches(["hpl_m"]))


def test_a_long_damaged_file(tmp_path: Path) -> None:
    path = tmp_path / "log.sbf"
    write([recording(4000, seed=3)], path)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(2)
    data[200_000:200_030] = rng.bytes(900)
    data[500_000:500_000] = NMEA * 2000
    for at in rng.integers(0, len(data), 60):
        data[at] ^= 4
    path.write_bytes(bytes(data[:-7]))
    for segment_bytes in (100_000, 300_000, 32 << 20):
        source = assert_same(path, segment_bytes)
        assert (segments(source) > 3) == (segment_bytes < 1 << 20)
    codes = {finding.code for finding in source.meta.findings}
    assert {"E10", "E24"} <= codes


def test_stretches_between_blocks_are_counted_as_they_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log.sbf"
    parts = []
    for i in range(60):
        parts += [epoch(1000 * i), NMEA, b"junk!" * (i % 7), filler(10_000)]
    path.write_bytes(b"".join(parts) + epoch(70_000)[:50])
    expected = read(path)
    monkeypatch.setattr("sbas.logs.septentrio.sbf_foreign.MANY_STRETCHES", 5)
    assert read(path).meta == expected.meta
    assert_same(path, 100_000)


def test_an_epoch_whose_blocks_straddle_chunks(tmp_path: Path) -> None:
    """Blocks of one epoch lie in up to three chunks, in segments of all cuts."""
    path = tmp_path / "log.sbf"
    parts = []
    for i in range(40):
        for _, _, blk in reference_blocks(epoch(1000 * i)):
            parts += [blk, filler(12_000 + 40 * i)]
    path.write_bytes(b"".join(parts))
    assert segments(assert_same(path, 80_000)) > 5
    assert not [f for f in read(path).meta.findings if f.severity != "info"]


def test_blocks_that_come_late(tmp_path: Path) -> None:
    """The level of each fifth epoch comes behind the position of the next but one."""
    path = tmp_path / "log.sbf"
    parts, late = [], b""
    for i in range(200):
        blocks = [b for _, _, b in reference_blocks(epoch(1000 * i, hpl=5.0 + i))]
        parts += [blocks[0], filler(3000)]
        if i % 5 == 2:
            parts.append(late)
        if i % 5 == 0:
            late = blocks.pop(2)
        parts += blocks[1:]
    path.write_bytes(b"".join(parts))
    source = assert_same(path, 150_000)
    assert segments(source) > 3
    assert whole(source)["hpl_m"].tolist() == [5.0 + i for i in range(200)]


def test_a_kind_of_block_that_one_segment_lacks(tmp_path: Path) -> None:
    """Epochs lack a block if any other epoch of the file has it, be it in another segment."""
    path = tmp_path / "log.sbf"
    parts = [block(4007, 2, tow_ms=1000 * i, mode=1, lat=0.5, lon=0.1) + filler(9000)
             for i in range(60)]  # fmt: skip
    parts += [epoch(60_000)]
    path.write_bytes(b"".join(parts))
    source = assert_same(path, 100_000)
    incomplete = (whole(source)["flags"].to_numpy() & Flag.EPOCH_INCOMPLETE) != 0
    assert incomplete.tolist() == [True] * 60 + [False]


def test_time_that_goes_backward_streams(tmp_path: Path) -> None:
    """A log of an earlier hour behind a later one; the jump lies between two segments or in one."""
    path = tmp_path / "log.sbf"
    for first in (20, 21, 22, 23):
        later = [epoch(9_000_000 + 1000 * i) + filler(9000) for i in range(first)]
        earlier = [epoch(1000 * i) + filler(9000) for i in range(40)]
        path.write_bytes(b"".join(later + earlier))
        table = whole(assert_same(path, 100_000))
        backward = (table["flags"].to_numpy() & Flag.TIME_BACKWARD) != 0
        assert np.flatnonzero(backward).tolist() == [first]


@pytest.mark.parametrize("kind", ["twice", "sections", "late"])
def test_a_time_that_comes_again_far_behind_is_read_whole(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "log.sbf"
    parts = [epoch(1000 * i) + filler(9000) for i in range(40)]
    if kind == "twice":
        parts += parts
    elif kind == "sections":
        parts = [block(n, tow_ms=1000 * i, **{f: 9.0}) + filler(9000)
                 for n, f in ((4001, "hpl"), (5906, "nn")) for i in range(40)]  # fmt: skip
    else:
        parts.append(block(5921, tow_ms=0))
    path.write_bytes(b"".join(parts))
    source = assert_same(path, 100_000, streams=False)
    assert isinstance(source, Recording)


def test_a_stretch_without_any_place_to_cut_is_read_whole(tmp_path: Path) -> None:
    """One kind of block lags by an epoch throughout."""
    path = tmp_path / "log.sbf"
    parts = []
    for i in range(90):
        parts += [block(4001, tow_ms=1000 * (i + 1), hpl=5.0), filler(9000),
                  block(5906, tow_ms=1000 * i, nn=1.0)]  # fmt: skip
    path.write_bytes(b"".join(parts))
    assert_same(path, 70_000, streams=False)


def test_findings_of_side_tables_are_among_those_of_a_scan(tmp_path: Path) -> None:
    path = tmp_path / "log.sbf"
    parts = []
    for i in range(50):
        t = 1000 * i
        parts += [
            epoch(t), positions_block(t, {5: (2e7, 1e7, 0.0), 62: (2e7, 1e7, 0.0)}),
            corrections_block(t, {5: (-1.0, 1.0, 1.0, 1.0)}),
            residuals_block(t, signal(5, code=(1.0, 1, 1)), signal(5, signal=3, code=(1.0, 1, 1))),
            block(4020, tow_ms=t if i % 2 else 4294967295, svid=120),
            block(5914, tow_ms=t, leap_seconds=14 if i < 30 else 15, sync_level=7 if i else 3),
            filler(9000),
        ]  # fmt: skip
    path.write_bytes(b"".join(parts))
    source = assert_same(path, 100_000)
    text = "\n".join(f"{f.message} {f.evidence}" for f in source.meta.findings)
    for words in ("50 x negative variance", "50 residuals of further", "50 sub-blocks of no known",
                  "25 GEORawL1", "1 of 50 ReceiverTime", "14 s to 15 s, k = +1"):  # fmt: skip
        assert words in text


def test_named_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.sbf"
    write([recording(1500, seed=5)], path)
    for columns in (["hpl_m"], ["flags", "sigma_e_m"], []):
        expected = read(path, columns=columns)
        found = scan_in_segments(path, CHUNK, 100_000, columns=columns)
        assert found.columns == tuple(columns)
        assert found.meta == expected.meta
        pd.testing.assert_frame_equal(
            whole(found, tuple(columns)), expected.table, check_freq=False
        )
    found = scan_in_segments(path, CHUNK, 100_000, columns=["hpl_m"])
    table = whole(found, ("vpl_m", "environment", "hpl_m"))
    assert table.columns.tolist() == ["vpl_m", "environment", "hpl_m"]
    assert table["vpl_m"].isna().all()
    with pytest.raises(InputError, match="unknown column"):
        whole(found, ("x_nonsense",))


def test_no_epoch(tmp_path: Path) -> None:
    path = tmp_path / "x.sbf"
    path.write_bytes(block(4020, tow_ms=0, svid=120))
    assert len(whole(assert_same(path, 100_000))) == 0
    path.write_bytes(b"")
    assert_same(path, 100_000)


def test_progress_reaches_the_end_each_time(tmp_path: Path) -> None:
    path = tmp_path / "log.sbf"
    write([recording(500)], path)
    steps: list[tuple[int, int]] = []
    source = scan(path, progress=lambda done, of: steps.append((done, of)))
    size = path.stat().st_size
    assert steps[-1] == (size, size)
    steps.clear()
    assert len(whole(source)) == 500
    assert steps[-1] == (size, size)


def test_what_waits_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No segment spans more bytes than a segment, what waits behind it, and a chunk."""
    path = tmp_path / "log.sbf"
    write([recording(6000, seed=1)], path)
    spans = []
    decode = sbf_stream.decode_part

    def watched(part, *more, **options):  # type: ignore[no-untyped-def]
        positions = part.stamps(4007).position
        spans.append(int(positions[-1] - positions[0]))
        return decode(part, *more, **options)

    monkeypatch.setattr(sbf_stream, "decode_part", watched)
    scan_in_segments(path, CHUNK, 200_000)
    assert len(spans) > 5
    assert max(spans) < 200_000 + 2 * CHUNK


STEPS = st.lists(
    st.tuples(
        st.integers(0, 12), st.sampled_from([4007, 4001, 5906, 4011, 5921, 4008, 5935]),
        st.integers(0, 40_000),
    ),
    max_size=24,
)  # fmt: skip


@settings(max_examples=120)
@given(STEPS, st.booleans(), st.sampled_from([66_000, 120_000, 200_000]))
def test_random_files(
    tmp_path_factory: pytest.TempPathFactory,
    steps: list[tuple[int, int, int]],
    in_order: bool,
    segment_bytes: int,
) -> None:
    """Any order of blocks and times, with any bytes between: the same as read at once."""
    path = tmp_path_factory.mktemp("stream") / "x.sbf"
    if in_order:
        steps = sorted(steps, key=lambda step: step[0])
    parts = []
    for i, (t, number, between) in enumerate(steps):
        tow = 1000 * t
        if number == 4008:
            parts.append(positions_block(tow, {i + 1: (2e7, 1e7, 1e6)}))
        elif number == 5935:
            parts.append(corrections_block(tow, {i + 1: (1.0, 1.0, 1.0, 1.0)}))
        else:
            fields = {4007: {"mode": 1, "height": float(i)}, 4001: {"hpl": float(i)},
                      5906: {"nn": float(i) ** 2}, 4011: {"herl": 1.0}, 5921: {}}  # fmt: skip
            revision = 2 if number == 4007 else 0
            parts.append(block(number, revision, tow_ms=tow, **fields[number]))
        parts.append(filler(between) if between % 3 else NMEA * (between // 4000))
    path.write_bytes(b"".join(parts))
    source = assert_same(path, segment_bytes, streams=None)
    if len(steps) < 4:
        assert isinstance(source, SbfEpochs)
