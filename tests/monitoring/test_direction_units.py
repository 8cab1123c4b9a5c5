"""What tells radians from degrees, and what does not."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.monitoring.direction_units import radians_in


def drawn(satellites: int, epochs: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    n = satellites * epochs
    epoch = np.repeat(np.arange(epochs), satellites)
    return np.rad2deg(np.arcsin(rng.uniform(0.05, 1, n))), rng.uniform(0, 360, n), epoch


def test_degrees_give_no_evidence() -> None:
    assert radians_in(*drawn(12, 30)) == ""
    nothing = np.full(6, np.nan)
    assert radians_in(nothing, nothing, np.zeros(6, int)) == ""
    assert radians_in(np.empty(0), np.empty(0), np.empty(0, int)) == ""


@pytest.mark.parametrize(("satellites", "epochs"), [(5, 1), (12, 40), (4, 5)])
def test_elevations_in_radians_whatever_the_azimuths(satellites: int, epochs: int) -> None:
    elevation, azimuth, epoch = drawn(satellites, epochs)
    assert "none above" in radians_in(np.deg2rad(elevation), np.deg2rad(azimuth), epoch)
    assert "none above" in radians_in(np.deg2rad(elevation), azimuth, epoch)


def test_one_epoch_in_radians_among_others() -> None:
    elevation, azimuth, epoch = drawn(8, 3)
    elevation[8:16] = np.deg2rad(elevation[8:16])
    assert radians_in(elevation, azimuth, epoch).startswith("1 epochs")


def test_azimuths_in_radians() -> None:
    elevation, azimuth, epoch = drawn(8, 3)
    assert "azimuths" in radians_in(elevation, np.deg2rad(azimuth), epoch)


def test_a_few_low_satellites_and_unset_elevations_are_no_radians() -> None:
    elevation, azimuth, epoch = drawn(8)
    elevation[:6] = 0.2, 0.5, 0.9, 1.1, 1.4, 1.5
    assert radians_in(elevation, azimuth, epoch) == ""
    assert radians_in(elevation[:4], azimuth[:4], epoch[:4]) == ""
    assert radians_in(np.zeros(8), azimuth, epoch) == ""
