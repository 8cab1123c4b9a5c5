"""The times of a recording that is read piece by piece, as far as findings need them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sbas.findings import Finding
from sbas.logs.time_stamps import Stamps, stamps_to_gps


@dataclass(frozen=True)
class TimeTally:
    """Counts and extremes of readable stamps, of one piece or of several added in file order.

    Parameters
    ----------
    rows, zoned : stamps, and those of them that name a zone.
    ns : first, smallest and largest of them; none where there is no stamp.
    """

    rows: int = 0
    zoned: int = 0
    ns: tuple[int, ...] = ()

    @classmethod
    def of(cls, stamps: Stamps) -> TimeTally:
        """The tally of a piece."""
        if not len(stamps.ns):
            return cls()
        extremes = (int(stamps.ns[0]), int(stamps.ns.min()), int(stamps.ns.max()))
        return cls(len(stamps.ns), int(np.count_nonzero(stamps.zoned)), extremes)

    def __add__(self, other: TimeTally) -> TimeTally:
        ns = self.ns or other.ns
        if self.ns and other.ns:
            ns = (self.ns[0], min(self.ns[1], other.ns[1]), max(self.ns[2], other.ns[2]))
        return TimeTally(self.rows + other.rows, self.zoned + other.zoned, ns)

    def zones(self) -> Stamps:
        """Stamps of which as many name a zone: enough to tell the scale of all."""
        nothing = np.zeros(self.rows, bool)
        zoned = np.arange(self.rows, dtype=np.uint32) < self.zoned
        return Stamps(np.zeros(0, np.int64), nothing, nothing, zoned)

    def conversions(self, scale: str) -> tuple[int | None, tuple[Finding, ...]]:
        """GPST - UTC at the first stamp, and the findings of `stamps_to_gps`, of all stamps."""
        nothing = np.zeros(len(self.ns), bool)
        shown = Stamps(np.array(self.ns, np.int64), ~nothing, nothing, nothing)
        _, leap_seconds, findings = stamps_to_gps(shown, scale)
        if not findings:
            return leap_seconds, ()
        counted = replace(
            findings[0], message=f"{self.rows:,} times converted from {scale} to GPS time"
        )
        return leap_seconds, (counted, *findings[1:])
