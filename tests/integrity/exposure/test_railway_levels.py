"""HPL for another target: the ratio of the K and nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.integrity.exposure.railway_levels import railway_hpl


def test_hpl_of_the_two_modes() -> None:
    # Methods page, section 7: 6.0/6.18 = 0.9709 with equal sigmas.
    assert railway_hpl(100.0, k_from=6.18, k_to=6.0) == pytest.approx(97.09, abs=5e-3)


def test_missing_stays_missing_and_the_input_untouched() -> None:
    hpl = np.array([10.0, math.nan, 30.0])
    scaled = railway_hpl(hpl, k_from=6.18, k_to=6.7236)
    assert np.isnan(scaled[1])
    assert scaled[[0, 2]] == pytest.approx(np.array([10, 30]) * 6.7236 / 6.18, rel=1e-15)
    assert hpl[0] == 10


@pytest.mark.parametrize(("k_from", "k_to"), [(0, 6), (6, -1), (math.nan, 6), (6, math.inf)])
def test_k_out_of_range(k_from: float, k_to: float) -> None:
    with pytest.raises(InputError, match="k_"):
        railway_hpl(10, k_from=k_from, k_to=k_to)
