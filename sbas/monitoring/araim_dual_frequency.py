"""Range errors of dual-frequency ARAIM: what the support message says, troposphere and user.

Source: WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017), error models; J. Blanch et
al., "Baseline advanced RAIM user algorithm and possible improvements", IEEE Transactions on
Aerospace and Electronic Systems 51 (2015), Table A.I for Galileo. The user errors are those of an
aircraft: reflections between buildings, cuttings and trains are far larger, so that for a train
these figures are the geometry's share and not a claim.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_settings import PerConstellation, by_constellation

Floats = NDArray[np.float64]

L1_HZ = 1575.42e6
L5_HZ = 1176.45e6
GALILEO_STEP_DEG = 5.0
GALILEO_USER_SIGMA_M = (
    0.4529, 0.3553, 0.3063, 0.2638, 0.2593, 0.2555, 0.2504, 0.2438, 0.2396,
    0.2359, 0.2339, 0.2302, 0.2295, 0.2278, 0.2297, 0.2310, 0.2274, 0.2277,
)  # fmt: skip
"""Ionosphere-free user error of Galileo at 5, 10, ... 90 deg."""


@dataclass(frozen=True)
class SupportMessage:
    """Errors of orbits and clocks that the integrity support message bounds, for all
    constellations or by letter.

    Parameters
    ----------
    ura_m : 1-sigma that integrity counts with, URA of GPS or SISA of Galileo.
    ure_m : 1-sigma that accuracy and continuity count with, URE or SISE.
    b_nom_m : bound of the nominal bias.
    """

    ura_m: PerConstellation = 0.75
    ure_m: PerConstellation = 0.5
    b_nom_m: PerConstellation = 0.5

    def __post_init__(self) -> None:
        for name, least in (("ura_m", 0.0), ("ure_m", 0.0), ("b_nom_m", 0.0)):
            given = getattr(self, name)
            values = list(given.values()) if isinstance(given, Mapping) else [given]
            for value in values:
                if not isinstance(value, Real) or not least <= float(value) < np.inf:
                    raise InputError(
                        f"{name} must be a length from 0", where=name, evidence=f"{value!r}"
                    )


def tropospheric_sigma_m(elevation_deg: ArrayLike) -> Floats:
    """1-sigma of what the tropospheric model leaves: 0.12 x 1.001 / sqrt(0.002001 + sin^2 e) m.

    NaN below the horizon. Source: ADD 3.0 after RTCA DO-229D, A.4.2.4.
    """
    elevation = _above_horizon(elevation_deg)
    sigma: Floats = 0.12 * 1.001 / np.sqrt(0.002001 + np.sin(np.deg2rad(elevation)) ** 2)
    return sigma


def gps_user_sigma_m(elevation_deg: ArrayLike) -> Floats:
    """1-sigma of multipath and noise of the ionosphere-free L1 and L5 code of an aircraft.

    sqrt((f1^4 + f5^4) / (f1^2 - f5^2)^2) x hypot(0.13 + 0.53 exp(-e/10), 0.15 + 0.43 exp(-e/6.9)),
    e in degrees; NaN below the horizon. Source: ADD 3.0.
    """
    elevation = _above_horizon(elevation_deg)
    multipath = 0.13 + 0.53 * np.exp(-elevation / 10.0)
    noise = 0.15 + 0.43 * np.exp(-elevation / 6.9)
    sigma: Floats = _IONOSPHERE_FREE * np.hypot(multipath, noise)
    return sigma


_IONOSPHERE_FREE = float(np.hypot(L1_HZ**2, L5_HZ**2) / (L1_HZ**2 - L5_HZ**2))


def galileo_user_sigma_m(elevation_deg: ArrayLike) -> Floats:
    """1-sigma of multipath and noise of the ionosphere-free E1 and E5a code of an aircraft.

    Straight lines between the table's values; NaN below 5 deg, where the table ends. Source:
    Blanch et al. 2015, Table A.I.
    """
    elevation = np.asarray(elevation_deg, dtype=np.float64)
    table = GALILEO_STEP_DEG * np.arange(1, len(GALILEO_USER_SIGMA_M) + 1)
    return np.interp(elevation, table, GALILEO_USER_SIGMA_M, left=np.nan, right=np.nan)


def dual_frequency_ranges(
    elevation_deg: ArrayLike,
    azimuth_deg: ArrayLike,
    constellation: ArrayLike,
    *,
    message: SupportMessage | None = None,
    used: ArrayLike | None = None,
) -> AraimGeometry:
    """Ranges of GPS and Galileo with the errors that ARAIM expects of an aircraft.

    C_int = URA^2 + sigma_tropo^2 + sigma_user^2, C_acc the same with URE.

    Parameters
    ----------
    elevation_deg, azimuth_deg : (n, m) directions [deg].
    constellation : (m,) or (n, m) letters; only "G" and "E" have a model of user errors.
    message : errors of orbits and clocks; None: those of Appendix D.
    used : (n, m) False where a range is not in the fix.

    Raises
    ------
    InputError : a constellation without a model of user errors, or without a bound in `message`.
    """
    message = message or SupportMessage()
    bare = AraimGeometry(elevation_deg, azimuth_deg, constellation, 1.0, 1.0, 0.0, used)
    letters, clock, known = bare.clocks()
    elevation = np.asarray(bare.elevation_deg)
    local = np.full(elevation.shape, np.nan)
    # SBAS satellites share the clock of GPS and not its errors.
    present = "S" if (np.asarray(bare.constellation) == "S").any() else ""
    for letter in (*letters, *present):
        if letter not in _USER_SIGMA:
            raise InputError(
                f"no model of user errors for constellation {letter}",
                where="constellation",
                cure="AraimGeometry(..., sigma_int_m=, sigma_acc_m=) with sigmas of your own",
            )
    for number, letter in enumerate(letters):
        own = known & (clock == number)
        local[own] = _USER_SIGMA[letter](elevation[own])
    variance = local**2 + tropospheric_sigma_m(elevation) ** 2

    def bound(name: str) -> NDArray[Any]:
        if not letters:
            return np.zeros(elevation.shape)
        return by_constellation(name, getattr(message, name), letters)[clock]

    return AraimGeometry(
        elevation, np.asarray(bare.azimuth_deg), np.asarray(bare.constellation),
        np.sqrt(variance + bound("ura_m") ** 2), np.sqrt(variance + bound("ure_m") ** 2),
        bound("b_nom_m"), np.asarray(bare.used),
    )  # fmt: skip


_USER_SIGMA = {"G": gps_user_sigma_m, "E": galileo_user_sigma_m}


def _above_horizon(elevation_deg: ArrayLike) -> Floats:
    elevation = np.asarray(elevation_deg, dtype=np.float64)
    return np.where(elevation >= 0, elevation, np.nan)
