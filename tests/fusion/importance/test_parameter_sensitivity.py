"""Sobol indices against the analytic ones of Ishigami's function and of the g-function."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
import pytest

from sbas.exceptions import InputError, ModelError
from sbas.fusion.architecture.model import Architecture, Odometer, SatelliteReceiver
from sbas.fusion.importance.parameter_sensitivity import (
    Parameter,
    ParameterSensitivity,
    saltelli_design,
    sensitivity_to_parameters,
    sobol_indices,
    unacceptable_share,
)

ARCHITECTURE = Architecture("odometer and receiver", (Odometer("odo"), SatelliteReceiver("gps")))
PATHS = ("odo.scale_sd", "odo.noise_mps", "gps.white_m", "gps.tau_s", "gps.multipath.largest")


def read(architecture: Architecture) -> list[float]:
    odo, gps = architecture.sensors
    assert isinstance(odo, Odometer)
    assert isinstance(gps, SatelliteReceiver)
    return [odo.scale_sd, odo.noise_mps, gps.white_m, gps.tau_s, gps.multipath.largest]


def asked(
    figure: Callable[[list[float]], float], low: float, high: float, count: int, **options: object
) -> ParameterSensitivity:
    return sensitivity_to_parameters(
        ARCHITECTURE,
        [Parameter(path, low, high) for path in PATHS[:count]],
        simulate=lambda architecture: figure(read(architecture)[:count]),
        **options,  # type: ignore[arg-type]
    )


def ishigami(x: list[float]) -> float:
    return math.sin(x[0]) + 7 * math.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * math.sin(x[0])


def test_ishigami() -> None:
    # Ishigami and Homma 1990, a = 7, b = 0.1, exactly.
    v1 = 0.5 * (1 + 0.1 * math.pi**4 / 5) ** 2
    v2, v13 = 49 / 8, 0.01 * math.pi**8 * (1 / 18 - 1 / 50)
    v = v1 + v2 + v13
    found = asked(ishigami, -math.pi, math.pi, 3, base_points=1024)
    assert found.evaluations == 1024 * 5
    assert found.mean == pytest.approx(3.5, abs=0.02)
    assert found.sd**2 == pytest.approx(v, rel=0.02)
    for row, first, total in zip(
        found.rows, (v1 / v, v2 / v, 0.0), ((v1 + v13) / v, v2 / v, v13 / v), strict=True
    ):
        # 2e-2 is some ten times the error of a Sobol sequence here; half-widths hold it too.
        assert row.first == pytest.approx(first, abs=0.02)
        assert row.total == pytest.approx(total, abs=0.02)
        assert abs(row.first - first) < 2 * row.first_half_width
        assert abs(row.total - total) < 2 * row.total_half_width
        assert row.total_half_width < 0.1


def test_g_function() -> None:
    # Saltelli and Sobol 1995: product of (|4x - 2| + a)/(1 + a), each V_i = 1/(3 (1 + a)^2).
    a = np.array([0.0, 1.0, 4.5, 9.0, 99.0])
    parts = 1 / (3 * (1 + a) ** 2)
    v = np.prod(1 + parts) - 1
    found = asked(
        lambda x: float(np.prod((np.abs(4 * np.array(x) - 2) + a) / (1 + a))), 0.0, 1.0, 5,
        base_points=512, replicates=200,
    )  # fmt: skip
    first = [row.first for row in found.rows]
    total = [row.total for row in found.rows]
    assert first == pytest.approx(parts / v, abs=0.02)
    assert total == pytest.approx(parts * np.prod(1 + parts) / (1 + parts) / v, abs=0.02)


def test_log_range() -> None:
    # log10 of a log-uniform number is uniform, as wide as the other: half the variance each.
    found = sensitivity_to_parameters(
        ARCHITECTURE,
        [Parameter("odo.scale_sd", 1e-4, 1e-2, log=True), Parameter("gps.white_m", 0.0, 2.0)],
        simulate=lambda a: math.log10(read(a)[0]) + read(a)[2],
        base_points=256,
    )
    assert [row.first for row in found.rows] == pytest.approx([0.5, 0.5], abs=0.02)
    assert found.sd**2 == pytest.approx(2 * 4 / 12, rel=0.02)
    assert Parameter("x", 1e-4, 1e-2, log=True).at(0.5) == pytest.approx(1e-3)
    # exp(log(x)) may lie an ulp beyond x: never outside the range.
    for low, high in ((0.1, 0.3), (3e-5, 0.7), (2.0, 1e9)):
        ends = Parameter("x", low, high, log=True)
        assert low <= ends.at(0.0) == pytest.approx(low)
        assert high >= ends.at(1.0) == pytest.approx(high)


def test_half_widths_hold_the_truth_and_shrink() -> None:
    # y = x1 + x2/2: V = (1 + 1/4)/12, S = ST = 4/5 and 1/5, exactly.
    caught, widths = 0, {16: 0.0, 128: 0.0}
    for seed in range(20):
        for points in widths:
            found = asked(
                lambda x: x[0] + x[1] / 2, 0.0, 1.0, 2,
                base_points=points, seed=seed, replicates=200,
            )  # fmt: skip
            widths[points] += found.rows[0].total_half_width
            caught += abs(found.rows[0].total - 0.8) < found.rows[0].total_half_width
    # The points of a Sobol sequence are more even than a bootstrap believes: 95 % or better.
    assert caught >= 36
    assert widths[128] < widths[16] / 2


def test_design_takes_one_column_of_b_at_a_time() -> None:
    design = saltelli_design(3, 16, seed=5)
    assert design.shape == (16, 5, 3)
    a, b = design[:, 0], design[:, -1]
    for i in range(3):
        mixed = design[:, i + 1]
        assert np.array_equal(mixed[:, i], b[:, i])
        others = [j for j in range(3) if j != i]
        assert np.array_equal(mixed[:, others], a[:, others])
    # A scrambled net: one point in each of 16 strips of every column.
    for column in (*a.T, *b.T):
        assert sorted((column * 16).astype(int)) == list(range(16))
    assert np.array_equal(saltelli_design(3, 16, seed=5), design)
    assert not np.array_equal(saltelli_design(3, 16, seed=6), design)


def test_shift_and_scale_leave_indices() -> None:
    outputs = np.random.default_rng(1).normal(size=(32, 5))
    for ours, shifted in zip(sobol_indices(outputs), sobol_indices(1e4 - 3 * outputs), strict=True):
        assert shifted == pytest.approx(ours, rel=1e-9)


def test_constant_figure_has_no_indices() -> None:
    found = asked(lambda _: 0.125, 0.0, 1.0, 2, base_points=8)
    assert "is 0.125 at all 16 base points" in found.undefined
    assert "not given" in str(found)
    for row in found.rows:
        assert all(map(math.isnan, (row.first, row.first_half_width, row.total)))
    rows = found.to_dict()["rows"]
    assert rows[0]["first"] is None
    json.dumps(found.to_dict(), allow_nan=False)


def test_variance_in_one_point_has_no_half_width() -> None:
    design = saltelli_design(1, 8)
    rare = design[0, 0, 0]
    found = asked(lambda x: float(x[0] == rare), 0.0, 1.0, 1, base_points=8)
    assert found.undefined == ""
    assert math.isnan(found.rows[0].first_half_width)
    assert "no half-width" in str(found)


def test_text_and_table() -> None:
    found = asked(ishigami, -1.0, 1.0, 3, base_points=8, of="Ishigami's function")
    lines = str(found).splitlines()
    assert lines[0].startswith("Sobol indices of Ishigami's function, mean")
    assert "40 points, seed 0, half-widths at 95 %" in lines[0]
    totals = found.summary()["total"]
    assert list(totals.index) == list(PATHS[:3])
    assert lines[1].split(" ")[2] == totals.idxmax()


def test_progress_counts_to_all_points() -> None:
    told: list[tuple[int, int]] = []
    asked(ishigami, 0.0, 1.0, 2 + 1, base_points=8, progress=lambda *now: told.append(now))
    assert told == [(i, 40) for i in range(1, 41)]


@pytest.mark.parametrize(
    ("points", "cure"), [(0, "8"), (7, "8"), (100, "128"), (576, "512"), (-4, "8")]
)
def test_base_points_are_a_power_of_two(points: int, cure: str) -> None:
    with pytest.raises(InputError) as caught:
        asked(ishigami, 0.0, 1.0, 3, base_points=points)
    assert caught.value.cure == f"base_points={cure}"


@pytest.mark.parametrize(
    "options", [{"replicates": 1}, {"confidence": 1.0}, {"confidence": math.nan}]
)
def test_options_out_of_range(options: dict[str, float]) -> None:
    with pytest.raises(InputError, match="half-width"):
        asked(ishigami, 0.0, 1.0, 3, **options)


def test_wrong_parameters() -> None:
    def refused(*parameters: Parameter) -> None:
        sensitivity_to_parameters(ARCHITECTURE, parameters, simulate=lambda _: 1 / 0)

    with pytest.raises(InputError, match="each once"):
        refused()
    with pytest.raises(InputError, match="each once"):
        refused(Parameter("step_s", 1.0, 2.0), Parameter("step_s", 1.0, 3.0))
    # An unknown path is refused before the first simulation.
    with pytest.raises(ModelError) as caught:
        refused(Parameter("step_s", 1.0, 2.0), Parameter("gps.multipath.larges", 1.0, 3.0))
    assert "gps.multipath.largest" in caught.value.cure


@pytest.mark.parametrize(
    ("low", "high", "log"),
    [(1.0, 1.0, False), (2.0, 1.0, False), (0.0, math.inf, False), (0.0, 1.0, True)],
)
def test_wrong_ranges(low: float, high: float, log: bool) -> None:
    with pytest.raises(InputError) as caught:
        Parameter("gps.white_m", low, high, log)
    assert caught.value.where == "gps.white_m"


def test_figure_that_is_not_finite_names_its_point() -> None:
    with pytest.raises(InputError) as caught:
        asked(lambda _: math.nan, 0.0, 1.0, 2, base_points=8)
    assert "odo.scale_sd 0." in caught.value.evidence


def test_share_of_a_simulation_has_one_seed() -> None:
    share = unacceptable_share(runs=20, seed=3)
    assert share(ARCHITECTURE) == share(ARCHITECTURE)
    assert 0.0 < share(ARCHITECTURE) < 0.5
    assert unacceptable_share(runs=20, seed=4)(ARCHITECTURE) != share(ARCHITECTURE)
