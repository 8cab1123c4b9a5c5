"""Level, test and reason of an epoch are three things."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels
from sbas.monitoring.araim_result import UNMONITORED, AraimResult, reason_words
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.verdicts import MonitorReason
from tests.monitoring.araim_reference import appendix_d


def three_epochs(residual_m: np.ndarray | None, **options: float) -> AraimResult:
    """Appendix D three times."""
    example = appendix_d()
    wide = {k: v if k == "constellation" else np.tile(v, (3, 1)) for k, v in example.items()}
    settings = AraimSettings(**options)  # type: ignore[arg-type]
    return araim_levels(AraimGeometry(**wide), residual_m=residual_m, settings=settings)


def test_a_level_without_a_test_is_not_available() -> None:
    r = three_epochs(None)
    assert r.has_level.all()
    assert not r.tested.any()
    assert not r.available.any()
    assert all(words.startswith("no test ran") for words in r.reasons)
    plain = r.to_dict()
    assert (plain["available"], plain["with_level"], plain["tested"]) == (0, 3, 0)
    assert plain["levels_over"] == "geometry"
    assert plain["hpl_m"]["median"] == r.hpl_m[0]
    assert "of the geometry: no test" in str(r)
    json.dumps(plain, allow_nan=False)


def test_test_passed_test_failed_and_no_test_are_told_apart() -> None:
    residual = np.zeros((3, 10))
    residual[1, 2] = 500.0
    residual[2] = np.nan
    r = three_epochs(residual)
    assert r.available.tolist() == [True, False, False]
    assert r.detected.tolist() == [False, True, False]
    assert r.tested.tolist() == [True, True, False]
    assert r.reasons[0] == ""
    assert "fault is detected" in r.reasons[1]
    assert r.reasons[2] == MonitorReason.TOO_FEW.words
    plain = r.to_dict()
    assert plain["available"] + sum(plain["reasons"].values()) == 3
    assert plain["levels_over"] == "available"
    assert plain["hpl_m"]["epochs"] == 1
    assert "of the geometry" not in str(r)


def test_without_a_horizontal_budget_the_level_is_infinite_and_says_so() -> None:
    r = three_epochs(np.zeros((3, 10)), phmi_h=0.0, phmi_v=1e-7)
    assert not r.available.any()
    assert set(r.reasons) == {"the horizontal level is infinite"}


def test_a_single_constellation_prints_its_cure() -> None:
    example = {k: v[:5] for k, v in appendix_d().items()}
    r = araim_levels(AraimGeometry(**example), residual_m=np.zeros((1, 5)))
    assert reason_words(UNMONITORED) in str(r)
    assert "--prior-constellation" in str(r)
    assert "second constellation" in str(r)
    assert "--prior-constellation" not in str(three_epochs(None))


@pytest.mark.parametrize("reason", MonitorReason)
def test_every_reason_of_an_epoch_has_words(reason: MonitorReason) -> None:
    assert reason_words(int(reason)) == reason.words
