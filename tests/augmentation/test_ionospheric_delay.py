"""Slant delays from the grid, against a plain look-up of one place at a time."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sbas.augmentation.grid_points import BAND_POINTS, grid_points
from sbas.augmentation.ionospheric_delay import SlantIonosphere, slant_ionosphere
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc
from tests.augmentation.iono_reference import GIVE_VARIANCE, Grid, Point, vertical

SEEDS = range(12)
ZONES = {"middle": (-60, 60), "north": (60, 75), "south": (-75, -60), "far north": (75, 85),
         "far south": (-85, -75), "pole": (85, 90), "south pole": (-90, -85)}  # fmt: skip


def broadcast(
    chosen: dict[int, dict[int, Point]], *, iodi: int = 1, start: int = 0
) -> dict[int, bytes]:
    """Masks and delays of points by band and number (from 1), a message a second."""
    messages: list[bytes] = []
    for band, points in chosen.items():
        messages.append(enc.iono_mask(len(chosen), band, iodi, points))
    for band, points in chosen.items():
        numbers = sorted(points)
        for block in range((len(numbers) + 14) // 15):
            own = [points[n] for n in numbers[15 * block : 15 * block + 15]]
            if all(point.delay is None for point in own):
                continue
            filled = own + [Point(0, 15)] * (15 - len(own))
            delays = [0 if p.delay is None else p.delay for p in filled]
            messages.append(enc.iono_delays(band, block, iodi, delays, [p.givei for p in filled]))
    return {start + second: message for second, message in enumerate(messages)}


def seen(
    line: CorrectionTimeline, lat: list[float], lon: list[float], epoch: float, *,
    needs_data: bool = False, elevation: float = 90.0, azimuth: float = 0.0,
) -> SlantIonosphere:  # fmt: skip
    """From below: at 90 degrees of elevation the pierce point is the receiver's place."""
    n = len(lat)
    instants = line.reception.instants(enc.epochs_ns(*[epoch] * n))
    degradation = line.degradation(instants, mode="pa")
    return slant_ionosphere(
        line.grid, instants, degradation, np.array(lat), np.array(lon), np.full(n, elevation),
        np.full(n, azimuth), needs_data=needs_data,
    )  # fmt: skip


@cache
def random_grid(seed: int) -> tuple[Grid, CorrectionTimeline, int]:
    """Points drawn at random: in the mask, sent, monitored or forbidden."""
    rng = np.random.default_rng(seed)
    density = rng.choice([0.55, 0.8, 0.95])
    places = grid_points()
    chosen: dict[int, dict[int, Point]] = {}
    grid: Grid = {}
    for band in range(11):
        if band >= 9 and rng.random() < 0.4:
            continue
        points: dict[int, Point] = {}
        silent_block = int(rng.integers(0, 14)) if rng.random() < 0.2 else -1
        for number in range(1, BAND_POINTS + 1):
            lat = places.lat_deg[band * BAND_POINTS + number - 1]
            if np.isnan(lat) or rng.random() > density:
                continue
            if len(points) // 15 == silent_block:
                point = Point()
            else:
                delay = 511 if rng.random() < 0.01 else int(rng.integers(0, 200))
                point = Point(delay, 15 if rng.random() < 0.06 else int(rng.integers(0, 15)))
            points[number] = point
        chosen[band] = points
        for number, point in points.items():
            identity = band * BAND_POINTS + number - 1
            lat, lon = int(places.lat_deg[identity]), int(places.lon_deg[identity]) % 360
            grid["high" if band >= 9 else "low", lat, lon] = point
    messages = broadcast(chosen)
    end = len(messages) + 5
    return grid, correction_timeline(enc.hourly(messages, end)), end


@pytest.mark.parametrize("zone", ZONES)
@pytest.mark.parametrize("seed", SEEDS)
def test_random_grids_give_what_a_plain_look_up_has(seed: int, zone: str) -> None:
    grid, line, end = random_grid(seed)
    rng = np.random.default_rng(seed)
    lat, lon = rng.uniform(*ZONES[zone], 60).tolist(), rng.uniform(0, 360, 60).tolist()
    found = seen(line, lat, lon, end)
    wanted = [vertical(grid, *place) for place in zip(lat, lon, strict=True)]
    assert found.reason.tolist() == [reason for reason, *_ in wanted]
    good = found.reason == 0
    delay = np.array([d for _, d, _ in wanted])
    np.testing.assert_allclose(found.delay_m[good], delay[good])
    variance = np.array([v for *_, v in wanted])
    np.testing.assert_allclose(found.sigma_uire_m[good] ** 2, variance[good])
    assert np.isnan(found.delay_m[~good]).all()
    assert np.isnan(found.sigma_uire_m[~good]).all()


