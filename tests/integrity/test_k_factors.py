"""K factors against high precision, the paper, and each other."""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.k_factors import exceedance, k_factor, log_exceedance

RISKS = [
    1 - 2.0**-53, 1 - 1e-9, 0.9, 0.7, 0.5, 0.45, 0.3, 0.1, 1e-2, 1e-5, 5e-9,
    1e-20, 1e-100, 1e-300, 3e-310, 5e-324,
]  # fmt: skip
AXIS_RATIOS = [
    0, 1e-300, 1e-12, 1e-6, 1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3, 0.5, 0.9, 0.999, 1 - 1e-12, 1,
]  # fmt: skip


def erfc(x: Any) -> Any:
    """mpmath's erfc, which cannot take arguments above 1e150; 0 is exact enough from 1000 on."""
    return mp.erfc(x) if x < 1000 else mp.mpf(0)


def gaussian_tail(k: Any) -> Any:
    return mp.erfc(k / mp.sqrt(2))


def one_sided_tail(k: Any) -> Any:
    return mp.erfc(k / mp.sqrt(2)) / 2


def chi_tail(dim: int) -> Any:
    return lambda k: mp.gammainc(mp.mpf(dim) / 2, k * k / 2, mp.inf, regularized=True)


def hoyt_tail(q: float) -> Any:
    """P(|(x, y)| > k), x ~ N(0, 1), y ~ N(0, q^2), by conditioning on x.

    Another integral than the package's: x = k cos a leaves the tail of y alone. exp(-k^2/2) is
    taken out because mpmath's quadrature stops on the absolute error.
    """
    ratio = mp.mpf(q)

    def tail(k: Any) -> Any:
        if ratio == 0:
            return gaussian_tail(k)

        def integrand(a: Any) -> Any:
            y = k * mp.sin(a)
            return mp.exp(y * y / 2) * erfc(y / (ratio * mp.sqrt(2))) * y

        knees = [ratio / k * 2**j for j in range(-2, 7)]
        points = [0, *(a for a in knees if a < 1.4), mp.pi / 2]
        inside = mp.sqrt(2 / mp.pi) * mp.quad(integrand, points)
        return gaussian_tail(k) + mp.exp(-k * k / 2) * inside

    return tail


def relative_error(k: float, risk: float, tail: Any) -> float:
    """Upper bound of the relative error of a K factor, from its tail in 30 digits.

    ln(-ln tail) grows at least as fast as ln K for every distribution of errors in size.
    """
    with mp.workdps(30):
        return float(abs(mp.log(mp.log(tail(mp.mpf(k))) / mp.log(mp.mpf(risk)))))


def test_the_paper_s_npa_factor() -> None:
    # Filip, Bazant, Mocek 2010, eq. 2 prints 6.18; the digits are sqrt(-2 ln 5e-9) in mpmath.
    with mp.workdps(30):
        exact = float(mp.sqrt(-2 * mp.log(mp.mpf("5e-9"))))
    assert exact == 6.182851756998919
    assert k_factor(5e-9) == pytest.approx(exact, rel=1e-14)
    assert round(k_factor(5e-9), 2) == 6.18


@pytest.mark.parametrize(
    ("risk", "options", "k"),
    [
        (2e-9, {"distribution": "gaussian"}, 5.997807015),
        (0.98e-7, {"distribution": "gaussian"}, 5.330393852),
        (1e-7, {"distribution": "gaussian"}, 5.326723886),
        (5e-9, {"distribution": "ellipse", "axis_ratio": 0.0}, 5.847172),
        (5e-9, {"distribution": "ellipse", "axis_ratio": 0.5}, 5.871837),
        (5e-9, {"distribution": "ellipse", "axis_ratio": 1.0}, 6.182852),
    ],
)
def test_factors_computed_elsewhere(risk: float, options: dict[str, Any], k: float) -> None:
    assert k_factor(risk, **options) == pytest.approx(k, rel=1e-7)


@pytest.mark.parametrize(
    ("k", "options", "risk"),
    [
        (6.0, {"distribution": "gaussian"}, 1.973175e-9),
        (5.33, {"distribution": "gaussian"}, 9.821277e-8),
        (6.18, {}, 5.088921e-9),
        (6.0, {}, 1.522998e-8),
        (6.18, {"distribution": "ellipse", "axis_ratio": 0.0}, 6.410160e-10),
        (6.18, {"distribution": "ellipse", "axis_ratio": 0.5}, 7.433210e-10),
    ],
)
def test_risks_of_rounded_factors(k: float, options: dict[str, Any], risk: float) -> None:
    assert exceedance(k, **options) == pytest.approx(risk, rel=1e-6)


