"""Verdicts on 360 s, in words, from an interval."""

from __future__ import annotations

import pytest

from sbas.estimate import Estimate, Fitted, Refusal
from sbas.integrity.correlation.decorrelation_results import Decorrelation, Misfit

FITTED = Fitted("Gauss-Markov process", {}, 0.0)


def answer(low: float | None, high: float | None, misfit: Misfit = "gm1") -> Decorrelation:
    tau: Estimate | Refusal = Refusal("too short")
    if misfit != "record_too_short" and low is not None:
        tau = Estimate(1.1 * low, low, high, 0.95, "s", FITTED, sided="two")
    return Decorrelation("", tau, low, high, 0.95, misfit=misfit)


@pytest.mark.parametrize(
    ("low", "high", "misfit", "verdict", "words"),
    [
        (330.0, 400.0, "gm1", "confirmed", "360 s is confirmed: tau lies from 330 s to 400 s"),
        (200.0, 700.0, "gm1", "cannot_be_told", "too short to confirm or reject 360 s"),
        (361.0, 2000.0, "gm1", "longer", "correlated longer than 360 s"),
        (361.0, None, "record_too_short", "longer", "without an upper limit at 95 %, though"),
        (100.0, 359.0, "smooth", "shorter", "correlated shorter than 360 s"),
        (90.0, None, "record_too_short", "cannot_be_told", "too short to confirm or reject"),
        (330.0, 400.0, "record_too_short", "cannot_be_told", "too short to confirm or reject"),
        (500.0, 900.0, "mixture", "cannot_be_told", "one time constant does not describe"),
        (None, None, "mostly_white", "cannot_be_told", "cannot be told"),
    ],
)
def test_verdicts(
    low: float | None, high: float | None, misfit: Misfit, verdict: str, words: str
) -> None:
    result = answer(low, high, misfit)
    assert result.verdict_on_360_s == verdict
    assert words in result.verdict_text
