"""Errors of the sensors against closed forms of their laws, within stated sampling error."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    InertialUnit,
    Odometer,
    Redundancy,
    SatelliteReceiver,
    Sensor,
    Unmodelled,
)
from sbas.fusion.fused_runs import SensorRuns
from sbas.fusion.simulation.sensor_errors import draw_sensors
from sbas.fusion.simulation.speed_profile import positions_m, speeds_mps
from tests.fusion.simulation.test_bursts import chain_law

NEVER = Bursts(0.0, 1.0)
ODO, ACC, GPS = Odometer("odo"), Accelerometer("acc"), SatelliteReceiver("gps")
CLEAN_ODO = replace(ODO, slip=NEVER)
CLEAN_GPS = replace(GPS, multipath=NEVER, outage=NEVER)
STANDARD_ERRORS = 4.5
"""Seeds are fixed; a bound that one of 150 000 correct draws misses."""


def architecture(*sensors: Sensor, **options: Any) -> Architecture:
    return Architecture("test", sensors, **options)


def draw(arch: Architecture, runs: int, seed: int = 1, **options: Any) -> dict[str, SensorRuns]:
    return draw_sensors(arch, runs, np.random.SeedSequence(seed), **options)


def along(drawn: dict[str, SensorRuns], name: str) -> np.ndarray:
    return drawn[name].error_m[0]


# --- variances in closed form -----------------------------------------------------------------


def odometer_variance(sensor: Odometer, arch: Architecture) -> np.ndarray:
    """(s x)^2 + nv^2 0.1 t at the epochs."""
    m = arch.substeps
    x = positions_m(arch.profile, arch.substep_s, arch.epochs * m)[m - 1 :: m]
    t = arch.step_s * np.arange(1, arch.epochs + 1)
    return (sensor.scale_sd * x) ** 2 + sensor.noise_mps**2 * 0.1 * t


def accelerometer_parts(sensor: Accelerometer, h: float, n: int) -> tuple[float, float, float]:
    """Standard deviations of bias, walk and white noise after n sub-steps, as sums of weights.

    A position is h^2 times the double sum; the acceleration j sub-steps before its end counts
    j times, a step of the walk then j (j + 1) / 2 times.
    """
    j = np.arange(1.0, n + 1)
    return (
        sensor.bias_mps2 * h**2 * j.sum(),
        sensor.walk_mps2_per_rts * math.sqrt(h) * h**2 * math.sqrt(((j * (j + 1) / 2) ** 2).sum()),
        sensor.noise_mps2_per_rthz / math.sqrt(h) * h**2 * math.sqrt((j**2).sum()),
    )


def accelerometer_variance(sensor: Accelerometer, arch: Architecture) -> np.ndarray:
    steps = arch.substeps * np.arange(1, arch.epochs + 1)
    parts = [accelerometer_parts(sensor, arch.substep_s, int(n)) for n in steps]
    return (np.array(parts) ** 2).sum(axis=1)


def test_closed_forms_give_the_check_values_of_the_page() -> None:
    """Page causal-analysis, section 11: pooled standard deviations and those at 100 s."""
    arch = architecture(ODO, ACC, GPS)
    odo, acc = odometer_variance(ODO, arch), accelerometer_variance(ACC, arch)
    assert math.sqrt(odo.mean()) == pytest.approx(0.8288, abs=5e-5)
    assert math.sqrt(acc.mean()) == pytest.approx(1.2741, abs=5e-5)
    assert math.sqrt(odo[-1]) == pytest.approx(1.3865, abs=5e-5)
    parts = accelerometer_parts(ACC, 0.1, 1000)
    assert parts == pytest.approx([2.0020, 0.4483, 1.7333], abs=5e-5)
    assert math.sqrt(acc[-1]) == pytest.approx(2.6858, abs=5e-5)
    gps = math.hypot(GPS.white_m, GPS.correlated_m)
    weights = 1 / np.array([odo.mean(), acc.mean(), gps**2])
    assert weights / weights.sum() == pytest.approx([0.3575, 0.1513, 0.4912], abs=5e-5)


@pytest.mark.parametrize(("step_s", "substep_s"), [(1.0, 0.1), (1.0, 0.2), (0.5, 0.05), (1.0, 1.0)])
def test_variance_at_each_epoch(step_s: float, substep_s: float) -> None:
    """4000 runs: a variance of normal errors has relative standard error sqrt(2 / runs)."""
    runs = 4000
    arch = architecture(CLEAN_ODO, ACC, CLEAN_GPS, step_s=step_s, substep_s=substep_s)
    drawn = draw(arch, runs)
    fixes = along(drawn, "gps")
    expected = {
        "odo": odometer_variance(ODO, arch),
        "acc": accelerometer_variance(ACC, arch),
        "gps": np.where(np.isnan(fixes[:, 0]), np.nan, 0.5),
    }
    for name, variance in expected.items():
        square = along(drawn, name) ** 2
        ratio = (square.mean(axis=1) / variance)[np.isfinite(variance)]
        assert (np.abs(ratio - 1) < STANDARD_ERRORS * math.sqrt(2 / runs)).all(), name
        a_run = np.nanmean(square, axis=0)
        error = a_run.std() / math.sqrt(runs)
        assert abs(a_run.mean() - np.nanmean(variance)) < STANDARD_ERRORS * error, name


@pytest.mark.parametrize("only", ["bias_mps2", "walk_mps2_per_rts", "noise_mps2_per_rthz"])
@pytest.mark.parametrize("substep_s", [0.1, 0.5])
def test_each_part_of_the_accelerometer(only: str, substep_s: float) -> None:
    """Each part alone, at each epoch; a bias acts from the first sub-step on and never changes."""
    runs, parts = 4000, {"bias_mps2": 0.0, "walk_mps2_per_rts": 0.0, "noise_mps2_per_rthz": 0.0}
    parts[only] = getattr(ACC, only)
    sensor = replace(ACC, **parts)  # type: ignore[arg-type]
    arch = architecture(sensor, substep_s=substep_s, duration_s=20.0)
    drawn = draw(arch, runs)
    ratio = (along(drawn, "acc") ** 2).mean(axis=1) / accelerometer_variance(sensor, arch)
    assert (np.abs(ratio - 1) < STANDARD_ERRORS * math.sqrt(2 / runs)).all()
    acceleration = drawn["acc"].acceleration_error_mps2
    assert acceleration is not None
    assert (acceleration == acceleration[0]).all() == (only == "bias_mps2")


def test_positions_are_sums_of_what_the_filter_sees() -> None:
    """Odometer: sum of speed x sub-step; accelerometer: of the sum of acceleration x sub-step."""
    drawn = draw(architecture(ODO, ACC, substep_s=0.2, step_s=1.0), 50)
    speed, acceleration = drawn["odo"].speed_error_mps, drawn["acc"].acceleration_error_mps2
    assert speed is not None
    assert acceleration is not None
    p = q = v = np.zeros(50)
    for k in range(500):
        p = p + 0.2 * speed[k]
        v = v + 0.2 * acceleration[k]
        q = q + 0.2 * v
        if k % 5 == 4:
            assert along(drawn, "odo")[k // 5] == pytest.approx(p, abs=1e-12)
            assert along(drawn, "acc")[k // 5] == pytest.approx(q, abs=1e-11)


def test_fault_free_fixes_are_nominal_with_probability_erf_1() -> None:
    """Page, section 11: P(|e| < 1 m) = erf(1), P(|e| >= 2.5 m) = erfc(2.5)."""
    runs = 10_000
    size = np.abs(along(draw(architecture(CLEAN_GPS), runs), "gps"))
    for seen, expected in ((size < 1, math.erf(1)), (size >= 2.5, math.erfc(2.5))):
        a_run = seen.mean(axis=0)
        error = a_run.std() / math.sqrt(runs)
        assert abs(a_run.mean() - expected) < STANDARD_ERRORS * error


@pytest.mark.parametrize("interval_s", [1.0, 2.0])
def test_fixes_are_correlated_as_gauss_and_markov_say(interval_s: float) -> None:
    """Covariance s^2 exp(-lag / tau) from the first fix on, plus the white part at lag 0."""
    runs = 20_000
    arch = architecture(replace(CLEAN_GPS, interval_s=interval_s), duration_s=60.0)
    fixes = along(draw(arch, runs), "gps")[round(interval_s) - 1 :: round(interval_s)]
    lag = interval_s * np.abs(np.subtract.outer(np.arange(len(fixes)), np.arange(len(fixes))))
    expected = 0.25 * np.exp(-lag / 30.0) + 0.25 * (lag == 0)
    # The product of two normal errors of variance 0.5 and covariance c: variance 0.25 + c^2.
    error = np.sqrt((0.25 + expected**2) / runs)
    assert (np.abs(fixes @ fixes.T / runs - expected) < 5 * error).all()


# --- faults -----------------------------------------------------------------------------------


def test_slips_over_read_in_traction_and_under_read_in_braking() -> None:
    runs = 5000
    only_slips = replace(ODO, scale_sd=0.0, noise_mps=0.0)
    drawn = draw(architecture(only_slips), runs)
    speed = speeds_mps(Architecture("x", ()).profile, 0.1, 1000)
    error = drawn["odo"].speed_error_mps
    assert error is not None
    share = error[:-1] / speed[:-1, None]
    on = share != 0
    assert (share[:400][on[:400]] > 0).all()
    assert not on[400:750].any()
    assert (share[750:][on[750:]] < 0).all()
    size = np.abs(share[on])
    assert 0.01 <= size.min() < 0.0101
    assert 0.0599 < size.max() <= 0.06
    law = chain_law(ODO.slip, 0.1, 1000)
    for part in (slice(0, 400), slice(750, 999)):
        assert (np.abs(on[part].mean(axis=1) - law[part]) < 5 * np.sqrt(law[part] / runs)).all()
    # Mean of the position: sum of v x sign of the acceleration x mean amplitude x P(slip).
    sign = np.repeat([1.0, 0.0, -1.0], [400, 350, 250])
    expected = np.cumsum(0.1 * speed * sign * 0.035 * law)[9::10]
    position = along(drawn, "odo")
    off = np.abs(position.mean(axis=1) - expected)
    assert (off[5:] < STANDARD_ERRORS * position[5:].std(axis=1) / math.sqrt(runs)).all()


def test_multipath_and_outages_follow_their_chains() -> None:
    runs = 20_000
    law = chain_law(GPS.multipath, 1.0, 100)
    error = along(draw(architecture(replace(CLEAN_GPS, white_m=0.0, correlated_m=0.0,
                                            multipath=GPS.multipath)), runs), "gps")  # fmt: skip
    on = error != 0
    assert (np.abs(on.mean(axis=1) - law) < STANDARD_ERRORS * np.sqrt(law / runs)).all()
    assert 1.5 <= np.abs(error[on]).min() < 1.51
    assert 7.99 < np.abs(error[on]).max() <= 8.0
    a_run = error.mean(axis=0)
    assert abs(a_run.mean()) < STANDARD_ERRORS * a_run.std() / math.sqrt(runs)
    law = chain_law(GPS.outage, 1.0, 100)
    silent = np.isnan(along(draw(architecture(GPS), runs), "gps"))
    assert (np.abs(silent.mean(axis=1) - law) < STANDARD_ERRORS * np.sqrt(law / runs)).all()


def test_faults_leave_the_noise_as_it_is() -> None:
    faulty, clean = (draw(architecture(o, ACC, g), 200)
                     for o, g in ((ODO, GPS), (CLEAN_ODO, CLEAN_GPS)))  # fmt: skip
    difference = along(faulty, "gps") - along(clean, "gps")
    hit = np.abs(difference) > 1e-9
    assert 0.02 < (np.isnan(difference) | hit).mean() < 0.25
    assert (np.abs(difference[hit]) > 1.4999).all()
    slipping = np.abs(faulty["odo"].speed_error_mps - clean["odo"].speed_error_mps) > 1e-12  # type: ignore[operator]
    assert 0.01 < slipping.mean() < 0.06


def test_fixes_between_epochs() -> None:
    """Fixes each second, epochs each 0.1 s: no data before, between and after them."""
    arch = architecture(CLEAN_GPS, step_s=0.1, substep_s=0.1, duration_s=10.5)
    fixes = along(draw(arch, 30), "gps")
    at = np.arange(1, 106) % 10 == 0
    assert fixes.shape == (105, 30)
    assert np.isnan(fixes[~at]).all()
    assert np.isfinite(fixes[at]).all()
    slower = architecture(replace(CLEAN_GPS, interval_s=200.0))
    assert np.isnan(along(draw(slower, 3), "gps")).all()


# --- three axes -------------------------------------------------------------------------------


def test_three_axes() -> None:
    runs = 4000
    imu = InertialUnit("imu")
    sensors = (ODO, imu, GPS, ACC)
    arch = architecture(*sensors, operator="per_axis", substep_s=0.5)
    drawn = draw(arch, runs)
    assert [drawn[s.name].measures for s in sensors] == [
        (True, False, False), (True, True, True), (True, True, True), (True, False, False)
    ]  # fmt: skip
    for name in ("odo", "acc"):
        assert np.isnan(drawn[name].error_m[1:]).all()
        assert np.isfinite(drawn[name].error_m[0]).all()
    fixes = drawn["gps"].error_m
    assert np.isnan(fixes).any()
    assert (np.isnan(fixes) == np.isnan(fixes[0])).all()
    # Axes are independent: a correlation has standard error 1 / sqrt(runs).
    last = drawn["imu"].error_m[:, -1]
    assert (np.abs(np.corrcoef(last) - np.eye(3)) < STANDARD_ERRORS / math.sqrt(runs)).all()
    variance = accelerometer_variance(ACC, arch)[-1]
    assert (last**2).mean(axis=1) == pytest.approx(variance, rel=4.5 * math.sqrt(2 / runs))
    # Along the track nothing depends on the number of axes.
    flat = draw(architecture(*sensors, substep_s=0.5), runs)
    for sensor in sensors:
        assert flat[sensor.name].measures == (True,)
        np.testing.assert_array_equal(along(flat, sensor.name), along(drawn, sensor.name))


def test_multipath_hits_all_axes_with_amplitudes_of_their_own() -> None:
    only = replace(CLEAN_GPS, white_m=0.0, correlated_m=0.0, multipath=GPS.multipath)
    error = draw(architecture(only, operator="per_axis"), 2000)["gps"].error_m
    on = error != 0
    assert (on == on[0]).all()
    hit = error[:, on[0]]
    assert (np.abs(np.corrcoef(np.abs(hit)) - np.eye(3)) < 0.05).all()
    assert (np.abs(np.corrcoef(np.sign(hit)) - np.eye(3)) < 0.05).all()


# --- streams ----------------------------------------------------------------------------------


def test_a_sensor_more_or_another_order_changes_no_other() -> None:
    seed = np.random.SeedSequence(5).spawn(3)[2]
    few = draw_sensors(architecture(ODO, GPS), 20, seed)
    many = draw_sensors(architecture(Odometer("odo2"), GPS, ACC, ODO), 20, seed)
    for name in ("odo", "gps"):
        np.testing.assert_array_equal(along(few, name), along(many, name))
    again = draw_sensors(architecture(ODO, GPS), 20, seed)
    np.testing.assert_array_equal(along(few, "odo"), along(again, "odo"))
    assert seed.n_children_spawned == 0
    other = draw_sensors(architecture(ODO, GPS), 20, np.random.SeedSequence(5).spawn(3)[1])
    assert (along(few, "odo") != along(other, "odo")).all()
    assert (along(many, "odo") != along(many, "odo2")).all()


# --- redundancy -------------------------------------------------------------------------------


def slipping(common_cause: str, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Slips of two odometers, as shares of the speed, in traction."""
    pair = [Odometer(name, scale_sd=0.0, noise_mps=0.0) for name in ("one", "two")]
    group = Redundancy(("one", "two"), common_cause, share)  # type: ignore[arg-type]
    drawn = draw(architecture(*pair, redundancy=(group,), duration_s=40.0), 2000)
    one, two = (drawn[name].speed_error_mps for name in ("one", "two"))
    assert one is not None
    assert two is not None
    return one, two


