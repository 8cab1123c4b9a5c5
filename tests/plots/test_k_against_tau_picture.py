"""The picture of K over tau: what it draws, says, and that it survives every answer."""

from __future__ import annotations

from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sbas.estimate import Estimate, Fitted, Refusal
from sbas.integrity.correlation.decorrelation_results import Curve, Decorrelation
from sbas.integrity.correlation.two_processes import TwoProcesses
from sbas.integrity.exposure.k_against_tau import k_against_tau
from sbas.plots.k_against_tau_picture import k_curve

TAUS = [30, 360, 1500, 3600]
HOUR = k_against_tau(5e-8, taus_s=TAUS)
WHITE = k_against_tau(5e-8, taus_s=TAUS, nugget=0.09 / 1.09)
EMPTY = k_against_tau(0.999, exposure_s=100, taus_s=[80, 100])
BASIS = Fitted("Gauss-Markov process", {"nugget": 0.0}, 0.0)
TAU = Estimate(400.0, 340.0, 470.0, 0.95, "s", BASIS, sided="two")
MEASURED = Decorrelation("", TAU, 340.0, 470.0, 0.95, misfit="gm1", step_s=1.0)
PARTS = TwoProcesses(tau_1_s=10, tau_2_s=990, share_1=0.5, share_2=0.5, nugget=0.0, rms=0.01)


def with_white(share: float) -> Decorrelation:
    lag = np.arange(3.0)
    r = np.where(lag == 0, 1.0, (1 - share) * np.exp(-lag / 400))
    return replace(MEASURED, curve=Curve(lag, r, np.array([r, r]), np.empty(0)))


ANSWERS = {
    "measured": MEASURED,
    "open": Decorrelation("", Refusal("too short"), 113.0, None, 0.95, misfit="record_too_short"),
    "refused": Decorrelation("", Refusal("the receiver moved and has no truth"), None, None, 0.95),
    "mixture": replace(MEASURED, misfit="mixture", two_processes=PARTS),
    "white": with_white(0.2),
    "long": replace(MEASURED, tau_s=replace(TAU, value=9e3, upper=2e4), tau_high_s=2e4),
}  # fmt: skip


def written(ax: Axes) -> str:
    return " ".join(" ".join(t.get_text().split()) for t in ax.texts)


def labels(ax: Axes) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def line(ax: Axes, start: str) -> tuple[np.ndarray, np.ndarray]:
    (found,) = [line for line in ax.lines if str(line.get_label()).startswith(start)]
    return np.asarray(found.get_xdata()), np.asarray(found.get_ydata())


@pytest.mark.parametrize("answer", [None, *ANSWERS])
@pytest.mark.parametrize("curves", [HOUR, WHITE, EMPTY], ids=["hour", "white", "empty"])
def test_draws_on_the_given_axes_and_leaves_no_trace(curves: object, answer: str | None) -> None:
    from matplotlib import pyplot

    result = None if answer is None else ANSWERS[answer]
    settings, figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure(figsize=(4, 4.5))
    ax = figure.subplots()
    assert k_curve(curves, decorrelation=result, ax=ax) is ax  # type: ignore[arg-type]
    figure.canvas.draw()
    own = k_curve(curves, decorrelation=result)  # type: ignore[arg-type]
    own.figure.canvas.draw()
    assert own.figure is not figure
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == figures
    low, high = ax.get_xlim()
    assert low < 360 < high
    assert ax.get_ylim()[0] < 6.18 < ax.get_ylim()[1]
    assert ("no K between 1 and 12" in written(ax)) == (curves is EMPTY)


def test_the_curves_are_the_check_values() -> None:
    """Methods page of integrity statistics, sections 2.7 and 9, at tau 360 s."""
    ax = k_curve(WHITE)
    for start, k in (
        ("claimed: T/τ independent samples", 6.1829),
        ("modelled: smooth error (Rice)", 6.4562),
        ("modelled: Gauss-Markov error, sampled at 1 Hz", 6.7236),
        ("modelled: the same with 8.3 % white noise", 6.9629),
    ):
        x, y = line(ax, start)
        assert y[x == 360] == pytest.approx([k], abs=6e-5)
    assert line(ax, "claimed: K = 6.18")[1][0] == 6.18
    assert line(ax, "claimed: τ = 360 s")[0][0] == 360
    assert "white" not in " ".join(labels(k_curve(HOUR)))
    assert ax.get_ylabel() == "K for a risk of 5e-08 in 1 h [1]"


def test_the_measured_time_and_its_interval() -> None:
    ax = k_curve(HOUR, decorrelation=MEASURED)
    assert line(ax, "modelled: τ of this recording, 400 s")[0][0] == 400
    (band,) = ax.patches
    assert (band.get_x(), band.get_x() + band.get_width()) == pytest.approx((340, 470))
    assert "from 340 s to 470 s at 95 %" in labels(ax)[-1]
    assert written(ax) == ""


def test_an_open_interval_runs_to_the_edge_without_a_line() -> None:
    ax = k_curve(HOUR, decorrelation=ANSWERS["open"])
    (band,) = ax.patches
    assert band.get_x() == 113
    assert band.get_x() + band.get_width() == pytest.approx(ax.get_xlim()[1])
    assert "from 113 s without an upper limit" in labels(ax)[-1]
    assert not any("τ of this recording," in label for label in labels(ax))
    assert "too short" in written(ax)


def test_a_time_beyond_the_curves_is_still_seen() -> None:
    ax = k_curve(HOUR, decorrelation=ANSWERS["long"])
    assert ax.get_xlim()[1] > 9e3
    (band,) = ax.patches
    assert band.get_x() + band.get_width() == pytest.approx(ax.get_xlim()[1])
    assert line(ax, "modelled: Gauss-Markov")[0][-1] == 3600


def test_what_cannot_be_read_off_is_said() -> None:
    refused = k_curve(HOUR, decorrelation=ANSWERS["refused"])
    assert "no measured τ: the receiver moved and has no truth" in written(refused)
    assert not refused.patches
    # 1/(0.5/10 + 0.5/990) = 19.8 s.
    mixture = written(k_curve(HOUR, decorrelation=ANSWERS["mixture"]))
    assert "one time constant does not describe it" in mixture
    assert "its short part counts: τ 19.8 s" in mixture
    white = ANSWERS["white"]
    assert "20 % of the variance of this recording is white, in the curves none" in written(
        k_curve(HOUR, decorrelation=white)
    )
    assert "in the curves 8.3 %" in written(k_curve(WHITE, decorrelation=white))
    assert written(k_curve(WHITE, decorrelation=with_white(0.08))) == ""
