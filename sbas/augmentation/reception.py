"""When messages of one satellite were heard: gaps, damage and alarms, over time.

Source: RTCA DO-229D, 2.1.1.3 and J.2.2; gLAB 6.0.0 for the count of lost messages.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import DATA_BITS, bits_of
from sbas.augmentation.messages import SbasMessages
from sbas.timescales import NS_PER_S

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

AlarmRule = Literal["alarm", "as_mt2", "ignore"]
"""What a message of type 0 means: an alarm, a type 2 of a test signal, or nothing."""

MOST_LOST = 4
"""From so many messages lost in a row no solution is formed and fast corrections are void."""
MOST_DAMAGED = 4
"""From so many damaged messages in a row all UDREI are void for precision approach."""
ALARM_S = 60
"""For so long an alarm bars its satellite."""
NEVER = np.int64(-(1 << 62))


@dataclass(frozen=True, eq=False)
class Instants:
    """Epochs as the messages see them.

    Parameters
    ----------
    time_ns : (n,) nanoseconds since the GPS epoch.
    second : (n,) the last second whose message can be used: the last bit, and the flight of the
        signal, lie before the epoch.
    since_s : (n,) only messages after this second count: an alarm wiped out all before it.
    """

    time_ns: Ints
    second: Ints
    since_s: Ints
    flight_time_ns: int

    def age_s(self, stamp_s: Ints) -> Floats:
        """(n,) age of the last bit of (n,) messages [s]."""
        age: Floats = (self.time_ns - stamp_s * NS_PER_S) / NS_PER_S
        return age

    def expired(self, stamp_s: Ints, timeout_s: Floats | float) -> Bools:
        """(n,) True where messages of (n,) stamps are older than their time-out."""
        age_ns = self.time_ns - stamp_s * NS_PER_S - self.flight_time_ns
        old: Bools = age_ns > np.asarray(timeout_s) * NS_PER_S
        return old

    def latest(self, time_s: Ints) -> Ints:
        """(n,) index of the latest message at each epoch; -1 where there is none."""
        index: Ints = np.searchsorted(time_s, self.second, side="right") - 1
        if time_s.size:
            index[time_s[index] <= self.since_s] = -1
        return index

    def some(self, rows: Ints | Bools) -> Instants:
        """Some of the epochs."""
        return Instants(
            self.time_ns[rows], self.second[rows], self.since_s[rows], self.flight_time_ns
        )


@dataclass(frozen=True, eq=False)
class Reception:
    """What the link gave; all times GPS seconds.

    Parameters
    ----------
    heard_s : (n,) messages, damaged ones among them: the link was alive.
    session_s : (g,) first message after each gap that voids fast corrections.
    damaged_s : (d,) damaged messages that ended a row of `MOST_DAMAGED`.
    alarm_s : (a,) alarms.
    wiped_s : (w,) nothing heard up to these seconds serves any more: alarms, and the seconds
        before masks that contradict the one whose issue they bear.
    flight_time_ns : between the last bit's stamp and its reception.
    """

    heard_s: Ints
    session_s: Ints
    damaged_s: Ints
    alarm_s: Ints
    wiped_s: Ints
    flight_time_ns: int

    def instants(self, time_ns: Ints) -> Instants:
        """Epochs, in nanoseconds since the GPS epoch, as the messages see them."""
        second = (time_ns - self.flight_time_ns) // NS_PER_S
        since_s = _latest_value(self.wiped_s, second)
        return Instants(time_ns, second, since_s, self.flight_time_ns)

    def session(self, second: Ints) -> Ints:
        """(n,) number of voiding gaps that ended up to each second."""
        number: Ints = np.searchsorted(self.session_s, second, side="right")
        return number

    def last_gap_s(self, second: Ints) -> Ints:
        """(n,) first message after the last voiding gap up to each second; NEVER for none."""
        return _latest_value(self.session_s, second)

    def void_before_s(self, second: Ints) -> Ints:
        """(n,) UDREI received up to this second are void for precision approach."""
        return _latest_value(self.damaged_s, second)

    def lost(self, instants: Instants) -> Bools:
        """(n,) True where no solution may be formed: too many messages lost, none heard yet, or
        an alarm within the last minute."""
        index = np.searchsorted(self.heard_s, instants.second, side="right") - 1
        if not self.heard_s.size:
            return np.ones(index.size, bool)
        last = self.heard_s[index]
        missing = (instants.time_ns - last * NS_PER_S - self.flight_time_ns) // NS_PER_S
        alarm_s = _latest_value(self.alarm_s, instants.second)
        barred = (alarm_s > NEVER) & (instants.second - alarm_s <= ALARM_S)
        lost: Bools = (index < 0) | (missing >= MOST_LOST) | barred
        return lost


def _latest_value(times: Ints, second: Ints) -> Ints:
    if not times.size:
        return np.full(second.size, NEVER)
    index = np.searchsorted(times, second, side="right") - 1
    value: Ints = np.where(index >= 0, times[index], NEVER)
    return value


def receive(
    messages: SbasMessages, *, alarms: AlarmRule, flight_time_s: float
) -> tuple[SbasMessages, Reception]:
    """The messages that count after alarms, and what the link gave.

    Parameters
    ----------
    messages : of one PRN, in the order of time.
    alarms : "alarm": each type 0 message voids all that came before it and what comes in the
        next minute; "as_mt2": one with content is taken as a type 2, an empty one is an alarm;
        "ignore".
    flight_time_s : assumed between the stamp of a message and its reception.
    """
    type_0 = messages.kind == 0
    is_alarm = type_0 & (alarms != "ignore")
    if alarms == "as_mt2":
        is_alarm[type_0] = ~bits_of(messages.frame[type_0])[:, 8:DATA_BITS].any(axis=1)
    alarm_s = messages.time_s[is_alarm]
    # A damaged message does not say anything, but the link was alive.
    heard = np.union1d(messages.time_s, messages.bad_time_s)
    gap = np.flatnonzero(np.diff(heard) > MOST_LOST)
    damaged_s = _rows_of_damage(messages)
    since = messages.time_s - _latest_value(alarm_s, messages.time_s)
    barred = (since > 0) & (since <= ALARM_S)
    without_content = is_alarm if alarms == "as_mt2" else type_0
    return _without(messages, barred | without_content), Reception(
        heard, heard[gap + 1], damaged_s, alarm_s, alarm_s, round(flight_time_s * NS_PER_S)
    )


def _without(messages: SbasMessages, dropped: Bools) -> SbasMessages:
    kept = ~dropped
    return replace(
        messages,
        time_s=messages.time_s[kept],
        prn=messages.prn[kept],
        kind=messages.kind[kept],
        frame=messages.frame[kept],
        crc_checked=messages.crc_checked[kept],
    )


def _rows_of_damage(messages: SbasMessages) -> Ints:
    """(d,) times at which `MOST_DAMAGED` or more damaged messages have come in a row."""
    bad = np.unique(messages.bad_time_s)
    heard_before = np.searchsorted(messages.time_s, bad, side="right")
    if bad.size < MOST_DAMAGED:
        return bad[:0]
    last = MOST_DAMAGED - 1
    ends: Ints = bad[last:][heard_before[last:] == heard_before[:-last]]
    return ends
