"""Changes of frame against published examples and parameters, computed apart."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest

from sbas.exceptions import InputError
from sbas.frames import Changed, change_frame, decimal_year, find_frame, frame_change, unprojected

MAS = np.radians(1 / 3_600_000)
BRUSSELS = np.array([4027894.006, 307045.600, 4919474.910])
"""The place of the examples of the EUREF Permanent Network's transformation service."""

PARAMETERS = {
    # EUREF Technical Note 1 (Altamimi 2018), tables of ITRF2014 at epoch 2010.0: T [mm], D [ppb],
    # R [mas], and their rates a year.
    "ETRF2000": ((54.7, 52.2, -74.1), 2.12, (1.701, 10.290, -16.632),
                 (0.1, 0.1, -1.9), 0.11, (0.081, 0.490, -0.792)),
    "ETRF2014": ((0, 0, 0), 0, (1.785, 11.151, -16.170), (0, 0, 0), 0, (0.085, 0.531, -0.770)),
}  # fmt: skip


def helmert(frame: str, place: np.ndarray, year: float, sense: int = 1) -> np.ndarray:
    """ITRF2014 to an ETRF (sense 1) or back (-1): X' = X + T + D X + R X, TN 1, equation 1."""
    t, d, r, dt, dd, dr = PARAMETERS[frame]
    dy = year - 2010.0
    shift = (np.array(t) + dy * np.array(dt)) * 1e-3
    scale = (d + dy * dd) * 1e-9
    turn = (np.array(r) + dy * np.array(dr)) * MAS

    def forward(x: np.ndarray) -> np.ndarray:
        return np.asarray(x + shift + scale * x + np.cross(turn, x))

    if sense > 0:
        return forward(place)
    back = place
    for _ in range(5):  # the inverse by iteration: terms of 1e-16 are left
        back = place - (forward(back) - back)
    return back


def ecef(done: Changed) -> np.ndarray:
    return np.array(pymap3d.geodetic2ecef(done.lat_deg, done.lon_deg, done.height_m)).ravel()


def changed(text: str, place: np.ndarray, **options: object) -> Changed:
    lat, lon, height = pymap3d.ecef2geodetic(*place)
    return change_frame(frame_change(text), lat, lon, height, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # Examples 4 and 5 of the service's tutorial (epncb.oma.be, coordinate transformation).
        ("ITRF2000>ETRF2000@2012", (4027894.3559, 307045.2508, 4919474.6447)),
        ("ITRF2014>ETRF2000@2012", (4027894.3662, 307045.2530, 4919474.6263)),
    ],
)
def test_published_examples(text: str, expected: tuple[float, ...]) -> None:
    assert np.abs(ecef(changed(text, BRUSSELS)) - expected).max() < 1e-4


@pytest.mark.parametrize("frame", ["ETRF2000", "ETRF2014"])
@pytest.mark.parametrize("year", [1995.0, 2010.0, 2025.5])
def test_fourteen_parameters_computed_apart(frame: str, year: float) -> None:
    prague = np.array(pymap3d.geodetic2ecef(50.03, 15.77, 289.4))
    there = changed(f"ITRF2014>{frame}@{year}", prague)
    assert np.abs(ecef(there) - helmert(frame, prague, year)).max() < 1e-4
    back = changed(f"{frame}>ITRF2014@{year}", prague)
    assert np.abs(ecef(back) - helmert(frame, prague, year, -1)).max() < 1e-4
    assert back.sigma_m == 0.0
    assert str(back.frame) == f"ITRF2014 {year:.8g}"
    assert f"ITRF2014 to {frame}" in back.description


def test_each_point_of_a_trajectory_has_its_own_epoch() -> None:
    lat, lon, height = np.full(3, 50.03), np.full(3, 15.77), np.full(3, 289.4)
    years = np.array([2005.0, 2015.0, 2025.0])
    done = change_frame(frame_change("ETRF2000>ITRF2014"), lat, lon, height, epoch=years)
    for i, year in enumerate(years):
        one = change_frame(frame_change(f"ETRF2000>ITRF2014@{year}"), 50.03, 15.77, 289.4)
        assert done.lon_deg[i] == pytest.approx(one.lon_deg[0], abs=1e-12)
    assert done.frame.epoch == 2015.0


