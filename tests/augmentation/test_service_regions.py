"""Service regions: shapes, priorities, and which set holds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.decoding import decode
from sbas.augmentation.delta_udre import service_factor
from sbas.augmentation.service_regions import region_factor, region_states
from sbas.augmentation.tables import DELTA_UDRE
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc

Region = tuple[int, int, int, int, int]
RECTANGLE: Region = (40, 10, 60, 30, 1)
OUTSIDE, INSIDE = 14, 4


def factor(place: tuple[float, float], *messages: bytes) -> float:
    states = region_states(decode(enc.heard(*enumerate(messages))).service_regions, np.array([]))
    complete = states[-1].complete
    assert complete is not None
    lat, lon = (np.array([value]) for value in place)
    return float(region_factor(complete, states[-1].begun, lat, lon)[0])


def one(*regions: Region, priority: int = 0, inside: int = INSIDE) -> bytes:
    return enc.service(1, 1, 1, priority, inside, OUTSIDE, *regions)


@pytest.mark.parametrize(
    ("place", "inside"),
    [
        ((50, 20), True), ((40, 10), True), ((60, 30), True), ((40, 30), True), ((60, 10), True),
        ((39.99, 20), False), ((60.01, 20), False), ((50, 9.99), False), ((50, 30.01), False),
        ((50, 380), True), ((50, -340), True), ((-50, 20), False), ((50, 200), False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("corners", [(40, 10, 60, 30), (60, 30, 40, 10), (60, 10, 40, 30)])
def test_a_rectangle(
    place: tuple[float, float], inside: bool, corners: tuple[int, int, int, int]
) -> None:
    """Whichever opposite corners are sent."""
    assert factor(place, one((*corners, 1))) == DELTA_UDRE[INSIDE if inside else OUTSIDE]


@given(
    st.tuples(*[st.integers(-40, 40) for _ in range(4)]),
    st.lists(st.floats(-60, 60), min_size=2, max_size=2),
)
def test_a_triangle(corners: tuple[int, int, int, int], place: list[float]) -> None:
    """Against the signs of the areas to its three sides."""
    lat1, lon1, lat2, lon2 = corners
    if lat1 == lat2 or lon1 == lon2:
        return
    points = [(lat1, lon1), (lat2, lon2), (lat1, lon2)]
    areas = []
    for (a, b), (c, d) in zip(points, points[1:] + points[:1], strict=True):
        areas.append((c - a) * (place[1] - b) - (d - b) * (place[0] - a))
    if min(abs(area) for area in areas) < 1e-6:
        return
    inside = all(area > 0 for area in areas) or all(area < 0 for area in areas)
    found = factor((place[0], place[1]), one((*corners, 0)))
    assert found == DELTA_UDRE[INSIDE if inside else OUTSIDE]


@pytest.mark.parametrize(
    ("lon", "inside"),
    [(175, True), (-175, True), (185, True), (160, False), (-160, False), (0, False)],
)
@pytest.mark.parametrize("ends", [(170, -170), (-170, 170)])
def test_a_region_across_the_180th_meridian(
    lon: float, inside: bool, ends: tuple[int, int]
) -> None:
    found = factor((10, lon), one((0, ends[0], 20, ends[1], 1)))
    assert found == DELTA_UDRE[INSIDE if inside else OUTSIDE]


def test_a_triangle_across_the_180th_meridian() -> None:
    """Corners (0, 170), (20, -170) and (0, -170)."""
    message = one((0, 170, 20, -170, 0))
    assert factor((1, -175), message) == DELTA_UDRE[INSIDE]
    assert factor((15, 172), message) == DELTA_UDRE[OUTSIDE]


def test_a_span_of_179_degrees_does_not_wrap() -> None:
    assert factor((10, 0), one((0, -90, 20, 89, 1))) == DELTA_UDRE[INSIDE]
    assert factor((10, 180), one((0, -90, 20, 90, 1))) == DELTA_UDRE[INSIDE]


@pytest.mark.parametrize(
    "region", [(40, 10, 40, 30, 1), (40, 10, 60, 10, 1), (40, -180, 60, 180, 1)]
)
def test_regions_without_width_or_height_are_void(region: Region) -> None:
    assert factor((40, 10), one(region)) == DELTA_UDRE[OUTSIDE]
    assert factor((50, 180), one(region)) == DELTA_UDRE[OUTSIDE]


def test_the_highest_priority_that_holds_the_place_counts_and_of_it_the_smallest() -> None:
    wide: Region = (-80, -170, 80, 0, 1)
    everywhere = enc.service(1, 3, 1, 0, 2, OUTSIDE, wide, (-80, 0, 80, 170, 1))
    around = enc.service(1, 3, 2, 2, 8, OUTSIDE, RECTANGLE)
    beside = enc.service(1, 3, 3, 2, 6, OUTSIDE, (50, 20, 70, 40, 1))
    messages = everywhere, around, beside
    assert factor((45, 15), *messages) == DELTA_UDRE[8]
    assert factor((55, 25), *messages) == DELTA_UDRE[6]
    assert factor((10, 50), *messages) == DELTA_UDRE[2]
    assert factor((85, 50), *messages) == DELTA_UDRE[OUTSIDE]


def test_the_factors_below_2_are_not_rounded() -> None:
    """gLAB 6.0.0 rounds 1.1, 1.25 and 1.5 down to 1, which is unsafe."""
    found = [factor((50, 20), one(RECTANGLE, inside=code)) for code in range(5)]
    assert found == [1, 1.1, 1.25, 1.5, 2]


def over_time(messages: dict[int, bytes], epochs: list[float], seconds: int) -> list[tuple]:  # type: ignore[type-arg]
    line = correction_timeline(enc.hourly(messages, seconds))
    return at_epochs(line, epochs)


def at_epochs(line: CorrectionTimeline, epochs: list[float]) -> list[tuple]:  # type: ignore[type-arg]
    instants = line.reception.instants(enc.epochs_ns(*epochs))
    n = len(epochs)
    found = service_factor(line.regions, instants, np.full(n, 50.0), np.full(n, 20.0))
    return list(zip(*(part.tolist() for part in found), strict=True))


def part(iods: int, number: int, inside: int, *, messages: int = 2, lat: int = 40) -> bytes:
    return enc.service(iods, messages, number, 0, inside, OUTSIDE, (lat, 10, lat + 20, 30, 1))


def test_a_set_counts_once_it_is_complete() -> None:
    messages = {10: part(1, 1, 6), 20: part(1, 1, 6), 30: part(1, 2, 8, lat=-40)}
    found = over_time(messages, [9, 11, 30, 31], 50)
    assert found == [(1, True, False)] * 3 + [(DELTA_UDRE[6], False, False)]


def test_until_a_new_issue_is_complete_the_larger_factor_holds() -> None:
    first = {10: part(1, 1, 6), 20: part(1, 2, 8, lat=-40)}
    larger = first | {30: part(2, 1, 9), 40: part(2, 2, 8, lat=-40)}
    smaller = first | {30: part(2, 1, 2), 40: part(2, 2, 8, lat=-40)}
    beside = first | {30: part(2, 1, 9, lat=-40), 40: part(2, 2, 3)}
    epochs = [21.0, 31.0, 41.0]
    for messages, wanted in ((larger, [6, 9, 9]), (smaller, [6, 6, 2]), (beside, [6, 6, 3])):
        found = over_time(messages, epochs, 60)
        assert [value for value, *_ in found] == [DELTA_UDRE[code] for code in wanted]


def test_outside_both_issues_the_larger_outside_factor_holds() -> None:
    old = enc.service(1, 1, 1, 0, 2, 5, (-40, 10, -20, 30, 1))
    new = enc.service(2, 2, 1, 0, 2, 9, (-40, 10, -20, 30, 1))
    assert [f for f, *_ in over_time({10: old, 20: new}, [11, 21], 30)] == [3, 8]


def test_an_issue_that_stays_incomplete_never_replaces_the_old_one() -> None:
    messages = {10: part(1, 1, 6, messages=1), 20: part(2, 1, 2), 30: part(3, 1, 2, messages=1)}
    assert [f for f, *_ in over_time(messages, [11, 21, 31], 40)] == [4, 4, 1.25]


def test_an_alarm_wipes_regions_out() -> None:
    messages = {10: part(1, 1, 6, messages=1), 20: enc.alarm(), 100: part(1, 1, 6, messages=1)}
    found = over_time(messages, [11, 21, 101], 120)
    assert [(f, incomplete) for f, incomplete, _ in found] == [(4, False), (1, True), (4, False)]
    halves = {10: part(1, 1, 6), 20: enc.alarm(), 100: part(1, 2, 8)}
    assert over_time(halves, [101], 120) == [(1, True, False)]


def test_a_set_expires_a_day_after_its_last_message() -> None:
    frames = ((0, part(1, 1, 6, messages=1)), (100, part(1, 1, 6, messages=1)))
    link = tuple((second, enc.null()) for second in range(86490, 86510))
    line = correction_timeline(enc.heard(*frames, *link))
    found = at_epochs(line, [86500, 86500.12, 86500.13])
    assert found == [(4, False, False), (4, False, False), (1, False, True)]
