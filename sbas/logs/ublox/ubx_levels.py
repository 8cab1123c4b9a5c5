"""NAV-PL: protection levels of the receiver's own, which are not those of DO-229.

Each has a target misleading information risk (TMIR) of coefficient x 10^exponent percent an
epoch, and there is one level an axis: north, east, down; along, across, vertical; or semi-major,
semi-minor, vertical. Source: pyubx2 1.4.0, `nav_pl.rs` of ublox-rs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Set
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sbas.logs.septentrio.sbf_decode import Decoded
from sbas.logs.ublox.ubx_messages import Raw
from sbas.recording import Flag

HorizontalLevel = Literal["norm", "max"]
"""One level of two: the root of the sum of squares, which no error within both axes exceeds, or
the larger, which such an error may exceed by a factor of up to 1.41."""

_MISSING = 4294967295
_FRAMES = (1, 2, 3)

Floats = NDArray[np.float64]


@dataclass
class LevelCounts:
    """What became of NAV-PL messages.

    Parameters
    ----------
    messages : in all.
    risks : stated risk an epoch -> epochs whose levels may be used.
    stated : stated risk an epoch -> messages, whether to be used or not.
    invalid : why not -> messages that may not be used.
    """

    messages: int = 0
    risks: Counter[float] = field(default_factory=Counter)
    stated: Counter[float] = field(default_factory=Counter)
    invalid: Counter[str] = field(default_factory=Counter)

    def add(self, other: LevelCounts) -> None:
        self.messages += other.messages
        self.risks.update(other.risks)
        self.stated.update(other.stated)
        self.invalid.update(other.invalid)

    @property
    def risk(self) -> float | None:
        """The most frequent risk of usable levels, else of any; of two as frequent the larger."""
        counts = self.risks or self.stated
        return max(counts, key=lambda risk: (counts[risk], risk)) if counts else None


def stated_risk(digits: NDArray[np.uint8], exponent: NDArray[np.int8]) -> Floats:
    """(n,) risk an epoch of coefficients and exponents that mean percent; NaN unless in (0, 1).

    Equal risks give equal numbers, however they are written: 5 x 10^0 and 50 x 10^-1.
    """
    pair = digits.astype(np.int64) << 8 | exponent.astype(np.int64) + 128
    pairs, index = np.unique(pair, return_inverse=True)
    values = [float(f"{p >> 8}e{(p & 255) - 128 - 2}") for p in pairs.tolist()]
    risk = np.array([value if 0 < value < 1 else np.nan for value in values])
    return risk[index] if len(pairs) else np.empty(0)


def _reasons(raw: Raw, unusable: NDArray[np.bool_], risk: Floats) -> Counter[str]:
    """Why levels may not be used, in the receiver's words where it gives a reason."""
    found: Counter[str] = Counter()
    valid, axes = raw["valid"][unusable], raw["axes"][unusable]
    code = raw["reason"][unusable].astype(np.int64)
    declared = valid != 1
    for reason, count in zip(*np.unique(code[declared], return_counts=True), strict=True):
        if 1 <= reason <= 29:
            text = f"not trustworthy (reason {reason})"
        elif 30 <= reason <= 100:
            text = f"set-up not verified (reason {reason})"
        else:
            text = "no reason stated" if reason == 0 else f"reason {reason}"
        found[text] += int(count)
    no_axes = ~declared & ~np.isin(axes, _FRAMES)
    for frame, count in zip(*np.unique(axes[no_axes], return_counts=True), strict=True):
        found[f"valid, but in frame {frame}"] += int(count)
    no_risk = ~declared & ~no_axes & np.isnan(risk[unusable])
    if count := int(no_risk.sum()):
        found["valid, but without a risk between 0 and 1"] += count
    return found


def levels(
    raw: Raw, want: Set[str], horizontal: HorizontalLevel
) -> tuple[Decoded, Floats, LevelCounts]:
    """Columns `hpl_m`, `vpl_m`, `flags` of NAV-PL, the risk of each, and the counts.

    Parameters
    ----------
    raw : fields of NAV-PL.
    want : columns to fill.
    horizontal : how the two horizontal levels become one.

    Returns
    -------
    Decoded; (n,) risk an epoch, NaN where the levels may not be used; LevelCounts.
    """
    out = Decoded()
    risk = stated_risk(raw["risk_digits"], raw["risk_exponent"])
    unusable = (raw["valid"] != 1) | ~np.isin(raw["axes"], _FRAMES) | np.isnan(risk)
    counts = LevelCounts(len(risk), _counted(risk[~unusable]), _counted(risk))
    if unusable.any():
        counts.invalid = _reasons(raw, unusable, risk)
    axes = [_metres(raw[f"level_{k}"]) for k in (1, 2, 3)]
    flat = np.hypot(axes[0], axes[1]) if horizontal == "norm" else np.maximum(axes[0], axes[1])
    for name, values in (("hpl_m", flat), ("vpl_m", axes[2])):
        missing = np.isnan(values)
        if missing.any():
            out.count(name, str(_MISSING), missing)
            if "flags" in want:
                out.add_flags(Flag.PL_SENTINEL, missing)
        if name in want:
            values[unusable] = np.nan
            out.columns[name] = values
    if "flags" in want:
        out.add_flags(Flag.PL_DECLARED_INVALID, unusable)
    return out, np.where(unusable, np.nan, risk), counts


def _counted(risk: Floats) -> Counter[float]:
    values, counts = np.unique(risk[~np.isnan(risk)], return_counts=True)
    return Counter(dict(zip(values.tolist(), counts.tolist(), strict=True)))


def _metres(raw: NDArray[Any]) -> Floats:
    metres = raw / 1000.0
    metres[raw == _MISSING] = np.nan
    return metres
