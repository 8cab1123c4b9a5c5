"""What a part of the check hands back: a finding, and the repair that cures it beyond doubt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sbas.findings import Finding, Severity
from sbas.timescales import NS_PER_S


@dataclass(frozen=True)
class Judged:
    """A finding, and fields of `Repairs` that cure it; none where a person has to decide."""

    finding: Finding
    repair: Mapping[str, Any] = field(default_factory=dict)


def judged(
    code: str,
    severity: Severity,
    message: str,
    *,
    where: str = "",
    evidence: str = "",
    cure: str = "",
    repair: Mapping[str, Any] | None = None,
) -> Judged:
    """A judgement from its words."""
    return Judged(Finding(code, severity, message, where, evidence, cure), repair or {})


def counted(n: int, what: str) -> str:
    """A number with its noun, such as "1 gap" or "2,000 gaps"."""
    return f"{n:,} {what}" if n == 1 else f"{n:,} {what}s"


def stamp(ns: int) -> str:
    """A time in ns of GPS time, to the millisecond."""
    return str(np.datetime64(ns, "ns").astype("M8[ms]"))


def place(row: int, ns: int) -> str:
    """Row and time of an epoch."""
    return f"row {row:,}, {stamp(ns)} GPST"


def seconds(ns: float) -> str:
    """A duration in seconds, with days or hours where they say more."""
    s = ns / NS_PER_S
    if abs(s) >= 2 * 86400:
        return f"{s:.9g} s ({s / 86400:.6g} days)"
    return f"{s:.9g} s ({s / 3600:.4g} h)" if abs(s) >= 2 * 3600 else f"{s:.9g} s"