@pytest.mark.parametrize("risk", RISKS)
def test_gaussian_two_sided_against_mpmath(risk: float) -> None:
    assert relative_error(k_factor(risk, distribution="gaussian"), risk, gaussian_tail) < 1e-14


@pytest.mark.parametrize("risk", [r for r in RISKS if r != 0.5])
def test_gaussian_one_sided_against_mpmath(risk: float) -> None:
    k = k_factor(risk, distribution="gaussian", one_sided=True)
    with mp.workdps(30):
        log_risk = mp.log(mp.mpf(risk))
        exact = mp.findroot(lambda x: mp.log(one_sided_tail(x)) - log_risk, mp.mpf(k))
        assert abs(k / exact - 1) < 1e-14


def test_gaussian_one_sided_median_is_zero() -> None:
    k = k_factor(0.5, distribution="gaussian", one_sided=True)
    assert k == 0
    assert math.copysign(1, k) == 1


@pytest.mark.parametrize("risk", RISKS)
def test_rayleigh_against_mpmath(risk: float) -> None:
    with mp.workdps(30):
        exact = mp.sqrt(-2 * mp.log(mp.mpf(risk)))
        assert abs(k_factor(risk) / exact - 1) < 1e-15


@pytest.mark.parametrize("dim", [1, 2, 3, 4, 7, 20, 101, 1000])
def test_chi_against_mpmath(dim: int) -> None:
    for risk in RISKS:
        k = k_factor(risk, distribution="chi", dim=dim)
        assert relative_error(k, risk, chi_tail(dim)) < 2e-14, risk


@pytest.mark.parametrize("axis_ratio", AXIS_RATIOS)
def test_ellipse_against_mpmath(axis_ratio: float) -> None:
    # Risks with K of 0.6 to 1.2, where a rule in the polar angle is least sure, and the ends.
    for risk in (1 - 1e-9, 0.7, 0.5, 0.3, 5e-9, 1e-300):
        k = k_factor(risk, distribution="ellipse", axis_ratio=axis_ratio)
        assert relative_error(k, risk, hoyt_tail(axis_ratio)) < 1e-14, risk


@pytest.mark.parametrize(
    ("options", "tail"),
    [
        ({"distribution": "gaussian"}, gaussian_tail),
        ({"distribution": "gaussian", "one_sided": True}, one_sided_tail),
        ({"distribution": "chi", "dim": 1}, chi_tail(1)),
        ({"distribution": "chi", "dim": 6}, chi_tail(6)),
        ({"distribution": "chi", "dim": 9}, chi_tail(9)),
        ({"distribution": "ellipse", "axis_ratio": 0.4}, hoyt_tail(0.4)),
    ],
)
def test_exceedance_against_mpmath(options: dict[str, Any], tail: Any) -> None:
    for k in (0.01, 0.7, 1.0, 3.0, 6.18, 20.0, 36.0, 45.0):
        with mp.workdps(30):
            exact = tail(mp.mpf(k))
            assert log_exceedance(k, **options) == pytest.approx(
                float(mp.log(exact)), rel=1e-13, abs=3e-16
            )
            if exact > mp.mpf("1e-300"):
                assert exceedance(k, **options) == pytest.approx(float(exact), rel=5e-13)


def test_chi_contains_the_others() -> None:
    risk = np.geomspace(1e-300, 0.99, 50)
    one_axis = k_factor(risk, distribution="gaussian")
    np.testing.assert_allclose(k_factor(risk, distribution="chi", dim=1), one_axis, rtol=1e-13)
    np.testing.assert_allclose(
        k_factor(risk, distribution="chi", dim=2), k_factor(risk), rtol=1e-13
    )


# --- properties -------------------------------------------------------------------------------

risks = st.one_of(
    st.floats(-323, -1e-3).map(lambda e: max(10.0**e, 5e-324)),
    st.floats(-15.9, -0.4).map(lambda e: 1 - 10.0**e),
)
ratios = st.one_of(st.floats(0, 1), st.floats(-20, 0).map(lambda e: 10.0**e))
shapes = st.one_of(
    st.just({"distribution": "rayleigh"}),
    st.booleans().map(lambda b: {"distribution": "gaussian", "one_sided": b}),
    st.integers(1, 40).map(lambda n: {"distribution": "chi", "dim": n}),
    ratios.map(lambda q: {"distribution": "ellipse", "axis_ratio": q}),
)


@given(risk=risks, options=shapes)
def test_exceedance_inverts_k_factor(risk: float, options: dict[str, Any]) -> None:
    log_risk = log_exceedance(k_factor(risk, **options), **options)
    assert log_risk == pytest.approx(math.log(risk), rel=1e-12, abs=1e-15)


