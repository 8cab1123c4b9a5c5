"""Tables of the SBAS L1 message standard: what indices mean, and how long data stay valid.

Source: RTCA DO-229D, A.4.4 and J.2 (tables A-6, A-8, A-9, A-17, A-19, A-21, A-25, J-2), held
against gLAB 6.0.0, MAAST and Ginan, which agree on the variances.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Mode = Literal["pa", "npa"]
"""Precision approach or non-precision approach: which data serve, and for how long."""

Floats = NDArray[np.float64]


def _table(*values: float) -> Floats:
    array = np.array(values)
    array.flags.writeable = False
    return array


UDRE_VARIANCE_M2 = _table(
    0.0520, 0.0924, 0.1444, 0.2830, 0.4678, 0.8315, 1.2992, 1.8709, 2.5465, 3.3260, 5.1968,
    20.7870, 230.9661, 2078.695, np.nan, np.nan,
)  # fmt: skip
"""Variance of the fast and long-term corrected range by UDREI; none for 14 and 15."""
UDREI_NOT_MONITORED = 14
"""From here on a satellite must not be used; 15 says so outright."""

GIVE_VARIANCE_M2 = _table(
    0.0084, 0.0333, 0.0749, 0.1331, 0.2079, 0.2994, 0.4075, 0.5322, 0.6735, 0.8315, 1.1974,
    1.8709, 3.3260, 20.7870, 187.0826, np.nan,
)  # fmt: skip
"""Variance of the vertical ionospheric delay at a grid point by GIVEI; none for 15."""
GIVEI_NOT_MONITORED = 15
DELAY_DO_NOT_USE = 511
"""Raw vertical delay of a grid point that must not be used."""

DEGRADATION_MPS2 = _table(
    0.0, 0.00005, 0.00009, 0.00012, 0.00015, 0.00020, 0.00030, 0.00045, 0.00060, 0.00090,
    0.00150, 0.00210, 0.00270, 0.00330, 0.00460, 0.00580,
)  # fmt: skip
"""Fast correction degradation factor a by its indicator ai (message type 7)."""
FAST_TIMEOUT_S: dict[Mode, Floats] = {
    "pa": _table(120, 120, 102, 90, 90, 78, 66, 54, 42, 30, 30, 18, 18, 18, 12, 12),
    "npa": _table(180, 180, 153, 135, 135, 117, 99, 81, 63, 45, 45, 27, 27, 27, 18, 18),
}
"""Time-out I_fc of a fast correction by ai [s]."""

DELTA_UDRE = _table(1, 1.1, 1.25, 1.5, 2, 3, 4, 5, 6, 8, 10, 20, 30, 40, 50, 100)
"""Factor on the UDRE by region by its indicator (message type 27)."""

MASK_TIMEOUT_S = 600
UDREI_TIMEOUT_S: dict[Mode, int] = {"pa": 12, "npa": 18}
SLOW_TIMEOUT_S: dict[Mode, int] = {"pa": 240, "npa": 360}
"""Of message types 7, 9, 10, 24/25 (long term) and 28."""
IONO_MASK_TIMEOUT_S = 1200
IONO_DELAY_TIMEOUT_S = 600
SERVICE_TIMEOUT_S = 86400
"""Of message type 27."""

SLOTS = 51
"""Most satellites of one PRN mask."""
