"""Dates of epochs that tell the time of day: their own, or counted on over midnight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.logs.nmea.nmea_cycles import DAY_NS, FOREIGN, OWN, WEAK, Epochs
from sbas.logs.time_stamps import Stamps, stamps_to_gps
from sbas.timescales import NS_PER_S

_HALF_DAY_NS = DAY_NS // 2
_FIRST_DAY, _LAST_DAY = 3657, 100_000
"""1980-01-06, where GPS time begins, and a day of 2243 that datetime64[ns] can still hold."""

Ints = NDArray[np.int64]


class Midnights:
    """Counts the midnights since the first epoch: where the time of day falls by over 12 h."""

    def __init__(self) -> None:
        self._count = 0
        self._last_ns: int | None = None

    def add(self, tod_ns: Ints) -> Ints:
        """(n,) midnights before each of the epochs that follow."""
        if not len(tod_ns):
            return np.empty(0, np.int64)
        before = tod_ns[0] if self._last_ns is None else self._last_ns
        falls = np.diff(tod_ns, prepend=before) < -_HALF_DAY_NS
        count: Ints = self._count + np.cumsum(falls)
        self._count, self._last_ns = int(count[-1]), int(tod_ns[-1])
        return count


@dataclass(frozen=True)
class FirstDate:
    """The first date of a file, as the day of its first epoch, and from where dates count.

    Parameters
    ----------
    day : days since 1970 at the first epoch, had its date been counted on.
    least : lowest origin (of `nmea_cycles`) that counts as a date.
    given : whether it is the one that the caller gave, for a file without dates.
    """

    day: int
    least: int
    given: bool = False


class DateSearch:
    """Looks for the first date of a file while its epochs pass."""

    def __init__(self) -> None:
        self._midnights = Midnights()
        self._first: dict[int, int] = {}
        self.rows = 0

    def add(self, epochs: Epochs) -> None:
        count = self._midnights.add(epochs.tod_ns)
        self.rows += len(count)
        for least in (FOREIGN, WEAK):
            if least not in self._first:
                dated = np.flatnonzero(epochs.day_from >= least)
                if len(dated):
                    self._first[least] = int(epochs.day[dated[0]] - count[dated[0]])

    @property
    def found(self) -> bool:
        """Whether no later date can go before the first one found."""
        return FOREIGN in self._first

    def result(self, given: str | None, where: str) -> FirstDate:
        """The first date; one beside a valid fix goes before one with a warning.

        Raises
        ------
        InputError : no date, in the file or given.
        """
        for least in (FOREIGN, WEAK):
            if least in self._first:
                return FirstDate(self._first[least], least)
        if given is not None:
            return FirstDate(int(np.datetime64(given, "D").astype(np.int64)), OWN, given=True)
        if not self.rows:
            return FirstDate(_FIRST_DAY, OWN)
        raise InputError(
            "the file tells times of day but no date",
            code="E25",
            where=where,
            evidence=f"{self.rows:,} epochs, no date in RMC or ZDA",
            cure="say --date YYYY-MM-DD, the UTC date of the first epoch",
        )


@dataclass
class Span:
    """What the dating of all epochs did: UTC of the first, earliest and latest, and counts."""

    rows: int = 0
    first_ns: int = 0
    low_ns: int = 0
    high_ns: int = 0
    inferred: int = 0
    given: str = ""
    used_given: bool = False


class Dating:
    """Gives GPS times to epochs, piece by piece in file order."""

    def __init__(self, first: FirstDate, given: str | None, where: str) -> None:
        self._midnights = Midnights()
        self._offset = first.day
        self._least = first.least
        self._where = where
        self.span = Span(given=given or "", used_given=first.given)

    def add(self, epochs: Epochs) -> tuple[NDArray[np.datetime64], NDArray[np.bool_]]:
        """GPS times of (n,) epochs, and which of their dates were inferred.

        Raises
        ------
        InputError : a date beyond what can be held.
        """
        count = self._midnights.add(epochs.tod_ns)
        if not len(count):
            return np.empty(0, "M8[ns]"), np.empty(0, np.bool_)
        dated = epochs.day_from >= self._least
        last = np.maximum.accumulate(np.where(dated, np.arange(len(count)), -1))
        offset = np.where(last >= 0, epochs.day[last] - count[last], self._offset)
        self._offset = int(offset[-1])
        day = count + offset
        if int(day.min()) < _FIRST_DAY or int(day.max()) > _LAST_DAY:
            raise InputError(
                "dates lie outside GPS time",
                code="E22",
                where=self._where,
                evidence=f"{np.datetime64(int(day.min()), 'D')} to "
                f"{np.datetime64(int(day.max()), 'D')}",
                cure="correct the dates, or say --date YYYY-MM-DD for a file without them",
            )
        inferred = ~dated | (epochs.day_from != OWN)
        leap = epochs.tod_ns >= DAY_NS
        utc_ns = day * DAY_NS + epochs.tod_ns - leap * NS_PER_S
        none = np.zeros(len(day), np.bool_)
        times, _, _ = stamps_to_gps(Stamps(utc_ns, ~none, leap, none), "UTC")
        span = self.span
        if not span.rows:
            span.first_ns = span.low_ns = span.high_ns = int(utc_ns[0])
        span.low_ns = min(span.low_ns, int(utc_ns.min()))
        span.high_ns = max(span.high_ns, int(utc_ns.max()))
        span.rows += len(day)
        span.inferred += int(np.count_nonzero(inferred))
        return times, inferred
