"""How far two receivers' positions lie apart, and whether an offset stays the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray
from scipy import special

from sbas.integrity.comparison.pairing import CommonEpochs
from sbas.recording_survey import GAP_STEPS
from sbas.timescales import NS_PER_S
from sbas.truth import TruePosition, east_north_up_m

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Frame = Literal["east, north, up", "along, right, up"]

MOVING_MPS = 1.0
"""Above this speed a direction of travel is formed."""
LEAST_OFFSET_M = 0.05
"""A smaller constant offset is not reported: choice of this package."""
_SIGNIFICANCE = 0.0027 / 2
_MIN_EFFECTIVE = 5.0


@dataclass(frozen=True, eq=False)
class PositionDifference:
    """(p,) position of A less that of B at the same instant, in B's tangent plane [m].

    NaN where a position is missing or could not be brought to the other's time. `interpolated`
    positions were moved by at most `max_shift_s`.
    """

    east_m: Floats
    north_m: Floats
    up_m: Floats
    speed_mps: Floats
    along_m: Floats
    right_m: Floats
    interpolated: int
    max_shift_s: float

    @property
    def horizontal_m(self) -> Floats:
        return np.hypot(self.east_m, self.north_m)


@dataclass(frozen=True)
class ConstantOffset:
    """A difference that stays: where it points [m], in which frame, and what it may be.

    `delay_s` is set instead where the difference along the track grows with the speed.
    """

    frame: Frame
    offset_m: tuple[float, float, float]
    scatter_m: tuple[float, float, float]
    delay_s: float | None
    effective: float

    def __str__(self) -> str:
        if self.delay_s is not None:
            return (
                "the difference along the track grows with the speed: A's positions are "
                f"{abs(self.delay_s):.3g} s {'ahead of' if self.delay_s > 0 else 'behind'} B's, "
                "which points to the time stamps"
            )
        values = ", ".join(f"{x:+.2f}" for x in self.offset_m)
        return (
            f"a constant offset of {values} m ({self.frame}) points to the antenna, the lever arm "
            "or the reference frame, not to the mode"
        )


def position_difference(
    a: pd.DataFrame,
    b: pd.DataFrame,
    common: CommonEpochs,
    *,
    interval_a_ns: int,
    interval_b_ns: int,
    moving: bool,
) -> PositionDifference:
    """Position differences of the paired epochs.

    Parameters
    ----------
    a, b : tables with lat_deg, lon_deg, height_m.
    common : their common epochs.
    interval_a_ns, interval_b_ns : sampling intervals [ns].
    moving : then the positions of the finer recording (B on a tie) are brought to the other's
        times where these differ: by a cubic in ECEF through the four nearest epochs, or a line
        where these are not all there; between neighbours at most 1.5 intervals apart.

    Returns
    -------
    PositionDifference.
    """
    paired = common.paired
    row_a, row_b = common.row_a[paired], common.row_b[paired]
    time_a, time_b = _time_ns(a)[row_a], _time_ns(b)[row_b]
    ecef_a, ecef_b = _ecef(a)[row_a], _ecef(b)[row_b]
    offset = common.offset_ns[paired]
    shifted = np.flatnonzero(offset != 0) if moving else np.empty(0, np.int64)
    a_is_finer = interval_a_ns < interval_b_ns
    if shifted.size and a_is_finer:
        ecef_a[shifted] = _at(a, time_b[shifted], int(GAP_STEPS * interval_a_ns))
    elif shifted.size:
        ecef_b[shifted] = _at(b, time_a[shifted], int(GAP_STEPS * interval_b_ns))
    time = time_b if a_is_finer else time_a
    flat_a = np.isnan(a["height_m"].to_numpy()[row_a])
    flat_b = np.isnan(b["height_m"].to_numpy()[row_b])
    lat_b, lon_b, height_b = (np.asarray(x) for x in pymap3d.ecef2geodetic(*ecef_b.T))
    lat_a, lon_a, height_a = (np.asarray(x) for x in pymap3d.ecef2geodetic(*ecef_a.T))
    # A missing height must not spoil east and north: both are then formed at the same height.
    one = flat_a | flat_b
    height_a = np.where(one, height_b, height_a)
    nothing = np.zeros(height_b.size)
    true = TruePosition(lat_b, lon_b, height_b, nothing, nothing)
    east, north, up = east_north_up_m(lat_a, lon_a, height_a, true)
    speed, direction = _travel(lat_a, lon_a, height_a, time, common.interval_ns)
    return PositionDifference(
        east,
        north,
        np.where(one, np.nan, up),
        speed,
        east * direction[0] + north * direction[1],
        east * direction[1] - north * direction[0],
        int(np.isfinite((ecef_a + ecef_b)[shifted, 0]).sum()),
        float(np.abs(offset[shifted]).max()) / NS_PER_S if shifted.size else 0.0,
    )


def _time_ns(table: pd.DataFrame) -> Ints:
    time: Ints = table.index.to_numpy().astype(np.int64)
    return time


def _ecef(table: pd.DataFrame) -> Floats:
    lat, lon, height = (table[c].to_numpy() for c in ("lat_deg", "lon_deg", "height_m"))
    xyz = pymap3d.geodetic2ecef(lat, lon, np.nan_to_num(height))
    return np.column_stack([np.asarray(x) for x in xyz])


def _at(table: pd.DataFrame, time_ns: Ints, max_step_ns: int) -> Floats:
    """(n, 3) ECEF positions of a table at other times; NaN where a neighbour is missing.

    A cubic through the two epochs before and the two after; a line where only one of each is
    near enough. Source: Lagrange's formula, Abramowitz and Stegun 25.2.1.
    """
    knots, ecef = _time_ns(table), _ecef(table)
    right = np.searchsorted(knots, time_ns, side="left")
    inside = (right > 0) & (right < knots.size)
    right = np.clip(right, 1, knots.size - 1)
    linear = _lagrange(knots, ecef, time_ns, right[:, None] + np.array([-1, 0]))
    joined = np.diff(knots) <= max_step_ns
    rows = right[:, None] + np.array([-2, -1, 0, 1])
    whole = (rows[:, 0] >= 0) & (rows[:, 3] < knots.size)
    rows = np.clip(rows, 0, knots.size - 1)
    whole &= joined[np.clip(rows[:, :3], 0, joined.size - 1)].all(axis=1)
    cubic = np.full(linear.shape, np.nan)
    cubic[whole] = _lagrange(knots, ecef, time_ns[whole], rows[whole])
    found = np.where(np.isfinite(cubic), cubic, linear)
    return np.where((inside & joined[right - 1])[:, None], found, np.nan)


def _lagrange(knots: Ints, values: Floats, time_ns: Ints, rows: Ints) -> Floats:
    """(n, 3) polynomial through the (n, k) rows of values, at the times."""
    # Seconds from the instant that is asked: nothing is lost to the size of GPS time.
    x = (knots[rows] - time_ns[:, None]) / NS_PER_S
    result = np.zeros((time_ns.size, values.shape[1]))
    for i in range(rows.shape[1]):
        others = np.delete(x, i, axis=1)
        weight = np.prod(others / (others - x[:, i : i + 1]), axis=1)
        result += weight[:, None] * values[rows[:, i]]
    return result


def _travel(
    lat: Floats, lon: Floats, height: Floats, time_ns: Ints, interval_ns: int
) -> tuple[Floats, Floats]:
    """(p,) speed [m/s] and (2, p) unit vector east, north of travel, from neighbours of a pair."""
    speed, direction = np.full(lat.size, np.nan), np.full((2, lat.size), np.nan)
    if lat.size < 3:
        return speed, direction
    span = time_ns[2:] - time_ns[:-2]
    before = TruePosition(lat[:-2], lon[:-2], height[:-2], height[:-2], height[:-2])
    east, north, _ = east_north_up_m(lat[2:], lon[2:], height[2:], before)
    length = np.hypot(east, north)
    near = span <= int(2 * GAP_STEPS * interval_ns)
    speed[1:-1] = np.where(near, length / (span / NS_PER_S), np.nan)
    known = near & (speed[1:-1] > MOVING_MPS)
    unit = np.stack([east, north]) / np.where(length > 0, length, 1.0)
    direction[:, 1:-1] = np.where(known, unit, np.nan)
    return speed, direction


def constant_offset(
    difference: PositionDifference, *, interval_s: float, tau_s: float, moving: bool
) -> ConstantOffset | None:
    """The offset between two receivers that stays the same, if there is one.

    Parameters
    ----------
    difference : of the paired epochs.
    interval_s : between them [s].
    tau_s : 1/e time of the differences [s]; that of the errors is the safe choice.
    moving : then an offset that turns with the vehicle, and one that grows with its speed, are
        looked for as well, and the one that leaves the least scatter is given.

    Returns
    -------
    None where no component's mean is beyond three standard errors (Student's t for T/(2 tau)
    effective values, at least 5) and 0.05 m.
    """
    found: list[tuple[float, ConstantOffset]] = []
    plain = (difference.east_m, difference.north_m, difference.up_m)
    turned = (difference.along_m, difference.right_m, difference.up_m)
    frames: list[tuple[Frame, tuple[Floats, Floats, Floats]]] = [("east, north, up", plain)]
    if moving:
        frames.append(("along, right, up", turned))
    known = np.isfinite(turned[0])
    for frame, components in frames:
        mean, scatter, left = [], [], 0.0
        significant = False
        # The frames are judged on the same epochs: those with a direction of travel.
        chosen = known if moving and known.sum() >= 2 else np.isfinite(plain[0])
        effective = float(chosen.sum()) * interval_s / (2 * max(tau_s, interval_s))
        if effective < _MIN_EFFECTIVE:
            return None
        limit = -float(special.stdtrit(effective - 1, _SIGNIFICANCE))
        for axis, component in enumerate(components):
            values = component[chosen & np.isfinite(component)]
            centre, spread = _robust(values)
            mean.append(centre)
            scatter.append(spread)
            standard_error = spread / np.sqrt(effective)
            significant |= abs(centre) > max(limit * standard_error, LEAST_OFFSET_M)
            left += spread**2 if axis < 2 else 0.0
        if significant:
            offset = ConstantOffset(frame, _triple(mean), _triple(scatter), None, effective)
            found.append((left, offset))
    if moving and known.sum() >= 2:
        delayed = _delay(difference, known, interval_s, tau_s)
        if delayed is not None:
            found.append(delayed)
    return min(found, key=lambda pair: pair[0])[1] if found else None


def _delay(
    difference: PositionDifference, known: NDArray[np.bool_], interval_s: float, tau_s: float
) -> tuple[float, ConstantOffset] | None:
    """The time offset that explains the difference along the track, and the scatter it leaves."""
    speed, along = difference.speed_mps[known], difference.along_m[known]
    effective = along.size * interval_s / (2 * max(tau_s, interval_s))
    slope, intercept = 0.0, float(np.median(along))
    kept = np.ones(along.size, bool)
    # Three rounds of clipping: outliers must not turn the line.
    for _ in range(3):
        v = speed[kept] - speed[kept].mean()
        spread_v = float(v @ v)
        if spread_v <= 0:
            return None
        slope = float(v @ along[kept]) / spread_v
        intercept = float(along[kept].mean() - slope * speed[kept].mean())
        rest = along - intercept - slope * speed
        kept = np.abs(rest) <= 4 * max(_robust(rest)[1], 1e-6)
    scatter = _robust(along - intercept - slope * speed)[1]
    limit = -float(special.stdtrit(effective - 1, _SIGNIFICANCE))
    error = scatter / (float(np.std(speed[kept])) * np.sqrt(effective))
    if abs(slope) <= limit * error or abs(slope) * float(np.median(speed)) < LEAST_OFFSET_M:
        return None
    right, right_scatter = _robust(difference.right_m[known])
    up, up_scatter = _robust(difference.up_m[known])
    offset = ConstantOffset(
        "along, right, up",
        (intercept, right, up),
        (scatter, right_scatter, up_scatter),
        slope,
        effective,
    )
    return scatter**2 + right_scatter**2, offset


def _robust(values: Floats) -> tuple[float, float]:
    """Median, and 1.4826 times the median absolute deviation from it; NaN is left out."""
    values = values[np.isfinite(values)]
    if values.size == 0:
        return 0.0, 0.0
    centre = float(np.median(values))
    return centre, 1.4826 * float(np.median(np.abs(values - centre)))


def _triple(values: list[float]) -> tuple[float, float, float]:
    first, second, third = values
    return first, second, third
