"""The likeliest cause of one event, by checks in a fixed order and shares of its log ratio.

HPL = K * geometry * range sigma: ln(HPL/HPL_usual) = ln(K/K_usual) + ln(HDOP/HDOP_usual) +
remainder. A change of state (mode, GEO, age) that came with the event takes the remainder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sbas.integrity.causes.event_context import Context
from sbas.recording import MODES

Cause = Literal[
    "sentinel_or_unit",
    "gap",
    "receiver_restart",
    "mode_change",
    "satellite_loss",
    "geometry",
    "geo_change",
    "correction_age",
    "ionosphere_lost",
    "place",
    "local_error",
    "unexplained",
]

CAUSES: dict[Cause, str] = {
    "sentinel_or_unit": "a value that stands for missing, or is in another unit",
    "gap": "the first epochs after a gap",
    "receiver_restart": "the receiver started anew: after a gap, or as the record begins",
    "mode_change": "another mode, with another kind of level",
    "satellite_loss": "satellites lost",
    "geometry": "another geometry (HDOP) with as many satellites",
    "geo_change": "another SBAS satellite",
    "correction_age": "old corrections",
    "ionosphere_lost": "ionospheric corrections lost (PA to NPA)",
    "place": "another environment",
    "local_error": "an error that the level does not know of (HPE without HPL)",
    "unexplained": "nothing in the recording explains it",
}
"""Causes in the order in which they are checked, with their meaning."""

DECISIVE = 0.8
"""A share of the log ratio from which the first cause in the order is named."""
LIKELY = 0.5
"""Without a decisive cause the largest share is named from here on."""

_SENTINELS_M = (
    65.535, 99.99, 655.35, 999.0, 999.9, 999.99, 6553.5, 8000.0, 9999.0, 9999.9, 32767.0, 65534.0,
    65535.0, 99999.0, 99999.9, 999999.0, 4294967.295, 4294967295.0,
)  # fmt: skip
"""Numbers that stand for "no level" in receivers' formats: all-ones integers and rows of nines."""
_NO_LENGTH_M = 1e6
"""No position on Earth is that uncertain."""
_UNIT_FACTORS = (100.0, 1000.0)
"""Centimetres and millimetres read as metres, or the other way."""
_UNIT_TOLERANCE, _OTHER_END = 0.05, 0.3
"""How exactly the level steps by the factor at one end, and at the other, where something else
may have changed as well."""
_OLD_AGE = 2.0
"""Corrections twice as old as any of the calm epochs around are old."""
_SBAS_PA, _SBAS_NPA, _SBAS = (MODES.index(m) for m in ("sbas_pa", "sbas_npa", "sbas"))


@dataclass(frozen=True)
class Explanation:
    """The likeliest cause, its share of the event's log ratio, and what speaks for it.

    `settled` says that the share is decisive. `shares` are those of K, geometry and the rest
    for a spike, of the error and the level for misleading information; NaN where not known.
    """

    cause: Cause
    share: float
    settled: bool
    shares: dict[str, float]
    evidence: str


def explain_spike(context: Context) -> Explanation:
    """The likeliest cause of a level far above the usual one.

    References
    ----------
    Order and shares: integrity statistics, 7. What differs across a gap did not change "within
    two intervals", so a rise that begins after a gap is the gap's, whatever else is new.
    """
    arrays, peak = context.arrays, context.peak
    hpl, usual = float(arrays.hpl_m[peak]), float(arrays.reference_m[peak])
    log_ratio = math.log(hpl / usual)
    k = _log_of(arrays.k[peak], context.usual(arrays.k)) / log_ratio
    geometry = _log_of(arrays.hdop[peak], context.usual(arrays.hdop)) / log_ratio
    rest = 1 - np.nan_to_num(k) - np.nan_to_num(geometry)
    shares = {"k_factor": k, "geometry": geometry, "remainder": float(rest)}
    found: dict[Cause, tuple[float, str]] = {}

    if text := _sentinel_or_unit(context, rising=True):
        found["sentinel_or_unit"] = 1.0, text
    if context.begins_after_gap:
        found[_kind_of_gap(context)] = 1.0, f"began after {context.gap_s:g} s without epochs"
    mode = context.changed(arrays.mode)
    lost_ionosphere = mode is not None and mode[0] == _SBAS_PA and mode[1] in (_SBAS_NPA, _SBAS)
    if mode is not None:
        # Between PA and NPA only K follows from the mode itself.
        between = {mode[0], mode[1]} <= {_SBAS_PA, _SBAS_NPA, _SBAS}
        share = float(np.nan_to_num(k)) + (0.0 if between else rest)
        found["mode_change"] = share, f"mode {MODES[mode[0]]} to {MODES[mode[1]]}"
    satellites = context.fewer(arrays.n_sv)
    # Without HDOP the number of satellites stands for the geometry.
    by_geometry = rest if math.isnan(geometry) and satellites else float(np.nan_to_num(geometry))
    ratio = arrays.hdop[peak] / context.usual(arrays.hdop)
    hdop = f"HDOP times {ratio:.2f}" if math.isfinite(ratio) else "HDOP not known"
    if satellites is not None:
        text = f"satellites {satellites[0]} to {satellites[1]}, {hdop}"
        found["satellite_loss"] = by_geometry, text
        if context.foot == 0:
            found["receiver_restart"] = by_geometry, f"the record begins with it; {text}"
    elif ratio > 1:
        found["geometry"] = by_geometry, hdop
    geo = context.changed(arrays.geo_prn)
    if geo is not None:
        found["geo_change"] = rest, f"GEO PRN {geo[0]} to {geo[1]}"
    if text := _old_corrections(context):
        found["correction_age"] = rest, text
    if lost_ionosphere:
        found["ionosphere_lost"] = rest, "mode sbas_pa to sbas_npa, same geometry"
    if context.changed(arrays.environment) is not None:
        found["place"] = rest, "the environment label changed with it"
    return _decide(found, shares)


