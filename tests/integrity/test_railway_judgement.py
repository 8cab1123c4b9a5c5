"""The verdict on 6.18 and the railway HPL of a recording."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd
import pytest

import sbas
from sbas.estimate import Refusal
from sbas.integrity.k_factors import k_factor
from sbas.integrity.railway_judgement import railway_judgement
from sbas.integrity.results import Evaluation
from tests.plots.synthetic import TRUTH, evaluated, synthetic_recording


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    made = sbas.simulate(hours=30, seed=5)
    return sbas.evaluate(made, truth=sbas.FixedPoint(50.03, 15.77, 289.4, frame="ITRF"))


def test_models_stand_at_the_measured_time(evaluation: Evaluation) -> None:
    judged = railway_judgement(evaluation)
    assert not isinstance(judged, Refusal)
    tau = evaluation.process.decorrelation.tau_s
    assert not isinstance(tau, Refusal)
    models = judged.models.models
    # T/tau independent samples: exact mathematics.
    naive = k_factor(5e-8 * tau.value / 3600, distribution="rayleigh")
    assert models["naive"].k == pytest.approx(float(naive), abs=1e-6)
    assert models["naive"].k < models["rice"].k < models["ar1"].k < models["nugget"].k
    # The safe K allows for the lower limit of tau as well.
    assert judged.k > models["nugget"].k
    assert judged.as_claimed.tau_lower_s == tau.lower
    assert judged.as_claimed.tau_upper_s == tau.upper
    assert not isinstance(judged.as_seen, Refusal)
    assert judged.as_seen.sigma_ratio == evaluation.process.sigma_ratio


def test_availability_is_that_of_the_re_scaled_recording(evaluation: Evaluation) -> None:
    judged = railway_judgement(evaluation)
    assert not isinstance(judged, Refusal)
    made = sbas.simulate(hours=30, seed=5)
    hpl = made.table["hpl_m"].to_numpy()
    for limit, (recorded, railway) in judged.availability.items():
        assert recorded == pytest.approx(np.mean(hpl < limit), abs=1e-4)
        scaled = sbas.railway_hpl(hpl, k_from=6.18, k_to=judged.k)
        assert railway == pytest.approx(np.mean(scaled < limit), abs=1e-4)
        assert railway <= recorded


def test_without_truth_the_seen_sigma_is_refused() -> None:
    own_median = sbas.evaluate(synthetic_recording(40_000))
    judged = railway_judgement(own_median)
    assert not isinstance(judged, Refusal)
    assert isinstance(judged.as_seen, Refusal)
    assert "lower bound" in judged.as_seen.reason


def test_a_short_record_is_no_verdict() -> None:
    judged = railway_judgement(evaluated("ordinary"))
    assert isinstance(judged, Refusal)


def test_errors_far_beyond_their_levels_are_refused_in_words() -> None:
    recording = synthetic_recording(40_000)
    table: pd.DataFrame = recording.table.assign(hpl_m=recording.table["hpl_m"] / 20)
    judged = railway_judgement(sbas.evaluate(recording.replace(table=table), truth=TRUTH))
    assert not isinstance(judged, Refusal)
    assert isinstance(judged.as_seen, Refusal)
    assert "times what the levels claim" in judged.as_seen.reason
    assert dataclasses.is_dataclass(judged.as_claimed)
