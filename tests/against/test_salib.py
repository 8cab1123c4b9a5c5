"""Sobol indices against SALib, on the same figures at the same points."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.fusion.importance.parameter_sensitivity import saltelli_design, sobol_indices

pytest.importorskip("SALib", reason="SALib is the peer of this test")

BOUNDS = [[0.0, 1.0]] * 4


def figure(x: np.ndarray) -> np.ndarray:
    """Smooth, with interactions, and a step as a share of Monte Carlo runs has."""
    return np.asarray(np.exp(x[..., 0] * x[..., 1]) + 3 * (x[..., 2] > 0.6) + 0.01 * x[..., 3])


@pytest.mark.parametrize(("base_points", "seed"), [(64, 1), (512, 2)])
def test_indices_and_half_widths(base_points: int, seed: int) -> None:
    from SALib.analyze import sobol

    outputs = figure(saltelli_design(4, base_points, seed=seed))
    problem = {"num_vars": 4, "names": list("abcd"), "bounds": BOUNDS}
    theirs = sobol.analyze(
        problem, outputs.ravel(), calc_second_order=False, num_resamples=2000, seed=1
    )
    first, total = sobol_indices(outputs)
    assert first == pytest.approx(theirs["S1"], rel=1e-10, abs=1e-12)
    assert total == pytest.approx(theirs["ST"], rel=1e-10, abs=1e-12)


def test_half_widths() -> None:
    from SALib.analyze import sobol

    from sbas.fusion.architecture.model import Architecture, Odometer
    from sbas.fusion.importance.parameter_sensitivity import Parameter, sensitivity_to_parameters

    fields = ("scale_sd", "noise_mps", "slip.smallest", "slip.largest")
    seen: list[float] = []

    def simulate(architecture: Architecture) -> float:
        odo = architecture.sensors[0]
        assert isinstance(odo, Odometer)
        x = np.array([odo.scale_sd, odo.noise_mps, odo.slip.smallest, odo.slip.largest])
        seen.append(float(figure(x)))
        return seen[-1]

    ours = sensitivity_to_parameters(
        Architecture("one odometer", (Odometer("odo"),)),
        [Parameter(f"odo.{field}", 0.0, 1.0) for field in fields],
        simulate=simulate,
        base_points=256,
        replicates=4000,
    )
    problem = {"num_vars": 4, "names": list("abcd"), "bounds": BOUNDS}
    theirs = sobol.analyze(
        problem, np.array(seen), calc_second_order=False, num_resamples=4000, seed=1
    )
    # A standard deviation of 4000 replicates scatters by 1.1 %; 5 sigma of the difference.
    tolerance = 5 * np.sqrt(2) / np.sqrt(2 * 4000)
    for row, s1, st in zip(ours.rows, theirs["S1_conf"], theirs["ST_conf"], strict=True):
        assert row.first_half_width == pytest.approx(s1, rel=tolerance)
        assert row.total_half_width == pytest.approx(st, rel=tolerance)


def test_points_of_the_same_construction() -> None:
    from SALib.sample import sobol as sample

    problem = {"num_vars": 4, "names": list("abcd"), "bounds": BOUNDS}
    theirs = sample.sample(problem, 32, calc_second_order=False, scramble=False)
    theirs = theirs.reshape(32, 6, 4)
    ours = saltelli_design(4, 32)
    # Which columns come from A and which from B, whatever the points.
    for design in (theirs, ours):
        same_as_a = np.isclose(design, design[:, :1]).all(axis=0)
        assert same_as_a[1:5].tolist() == (~np.eye(4, dtype=bool)).tolist()
