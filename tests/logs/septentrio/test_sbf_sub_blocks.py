"""Sub-blocks against a plain loop over the bytes, and blocks whose lengths do not add up."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.logs.septentrio.sbf_framing import frame
from sbas.logs.septentrio.sbf_sub_blocks import read_sub_blocks
from sbas.logs.septentrio.septentrio_sbf import read
from tests.logs.septentrio.sbf_samples import (
    corrections_block,
    positions_block,
    reference_blocks,
    residuals_block,
    signal,
    with_sub_blocks,
)

FIRST = {4008: 16, 4009: 20, 5935: 16}


def read_all(number: int, data: bytes):  # type: ignore[no-untyped-def]
    groups = [g for g in frame(np.frombuffer(data, np.uint8)).groups if g.number == number]
    return read_sub_blocks(number, groups)


def plain_loop(number: int, block: bytes) -> list[tuple] | None:  # type: ignore[type-arg]
    """Sub-blocks of one block, byte by byte; None where they do not add up to its length."""
    count, size, size_2 = block[14], block[15], block[16] if len(block) > 16 else 0
    least = {4008: 28, 4009: 6, 5935: 48}[number]
    if len(block) < FIRST[number] or (count and size < least):
        return None
    at, found = FIRST[number], []
    for _ in range(count):
        if at + size > len(block):
            return None
        part = block[at : at + size]
        if number == 4008:
            found.append((part[0], *struct.unpack_from("<ddd", part, 4)))
        elif number == 5935:
            full = size >= 64
            found.append((part[0], *(struct.unpack_from("<4f", part, 48) if full else ())))
        else:
            following = sum(bool(part[5] & bit) for bit in (4, 8, 16))
            if following and size_2 < 8:
                return None
            behind = block[at + size : at + size + following * size_2]
            if len(behind) < following * size_2:
                return None
            code = struct.unpack_from("<fHH", behind) if part[5] & 4 else None
            found.append((part[0], part[2], part[5], code))
            at += len(behind)
        at += size
    return found if len(block) - at < 4 else None


TRIPLES = st.one_of(
    st.none(),
    st.tuples(st.floats(width=32, allow_nan=False), st.integers(0, 65535), st.integers(0, 65535)),
)
SVIDS = st.integers(0, 255)
SIGNALS = st.lists(
    st.builds(
        lambda svid, number, antenna, code, phase, doppler: (
            svid, {"signal": number, "antenna": antenna, "code": code, "phase": phase,
                   "doppler": doppler}),
        SVIDS, st.integers(0, 31), st.integers(0, 2), TRIPLES, TRIPLES, TRIPLES,
    ),
    max_size=6,
)  # fmt: skip
XYZ = st.tuples(*[st.floats(allow_nan=False)] * 3)
VARIANCES = st.tuples(*[st.floats(width=32, allow_nan=False)] * 4)
BLOCKS = {
    4008: st.builds(
        lambda rows, size: positions_block(0, rows, size=size),
        st.dictionaries(SVIDS, XYZ, max_size=5), st.sampled_from([28, 40, 41, 48, 52]),
    ),
    5935: st.builds(
        lambda rows, size: corrections_block(0, rows, size=size),
        st.dictionaries(SVIDS, VARIANCES, max_size=5), st.sampled_from([48, 60, 64, 65, 80]),
    ),
    4009: st.builds(
        lambda signals, sizes: residuals_block(
            0, *(signal(svid, sizes=sizes, **fields) for svid, fields in signals), sizes=sizes
        ),
        SIGNALS, st.sampled_from([(12, 8), (13, 8), (16, 12)]),
    ),
}  # fmt: skip


@pytest.mark.parametrize("number", sorted(BLOCKS))
@settings(max_examples=80)
@given(data=st.data())
def test_sub_blocks_equal_those_of_a_plain_loop(number: int, data: st.DataObject) -> None:
    """Good blocks, and blocks of the same number whose bytes are of any kind, or too few."""
    hostile = st.builds(
        lambda head, body: with_sub_blocks(number, 0, bytes(head), body),
        st.tuples(st.integers(0, 4), st.sampled_from([0, 6, 12, 28, 48, 64]),
                  st.sampled_from([0, 7, 8])),
        st.binary(max_size=120),
    )  # fmt: skip
    short = st.builds(lambda head: with_sub_blocks(number, 0, head), st.binary(max_size=4))
    blocks = data.draw(st.lists(st.one_of(BLOCKS[number], hostile, short), min_size=1, max_size=6))
    found, untimed, unfit = read_all(number, b"".join(blocks))
    expected = [plain_loop(number, block) for block in blocks]
    good = [rows for rows in expected if rows is not None]
    assert (untimed, unfit) == (0, len(blocks) - len(good))
    assert found.count.tolist() == [len(rows) for rows in good]
    assert found.blocks["position"].tolist() == [
        at for (at, _, _), rows in zip(reference_blocks(b"".join(blocks)), expected, strict=True)
        if rows is not None
    ]  # fmt: skip
    flat = [row for rows in good for row in rows]
    assert found.rows["svid"].tolist() == [row[0] for row in flat]
    for i, row in enumerate(flat):
        if number == 4008:
            assert found.rows["xyz"][i].tobytes() == struct.pack("<ddd", *row[1:])
        elif number == 5935:
            assert bool(found.rows["with_variances"][i]) == (len(row) == 5)
            if len(row) == 5:
                assert found.rows["variances"][i].tobytes() == struct.pack("<4f", *row[1:])
        else:
            assert (found.rows["signal"][i], found.rows["info"][i]) == row[1:3]
            code = row[3] or (np.float32(-2e10), 65535, 65535)
            got = struct.pack("<fHH", *(found.rows[name][i] for name in ("residual", "w", "mdb")))
            assert got == struct.pack("<fHH", *code)


def test_residuals_begin_behind_three_reserved_bytes() -> None:
    """A reading that starts at byte 17 (crate sbf-tools 0.3.0) would see SVID 0 and no residual."""
    data = residuals_block(0, signal(24, code=(1.5, 2500, 40), doppler=(0.25, 0, 0)))
    found, _, unfit = read_all(4009, data)
    assert data[17:21] == bytes([0, 0, 0, 24])
    assert (found.rows["svid"].tolist(), found.rows["residual"].tolist()) == ([24], [1.5])
    assert unfit == 0


@pytest.mark.parametrize("more", [4, 8])
def test_a_block_longer_than_its_sub_blocks_does_not_fit(more: int) -> None:
    row = struct.pack("<BBHddd", 5, 0, 0, 1.0, 2.0, 3.0).ljust(40, b"\0")
    data = with_sub_blocks(4008, 0, bytes([1, 40]), row, bytes(more))
    assert read_all(4008, data)[2] == 1


def test_blocks_of_no_satellite_fit() -> None:
    empty = [with_sub_blocks(4008, 0, bytes([0, 0])), with_sub_blocks(5935, 0, bytes([0, 64])),
             residuals_block(0)]  # fmt: skip
    for number, data in zip((4008, 5935, 4009), empty, strict=True):
        found, untimed, unfit = read_all(number, data)
        assert (found.count.tolist(), untimed, unfit) == ([0], 0, 0)


def test_what_does_not_fit_is_counted_by_block(tmp_path: Path) -> None:
    path = tmp_path / "x.sbf"
    good = positions_block(0, {5: (2e7, 0.0, 1e7)})
    bad = with_sub_blocks(4008, 0, bytes([2, 48]), bytes(48))
    late = with_sub_blocks(4009, 4294967295, bytes([0, 12, 8, 0, 0, 0]))
    path.write_bytes(bad + good + bad + late + with_sub_blocks(5935, 0, bytes([1, 20]), bytes(20)))
    r = read(path)
    found = next(f for f in r.meta.findings if "add up" in f.message)
    assert (found.code, found.severity) == ("E10", "warning")
    assert found.evidence == "1 GEOCorrections, 2 PVTSatCartesian"
    assert (
        "1 PVTResiduals" in next(f for f in r.meta.findings if "usable time" in f.message).evidence
    )
    assert len(r.side_tables["satellites"]) == 1