@given(risk=risks, factor=st.floats(1e-6, 0.999), options=shapes)
def test_a_smaller_risk_needs_a_larger_k(
    risk: float, factor: float, options: dict[str, Any]
) -> None:
    smaller = max(risk * factor, 5e-324)
    if smaller < risk:
        assert k_factor(smaller, **options) > k_factor(risk, **options)


@given(risk=risks, ratio=ratios, other=ratios)
def test_a_rounder_ellipse_needs_a_larger_k(risk: float, ratio: float, other: float) -> None:
    flat, round_ = sorted((ratio, other))
    k = k_factor(risk, distribution="ellipse", axis_ratio=[0.0, flat, round_, 1.0])
    assert np.all(np.diff(k) >= -4e-15 * k[1:])
    assert k_factor(risk, distribution="gaussian") <= k[1]
    assert k[2] <= k_factor(risk)


def test_arrays_broadcast_and_agree_with_scalars() -> None:
    risk = np.array([[0.3], [5e-9], [1e-200]])
    ratio = np.array([0.0, 0.5, 1.0])
    table = k_factor(risk, distribution="ellipse", axis_ratio=ratio)
    assert table.shape == (3, 3)
    for (i, j), k in np.ndenumerate(table):
        scalar = k_factor(float(risk[i, 0]), distribution="ellipse", axis_ratio=float(ratio[j]))
        assert k == pytest.approx(scalar, rel=1e-15)
    many = k_factor(np.full(2000, 5e-9), distribution="ellipse", axis_ratio=0.5)
    np.testing.assert_allclose(many, table[1, 1], rtol=1e-15)
    assert k_factor(np.array([])).shape == (0,)
    assert isinstance(k_factor(0.1), float)


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize("risk", [0, 1, -0.1, 1.5, math.nan, math.inf, -math.inf, [0.1, math.nan]])
def test_risks_outside_the_unit_interval(risk: Any) -> None:
    with pytest.raises(InputError, match=r"(?s)risk.*\(0, 1\)"):
        k_factor(risk)


@pytest.mark.parametrize("risk", ["1e-7", None, True, 1j, [[0.1], [0.1, 0.2]], 10**400])
def test_risks_that_are_no_numbers(risk: Any) -> None:
    with pytest.raises(InputError, match="risk is not a number"):
        k_factor(risk)


@pytest.mark.parametrize("ratio", [-1e-9, 1.0000001, math.nan, [0.5, 2.0]])
def test_axis_ratios_outside_their_range(ratio: Any) -> None:
    with pytest.raises(InputError, match=r"(?s)axis_ratio.*\[0, 1\]"):
        k_factor(1e-7, distribution="ellipse", axis_ratio=ratio)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"distribution": "normal"}, "rayleigh, gaussian, chi, ellipse"),
        ({"one_sided": True}, "'gaussian', not to 'rayleigh'"),
        ({"distribution": "gaussian", "dim": 2}, "'chi', not to 'gaussian'"),
        ({"distribution": "chi", "dim": 2, "axis_ratio": 0.5}, "'ellipse', not to 'chi'"),
        ({"distribution": "chi"}, "1 to 1000"),
        ({"distribution": "chi", "dim": 0}, "1 to 1000"),
        ({"distribution": "chi", "dim": 2.5}, "1 to 1000"),
        ({"distribution": "chi", "dim": True}, "1 to 1000"),
        ({"distribution": "ellipse"}, "needs axis_ratio"),
        ({"distribution": "gaussian", "one_sided": "no"}, "True or False"),
    ],
)
def test_options_name_what_is_allowed(options: dict[str, Any], named: str) -> None:
    for function in (k_factor, exceedance, log_exceedance):
        with pytest.raises(InputError) as caught:
            function(0.1, **options)
        assert named in str(caught.value)


def test_shapes_that_do_not_fit() -> None:
    with pytest.raises(InputError, match=r"shapes \(2,\) and \(3,\)"):
        k_factor([0.1, 0.2], distribution="ellipse", axis_ratio=[0.1, 0.2, 0.3])


def test_an_underflow_is_no_zero_risk() -> None:
    with pytest.raises(InputError, match="log_exceedance"):
        exceedance(40.0)
    assert log_exceedance(40.0) == -800


@pytest.mark.parametrize("k", [-1.0, math.nan, math.inf, 1e9])
def test_factors_out_of_range(k: float) -> None:
    with pytest.raises(InputError, match="k is out of range"):
        exceedance(k)
