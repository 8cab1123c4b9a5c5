"""Slant ionospheric delay and its variance from the grid, for epochs and satellites.

Source: RTCA DO-229D, A.4.4.10 (interpolation), A.4.5.1.5 and J.2.3 (variance).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.grid_cells import CAP_LAT_DEG, CORNERS, POLAR_LAT_DEG, choose_cells, weights
from sbas.augmentation.grid_points import points_at
from sbas.augmentation.ionospheric_grid import (
    IonosphericGrid,
    PointsAt,
    PointState,
    points_at_epochs,
    points_in_mask,
)
from sbas.augmentation.pierce_points import pierce_points
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import IONO_MASK_TIMEOUT_S

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LOWEST_POLAR_DEG = 60
"""Latitude from which bands 9 and 10 have points."""


@dataclass(frozen=True, eq=False)
class SlantIonosphere:
    """Delay [m], sigma_UIRE [m] and reason of (n,) lines of sight; NaN where there is a reason."""

    delay_m: Floats
    sigma_uire_m: Floats
    reason: Ints


def slant_ionosphere(
    grid: IonosphericGrid,
    instants: Instants,
    degradation: DegradationAt,
    lat_deg: Floats,
    lon_deg: Floats,
    elevation_deg: Floats,
    azimuth_deg: Floats,
    *,
    needs_data: bool,
) -> SlantIonosphere:
    """Slant delays of (n,) lines of sight, each at its own epoch.

    Parameters
    ----------
    instants, degradation : (n,) epoch of each line of sight.
    lat_deg, lon_deg : (n,) receiver; elevation_deg, azimuth_deg : (n,) line of sight.
    needs_data : see `points_in_mask`.
    """
    n = elevation_deg.size
    delay, sigma = np.full(n, np.nan), np.full(n, np.nan)
    reason = np.full(n, Reason.OUTSIDE_GRID, np.int64)
    point = pierce_points(lat_deg, lon_deg, elevation_deg, azimuth_deg)
    lat, lon = point.lat_deg, point.lon_deg % 360
    absolute = np.abs(lat)
    zones = (
        (absolute <= POLAR_LAT_DEG, _below_75),
        ((absolute > POLAR_LAT_DEG) & (absolute <= CAP_LAT_DEG), _from_75_to_85),
        (absolute > CAP_LAT_DEG, _cap),
    )
    for zone, look_up in zones:
        rows = np.flatnonzero(zone)
        if not rows.size:
            continue
        if rows.size == n:  # the usual case, spared a copy of everything
            at = _At(grid, instants, degradation, needs_data)
        else:
            at = _At(grid, instants.some(rows), degradation.some(rows), needs_data)
        values, x, y, found = look_up(at, lat[rows], lon[rows])
        vertical, variance, why = _interpolated(values, x, y)
        why[~found] = Reason.OUTSIDE_GRID
        good = found & (why == 0)
        obliquity = point.obliquity[rows]
        delay[rows] = np.where(good, obliquity * vertical, np.nan)
        sigma[rows] = np.where(good, obliquity * np.sqrt(np.where(good, variance, 1.0)), np.nan)
        reason[rows] = why
    mask_row = instants.latest(grid.mask_s)
    if grid.mask_s.size:
        old = (mask_row >= 0) & instants.expired(grid.mask_s[mask_row], IONO_MASK_TIMEOUT_S)
    else:
        old = np.zeros(n, bool)
    none = mask_row < 0
    reason[old], reason[none] = Reason.IONO_MASK_EXPIRED, Reason.NO_IONO_MASK
    delay[old | none] = sigma[old | none] = np.nan
    return SlantIonosphere(delay, sigma, reason)


@dataclass(frozen=True, eq=False)
class _At:
    """The grid at the epochs of (n,) lines of sight."""

    grid: IonosphericGrid
    instants: Instants
    degradation: DegradationAt
    needs_data: bool

    def identify(self, lat: Ints, lon: Ints) -> tuple[Ints, Bools]:
        """Points at places, those of bands 9 and 10 first, and whether they are in the mask."""
        return _identify(self.grid, self.instants, self.needs_data, lat, lon)

    def in_mask(self, identity: Ints) -> Bools:
        return points_in_mask(self.grid, identity, self.instants, needs_data=self.needs_data)

    def values(self, identity: Ints, in_mask: Bools) -> PointsAt:
        return points_at_epochs(self.grid, identity, in_mask, self.instants, self.degradation)


def _identify(
    grid: IonosphericGrid, instants: Instants, needs_data: bool, lat: Ints, lon: Ints
) -> tuple[Ints, Bools]:
    identity = points_at(lat, lon, high=False)
    in_mask = points_in_mask(grid, identity, instants, needs_data=needs_data)
    if (np.abs(lat) >= LOWEST_POLAR_DEG).any():
        above = points_at(lat, lon, high=True)
        preferred = points_in_mask(grid, above, instants, needs_data=needs_data)
        identity = np.where(preferred, above, identity)
        in_mask |= preferred
    return identity, in_mask


def _below_75(at: _At, lat: Floats, lon: Floats) -> tuple[PointsAt, Floats, Floats, Bools]:
    def identify(rows: Ints, lat_corner: Ints, lon_corner: Ints) -> tuple[Ints, Bools]:
        return _identify(at.grid, at.instants.some(rows), at.needs_data, lat_corner, lon_corner)

    chosen, x, y, found = choose_cells(lat, lon, identify)
    return at.values(chosen, chosen >= 0), x, y, found


def _from_75_to_85(at: _At, lat: Floats, lon: Floats) -> tuple[PointsAt, Floats, Floats, Bools]:
    """Two points at 75 degrees, and two at 85 interpolated to their longitudes."""
    north = lat > 0
    west = (np.floor(lon / 10) * 10).astype(np.int64)
    lon_corners = np.stack([west, west + 10], axis=-1)
    latitude = np.where(north, POLAR_LAT_DEG, -POLAR_LAT_DEG)
    near = at.values(*at.identify(np.repeat(latitude[:, None], 2, 1), lon_corners))
    far = [_on_85(at, north, lon_corners[:, column]) for column in range(2)]

    def four(near_values: NDArray[Any], *far_values: NDArray[Any]) -> Any:
        near_west, near_east = near_values.T
        far_west, far_east = far_values
        northern = np.stack([far_east, far_west, near_west, near_east], axis=-1)
        southern = np.stack([near_east, near_west, far_west, far_east], axis=-1)
        return np.where(north[:, None], northern, southern)

    state = four(near.state, *(point.state for point in far))
    values = PointsAt(
        state,
        four(near.delay_m, *(point.delay_m for point in far)),
        four(near.variance_m2, *(point.variance_m2 for point in far)),
    )
    south = np.where(north, POLAR_LAT_DEG, -CAP_LAT_DEG)
    x, y = (lon - west) / 10, (lat - south) / 10
    inside = state != PointState.NOT_IN_MASK
    count = inside.sum(axis=1)
    triangle = (count == CORNERS - 1) & (weights(x, y, inside) >= 0).all(axis=1)
    return values, x, y, (count == CORNERS) | triangle


def _on_85(at: _At, north: Bools, lon_deg: Ints) -> PointsAt:
    """(n,) points at 85 degrees between two of bands 9 and 10, or else of the other bands; both
    neighbours are needed."""
    found = []
    latitude = np.where(north, CAP_LAT_DEG, -CAP_LAT_DEG)
    for high, spacing, first_south in ((True, 30, 10), (False, 90, 40)):
        first = np.where(north, 0, first_south)
        west = (lon_deg - first) // spacing * spacing + first
        pair = np.stack([west, west + spacing], axis=-1)
        identity = points_at(np.repeat(latitude[:, None], 2, 1), pair, high=high)
        inside = at.in_mask(identity)
        values = at.values(identity, inside)
        east_share = (lon_deg - west) / spacing
        shares = np.stack([1 - east_share, east_share], axis=-1)
        state = np.where(inside.all(axis=1), values.state.max(axis=1), PointState.NOT_IN_MASK)
        found.append((state, values.delay_m, values.variance_m2, shares))
    polar, other = (
        PointsAt(state, (delay * shares).sum(axis=1), (variance * shares).sum(axis=1))
        for state, delay, variance, shares in found
    )
    take = polar.state != PointState.NOT_IN_MASK
    return PointsAt(
        np.where(take, polar.state, other.state),
        np.where(take, polar.delay_m, other.delay_m),
        np.where(take, polar.variance_m2, other.variance_m2),
    )


def _cap(at: _At, lat: Floats, lon: Floats) -> tuple[PointsAt, Floats, Floats, Bools]:
    """Four points at 85 degrees, 90 degrees apart, all of them needed."""
    north = lat > 0
    origin = np.where(north, 0, 40)
    base = (np.floor((lon - origin) / 90) * 90 + origin).astype(np.int64)
    pole = np.where(north, CAP_LAT_DEG, -CAP_LAT_DEG)
    lons = base[:, None] + np.array([180, 270, 0, 90])
    identity, in_mask = at.identify(np.repeat(pole[:, None], CORNERS, 1), lons)
    y = (np.abs(lat) - CAP_LAT_DEG) / 10
    x = (lon - base) / 90 * (1 - 2 * y) + y
    return at.values(identity, in_mask), x, y, np.asarray(in_mask.all(axis=1))


def _interpolated(values: PointsAt, x: Floats, y: Floats) -> tuple[Floats, Floats, Ints]:
    """(n,) vertical delay and variance, and the reason where there are none."""
    state = values.state
    usable = state == PointState.USABLE
    weight = weights(x, y, usable)
    with np.errstate(invalid="ignore"):
        outside = (weight < 0).any(axis=1)
    reason = np.zeros(x.size, np.int64)
    reason[outside] = Reason.IONO_OUTSIDE_TRIANGLE
    reason[usable.sum(axis=1) < CORNERS - 1] = Reason.IONO_NOT_MONITORED
    reason[(state == PointState.DO_NOT_USE).any(axis=1)] = Reason.IONO_DO_NOT_USE
    delay = np.where(usable, weight * values.delay_m, 0.0).sum(axis=1)
    variance = np.where(usable, weight * values.variance_m2, 0.0).sum(axis=1)
    return delay, variance, reason
