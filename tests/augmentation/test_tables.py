"""Tables of the standard against the figures that they come from."""

from __future__ import annotations

import numpy as np

from sbas.augmentation.tables import (
    DEGRADATION_MPS2,
    DELTA_UDRE,
    FAST_TIMEOUT_S,
    GIVE_VARIANCE_M2,
    UDRE_VARIANCE_M2,
)

UDRE_M = [0.75, 1.0, 1.25, 1.75, 2.25, 3.0, 3.75, 4.5, 5.25, 6.0, 7.5, 15, 50, 150]
GIVE_M = [0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0, 3.6, 4.5, 6.0, 15, 45]
NORMAL_999 = 3.29
"""A UDRE and a GIVE are bounds at 99.9 %, 3.29 sigma."""


def test_variances_are_those_of_the_bounds() -> None:
    """Within the digits that the standard prints."""
    np.testing.assert_allclose(
        UDRE_VARIANCE_M2[:14], (np.array(UDRE_M) / NORMAL_999) ** 2, rtol=1e-3
    )
    np.testing.assert_allclose(
        GIVE_VARIANCE_M2[:15], (np.array(GIVE_M) / NORMAL_999) ** 2, rtol=1.2e-2
    )
    assert np.isnan(UDRE_VARIANCE_M2[14:]).all()
    assert np.isnan(GIVE_VARIANCE_M2[15:]).all()


def test_more_degradation_means_less_time() -> None:
    assert (np.diff(DEGRADATION_MPS2) > 0).all()
    for timeout in FAST_TIMEOUT_S.values():
        assert (np.diff(timeout) <= 0).all()
    np.testing.assert_array_equal(FAST_TIMEOUT_S["npa"], 1.5 * FAST_TIMEOUT_S["pa"])


def test_factors_begin_at_1_and_rise() -> None:
    assert DELTA_UDRE[0] == 1
    assert (np.diff(DELTA_UDRE) > 0).all()
    assert DELTA_UDRE.size == 16


def test_tables_cannot_be_written() -> None:
    for table in (UDRE_VARIANCE_M2, GIVE_VARIANCE_M2, DEGRADATION_MPS2, DELTA_UDRE):
        assert not table.flags.writeable
