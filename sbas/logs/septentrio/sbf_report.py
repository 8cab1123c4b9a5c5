"""What an SBF file said about itself, and what the reader removed, missed or left over."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding, Severity
from sbas.logs.sentinels import removed_findings
from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_decode import Removed
from sbas.logs.septentrio.sbf_epochs import gps_times
from sbas.logs.septentrio.sbf_foreign import Leftovers
from sbas.logs.septentrio.sbf_parts import Part, Raw
from sbas.logs.septentrio.sbf_satellites import Satellites
from sbas.logs.septentrio.sbf_table import (
    DO229_SATELLITES,
    Filled,
    Levels,
    incomplete_epochs,
    kinds_of,
    no_coverage,
)
from sbas.recording import ProtectionLevelMeta, RecordingMeta

BAD_SHARE = 0.01
"""Share of orphan bytes above which a file counts as damaged rather than scratched."""

_LEAP_MISSING = -128
_SYNCHRONISED = 7
_DATUM_WGS84 = 0
_CHANGES_KEPT = 5
_MARKER = "marker"
_ANTENNAS = {frozenset({1}): "marker, which is the ARP", frozenset({2}): "marker, off the ARP"}
"""Misc bits 6-7: whether the marker, to which positions refer, is the antenna reference point."""


@dataclass
class Clock:
    """What the receiver said about its clock (ReceiverTime), block by block in file order.

    Parameters
    ----------
    blocks, loose : ReceiverTime blocks, and how many have a SyncLevel below 7.
    leap_seconds : GPST - UTC as last stated, `None` while it is not known.
    changes : the first changes of that, as (time since 1980-01-06 [ms], before, after).
    changed : how often it changed.
    """

    blocks: int = 0
    loose: int = 0
    leap_seconds: int | None = None
    changes: list[tuple[int, int, int]] = field(default_factory=list)
    changed: int = 0

    def add(self, receiver_time: Raw) -> None:
        """Take note of the blocks that follow."""
        self.blocks += len(receiver_time["position"])
        self.loose += int(np.count_nonzero(receiver_time["sync_level"] != _SYNCHRONISED))
        stated = receiver_time["leap_seconds"]
        known = stated != _LEAP_MISSING
        values = stated[known].astype(np.int64)
        if not len(values):
            return
        times = receiver_time["time_ms"][known]
        before = values[0] if self.leap_seconds is None else self.leap_seconds
        steps = np.flatnonzero(np.diff(values, prepend=before))
        self.changed += len(steps)
        for i in steps[: _CHANGES_KEPT - len(self.changes)].tolist():
            last = int(values[i - 1]) if i else int(before)
            self.changes.append((int(times[i]), last, int(values[i])))
        self.leap_seconds = int(values[-1])


@dataclass
class Seen:
    """Counts of one reading, which grow part by part.

    Parameters
    ----------
    epochs : rows.
    coverage : epochs by the kinds of block that they have; see `sbf_table.kinds_of`.
    kinds : kinds of block that came at all.
    without_time, unfit : blocks dropped for want of a time, or because their sub-blocks do not
        add up to their length, by name of the block.
    encapsulated : EncapsulatedOutput blocks, whose content is not read.
    removed : values made missing, by column and what was seen.
    levels : kinds of the protection levels; None where they were not read.
    left_out : sub-blocks that no row of the satellite table took, by why.
    clock : the receiver's clock.
    datums, offsets : values of Datum, and of Misc bits 6-7, that came with positions.
    """

    epochs: int = 0
    coverage: NDArray[np.int64] = field(default_factory=no_coverage)
    kinds: int = 0
    without_time: Counter[str] = field(default_factory=Counter)
    unfit: Counter[str] = field(default_factory=Counter)
    encapsulated: int = 0
    removed: Removed = field(default_factory=Counter)
    levels: Levels | None = None
    left_out: Counter[str] = field(default_factory=Counter)
    clock: Clock = field(default_factory=Clock)
    datums: set[int] = field(default_factory=set)
    offsets: set[int] = field(default_factory=set)

    def add_part(self, part: Part) -> None:
        """Take note of the blocks of a part."""
        self.kinds |= kinds_of(part.raw)
        self.without_time.update(part.without_time)
        self.unfit.update(part.unfit)
        self.encapsulated += part.encapsulated
        if sbf.RECEIVER_TIME in part.raw:
            self.clock.add(part.raw[sbf.RECEIVER_TIME])
        if sbf.PVT_GEODETIC in part.raw:
            self.datums.update(np.unique(part.raw[sbf.PVT_GEODETIC]["datum"]).tolist())
        for number in (sbf.PVT_GEODETIC, sbf.PVT_CARTESIAN):
            if number in part.raw:
                self.offsets.update(np.unique(part.raw[number]["misc"] >> 6).tolist())

    def add_segment(self, table: Filled, satellites: Satellites) -> None:
        """Take note of the columns of some epochs, and of their satellites."""
        self.epochs += len(table.has)
        self.coverage = self.coverage + table.coverage
        self.removed.update(table.removed)
        if table.levels is not None:
            self.levels = table.levels if self.levels is None else self.levels + table.levels
        self.removed.update(satellites.removed)
        self.left_out.update(satellites.left_out)


def recording_meta(seen: Seen, leftovers: Leftovers) -> RecordingMeta:
    """Metadata of a whole file."""
    return RecordingMeta(
        leap_seconds=seen.clock.leap_seconds,
        frame="WGS84" if seen.datums == {_DATUM_WGS84} else "",
        antenna=_ANTENNAS.get(frozenset(seen.offsets), _MARKER),
        pl=protection_level_meta(seen.levels),
        findings=(*findings(seen), *leftover_findings(leftovers)),
    )


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


def findings(seen: Seen) -> tuple[Finding, ...]:
    """Findings on the blocks that were read."""
    found = [*removed_findings(seen.removed)]
    if seen.without_time:
        found.append(
            Finding(
                "E10",
                "warning",
                "blocks carry no usable time and were left out",
                evidence=", ".join(
                    f"{n:,} {name}" for name, n in sorted(seen.without_time.items())
                ),
                cure="usual before the first fix; log from when the receiver time is set",
            )
        )
    if incomplete := incomplete_epochs(seen.coverage, seen.kinds):
        found.append(
            Finding(
                "E10",
                "warning",
                "epochs lack a block that other epochs have; flag EPOCH_INCOMPLETE",
                evidence=f"{incomplete:,} of {seen.epochs:,} epochs",
                cure="log all blocks at one interval; missing values stay missing",
            )
        )
    if seen.unfit:
        found.append(
            Finding(
                "E10",
                "warning",
                "blocks whose sub-blocks do not add up to their length were left out",
                evidence=", ".join(f"{n:,} {name}" for name, n in sorted(seen.unfit.items())),
                cure="the receiver may write a revision that is not known yet",
            )
        )
    if seen.left_out:
        found.append(
            Finding(
                "E10",
                "info",
                "the satellite table has one row an epoch and satellite; some sub-blocks have none",
                evidence=", ".join(f"{n:,} {why}" for why, n in sorted(seen.left_out.items())),
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
    return (*found, *_clock(seen.clock))


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


def _clock(clock: Clock) -> list[Finding]:
    found = []
    if clock.loose:
        found.append(
            Finding(
                "E25",
                "warning",
                "the receiver's clock was not yet set to GPS time",
                evidence=f"{clock.loose:,} of {clock.blocks:,} ReceiverTime blocks have SyncLevel "
                "below 7",
                cure="leave out the epochs before the clock was set",
            )
        )
    if clock.changed:
        shown = [
            f"{np.datetime_as_string(gps_times(np.array([time_ms]))[0], unit='s')} GPST: "
            f"{before} s to {after} s, k = {after - before:+d}"
            for time_ms, before, after in clock.changes
        ]
        more = clock.changed - len(shown)
        found.append(
            Finding(
                "E11",
                "error",
                "the receiver's difference between GPS time and UTC (DeltaLS) changes",
                evidence="; ".join(shown) + (f"; and {more:,} more" if more else ""),
                cure="--leap-slip split, and look at both parts before they are joined",
            )
        )
    return found


def leftover_findings(leftovers: Leftovers) -> tuple[Finding, ...]:
    """E10 and E24 on what is no block."""
    found = []
    size = leftovers.path.stat().st_size
    foreign, cut = leftovers.finish()
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
