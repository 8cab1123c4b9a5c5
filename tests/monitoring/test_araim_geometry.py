"""What can be ranges of ARAIM, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_geometry import AraimGeometry
from tests.monitoring.araim_reference import appendix_d


def changed(**values: Any) -> AraimGeometry:
    return AraimGeometry(**(appendix_d() | values))


def test_one_epoch_may_come_without_its_axis() -> None:
    assert changed().shape == (1, 10)


def test_letters_by_slot_and_by_epoch_are_the_same() -> None:
    example = appendix_d()
    wide = {k: np.tile(v, (3, 1)) for k, v in example.items()}
    letters, index, known = AraimGeometry(**wide).clocks()
    by_slot = AraimGeometry(**(wide | {"constellation": example["constellation"]})).clocks()
    assert letters == by_slot[0] == ("G", "E")
    assert (index == by_slot[1]).all()
    assert (index[:, :5] == 0).all()
    assert (index[:, 5:] == 1).all()
    assert known.all()
    assert by_slot[2].all()


@pytest.mark.parametrize("empty", ["", None, np.nan])
def test_empty_slots_have_no_letter(empty: object) -> None:
    letters = np.array([*appendix_d()["constellation"][:9], empty], dtype=object)
    found, _, known = changed(constellation=letters).clocks()
    assert found == ("G", "E")
    assert known[0].tolist() == [True] * 9 + [False]


def test_unknown_letters_are_refused() -> None:
    with pytest.raises(InputError, match="unknown constellation 'X'"):
        changed(constellation=["G"] * 9 + ["X"]).clocks()


def test_radians_are_refused_with_a_cure() -> None:
    example = appendix_d()
    with pytest.raises(InputError, match="rad2deg"):
        changed(
            elevation_deg=np.deg2rad(example["elevation_deg"]),
            azimuth_deg=np.deg2rad(example["azimuth_deg"]),
        )


def test_elevations_in_radians_are_noticed_alone() -> None:
    with pytest.raises(InputError, match="radians"):
        changed(elevation_deg=np.deg2rad(appendix_d()["elevation_deg"]))


def test_sbas_satellites_keep_the_time_of_gps() -> None:
    letters, index, known = changed(constellation=list("GGGGGEEEES")).clocks()
    assert letters == ("G", "E")
    assert index[0].tolist() == [0] * 5 + [1] * 4 + [0]
    assert known.all()
    assert changed(constellation=list("EEEEESSSSS")).clocks()[0] == ("G", "E")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"elevation_deg": np.full(10, 90.5)}, "beyond 90"),
        ({"b_nom_m": -0.1}, "negative"),
        ({"sigma_acc_m": np.ones(9)}, "sigma_acc_m does not fit"),
        ({"elevation_deg": np.ones((1, 1, 10))}, "epochs x satellites"),
        ({"used": np.ones((2, 10), bool)}, "used does not fit"),
        ({"used": np.full(10, np.nan)}, "booleans"),
        ({"used": [True, None] * 5}, "booleans"),
        ({"used": ["True"] * 10}, "booleans"),
        ({"elevation_deg": [["a"] * 10]}, "elevation_deg must be numbers"),
        ({"sigma_int_m": "a"}, "sigma_int_m must be numbers"),
    ],
)
def test_nonsense_is_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        changed(**change)


def test_nonsense_in_slots_that_are_not_used_does_not_matter() -> None:
    elevation = appendix_d()["elevation_deg"]
    elevation[3] = 400.0
    used = np.arange(10) != 3
    assert changed(elevation_deg=elevation, used=used).shape == (1, 10)
