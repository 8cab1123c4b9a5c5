"""ARAIM on the ranges of a recording's fixes."""

from __future__ import annotations

from dataclasses import replace
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from sbas.exceptions import InputError
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels
from sbas.monitoring.araim_result import AraimResult
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.recorded_ranges import Sigma, recorded_ranges
from sbas.recording import Recording


def araim_of_recording(
    recording: Recording,
    *,
    settings: AraimSettings | None = None,
    b_nom_m: float = 0.5,
    accuracy_share: float = 1.0,
    heading_deg: ArrayLike | None = None,
    sigma: Sigma = None,
    elevation_mask_deg: float | None = None,
) -> AraimResult:
    """Levels of ARAIM at every epoch of a recording, from the sigmas of its own ranges.

    Parameters
    ----------
    recording : with a side table `satellites` (elevation, azimuth, sigma, residual, used).
    settings : priors and budgets; None: those of LPV-200. A single constellation has a level only
        where its prior lies far below the budgets: its fault leaves nothing to compare with.
    b_nom_m : bound of the nominal bias of every range [m], 0.5 as in Appendix D; SBAS corrections
        carry no such bound.
    accuracy_share : 1-sigma of accuracy over that of integrity, in (0, 1]. 1 counts the overbound
        as if it were the accuracy, which widens the thresholds and so the levels.
    heading_deg : (n,) or one for all: levels along and across a track as well [deg].
    sigma, elevation_mask_deg : as `sbas.raim` takes them.

    Returns
    -------
    AraimResult over the recording's epochs, in their order, with the findings about its ranges.
    Epochs whose fix lacks a direction, sigma or residual of one of its ranges have no level, and
    without residuals no epoch is available.

    Raises
    ------
    InputError : no ranges, a share outside (0, 1], a bound that is no length, or as
        `araim_levels`.

    References
    ----------
    WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017).
    """
    if not isinstance(accuracy_share, Real) or not 0 < accuracy_share <= 1:
        raise InputError(
            "the share of accuracy lies in (0, 1]", where="accuracy_share",
            evidence=f"{accuracy_share!r}", cure="1 where accuracy is not known apart",
        )  # fmt: skip
    if not isinstance(b_nom_m, Real) or not 0 <= b_nom_m < np.inf:
        raise InputError(
            "the bound of the nominal bias is a length from 0 [m]", where="b_nom_m",
            evidence=f"{b_nom_m!r}", cure="0.5 as in Appendix D where nothing better is known",
        )  # fmt: skip
    given = recorded_ranges(recording, sigma=sigma, elevation_mask_deg=elevation_mask_deg)
    # A fix of which one range is not known is not the fix that was made.
    used = given.used & (given.reason == 0)
    letters = np.array([name[:1] for name in given.names] + [""])
    spread = given.sigma_m.T
    # Without any satellite there is still one, empty, slot.
    empty = np.full((given.reason.size, 1), np.nan)
    bare = not len(given.used)
    result = araim_levels(
        AraimGeometry(
            empty if bare else given.elevation_deg.T,
            empty if bare else given.azimuth_deg.T,
            np.full((given.reason.size, 1), "") if bare else letters[given.satellite.T],
            empty if bare else spread,
            empty if bare else accuracy_share * spread,
            b_nom_m,
            False if bare else used.T,
        ),
        heading_deg=heading_deg,
        residual_m=given.residual_m.T if given.has_residuals and not bare else None,
        settings=settings,
    )
    # What is wrong with the recording is a better word than what is left of its fix.
    reason = np.where(given.reason > 0, given.reason, result.reason)
    return replace(result, reason=reason, findings=given.findings, masked=given.masked)
