"""K under each process model against the check values, and each model against its inverse."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.exposure_models import (
    MODELS,
    KModels,
    exposure_k,
    exposure_risk,
    k_models,
)

WHITE = 0.09 / 1.09


def hour(tau_s: float = 360, **changes: float) -> KModels:
    return k_models(5e-8, exposure_s=3600, tau_s=tau_s, interval_s=1, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("tau", "expected"),
    [
        # Methods page, section 2.7.
        (360, {"naive": 6.1829, "rice": 6.4562, "ar1": 6.7236, "ou": 6.7666}),
        (1500, {"naive": 5.9476, "rice": 6.2349, "ar1": 6.5232, "ou": 6.5426}),
    ],
)
def test_k_side_by_side(tau: float, expected: dict[str, float]) -> None:
    answer = hour(tau)
    assert list(answer.models) == ["naive", "ar1", "ou", "ou_dt", "rice"]
    for name, k in expected.items():
        assert answer.models[name].k == pytest.approx(k, abs=6e-5)
    assert answer.models["ou_dt"].k == pytest.approx(answer.k, rel=3e-4)
    assert answer.k == answer.models["ar1"].k
    assert answer.per_sample_risk == pytest.approx(math.exp(-(answer.k**2) / 2), rel=1e-12)


@pytest.mark.parametrize(("tau", "k"), [(360, 6.3955), (1500, 6.1887)])
def test_one_dimension(tau: float, k: float) -> None:
    assert hour(tau, dim=1).k == pytest.approx(k, rel=1e-5)


def test_nugget_is_there_only_where_given() -> None:
    answer = hour(nugget=WHITE)
    assert answer.models["nugget"].k == pytest.approx(6.9629, rel=1e-5)
    assert answer.models["ar1"].k == hour().k
    assert any("white" in caveat for caveat in answer.caveats)


def test_risk_of_6_18_is_29_and_8_times_the_target() -> None:
    # Methods page, section 2.7.
    for tau, times in ((360, 29), (1500, 8)):
        model = hour(tau).models["ar1"]
        assert model.hourly_risk_of_6_18 / 5e-8 == pytest.approx(times, rel=0.02)
        assert model.hourly_risk_of_6_18 == pytest.approx(
            exposure_risk(6.18, Exposure(3600, tau, 1)), rel=1e-12
        )
    # Whatever the exposure asked for.
    short = k_models(2e-9, exposure_s=600, tau_s=360, interval_s=1)
    assert short.models["ar1"].hourly_risk_of_6_18 == pytest.approx(1.431601e-6, rel=1e-6)


def test_n_es_is_at_the_k_of_the_model() -> None:
    for model in hour().models.values():
        assert model.n_es == pytest.approx(5e-8 / math.exp(-(model.k**2) / 2), rel=1e-8)
    assert hour().models["naive"].n_es == pytest.approx(10, rel=1e-6)


@given(
    log_risk=st.floats(-14.5, -0.5),
    tau=st.floats(5, 400),
    exposure=st.floats(1, 30),
    dim=st.sampled_from([1, 2, 3]),
    model=st.sampled_from(["naive", "ar1", "ou", "ou_dt", "rice"]),
)
def test_k_and_risk_are_inverse(
    log_risk: float, tau: float, exposure: float, dim: int, model: str
) -> None:
    process = Exposure(exposure * tau, tau, 1, dim)
    risk = 10**log_risk
    try:
        k = exposure_k(risk, process, model=model)
    except InputError:
        assert exposure_risk(1.0, process, model=model) <= risk
        return
    assert exposure_risk(k, process, model=model) == pytest.approx(risk, rel=1e-8)


def test_ellipse_and_nugget_inverse() -> None:
    ellipse = Exposure(3600, 360, 1, axis_ratio=0.4)
    white = Exposure(3600, 360, 1, nugget=0.1)
    for process, model in ((ellipse, "ar1"), (ellipse, "rice"), (white, "nugget")):
        k = exposure_k(5e-8, process, model=model)
        assert exposure_risk(k, process, model=model) == pytest.approx(5e-8, rel=1e-8)
    assert exposure_k(5e-8, ellipse) < hour().k


def test_short_exposures_are_for_single_models() -> None:
    # Methods page, section 9: n_es 13.255 in 150 samples at K 6.182851757.
    window = Exposure(150, 360, 1)
    assert exposure_k(13.2548 * 5e-9, window) == pytest.approx(6.182851757, rel=1e-6)


def test_plain_values_and_summary() -> None:
    answer = hour()
    plain = json.loads(json.dumps(answer.to_dict(), allow_nan=False))
    assert plain["k"] == answer.k
    assert set(plain["models"]["rice"]) == {"k", "n_es", "hourly_risk_of_6_18"}
    assert {"exposure_s", "tau_s", "interval_s", "per_sample_risk"} <= set(plain)
    assert list(answer.summary().index) == list(answer.models)
    assert set(MODELS) == {*answer.models, "nugget"}


def test_caveats_follow_the_arguments() -> None:
    assert any("second-order" in c for c in hour().caveats)
    assert any("unequal" in c for c in hour(axis_ratio=0.5).caveats)
    coarse = k_models(5e-8, exposure_s=3600, tau_s=10, interval_s=1)
    assert any("too long for a smooth error" in c for c in coarse.caveats)


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"exposure_s": 300}, "exposure_s"),
        ({"tau_s": 1}, "tau_s"),
        ({"tau_s": 0.5}, "tau_s"),
        ({"interval_s": -1}, "interval_s"),
        ({"risk": 0}, "risk"),
        ({"risk": 1}, "risk"),
        ({"risk": 1e-16}, "risk"),
        ({"risk": math.nan}, "risk"),
        ({"risk": 0.99999}, "risk"),
        ({"dim": 5}, "dim"),
        ({"nugget": 0.1, "axis_ratio": 0.5}, "axis_ratio"),
    ],
)
def test_arguments_out_of_range(changes: dict[str, float], where: str) -> None:
    arguments = {"risk": 5e-8, "exposure_s": 3600, "tau_s": 360, "interval_s": 1} | changes
    with pytest.raises(InputError) as error:
        k_models(arguments.pop("risk"), **arguments)  # type: ignore[arg-type]
    assert error.value.where == where


def test_unknown_model() -> None:
    with pytest.raises(InputError, match="unknown model"):
        exposure_risk(6, Exposure(3600, 360, 1), model="ar2")
