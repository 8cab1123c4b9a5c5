"""Priors and budgets: what is possible, and how axes share them."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_settings import AraimSettings, by_constellation

AXES = ("east", "north", "up", "along", "across")


def test_defaults_are_those_of_appendix_d() -> None:
    s = AraimSettings()
    assert (s.phmi_v, s.phmi_h, s.pfa_v, s.pfa_h) == (9.8e-8, 2e-9, 3.9e-6, 9e-8)
    assert (s.p_satellite, s.p_constellation, s.p_thres, s.p_emt) == (1e-5, 1e-4, 8e-8, 1e-5)


def test_shares_of_the_axes() -> None:
    along, split = AraimSettings(), AraimSettings(axis_budget="split")
    assert along.risk_shares(AXES) == pytest.approx([1e-9, 1e-9, 9.8e-8, 2e-9, 2e-9], rel=1e-15)
    assert split.risk_shares(AXES) == pytest.approx([1e-9, 1e-9, 9.8e-8, 1e-9, 1e-9], rel=1e-15)
    tails = [2.25e-8, 2.25e-8, 1.95e-6, 4.5e-8, 4.5e-8]
    assert along.alarm_tails(AXES) == pytest.approx(tails, rel=1e-15)
    assert split.alarm_tails(AXES)[3:] == pytest.approx([2.25e-8, 2.25e-8], rel=1e-15)


@pytest.mark.parametrize(
    "wrong",
    [
        {"p_satellite": 1.0},
        {"p_satellite": {"G": -1e-9}},
        {"p_constellation": math.nan},
        {"phmi_v": 1.0},
        {"phmi_v": 0.0, "phmi_h": 0.0},
        {"phmi_v": 0.6, "phmi_h": 0.6},
        {"pfa_v": 0.0},
        {"pfa_h": 1.0},
        {"p_thres": 0.0},
        {"p_emt": math.inf},
        {"most_faults": 0},
        {"most_faults": 1.5},
        {"most_faults": True},
        {"axis_budget": "across"},
    ],
    ids=str,
)
def test_impossible_settings_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong)).split("_")[0]):
        AraimSettings(**wrong)


PROBABILITIES = ("p_satellite", "p_constellation", "phmi_v", "phmi_h", "pfa_v", "pfa_h", "p_thres",
                 "p_emt")  # fmt: skip


@pytest.mark.parametrize("name", PROBABILITIES)
@pytest.mark.parametrize("value", ["a", None, [1e-5], True, {"G": "a"}], ids=str)
def test_what_is_no_number_is_refused(name: str, value: Any) -> None:
    with pytest.raises(InputError, match=name):
        AraimSettings(**{name: value})


def test_sbas_satellites_have_no_priors_of_their_own() -> None:
    with pytest.raises(InputError, match="priors of GPS"):
        AraimSettings(p_satellite={"G": 1e-5, "S": 1e-3})


def test_values_by_constellation() -> None:
    assert by_constellation("x", 0.5, ("G", "E")).tolist() == [0.5, 0.5]
    assert by_constellation("x", {"E": 1, "G": 2, "R": 3}, ("G", "E")).tolist() == [2.0, 1.0]
    with pytest.raises(InputError, match="no x for constellation E"):
        by_constellation("x", {"G": 2.0}, ("G", "E"))
