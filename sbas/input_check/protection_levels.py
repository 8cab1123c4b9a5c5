"""Protection levels: zero, without the mode that defines them, in another unit (E08, E13, E23)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sbas.findings import Finding
from sbas.input_check.judgement import Judged, counted, judged
from sbas.recording import MODES, SBAS_MODES, Flag, ProtectionLevelMeta
from sbas.recording_survey import Rows, Survey
from sbas.streaming import Distribution

OTHER_KINDS = {
    "raim": "RAIM protects against faults of satellites, not by the service's corrections",
    "tmir": "the receiver states its own integrity risk",
    "receiver": "the receiver's own definition",
}
RATIO_RANGE = (0.1, 1000.0)
"""Levels over HDOP [m]: metres give some 5 to 100; beyond these limits the unit is another."""
PLAUSIBLE_M = (2.0, 600.0)
"""Medians of levels of the service lie within."""


class LevelModes:
    """Levels by the mode of their epoch, and their size beside HDOP."""

    COLUMNS = ("hpl_m", "hdop", "mode", "flags")

    def __init__(self) -> None:
        self.by_mode = np.zeros(len(MODES) + 1, np.int64)
        self.flagged = 0
        self.modes_known = 0
        self.over_hdop = Distribution()
        self.levels = Distribution()

    def update(self, rows: Rows) -> None:
        hpl, mode = rows.values["hpl_m"], rows.values["mode"]
        left_out = (rows.values["flags"] & _SAID) != 0
        level = np.isfinite(hpl) & (hpl > 0)
        self.by_mode += np.bincount(mode[level & ~left_out] + 1, minlength=len(MODES) + 1)
        self.flagged += int(np.sum(level & left_out))
        self.modes_known += int(np.sum(mode >= 0))
        level &= ~left_out & np.isin(mode, _SERVICE)
        self.levels.update(hpl[level])
        hdop = rows.values["hdop"]
        level &= hdop > 0
        self.over_hdop.update(hpl[level] / hdop[level])


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
    if unflagged == 0 or any(f.code == "E23" for f in told):
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


def unit(
    seen: LevelModes, pl: ProtectionLevelMeta, *, columns: tuple[str, ...], hpe_median_m: float
) -> Iterator[Judged]:
    """E08: levels that are no metres, by their size beside HDOP and, with a truth, the errors.

    An error where a second measure agrees, else a warning: an unusable level may be large.

    Parameters
    ----------
    seen, pl : of the recording.
    columns : those that it has.
    hpe_median_m : of the errors against the truth; NaN without.
    """
    median = seen.levels.quantile(0.5)
    constant = seen.levels.min == seen.levels.max
    if not seen.levels.count or pl.kind in OTHER_KINDS or (constant and median >= 1e4):
        return
    ratio = seen.over_hdop.quantile(0.5)
    large, small = median > 2e3, median < 0.3
    if not (large or small):
        return
    sure = ratio > RATIO_RANGE[1] if large else ratio < RATIO_RANGE[0]
    if small and np.isfinite(hpe_median_m):
        sure |= hpe_median_m > 10 * median
    candidates = [
        name for name, size in {"mm": 1e-3, "cm": 1e-2, "km": 1e3}.items()
        if PLAUSIBLE_M[0] <= median * size <= PLAUSIBLE_M[1]
    ]  # fmt: skip
    if (small and not sure) or not candidates:
        return
    known = {"HPL / HDOP median": ratio, "HPE median": hpe_median_m}
    shown = "".join(f", {name} {v:.4g} m" for name, v in known.items() if np.isfinite(v))
    first = candidates[0]
    cured = [name for name in ("hpl_m", "vpl_m") if name in columns]
    yield judged(
        "E08", "error" if sure else "warning", "protection levels are in another unit than metres",
        evidence=f"HPL median {median:.6g} m{shown}; plausible as {', '.join(candidates)}",
        cure=" ".join(f"--unit {name}={first}" for name in cured)
        + ", or what the file's documentation says",
        repair={"unit": dict.fromkeys(cured, first)} if sure and len(candidates) == 1 else {},
    )  # fmt: skip
