"""The whole error budget of every range at a place of the receiver, and its model.

Source: RTCA DO-229D, J.1 and J.2 (sigma terms), A.4.2.4 and A.4.4 (model).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.delta_udre import covariance_factor, service_factor
from sbas.augmentation.fast_corrections import Profile
from sbas.augmentation.ionospheric_delay import slant_ionosphere
from sbas.augmentation.klobuchar import klobuchar
from sbas.augmentation.range_error import sigma_flt_m
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.positioning import troposphere
from sbas.positioning.corrected_ranges import CorrectedRanges
from sbas.positioning.lines_of_sight import Horizons, LinesOfSight, lines_of_sight
from sbas.positioning.measurements import FIRST_SBAS_SLOT, Measurements
from sbas.positioning.orbits import rotated_by_flight
from sbas.positioning.receiver_noise import ReceiverNoise
from sbas.positioning.satellite_corrections import udre_factors
from sbas.timescales import GPS_EPOCH_NS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

DAY_NS = 86_400_000_000_000
LOW_ELEVATION_DEG = 5.0


@dataclass(frozen=True)
class BudgetRules:
    """How ranges are judged.

    `fallback_sigma_m` is the sigma of a satellite without corrections in a non-precision
    approach; None leaves such satellites out.
    """

    mode: Mode
    profile: Profile
    elevation_mask_deg: float
    noise: ReceiverNoise
    klobuchar: tuple[tuple[float, ...], tuple[float, ...]]
    fallback_sigma_m: float | None


@dataclass(frozen=True, eq=False)
class RangesAt:
    """(k,) ranges with what SBAS says of them and how each epoch sees the messages."""

    measured: Measurements
    corrected: CorrectedRanges
    timeline: CorrectionTimeline
    instants: Instants
    degradation: DegradationAt

    def some(self, rows: Ints) -> RangesAt:
        """Some of the ranges."""
        return RangesAt(
            self.measured.some(rows), self.corrected.some(rows), self.timeline,
            self.instants.some(rows), self.degradation.some(rows),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class RangeBudget:
    """(k,) terms of every range [m, deg]; NaN where a term does not exist.

    `sigma_m` is NaN where the range does not serve; `prefit_m` measured less modelled; `enu`
    (k, 3) the unit vector to the satellite.
    """

    reason: Ints
    elevation_deg: Floats
    azimuth_deg: Floats
    delta_udre: Floats
    sigma_flt_m: Floats
    sigma_uire_m: Floats
    sigma_tropo_m: Floats
    sigma_air_m: Floats
    sigma_m: Floats
    iono_m: Floats
    tropo_m: Floats
    geometric_m: Floats
    prefit_m: Floats
    satellite_m: Floats
    enu: Floats

    def seen_from(self, ranges: RangesAt, horizon: Horizons) -> RangeBudget:
        """The budget with geometry, troposphere and prefits of horizons near by.

        The ionosphere and the sigmas stay: over 100 m they change a level by less than 1 mm.
        """
        measured, corrected = ranges.measured, ranges.corrected
        here = horizon.at(measured.epoch)
        satellite_m = rotated_by_flight(corrected.satellite_m, here.place_m)
        line = lines_of_sight(satellite_m, here)
        tropo = _zenith_delay(measured, horizon)[measured.epoch]
        tropo = tropo * self.sigma_tropo_m / troposphere.ZENITH_SIGMA_M
        change = line.distance_m - self.geometric_m + tropo - self.tropo_m
        return replace(
            self,
            elevation_deg=line.elevation_deg,
            azimuth_deg=line.azimuth_deg,
            tropo_m=tropo,
            geometric_m=line.distance_m,
            prefit_m=self.prefit_m - change,
            satellite_m=satellite_m,
            enu=line.enu.T,
        )

    def with_rows(self, rows: Ints, part: RangeBudget) -> RangeBudget:
        """The budget with some of its rows replaced."""
        whole = {name: values.copy() for name, values in vars(self).items()}
        for name, values in vars(part).items():
            whole[name][rows] = values
        return RangeBudget(**whole)


def range_budget(ranges: RangesAt, horizon: Horizons, rules: BudgetRules) -> RangeBudget:
    """Terms of every range seen from (n,) horizons, one an epoch, or one for all."""
    measured, corrected = ranges.measured, ranges.corrected
    degradation = ranges.degradation
    k = len(measured)
    here = horizon.at(measured.epoch)
    lat, lon = (np.broadcast_to(angle, (k,)) for angle in (here.lat_deg, here.lon_deg))
    satellite_m = rotated_by_flight(corrected.satellite_m, here.place_m)
    line = lines_of_sight(satellite_m, here)
    reason = measured.reason.copy()

    def because(code: Reason | Ints, where: Bools) -> None:
        rows = (reason == 0) & where
        reason[rows] = np.broadcast_to(code, k)[rows]

    pa = rules.mode == "pa"
    because(Reason.LOW_ELEVATION, line.elevation_deg < rules.elevation_mask_deg)
    because(corrected.reason, corrected.barred)
    if pa:
        because(corrected.reason, corrected.reason > 0)
    delta_udre, why = _delta_udre(ranges, line, lat, lon, rules.profile)
    if pa:
        because(why, why > 0)
    flt = sigma_flt_m(
        corrected.sigma_udre_m,
        delta_udre,
        corrected.eps_fc_m,
        corrected.eps_rrc_m,
        corrected.eps_ltc_m,
        corrected.eps_er_m,
        root_sum_square=degradation.rss_udre > 0,
        degraded=degradation.valid,
    )
    flt = np.where(corrected.full, flt, np.nan)
    if not pa:
        without = ~corrected.full & ~corrected.barred
        if rules.fallback_sigma_m is None:
            because(corrected.reason, without)
        else:
            flt = np.where(without, rules.fallback_sigma_m, flt)
    # What has no place or no sigma by now is no range to go on with.
    because(Reason.NO_SOLUTION, ~np.isfinite(line.elevation_deg + flt))
    # gLAB takes the path through the atmosphere before the Earth's rotation in flight.
    path = lines_of_sight(corrected.satellite_m, here) if rules.profile == "glab" else line
    iono, uire, why = _ionosphere(ranges, lat, lon, path, np.flatnonzero(reason == 0), rules)
    because(why, why > 0)
    mapping = troposphere.mapping(path.elevation_deg)
    tropo_sigma = troposphere.ZENITH_SIGMA_M * mapping
    is_sbas = measured.slot[measured.satellite] >= FIRST_SBAS_SLOT
    air = rules.noise.sigma_m(path.elevation_deg, is_sbas)
    sigma = np.sqrt(flt**2 + uire**2 + tropo_sigma**2 + air**2)
    because(Reason.NO_SOLUTION, ~(np.isfinite(sigma) & (sigma > 0)))
    sigma[reason > 0] = np.nan
    zenith = _zenith_delay(measured, horizon)
    tropo = zenith[measured.epoch] * mapping
    modelled = line.distance_m - corrected.relativity_m - corrected.clock_m + corrected.tgd_m
    prefit = measured.code_m - modelled - iono - tropo + corrected.prc_m + corrected.rrc_m
    return RangeBudget(
        reason, line.elevation_deg, line.azimuth_deg, delta_udre, flt, uire, tropo_sigma, air,
        sigma, iono, tropo, line.distance_m, prefit, satellite_m, line.enu.T,
    )  # fmt: skip


def _delta_udre(
    ranges: RangesAt, line: LinesOfSight, lat_deg: Floats, lon_deg: Floats, profile: Profile
) -> tuple[Floats, Ints]:
    """(k,) factor on the UDRE, and why there is none; 1 where neither message is sent."""
    timeline, instants = ranges.timeline, ranges.instants
    sent = udre_factors(timeline, instants, profile)
    factor, why = np.ones(len(ranges.measured)), np.zeros(len(ranges.measured), np.int64)
    if sent.by_covariance.any():
        row = np.where(sent.by_covariance, ranges.corrected.covariance_row, -1)
        factor = covariance_factor(
            timeline.decoded.covariances, row, line.unit, ranges.degradation.c_covariance
        )
    if sent.by_region.any():
        inside, incomplete, expired = service_factor(timeline.regions, instants, lat_deg, lon_deg)
        factor = np.where(sent.by_region, inside, factor)
        why = np.where(incomplete, Reason.SERVICE_INCOMPLETE, why)
        why = np.where(expired, Reason.SERVICE_EXPIRED, why)
        why = np.where(sent.by_region, why, 0)
    return factor, why


def _ionosphere(
    ranges: RangesAt,
    lat_deg: Floats,
    lon_deg: Floats,
    path: LinesOfSight,
    rows: Ints,
    rules: BudgetRules,
) -> tuple[Floats, Floats, Ints]:
    """Slant delay, its sigma, and the reason why there is none, of the rows that are worth it."""
    k = path.elevation_deg.size
    delay, sigma = np.full(k, np.nan), np.full(k, np.nan)
    reason = np.zeros(k, np.int64)
    grid = slant_ionosphere(
        ranges.timeline.grid,
        ranges.instants.some(rows),
        ranges.degradation.some(rows),
        lat_deg[rows],
        lon_deg[rows],
        path.elevation_deg[rows],
        path.azimuth_deg[rows],
        needs_data=rules.profile == "glab",
    )
    delay[rows], sigma[rows], reason[rows] = grid.delay_m, grid.sigma_uire_m, grid.reason
    if rules.mode == "npa":
        lacking = rows[grid.reason > 0]
        of_day = (ranges.instants.time_ns[lacking] % DAY_NS) / 1e9
        broadcast = klobuchar(
            *rules.klobuchar, of_day, lat_deg[lacking], lon_deg[lacking],
            path.elevation_deg[lacking], path.azimuth_deg[lacking],
        )  # fmt: skip
        delay[lacking], sigma[lacking] = broadcast.delay_m, broadcast.sigma_m
        reason[lacking] = 0
    return delay, sigma, reason


def _zenith_delay(measured: Measurements, horizon: Horizons) -> Floats:
    """(n,) vertical tropospheric delay at the horizon of each epoch [m]."""
    delay = troposphere.zenith_delay_m(
        horizon.lat_deg, horizon.height_m, day_of_year(measured.time_ns)
    )
    return np.broadcast_to(delay, measured.time_ns.shape)


def day_of_year(time_ns: Ints) -> Floats:
    """(n,) day of the year, from 1, with its fraction: delays then have no step at midnight."""
    days = (time_ns + GPS_EPOCH_NS).astype("M8[ns]").astype("M8[D]")
    whole = (days - days.astype("M8[Y]").astype("M8[D]")).astype(np.int64)
    number: Floats = whole + 1.0 + (time_ns % DAY_NS) / DAY_NS
    return number
