"""SBAS messages of any source: checked, sorted, and what was left out counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import bits_of, unsigned
from sbas.augmentation.network_time import stamps_against_network_time
from sbas.findings import Finding
from sbas.logs.checksums import crc24q_of_rows

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PREAMBLES = (0x53, 0x9A, 0xC6)
"""The three that follow each other on L1."""
L5_PREAMBLES = (0x5, 0xC, 0x6, 0x9, 0x3, 0xA)
"""The six of L5, four bits each; the type follows them."""
L5_KINDS = (31, 32, 34, 35, 36, 37, 39, 40, 42, 47, 48, 50, 51)
"""Message types that only exist on L5."""
SBAS_PRNS = range(120, 159)

LEFT_OUT = {
    "l5": "of L5",
    "crc": "with a wrong CRC",
    "preamble": "without an L1 preamble",
    "kind": "whose type is not the one stated beside it",
    "prn": "of no SBAS satellite",
    "repeated": "that came twice",
    "contradicting": "of one second that contradict each other",
    "unreadable": "that cannot be read",
}
"""Why messages are left out."""


@dataclass(frozen=True, eq=False)
class SbasMessages:
    """L1 messages of one or several SBAS satellites, by time and PRN.

    Parameters
    ----------
    time_s : (n,) GPS seconds (of 1980-01-06) at which the last bit came.
    prn : (n,) 120..158.
    kind : (n,) message type.
    frame : (n, 32) bytes: 250 bits from the first one received, then six that carry nothing.
    crc_checked : (n,) False where the source carries no CRC.
    bad_time_s, bad_prn : (b,) what came on L1 and was left out as damaged: the link was alive,
        the content lost.
    left_out : count by PRN and reason (a key of `LEFT_OUT`).
    findings : what is to be known about them.
    """

    time_s: Ints
    prn: Ints
    kind: Ints
    frame: NDArray[np.uint8]
    crc_checked: Bools
    bad_time_s: Ints
    bad_prn: Ints
    left_out: Mapping[tuple[int, str], int]
    findings: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return self.time_s.size

    @property
    def prns(self) -> tuple[int, ...]:
        """The satellites heard."""
        return tuple(np.unique(self.prn).tolist())

    def of_prn(self, prn: int) -> SbasMessages:
        """The messages of one satellite."""
        mine, bad = self.prn == prn, self.bad_prn == prn
        return replace(
            self,
            time_s=self.time_s[mine],
            prn=self.prn[mine],
            kind=self.kind[mine],
            frame=self.frame[mine],
            crc_checked=self.crc_checked[mine],
            bad_time_s=self.bad_time_s[bad],
            bad_prn=self.bad_prn[bad],
            left_out={key: count for key, count in self.left_out.items() if key[0] == prn},
        )


def checked_messages(
    time_s: Ints,
    prn: Ints,
    frame: NDArray[np.uint8],
    *,
    has_crc: Bools,
    crc_bad: Bools | None = None,
    l5: Bools | None = None,
    stated_kind: Ints | None = None,
    unreadable: int = 0,
    findings: tuple[Finding, ...] = (),
) -> SbasMessages:
    """Messages that pass every check, sorted by time and PRN.

    Parameters
    ----------
    time_s, prn, frame : (n,), (n,), (n, 32) as in SbasMessages, in any order.
    has_crc : (n,) True where bits 226 to 249 are the CRC as received.
    crc_bad : (n,) True where a receiver already found the CRC wrong.
    l5 : (n,) True where the source says that the message came on L5.
    stated_kind : (n,) message type that the source states beside the bits; -1 where none.
    unreadable : records of the source that gave no message at all.
    findings : of the source, handed on.

    Notes
    -----
    CRC-24Q over the 226 data bits, six zero bits in front (RTCA DO-229D, A.4.3.3). L5 messages
    have a preamble of four bits: one is told by its type where L1 has none, and by a preamble
    or a type that do not fit L1.
    """
    bits = bits_of(frame)
    kind = unsigned(bits, 8, 6)
    stated = np.full(time_s.size, -1) if stated_kind is None else stated_kind
    reason = np.full(time_s.size, "", dtype="U13")

    def mark(where: Bools, why: str) -> None:
        reason[where & (reason == "")] = why

    on_l5 = np.zeros(time_s.size, bool) if l5 is None else l5
    on_l1 = np.isin(unsigned(bits, 0, 8), PREAMBLES)
    crc_good = _crc_of(bits) == unsigned(bits, 226, 24)
    like_l5 = np.isin(unsigned(bits, 0, 4), L5_PREAMBLES) & np.where(
        stated >= 0,
        (stated == unsigned(bits, 4, 6)) & ~(on_l1 & (stated == kind)),
        has_crc & crc_good & ~on_l1,
    )
    mark((prn < SBAS_PRNS.start) | (prn >= SBAS_PRNS.stop), "prn")
    only_l5 = np.isin(np.where(stated >= 0, stated, kind), L5_KINDS)
    # Damage can turn a type into another; a valid CRC, or the source's word, cannot.
    mark(on_l5 | like_l5 | (only_l5 & ((stated >= 0) | crc_good)), "l5")
    mark(~on_l1, "preamble")
    mark((stated >= 0) & (stated != kind), "kind")
    wrong = has_crc & ~crc_good
    mark(wrong if crc_bad is None else wrong | crc_bad, "crc")
    good = np.flatnonzero(reason == "")
    by_prn = good[np.argsort(prn[good], kind="stable")]
    unsorted = bool(np.any((np.diff(time_s[by_prn]) < 0) & (np.diff(prn[by_prn]) == 0)))
    order = good[np.lexsort((prn[good], time_s[good]))]
    same = (np.diff(time_s[order]) == 0) & (np.diff(prn[order]) == 0)
    if same.any():
        data = np.packbits(bits[:, :226], axis=1)
        equal = np.all(data[order[1:]] == data[order[:-1]], axis=1)
        starts = np.concatenate([[True], ~same])
        group = np.cumsum(starts) - 1
        contradicted = np.zeros(group[-1] + 1, bool)
        np.logical_or.at(contradicted, group[1:], same & ~equal)
        reason[order[contradicted[group]]] = "contradicting"
        reason[order[~starts & ~contradicted[group]]] = "repeated"
        order = order[reason[order] == ""]
    damaged = np.isin(reason, ["crc", "preamble", "kind", "contradicting"])
    rejected = np.flatnonzero(reason != "")
    left_out = Counter(zip(prn[rejected].tolist(), reason[rejected].tolist(), strict=True))
    if unreadable:
        left_out[0, "unreadable"] = unreadable
    bad = np.flatnonzero(damaged)
    bad = bad[np.argsort(time_s[bad], kind="stable")]
    stamps = stamps_against_network_time(time_s[order], prn[order], kind[order], bits[order])
    return SbasMessages(
        time_s[order],
        prn[order],
        kind[order],
        frame[order],
        has_crc[order],
        time_s[bad],
        prn[bad],
        dict(left_out),
        (*findings, *_findings(left_out, order.size, unsorted), *stamps),
    )


def _crc_of(bits: NDArray[np.uint8]) -> Ints:
    padded = np.zeros((len(bits), 232), np.uint8)
    padded[:, 6:] = bits[:, :226]
    return crc24q_of_rows(np.packbits(padded, axis=1)).astype(np.int64)


def _findings(left_out: Mapping[tuple[int, str], int], kept: int, unsorted: bool) -> list[Finding]:
    found: list[Finding] = []
    sums: Counter[str] = Counter()
    for (_, why), count in left_out.items():
        sums[why] += count
    usual = {"l5", "prn", "repeated"}
    for why, count in sorted(sums.items()):
        satellites = sorted({p for (p, reason) in left_out if reason == why and p})
        found.append(
            Finding(
                "E24",
                "info" if why in usual else "warning",
                f"{count:,} messages {LEFT_OUT[why]} left out, {kept:,} kept",
                evidence=f"PRN {', '.join(map(str, satellites))}" if satellites else "",
            )
        )
    if unsorted:
        found.append(
            Finding("E14", "warning", "messages were not in the order of time and have been sorted")
        )
    return found
