"""What an architecture may not say, and what the error tells its author to write.

The rules are those of Railways 2014, section 3, and of the task: the text of each cure is held
here, since it is all that the author of a wrong model sees.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.exceptions import InputError, ModelError
from sbas.fusion.architecture.architecture_check import (
    check_architecture,
    refuse_unmodelled,
)
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    FilterTuning,
    InertialUnit,
    Missing,
    Odometer,
    Phase,
    Redundancy,
    SatelliteReceiver,
    SpeedProfile,
    Thresholds,
    Unmodelled,
)

ODO, ACC = Odometer("odo"), Accelerometer("acc")
GPS = SatelliteReceiver("gps", missing=Missing("extrapolate", "odo"))
GOOD = Architecture("lab", (ODO, ACC, GPS))
GYRO = Unmodelled("gyro", "gyroscope")


def _of(*sensors: object, **changes: object) -> Architecture:
    return replace(GOOD, sensors=sensors, **changes)  # type: ignore[arg-type]


def _missing(policy: str, by: str = "", *, renormalise: bool = True) -> Architecture:
    return _of(ODO, ACC, replace(GPS, missing=Missing(policy, by, renormalise)))  # type: ignore[arg-type]


def _fixed(*weights: float) -> Architecture:
    return replace(GOOD, weights="fixed", fixed_weights=weights)


def _tuned(**changes: float) -> Architecture:
    return replace(GOOD, operator="kalman", filter=FilterTuning(**changes))


def _phases(*phases: Phase, start: float = 0.0, duration: float = 100.0) -> Architecture:
    return replace(GOOD, profile=SpeedProfile(phases, start), duration_s=duration)


def _group(*names: str, **changes: object) -> Architecture:
    second = replace(ODO, name="odo2")
    third = replace(ACC, name="acc2")
    group = Redundancy(names, **changes)  # type: ignore[arg-type]
    return _of(ODO, second, ACC, third, GPS, redundancy=(group,))


WRONG: dict[str, tuple[Architecture, str, str]] = {
    # what is wrong: architecture, key path, words of the cure
    "no sensors": (_of(), "sensors", "[[sensors]]"),
    "forty sensors": (
        _of(*(Odometer(f"odo{i}") for i in range(40))), "sensors", "at most 39",
    ),
    "one name twice": (_of(ODO, Accelerometer("odo")), "sensors[1].name", "odo2"),
    "a name without end": (_of(Odometer("o" * 81)), f"sensors.{'o' * 81}.name", "80 characters"),
    "a name of nothing": (_of(Odometer(" ")), "sensors. .name", "printable"),
    "policy by an unknown sensor": (
        _missing("extrapolate", "odom"), "sensors.gps.missing.by", "did you mean 'odo'",
    ),
    "policy by itself": (
        _missing("substitute", "gps"), "sensors.gps.missing.by", '"remove"',
    ),
    "policy by nobody": (_missing("extrapolate"), "sensors.gps.missing.by", 'by = "odo"'),
    "policy by a map": (
        _of(Unmodelled("map", "digital_map"), ODO,
                    replace(GPS, missing=Missing("substitute", "map"))),
        "sensors.gps.missing.by", "odo",
    ),
    "policy on y and z by an odometer": (
        _of(ODO, InertialUnit("imu"), GPS, operator="per_axis"),
        "sensors.gps.missing.by", "imu",
    ),
    "policies in a circle": (
        _of(replace(ODO, missing=Missing("substitute", "acc")),
                    replace(ACC, missing=Missing("extrapolate", "gps")), GPS),
        "sensors.odo.missing.by", 'policy = "remove" or "hold"',
    ),
    "hold by another": (_missing("hold", "odo"), "sensors.gps.missing.by", "substitute"),
    "hold without renormalising": (
        _missing("hold", renormalise=False), "sensors.gps.missing.renormalise", "remove",
    ),
    "unknown policy": (_missing("interpolate"), "sensors.gps.missing.policy", "extrapolate"),
    "weights that do not add up": (
        _fixed(0.2, 0.2, 0.2), "fixed_weights", "0.333333333333, 0.333333333333",
    ),
    "two weights for three": (_fixed(0.5, 0.5), "fixed_weights", "0.333333333333"),
    "a negative weight": (_fixed(1.5, -0.5, 0.0), "fixed_weights[1]", "0 or more"),
    "a weight of NaN": (_fixed(math.nan, 0.5, 0.5), "fixed_weights[0]", "finite"),
    "weights of zero": (_fixed(0.0, 0.0, 0.0), "fixed_weights", "add up to 1"),
    "weights without their rule": (
        replace(GOOD, fixed_weights=(0.5, 0.25, 0.25)), "fixed_weights", 'weights = "fixed"',
    ),
    "no weight on y and z": (
        _of(ODO, InertialUnit("imu"), operator="per_axis", weights="fixed",
                    fixed_weights=(1.0, 0.0)),
        "fixed_weights", "imu or gnss",
    ),
    "an odometer without error": (
        _of(Odometer("odo", scale_sd=0.0, noise_mps=0.0), ACC, GPS),
        "sensors.odo.scale_sd", "noise_mps above 0",
    ),
    "a receiver without error": (
        _of(ODO, replace(GPS, white_m=0.0, correlated_m=0.0)), "sensors.gps.white_m", "fixed",
    ),
    "errors whose square is 0": (
        _of(Accelerometer("acc", 1e-200, 0.0, 0.0)), "sensors.acc.bias_mps2", "above 0",
    ),
    "zero noise to test against": (
        replace(_fixed(0.5, 0.25, 0.25), fault_detection="leave_one_out",
                        sensors=(ODO, Accelerometer("acc", 0.0, 0.0, 0.0), GPS)),
        "sensors.acc.bias_mps2", "noise_mps2_per_rthz above 0",
    ),
    "negative noise": (
        _of(Odometer("odo", noise_mps=-0.1)), "sensors.odo.noise_mps", "0 or more",
    ),
    "filter without process noise": (
        _tuned(acceleration_mps2_per_rthz=0.0), "filter.acceleration_mps2_per_rthz",
        "more than 0",
    ),
    "filter with a perfect odometer": (
        _tuned(speed_mps=0.0), "filter.speed_mps", "more than 0",
    ),
    "filter with a perfect fix": (
        _tuned(position_m=0.0), "filter.position_m", "more than 0",
    ),
    "filter with a negative start": (
        _tuned(initial_speed_mps=-1.0), "filter.initial_speed_mps", "0 or more",
    ),
    "gate of zero": (_tuned(gate=0.0), "filter.gate", "more than 0"),
    "thresholds out of order": (
        replace(GOOD, thresholds=Thresholds(2.5, 2.5)), "thresholds.nominal_m",
        "below alert_limit_m",
    ),
    "hysteresis that never ends": (
        replace(GOOD, thresholds=Thresholds(hysteresis_m=1.0)), "thresholds.hysteresis_m",
        "below nominal_m",
    ),
    "step between sub-steps": (
        replace(GOOD, step_s=0.25), "step_s", "substep_s = 0.125",
    ),
    "second between steps": (replace(GOOD, step_s=0.3), "step_s", "step_s = 0.333333333333"),
    "step of two seconds": (replace(GOOD, step_s=2.0), "step_s", "step_s = 1"),
    "fixes between steps": (
        _of(ODO, replace(GPS, interval_s=1.5)), "sensors.gps.interval_s", "interval_s = 2",
    ),
    "fixes faster than steps": (
        _of(ODO, replace(GPS, interval_s=0.5)), "sensors.gps.interval_s", "interval_s = 1",
    ),
    "duration between steps": (
        replace(GOOD, duration_s=99.5), "duration_s", "duration_s = 100",
    ),
    "duration below a step": (replace(GOOD, duration_s=0.4), "duration_s", "duration_s = 1"),
    "duration without end": (
        _phases(Phase(1.0, 0.0), duration=1e9), "duration_s", "duration_s = 100000 or less",
    ),
    "kalman without odometer": (
        _of(ACC, SatelliteReceiver("gps"), operator="kalman"), "operator", "weighted_mean",
    ),
    "kalman with two odometers": (
        _of(ODO, Odometer("odo2"), ACC, GPS, operator="kalman"), "operator", "just one",
    ),
    "kalman with an inertial unit": (
        _of(ODO, ACC, InertialUnit("imu"), GPS, operator="kalman"), "operator", "just one",
    ),
    "three axes by an odometer": (_of(ODO, ACC, operator="per_axis"), "operator", "imu or gnss"),
    "no phases": (_phases(), "profile.phases", "until_s"),
    "phases unsorted": (
        _phases(Phase(40.0, 0.5), Phase(20.0, 0.0)), "profile.phases[1].until_s", "growing",
    ),
    "two phases to one time": (
        _phases(Phase(40.0, 0.5), Phase(40.0, 0.0)), "profile.phases[1].until_s", "growing",
    ),
    "a train that runs backward": (
        replace(GOOD, duration_s=101.0), "profile.phases[2].acceleration_mps2", "shorten",
    ),
    "a phase of NaN": (
        _phases(Phase(40.0, math.nan)), "profile.phases[0].acceleration_mps2", "finite",
    ),
    "a probability above 1": (
        _group("odo", "odo2", common_cause="per_run", share=1.1), "redundancy[0].share",
        "at most 1",
    ),
    "a negative probability": (
        _group("odo", "odo2", common_cause="beta_factor", share=-0.1),
        "redundancy[0].share", "0 or more",
    ),
    "a negative rate": (
        _of(Odometer("odo", slip=Bursts(-0.02, 3.0, 0.01, 0.06))),
        "sensors.odo.slip.rate_per_s", "0 or more",
    ),
    "a negative failure rate": (
        _of(Odometer("odo", failure_rate_per_h=-1e-6)), "sensors.odo.failure_rate_per_h",
        "0 or more",
    ),
    "bursts of no length": (
        _of(Odometer("odo", slip=Bursts(0.02, 0.0, 0.01, 0.06))),
        "sensors.odo.slip.mean_duration_s", "more than 0",
    ),
    "bursts from large to small": (
        _of(Odometer("odo", slip=Bursts(0.02, 3.0, 0.06, 0.01))),
        "sensors.odo.slip.smallest", "exchange",
    ),
    "an outage of some size": (
        _of(ODO, replace(GPS, outage=Bursts(0.01, 6.0, 0.0, 3.0))),
        "sensors.gps.outage.largest", "leave out",
    ),
    "slips of no size": (
        _of(Odometer("odo", slip=Bursts(0.02, 3.0))), "sensors.odo.slip.largest", "rate_per_s = 0",
    ),
    "multipath of no size": (
        _of(ODO, replace(GPS, multipath=Bursts(0.02, 3.0))), "sensors.gps.multipath.largest",
        "write smallest and largest",
    ),
    "redundancy of an unknown sensor": (
        _group("odo", "odo22"), "redundancy[0].sensors", "did you mean 'odo2'",
    ),
    "redundancy of one": (_group("odo"), "redundancy[0].sensors", "two or more"),
    "redundancy of one sensor twice": (
        _group("odo", "odo"), "redundancy[0].sensors", "once",
    ),
    "redundancy of two kinds": (_group("odo", "acc"), "redundancy[0].sensors", "alike"),
    "redundancy of unlike odometers": (
        _of(ODO, Odometer("odo2", noise_mps=0.2), redundancy=(Redundancy(("odo", "odo2")),)),
        "redundancy[0].sensors", "alike",
    ),
    "independent with a share": (
        _group("odo", "odo2", share=0.5), "redundancy[0].share", "beta_factor",
    ),
    "a common cause of nothing": (
        _group("acc", "acc2", common_cause="per_run", share=0.5),
        "redundancy[0].common_cause", "independent",
    ),
    "a kind that nobody knows": (
        _of(ODO, GPS, Unmodelled("x", "gyroscop")), "sensors.x.kind", "'gyroscope'",
    ),
    "unknown operator": (replace(GOOD, operator="mean"), "operator", "weighted_mean"),  # type: ignore[arg-type]
    "true for a number": (replace(GOOD, duration_s=True), "duration_s", "finite number"),
    "text for a number": (_tuned(speed_mps="0.1"), "filter.speed_mps", "finite number"),  # type: ignore[arg-type]
    "no sensor at all": (_of("odo"), "sensors[0]", "Odometer or"),
    "a list for a tuple": (replace(GOOD, sensors=[ODO]), "sensors", "tuple"),  # type: ignore[arg-type]
    "a text of two lines": (replace(GOOD, source="a\nb"), "source", "one line"),
    "one for true": (
        _of(replace(ODO, missing=Missing(renormalise=1))),  # type: ignore[arg-type]
        "sensors.odo.missing.renormalise", "true or false",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_architecture_is_refused_with_its_place_and_what_to_write(name: str) -> None:
    wrong, where, cure = WRONG[name]
    with pytest.raises(ModelError) as caught:
        check_architecture(wrong)
    error = caught.value
    assert error.where == where
    assert cure in error.cure, error.cure
    assert error.evidence
    assert error.what


def test_the_filter_names_what_it_lacks_and_what_it_has_too_much_of() -> None:
    with pytest.raises(ModelError) as caught:
        check_architecture(_of(ODO, Odometer("odo2"), InertialUnit("imu"), operator="kalman"))
    assert caught.value.evidence == "found 2 odometer, no accelerometer, no gnss, imu (imu)"


def test_a_circle_is_written_out() -> None:
    circle = (
        Odometer("a", missing=Missing("substitute", "b")),
        Odometer("b", missing=Missing("substitute", "c")),
        Odometer("c", missing=Missing("substitute", "b")),
    )
    with pytest.raises(ModelError, match="a -> b -> c -> b"):
        check_architecture(_of(*circle))


def test_the_weights_that_a_cure_names_are_taken() -> None:
    with pytest.raises(ModelError) as caught:
        check_architecture(_fixed(0.3, 0.3, 0.1))
    written = caught.value.cure.split("[")[1].split("]")[0]
    cured = tuple(float(word) for word in written.split(","))
    assert check_architecture(_fixed(*cured)) == ()
    assert cured == pytest.approx((3 / 7, 3 / 7, 1 / 7))


@pytest.mark.parametrize(("off", "sound"), [(0.9e-9, True), (1.2e-9, False)])
def test_weights_add_up_within_a_billionth(off: float, sound: bool) -> None:
    weights = _fixed(0.5, 0.25, 0.25 + off)
    if sound:
        assert check_architecture(weights) == ()
    else:
        with pytest.raises(ModelError, match="add up"):
            check_architecture(weights)


def test_perfect_sensors_are_sound_where_no_weight_comes_from_their_errors() -> None:
    perfect = _of(
        Odometer("odo", scale_sd=0.0, noise_mps=0.0), ACC, GPS, weights="fixed",
        fixed_weights=(1.0, 0.0, 0.0),
    )  # fmt: skip
    assert check_architecture(perfect) == ()
    slipping = replace(perfect, weights="with_faults", fixed_weights=())
    assert check_architecture(slipping) == ()
    with pytest.raises(ModelError, match="zero variance"):
        check_architecture(replace(slipping, weights="fault_free"))


def test_a_filter_may_start_from_a_known_position() -> None:
    assert check_architecture(_tuned(initial_position_m=0.0, initial_speed_mps=0.0)) == ()


def test_the_most_sensors_still_have_a_number_for_each_combination() -> None:
    assert 3**39 < 2**63 < 3**40
    assert check_architecture(_of(*(SatelliteReceiver(f"gps{i}") for i in range(39)))) == ()


def test_numpy_numbers_are_numbers() -> None:
    assert check_architecture(replace(GOOD, duration_s=np.float64(50.0))) == ()


def test_what_is_no_architecture_is_refused() -> None:
    with pytest.raises(InputError, match="no architecture"):
        check_architecture("arch1")  # type: ignore[arg-type]


# --- findings ---------------------------------------------------------------------------------


def test_a_sound_architecture_has_no_findings() -> None:
    assert check_architecture(GOOD) == ()


def test_unmodelled_sensors_are_named_with_their_kind() -> None:
    refuse_unmodelled(GOOD)
    described = _of(ODO, GYRO, GPS, Unmodelled("map", "digital_map"))
    check_architecture(described)
    with pytest.raises(ModelError) as caught:
        refuse_unmodelled(described)
    assert "no error model for gyro, map" in caught.value.what
    assert caught.value.where == "sensors.gyro.kind, sensors.map.kind"
    assert caught.value.evidence == "gyro: gyroscope, map: digital track map"


def test_errors_from_elsewhere_make_up_for_a_model_but_not_in_the_filter() -> None:
    described = _of(ODO, GYRO, GPS)
    refuse_unmodelled(described, supplied={"gyro"})
    with pytest.raises(ModelError, match="gyro"):
        refuse_unmodelled(described, supplied={"odo"})
    with pytest.raises(ModelError, match="gyro"):
        refuse_unmodelled(replace(described, operator="kalman"), supplied={"gyro"})
