"""Protection levels: zero, without the mode that defines them, in another unit (E07, E08, E13,
E23)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.input_check.judgement import Judged, counted, judged
from sbas.recording import MODES, SBAS_MODES, Flag, ProtectionLevelMeta
from sbas.recording_survey import Rows, Survey
from sbas.streaming import Distribution

Floats = NDArray[np.float64]

OTHER_KINDS = {
    "raim": "RAIM protects against faults of satellites, not by the service's corrections",
    "tmir": "the receiver states its own integrity risk",
    "receiver": "the receiver's own definition",
}
RATIO_RANGE = (0.1, 1000.0)
"""Levels over HDOP [m]: metres give some 5 to 100; beyond these limits the unit is another."""
PLAUSIBLE_M = (2.0, 600.0)
"""Medians of levels of the service lie within."""
STAND_INS = (999.9, 9999.0, 99999.0)
"""Numbers that programs write for "no level"."""
ALONE = 5.0
"""A stand-in is one where no other level lies within this factor of it."""
LOOSE = 100.0
"""Levels that many times the errors, and large beside HDOP, may be in cm."""
LOOSE_RATIO = 200.0


@dataclass
class _Levels:
    """The levels of one column: their sizes, beside HDOP too, and those equal to a stand-in."""

    sizes: Distribution = field(default_factory=Distribution)
    over_hdop: Distribution = field(default_factory=Distribution)
    stand_ins: dict[float, int] = field(default_factory=lambda: dict.fromkeys(STAND_INS, 0))
    near: dict[float, int] = field(default_factory=lambda: dict.fromkeys(STAND_INS, 0))
    others: int = 0

    def update(self, level_m: Floats, hdop: Floats) -> None:
        """More levels [m], NaN where there is none of the service."""
        known = np.isfinite(level_m) & (level_m > 0)
        odd = np.isin(level_m, STAND_INS)
        for value in STAND_INS:
            self.stand_ins[value] += int(np.sum(level_m == value))
            within = (level_m > value / ALONE) & (level_m < value * ALONE)
            self.near[value] += int(np.sum(within & ~odd))
        self.others += int(np.sum(known & ~odd))
        self.sizes.update(level_m[known])
        known &= hdop > 0
        self.over_hdop.update(level_m[known] / hdop[known])

    def standing_in(self) -> dict[float, int]:
        """Stand-ins that are there twice or more, with no other level near, by their count."""
        return {
            value: n for value, n in self.stand_ins.items()
            if n >= 2 and self.others and not self.near[value]
        }  # fmt: skip


class LevelModes:
    """Levels by the mode of their epoch, and their size beside HDOP."""

    COLUMNS = ("hpl_m", "vpl_m", "hdop", "mode", "flags")

    def __init__(self) -> None:
        self.by_mode = np.zeros(len(MODES) + 1, np.int64)
        self.flagged = 0
        self.modes_known = 0
        self.levels = {"hpl_m": _Levels(), "vpl_m": _Levels()}

    def update(self, rows: Rows) -> None:
        hpl, mode = rows.values["hpl_m"], rows.values["mode"]
        left_out = (rows.values["flags"] & _SAID) != 0
        level = np.isfinite(hpl) & (hpl > 0)
        self.by_mode += np.bincount(mode[level & ~left_out] + 1, minlength=len(MODES) + 1)
        self.flagged += int(np.sum(level & left_out))
        self.modes_known += int(np.sum(mode >= 0))
        service = ~left_out & np.isin(mode, _SERVICE)
        for name, levels in self.levels.items():
            levels.update(np.where(service, rows.values[name], np.nan), rows.values["hdop"])


_SERVICE = (-1, *(MODES.index(mode) for mode in SBAS_MODES))
_SAID = np.uint32(Flag.PL_OUTSIDE_SBAS | Flag.PL_DECLARED_INVALID)


def not_positive(facts: Survey) -> Iterator[Judged]:
    """E13: levels that would pass for a perfect bound."""
    if facts.levels_not_positive:
        yield judged(
            "E13", "error", f"{facts.levels_not_positive:,} protection levels are zero or negative",
            evidence="they would pass for a perfect bound",
            cure="--pl-zero missing",
            repair={"pl_zero": "missing"},
        )  # fmt: skip


def definition(
    seen: LevelModes, pl: ProtectionLevelMeta, told: tuple[Finding, ...]
) -> Iterator[Judged]:
    """E23: levels whose mode or kind is not that of the service.

    Parameters
    ----------
    seen : levels by mode.
    pl : what the source says of its levels.
    told : findings of the reader; what it said is not said again.
    """
    unflagged = int(seen.by_mode.sum())
    if any(f.code == "E23" for f in told):
        return
    if seen.flagged:
        yield judged(
            "E23", "warning",
            f"{counted(seen.flagged, 'level')} of a fix outside SBAS, or declared invalid",
            evidence=f"flagged by the reader; {counted(unflagged, 'level')} without such a flag",
            cure="nothing to do: they are counted as without level",
        )  # fmt: skip
    if unflagged == 0:
        return
    if pl.kind in OTHER_KINDS:
        risk = "" if pl.risk is None else f"; stated risk {pl.risk:g} per {pl.risk_per or 'epoch'}"
        yield judged(
            "E23", "warning", f"the protection levels are of the kind {pl.kind!r}, not DO-229's",
            evidence=f"{counted(unflagged, 'level')}; {OTHER_KINDS[pl.kind]}{risk}",
            cure="--pl-kind do229, only where the receiver's documentation says so",
        )  # fmt: skip
        return
    outside = {m: int(seen.by_mode[i + 1]) for i, m in enumerate(MODES) if m not in SBAS_MODES}
    if number := sum(outside.values()):
        yield judged(
            "E23", "warning", f"{counted(number, 'level')} in a mode that does not define it",
            evidence=", ".join(f"{n:,} in mode {m!r}" for m, n in outside.items() if n)
            + f", of {unflagged:,}",
            cure="nothing to do: they are counted as without level",
        )  # fmt: skip
    if seen.modes_known == 0 and pl.kind == "unknown" and pl.k_h is None:
        yield judged(
            "E23", "warning", "protection levels without the mode that defines them",
            evidence=f"{counted(unflagged, 'level')}, no epoch states its mode: K may be 6.00 "
            "(precision approach) or 6.18 (non-precision), or it is no level of the service",
            cure="--mode-map, a column mode with sbas_pa and sbas_npa, or --pl-kind do229",
        )  # fmt: skip


def stand_ins(seen: LevelModes) -> Iterator[Judged]:
    """E07: levels of 999.9, 9999 or 99999 that nothing else comes near: "no level" in figures."""
    found = {name: levels.standing_in() for name, levels in seen.levels.items()}
    found = {name: values for name, values in found.items() if values}
    if not found:
        return
    values = sorted({value for one in found.values() for value in one})
    yield judged(
        "E07", "warning", "levels seem to stand for 'no level'; they count as far too large",
        evidence="; ".join(
            f"{name}: {n:,} x {value:g}, no other within a factor of {ALONE:g}"
            for name, one in found.items() for value, n in one.items()
        ),
        cure=" or ".join(f"--pl-sentinel {value:g}" for value in values),
        repair={"pl_sentinel": values[0]},
    )  # fmt: skip


def unit(
    seen: LevelModes,
    pl: ProtectionLevelMeta,
    *,
    errors_m: Mapping[str, float],
) -> Iterator[Judged]:
    """E08: levels that are no metres, by their size beside HDOP and, with a truth, the errors.

    Each column by itself. An error where a second measure agrees, else a warning: an unusable
    level may be large.

    Parameters
    ----------
    seen, pl : of the recording.
    errors_m : median size of the errors that each column bounds, where a truth tells them [m].
    """
    if pl.kind in OTHER_KINDS:
        return
    for name, levels in seen.levels.items():
        yield from _unit_of(name, levels, errors_m.get(name, float("nan")))


def _unit_of(name: str, levels: _Levels, error_m: float) -> Iterator[Judged]:
    median = levels.sizes.quantile(0.5)
    constant = levels.sizes.min == levels.sizes.max
    if not levels.sizes.count or (constant and median >= 1e4):
        return
    ratio = levels.over_hdop.quantile(0.5)
    large, small = median > 2e3, median < 0.3
    loose = median > LOOSE * error_m and (median if np.isnan(ratio) else ratio) > LOOSE_RATIO
    if not (large or small or loose):
        return
    sure = (large and ratio > RATIO_RANGE[1]) or (small and ratio < RATIO_RANGE[0])
    if small and np.isfinite(error_m):
        sure |= error_m > 10 * median
    candidates = [
        unit for unit, size in {"mm": 1e-3, "cm": 1e-2, "km": 1e3}.items()
        if PLAUSIBLE_M[0] <= median * size <= PLAUSIBLE_M[1]
    ]  # fmt: skip
    if (small and not sure) or not candidates:
        return
    short = name.removesuffix("_m").upper()
    known = {f"{short} / HDOP median": ratio, "error median": error_m}
    shown = "".join(f", {what} {v:.4g} m" for what, v in known.items() if np.isfinite(v))
    yield judged(
        "E08", "error" if sure else "warning",
        f"protection levels ({short}) are in another unit than metres",
        evidence=f"{short} median {median:.6g} m{shown}; plausible as {', '.join(candidates)}",
        cure=f"--unit {name}={candidates[0]}, or what the file's documentation says",
        repair={"unit": {name: candidates[0]}} if sure and len(candidates) == 1 else {},
    )  # fmt: skip
