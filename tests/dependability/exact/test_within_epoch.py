"""Hardware between epochs against integrals of its closed form."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import And, Con, Not, Options, Or
from tests.dependability.exact.test_product_chain import two_state


def test_and_or_of_hardware_by_quadrature() -> None:
    gates = (And("both", ("e0", "e1")), Not("e0 up", "e0"), And("shared", ("e0", "e1", "e0")),
             Or("top", ("e0", "e1")))  # fmt: skip
    model = replace(two_state(2, gates), step_s=1800.0, options=Options(mean_rule="integral"))
    rows = solve(model).rows

    def failed(t: float) -> mpmath.mpf:
        return (1 - mpmath.exp(-2 * mpmath.mpf(t))) / 2

    with mpmath.workdps(30):
        both = mpmath.quad(lambda t: failed(t) ** 2, [0, 1])
        either = mpmath.quad(lambda t: 1 - (1 - failed(t)) ** 2, [0, 1])
        up = mpmath.quad(lambda t: 1 - failed(t), [0, 1])
    assert rows["both"].mean_unavailability == pytest.approx(float(both), rel=1e-13)
    assert rows["shared"].mean_unavailability == pytest.approx(float(both), rel=1e-13)
    assert rows["top"].mean_unavailability == pytest.approx(float(either), rel=1e-13)
    assert rows["e0 up"].mean_unavailability == pytest.approx(float(up), rel=1e-13)


def test_gates_with_memory_are_held() -> None:
    model = replace(two_state(1, (Con("top", 2, "e0"),)), step_s=900.0)
    left = solve(replace(model, options=Options(mean_rule="left")))
    held = solve(replace(model, options=Options(mean_rule="integral")))
    assert held.top.mean_unavailability == pytest.approx(left.top.mean_unavailability, rel=1e-14)
    assert held.rows["e0"].mean_unavailability > left.rows["e0"].mean_unavailability