def test_random_grids_meet_every_answer() -> None:
    met: dict[str, set[int]] = {}
    for zone, (low, high) in ZONES.items():
        met[zone] = set()
        for seed in SEEDS:
            _, line, end = random_grid(seed)
            rng = np.random.default_rng(seed)
            lat, lon = rng.uniform(low, high, 60).tolist(), rng.uniform(0, 360, 60).tolist()
            met[zone] |= set(seen(line, lat, lon, end).reason.tolist())
    assert met["middle"] == met["north"] == met["south"] == {0, 40, 41, 42, 44}
    assert all({0, 40} <= reasons for reasons in met.values())


# A square of four points round (12.5 N, 12.5 E): band 4, meridians 10 and 15 E

CORNERS = {(15, 15): 0, (15, 10): 1, (10, 10): 2, (10, 15): 3}


def identity(lat: int, lon: int) -> tuple[int, int]:
    places = grid_points()
    rows = np.flatnonzero((places.lat_deg == lat) & (places.lon_deg == lon))
    return int(rows[0]) // BAND_POINTS, int(rows[0]) % BAND_POINTS + 1


def of_points(points: dict[tuple[int, int], Point]) -> dict[int, dict[int, Point]]:
    chosen: dict[int, dict[int, Point]] = {}
    for place, point in points.items():
        band, number = identity(*place)
        chosen.setdefault(band, {})[number] = point
    return chosen


FOUR = {place: Point(8 * (k + 1), 3 + k) for place, k in CORNERS.items()}


def test_four_points_are_weighed_bilinearly() -> None:
    """Delays 1, 2, 3, 4 m at north-east, north-west, south-west, south-east."""
    line = correction_timeline(enc.hourly(broadcast(of_points(FOUR)), 30))
    found = seen(line, [12.5, 11.0, 14.999999], [12.5, 13.0, 10.000001], 20)
    x, y = 0.6, 0.2
    weight = np.array([x * y, (1 - x) * y, (1 - x) * (1 - y), x * (1 - y)])
    np.testing.assert_allclose(
        found.delay_m, [2.5, float(weight @ np.arange(1.0, 5.0)), 2.0], atol=1e-5
    )
    variance = np.array(GIVE_VARIANCE[3:7])
    np.testing.assert_allclose(found.sigma_uire_m[0] ** 2, np.mean(variance))
    np.testing.assert_allclose(found.sigma_uire_m[1] ** 2, weight @ variance)


@pytest.mark.parametrize("gone", range(4))
@pytest.mark.parametrize("how", ["not in the mask", "not monitored", "no more monitored"])
def test_three_points_are_weighed_by_their_plane(gone: int, how: str) -> None:
    place = next(p for p, k in CORNERS.items() if k == gone)
    inside = {0: (11.0, 11.0), 1: (11.0, 14.0), 2: (14.0, 14.0), 3: (14.0, 11.0)}[gone]
    beyond = {0: (14.0, 14.0), 1: (14.0, 11.0), 2: (11.0, 11.0), 3: (11.0, 14.0)}[gone]
    points = dict(FOUR)
    epoch = 20.0
    if how == "not in the mask":
        del points[place]
    elif how == "not monitored":
        points[place] = Point(0, 15)
    messages = broadcast(of_points(points))
    if how == "no more monitored":
        # All are sent in the beginning; later the point that is gone comes as not monitored.
        epoch = 720.0
        points[place] = Point(0, 15)
        messages = broadcast(of_points(FOUR)) | broadcast(of_points(points), start=650)
    line = correction_timeline(enc.hourly(messages, 730))
    found = seen(line, [inside[0], beyond[0]], [inside[1], beyond[1]], epoch)
    grid: Grid = {("low", *p): v for p, v in points.items()}
    reason, delay, _ = vertical(grid, *inside)
    assert reason == 0
    assert found.delay_m[0] == pytest.approx(delay)
    assert found.reason.tolist() == [0, 40 if how == "not in the mask" else 44]


def test_a_forbidden_point_forbids_the_cell() -> None:
    points = FOUR | {(10, 10): Point(511, 3)}
    line = correction_timeline(enc.hourly(broadcast(of_points(points)), 30))
    assert seen(line, [14.0], [14.0], 20).reason.tolist() == [41]


def test_two_silent_points_leave_nothing() -> None:
    points = FOUR | {(10, 10): Point(5, 15), (15, 15): Point(5, 15)}
    line = correction_timeline(enc.hourly(broadcast(of_points(points)), 30))
    assert seen(line, [12.0], [12.0], 20).reason.tolist() == [42]


