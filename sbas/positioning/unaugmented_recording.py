"""RINEX without SBAS to a Recording with fixes and the budget of every range: `unaugmented`.

Sigmas are broadcast: user range accuracy, Klobuchar's ionosphere, residual troposphere, and the
receiver. Source: IS-GPS-200, 20.3.3; RTCA DO-229D, A.4.2.4 and J.2 (troposphere, receiver, and the
sigma of a broadcast ionosphere).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.augmentation.klobuchar import klobuchar
from sbas.augmentation.reasons import WORDS, Reason
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.provenance import source_of
from sbas.positioning import troposphere
from sbas.positioning.least_squares import Step, dilution, step
from sbas.positioning.lines_of_sight import Horizons, horizons, lines_of_sight
from sbas.positioning.normal_equations import design, sums_by_epoch
from sbas.positioning.orbits import length, rotated_by_flight
from sbas.positioning.range_budget import DAY_NS, LOW_ELEVATION_DEG, day_of_year
from sbas.positioning.receiver_noise import CLASS_2, ReceiverNoise
from sbas.positioning.rough_places import rough_places
from sbas.positioning.unaugmented_ranges import (
    REASON_WORDS,
    UnaugmentedRanges,
    unaugmented_ranges,
)
from sbas.recording import MODES, Recording, RecordingMeta, mode_categories
from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observation_file import read_observations
from sbas.satellite_table import SIDE_TABLE, satellite_table
from sbas.timescales import GPS_EPOCH_NS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Files = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]

CLOSE_ENOUGH_M = 1e-3
MOST_STEPS = 12
_CODES = ("C1C", "L1C", "S1C", "C1X", "L1X", "S1X")


def unaugmented(
    observations: Files,
    navigation: Files,
    *,
    systems: Literal["G", "E", "GE"] = "G",
    place_m: tuple[float, float, float] | None = None,
    elevation_mask_deg: float = LOW_ELEVATION_DEG,
    smoothing: bool = False,
    noise: ReceiverNoise = CLASS_2,
    causal: bool = False,
) -> Recording:
    """Positions without SBAS from RINEX observations and navigation, for RAIM to judge.

    Parameters
    ----------
    observations, navigation : RINEX files of one receiver, and of broadcast orbits.
    systems : "G" for GPS L1 C/A, "E" for Galileo E1, "GE" for both, each with its own clock.
    place_m : (3,) known antenna position, earth-fixed [m]: the geometry is taken there.
    elevation_mask_deg : satellites below are not used.
    smoothing : smooth the code by the carrier over 100 s.
    noise : model of the receiver's own errors.
    causal : use only ephemerides that had been transmitted by then.

    Returns
    -------
    Recording with every epoch, mode "standalone" where there is a fix, without protection levels.
    No range is left out for being an outlier: that is for RAIM. The side table `satellites` has
    the budget and residual of every range.

    Raises
    ------
    InputError : files that cannot be read, or observations without ranges of the systems asked for.

    References
    ----------
    IS-GPS-200, 20.3.3; RTCA DO-229D, J.2.
    """
    if systems not in ("G", "E", "GE"):
        raise InputError(f"systems cannot be {systems!r}", cure="G, E or GE")
    observed = read_observations(observations, systems=systems, codes=_CODES)
    nav = read_navigation(navigation)
    given = unaugmented_ranges(observed, nav, systems=systems, smoothing=smoothing, causal=causal)
    findings = [*observed.findings, *nav.findings, *given.findings]
    if nav.klobuchar is None:
        findings.append(
            Finding(
                "E25", "warning", "no broadcast ionosphere (Klobuchar): its delay is left at 5 ns",
                where="navigation", cure="give a navigation file with ION ALPHA and ION BETA",
            )
        )  # fmt: skip
    model = _Model(given, nav.klobuchar or (4 * (0.0,), 4 * (0.0,)), elevation_mask_deg, noise)
    approximate = observed.header.position_m
    fix = _solve(
        model,
        None if place_m is None else np.array(place_m, float),
        None if approximate is None else np.array(approximate, float),
    )
    meta = RecordingMeta(
        sources=tuple(
            source_of(path, kind)
            for paths, kind in ((observations, "rinex_obs"), (navigation, "rinex_nav"))
            for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)
        ),
        frame="WGS 84 (broadcast orbits)",
        antenna="phase centre",
        receiver=observed.header.receiver,
        leap_seconds=nav.leap_seconds,
        findings=tuple(findings),
        options={
            "unaugmented": f"systems {systems}, mask {elevation_mask_deg:g} deg, "
            f"smoothing {smoothing}, {noise}"
        },
    )
    return Recording(_epochs(given, fix), meta, {SIDE_TABLE: _satellites(given, fix)})


@dataclass(frozen=True, eq=False)
class _Model:
    """How ranges are modelled and weighted."""

    given: UnaugmentedRanges
    klobuchar: tuple[tuple[float, ...], tuple[float, ...]]
    elevation_mask_deg: float
    noise: ReceiverNoise


@dataclass(frozen=True, eq=False)
class _Seen:
    """(k,) ranges seen from places; `sigma_m` NaN where one does not serve."""

    elevation_deg: Floats
    azimuth_deg: Floats
    satellite_m: Floats
    enu: Floats
    iono_sigma_m: Floats
    tropo_sigma_m: Floats
    air_sigma_m: Floats
    sigma_m: Floats
    prefit_m: Floats
    reason: Ints


@dataclass(frozen=True, eq=False)
class _Fix:
    seen: _Seen
    horizon: Horizons
    solution: Step
    used: Bools
    solved: Bools
    dop: Floats


def _see(model: _Model, horizon: Horizons) -> _Seen:
    given = model.given
    measured, corrected = given.measured, given.corrected
    here = horizon.at(measured.epoch)
    k = len(measured)
    lat, lon = (np.broadcast_to(angle, (k,)) for angle in (here.lat_deg, here.lon_deg))
    satellite_m = rotated_by_flight(corrected.satellite_m, here.place_m)
    line = lines_of_sight(satellite_m, here)
    # Below the horizon the models have no meaning; such ranges do not serve.
    elevation = np.maximum(line.elevation_deg, 0.0)
    of_day = (measured.time_ns % DAY_NS)[measured.epoch] / 1e9
    iono = klobuchar(*model.klobuchar, of_day, lat, lon, elevation, line.azimuth_deg)
    zenith = troposphere.zenith_delay_m(
        horizon.lat_deg, horizon.height_m, day_of_year(measured.time_ns)
    )
    zenith = np.broadcast_to(zenith, measured.time_ns.shape)[measured.epoch]
    mapping = troposphere.mapping(elevation)
    tropo = troposphere.ZENITH_SIGMA_M * mapping
    air = model.noise.sigma_m(elevation, np.zeros(k, bool))
    sigma = np.sqrt(given.ura_m**2 + iono.sigma_m**2 + tropo**2 + air**2)
    modelled = line.distance_m - corrected.relativity_m - corrected.clock_m + corrected.tgd_m
    prefit = measured.code_m - modelled - iono.delay_m - zenith * mapping
    low = line.elevation_deg < model.elevation_mask_deg
    reason = np.where((given.reason == 0) & low, int(Reason.LOW_ELEVATION), given.reason)
    unknown = (reason == 0) & ~np.isfinite(sigma + prefit)
    reason = np.where(unknown, int(Reason.NO_SOLUTION), reason)
    return _Seen(
        line.elevation_deg, line.azimuth_deg, satellite_m, line.enu, iono.sigma_m, tropo, air,
        np.where(reason == 0, sigma, np.nan), prefit, reason,
    )  # fmt: skip


def _solve(model: _Model, place_m: Floats | None, approximate_m: Floats | None) -> _Fix:
    given = model.given
    n = given.measured.time_ns.size
    if place_m is not None:
        horizon = horizons(place_m[None, :])
        seen = _see(model, horizon)
        return _fix(given, seen, horizon, *_step(given, seen), np.ones(n, bool))
    places = rough_places(given.measured, given.corrected, approximate_m)
    moving = np.ones(n, bool)
    for _ in range(MOST_STEPS):
        horizon = horizons(places)
        seen = _see(model, horizon)
        solution, g, enough = _step(given, seen)
        enu = np.nan_to_num(solution.enu_m)
        moving = length(enu) >= CLOSE_ENOUGH_M
        if not moving.any():
            break
        places = horizon.moved(np.where(moving[:, None], enu, 0.0))
    return _fix(given, seen, horizon, solution, g, enough, ~moving)


def _step(given: UnaugmentedRanges, seen: _Seen) -> tuple[Step, Floats, Bools]:
    """A step with a clock per constellation, its designs, and (n,) enough ranges for one.

    Rows and ranges less their weighted means over a constellation leave one clock that is 0: the
    step of four unknowns is then that of all clocks.
    """
    measured = given.measured
    n = measured.time_ns.size
    serves = np.isfinite(seen.sigma_m)
    weight = np.where(serves, 1 / np.where(serves, seen.sigma_m, 1.0) ** 2, 0.0)
    prefit = np.where(serves, seen.prefit_m, 0.0)
    g = np.where(serves, design(seen.enu), 0.0)
    count = np.bincount(measured.epoch[serves], minlength=n)
    clocks = np.zeros(n, np.int64)
    group = measured.epoch + n * given.clock
    total = sums_by_epoch(weight, group, 2 * n)
    clocks = (total[:n] > 0).astype(np.int64) + (total[n:] > 0)
    safe = np.where(total > 0, total, 1.0)
    for row in g[:3]:
        row -= np.where(serves, (sums_by_epoch(weight * row, group, 2 * n) / safe)[group], 0.0)
    centred = prefit - (sums_by_epoch(weight * prefit, group, 2 * n) / safe)[group]
    enough = count >= 3 + clocks
    sigma = np.where(serves & enough[measured.epoch], seen.sigma_m, np.nan)
    return step(g, sigma, np.where(serves, centred, np.nan), measured.epoch, n), g, enough


def _fix(
    given: UnaugmentedRanges,
    seen: _Seen,
    horizon: Horizons,
    solution: Step,
    g: Floats,
    enough: Bools,
    settled: Bools,
) -> _Fix:
    measured = given.measured
    n = measured.time_ns.size
    solved = solution.geometry.solved & enough & settled & np.isfinite(solution.enu_m).all(axis=1)
    used = (solution.geometry.weight > 0) & solved[measured.epoch]
    # Dilutions have weights of 1, so that the means that are taken away are others.
    ones = _Seen(**{**vars(seen), "sigma_m": np.where(used, 1.0, np.nan)})
    _, level, _ = _step(given, ones)
    return _Fix(
        seen, horizon, solution, used, solved, dilution(level, used, measured.epoch, n, solved)
    )


def _epochs(given: UnaugmentedRanges, fix: _Fix) -> pd.DataFrame:
    measured = given.measured
    n = measured.time_ns.size
    place = fix.horizon.moved(fix.solution.enu_m)
    place = np.where(fix.solved[:, None], place, [[6378137.0, 0.0, 0.0]])
    lat, lon, height = (
        np.where(fix.solved, value, np.nan) for value in pymap3d.ecef2geodetic(*place.T)
    )
    d, dop = fix.solution.covariance_m2, fix.dop
    horizontal = dop[:, 0, 0] + dop[:, 1, 1]
    codes = np.where(fix.solved, MODES.index("standalone"), MODES.index("none")).astype(np.int8)
    data: dict[str, object] = {
        "lat_deg": lat,
        "lon_deg": lon,
        "height_m": height,
        "hdop": np.where(fix.solved, np.sqrt(horizontal), np.nan),
        "vdop": np.where(fix.solved, np.sqrt(dop[:, 2, 2]), np.nan),
        "pdop": np.where(fix.solved, np.sqrt(horizontal + dop[:, 2, 2]), np.nan),
        "sigma_e_m": np.where(fix.solved, np.sqrt(d[:, 0, 0]), np.nan),
        "sigma_n_m": np.where(fix.solved, np.sqrt(d[:, 1, 1]), np.nan),
        "sigma_u_m": np.where(fix.solved, np.sqrt(d[:, 2, 2]), np.nan),
        "cov_en_m2": np.where(fix.solved, d[:, 0, 1], np.nan),
        "n_sv": np.bincount(measured.epoch[fix.used], minlength=n).astype(np.int16),
        "n_sv_tracked": np.bincount(measured.epoch, minlength=n).astype(np.int16),
        "mode": mode_categories(codes),
    }
    time = (measured.time_ns + GPS_EPOCH_NS).astype("M8[ns]")
    return pd.DataFrame(data, index=pd.DatetimeIndex(time, name="time"), copy=False)


def _satellites(given: UnaugmentedRanges, fix: _Fix) -> pd.DataFrame:
    measured, seen = given.measured, fix.seen
    reason = np.where((seen.reason == 0) & ~fix.used, int(Reason.NO_SOLUTION), seen.reason)
    words = {int(code): text for code, text in WORDS.items() if code} | REASON_WORDS
    lookup = np.full(max(words) + 1, -1)
    lookup[list(words)] = np.arange(len(words))
    serving = np.isfinite(seen.sigma_m)
    columns: dict[str, object] = {
        "satellite": pd.Categorical.from_codes(measured.satellite, categories=list(measured.names)),
        "elevation_deg": seen.elevation_deg,
        "azimuth_deg": seen.azimuth_deg,
        "x_ecef_m": seen.satellite_m[:, 0],
        "y_ecef_m": seen.satellite_m[:, 1],
        "z_ecef_m": seen.satellite_m[:, 2],
        "sigma_uire_m": np.where(serving, seen.iono_sigma_m, np.nan),
        "sigma_air_m": np.where(serving, seen.air_sigma_m, np.nan),
        "sigma_tropo_m": np.where(serving, seen.tropo_sigma_m, np.nan),
        "sigma_m": seen.sigma_m,
        "residual_m": fix.solution.residual_m,
        "x_ura_m": given.ura_m,
        "used": fix.used,
        "reason": pd.Categorical.from_codes(lookup[reason], categories=list(words.values())),
    }
    return satellite_table(
        (measured.time_ns + GPS_EPOCH_NS).astype("M8[ns]")[measured.epoch], columns
    )
