"""Issues of the ionospheric mask, and delays that come before it or after it changed."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.grid_points import BAND_POINTS
from sbas.augmentation.ionospheric_grid import points_at_epochs, points_in_mask
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc

BAND = 3


def mask(iodi: int, *points: int, band: int = BAND) -> bytes:
    return enc.iono_mask(1, band, iodi, points)


def delays(iodi: int, *raw: int, band: int = BAND, block: int = 0) -> bytes:
    filled = [*raw, *[0] * (15 - len(raw))]
    return enc.iono_delays(band, block, iodi, filled, [4] * 15)


def timeline(messages: dict[int, bytes], seconds: int = 300) -> CorrectionTimeline:
    return correction_timeline(enc.hourly(messages, seconds))


def raw_at(
    line: CorrectionTimeline, number: int, *epochs: float, needs_data: bool = False,
    band: int = BAND,
) -> list[float | None]:  # fmt: skip
    """Raw delay of a point; None where it is not in the mask, -1 where it has no delay."""
    instants = line.reception.instants(enc.epochs_ns(*epochs))
    n = len(epochs)
    point = np.full((n, 1), band * BAND_POINTS + number - 1)
    inside = points_in_mask(line.grid, point, instants, needs_data=needs_data)
    degradation = line.degradation(instants, mode="pa")
    found = points_at_epochs(line.grid, point, inside, instants, degradation)
    value = np.where(np.isnan(found.delay_m), -0.125, found.delay_m)[:, 0] / 0.125
    return [float(v) if i else None for v, i in zip(value, inside[:, 0], strict=True)]


def test_delays_are_of_the_points_that_the_mask_names() -> None:
    line = timeline({0: mask(1, 5, 9, 200), 1: delays(1, 10, 20, 30)})
    assert [raw_at(line, n, 5)[0] for n in (5, 9, 200, 6)] == [10, 20, 30, None]


def test_the_second_block_begins_with_the_sixteenth_point_of_the_mask() -> None:
    points = list(range(2, 40, 2))
    line = timeline({0: mask(1, *points), 1: delays(1, 7, block=1), 2: delays(1, *range(100, 115))})
    assert raw_at(line, points[15], 5) == [7]
    assert raw_at(line, points[14], 5) == [114]
    assert raw_at(line, points[16], 5) == [0]


@pytest.mark.parametrize("needs_data", [False, True])
def test_delays_before_their_mask_wait_for_it(needs_data: bool) -> None:
    """And then hold with their own stamp, which times out 600 s after they were sent."""
    line = timeline({1: delays(1, 10), 2: delays(1, 11), 50: mask(1, 5)}, 700)
    found = raw_at(line, 5, 49, 51, 602.12, 602.13, needs_data=needs_data)
    assert found == [None, 11, 11, -1]


def test_delays_of_a_band_whose_mask_is_not_there_yet_wait_too() -> None:
    line = timeline({0: mask(1, 5), 1: delays(1, 10, band=4), 5: mask(1, 5, band=4)})
    assert raw_at(line, 5, 5, 6, band=4) == [None, 10]


def test_a_new_issue_keeps_delays_until_they_are_replaced() -> None:
    """Point 5 is second in the new mask; point 9 is not in it."""
    line = timeline(
        {0: mask(1, 5, 9), 1: delays(1, 10, 20), 50: mask(2, 3, 5), 60: delays(2, 30, 40)}
    )
    assert raw_at(line, 5, 49, 51, 61) == [10, 10, 40]
    assert raw_at(line, 9, 49, 51, 61) == [20, None, None]
    assert raw_at(line, 9, 49, 51, 61, needs_data=True) == [20, 20, 20]
    assert raw_at(line, 3, 49, 51, 61) == [None, -1, 30]
    assert raw_at(line, 3, 49, 51, 61, needs_data=True) == [None, None, 30]


def test_delays_of_the_issue_before_are_read_by_its_own_mask() -> None:
    line = timeline({0: mask(1, 5, 9), 50: mask(2, 3, 5), 60: delays(1, 10, 20)})
    assert raw_at(line, 5, 59, 61) == [-1, 10]
    assert raw_at(line, 3, 61) == [-1]


def test_delays_of_an_issue_to_come_wait_for_its_mask() -> None:
    line = timeline(
        {0: mask(1, 5, 9), 1: delays(1, 10, 20), 40: delays(2, 30, 40), 50: mask(2, 3, 5)}
    )
    assert raw_at(line, 5, 49, 51) == [10, 40]
    assert raw_at(line, 3, 49, 51) == [None, 30]


def test_two_new_issues_leave_nothing_of_the_first() -> None:
    line = timeline({0: mask(1, 5), 1: delays(1, 10), 50: mask(2, 5), 60: mask(3, 5)})
    for needs_data, wanted in ((False, [10, 10, -1]), (True, [10, 10, None])):
        assert raw_at(line, 5, 49, 51, 61, needs_data=needs_data) == wanted


def test_a_band_of_the_old_issue_serves_until_its_own_new_mask_comes() -> None:
    line = timeline(
        {0: mask(1, 5), 1: mask(1, 5, band=4), 2: delays(1, 10, band=4), 50: mask(2, 5),
         60: mask(2, 7, band=4)}
    )  # fmt: skip
    assert raw_at(line, 5, 51, 59, 61, band=4) == [10, 10, None]


def test_another_content_under_the_same_issue_voids_what_was_before() -> None:
    line = timeline({0: mask(1, 5), 1: delays(1, 10), 50: mask(1, 6), 60: delays(1, 20)})
    assert raw_at(line, 5, 49, 61) == [10, None]
    assert raw_at(line, 6, 61) == [20]
    assert line.contradicted_s.size == 1


@pytest.mark.parametrize("needs_data", [False, True])
def test_an_alarm_wipes_out_masks_delays_and_what_waits(needs_data: bool) -> None:
    line = timeline(
        {0: mask(1, 5), 1: delays(1, 10), 2: delays(2, 12), 20: enc.alarm(), 100: mask(2, 5)}
    )
    before = None if needs_data else -1
    assert raw_at(line, 5, 20, 90, 101, needs_data=needs_data) == [10, None, before]


def test_bands_that_do_not_exist_are_ignored() -> None:
    line = timeline({0: mask(1, 5, band=12), 1: delays(1, 10, band=12), 2: mask(1, 5)})
    assert raw_at(line, 5, 5) == [-1]
