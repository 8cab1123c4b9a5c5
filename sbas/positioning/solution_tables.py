"""Fixes as the tables of a Recording: epochs, and the budget of every range."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.augmentation.reasons import WORDS
from sbas.augmentation.tables import Mode
from sbas.positioning.mode_choice import ModeChoice
from sbas.positioning.protection_levels import (
    horizontal_level_m,
    k_along,
    level_along_m,
    vertical_level_m,
)
from sbas.positioning.receiver_settings import ReceiverSettings
from sbas.positioning.software_receiver import Fixes
from sbas.recording import MODES, mode_categories
from sbas.satellite_table import satellite_table
from sbas.timescales import GPS_EPOCH_NS

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


def epoch_table(
    fixes: Mapping[Mode, Fixes], choice: ModeChoice, settings: ReceiverSettings, geo: int
) -> pd.DataFrame:
    """The epoch table: of several modes the chosen one's fix."""
    first = next(iter(fixes.values()))
    n = first.solved.size
    columns: dict[str, Floats] = {}
    n_sv = np.zeros(n, np.int16)
    codes = np.full(n, MODES.index("none"), np.int8)
    for mode, fix in fixes.items():
        rows = choice.rows[mode]
        for name, values in _mode_columns(fix, mode, settings).items():
            columns[name] = np.where(rows, values, columns.get(name, np.nan))
        used = np.bincount(fix.measured.epoch[fix.used], minlength=n).astype(np.int16)
        n_sv[rows] = used[rows]
        codes[rows] = MODES.index("sbas_pa" if mode == "pa" else "sbas_npa")
    chosen = np.logical_or.reduce(list(choice.rows.values()))
    data: dict[str, object] = {
        **columns,
        "n_sv": n_sv,
        "n_sv_tracked": np.bincount(first.measured.epoch, minlength=n).astype(np.int16),
        "geo_prn": np.where(chosen, geo, -1).astype(np.int16),
        "mode": mode_categories(codes),
        "x_reason": choice.reason,
    }
    time = (first.measured.time_ns + GPS_EPOCH_NS).astype("M8[ns]")
    return pd.DataFrame(data, index=pd.DatetimeIndex(time, name="time"), copy=False)


def _mode_columns(fix: Fixes, mode: Mode, settings: ReceiverSettings) -> dict[str, Floats]:
    solved = fix.solved
    places = np.where(solved[:, None], fix.receiver_m, [[6378137.0, 0.0, 0.0]])
    lat, lon, height = (
        np.where(solved, value, np.nan) for value in pymap3d.ecef2geodetic(*places.T)
    )
    d, dop = fix.covariance_m2, fix.dop
    horizontal = dop[:, 0, 0] + dop[:, 1, 1]
    k_h = settings.k_h_of(mode)
    columns = {
        "lat_deg": lat,
        "lon_deg": lon,
        "height_m": height,
        "hpl_m": horizontal_level_m(d, k_h),
        "vpl_m": vertical_level_m(d, settings.k_v),
        "hdop": np.sqrt(horizontal),
        "vdop": np.sqrt(dop[:, 2, 2]),
        "pdop": np.sqrt(horizontal + dop[:, 2, 2]),
        "sigma_e_m": np.sqrt(d[:, 0, 0]),
        "sigma_n_m": np.sqrt(d[:, 1, 1]),
        "sigma_u_m": np.sqrt(d[:, 2, 2]),
        "cov_en_m2": d[:, 0, 1],
    }
    if settings.track_azimuth_deg is not None:
        columns["x_level_along_m"] = level_along_m(
            d, settings.track_azimuth_deg, k_along(k_h, mode)
        )
    return columns


def satellites_of(fixes: Mapping[Mode, Fixes], choice: ModeChoice) -> pd.DataFrame:
    """Rows of all ranges; of several modes those of the one whose fix is given, and of the last
    one where none is."""
    *others, last = fixes
    fix = fixes[last]
    m = fix.measured
    values, used, reason = _values(fix), fix.used, fix.reason
    for mode in others:
        rows = choice.rows[mode][m.epoch]
        other = fixes[mode]
        for name, array in _values(other).items():
            values[name] = np.where(rows, array, values[name])
        used, reason = np.where(rows, other.used, used), np.where(rows, other.reason, reason)
    numbers = sorted(int(code) for code in WORDS if code)
    lookup = np.full(max(numbers) + 1, -1)
    lookup[numbers] = np.arange(len(numbers))
    columns: dict[str, object] = {
        "satellite": pd.Categorical.from_codes(m.satellite, categories=list(m.names)),
        **values,
        "used": used,
        "reason": pd.Categorical.from_codes(
            lookup[reason],
            categories=[WORDS[code] for code in sorted(WORDS) if code],
        ),
    }
    return satellite_table((m.time_ns + GPS_EPOCH_NS).astype("M8[ns]")[m.epoch], columns)


def _values(fix: Fixes) -> dict[str, Floats]:
    """Columns named as those of a gLAB output, so that two budgets are held side by side."""
    b, c = fix.budget, fix.corrected
    return {
        "elevation_deg": b.elevation_deg,
        "azimuth_deg": b.azimuth_deg,
        "x_ecef_m": b.satellite_m[:, 0],
        "y_ecef_m": b.satellite_m[:, 1],
        "z_ecef_m": b.satellite_m[:, 2],
        "sigma_flt_m": b.sigma_flt_m,
        "sigma_uire_m": b.sigma_uire_m,
        "sigma_air_m": b.sigma_air_m,
        "sigma_tropo_m": b.sigma_tropo_m,
        "sigma_m": b.sigma_m,
        "residual_m": fix.residual_m,
        "x_prefit_m": b.prefit_m,
        "x_sigma_udre_m": c.sigma_udre_m,
        "x_udrei": c.udrei.astype(float),
        "x_delta_udre": b.delta_udre,
        "x_fast_degradation_m": c.eps_fc_m,
        "x_range_rate_degradation_m": c.eps_rrc_m,
        "x_long_term_degradation_m": c.eps_ltc_m,
        "x_en_route_degradation_m": c.eps_er_m,
        "x_fast_correction_m": c.prc_m,
        "x_range_rate_correction_m": c.rrc_m,
        "x_long_term_clock_m": c.clock_correction_m,
        "x_ionosphere_delay_m": b.iono_m,
        "x_troposphere_delay_m": b.tropo_m,
        "x_iode": c.iode.astype(float),
    }
