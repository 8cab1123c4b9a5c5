"""The exact quadrature against closed forms, other quadratures, simulation and check values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import integrate, special, stats

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure, per_sample_risk
from sbas.integrity.exposure.gauss_markov import siegmund_risk
from sbas.integrity.exposure.gauss_markov_sampled import (
    ar1_risk,
    extremal_index,
    nugget_risk,
    sampled_risk,
)
from sbas.integrity.k_factors import exceedance

NPA_K = 6.182851757
WHITE = 0.09 / 1.09


def chi_tail(k: float, dim: int) -> float:
    return exceedance(k, distribution="chi", dim=dim)


@pytest.mark.parametrize(
    ("k", "dim", "tau", "samples", "n_es"),
    [
        # Methods page, section 9 (computed there by another quadrature).
        (NPA_K, 2, 360, 3600, 281.55),
        (NPA_K, 2, 1500, 3600, 78.37),
        (NPA_K, 2, 360, 150, 13.255),
        (NPA_K, 2, 1500, 150, 4.948),
        (6.0, 1, 360, 3600, 279.87),
        (6.0, 1, 1500, 3600, 77.88),
        (5.33, 1, 360, 150, 11.075),
        (5.33, 1, 360, 3600, 227.43),
    ],
)
def test_effective_samples_for_exposure(
    k: float, dim: int, tau: float, samples: int, n_es: float
) -> None:
    risk = sampled_risk(k, correlation=math.exp(-1 / tau), samples=samples, dim=dim)
    assert risk / chi_tail(k, dim) == pytest.approx(n_es, rel=1e-4)


def test_hourly_risk_of_the_standards_k_with_and_without_white_noise() -> None:
    assert ar1_risk(NPA_K, Exposure(3600, 360, 1)) == pytest.approx(1.40777e-6, rel=1e-5)
    assert ar1_risk(NPA_K, Exposure(3600, 1500, 1)) == pytest.approx(3.91837e-7, rel=1e-5)
    white = nugget_risk(NPA_K, Exposure(3600, 360, 1, nugget=WHITE))
    assert white / 5e-9 == pytest.approx(1288.0, rel=1e-3)
    assert nugget_risk(6.9629, Exposure(3600, 360, 1, nugget=WHITE)) == pytest.approx(
        5e-8, rel=1e-3
    )


@given(
    k=st.floats(0.01, 12),
    samples=st.integers(1, 500),
    dim=st.sampled_from([1, 2, 3]),
    nugget=st.one_of(st.just(0.0), st.floats(1e-6, 0.99)),
)
def test_without_correlation_it_is_the_binomial(
    k: float, samples: int, dim: int, nugget: float
) -> None:
    risk = sampled_risk(k, correlation=0, samples=samples, dim=dim, nugget=nugget)
    exact = -math.expm1(samples * math.log1p(-chi_tail(k, dim)))
    assert risk == pytest.approx(exact, rel=1e-8)


def test_without_correlation_check_value() -> None:
    assert sampled_risk(3, correlation=0, samples=10) == pytest.approx(0.1056979, rel=1e-6)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("k", [0.8, 3, 6.18, 11])
@pytest.mark.parametrize("correlation", [0.3, 0.9, 0.997])
def test_two_samples_by_the_noncentral_chi_square(k: float, dim: int, correlation: float) -> None:
    """P = p + integral over the first norm of the tail of the second, by scipy."""
    variance = 1 - correlation**2
    norm = math.log(2) * (dim / 2 - 1) + math.lgamma(dim / 2)

    def exit_density(x: float) -> float:
        density = math.exp((dim - 1) * math.log(x) - x * x / 2 - norm)
        mean = (correlation * x) ** 2 / variance
        return density * float(stats.ncx2.sf(k * k / variance, dim, mean))

    low = max(1e-9, k - 30 * math.sqrt(variance))
    points = [p for p in (k - 3 * math.sqrt(variance), correlation * k) if low < p < k]
    exits, error = integrate.quad(exit_density, low, k, points=points, epsabs=0, limit=500)
    assert error < 1e-8 * exits
    risk = sampled_risk(k, correlation=correlation, samples=2, dim=dim)
    # scipy's tail is good to about 1e-8 here.
    assert risk == pytest.approx(chi_tail(k, dim) + exits, rel=1e-7)


@pytest.mark.parametrize("tau", [3, 40, 360])
@pytest.mark.parametrize("k", [1.0, 3.0, 6.0])
def test_one_component_on_a_signed_grid(k: float, tau: float) -> None:
    """One Gauss-Legendre rule over [-K, K]: no symmetry, no panels, no band."""
    correlation = math.exp(-1 / tau)
    step = math.sqrt(1 - correlation**2)
    nodes, weights = special.roots_legendre(max(200, int(8 * k / step)))
    x, w = k * nodes, k * weights
    kernel = stats.norm.pdf(x[:, None], correlation * x, step) * w
    lost = special.ndtr(-(k - correlation * x) / step) + special.ndtr(-(k + correlation * x) / step)
    density = stats.norm.pdf(x)
    total = chi_tail(k, 1)
    for _ in range(120):
        total += float((w * density) @ lost)
        density = kernel @ density
    risk = sampled_risk(k, correlation=correlation, samples=121, dim=1)
    assert risk == pytest.approx(total, rel=1e-8)


def simulate(
    k: float, tau: float, steps: int, scales: list[float], nugget: float, records: int, seed: int
) -> tuple[float, float]:
    """Share of simulated records with an exceedance, and its standard error."""
    rng = np.random.default_rng(seed)
    correlation = math.exp(-1 / tau)
    step = math.sqrt(1 - correlation**2)
    scale = np.asarray(scales)[:, None]
    slow: NDArray[np.float64] = rng.standard_normal((len(scales), records))
    hit = np.zeros(records, dtype=bool)
    for i in range(steps):
        if i:
            slow = correlation * slow + step * rng.standard_normal(slow.shape)
        error = math.sqrt(1 - nugget) * slow
        if nugget:
            error = error + math.sqrt(nugget) * rng.standard_normal(slow.shape)
        hit |= ((scale * error) ** 2).sum(axis=0) >= k * k
    share = float(hit.mean())
    return share, math.sqrt(share * (1 - share) / records)


@pytest.mark.parametrize(
    ("k", "dim", "nugget"),
    [
        (3, 1, 0),
        (3, 2, 0),
        (3.5, 2, 0),
        (4, 2, 0),
        (3, 3, 0),
        (4, 3, 0),
        (3.5, 2, WHITE),
        (4, 1, 0.3),
    ],
)
def test_simulation_agrees_within_its_standard_error(k: float, dim: int, nugget: float) -> None:
    share, error = simulate(k, 36, 360, [1.0] * dim, nugget, 20_000, seed=round(100 * k) + dim)
    risk = sampled_risk(k, correlation=math.exp(-1 / 36), samples=360, dim=dim, nugget=nugget)
    assert abs(risk - share) < 3 * error


@pytest.mark.parametrize(
    ("axis_ratio", "tau", "steps"), [(0.5, 36, 360), (0.3, 36, 360), (0.5, 100, 42)]
)
def test_ellipse_against_simulation(axis_ratio: float, tau: float, steps: int) -> None:
    share, error = simulate(3, tau, steps, [1.0, axis_ratio], 0, 40_000, seed=5)
    risk = ar1_risk(3, Exposure(steps, tau, 1, axis_ratio=axis_ratio))
    assert -3 * error < risk - share < 3 * error + 0.03 * share


def test_ellipse_joins_its_ends() -> None:
    circle = ar1_risk(NPA_K, Exposure(3600, 360, 1))
    line = ar1_risk(NPA_K, Exposure(3600, 360, 1, dim=1))
    risks = [ar1_risk(NPA_K, Exposure(3600, 360, 1, axis_ratio=q)) for q in (0, 0.3, 0.6, 0.9, 1)]
    assert risks == sorted(risks)
    assert risks[-1] == circle
    assert risks[0] == pytest.approx(line, rel=1e-3)
    assert risks[2] < circle
    # Methods page, section 9: by a two-dimensional grid.
    half = ar1_risk(NPA_K, Exposure(3600, 360, 1, axis_ratio=0.5))
    assert half == pytest.approx(2.140e-7, rel=1e-2)
    one = Exposure(1, 360, 1, axis_ratio=0.5)
    assert ar1_risk(3, one) == per_sample_risk(3, one)


@given(
    k=st.floats(0.5, 9),
    tau=st.floats(1.5, 300),
    samples=st.integers(2, 400),
    dim=st.sampled_from([1, 2, 3]),
)
def test_bounds_and_order(k: float, tau: float, samples: int, dim: int) -> None:
    correlation = math.exp(-1 / tau)

    def risk(**changes: float) -> float:
        values = {"k": k, "correlation": correlation, "samples": samples, "dim": dim} | changes
        return sampled_risk(**values)  # type: ignore[arg-type]

    slack = 1 + 1e-9
    p = chi_tail(k, dim)
    independent = -math.expm1(samples * math.log1p(-p))
    # Gaussian correlation inequality (Royen 2014): never more than independent samples.
    assert p <= risk() <= independent * slack
    assert risk() <= 1
    assert risk(k=k + 0.1) <= risk() * slack
    assert risk(samples=samples + 10) * slack >= risk()
    assert risk(correlation=math.exp(-1 / (tau * 1.2))) <= risk() * slack
    if dim < 3:
        assert risk(dim=dim + 1) * slack >= risk()
    assert risk(nugget=0.1) * slack >= risk()


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_vanishing_nugget_is_none(dim: int) -> None:
    hard = sampled_risk(4, correlation=0.99, samples=200, dim=dim)
    soft = [
        sampled_risk(4, correlation=0.99, samples=200, dim=dim, nugget=w)
        for w in (1e-5, 1e-7, 1e-9)
    ]
    assert soft[0] > soft[1] > soft[2] > hard
    assert soft[2] == pytest.approx(hard, rel=1e-3)


@pytest.mark.parametrize("nugget", [0.0, 0.2])
def test_a_long_exposure_is_the_geometric_tail(nugget: float) -> None:
    """Doubling the exposure squares the survival, up to the start."""
    survival = [
        -math.log1p(-sampled_risk(6, correlation=0.9, samples=n, nugget=nugget))
        for n in (5000, 10_000, 20_000)
    ]
    assert survival[2] - survival[1] == pytest.approx(2 * (survival[1] - survival[0]), rel=1e-6)


def test_extremal_index_is_the_long_run_of_the_risk() -> None:
    for nugget in (0.0, 0.1):
        risks = [
            -math.log1p(-sampled_risk(4, correlation=0.95, samples=n, nugget=nugget))
            for n in (2000, 3000)
        ]
        # Hazard per step over p; the logarithm turns the exit share into the hazard.
        theta = extremal_index(4, correlation=0.95, nugget=nugget)
        per_step = (risks[1] - risks[0]) / 1000
        assert -math.log1p(-theta * chi_tail(4, 2)) == pytest.approx(per_step, rel=1e-7)
    assert extremal_index(5, correlation=0) == pytest.approx(1, rel=1e-9)


def test_asymptotic_form_within_two_percent() -> None:
    for tau in (360, 1500):
        hour = Exposure(3600, tau, 1)
        assert 0.98 < siegmund_risk(NPA_K, hour) / ar1_risk(NPA_K, hour) < 1


def test_small_risks_keep_their_digits() -> None:
    """At high K the hazard goes as K f(K): ratios of P/p vary slowly down to 1e-86."""
    risks = [sampled_risk(k, correlation=0.999, samples=100) / chi_tail(k, 2) for k in (12, 16, 20)]
    assert risks == sorted(risks)
    assert 10 < risks[0] < risks[-1] < 100


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"k": 0}, "k"),
        ({"k": 21}, "k"),
        ({"k": math.nan}, "k"),
        ({"correlation": 1}, "correlation"),
        ({"correlation": -0.1}, "correlation"),
        ({"samples": 0}, "samples"),
        ({"samples": 1.5}, "samples"),
        ({"dim": 0}, "dim"),
        ({"nugget": 0.995}, "nugget"),
    ],
)
def test_arguments_out_of_range(changes: dict[str, float], where: str) -> None:
    arguments = {"k": 4.0, "correlation": 0.9, "samples": 10} | changes
    with pytest.raises(InputError) as error:
        sampled_risk(**arguments)  # type: ignore[arg-type]
    assert error.value.where == where


def test_a_nugget_of_an_ellipse_is_refused() -> None:
    with pytest.raises(InputError, match="equal axes"):
        nugget_risk(4, Exposure(3600, 360, 1, axis_ratio=0.5, nugget=0.1))


@pytest.mark.parametrize("nugget", [0.0, 0.08])
@pytest.mark.parametrize(("k", "tau", "dim"), [(3, 10, 1), (4, 360, 2), (6.18, 360, 2), (8, 60, 3)])
def test_finer_grid_and_all_steps_change_nothing(
    k: float, tau: float, dim: int, nugget: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def risk() -> float:
        return sampled_risk(
            k, correlation=math.exp(-1 / tau), samples=20 * int(tau), dim=dim, nugget=nugget
        )

    module = "sbas.integrity.exposure.gauss_markov_sampled"
    usual = risk()
    monkeypatch.setattr(f"{module}._SETTLED", -1.0)
    all_steps = risk()
    assert usual == pytest.approx(all_steps, rel=1e-8)
    monkeypatch.setattr(f"{module}._PANEL", 3.0)
    monkeypatch.setattr(f"{module}._REACH", 11.0)
    assert risk() == pytest.approx(all_steps, rel=1e-11)


def test_too_dense_sampling_is_refused() -> None:
    with pytest.raises(InputError, match="samples per tau") as error:
        ar1_risk(6, Exposure(3600, 360, 0.001))
    assert error.value.where == "interval_s"
