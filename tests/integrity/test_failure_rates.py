"""The rate verb's figures, its verdicts and its refusals."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.failure_rates import failure_rate
from tests.examples import POINT, quiet, recording


def test_a_quiet_record_demonstrates_its_bound_and_not_a_small_target() -> None:
    r = quiet(36_000)
    result = failure_rate(r, truth=POINT, alert_limit_m=25, target_per_h=1e-7)
    assert isinstance(result.evidence.demonstrated, Estimate)
    # Zero events in 10 h: ln 20 / 10 h.
    assert result.evidence.demonstrated.upper == pytest.approx(np.log(20) / 10, rel=1e-12)
    assert not result.demonstrated
    assert "NOT DEMONSTRATED" in str(result.target)
    assert failure_rate(r, truth=POINT, alert_limit_m=25, target_per_h=0.3).demonstrated
    assert failure_rate(r, truth=POINT, alert_limit_m=25).demonstrated


def test_without_truth_nothing_is_demonstrated() -> None:
    result = failure_rate(quiet(3600), truth=None, alert_limit_m=25, target_per_h=1.0)
    assert isinstance(result.evidence.demonstrated, Refusal)
    assert not result.demonstrated
    assert "refused" in result.to_dict()["demonstrated"]


def test_a_moving_record_without_truth_is_bad_input() -> None:
    n = 600
    moving = recording(np.arange(n) * 10.0, np.zeros(n), np.full(n, 11.0))
    with pytest.raises(InputError, match="no truth") as error:
        failure_rate(moving, truth=None, alert_limit_m=25)
    assert error.value.code == "E01"
    assert "--truth" in error.value.cure


def test_an_unknown_event_is_refused() -> None:
    with pytest.raises(InputError, match="unknown event"):
        failure_rate(quiet(100), truth=POINT, alert_limit_m=25, event="HMI")  # type: ignore[arg-type]
