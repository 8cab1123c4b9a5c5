"""Reduced fixes: updates against refits of every subset by another way of solving."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.monitoring.araim_faults import fault_sets
from sbas.monitoring.araim_subsets import Errors, complete_fix, subsets
from sbas.monitoring.normal_equations import geometry, ranges
from tests.monitoring.araim_reference import gain_of

ENU = np.eye(3)[:, :, None]


def sky(seed: int, letters: str) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    m = len(letters)
    return {
        "el": np.rad2deg(np.arcsin(rng.uniform(0.09, 1.0, m))),
        "az": rng.uniform(0, 360, m),
        "sigma": rng.uniform(0.5, 3.0, m),
        "accuracy": rng.uniform(0.3, 2.0, m),
        "bias": rng.uniform(0.0, 1.0, m),
        "y": rng.normal(0, 5, m),
    }


@given(
    st.integers(0, 10**6),
    st.sampled_from(["GGGGGGG", "GGGGGEEE", "GGGGEEEE", "GGGGEE", "GGGEERRR", "GGGGGGGEEEEEE"]),
    st.sampled_from([1, 2, 3]),
)
def test_every_subset_against_a_refit(seed: int, letters: str, most: int) -> None:
    s = sky(seed, letters)
    names = sorted(set(letters))
    clock = np.array([[names.index(letter)] for letter in letters])
    given_ranges = ranges(s["el"][:, None], s["az"][:, None], s["sigma"][:, None], clock=clock)
    fix = geometry(given_ranges)
    if not fix.solved[0]:
        return
    errors = Errors(s["accuracy"][:, None] ** 2, s["bias"][:, None], s["y"][:, None])
    sets = fault_sets(len(letters), len(names), most)
    found = subsets(given_ranges, fix, sets, ENU, errors)
    whole = gain_of(list(range(len(letters))), s["el"], s["az"], list(letters), s["sigma"])
    if whole is None:
        return
    sigma, bias, accuracy = complete_fix(fix, ENU, errors)
    assert sigma[:, 0] == pytest.approx(np.sqrt(np.diag(whole[1])), rel=1e-8)
    assert bias[:, 0] == pytest.approx(np.abs(whole[0]) @ s["bias"], rel=1e-8)
    assert accuracy[:, 0] == pytest.approx(np.sqrt(whole[0] ** 2 @ s["accuracy"] ** 2), rel=1e-8)
    row = -1
    for part in sets:
        failed = {names[c] for c in part.clocks}
        for slots in part.slots.tolist():
            row += 1
            if failed & {letters[i] for i in slots}:
                continue  # such a set has the prior 0
            keep = [i for i in range(len(letters)) if i not in slots and letters[i] not in failed]
            answer = gain_of(keep, s["el"], s["az"], list(letters), s["sigma"])
            if answer is None:
                # Degenerate for the refit is a condition of 1e5, twice as strict as the square
                # root of what the normal equations allow.
                left = len(keep) - 3 - len({letters[i] for i in keep})
                assert left >= 0 or not found.full[row, 0]
                continue
            gain, cov = answer
            assert found.full[row, 0]
            scale = np.sqrt(np.diag(cov)).max()
            close = {"rel": 1e-7, "abs": 1e-9 * scale}
            assert found.sigma_m[:, row, 0] == pytest.approx(np.sqrt(np.diag(cov)), **close)
            assert found.bias_m[:, row, 0] == pytest.approx(np.abs(gain) @ s["bias"], **close)
            change = gain - whole[0]
            spread = np.sqrt(change**2 @ s["accuracy"] ** 2)
            assert found.sigma_separation_m[:, row, 0] == pytest.approx(spread, **close)
            assert found.separation_m is not None
            step = found.separation_m[:, row, 0]
            assert step == pytest.approx(change @ s["y"], rel=1e-6, abs=1e-7 * scale)
    assert row == len(found.full) - 1


def test_with_equal_variances_the_separation_test_is_the_w_test() -> None:
    s = sky(4, "GGGGGGGG")
    given_ranges = ranges(s["el"][:, None], s["az"][:, None], s["sigma"][:, None])
    fix = geometry(given_ranges)
    errors = Errors(s["sigma"][:, None] ** 2, s["bias"][:, None], s["y"][:, None])
    found = subsets(given_ranges, fix, fault_sets(8, 1, 1)[:1], ENU, errors)
    # w = e / (sigma sqrt(r)) from residuals of an explicit fit.
    e, a = np.deg2rad(s["el"]), np.deg2rad(s["az"])
    g = np.stack(
        [-np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), -np.sin(e), np.ones(8)], axis=1
    ) / s["sigma"][:, None]  # fmt: skip
    q, _ = np.linalg.qr(g)
    left = s["y"] / s["sigma"]
    w = (left - q @ (q.T @ left)) / np.sqrt(1 - (q**2).sum(axis=1))
    assert found.separation_m is not None
    ratio = np.abs(found.separation_m / found.sigma_separation_m)[:, :, 0]
    for axis in range(3):
        assert ratio[axis] == pytest.approx(np.abs(w), rel=1e-8)


def test_a_critical_satellite_cannot_be_left_out() -> None:
    # Four at 30 deg and one in the zenith: without the latter, height and clock are one.
    el = np.array([[30.0], [30], [30], [30], [90]])
    az = np.array([[0.0], [90], [180], [270], [0]])
    given_ranges = ranges(el, az, np.ones((5, 1)))
    fix = geometry(given_ranges)
    one = np.ones((5, 1))
    found = subsets(given_ranges, fix, fault_sets(5, 1, 1), ENU, Errors(one, one, None))
    assert found.full[:5, 0].tolist() == [True, True, True, True, False]
    assert not found.full[5, 0]
    assert found.separation_m is None
