"""Policies for silent sensors: exact on cases made by hand, and against the table of the page."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    Missing,
    Odometer,
    Phase,
    SatelliteReceiver,
    SpeedProfile,
)
from sbas.fusion.fused_runs import Floats, SensorRuns
from sbas.fusion.simulation.missing_data import (
    UsedErrors,
    epoch_positions_m,
    used_errors,
)
from sbas.fusion.simulation.sensor_errors import draw_sensors
from sbas.fusion.simulation.weighted_fusion import fused_errors

NAN = np.nan
TRUE_M = np.array([10.0, 30.0, 60.0, 100.0])
# Two runs; the receiver is silent at first in run 0, and later on in both.
GNSS = np.array([[[NAN, 1.0], [2.0, NAN], [NAN, NAN], [NAN, 4.0]]])
ODO = np.array([[[0.1, 0.2], [0.3, 0.5], [0.6, 0.9], [1.0, NAN]]])


def _runs() -> dict[str, SensorRuns]:
    return {"odo": SensorRuns(ODO, (True,)), "gnss": SensorRuns(GNSS, (True,))}


def _gnss(policy: Missing) -> UsedErrors:
    return used_errors(_runs(), {"gnss": policy}, TRUE_M)["gnss"]


@pytest.mark.parametrize(
    ("policy", "expected"),
    [
        # e_m(tf) + e_j(t) - e_j(tf); no fix yet in run 0 at first; no odometer in run 1 at last
        (
            Missing("extrapolate", "odo"),
            [[NAN, 1.0], [2.0, 1.3], [2.3, 1.7], [2.7, 4.0]],
        ),
        (Missing("substitute", "odo"), [[0.1, 1.0], [2.0, 0.5], [0.6, 0.9], [1.0, 4.0]]),
        # e_m(tf) - (x(t) - x(tf))
        (Missing("hold"), [[NAN, 1.0], [2.0, -19.0], [-28.0, -49.0], [-68.0, 4.0]]),
        (Missing("remove"), [[NAN, 1.0], [2.0, NAN], [NAN, NAN], [NAN, 4.0]]),
    ],
)
def test_each_policy_on_a_case_made_by_hand(policy: Missing, expected: list[list[float]]) -> None:
    used = _gnss(policy)
    assert used.error_m[0] == pytest.approx(np.array(expected), abs=1e-12, nan_ok=True)
    silent = np.isnan(GNSS)
    assert_array_equal(used.supplied, silent & ~np.isnan([expected]))
    assert_array_equal(used.out, np.isnan([expected]))
    assert_array_equal(used.informed, ~used.out)
    assert_array_equal(used.state_error_m("used"), used.error_m)
    assert_array_equal(used.state_error_m("own"), GNSS)
    assert_array_equal(used.own_m, GNSS)


def test_a_sensor_removed_with_its_weight_pulls_to_the_origin_and_has_no_state() -> None:
    used = _gnss(Missing("remove", renormalise=False))
    assert used.error_m[0] == pytest.approx(
        np.array([[-10.0, 1.0], [2.0, -30.0], [-60.0, -60.0], [-100.0, 4.0]])
    )
    assert not used.supplied.any()
    assert_array_equal(used.informed, ~np.isnan(GNSS))
    assert_array_equal(used.state_error_m("used"), GNSS)
    # w_o e_o - w_m x(t), weights .25 and .75
    fused = fused_errors(
        [UsedErrors(ODO, ODO, np.zeros(ODO.shape, bool)), used], np.array([[0.25, 0.75]])
    )
    assert fused[0, 2] == pytest.approx([0.25 * 0.6 - 45.0, 0.25 * 0.9 - 45.0])


def test_no_later_value_is_used_and_a_silent_helper_does_not_help() -> None:
    assert np.isnan(_gnss(Missing("hold")).error_m[0, 0, 0])
    assert np.isnan(_gnss(Missing("extrapolate", "odo")).error_m[0, 0, 0])
    both = used_errors(
        _runs(), {"odo": Missing("substitute", "gnss"), "gnss": Missing("hold")}, TRUE_M
    )
    assert both["odo"].error_m[0, 3, 1] == 4.0
    silent = {"odo": SensorRuns(ODO * NAN, (True,)), "gnss": SensorRuns(GNSS, (True,))}
    alone = used_errors(silent, {"gnss": Missing("substitute", "odo")}, TRUE_M)["gnss"]
    assert_array_equal(alone.error_m, GNSS)
    assert not alone.supplied.any()


def test_across_the_track_the_train_stands_still() -> None:
    three = np.stack([GNSS[0], GNSS[0] + 1, GNSS[0] + 2])
    odo = np.full((3, 4, 2), NAN)
    odo[0] = ODO[0]
    runs = {
        "odo": SensorRuns(odo, (True, False, False)),
        "gnss": SensorRuns(three, (True, True, True)),
    }
    held = used_errors(runs, {"gnss": Missing("hold"), "odo": Missing("hold")}, TRUE_M)
    assert held["gnss"].error_m[:, 3, 0] == pytest.approx([2.0 - 70.0, 3.0, 4.0])
    assert np.isnan(held["odo"].error_m[1:]).all()
    moved = used_errors(runs, {"gnss": Missing("extrapolate", "odo")}, TRUE_M)["gnss"]
    assert moved.error_m[:, 3, 0] == pytest.approx([2.7, NAN, NAN], nan_ok=True)


def test_infinite_errors_stay_infinite_or_missing() -> None:
    runs = {
        "odo": SensorRuns(np.array([[[np.inf], [np.inf], [1.0]]]), (True,)),
        "gnss": SensorRuns(np.array([[[1.0], [NAN], [NAN]]]), (True,)),
    }
    used = used_errors(runs, {"gnss": Missing("extrapolate", "odo")}, TRUE_M[:3])["gnss"]
    assert_array_equal(used.error_m[0, :, 0], [1.0, NAN, -np.inf])


# --- the table of the page: mean |fused error| at the end of an outage of 10 and 40 s -----------

NEVER = Bursts(0.0, 1.0, 0.0, 0.0)
WEIGHTS = np.array([[0.3585, 0.1585, 0.4830]])  # .359/.159/.483 of the page, adding up to 1
ABC = Architecture(
    "arch1",
    (
        Odometer("odo", slip=NEVER),
        Accelerometer("acc"),
        SatelliteReceiver("gnss", multipath=NEVER, outage=NEVER),
    ),
)
CONST = replace(ABC, profile=SpeedProfile((Phase(100.0, 0.0),), start_speed_mps=20.0))
RUNS = 3000


def _drawn(architecture: Architecture) -> dict[str, SensorRuns]:
    return draw_sensors(architecture, RUNS, np.random.SeedSequence(8))


def _after_outage(
    drawn: dict[str, SensorRuns], x: Floats, outage_s: int, policy: Missing
) -> Floats:
    error = drawn["gnss"].error_m.copy()
    error[:, 100 - outage_s :] = NAN
    runs = {**drawn, "gnss": SensorRuns(error, (True,))}
    used = used_errors(runs, {"gnss": policy}, x)
    size: Floats = np.abs(fused_errors(list(used.values()), WEIGHTS)[0, -1])
    return size


def _mean_of_normal(mean: float, sd: float) -> float:
    """E|X| of a normal X."""
    z = mean / sd
    return sd * math.sqrt(2 / math.pi) * math.exp(-z * z / 2) + mean * math.erf(z / math.sqrt(2))


@pytest.mark.parametrize(
    ("architecture", "table"),
    [
        (ABC, {"plain": (652, 652), "remove": (1.04, 1.04), "hold": (19.1, 265),
               "odo": (1.03, 1.03), "acc": (1.45, 1.45), "extrapolate": (0.61, 0.77)}),
        (CONST, {"plain": (966, 966), "remove": (1.34, 1.34), "hold": (96.6, 386),
                 "odo": (1.45, 1.45), "acc": (1.52, 1.52), "extrapolate": (0.81, 1.03)}),
    ],
)  # fmt: skip
def test_errors_after_an_outage(
    architecture: Architecture, table: dict[str, tuple[float, float]]
) -> None:
    """Against the exact mean of the normal errors, and against the page (2000 runs)."""
    x = epoch_positions_m(architecture)
    drawn = _drawn(architecture)
    wo, wa, wg = WEIGHTS[0]
    odo, acc, gps = 1e-6 * x[-1] ** 2 + 0.01 * 0.1 * 100, 2.6858**2, 0.5
    policies = {
        "plain": Missing("remove", renormalise=False),
        "remove": Missing("remove"),
        "hold": Missing("hold"),
        "odo": Missing("substitute", "odo"),
        "acc": Missing("substitute", "acc"),
        "extrapolate": Missing("extrapolate", "odo"),
    }
    for outage, column in ((10, 0), (40, 1)):
        dx = x[-1] - x[-1 - outage]
        drift = 1e-6 * dx**2 + 0.01 * 0.1 * outage
        both = 1e-6 * x[-1] * dx + 0.01 * 0.1 * outage
        acc_part = wa**2 * acc
        exact = {
            "plain": (wg * x[-1], wo**2 * odo + acc_part),
            "remove": (0.0, (wo**2 * odo + acc_part) / (1 - wg) ** 2),
            "hold": (wg * dx, wo**2 * odo + acc_part + wg**2 * gps),
            "odo": (0.0, (wo + wg) ** 2 * odo + acc_part),
            "acc": (0.0, wo**2 * odo + (wa + wg) ** 2 * acc),
            "extrapolate": (
                0.0,
                wo**2 * odo + wg**2 * drift + 2 * wo * wg * both + acc_part + wg**2 * gps,
            ),
        }
        for name, policy in policies.items():
            mean, variance = exact[name]
            expected = _mean_of_normal(mean, math.sqrt(variance))
            errors = _after_outage(drawn, x, outage, policy)
            assert errors.mean() == pytest.approx(expected, abs=4 * errors.std() / math.sqrt(RUNS))
            # 3.5 sd of the page's own sample, half a unit of its last digit
            page = table[name][column]
            scatter = 3.5 * math.sqrt(variance / 2000) + (0.5 if page > 100 else 0.05)
            assert page == pytest.approx(expected, abs=scatter), (name, outage)
