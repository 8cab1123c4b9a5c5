"""Stanford regions: what a protection level was worth at one epoch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

REGIONS = ("nominal", "unavailable", "mi_unavailable", "mi", "hmi", "missing")
"""Names by code. MI: misleading information, the error is not bounded by the level;
HMI: hazardously so, the error reaches the alert limit and no alert is given."""


def stanford_regions(
    error_m: ArrayLike, level_m: ArrayLike, alert_limit_m: float
) -> NDArray[np.int8]:
    """Region code of every epoch: disjoint, and a tie is always unsafe.

    Parameters
    ----------
    error_m, level_m : (n,) position error and protection level [m]; NaN where missing.
    alert_limit_m : alert limit [m].

    Returns
    -------
    (n,) codes into `REGIONS`:
        5 error or level missing; 4 error >= AL > level; 3 AL > error >= level;
        2 error >= level >= AL; 1 level >= AL; 0 otherwise.

    References
    ----------
    T. Walter, Stanford chart `hplstat.m` (1998); RTCA DO-229D, 1.7.2.
    """
    error = np.asarray(error_m, dtype=float)
    level = np.asarray(level_m, dtype=float)
    # Comparisons with NaN are false and would land in nominal: missing is decided on its own.
    missing = ~(np.isfinite(error) & np.isfinite(level))
    misled = error >= level
    down = level >= alert_limit_m
    codes = np.zeros(error.shape, np.int8)
    codes[down] = 1
    codes[misled & down] = 2
    codes[misled & ~down] = 3
    codes[(error >= alert_limit_m) & ~down] = 4
    codes[missing] = 5
    return codes
