"""Cumulative incidence against statsmodels, ties and frequency weights included."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.fusion.critical.competing_risks import cumulative_incidence

survfunc = pytest.importorskip(
    "statsmodels.duration.survfunc", reason="statsmodels is the peer of this test"
)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("weighted", [False, True])
def test_incidence_equals_the_peers(seed: int, weighted: bool) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(20, 400))
    time, outcome = rng.integers(1, 12, size), rng.integers(0, 3, size)
    weights = rng.integers(1, 6, size) if weighted else None
    peer = survfunc.CumIncidenceRight(time, outcome, freq_weights=weights)
    ours = cumulative_incidence(
        time, outcome, weights=None if weights is None else weights.astype(float)
    )
    known = np.isin(ours.time, peer.times)
    np.testing.assert_array_equal(ours.time[known], peer.times)
    np.testing.assert_allclose(ours.incidence[known], peer.cinc[0], rtol=1e-12)


def test_the_hand_case_of_the_page_equals_the_peers() -> None:
    time, outcome = np.array([1, 1, 2, 2, 3, 3]), np.array([1, 2, 1, 0, 2, 1])
    # With weights the peer gives no standard error, which would divide by zero here.
    peer = survfunc.CumIncidenceRight(time, outcome, freq_weights=np.ones(6))
    np.testing.assert_allclose(
        cumulative_incidence(time, outcome).incidence, peer.cinc[0], rtol=1e-14
    )
