"""Gaps, damage and alarms of the link."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.reception import NEVER, AlarmRule, Reception, receive
from tests.augmentation import encoding as enc


def link(messages: SbasMessages, alarms: AlarmRule = "alarm") -> Reception:
    return receive(messages, alarms=alarms, flight_time_s=0.12)[1]


def seconds(*chosen: int) -> SbasMessages:
    return enc.heard(*((second, enc.null()) for second in chosen))


def lost(messages: SbasMessages, *epochs: float) -> list[bool]:
    reception = link(messages)
    found: list[bool] = reception.lost(reception.instants(enc.epochs_ns(*epochs))).tolist()
    return found


def test_lost_messages_are_counted_from_the_last_bit_and_the_flight() -> None:
    """floor(t - T - 0.12) messages are missing; four are too many."""
    assert lost(seconds(0, 6), 4, 4.11, 4.12, 5, 6, 6.11, 6.12) == [
        False, False, True, True, True, True, False,
    ]  # fmt: skip
    assert lost(seconds(0), -1, 0, 0.11, 0.12, 1) == [True, True, True, False, False]


@pytest.mark.parametrize(("next_second", "voids"), [(3, False), (4, False), (5, True), (6, True)])
def test_a_gap_of_four_messages_begins_a_session(next_second: int, voids: bool) -> None:
    reception = link(seconds(0, next_second, next_second + 1))
    assert reception.session_s.tolist() == ([enc.START_S + next_second] if voids else [])


def test_a_damaged_message_keeps_the_link_alive() -> None:
    messages = seconds(0, 4, 8)
    damaged = SbasMessages(
        **{**vars(messages), "bad_time_s": np.array([enc.START_S + 2, enc.START_S + 6])}
    )
    assert not link(damaged).session_s.size
    assert lost(damaged, 4.5, 6.5, 9.0) == [False] * 3


def test_nothing_heard_is_lost() -> None:
    assert lost(seconds(100), 0, 50) == [True, True]


def test_rows_of_damage() -> None:
    messages = seconds(0, 10, 20)
    bad = np.array([1, 2, 3, 11, 12, 13, 13, 14, 15, 21, 22, 23]) + enc.START_S
    reception = link(SbasMessages(**{**vars(messages), "bad_time_s": bad}))
    assert (reception.damaged_s - enc.START_S).tolist() == [14, 15]
    second = enc.START_S + np.array([13, 14, 15, 99])
    void = reception.void_before_s(second)
    assert void[0] == NEVER
    assert (void[1:] - enc.START_S).tolist() == [14, 15, 15]


def test_every_alarm_bars_for_a_minute() -> None:
    messages = enc.hourly({10: enc.alarm(), 50: enc.fast(0, 0, 0, [0] * 13, [1] * 13)}, 200)
    kept, reception = receive(messages, alarms="alarm", flight_time_s=0.12)
    assert (kept.time_s - enc.START_S).tolist() == [*range(10), *range(111, 200)]
    assert (reception.alarm_s - enc.START_S).tolist() == [10, 50]
    assert not reception.session_s.size, "the link was alive"
    instants = reception.instants(enc.epochs_ns(10, 11, 70, 110, 111, 112))
    assert reception.lost(instants).tolist() == [False, True, True, True, True, False]
    assert (instants.since_s[1:] - enc.START_S).tolist() == [10, 50, 50, 50, 50]


@pytest.mark.parametrize(
    ("rule", "alarms"), [("alarm", [10, 50]), ("as_mt2", [10]), ("ignore", [])]
)
def test_what_type_0_means(rule: AlarmRule, alarms: list[int]) -> None:
    messages = enc.hourly({10: enc.alarm(), 50: enc.fast(0, 0, 0, [0] * 13, [1] * 13)}, 120)
    kept, reception = receive(messages, alarms=rule, flight_time_s=0.12)
    assert (reception.alarm_s - enc.START_S).tolist() == alarms
    type_0 = kept.time_s[kept.kind == 0] - enc.START_S
    assert type_0.tolist() == []
    content = receive(messages.of_prn(enc.PRN), alarms="as_mt2", flight_time_s=0.12)[0]
    assert 50 not in content.time_s - enc.START_S, "within the minute of the empty one"


def test_a_type_0_with_content_is_kept_as_type_2() -> None:
    messages = enc.hourly({50: enc.fast(0, 0, 0, [0] * 13, [1] * 13)}, 60)
    kept, reception = receive(messages, alarms="as_mt2", flight_time_s=0.12)
    assert kept.kind.tolist() == messages.kind.tolist()
    assert not reception.alarm_s.size


def test_ages_and_time_outs_are_exact() -> None:
    """At 12.12 s after the stamp a message of 12 s holds; a nanosecond later it does not."""
    reception = link(seconds(0))
    exact = enc.epochs_ns(12.12)
    instants = reception.instants(np.concatenate([exact, exact + 1]))
    stamp = np.full(2, enc.START_S)
    assert instants.expired(stamp, 12).tolist() == [False, True]
    assert instants.age_s(stamp)[0] == 12.12
