from __future__ import annotations

import time

import numpy as np
import pytest

from sbas.integrity.causes.running_level import running_level

S = 1_000_000_000


def seconds(n: int) -> np.ndarray:
    return np.arange(n, dtype=np.int64) * S


def test_the_reference_is_the_median_of_the_window_without_spikes() -> None:
    """Two ways: the definition, epoch by epoch, with the spikes found left out."""
    rng = np.random.default_rng(3)
    hpl = np.exp(rng.normal(2.4, 0.1, 1500))
    hpl[700:730] = 90.0
    reference, spike = running_level(seconds(1500), hpl, window_s=100.0)
    assert np.flatnonzero(spike).tolist() == list(range(700, 730))
    for row in (0, 3, 400, 715, 728, 1499):
        # pandas' centred window is open on the left: (t - 50 s, t + 50 s].
        window = np.arange(max(row - 49, 0), min(row + 51, 1500))
        expected = np.median(hpl[window][~spike[window]])
        assert reference[row] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("length", [1, 10, 290, 400, 590, 1500])
def test_spikes_are_found_whole_even_where_they_fill_the_window(length: int) -> None:
    hpl = np.full(12_000, 11.0)
    hpl[5000 : 5000 + length] = 40.0
    reference, spike = running_level(seconds(12_000), hpl)
    assert np.flatnonzero(spike).tolist() == list(range(5000, 5000 + length))
    np.testing.assert_allclose(reference, 11.0)


def test_three_times_the_median_is_no_spike_and_a_lasting_level_is_none() -> None:
    hpl = np.full(20_000, 10.0)
    hpl[100:105] = 30.0
    hpl[10_000:] = 35.0
    _, spike = running_level(seconds(20_000), hpl)
    assert not spike[:9000].any()
    assert not spike[13_000:].any()


def test_gaps_and_missing_levels() -> None:
    time_ns = np.concatenate([seconds(2000), seconds(2000) + 50_000 * S])
    hpl = np.full(4000, 11.0)
    hpl[2000:] = 13.0
    hpl[:5] = hpl[1990:2010] = np.nan
    hpl[2010] = 80.0
    reference, spike = running_level(time_ns, hpl)
    assert np.flatnonzero(spike).tolist() == [2010]
    # The gap parts the windows.
    assert reference[1980] == 11.0
    assert reference[2010] == 13.0
    nothing = running_level(seconds(5), np.full(5, np.nan))
    assert np.isnan(nothing[0]).all()
    assert not nothing[1].any()


def test_three_hundred_thousand_epochs_in_a_second() -> None:
    rng = np.random.default_rng(0)
    hpl = 11 + np.sin(np.arange(300_000) / 7000) + rng.normal(0, 0.1, 300_000)
    hpl[150_000:150_030] = 80.0
    begin = time.process_time()
    _, spike = running_level(seconds(300_000), hpl)
    assert time.process_time() - begin < 1.0
    assert spike.sum() == 30
