"""Which mask is current, which one before it still serves, and whose messages are whose."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.prn_masks import latest_of_slot
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc

A, B, C = (3, 5, 9), (1, 3, 7), (7, 8)


def timeline(*changes: tuple[int, bytes], seconds: int = 1500) -> CorrectionTimeline:
    return correction_timeline(enc.hourly(dict(changes), seconds))


def current_and_previous(line: CorrectionTimeline, *epochs: float) -> list[tuple[int, int]]:
    instants = line.reception.instants(enc.epochs_ns(*epochs))
    current = line.masks.current(instants)
    previous = line.masks.previous(current, instants)
    return list(zip(current.tolist(), previous.tolist(), strict=True))


def test_the_mask_before_serves_until_600_s_after_it_was_last_sent() -> None:
    line = timeline((5, enc.mask(0, A)), (50, enc.mask(0, A)), (100, enc.mask(1, B)))
    assert line.masks.iodp.tolist() == [0, 1]
    found = current_and_previous(line, 5, 6, 101, 650, 650.12, 650.13, 700)
    assert found == [(-1, -1), (0, -1), (1, 0), (1, 0), (1, 0), (1, -1), (1, -1)]


def test_a_mask_that_comes_again_renews_the_time_alone() -> None:
    line = timeline((0, enc.mask(0, A)), (500, enc.mask(0, A)), (900, enc.mask(0, A)))
    assert line.masks.time_s.size == 1
    assert line.contradicted_s.size == 0
    assert line.masks.position_of[0, 9] == 2
    assert line.masks.position_of[0, 7] == -1
    instants = line.reception.instants(enc.epochs_ns(600.13, 1100, 1100.13, 1500, 1500.13))
    assert line.masks.expired(instants).tolist() == [False, False, False, False, True]


@pytest.mark.parametrize("gap_s", [30, 700, 1300])
def test_another_content_under_the_same_issue_voids_what_was_before(gap_s: int) -> None:
    line = timeline((0, enc.mask(0, A)), (gap_s, enc.mask(0, B)))
    assert (line.contradicted_s - enc.START_S).tolist() == [gap_s]
    # Nothing serves in the second in which the message is on its way.
    assert current_and_previous(line, gap_s - 1, gap_s, gap_s + 1) == [(0, -1), (-1, -1), (1, -1)]
    assert line.masks.position_of[1, 7] != line.masks.position_of[0, 7]


def test_an_issue_that_comes_round_within_the_life_of_its_data_is_a_contradiction() -> None:
    line = timeline((0, enc.mask(3, A)), (10, enc.mask(0, B)), (20, enc.mask(3, C)))
    assert current_and_previous(line, 1, 11, 21) == [(0, -1), (1, 0), (2, -1)]
    later = timeline((0, enc.mask(3, A)), (10, enc.mask(0, B)), (971, enc.mask(3, C)))
    assert later.contradicted_s.size == 0


def test_three_issues_follow_each_other() -> None:
    line = timeline((0, enc.mask(3, A)), (10, enc.mask(0, B)), (20, enc.mask(1, C)))
    assert current_and_previous(line, 1, 11, 21) == [(0, -1), (1, 0), (2, 1)]
    assert line.masks.position_of[2, 8] == 1


def test_an_alarm_leaves_no_mask_before() -> None:
    line = timeline(
        (0, enc.mask(0, A)), (10, enc.mask(1, B)), (20, enc.alarm()), (90, enc.mask(1, B)),
        (95, enc.mask(2, C)),
    )  # fmt: skip
    assert current_and_previous(line, 20, 85, 91, 96) == [(1, 0), (-1, -1), (2, -1), (3, 2)]


def test_slow_messages_are_read_by_the_mask_of_their_own_issue() -> None:
    """Slot 3 is first in the old mask and second in the new; slot 9 only in the old one."""
    line = timeline((0, enc.mask(0, A)), (10, enc.mask(1, B)))
    time_s = enc.START_S + np.array([2, 4, 12, 14])
    iodp, position = np.array([0, 0, 1, 1]), np.array([0, 2, 0, 1])
    instants = line.reception.instants(enc.epochs_ns(2, 3, 11, 13, 15))
    for slot, wanted in ((3, [-1, 0, 0, 0, 3]), (9, [-1, -1, 1, 1, 1]), (1, [-1, -1, -1, 2, 2])):
        found = latest_of_slot(line.masks, slot, time_s, iodp, position, instants)
        assert found.tolist() == wanted, slot
    assert latest_of_slot(line.masks, 8, time_s, iodp, position, instants).tolist() == [-1] * 5
