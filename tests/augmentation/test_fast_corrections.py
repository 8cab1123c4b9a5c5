"""Fast corrections at epochs: each rule at its exact second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from sbas.augmentation.fast_corrections import FastAt, Profile
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import correction_timeline
from tests.augmentation import encoding as enc
from tests.augmentation.fast_reference import (
    Alarm,
    Damaged,
    Factors,
    Fast,
    Integrity,
    Mask,
    Message,
    Null,
    Parameters,
)
from tests.augmentation.streams import heard

SLOTS = (3, 5, 9)
PRC = (8, 16, 24)


def filled(stream: dict[int, Message], seconds: int) -> dict[int, Message]:
    """A message a second; null where none is given."""
    return {second: stream.get(second, Null()) for second in range(seconds)}


def corrections(iodf: int, udrei: int = 5, prc: int = 8, *, iodp: int = 2, others: int = 5) -> Fast:
    """Type 2 in which the first satellite (slot 3) has the values."""
    return Fast(iodp, iodf, 0, (prc, *[0] * 12), (udrei, *[others] * 12))


def beginning(ai: int = 9, latency_s: int = 0) -> dict[int, Message]:
    factors = Factors(2, latency_s, (ai,) * 51)
    return {0: Mask(2, SLOTS), 1: factors, 2: Parameters(50)}


def at(
    stream: dict[int, Message], epochs: Sequence[float], mode: Mode = "pa",
    profile: Profile = "mops", slot: int = 3,
) -> FastAt:  # fmt: skip
    timeline = correction_timeline(heard(stream))
    instants = timeline.reception.instants(enc.epochs_ns(*epochs))
    return timeline.fast_corrections(slot, instants, mode=mode, profile=profile)


def reasons(stream: dict[int, Message], epochs: Sequence[float], mode: Mode = "pa") -> list[int]:
    found: list[int] = at(stream, epochs, mode).reason.tolist()
    return found


def test_a_message_counts_once_its_last_bit_and_its_flight_are_over() -> None:
    stream = filled({**beginning(), 4: corrections(0), 10: corrections(1)}, 30)
    found = at(stream, [10.0, 10.11, 10.12, 11.0])
    assert found.reason.tolist() == [20, 20, 0, 0]


@pytest.mark.parametrize(("mode", "limit"), [("pa", 12), ("npa", 18)])
def test_a_udrei_times_out_at_its_exact_second(mode: Mode, limit: int) -> None:
    stream = filled({**beginning(ai=0), 4: corrections(0), 10: corrections(1)}, 60)
    found = reasons(stream, [10 + limit, 10 + limit + 0.12, 10 + limit + 0.13, 11 + limit], mode)
    assert found == [0, 0, 13, 13]


@pytest.mark.parametrize(
    ("mode", "ai", "limit"), [("pa", 9, 30), ("npa", 9, 45), ("pa", 14, 12), ("npa", 11, 27)]
)
def test_a_correction_times_out_at_its_exact_second(mode: Mode, ai: int, limit: int) -> None:
    """Integrity messages of another correction renew the UDREI and not the correction."""
    stream: dict[int, Message] = {**beginning(ai), 4: corrections(0), 10: corrections(1)}
    stream |= {second: Integrity((2, 2, 2, 2), (5,) * 51) for second in range(12, 70, 4)}
    filled_stream = filled(stream, 80)
    epochs = [10 + limit, 10 + limit + 0.12, 10 + limit + 0.13]
    assert reasons(filled_stream, epochs, mode) == [0, 0, 19]


def test_an_integrity_message_of_the_same_correction_renews_it() -> None:
    stream: dict[int, Message] = {**beginning(14), 4: corrections(0), 10: corrections(1)}
    stream |= {20: Integrity((1, 0, 0, 0), (9,) * 51)}
    found = at(filled(stream, 50), [20, 21, 32, 33], "pa")
    assert found.reason.tolist() == [0, 0, 0, 13]
    assert found.udrei.tolist()[:3] == [5, 9, 9]
    # a = 0.0046 m/s2 and the age of the first bit of the message that renewed it.
    np.testing.assert_allclose(found.eps_fc_m[[0, 1]], [0.0023 * 11**2, 0.0023 * 2**2])


@pytest.mark.parametrize(("mode", "limit"), [("pa", 240), ("npa", 360)])
def test_degradation_factors_time_out_at_their_exact_second(mode: Mode, limit: int) -> None:
    stream: dict[int, Message] = beginning(0)
    stream |= {second: corrections(second % 3) for second in range(4, 400, 6)}
    found = reasons(filled(stream, 400), [1 + limit, 1 + limit + 0.12, 1 + limit + 0.13], mode)
    assert found == [0, 0, 18]


@pytest.mark.parametrize("mode", ["pa", "npa"])
def test_a_mask_times_out_at_its_exact_second(mode: Mode) -> None:
    stream: dict[int, Message] = beginning(0)
    stream |= {second: Factors(2, 0, (0,) * 51) for second in range(100, 620, 100)}
    stream |= {second: corrections(second % 3) for second in range(4, 620, 6)}
    found = at(filled(stream, 620), [600, 600.12, 600.13], mode)
    assert found.reason.tolist() == [0, 0, 8]
    assert found.barred.tolist() == [False, False, True]


def test_three_lost_messages_do_nothing_and_four_void_everything() -> None:
    stream = filled({**beginning(), **{s: corrections(s % 3) for s in range(4, 60, 5)}}, 60)
    three = {s: m for s, m in stream.items() if s not in (30, 31, 32)}
    found = at(three, range(29, 40))
    assert found.reason.tolist() == [0] * 11
    # Lost: 30 to 33. The correction of 34 is the first again, that of 39 the second.
    four = {s: m for s, m in stream.items() if s not in (30, 31, 32, 33)}
    found = at(four, [33, 34, 35, 39, 40, 41])
    assert found.reason.tolist() == [0, 60, 20, 20, 0, 0]
    assert found.barred.tolist() == [False, True, False, False, False, False]
    assert at(four, [34, 35], "npa").usable.tolist() == [False, True]


def test_after_a_gap_a_satellite_is_not_monitored_until_a_correction_comes() -> None:
    stream: dict[int, Message] = {**beginning(), 4: corrections(0), 10: corrections(1)}
    stream |= {30: corrections(2)}
    lost = {s: m for s, m in filled(stream, 50).items() if not 12 <= s <= 16}
    found = at(lost, [12, 17, 18, 30, 31], "npa")
    assert found.reason.tolist() == [0, 60, 14, 14, 0]
    assert found.barred.tolist() == [False, True, True, True, False]


def test_four_damaged_messages_in_a_row_void_the_udrei_for_precision_approach_only() -> None:
    stream: dict[int, Message] = filled(
        {**beginning(), **{s: corrections(s % 3) for s in (4, 9, 14, 24)}}, 40
    )
    three = stream | {s: Damaged() for s in (16, 17, 18)}
    four = stream | {s: Damaged() for s in (16, 17, 18, 19)}
    apart = stream | {s: Damaged() for s in (16, 17, 19, 20)}
    epochs = [19, 20, 21, 24, 25]
    assert reasons(three, epochs) == [0] * 5
    assert reasons(apart, epochs) == [0] * 5
    assert reasons(four, epochs) == [0, 13, 13, 13, 0]
    assert reasons(four, epochs, "npa") == [0] * 5


@pytest.mark.parametrize("udrei", [14, 15])
def test_a_satellite_that_is_not_monitored_starts_anew(udrei: int) -> None:
    stream = {**beginning(), 4: corrections(0), 10: corrections(1), 16: corrections(2, udrei),
              22: corrections(0, 13), 28: corrections(1)}  # fmt: skip
    wanted_in: dict[Mode, list[int]] = {"pa": [0, udrei, 16, 0], "npa": [0, udrei, 0, 0]}
    for mode, wanted in wanted_in.items():
        found = at(filled(stream, 40), [16, 17, 23, 29], mode)
        assert found.reason.tolist() == wanted
        assert found.barred.tolist() == [False, True, False, False]
    # The rate after it is formed from corrections since, at 22 and 28.
    assert found.rrc_m[3] == 0.0
    assert at(filled(stream, 40), [23], "pa").udrei.tolist() == [13]


def test_an_integrity_message_bars_a_satellite_at_once() -> None:
    stream: dict[int, Message] = {**beginning(), 4: corrections(0), 10: corrections(1)}
    stream |= {12: Integrity((1, 0, 0, 0), (15,) * 51)}
    assert reasons(filled(stream, 30), [12, 13, 25], "npa") == [0, 15, 15]
    other: dict[int, Message] = stream | {12: Integrity((2, 0, 0, 0), (15,) * 51)}
    assert reasons(filled(other, 30), [12, 13], "npa") == [0, 0], "of another correction"
    alarm: dict[int, Message] = stream | {12: Integrity((3, 0, 0, 0), (15,) * 51)}
    assert reasons(filled(alarm, 30), [12, 13], "npa") == [0, 15], "an alarm is of every correction"


def test_the_rate_and_its_degradation() -> None:
    """PRC 1 m and 2 m, 6 s apart; a = 0.0009 m/s2, B_rrc = 0.1 m, both IODF the same."""
    stream = filled({**beginning(9, 2), 4: corrections(1, prc=8), 10: corrections(1, prc=16)}, 30)
    found = at(stream, [14])
    assert found.rrc_m[0] == pytest.approx(1 / 6 * 5)
    assert found.eps_fc_m[0] == pytest.approx(0.0009 * (5 + 2) ** 2 / 2)
    assert found.eps_rrc_m[0] == pytest.approx((0.0009 * 30 / 4 + 0.1 / 6) * 5)
    in_turn = filled({**beginning(9), 4: corrections(1, prc=8), 10: corrections(2, prc=16)}, 30)
    assert at(in_turn, [14]).eps_rrc_m[0] == 0.0


def test_without_degradation_parameters_there_is_no_rate_term() -> None:
    stream = {**beginning(9), 4: corrections(1), 10: corrections(1)}
    del stream[2]
    found = at(filled(stream, 30), [14], "npa")
    assert found.eps_rrc_m[0] == 0.0
    assert found.usable[0]


def test_a_rate_is_too_old_after_eight_steps() -> None:
    stream: dict[int, Message] = {**beginning(5), 4: corrections(0), 5: corrections(1)}
    stream |= {12: Integrity((1, 1, 1, 1), (5,) * 51)}
    assert reasons(filled(stream, 30), [13, 13.01, 14]) == [0, 24, 24]


def test_corrections_too_far_apart_give_no_rate() -> None:
    stream: dict[int, Message] = {**beginning(14), 4: corrections(0), 17: corrections(1)}
    assert reasons(filled(stream, 30), [18]) == [23]
    stream = {**beginning(14), 4: corrections(0), 16: corrections(1)}
    assert reasons(filled(stream, 30), [17]) == [0]


@pytest.mark.parametrize(
    ("profile", "previous", "dt"), [("mops", 12, 14), ("glab", 16, 10), ("glab", 12, 14)]
)
def test_after_an_alarm_the_rate_is_formed_over_half_a_time_out(
    profile: Profile, previous: int, dt: int
) -> None:
    """I_fc = 30 s: the correction nearest to 15 s before; gLAB: the oldest younger than that."""
    times = {6: 1, 12: 2, 16: 5, 20: 7, 26: 9}
    if profile == "glab" and previous == 16:
        del times[12]
    stream: dict[int, Message] = beginning(9)
    for k, (second, prc) in enumerate(times.items()):
        stream[second] = corrections(3 if second == 26 else k % 3, prc=8 * prc)
    found = at(filled(stream, 40), [28], profile=profile)
    assert found.rrc_m[0] == pytest.approx((9 - times[previous]) / dt * 3)
    b, a = 0.1, 0.0009
    assert found.eps_rrc_m[0] == pytest.approx((a * abs(dt - 15) / 2 + b / dt) * 3)


def test_an_alarm_without_a_correction_in_time_has_no_rate_in_glab() -> None:
    stream: dict[int, Message] = {**beginning(14), 4: corrections(0), 24: corrections(3, prc=80)}
    assert at(filled(stream, 40), [25], profile="glab").rrc_m[0] == 0.0
    assert at(filled(stream, 40), [25], profile="glab").usable[0]
    assert at(filled(stream, 40), [25], profile="mops").reason[0] == 21


@pytest.mark.parametrize(
    ("satellites", "quick", "mops", "glab"),
    [(14, 0, 23, 23), (14, 13, 0, 0), (15, 13, 0, 23), (15, 14, 0, 0), (14, 12, 23, 23)],
)
def test_the_shortest_time_out_is_that_of_the_same_message(
    satellites: int, quick: int, mops: int, glab: int
) -> None:
    """One satellite has I_fc = 12 s, less than the 14 s between corrections of slot 5; the others
    30 s. gLAB takes the shortest of the mask but leaves the last satellite out."""
    ai = tuple(14 if position == quick else 9 for position in range(51))
    slots = tuple(range(1, satellites + 1))
    stream: dict[int, Message] = {0: Mask(2, slots), 1: Factors(2, 0, ai)}
    stream |= {4: corrections(0), 18: corrections(1)}
    assert at(filled(stream, 30), [19], slot=5).reason[0] == mops
    assert at(filled(stream, 30), [19], profile="glab", slot=5).reason[0] == glab


def test_a_change_of_mask_keeps_the_old_corrections_until_new_ones_come() -> None:
    new = Fast(3, 0, 0, (80,) * 13, (9,) * 13)
    stream: dict[int, Message] = {**beginning(9), 4: corrections(0), 10: corrections(1)}
    stream |= {14: Mask(3, (1, 3, 7)), 16: new, 20: Factors(3, 0, (9,) * 51)}
    stream |= {22: Fast(3, 1, 0, (88,) * 13, (9,) * 13)}
    found = at(filled(stream, 40), [15, 17, 21, 23], "npa")
    assert found.reason.tolist() == [0, 17, 0, 0]
    assert found.iodp.tolist() == [2, 3, 3, 3]
    assert found.position.tolist() == [0, 1, 1, 1]
    assert found.prc_m[[0, 2, 3]].tolist() == [1.0, 10.0, 11.0]
    # Slot 5 is only in the old mask: its last correction serves until its UDREI is too old.
    dropped = at(filled(stream, 40), [15, 17, 22, 29, 30], "npa", slot=5)
    assert dropped.reason.tolist() == [0, 0, 0, 13, 13]
    # Slot 7 is only in the new one.
    assert at(filled(stream, 40), [15, 17, 23], "npa", slot=7).reason.tolist() == [12, 17, 0]


def test_the_old_mask_ends_600_s_after_it_was_last_sent() -> None:
    stream: dict[int, Message] = {**beginning(9), 4: corrections(0), 14: Mask(3, (1, 3, 7))}
    stream |= {s: Mask(3, (1, 3, 7)) for s in (300, 590)}
    found = at(filled(stream, 620), [600, 600.12, 600.13], "npa", slot=5)
    assert found.reason.tolist() == [13, 13, 9]
    assert found.barred.tolist() == [False, False, True]


@pytest.mark.parametrize("later", [30, 60])
def test_an_alarm_wipes_out_everything_and_bars_for_a_minute(later: int) -> None:
    """A second alarm within the minute begins it anew."""
    again: dict[int, Message] = {}
    for start in (0, 100, 170):
        again |= {start + s: m for s, m in {**beginning(), 4: corrections(0)}.items()}
        again |= {start + s: corrections(s % 3) for s in (8, 12, 16)}
    first = filled({**again, 20: Alarm()}, 240)
    assert reasons(first, [20, 21, 80, 81, 82, 100, 101]) == [0, 60, 60, 60, 7, 7, 12]
    assert reasons(first, [105, 109]) == [20, 0]
    twice = filled({**again, 20: Alarm(), 20 + later: Alarm()}, 240)
    assert reasons(twice, [81, 20 + later + 61, 20 + later + 62]) == [60, 60, 7]


def test_corrections_in_alarms_of_a_test_signal() -> None:
    frames = {0: enc.mask(2, SLOTS), 1: enc.fast_degradation(2, 0, [9] * 51)}
    for second, iodf in ((4, 0), (10, 1)):
        frames[second] = enc.fast(0, iodf, 2, [8] * 13, [5] * 13)
    messages = enc.hourly(frames, 30)
    assert correction_timeline(messages).alarms_ignored == 0
    timeline = correction_timeline(messages, alarms="as_mt2")
    instants = timeline.reception.instants(enc.epochs_ns(5, 11))
    found = timeline.fast_corrections(3, instants, mode="pa", profile="mops")
    assert found.reason.tolist() == [20, 0]
    assert timeline.alarms_ignored == 2
    ignored = correction_timeline(messages, alarms="ignore")
    instants = ignored.reception.instants(enc.epochs_ns(5, 11))
    found = ignored.fast_corrections(3, instants, mode="pa", profile="mops")
    assert found.reason.tolist() == [12, 12]
    assert ignored.alarms_ignored == 2


def test_an_empty_alarm_is_one_even_for_a_test_signal() -> None:
    frames = {0: enc.mask(2, SLOTS), 5: enc.alarm()}
    timeline = correction_timeline(enc.hourly(frames, 30), alarms="as_mt2")
    instants = timeline.reception.instants(enc.epochs_ns(5, 6))
    found = timeline.fast_corrections(3, instants, mode="pa", profile="mops")
    assert found.reason.tolist() == [12, 60]
    assert timeline.alarms_ignored == 0
