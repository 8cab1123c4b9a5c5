"""Two exponentials: exact mixtures are taken apart, single ones are not."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.integrity.correlation.two_processes import fit_two_processes, seconds_text

LAG = np.arange(20_000.0)


@pytest.mark.parametrize("white", [0.0, 0.2])
@pytest.mark.parametrize(
    ("short", "long", "share"), [(30.0, 1500.0, 0.5), (100.0, 720.0, 0.5), (20.0, 400.0, 0.2)]
)
def test_exact_mixtures_are_recovered(
    short: float, long: float, share: float, white: float
) -> None:
    r = share * np.exp(-LAG / short) + (1 - share) * np.exp(-LAG / long)
    r[1:] *= 1 - white
    two = fit_two_processes(r, 1.0)
    assert two is not None
    found = (two.tau_1_s, two.tau_2_s, two.share_1, two.nugget)
    assert found == pytest.approx((short, long, share, white), rel=1e-4, abs=1e-6)
    assert two.rms < 1e-7
    # -1/r'(0+) of the mixture.
    assert two.tau_short_s == pytest.approx(1 / (share / short + (1 - share) / long), rel=1e-4)
    np.testing.assert_allclose(two.correlation(LAG[1:]), r[1:], atol=1e-7)
    assert two.to_dict()["tau_short_s"] == two.tau_short_s


def test_the_step_scales_the_times() -> None:
    r = 0.5 * np.exp(-LAG / 30) + 0.5 * np.exp(-LAG / 300)
    two = fit_two_processes(r, 0.2)
    assert two is not None
    assert (two.tau_1_s, two.tau_2_s) == pytest.approx((6.0, 60.0), rel=1e-4)


def test_one_process_or_too_few_lags_give_none() -> None:
    assert fit_two_processes(np.exp(-LAG / 360), 1.0) is None
    assert fit_two_processes(np.exp(-LAG / 2), 1.0) is None


def test_seconds_are_never_a_power_of_ten() -> None:
    assert [seconds_text(s) for s in (29.44, 999.4, 999.6, 1484.0)] == [
        "29.4 s", "999 s", "1000 s", "1480 s",
    ]  # fmt: skip
