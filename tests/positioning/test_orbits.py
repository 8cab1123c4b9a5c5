"""Orbits against multi-precision arithmetic and plain loops (page section 9.1)."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.positioning.orbits import (
    EARTH_RATE_RADPS,
    GM_M3PS2,
    LIGHT_MPS,
    choose_records,
    eccentric_anomaly,
    kepler_clock_s,
    kepler_state,
    rotated_by_flight,
)
from sbas.rinex.ephemerides import KeplerEphemerides

WEEK = 604_800


def records(k: int = 1, **changes: object) -> KeplerEphemerides:
    """Records of one plausible GPS satellite, fields replaced by name."""
    plain: dict[str, object] = {
        "prn": 5, "toc_s": 0.0, "toe_s": 0.0, "transmission_s": -7200.0, "iode": 30, "iodc": 30,
        "health": 0, "source": 0, "fit_h": 4.0, "ura_m": 2.0, "af0_s": 1.5e-4, "af1": 3.0e-12,
        "af2": 0.0, "tgd_s": -1.1e-8, "sqrt_a": 5153.7, "eccentricity": 0.012, "i0": 0.96,
        "idot": 2.1e-10, "omega0": 1.3, "omega_dot": -8.0e-9, "omega": 0.7, "m0": -2.1,
        "delta_n": 4.6e-9, "cuc": 1.0e-6, "cus": 8.0e-6, "crc_m": 210.0, "crs_m": -30.0,
        "cic": 1.5e-7, "cis": -4.0e-8,
    }  # fmt: skip
    integer = {"prn", "iode", "iodc", "health", "source"}
    return KeplerEphemerides(
        **{
            name: np.broadcast_to(
                np.array(value, dtype=np.int64 if name in integer else float), (k,)
            ).copy()
            for name, value in {**plain, **changes}.items()
        }
    )


def exact_position(e: KeplerEphemerides, time_s: float) -> list[mpmath.mpf]:
    """IS-GPS-200, table 20-IV, with 40 digits."""
    with mpmath.workdps(40):
        v = {name: mpmath.mpf(float(values[0])) for name, values in vars(e).items()}
        tk = mpmath.mpf(time_s) - v["toe_s"]
        axis = v["sqrt_a"] ** 2
        mean = v["m0"] + (mpmath.sqrt(mpmath.mpf(GM_M3PS2) / axis**3) + v["delta_n"]) * tk
        anomaly = mpmath.findroot(lambda x: x - v["eccentricity"] * mpmath.sin(x) - mean, mean)
        # The half-angle form, where the package takes the other.
        true = 2 * mpmath.atan(
            mpmath.sqrt((1 + v["eccentricity"]) / (1 - v["eccentricity"])) * mpmath.tan(anomaly / 2)
        )
        phi = true + v["omega"]
        u = phi + v["cus"] * mpmath.sin(2 * phi) + v["cuc"] * mpmath.cos(2 * phi)
        r = axis * (1 - v["eccentricity"] ** 2) / (1 + v["eccentricity"] * mpmath.cos(true))
        r += v["crs_m"] * mpmath.sin(2 * phi) + v["crc_m"] * mpmath.cos(2 * phi)
        i = (
            v["i0"]
            + v["idot"] * tk
            + v["cis"] * mpmath.sin(2 * phi)
            + v["cic"] * mpmath.cos(2 * phi)
        )
        rate = mpmath.mpf(EARTH_RATE_RADPS)
        node = v["omega0"] + (v["omega_dot"] - rate) * tk - rate * (v["toe_s"] % WEEK)
        about_z = mpmath.matrix(
            [
                [mpmath.cos(node), -mpmath.sin(node), 0],
                [mpmath.sin(node), mpmath.cos(node), 0],
                [0, 0, 1],
            ]
        )
        about_x = mpmath.matrix(
            [[1, 0, 0], [0, mpmath.cos(i), -mpmath.sin(i)], [0, mpmath.sin(i), mpmath.cos(i)]]
        )
        return list(about_z * about_x * mpmath.matrix([r * mpmath.cos(u), r * mpmath.sin(u), 0]))


@pytest.mark.parametrize("since", [-7200.0, -1.0, 0.0, 3333.25, 7200.0])
@pytest.mark.parametrize("eccentricity", [0.0, 0.012, 0.03])
def test_positions_to_a_tenth_of_a_millimetre(since: float, eccentricity: float) -> None:
    e = records(toe_s=345_600.0, toc_s=345_600.0, eccentricity=eccentricity)
    state = kepler_state(e, np.zeros(1, np.int64), np.array([345_600.0 + since]))
    exact = exact_position(e, 345_600.0 + since)
    difference = [abs(float(x) - y) for x, y in zip(exact, state.position_m[0], strict=True)]
    assert max(difference) < 1e-4


@given(st.floats(-40, 40), st.floats(0, 0.1))
def test_keplers_equation(mean: float, eccentricity: float) -> None:
    anomaly = eccentric_anomaly(np.array([mean]), np.array([eccentricity]))[0]
    with mpmath.workdps(40):
        e, m = mpmath.mpf(eccentricity), mpmath.mpf(mean)
        exact = mpmath.findroot(lambda x: x - e * mpmath.sin(x) - m, m + e * mpmath.sin(m))
        assert abs(exact - anomaly) < 2e-14


@pytest.mark.parametrize("rule", ["elements", "motion"])
def test_relativity_is_the_product_of_place_and_motion(rule: str) -> None:
    e, zero = records(), np.zeros(3, np.int64)
    half = 0.5
    for time in (-5000.0, 0.0, 4321.0):
        state = kepler_state(
            e,
            zero,
            np.array([time - half, time, time + half]),
            relativity=rule,  # type: ignore[arg-type]
        )
        velocity = (state.position_m[2] - state.position_m[0]) / (2 * half)
        product = -2 * state.position_m[1] @ velocity / LIGHT_MPS**2
        # IS-GPS-200 leaves the harmonics of the radius out: some centimetres at most.
        tolerance = 1e-4 if rule == "motion" else 0.03
        assert abs(state.relativity_s[1] - product) * LIGHT_MPS < tolerance


def test_clock_without_relativity() -> None:
    e = records(af2=1e-18, toc_s=100.0)
    clock = kepler_clock_s(e, np.array([0, -1]), np.array([1100.0, 1100.0]))
    assert clock[0] == pytest.approx(1.5e-4 + 3e-12 * 1000 + 1e-18 * 1e6, rel=1e-15)
    assert np.isnan(clock[1])
    state = kepler_state(e, np.array([0, -1]), np.array([1100.0, 1100.0]))
    assert state.clock_s[0] == clock[0]
    assert np.isnan(state.position_m[1]).all()
    assert np.isnan([state.clock_s[1], state.relativity_s[1], state.tgd_s[1]]).all()


def test_no_records_at_all() -> None:
    nothing = KeplerEphemerides(*(values[:0] for values in vars(records()).values()))
    state = kepler_state(nothing, np.full(2, -1), np.zeros(2))
    assert np.isnan(state.position_m).all()
    assert np.isnan(kepler_clock_s(nothing, np.full(2, -1), np.zeros(2))).all()


def test_rotation_during_the_flight_is_a_rotation_about_the_pole() -> None:
    satellite = np.array([[2.0e7, 1.5e7, 8.0e6]])
    receiver = np.array([[4.0e6, 1.0e6, 4.8e6]])
    turned = rotated_by_flight(satellite, receiver)[0]
    distance = float(mpmath.norm(mpmath.matrix(satellite[0] - receiver[0])))
    angle = EARTH_RATE_RADPS * distance / LIGHT_MPS
    matrix = [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    assert turned == pytest.approx(np.array(matrix) @ satellite[0], abs=1e-7)
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(satellite[0]), abs=1e-7)


@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("iode", [None, 31])
def test_records_are_chosen_as_a_plain_loop_does(causal: bool, iode: int | None) -> None:
    rng = np.random.default_rng(1)
    toe = np.sort(rng.choice(np.arange(-14400, 28800, 1800), 9, replace=False)).astype(float)
    e = records(
        9, toe_s=toe, transmission_s=toe - rng.integers(0, 9000, 9),
        iode=rng.integers(30, 33, 9), fit_h=rng.choice([0.0, 2.0, 4.0], 9),
        prn=rng.choice([5, 5, 6], 9),
    )  # fmt: skip
    times = np.linspace(-20000, 35000, 400)
    wanted = None if iode is None else np.full(times.size, iode)
    chosen = choose_records(e, 5, times, wanted, causal=causal)
    for time, record in zip(times.tolist(), chosen.tolist(), strict=True):
        good = [
            (abs(time - e.transmission_s[r]), r)
            for r in range(9)
            if e.prn[r] == 5
            and abs(time - e.toe_s[r]) <= (e.fit_h[r] or 4.0) * 1800
            and (iode is None or e.iode[r] == iode)
            and (not causal or e.transmission_s[r] <= time)
        ]
        assert record == (min(good)[1] if good else -1)
    assert (chosen >= 0).any()
    assert (chosen < 0).any()