@pytest.mark.parametrize("common_cause", ["per_run", "beta_factor"])
def test_common_slips(common_cause: str) -> None:
    """All common: the same slips with other amplitudes. None: as two odometers by themselves."""
    one, two = slipping(common_cause, 1.0)
    assert ((one != 0) == (two != 0)).all()
    both = one != 0
    assert (one[both] != two[both]).all()
    apart, alone = slipping(common_cause, 0.0), slipping("independent", 0.5)
    for ours, theirs in zip(apart, alone, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert 0.001 < ((apart[0] != 0) & (apart[1] != 0)).mean() < 0.005


def test_common_outages_of_receivers() -> None:
    """With "per_run" one throw a run decides on outages and multipath alike."""
    pair = [replace(GPS, name=name, white_m=0.0, correlated_m=0.0) for name in ("one", "two")]
    arch = architecture(*pair, redundancy=(Redundancy(("one", "two"), "per_run", 0.5),))
    drawn = draw(arch, 2000)
    one, two = along(drawn, "one"), along(drawn, "two")
    multipath = ((one != 0) == (two != 0)) | np.isnan(one) | np.isnan(two)
    outages = np.isnan(one) == np.isnan(two)
    alike = outages.all(axis=0) & multipath.all(axis=0)
    # Runs of their own look alike only where neither has any burst: P = exp(-2 x rates x 100 s).
    nothing = math.exp(-200 * (1 / 60 + 1 / 150))
    expected = 0.5 + 0.5 * nothing
    assert abs(alike.mean() - expected) < STANDARD_ERRORS * 0.5 / math.sqrt(2000) + 0.02


# --- sources ----------------------------------------------------------------------------------


def test_a_source_replaces_a_sensor() -> None:
    arch = architecture(ODO, GPS, Unmodelled("radar", "Doppler radar"))
    errors = np.full((100, 7), 1.5)
    errors[3] = np.nan
    errors[4] = np.inf

    def replay(rng: np.random.Generator, runs: int) -> np.ndarray:
        return rng.standard_normal((100, runs))

    drawn = draw(arch, 7, sources={"gps": lambda rng, runs: errors[:, :runs], "radar": replay})
    np.testing.assert_array_equal(along(drawn, "gps"), errors)
    assert drawn["gps"].measures == (True,)
    again = draw(replace(arch, sensors=arch.sensors[2:]), 7, sources={"radar": replay})
    np.testing.assert_array_equal(along(drawn, "radar"), along(again, "radar"))
    np.testing.assert_array_equal(along(drawn, "odo"), along(draw(architecture(ODO), 7), "odo"))


def test_a_source_on_three_axes() -> None:
    arch = architecture(GPS, replace(GPS, name="one"), operator="per_axis")
    errors = np.random.default_rng(1).standard_normal((3, 100, 4))
    sources = {"gps": lambda rng, runs: errors, "one": lambda rng, runs: errors[0]}
    drawn = draw(arch, 4, sources=sources)
    np.testing.assert_array_equal(drawn["gps"].error_m, errors)
    assert drawn["gps"].measures == (True, True, True)
    np.testing.assert_array_equal(drawn["one"].error_m[0], errors[0])
    assert np.isnan(drawn["one"].error_m[1:]).all()
    assert drawn["one"].measures == (True, False, False)


# --- sources that do not fit -------------------------------------------------------------------

PAIR = Redundancy(("odo", "odo2"), "per_run", 0.5)
ODO2 = replace(ODO, name="odo2")


def test_refused_sources() -> None:
    def zeros(rng: np.random.Generator, runs: int) -> np.ndarray:
        return np.zeros((100, runs))

    arch = architecture(ODO, ODO2, GPS)
    with pytest.raises(InputError, match="no sensor is called 'GPS'"):
        draw(arch, 2, sources={"GPS": zeros})
    with pytest.raises(InputError, match="wrong shape"):
        draw(arch, 2, sources={"gps": lambda rng, runs: np.zeros((runs, 100))})
    with pytest.raises(InputError, match="errors of 'odo' cannot be replaced"):
        draw(replace(arch, operator="kalman"), 2, sources={"odo": zeros})
    with pytest.raises(InputError, match="'odo' is replaced: it has no common cause"):
        draw(replace(arch, redundancy=(PAIR,)), 2, sources={"odo": zeros})
