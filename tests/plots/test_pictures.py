"""All pictures, one test: they draw where they are told and leave no trace elsewhere."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

import sbas.plots
from sbas.estimate import Estimate, Fitted, Refusal
from sbas.integrity.evaluation import evaluate
from sbas.integrity.rate_evidence import EventKind
from sbas.integrity.results import Evaluation
from tests.plots.synthetic import KINDS, TRUTH, evaluated, synthetic_recording

OF_OTHER_RESULTS = {
    "architecture_ladder", "combination_ribbon", "decision_tree", "decorrelation_curve",
    "ground_plan", "importance_bars", "incidence_curve", "k_curve", "level_lines",
    "message_timeline", "pair_strips", "probability_curve", "raim_availability",
    "raim_level_ratios", "raim_levels",
    "range_faults", "sensitivity_bars", "sky", "sojourn_survival", "state_importance_bars",
    "state_ribbon", "tail_plot", "threshold_stability", "tree_picture", "variance_budget",
}  # fmt: skip
"""Drawn from results of their own; tested beside them."""
PICTURES = [name for name in sbas.plots.__all__ if name not in OF_OTHER_RESULTS]


def _draw(name: str, evaluation: Any, figure: Figure | None) -> Any:
    picture = getattr(sbas.plots, name)
    if figure is None:
        return picture(evaluation)
    if name == "strips":
        return picture(evaluation, axes=list(figure.subplots(4)))
    return picture(evaluation, ax=figure.subplots())


def _texts(figure: Figure) -> str:
    return "\n".join(t.get_text() for ax in figure.axes for t in ax.texts)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", PICTURES)
def test_draws_on_the_given_axes_and_touches_nothing_else(name: str, kind: str) -> None:
    from matplotlib import pyplot

    evaluation = evaluated(kind)
    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    before = [np.copy(a) for a in _arrays(evaluation)]
    figure = Figure(figsize=(5, 6))
    drawn = np.atleast_1d(_draw(name, evaluation, figure))
    assert all(ax.figure is figure for ax in drawn)
    assert set(drawn) == set(figure.axes)
    assert all(ax.get_xlabel() or ax.get_ylabel() for ax in drawn)
    figure.canvas.draw()
    own = np.atleast_1d(_draw(name, evaluation, None))
    assert own[0].figure is not figure
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures
    for a, b in zip(before, _arrays(evaluation), strict=True):
        np.testing.assert_array_equal(a, b)


def _arrays(evaluation: Any) -> list[Any]:
    curves = [v for v in vars(evaluation.curves).values() if isinstance(v, np.ndarray)]
    return [*curves, evaluation.strips.low, evaluation.strips.high, evaluation.scatter.counts]


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("strips", "nothing_known", "no protection level in this recording"),
        ("strips", "nothing_known", "no position error in this recording"),
        ("strips", "without_levels", "no HDOP in this recording"),
        ("stanford", "moving_without_truth", "no epoch with both"),
        ("scatter", "moving_without_truth", "no position error"),
        ("survival", "without_levels", "no epoch with both"),
        ("availability_curve", "without_levels", "no protection level"),
        ("rate_curve", "moving_without_truth", "no truth"),
        ("rate_curve", "own_median", "only a lower bound"),
    ],
)
def test_what_cannot_be_drawn_is_said(name: str, kind: str, words: str) -> None:
    figure = Figure()
    _draw(name, evaluated(kind), figure)
    assert words in _texts(figure)


def test_a_spike_of_one_epoch_is_drawn_at_its_height() -> None:
    recording = synthetic_recording(100_000, spikes={56_789: 100.0})
    # Without positions nothing is simulated for a decorrelation time.
    evaluation = evaluate(recording.replace(table=recording.table[["hpl_m", "vpl_m"]]))
    level = sbas.plots.strips(evaluation)[0]
    heights = np.concatenate([line.get_ydata() for line in level.get_lines()])
    assert np.nanmax(heights) == 100.0
    x = level.get_lines()[0].get_xdata()[np.nanargmax(level.get_lines()[0].get_ydata())]
    # The axis is in hours; a bin is 1/1200 of the record.
    assert x * 3600 == pytest.approx(56_789, abs=100_000 / 1200)
    low, high = level.get_ylim()
    assert low < 10 < 100 < high


def test_a_gap_stays_empty() -> None:
    error = sbas.plots.strips(evaluated("ordinary"))[3]
    line = error.get_lines()[0]
    x = np.asarray(line.get_xdata()) * 60
    assert not np.any((x > 1003) & (x < 1097))
    pieces = np.flatnonzero(np.isnan(line.get_ydata()))
    assert np.array_equal(pieces, np.arange(2, x.size, 3))


def test_stanford_writes_the_counts_of_its_alert_limit() -> None:
    evaluation = evaluated("ordinary")
    for limit in (50.0, 20.0):
        regions = evaluation.at(limit).regions
        assert regions is not None
        figure = Figure()
        sbas.plots.stanford(evaluation, alert_limit_m=limit, ax=figure.subplots())
        written = _texts(figure)
        for name, count in (("nominal", "nominal"), ("MI", "mi"), ("HMI", "hmi")):
            assert f"{name}\n{regions[count]:,}" in written.split("counts for")[0]
        assert f"AL {limit:g} m" in written
    with pytest.raises(KeyError):
        sbas.plots.stanford(evaluation, alert_limit_m=33.0)


def test_the_drawn_bound_is_garwoods() -> None:
    """No event in 900 s at 95 %: -ln(0.05) * 3600/900 = 11.983/h, exact mathematics."""
    evaluation = evaluate(synthetic_recording(900), truth=TRUTH)
    ax = sbas.plots.rate_curve(evaluation)
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    bound = lines["demonstrated: HMI, upper bound at 95 %"]
    assert bound.get_ydata()[-1] == pytest.approx(-np.log(0.05) * 4, rel=1e-12)
    assert any(label.startswith("claimed: 1e-07/h") for label in lines)


def _with_modelled(modelled: Callable[[EventKind, float], Estimate | Refusal]) -> Evaluation:
    evaluation = evaluated("ordinary")
    rates = {
        kind: tuple(replace(r, modelled=modelled(kind, r.alert_limit_m)) for r in of_kind)
        for kind, of_kind in evaluation.curves.rates.items()
    }
    return replace(evaluation, curves=replace(evaluation.curves, rates=rates))


def _tail_rate(rate_per_h: float, *, upper: float | None = None) -> Estimate:
    basis = Fitted("exponential tail", {"scale": 1.0}, 5.4)
    confidence = None if upper is None else 0.95
    return Estimate(rate_per_h, None, upper, confidence, "per_h", basis)


def test_modelled_rates_are_drawn_apart_from_demonstrated_ones() -> None:
    def modelled(kind: EventKind, limit: float) -> Estimate | Refusal:
        if kind == "hmi" or limit == 50:
            return Refusal("the tail is not Gaussian")
        return _tail_rate(1e-4 / limit, upper=1e-3 / limit)

    evaluation = _with_modelled(modelled)
    ax = sbas.plots.rate_curve(evaluation)
    plain = sbas.plots.rate_curve(_with_modelled(lambda kind, limit: Refusal("no tail")))
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    (label,) = [name for name in lines if name.startswith("modelled")]
    assert label == "modelled: HPE ≥ AL, rate (dotted: upper bound at 95 %)"
    limits, rates = (np.asarray(a, float) for a in lines[label].get_data())
    assert np.isnan(rates[limits == 50]).tolist() == [True]
    known = limits != 50
    np.testing.assert_allclose(rates[known], 1e-4 / limits[known])
    (bound,) = [
        line for line in ax.get_lines()
        if line.get_label().startswith("_") and np.size(line.get_xdata()) == limits.size
    ]  # fmt: skip
    np.testing.assert_allclose(bound.get_ydata()[known], 1e-3 / limits[known])
    # Neither the axis nor the demonstrated figures change where nothing lies below.
    assert ax.get_ylim() == plain.get_ylim()
    for line in plain.get_lines():
        if str(line.get_label()).startswith("demonstrated"):
            np.testing.assert_array_equal(line.get_ydata(), lines[line.get_label()].get_ydata())


@pytest.mark.parametrize(("rate", "foot"), [(3e-11, 1e-11), (1e-30, 1e-12), (0.0, 1e-12)])
def test_modelled_rates_lower_the_axis_to_1e_12_at_most(rate: float, foot: float) -> None:
    def modelled(kind: EventKind, limit: float) -> Estimate | Refusal:
        return _tail_rate(rate if limit > 30 else 1e-6)

    ax = sbas.plots.rate_curve(_with_modelled(modelled))
    assert ax.get_ylim()[0] == pytest.approx(foot)
    ax.figure.canvas.draw()
    labels = [t.get_text() for t in ax.get_legend().get_texts()]
    assert {"modelled: HMI, rate", "modelled: HPE ≥ AL, rate"} <= set(labels)
    bands = {t.get_text() for t in ax.texts}
    assert {"SIL 1", "SIL 2", "SIL 3", "SIL 4"} <= bands


def test_nothing_is_drawn_of_what_is_modelled_nowhere() -> None:
    ax = sbas.plots.rate_curve(_with_modelled(lambda kind, limit: Refusal("no tail")))
    assert not any(str(line.get_label()).startswith("modelled") for line in ax.get_lines())
    assert not any("no tail" in t.get_text() for t in ax.texts)


def test_the_ellipse_of_95_percent_has_the_rayleigh_factor() -> None:
    """K = sqrt(chi2.isf(0.05, 2)) = 2.447746830681 (exact mathematics, printed tables 2.448)."""
    ax = sbas.plots.scatter(evaluated("ordinary"))
    inner, outer = ax.patches
    assert outer.width / inner.width == pytest.approx(2.447746830681, rel=1e-12)


def test_availability_is_drawn_from_both_ways_to_count_gaps() -> None:
    evaluation = evaluated("ordinary")
    ax = sbas.plots.availability_curve(evaluation)
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    # 100 of 3000 seconds are a gap, and the spike is one more epoch above every limit but 556 m.
    down = lines["asked, gaps count as down"].get_ydata()
    left_out = lines["asked, gaps left out"].get_ydata()
    np.testing.assert_allclose(down, [101 / 3000] * 3, rtol=1e-9)
    np.testing.assert_allclose(left_out, [1 / 2900] * 3, rtol=1e-9)


def test_sbas_loads_without_matplotlib_and_pictures_without_pyplot() -> None:
    code = (
        "import sys, sbas, sbas.integrity.evaluation; assert 'matplotlib' not in sys.modules; "
        "import sbas.plots, sbas.reporting; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
