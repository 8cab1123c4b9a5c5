"""A plain receiver of fast corrections: one satellite, a message and an epoch at a time.

Written from the rules alone, not from the package: it keeps the state that a receiver keeps, and
erases it when the rules say so. Slow; for comparison with `fast_at` on streams of any kind.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isclose, nan

import numpy as np

FLIGHT_S = 0.12
FACTOR = [0, 5e-5, 9e-5, 12e-5, 15e-5, 2e-4, 3e-4, 45e-5, 6e-4, 9e-4, 15e-4, 21e-4, 27e-4, 33e-4,
          46e-4, 58e-4]  # fmt: skip
TIMEOUT = {
    "pa": [120, 120, 102, 90, 90, 78, 66, 54, 42, 30, 30, 18, 18, 18, 12, 12],
    "npa": [180, 180, 153, 135, 135, 117, 99, 81, 63, 45, 45, 27, 27, 27, 18, 18],
}
UDREI_S = {"pa": 12, "npa": 18}
SLOW_S = {"pa": 240, "npa": 360}
MASK_S = 600
ALARM_IODF = 3
LINK_LOST, NO_MASK, MASK_EXPIRED, NOT_IN_MASK, NO_FAST = 60, 7, 8, 9, 12


@dataclass(frozen=True)
class Mask:
    iodp: int
    slots: tuple[int, ...]


@dataclass(frozen=True)
class Fast:
    """Corrections of consecutive positions from `first`; values in raw units."""

    iodp: int
    iodf: int
    first: int
    prc: tuple[int, ...]
    udrei: tuple[int, ...]


@dataclass(frozen=True)
class Integrity:
    iodf: tuple[int, ...]
    udrei: tuple[int, ...]


@dataclass(frozen=True)
class Factors:
    iodp: int
    latency_s: int
    ai: tuple[int, ...]


@dataclass(frozen=True)
class Parameters:
    b_rrc: int


@dataclass(frozen=True)
class Alarm:
    pass


@dataclass(frozen=True)
class Damaged:
    pass


@dataclass(frozen=True)
class Null:
    pass


Message = Mask | Fast | Integrity | Factors | Parameters | Alarm | Damaged | Null


@dataclass
class Entry:
    time: int
    prc_m: float
    udrei: int
    iodf: int
    block: int


@dataclass
class Six:
    time: int
    udrei: int
    iodf: int
    older: int | None = None
    by_iodf: dict[int, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Answer:
    reason: int
    usable: bool = False
    barred: bool = False
    prc_m: float = nan
    rrc_m: float = nan
    eps_fc_m: float = nan
    eps_rrc_m: float = nan
    udrei: int = -1


class Receiver:
    """State of one satellite's corrections in one mode and profile."""

    def __init__(self, slot: int, mode: str, profile: str) -> None:
        self.slot, self.mode, self.profile = slot, mode, profile
        self.heard: int | None = None
        self.bad_in_a_row = 0
        self.void: int | None = None
        self.alarm: int | None = None
        self.forget()

    def forget(self) -> None:
        self.current: int | None = None
        self.before: int | None = None
        self.masks: dict[int, tuple[int, ...]] = {}
        self.mask_time: dict[int, int] = {}
        self.fast_now: int | None = None
        self.fast_before: int | None = None
        self.history: dict[tuple[int, int], list[Entry]] = {}
        self.six: dict[tuple[int, int], Six] = {}
        self.factors: dict[int, tuple[int, Factors]] = {}
        self.parameters: tuple[int, float] | None = None
        self.forbidden: int | None = None

    # Messages

    def receive(self, time: int, message: Message) -> None:
        self._gap(time)
        self.heard = time
        if isinstance(message, Damaged):
            self.bad_in_a_row += 1
            if self.bad_in_a_row >= 4:
                self.void = time
            return
        self.bad_in_a_row = 0
        if isinstance(message, Alarm):
            self.forget()
            self.alarm = time
        if self.alarm is not None and time - self.alarm <= 60:
            return
        if isinstance(message, Mask):
            self._mask(time, message)
        elif isinstance(message, Fast):
            self._fast(time, message)
        elif isinstance(message, Integrity):
            self._integrity(time, message)
        elif isinstance(message, Factors):
            self.factors[message.iodp] = (time, message)
        elif isinstance(message, Parameters):
            self.parameters = (time, message.b_rrc * 0.002)

    def _gap(self, time: int) -> None:
        if self.heard is None or time - self.heard < 5:
            return
        self.history, self.six = {}, {}
        if self.slot in self.masks.get(-1 if self.fast_now is None else self.fast_now, ()):
            self.forbidden = 14

    def _mask(self, time: int, message: Mask) -> None:
        if message.iodp != self.current:
            self.before, self.current = self.current, message.iodp
            kept = {self.before: self.masks.get(self.before, ())} if self.before is not None else {}
            self.masks = {**kept, message.iodp: message.slots}
        self.mask_time[message.iodp] = time

    def _fast(self, time: int, message: Fast) -> None:
        if message.iodp != self.fast_now:
            self.fast_before, self.fast_now = self.fast_now, message.iodp
            live = (self.fast_now, self.fast_before)
            self.history = {key: rows for key, rows in self.history.items() if key[0] in live}
            self.six = {key: six for key, six in self.six.items() if key[0] in live}
        for i, (prc, udrei) in enumerate(zip(message.prc, message.udrei, strict=True)):
            position = message.first + i
            if position > 50:
                continue
            entry = Entry(time, prc * 0.125, udrei, message.iodf, message.first // 13)
            self.history.setdefault((message.iodp, position), []).append(entry)

    def _integrity(self, time: int, message: Integrity) -> None:
        if self.fast_now is None:
            return
        for position, udrei in enumerate(message.udrei):
            iodf = message.iodf[min(position // 13, 3)]
            old = self.six.get((self.fast_now, position))
            new = Six(time, udrei, iodf)
            if old is not None:
                new.older = old.time if old.iodf != iodf else old.older
                new.by_iodf = dict(old.by_iodf)
            new.by_iodf[iodf] = time
            self.six[self.fast_now, position] = new
            rows = self.history.get((self.fast_now, position))
            if rows and udrei >= 14 > rows[-1].udrei and iodf in (ALARM_IODF, rows[-1].iodf):
                # It ends the history as a fast correction with this UDREI would.
                rows.append(Entry(time, nan, udrei, iodf, rows[-1].block))

    # Epochs

    def at(self, t: int) -> Answer:
        """What holds at the whole second t, all messages before it received."""
        if self.heard is None:
            return Answer(LINK_LOST, barred=True)
        if int(t - self.heard - FLIGHT_S) >= 4:
            return Answer(LINK_LOST, barred=True)
        if self.alarm is not None and int(t - FLIGHT_S) - self.alarm <= 60:
            return Answer(LINK_LOST, barred=True)
        if self.current is None:
            return Answer(NO_MASK, barred=True)
        if self._old(t, self.mask_time[self.current], MASK_S):
            return Answer(MASK_EXPIRED, barred=True)
        known = {self.current: self.masks[self.current]}
        if self.before is not None and not self._old(t, self.mask_time[self.before], MASK_S):
            known[self.before] = self.masks[self.before]
        if not any(self.slot in slots for slots in known.values()):
            return Answer(NOT_IN_MASK, barred=True)
        for iodp in (self.fast_now, self.fast_before):
            if iodp is None or self.slot not in known.get(iodp, ()):
                continue
            position = sorted(known[iodp]).index(self.slot)
            if self.history.get((iodp, position)):
                return self._corrected(t, iodp, position, known)
        return self._without()

    def _without(self) -> Answer:
        if self.forbidden is None:
            return Answer(NO_FAST)
        return Answer(self.forbidden, barred=True, udrei=self.forbidden)

    @staticmethod
    def _old(t: int, time: int, limit: float) -> bool:
        return t - time - FLIGHT_S > limit

    def _erase(self, known: dict[int, tuple[int, ...]]) -> None:
        for iodp, slots in known.items():
            if self.slot in slots:
                key = iodp, sorted(slots).index(self.slot)
                self.history.pop(key, None)
                self.six.pop(key, None)

    def _corrected(
        self, t: int, iodp: int, position: int, known: dict[int, tuple[int, ...]]
    ) -> Answer:
        rows = self.history[iodp, position]
        bad = [i for i, entry in enumerate(rows) if entry.udrei >= 14]
        if bad:
            # Corrections up to the last "not monitored" one never serve again.
            kept, code = rows[bad[-1] + 1 :], rows[bad[-1]].udrei
            six = self.six.get((iodp, position))
            self._erase(known)
            self.forbidden = code
            if not kept:
                return self._without()
            self.history[iodp, position] = rows = kept
            if six is not None and six.time > kept[0].time:
                self.six[iodp, position] = six
        newest = rows[-1]
        six = self.six.get((iodp, position))
        if six is not None and six.time < newest.time:
            six = None
        udrei, t_udre, t_used = newest.udrei, newest.time, newest.time
        alarm = newest.iodf == ALARM_IODF
        if six is not None:
            t_udre = six.time
            if six.iodf == ALARM_IODF:
                udrei, alarm = six.udrei, True
            elif six.iodf == newest.iodf:
                udrei, t_used = six.udrei, six.time
            elif self.profile == "glab":
                t_used = max(newest.time, six.older if six.older is not None else 0)
            else:
                t_used = max(newest.time, six.by_iodf.get(newest.iodf, 0))
        pa = self.mode == "pa"
        self.forbidden = None
        if self._old(t, t_udre, UDREI_S[self.mode]):
            return Answer(13)
        if pa and self.void is not None and t_udre <= self.void:
            return Answer(13)
        if pa and udrei >= 12:
            return Answer(16)
        if iodp not in self.factors:
            return Answer(17)
        when, factors = self.factors[iodp]
        if self._old(t, when, SLOW_S[self.mode]):
            return Answer(18)
        a, timeout = FACTOR[factors.ai[position]], TIMEOUT[self.mode][factors.ai[position]]
        if self._old(t, t_used, timeout):
            return Answer(19)
        if pa and len(rows) < 2:
            return Answer(20)
        eps_fc = a * (t - t_used + 1 + factors.latency_s) ** 2 / 2
        rrc, eps_rrc, code = self._rate(
            t, rows, a, self._shortest(factors, known[iodp], newest), alarm
        )
        if code:
            return Answer(code)
        return Answer(0, True, False, newest.prc_m, rrc, eps_fc, eps_rrc, udrei)

    def _shortest(self, factors: Factors, slots: tuple[int, ...], newest: Entry) -> int:
        count = len(slots)
        if self.profile == "glab":
            positions = range(max(count - 1, 1))
        else:
            positions = range(13 * newest.block, min(13 * newest.block + 13, count))
        return min(TIMEOUT[self.mode][factors.ai[p]] for p in positions)

    def _rate(
        self, t: int, rows: list[Entry], a: float, shortest: float, alarm: bool
    ) -> tuple[float, float, int]:
        if len(rows) < 2 or a == 0:
            return 0.0, 0.0, 0
        newest, last = rows[-1], rows[-2]
        alarm = alarm or last.iodf == ALARM_IODF
        previous: Entry | None = last
        if alarm:
            previous = self._previous_in_alarm(rows, shortest)
            if previous is None:
                return 0.0, 0.0, 0
        assert previous is not None
        dt = newest.time - previous.time
        age = t - newest.time
        if dt > shortest:
            return nan, nan, 21 if alarm else 23
        if age > 8 * dt:
            return nan, nan, 22 if alarm else 24
        rate = (newest.prc_m - previous.prc_m) / dt
        b = None
        if self.parameters is not None and not self._old(t, self.parameters[0], SLOW_S[self.mode]):
            b = self.parameters[1]
        if b is None:
            eps = 0.0
        elif alarm:
            off = abs(dt - shortest / 2)
            eps = 0.0 if isclose(off, 0) else (a * off / 2 + b / dt) * (age + 1)
        elif (newest.iodf - previous.iodf) % 3 == 1:
            eps = 0.0
        else:
            eps = (a * shortest / 4 + b / dt) * (age + 1)
        return rate * (age + 1), eps, 0

    def _previous_in_alarm(self, rows: list[Entry], shortest: float) -> Entry | None:
        newest, older = rows[-1], rows[:-1]
        if self.profile == "mops":
            return min(older, key=lambda entry: abs(newest.time - entry.time - shortest / 2))
        young = [entry for entry in older if newest.time - entry.time < shortest / 2]
        if young:
            return young[0]
        middle = [entry for entry in older if newest.time - entry.time <= shortest]
        return middle[-1] if middle else None


def random_stream(seed: int, seconds: int) -> dict[int, Message]:
    """A message a second, but for those lost; every rule is touched by some seed."""
    rng = np.random.default_rng(seed)
    slots = [
        np.sort(rng.choice(np.arange(1, 62), size=int(rng.choice([3, 14, 30])), replace=False))
    ]
    changed = np.setdiff1d(np.arange(1, 62), slots[0][: slots[0].size // 2])
    slots.append(np.sort(rng.choice(changed, size=slots[0].size, replace=False)))
    slots.append(slots[0])
    iodp = int(rng.integers(0, 4))
    issues = [iodp, (iodp + 1) % 4, iodp if rng.random() < 0.3 else (iodp + 2) % 4]
    changes = np.sort(rng.integers(40, seconds, 2)) if rng.random() < 0.6 else [10**6, 10**6]
    if rng.random() < 0.7:
        changes[1] = 10**6
    lag = int(rng.integers(0, 8))
    counter = [0, 0, 0, 0]
    factors = {i: tuple(int(v) for v in rng.choice([0, 5, 9, 12, 14, 15], 51)) for i in range(4)}
    prone = float(rng.choice([0.0, 0.02, 0.15]))
    silent_until = damaged_until = 0
    stream: dict[int, Message] = {}
    for second in range(seconds):
        if rng.random() < 0.01:
            silent_until = second + int(rng.integers(1, 7))
        if rng.random() < 0.01:
            damaged_until = second + int(rng.integers(1, 7))
        if second < silent_until:
            continue
        if second < damaged_until:
            stream[second] = Damaged()
            continue
        now = int((second >= changes[0]) + (second >= changes[1]))
        at_mask = int((second >= changes[0] + lag - 3) + (second >= changes[1] + lag - 3))
        names, issue = slots[now], issues[now]
        kind = rng.choice(
            ["mask", "fast", "mixed", "integrity", "factors", "parameters", "null"],
            p=[0.12, 0.45, 0.05, 0.18, 0.08, 0.04, 0.08],
        )

        def udreis(count: int) -> tuple[int, ...]:
            good = rng.choice([3, 5, 9, 11, 12, 13], count, p=[0.2, 0.3, 0.3, 0.1, 0.05, 0.05])
            bad = rng.choice([14, 15], count)
            return tuple(int(v) for v in np.where(rng.random(count) < prone, bad, good))

        def next_iodf(block: int) -> int:
            if rng.random() < prone:
                return ALARM_IODF
            counter[block] = (counter[block] + (2 if rng.random() < 0.1 else 1)) % 3
            return counter[block]

        message: Message = Null()
        if rng.random() < 0.001:
            message = Alarm()
        elif kind == "mask":
            message = Mask(issues[at_mask], tuple(int(s) for s in slots[at_mask]))
        elif kind in ("fast", "mixed"):
            block = int(rng.integers(0, (names.size + 12) // 13))
            count = 13 if kind == "fast" else 6
            prc = tuple(int(v) for v in rng.integers(-40, 41, count))
            message = Fast(issue, next_iodf(block), 13 * block, prc, udreis(count))
        elif kind == "integrity":
            held = [c if rng.random() < 0.8 else int(rng.integers(0, 4)) for c in counter]
            message = Integrity(tuple(held), udreis(51))
        elif kind == "factors":
            message = Factors(issue, int(rng.integers(0, 5)), factors[issue])
        elif kind == "parameters":
            message = Parameters(int(rng.integers(0, 200)))
        stream[second] = message
    return stream