def test_a_point_at_rest_on_the_plate_moves_with_it() -> None:
    prague = np.array(pymap3d.geodetic2ecef(50.03, 15.77, 289.4))
    moved = ecef(changed("ITRF2014 2010.0>ETRF2014>ITRF2014@2020.0", prague)) - prague
    # Velocity of the Eurasian plate in TN 1: the rates of rotation times the radius.
    velocity = -np.cross(np.array((0.085, 0.531, -0.770)) * MAS, prague)
    assert np.abs(moved - 10 * velocity).max() < 1e-3


def test_accuracies_add_up_and_several_ways_are_told() -> None:
    done = change_frame(
        frame_change("S-JTSK>ETRS89>ITRF2014@2025.5"), [50.03, 50.04], [15.77, 15.78], [289.4, 290]
    )
    # EPSG: 1 m for "S-JTSK to ETRS89 (1)", 0.1 m for the realisations of ETRS89.
    assert done.sigma_m == pytest.approx(np.hypot(1.0, 0.1))
    assert "'S-JTSK to ETRS89 (1)', accuracy 1 m" in done.description
    assert "operations part by up to" in done.description
    named = change_frame(frame_change("S-JTSK>ETRS89[S-JTSK to ETRS89 (4)]"), 49.0, 18.0, 200.0)
    assert "(4)" in named.description


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ETRF2000>ITRF2014", "depend on the epoch"),
        ("ITRF2014 2010.0>ITRF2020@2025.5", "not of the epoch"),
        ("ITRF2014 2010.0>ETRF2000@2025.5", "not of the epoch"),
        ("ETRF2000>WGS 84@2025", "known to 2 m"),
        ("WGS 84>ITRF2014@2025", "known to 2 m"),
        ("S-JTSK>ITRF2014@2025.5", "go through another frame"),
        ("DHDN>ETRS89", "at this place"),  # Germany, asked for in Bohemia
        ("S-JTSK>ETRS89[Slovak grid]", "put words of one"),
    ],
)
def test_no_transformation_is_made_up(text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        change_frame(frame_change(text), 50.03, 15.77, 289.4)
    assert says in str(caught.value)
    assert caught.value.cure


def test_krovak_as_in_the_guidance_note() -> None:
    # IOGP Guidance Note 7-2, Krovak: 50 12' 32.442" N, 16 50' 59.179" E of S-JTSK has southing
    # 1050538.643 m and westing 568990.997 m.
    lat, lon = unprojected(find_frame("EPSG:5514"), [-568990.997], [-1050538.643])
    assert lat[0] == pytest.approx(
        50 + 12 / 60 + 32.442 / 3600, abs=1.5e-7
    )  # three decimals of a second
    assert lon[0] == pytest.approx(
        16 + 50 / 60 + 59.179 / 3600, abs=1.5e-7
    )  # three decimals of a second


def test_projected_coordinates_have_a_projection_and_lie_within_it() -> None:
    lat, lon = unprojected(find_frame("EPSG:25833"), [500_000.0], [0.0])
    assert (lat[0], lon[0]) == pytest.approx((0.0, 15.0), abs=1e-9)  # the central meridian
    with pytest.raises(InputError, match="not projected"):
        unprojected(find_frame("ETRS89"), [0.0], [0.0])
    with pytest.raises(InputError, match="do not lie within"):
        unprojected(find_frame("EPSG:25833"), [1e12], [5e6])


def test_decimal_years_follow_the_calendar() -> None:
    at = np.array(["2025-01-01", "2025-07-02T12", "2024-12-31T12"], "M8[ns]")
    np.testing.assert_allclose(decimal_year(at), [2025.0, 2025.5, 2024 + 365.5 / 366], atol=1e-12)
