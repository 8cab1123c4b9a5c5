"""Times in another scale than the truth's: the lag at which a moving recording fits it best (E02).

The sampled positions are held against the trajectory shifted by whole seconds, and where that
does not fit, by hours, a day or a week as well. The measure is the median horizontal distance
over epochs at which the truth moves: single failures, which the analysis is about, do not enter.
A lag counts only where blocks of time agree on it. Where nothing moves no lag can be seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.input_check.against_truth import Comparison
from sbas.input_check.judgement import Judged, judged
from sbas.recording_survey import Ints
from sbas.timescales import NS_PER_S, gps_to_utc, gpst_minus_utc_s
from sbas.truth import Trajectory

LARGEST_LAG_S = 40
FAR_S = (*(h * 3600 for h in range(-14, 15) if h), -86_400, 86_400, -604_800, 604_800)
"""Time zones, a wrong day and a wrong week."""
LEAST_WAY_M = 100.0
"""Way of the truth within `LARGEST_LAG_S` on both sides that makes an epoch one in motion."""
LEAST_MOVING = 30
LEAST_GAIN_M = 1.0
"""The best lag brings the positions nearer by this, and to half the distance."""
LEAST_LAG_S = 0.15
SPREADS = 3.0
HPL_SHARE = 0.1
"""A lag below 1 s counts by its way: what exceeds so many distances at the best lag, or this part
of the protection level, makes events that the receiver has not."""
POOR_FIT_M = 50.0
_BLOCKS = 10
_AGREEING = 0.7
_FAR_SAMPLES = 2000

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Lag:
    """Median distances at no lag (NaN: the truth does not reach) and at the best one."""

    lag_s: float
    at_zero_m: float
    at_best_m: float
    block_range_s: tuple[float, float]
    moving: int
    speed_mps: float


class _Track:
    """A trajectory in ECEF, read off by straight lines, NaN where its steps are too long."""

    def __init__(self, truth: Trajectory) -> None:
        table = truth.table
        known = table[["lat_deg", "lon_deg", "height_m"]].dropna()
        self.origin_ns = int(table.index.to_numpy()[0].astype(np.int64))
        self.time_s = (known.index.to_numpy().astype(np.int64) - self.origin_ns) / NS_PER_S
        self.ecef = np.stack(
            pymap3d.geodetic2ecef(*(known[name].to_numpy(float) for name in known.columns))
        )
        self.max_step_s = truth.max_step_s
        way = np.linalg.norm(np.diff(self.ecef, axis=1), axis=0)
        self.way_m = np.concatenate([[0.0], np.cumsum(way)])

    def at(self, time_s: Floats) -> Floats:
        """(3, m) positions."""
        right = np.clip(np.searchsorted(self.time_s, time_s), 1, self.time_s.size - 1)
        step = self.time_s[right] - self.time_s[right - 1]
        share = (time_s - self.time_s[right - 1]) / step
        left = self.ecef[:, right - 1]
        place = left + share * (self.ecef[:, right] - left)
        place[:, (step > self.max_step_s) | (share < 0) | (share > 1)] = np.nan
        return np.asarray(place)

    def moves(self, time_s: Floats) -> NDArray[np.bool_]:
        """(m,) True where the truth goes `LEAST_WAY_M` or more around a time."""
        begin, end = (
            np.interp(time_s + d, self.time_s, self.way_m) for d in (-LARGEST_LAG_S, LARGEST_LAG_S)
        )
        return np.asarray(end - begin >= LEAST_WAY_M)

    def speed_mps(self, time_s: Floats) -> float:
        """Median speed over the seconds around the times."""
        begin, end = (np.interp(time_s + d, self.time_s, self.way_m) for d in (-0.5, 0.5))
        return float(np.median(end - begin))


class _Epochs:
    """Sampled epochs in ECEF, with their east and north directions."""

    def __init__(self, pair: Comparison, track: _Track, rows: Ints) -> None:
        lat, lon = np.radians(pair.lat_deg[rows]), np.radians(pair.lon_deg[rows])
        height = pair.height_m[rows]
        usual = float(np.nanmedian(height)) if np.isfinite(height).any() else 0.0
        height = np.where(np.isfinite(height), height, usual)
        self.time_s = (pair.time_ns[rows] - track.origin_ns) / NS_PER_S
        self.ecef = np.stack(pymap3d.geodetic2ecef(lat, lon, height, deg=False))
        zero = np.zeros_like(lat)
        self.east = np.stack([-np.sin(lon), np.cos(lon), zero])
        self.north = np.stack([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)])

    def distance_m(self, track: _Track, lag_s: float) -> Floats:
        """(m,) horizontal distances from the truth `lag_s` later."""
        apart = self.ecef - track.at(self.time_s + lag_s)
        east, north = (apart * self.east).sum(axis=0), (apart * self.north).sum(axis=0)
        return np.asarray(np.hypot(east, north))


def _typical(distance_m: Floats) -> float:
    """Median distance; NaN where too few epochs are covered."""
    known = distance_m[np.isfinite(distance_m)]
    return float(np.median(known)) if known.size >= LEAST_MOVING else float("nan")


def best_lag(pair: Comparison) -> Lag | None:
    """The lag at which the sample fits a trajectory best; None where nothing moves together.

    Parameters
    ----------
    pair : sample and truth; the truth is a Trajectory with two or more points.
    """
    assert isinstance(pair.truth, Trajectory)
    track = _Track(pair.truth)
    if track.time_s.size < 2:
        return None
    order = np.argsort(pair.time_ns, kind="stable")
    near = _search(pair, track, order, 0)
    if near is not None and not near.at_best_m > POOR_FIT_M:
        return near
    best = near
    few = order[:: max(order.size // _FAR_SAMPLES, 1)]
    for base_s in FAR_S:
        found = _search(pair, track, few, base_s)
        fits = found is not None and found.at_best_m <= POOR_FIT_M
        if found is not None and fits and (best is None or found.at_best_m < best.at_best_m):
            best = found
    return best


def _search(pair: Comparison, track: _Track, order: Ints, base_s: int) -> Lag | None:
    time_s = (pair.time_ns[order] - track.origin_ns) / NS_PER_S + base_s
    reach = (time_s > track.time_s[0] - LARGEST_LAG_S) & (time_s < track.time_s[-1] + LARGEST_LAG_S)
    rows = order[reach & track.moves(time_s)]
    if rows.size < LEAST_MOVING:
        return None
    epochs = _Epochs(pair, track, rows)
    lags = np.arange(-LARGEST_LAG_S, LARGEST_LAG_S + 1)
    distance = np.stack([epochs.distance_m(track, base_s + lag) for lag in lags.tolist()])
    typical = np.array([_typical(row) for row in distance])
    if np.isnan(typical).all():
        return None
    whole = int(lags[np.nanargmin(typical)])
    fine = base_s + whole + np.arange(-10, 11) / 10
    near = np.stack([epochs.distance_m(track, lag) for lag in fine.tolist()])
    fitted = [_typical(row) for row in near]
    i = int(np.nanargmin(fitted))
    lag_s = round(float(fine[i]), 1)
    if abs(lag_s) < 1:  # Whole seconds would agree on no lag at all.
        blocks = _block_lags(near, fine, lag_s, 0.35)
    else:
        blocks = _block_lags(distance, base_s + lags, base_s + whole, 1.0)
    return Lag(
        lag_s,
        _typical(epochs.distance_m(track, 0)) if base_s else float(typical[LARGEST_LAG_S]),
        fitted[i],
        blocks,
        rows.size,
        track.speed_mps(epochs.time_s + lag_s),
    )


def _block_lags(
    distance: Floats, lags_s: Floats | Ints, best_s: float, within_s: float
) -> tuple[float, float]:
    """Range of the best lags of most blocks of time; endless where they do not agree."""
    blocks = [
        part for part in np.array_split(np.arange(distance.shape[1]), _BLOCKS)
        if part.size >= LEAST_MOVING // 3
    ]  # fmt: skip
    found = []
    for part in blocks:
        some = np.isfinite(distance[:, part]).sum(axis=1) >= part.size / 2
        if some.any():
            medians = np.full(lags_s.size, np.inf)
            medians[some] = np.nanmedian(distance[some][:, part], axis=1)
            found.append(float(lags_s[np.argmin(medians)]))
    agreeing = [lag for lag in found if abs(lag - best_s) <= within_s]
    if len(found) < 3 or len(agreeing) < _AGREEING * len(found):
        return -np.inf, np.inf
    return min(agreeing), max(agreeing)


def early_fits(pair: Comparison, row: Ints, first: int, last: int) -> bool:
    """Whether epochs before row `first` fit a trajectory, and those from row `last` on do not.

    Parameters
    ----------
    pair : sample and truth.
    row : (m,) rows of the sample.
    first, last : rows of the first and last corrected leap second.
    """
    east, north, _ = pair.errors_m()
    apart, row = np.hypot(east, north), row[pair.covered]
    early, late = apart[row < first], apart[row >= last]
    if min(early.size, late.size) < LEAST_MOVING:
        return False
    return bool(np.median(early) + LEAST_GAIN_M < np.median(late) / 2)


def time_lag(pair: Comparison) -> Iterator[Judged]:
    """E02: the lag between a recording and a trajectory.

    Parameters
    ----------
    pair : sample and truth; the truth is a Trajectory.
    """
    lag = best_lag(pair) if pair.time_ns.size else None
    if lag is None:
        yield judged(
            "E02", "info", "whether times and truth are in one time scale cannot be seen",
            evidence="too little of the truth is in motion where the recording is near it in time",
            cure="check the time scales in the documentation of both",
        )  # fmt: skip
        return
    gain = lag.at_zero_m - lag.at_best_m
    significant = np.isnan(lag.at_zero_m) or (
        gain >= LEAST_GAIN_M and lag.at_best_m <= 0.5 * lag.at_zero_m
    )
    blocks = lag.block_range_s
    if not significant or not np.isfinite(blocks[0]) or abs(lag.lag_s) < LEAST_LAG_S:
        return
    if not lag.at_best_m <= POOR_FIT_M:
        return
    leap = _leap_seconds(pair)
    zero = "the truth does not reach" if np.isnan(lag.at_zero_m) else f"{lag.at_zero_m:.4g} m"
    evidence = (
        f"median horizontal distance {zero} at lag 0, {lag.at_best_m:.4g} m at {lag.lag_s:+.1f} s "
        f"({lag.moving:,} sampled epochs in motion; blocks of time {blocks[0]:+g}.."
        f"{blocks[1]:+g} s); GPST - UTC that day {leap} s"
    )
    if abs(lag.lag_s) < 1:
        way_m = abs(lag.lag_s) * lag.speed_mps
        hpl = pair.hpl_m[pair.hpl_m > 0]
        hpl_m = float(np.median(hpl)) if hpl.size else float("nan")
        matters = way_m > max(SPREADS * lag.at_best_m, 1.0) or way_m > HPL_SHARE * hpl_m
        yield judged(
            "E02", "error" if matters else "warning",
            f"positions fit the truth best {lag.lag_s:+.1f} s later",
            evidence=f"{evidence}; {way_m:.3g} m at the median speed of {lag.speed_mps:.3g} m/s"
            + (f", HPL median {hpl_m:.4g} m" if hpl.size else ""),
            cure=f"--shift-s {lag.lag_s:g}, where the recording's stamps are off (its latency); "
            "else correct the truth's times, or the place on the vehicle that it is of",
        )  # fmt: skip
        return
    cure, repair = _cure(lag.lag_s, leap)
    yield judged(
        "E02", "error",
        f"positions fit the truth {lag.lag_s:+.1f} s later: one of the two is not in GPS time",
        evidence=evidence, cure=cure, repair=repair,
    )  # fmt: skip


def _leap_seconds(pair: Comparison) -> int:
    utc = gps_to_utc(pair.time_ns[:1].view("M8[ns]"))
    return int(gpst_minus_utc_s(utc)[0])


def _cure(lag_s: float, leap: int) -> tuple[str, dict[str, object]]:
    shift = f"--shift-s {lag_s:g}"
    truth = "read the truth in its own time scale"
    if abs(lag_s - leap) <= 0.3:
        return f"--time UTC, if the recording's stamps are UTC; else {truth}", {"time": "UTC"}
    if abs(lag_s + leap) <= 0.3:
        return (
            f"--truth-time-scale UTC, as the truth's times seem to be UTC; {shift} where the "
            "recording's are wrong"
        ), {}
    if abs(lag_s - (leap - 10_800)) <= 0.3:
        return f"--time GLONASST, if the recording's stamps are; else {truth}", {}
    if abs(lag_s - 14) <= 0.3:
        return f"--time BDT, if the recording's stamps are; else {truth}", {}
    return f"{shift}, if the recording is wrong (old leap seconds, a time zone); else {truth}", {}
