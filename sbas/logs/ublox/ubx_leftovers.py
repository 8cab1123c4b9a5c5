"""What lies between UBX frames: NMEA sentences, RTCM frames, a cut last frame, or damage."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding, Severity
from sbas.logs.septentrio.sbf_foreign import Foreign, count_foreign
from sbas.logs.septentrio.sbf_framing import read_span
from sbas.logs.ublox.ubx_framing import EXTRA_BYTES, HEADER_BYTES

BAD_SHARE = 0.01
"""Share of orphan bytes above which a file counts as damaged rather than scratched."""
MANY_STRETCHES = 1 << 16
_SYNC = b"\xb5\x62"

Positions = NDArray[np.int64]


@dataclass
class Leftovers:
    """Counts over the stretches of a file that are no frame, made while it is read.

    Parameters
    ----------
    path : the file.
    max_payload : the longest payload of a frame [bytes].
    """

    path: Path
    max_payload: int
    _found: Foreign = field(default_factory=Foreign)
    _waiting: list[tuple[Positions, Positions]] = field(default_factory=list)
    _count: int = 0

    def add(self, start: Positions, end: Positions) -> None:
        """Take note of (n,) stretches [start, end) that are no frame, in file order."""
        self._waiting.append((start, end))
        self._count += len(start)
        if self._count > MANY_STRETCHES:
            self._settle()

    def _settle(self) -> None:
        start, end = (np.concatenate([pair[i] for pair in self._waiting]) for i in (0, 1))
        count_foreign(self.path, start.astype(np.int64), end.astype(np.int64), self._found)
        self._waiting, self._count = [], 0

    def findings(self, last_end: int) -> tuple[Finding, ...]:
        """E10 and E24, once all stretches up to the end of the last frame are noted."""
        size = self.path.stat().st_size
        found = []
        if last_end < size:
            end = size
            cut = self._cut_frame(last_end, size)
            if cut is not None:
                end, length = cut
                found.append(
                    Finding(
                        "E10",
                        "warning",
                        "the last frame is cut by the end of the file and was left out",
                        where=f"byte {end:,}",
                        evidence=f"{size - end} bytes of {length or 'unknown length'}",
                    )
                )
            self.add(np.array([last_end]), np.array([end]))
        if self._waiting:
            self._settle()
        foreign = self._found
        if foreign.orphan_bytes:
            share = foreign.orphan_bytes / size
            severity: Severity = "error" if share > BAD_SHARE else "warning"
            others = [f"{n:,} {name}" for n, name in
                      ((foreign.nmea_sentences, "NMEA sentences"),
                       (foreign.rtcm_frames, "RTCM frames")) if n]  # fmt: skip
            found.append(
                Finding(
                    "E24",
                    severity,
                    "bytes belong to no valid UBX frame, NMEA sentence or RTCM frame",
                    where="first at byte " + ", ".join(f"{at:,}" for at in foreign.first_orphans),
                    evidence=f"{foreign.orphan_bytes:,} of {size:,} bytes ({share:.3%})"
                    + (f"; beside {' and '.join(others)}" if others else ""),
                    cure="check the link and the storage; every intact frame was read",
                )
            )
        return tuple(found)

    def _cut_frame(self, start: int, end: int) -> tuple[int, int] | None:
        """Place and stated length of a last frame that the end of the file cuts, if any."""
        low = max(start, end - self.max_payload - EXTRA_BYTES)
        with self.path.open("rb", buffering=0) as file:
            tail = read_span(file, low, end).tobytes()
        at = tail.find(_SYNC)
        while at >= 0:
            if at + HEADER_BYTES > len(tail):
                return low + at, 0
            length = int.from_bytes(tail[at + 4 : at + 6], "little") + EXTRA_BYTES
            if length <= self.max_payload + EXTRA_BYTES and at + length > len(tail):
                return low + at, length
            at = tail.find(_SYNC, at + 1)
        return None
