"""Tails of the squared size of Gaussian errors."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.integrity.tails.tail_family import tail_family


def test_equal_axes_are_the_exponential() -> None:
    family = tail_family(1.0)
    v = np.array([0.1, 3.0, 19.1, 300.0])
    np.testing.assert_allclose(family.depth_at(v), v, rtol=1e-12)
    np.testing.assert_allclose(family.scale(3.0, [0.5, 1.0, 2.0]), [0.5, 1.0, 2.0], rtol=1e-9)


@pytest.mark.parametrize("v", [0.5, 2.0, 3.0, 10.0])
def test_one_axis_is_half_a_chi_square(v: float) -> None:
    """y = z^2/2: P(y > v) = erfc(sqrt v), E(y - v | y > v) from the density of z."""
    tail = mpmath.erfc(mpmath.sqrt(v))
    upper = mpmath.quad(lambda t: mpmath.erfc(mpmath.sqrt(t)), [v, v + 5, v + 40])
    family = tail_family(0.0)
    # Interpolated on 500 levels.
    assert family.depth_at(v) == pytest.approx(float(-mpmath.log(tail)), rel=1e-4)
    excess = float(upper / tail)
    assert float(family.scale(v, excess)) == pytest.approx(1.0, rel=1e-3)


def test_an_ellipse_against_direct_quadrature() -> None:
    """P(y > v) for axes 1 and 0.5 as the integral over the major axis."""
    v, q = mpmath.mpf(4), mpmath.mpf("0.5")
    edge = mpmath.sqrt(2 * v)

    def minor_tail(x: mpmath.mpf) -> mpmath.mpf:
        return mpmath.erfc(mpmath.sqrt(max(2 * v - x * x, 0) / 2) / q)

    inside = mpmath.quad(lambda x: mpmath.npdf(x) * minor_tail(x), [-edge, 0, edge])
    tail = inside + mpmath.erfc(edge / mpmath.sqrt(2))
    assert tail_family(0.5).depth_at(4.0) == pytest.approx(float(-mpmath.log(tail)), rel=1e-4)


@pytest.mark.parametrize("q", [0.0, 0.3, 0.8, 1.0])
def test_level_and_depth_are_inverse(q: float) -> None:
    family = tail_family(q)
    v = np.geomspace(0.01, 2000, 60)
    np.testing.assert_allclose(family.level_at(family.depth_at(v)), v, rtol=1e-9)
    assert family.level_at(-1.0) == 0


def test_an_impossible_ellipse_is_refused() -> None:
    with pytest.raises(InputError):
        tail_family(1.5)