def explain_misleading(context: Context) -> Explanation:
    """The likeliest cause of an error near or beyond its level.

    Notes
    -----
    ln(ratio/ratio_usual), ratio = HPE/HPL, is the sum of what the error rose and the level fell.
    Satellites and HDOP are no cause: they raise error and level alike.
    """
    arrays, peak = context.arrays, context.peak
    hpe_usual, hpl_usual = context.usual(arrays.hpe_m), context.usual(arrays.hpl_m)
    risen = _log_of(arrays.hpe_m[peak], hpe_usual)
    fallen = -_log_of(arrays.hpl_m[peak], hpl_usual)
    log_ratio = risen + fallen
    if not log_ratio > math.log(1.2):
        text = "no calm epoch around" if math.isnan(log_ratio) else "as large before and after"
        return Explanation(
            "unexplained", math.nan, False, {"error": math.nan, "level": math.nan},
            f"{text}: check the truth, the antenna and the datum",
        )  # fmt: skip
    error, level = risen / log_ratio, fallen / log_ratio
    shares = {"error": error, "level": level}
    found: dict[Cause, tuple[float, str]] = {}
    if text := _sentinel_or_unit(context, rising=False):
        found["sentinel_or_unit"] = level, text
    if context.begins_after_gap:
        found[_kind_of_gap(context)] = 1.0, f"began after {context.gap_s:g} s without epochs"
    mode = context.changed(arrays.mode)
    if mode is not None:
        lost = mode[0] == _SBAS_PA and mode[1] in (_SBAS_NPA, _SBAS)
        cause: Cause = "ionosphere_lost" if lost else "mode_change"
        found[cause] = 1.0, f"mode {MODES[mode[0]]} to {MODES[mode[1]]}"
    geo = context.changed(arrays.geo_prn)
    if geo is not None:
        found["geo_change"] = 1.0, f"GEO PRN {geo[0]} to {geo[1]}"
    if text := _old_corrections(context):
        found["correction_age"] = error, text
    text = f"HPE times {math.exp(risen):.3g}, HPL times {math.exp(-fallen):.3g}"
    found["local_error"] = error, f"{text}: a local error, or a failure that the service missed"
    return _decide(found, shares)


def _decide(found: dict[Cause, tuple[float, str]], shares: dict[str, float]) -> Explanation:
    order = list(CAUSES)
    for cause in sorted(found, key=order.index):
        share, text = found[cause]
        if share >= DECISIVE:
            return Explanation(cause, share, True, shares, text)
    if found:
        cause = max(found, key=lambda name: found[name][0])
        share, text = found[cause]
        if share >= LIKELY:
            return Explanation(cause, share, False, shares, text)
    seen = "; ".join(f"{text} ({100 * share:.0f} %)" for share, text in found.values())
    text = f"only in part: {seen}" if seen else CAUSES["unexplained"]
    return Explanation("unexplained", math.nan, False, shares, text)


def _log_of(value: float, usual: float) -> float:
    """ln(value/usual); NaN where one of them is missing or not positive."""
    return math.log(value / usual) if value > 0 and usual > 0 else math.nan


def _sentinel_or_unit(context: Context, *, rising: bool) -> str:
    """What marks the level as no length in metres; empty where nothing does."""
    arrays = context.arrays
    hpl = arrays.hpl_m[context.first : context.last + 1]
    value = float(arrays.hpl_m[context.peak])
    if rising and ((value in _SENTINELS_M and np.all(hpl == value)) or value >= _NO_LENGTH_M):
        return f"HPL {value:g} m is a stand-in for 'missing'"
    # In another unit the level steps by a power of ten at both ends, from one epoch to the next.
    ends = [
        (context.first, context.first - 1) if context.first > 0 else None,
        (context.last, context.last + 1) if context.last + 1 < arrays.hpl_m.size else None,
    ]
    steps = [arrays.hpl_m[a] / arrays.hpl_m[b] for a, b in filter(None, ends)]
    for factor in _UNIT_FACTORS:
        expected = factor if rising else 1 / factor
        off = [abs(step / expected - 1) for step in steps]
        if off and min(off) < _UNIT_TOLERANCE and max(off) < _OTHER_END:
            return f"HPL steps by a factor of {expected:g} at once: another unit"
    return ""


def _kind_of_gap(context: Context) -> Cause:
    """A restart shows by satellites or modes that had to be found again after the gap."""
    arrays = context.arrays
    before, foot = context.foot - 1, context.foot
    fewer = 0 <= arrays.n_sv[foot] < arrays.n_sv[before]
    later = arrays.n_sv[foot : context.last + 2].max() > arrays.n_sv[foot]
    other_mode = arrays.mode[foot] >= 0 and arrays.mode[foot] != arrays.mode[before] >= 0
    return "receiver_restart" if (fewer and later) or other_mode else "gap"


def _old_corrections(context: Context) -> str:
    arrays = context.arrays
    calm = arrays.age_s[context.calm_around]
    calm = calm[np.isfinite(calm)]
    age = float(arrays.age_s[context.peak])
    if calm.size == 0 or not age > _OLD_AGE * float(calm.max()):
        return ""
    return f"corrections {age:g} s old, at most {calm.max():g} s around"
