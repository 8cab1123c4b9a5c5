"""What an SBF file said about itself, and what the reader removed, missed or left over."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding, Severity
from sbas.logs.sentinels import sentinel_findings
from sbas.logs.septentrio.sbf_decode import Removed
from sbas.logs.septentrio.sbf_foreign import count_foreign, cut_block
from sbas.logs.septentrio.sbf_table import DO229_SATELLITES, Levels, Raw
from sbas.recording import ProtectionLevelMeta

BAD_SHARE = 0.01
"""Share of orphan bytes above which a file counts as damaged rather than scratched."""

_SAFETY_COLUMNS = ("hpl_m", "vpl_m", "lat_deg", "lon_deg", "height_m")
_LEAP_MISSING = -128
_SYNCHRONISED = 7
_DATUM_WGS84 = 0


@dataclass(frozen=True)
class Seen:
    """Counts of one reading.

    Parameters
    ----------
    epochs, incomplete : rows, and rows that lack a block which other rows have.
    without_time : blocks dropped for want of a time, by name of the block.
    encapsulated : EncapsulatedOutput blocks, whose content is not read.
    removed : values made missing, by column and what was seen.
    levels : kinds of the protection levels; None where they were not read.
    """

    epochs: int
    incomplete: int
    without_time: Mapping[str, int]
    encapsulated: int
    removed: Removed
    levels: Levels | None


def leap_seconds(receiver_time: Raw | None) -> int | None:
    """GPST - UTC as the receiver last stated it (ReceiverTime, DeltaLS)."""
    stated = _stated_leaps(receiver_time)
    return int(stated[-1]) if len(stated) else None


def _stated_leaps(receiver_time: Raw | None) -> NDArray[np.int8]:
    if receiver_time is None:
        return np.empty(0, np.int8)
    values: NDArray[np.int8] = receiver_time["leap_seconds"]
    known: NDArray[np.int8] = values[values != _LEAP_MISSING]
    return known


def reference_frame(pvt: Raw | None) -> str:
    """Frame of the positions, where the receiver says WGS 84 or ITRS throughout (Datum 0)."""
    known = pvt is not None and bool((pvt["datum"] == _DATUM_WGS84).all())
    return "WGS84" if known else ""


def protection_level_meta(levels: Levels | None) -> ProtectionLevelMeta:
    """Kind of the protection levels.

    `do229` only where all levels in SBAS mode come from L1 signals of GPS and SBAS; `receiver`
    where other signals, more satellites than DO-229 knows, or no SBAS mode show another origin.
    """
    if levels is None or not levels.present:
        return ProtectionLevelMeta()
    if levels.other_signals or levels.many_satellites or levels.outside == levels.present:
        return ProtectionLevelMeta("receiver")
    return ProtectionLevelMeta("do229" if levels.certain else "unknown")


def findings(seen: Seen, receiver_time: Raw | None) -> tuple[Finding, ...]:
    """Findings on the blocks that were read."""
    found = [*_removed(seen.removed)]
    if seen.without_time:
        found.append(
            Finding(
                "E10",
                "warning",
                "blocks carry no usable time and were left out",
                evidence=", ".join(f"{n:,} {name}" for name, n in seen.without_time.items()),
                cure="usual before the first fix; log from when the receiver time is set",
            )
        )
    if seen.incomplete:
        found.append(
            Finding(
                "E10",
                "warning",
                "epochs lack a block that other epochs have; flag EPOCH_INCOMPLETE",
                evidence=f"{seen.incomplete:,} of {seen.epochs:,} epochs",
                cure="log all blocks at one interval; missing values stay missing",
            )
        )
    if seen.encapsulated:
        found.append(
            Finding(
                "E24",
                "info",
                "EncapsulatedOutput blocks: what they wrap was not read",
                evidence=f"{seen.encapsulated:,} blocks",
            )
        )
    if seen.levels is not None:
        found += _levels(seen.levels)
    return (*found, *_clock(receiver_time))


def _removed(removed: Removed) -> list[Finding]:
    """E07: a warning for positions and protection levels, for the rest only information."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for (column, value), number in sorted(removed.items()):
        counts[column][value] += number
    grave = {name: counts.pop(name) for name in _SAFETY_COLUMNS if name in counts}
    found = list(sentinel_findings(grave))
    if counts:
        found.append(
            Finding(
                "E07",
                "info",
                "values that the receiver marked as not available were made missing",
                evidence="; ".join(
                    f"{name}: {number:,} x {value}"
                    for name, values in counts.items()
                    for value, number in values.items()
                ),
            )
        )
    return found


def _levels(levels: Levels) -> list[Finding]:
    signs = {
        "outside SBAS mode (flag PL_OUTSIDE_SBAS)": levels.outside,
        "from signals other than GPS and SBAS L1": levels.other_signals,
        f"from more than {DO229_SATELLITES} satellites": levels.many_satellites,
    }
    if not any(signs.values()):
        return []
    return [
        Finding(
            "E23",
            "warning",
            "protection levels that are not those of DO-229 for L1",
            evidence="; ".join(f"{n:,} {sign}" for sign, n in signs.items() if n)
            + f"; of {levels.present:,} epochs with a level",
            cure="judge them by the receiver's own definition, or log in SBAS L1 mode",
        )
    ]


def _clock(receiver_time: Raw | None) -> list[Finding]:
    if receiver_time is None:
        return []
    found = []
    level = receiver_time["sync_level"]
    if loose := int((level != _SYNCHRONISED).sum()):
        found.append(
            Finding(
                "E25",
                "warning",
                "the receiver's clock was not yet set to GPS time",
                evidence=f"{loose:,} of {len(level):,} ReceiverTime blocks have SyncLevel below 7",
                cure="leave out the epochs before the clock was set",
            )
        )
    stated = np.unique(_stated_leaps(receiver_time))
    if len(stated) > 1:
        found.append(
            Finding(
                "E25",
                "warning",
                "the receiver states several differences between GPS time and UTC",
                evidence=", ".join(f"{value} s" for value in stated.tolist()),
                cure="GPS times are not affected; mind it when comparing with UTC",
            )
        )
    return found


def leftover_findings(
    path: Path, start: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[Finding, ...]:
    """E10 and E24 on the stretches [start, end) of the file that are no block."""
    if not len(start):
        return ()
    found = []
    size = path.stat().st_size
    cut = cut_block(path, int(start[-1]), size) if end[-1] == size else None
    if cut is not None:
        place, length = cut
        found.append(
            Finding(
                "E10",
                "warning",
                "the last block is cut by the end of the file and was left out",
                where=f"byte {place:,}",
                evidence=f"{size - place} bytes of {length or 'unknown length'}",
            )
        )
        end = np.append(end[:-1], place)
    foreign = count_foreign(path, start, end)
    if foreign.orphan_bytes:
        share = foreign.orphan_bytes / size
        severity: Severity = "error" if share > BAD_SHARE else "warning"
        others = [f"{n:,} {name}" for n, name in
                  ((foreign.nmea_sentences, "NMEA sentences"), (foreign.rtcm_frames, "RTCM frames"))
                  if n]  # fmt: skip
        found.append(
            Finding(
                "E24",
                severity,
                "bytes belong to no valid SBF block, NMEA sentence or RTCM frame",
                where="first at byte " + ", ".join(f"{at:,}" for at in foreign.first_orphans),
                evidence=f"{foreign.orphan_bytes:,} of {size:,} bytes ({share:.3%})"
                + (f"; beside {' and '.join(others)}" if others else ""),
                cure="check the link and the storage; every intact block was read",
            )
        )
    return tuple(found)
