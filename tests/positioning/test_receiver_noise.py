"""The receiver's own error (page section 15, check value 1)."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.positioning.receiver_noise import CLASS_1, CLASS_2, ReceiverNoise

ELEVATION = np.array([5.0, 10.0, 90.0])
GPS = np.zeros(3, bool)


def test_airborne_classes() -> None:
    class_2 = CLASS_2.sigma_m(ELEVATION, GPS)
    assert class_2 == pytest.approx([0.577422947183, 0.484983987421, 0.382775404316], abs=1e-12)
    assert CLASS_1.sigma_m(ELEVATION, GPS) == pytest.approx([5.0, 5.0, 5.0])


def test_sbas_ranging_has_a_noise_of_its_own() -> None:
    multipath = np.array([0.451461249648, 0.324976103821, 0.130065407196])
    got = CLASS_2.sigma_m(ELEVATION, ~GPS)
    assert got == pytest.approx(np.hypot(1.8, multipath), abs=1e-11)


def test_a_model_of_ones_own() -> None:
    own = ReceiverNoise(0.5, 2.0, 0.2, 1.0, 3.0, 20.0)
    exact = np.sqrt(0.25 + 0.04 + (1 + 3 * np.exp(-ELEVATION / 20)) ** 2)
    assert own.sigma_m(ELEVATION, GPS) == pytest.approx(exact)


@pytest.mark.parametrize(
    "values", [{"noise_gps_m": -0.1}, {"divergence_m": np.nan}, {"multipath_c_deg": 0.0}]
)
def test_a_model_that_is_none(values: dict[str, float]) -> None:
    with pytest.raises(InputError):
        ReceiverNoise(**values)