def test_a_point_in_the_mask_without_data() -> None:
    """Not monitored; gLAB takes it as not in the mask, and so looks for another cell."""
    points = FOUR | {(15, 15): Point()}
    chosen = of_points(points)
    # The silent point is alone in its block: others of the band before it fill the first.
    band, number = identity(15, 15)
    before = {n: Point(0, 15) for n in range(1, 60) if n not in chosen[band]}
    chosen[band] |= dict(list(before.items())[: 15 - len(chosen[band]) + 1])
    numbers = sorted(chosen[band])
    assert numbers[-1] == number
    assert len(numbers) == 16
    line = correction_timeline(enc.hourly(broadcast(chosen), 30))
    assert seen(line, [11.0, 14.0], [11.0, 14.0], 20).reason.tolist() == [0, 44]
    assert seen(line, [11.0, 14.0], [11.0, 14.0], 20, needs_data=True).reason.tolist() == [0, 40]


def test_delays_and_masks_time_out_at_their_exact_second() -> None:
    messages = broadcast(of_points(FOUR))
    line = correction_timeline(enc.hourly(messages, 1300))
    last_mask, last_delay = 0, 1
    assert len(messages) == 2
    times = [600.12 + last_delay, 600.13 + last_delay, 1200.12 + last_mask, 1200.13 + last_mask]
    assert [seen(line, [12.0], [12.0], t).reason[0] for t in times] == [0, 42, 42, 38]
    assert seen(line, [12.0], [12.0], 0.1).reason[0] == 37


PARAMETERS = {"c_iono_step": 500, "i_iono": 10, "c_iono_ramp": 1000}


@pytest.mark.parametrize("rss", [0, 1])
@pytest.mark.parametrize(("age", "steps"), [(8, 0), (9, 1), (18.5, 1), (19, 2)])
def test_the_variance_grows_with_the_first_bits_age(rss: int, age: float, steps: int) -> None:
    """0.5 m a step of 10 s and 5 mm/s: added to the sigma, or as a square."""
    messages = broadcast(of_points(dict.fromkeys(CORNERS, Point(8, 3))))
    sent = len(messages) - 1
    messages[len(messages)] = enc.degradation(**PARAMETERS, rss_iono=rss)
    line = correction_timeline(enc.hourly(messages, 60))
    found = seen(line, [12.0], [12.0], sent + age)
    eps = 0.5 * steps + 0.005 * (age + 1)
    give = 0.1331
    wanted = give + eps**2 if rss else (np.sqrt(give) + eps) ** 2
    assert found.sigma_uire_m[0] ** 2 == pytest.approx(wanted)


def test_a_step_interval_of_zero_has_no_steps() -> None:
    messages = broadcast(of_points(dict.fromkeys(CORNERS, Point(8, 3))))
    messages[len(messages)] = enc.degradation(c_iono_step=500, i_iono=0, c_iono_ramp=0)
    line = correction_timeline(enc.hourly(messages, 60))
    assert seen(line, [12.0], [12.0], 40).sigma_uire_m[0] ** 2 == pytest.approx(0.1331)


def test_a_slant_path_has_the_obliquity_factor() -> None:
    """F at 30 degrees is 1.751421095157; the same field everywhere gives the same delay."""
    field = {(lat, lon): Point(8, 3) for lat in range(0, 30, 5) for lon in range(0, 30, 5)}
    messages = broadcast(of_points(field))
    line = correction_timeline(enc.hourly(messages, 60))
    found = seen(line, [12.0], [12.0], 40, elevation=30.0, azimuth=77.0)
    assert found.delay_m[0] == pytest.approx(1.751421095157)
    assert found.sigma_uire_m[0] == pytest.approx(1.751421095157 * np.sqrt(0.1331))


def test_lines_of_sight_without_an_elevation_have_no_delay() -> None:
    line = correction_timeline(enc.hourly(broadcast(of_points(FOUR)), 30))
    found = seen(line, [12.0], [12.0], 20, elevation=np.nan)
    assert found.reason.tolist() == [40]
    assert np.isnan(found.delay_m).all()


def test_without_any_grid() -> None:
    line = correction_timeline(enc.hourly({}, 30))
    assert seen(line, [12.0, 80.0, 89.0], [12.0] * 3, 20).reason.tolist() == [37] * 3
    masks_alone = {0: enc.iono_mask(1, *identity(10, 10)[:1], 0, [identity(10, 10)[1]])}
    line = correction_timeline(enc.hourly(masks_alone, 30))
    assert seen(line, [12.0, 80.0, 89.0], [12.0] * 3, 20).reason.tolist() == [40] * 3
