"""Messages checked: CRC, preamble, type, band, order and repetition."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from sbas.augmentation.messages import SbasMessages, checked_messages
from tests.augmentation import encoding as enc

DAMAGED = ("crc", "preamble", "kind", "contradicting")


def check(
    *records: tuple[int, int, bytes],
    has_crc: bool = True,
    stated: list[int] | None = None,
    l5: list[bool] | None = None,
    crc_bad: list[bool] | None = None,
) -> SbasMessages:
    n = len(records)
    return checked_messages(
        np.array([time for time, _, _ in records], np.int64),
        np.array([prn for _, prn, _ in records], np.int64),
        np.frombuffer(b"".join(data for *_, data in records), np.uint8).reshape(n, 32),
        has_crc=np.full(n, has_crc),
        stated_kind=None if stated is None else np.array(stated),
        l5=None if l5 is None else np.array(l5),
        crc_bad=None if crc_bad is None else np.array(crc_bad),
    )


def turned(data: bytes, bit: int) -> bytes:
    return (int.from_bytes(data, "big") ^ 1 << (255 - bit)).to_bytes(32, "big")


def l5_frame(kind: int, preamble: int = 0x5) -> bytes:
    """Four bits of preamble, six of type, with a valid CRC."""
    return enc.frame(0, [(0, 4, preamble), (4, 6, kind), (10, 4, 0)], preamble=0)


def codes(found: SbasMessages) -> list[tuple[str, str]]:
    return [(finding.code, finding.severity) for finding in found.findings]


@pytest.mark.parametrize("preamble", enc.PREAMBLES)
def test_the_three_preambles_are_good(preamble: int) -> None:
    found = check((10, 131, enc.frame(63, preamble=preamble)))
    assert found.time_s.tolist() == [10]
    assert found.kind.tolist() == [63]
    assert not found.findings
    assert found.crc_checked.all()


@pytest.mark.parametrize("bit", [14, 100, 225, 226, 249])
def test_a_turned_bit_fails_the_crc(bit: int) -> None:
    found = check((10, 131, enc.null()), (11, 131, turned(enc.null(), bit)))
    assert found.time_s.tolist() == [10]
    assert found.left_out == {(131, "crc"): 1}
    assert found.bad_time_s.tolist() == [11]
    assert codes(found) == [("E24", "warning")]


def test_padding_does_not_matter() -> None:
    assert len(check((10, 131, turned(enc.null(), 252)))) == 1


def test_without_a_crc_there_is_none_to_check() -> None:
    found = check((10, 131, turned(enc.null(), 100)), has_crc=False)
    assert not found.crc_checked[0]
    assert len(found) == 1


def test_a_receivers_word_on_the_crc_counts() -> None:
    found = check((10, 131, enc.null()), (11, 131, enc.null()), crc_bad=[True, False])
    assert found.left_out == {(131, "crc"): 1}
    assert found.time_s.tolist() == [11]


def test_a_wrong_preamble_and_a_wrong_type_are_left_out() -> None:
    found = check(
        (10, 131, enc.frame(63, preamble=0x54)), (11, 131, enc.null()), (12, 131, enc.null()),
        stated=[63, 62, 63],
    )  # fmt: skip
    assert found.left_out == {(131, "preamble"): 1, (131, "kind"): 1}
    assert found.bad_time_s.tolist() == [10, 11]
    assert found.time_s.tolist() == [12]


L5_KINDS, L5_PREAMBLES = (31, 32, 34, 35, 37, 39, 40, 42, 47, 63), (0x5, 0xC, 0x6, 0x9, 0x3, 0xA)
UNTOLD = {(40, 0x9), (42, 0x9)}


@pytest.mark.parametrize(
    ("kind", "preamble", "states"),
    [
        (kind, preamble, states)
        for kind, preamble, states in product(L5_KINDS, L5_PREAMBLES, (True, False))
        if states or (kind, preamble) not in UNTOLD
    ],
)
def test_messages_of_l5_are_told_from_those_of_l1(kind: int, preamble: int, states: bool) -> None:
    """With the type beside the bits, or with a CRC, and they never count as damage.

    Without both the first eight bits of types 40 and 42 can be an L1 preamble: such sources must
    not mix bands.
    """
    found = check(
        (10, 131, l5_frame(kind, preamble)), (10, 131, enc.null()),
        has_crc=not states, stated=[kind, 63] if states else None,
    )  # fmt: skip
    assert found.left_out == {(131, "l5"): 1}
    assert found.kind.tolist() == [63]
    assert found.bad_time_s.size == 0
    assert codes(found) == [("E24", "info")]


def test_a_stated_band_counts() -> None:
    found = check((10, 131, enc.null()), (11, 131, enc.null()), l5=[True, False])
    assert found.left_out == {(131, "l5"): 1}


@pytest.mark.parametrize("prn", [-1, 33, 119, 159, 193])
def test_other_satellites_are_left_out(prn: int) -> None:
    found = check((10, prn, enc.null()), (10, 120, enc.null()), (10, 158, enc.null()))
    assert found.prns == (120, 158)
    assert found.left_out == {(prn, "prn"): 1}
    assert found.bad_time_s.size == 0


def test_what_comes_twice_is_kept_once() -> None:
    found = check((10, 131, enc.null()), (11, 131, enc.null()), (10, 131, enc.null()))
    assert found.time_s.tolist() == [10, 11]
    assert found.left_out == {(131, "repeated"): 1}


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 1, 0)])
def test_what_contradicts_is_rejected_whole(order: tuple[int, ...]) -> None:
    same, other = (10, 131, enc.null()), (10, 131, enc.frame(62))
    records = (same, other, same)
    found = check(*(records[i] for i in order), (11, 131, enc.null()), (10, 132, enc.null()))
    assert list(zip(found.time_s.tolist(), found.prn.tolist(), strict=True)) == [
        (10, 132),
        (11, 131),
    ]
    assert found.left_out == {(131, "contradicting"): 3}
    assert ("E24", "warning") in codes(found)


def test_messages_are_sorted_with_a_warning() -> None:
    found = check((12, 131, enc.null()), (10, 131, enc.null()), (11, 131, enc.frame(62)))
    assert found.time_s.tolist() == [10, 11, 12]
    assert found.kind.tolist() == [63, 62, 63]
    assert codes(found) == [("E14", "warning")]


def test_satellites_one_after_the_other_are_in_order() -> None:
    found = check((10, 137, enc.null()), (11, 137, enc.null()), (10, 129, enc.null()))
    assert found.prn.tolist() == [129, 137, 137]
    assert not found.findings


def test_the_messages_of_one_satellite() -> None:
    found = check(
        (10, 131, enc.null()), (11, 131, turned(enc.null(), 9)), (11, 132, turned(enc.null(), 99))
    ).of_prn(131)
    assert found.prns == (131,)
    assert found.bad_time_s.tolist() == [11], "the type turned into one of L5, but it is damage"
    assert set(found.left_out) == {(131, "crc")}


def test_no_message_at_all() -> None:
    found = checked_messages(
        np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 32), np.uint8),
        has_crc=np.empty(0, bool), unreadable=3,
    )  # fmt: skip
    assert len(found) == 0
    assert found.left_out == {(0, "unreadable"): 3}


@pytest.mark.parametrize(
    ("offset", "warns"), [(18, True), (-18, True), (3, True), (2, False), (0, False)]
)
def test_stamps_that_are_not_gps_time_are_told_by_type_12(offset: int, warns: bool) -> None:
    """GPS 1,200,000,000 s is 76,800 s into its week; UTC stamps lie 18 s before it."""
    records = []
    for second in (0, 300, 600):
        tow = (enc.START_S + second) % 604800
        records.append((second - offset, enc.network_time(tow=tow)))
    found = enc.heard(*records)
    assert [f.code for f in found.findings] == (["E02"] if warns else [])


def test_times_of_type_12_that_jump_say_nothing_and_the_week_may_turn() -> None:
    first = -(enc.START_S % 604800)
    turn = [(first + s, enc.network_time(tow=(s - 1) % 604800)) for s in (0, 1, 2)]
    assert not enc.heard(*turn).findings
    jumps = [(s, enc.network_time(tow=(enc.START_S + s + 100 * s) % 604800)) for s in (1, 2, 3)]
    assert not enc.heard(*jumps).findings
    beyond = [(0, enc.network_time(tow=604800)), (1, enc.network_time(tow=1 << 19))]
    assert {f.code for f in enc.heard(*beyond).findings} <= {"E02"}
