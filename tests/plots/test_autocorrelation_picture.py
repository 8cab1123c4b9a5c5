"""The picture of the autocorrelation: what it writes, and that it survives every answer."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.signal import lfilter

from sbas.estimate import Refusal
from sbas.integrity.correlation.correlation import decorrelation_of
from sbas.integrity.correlation.decorrelation_results import Decorrelation
from sbas.plots.autocorrelation_picture import decorrelation_curve


def gauss_markov(tau: float, n: int, seed: int) -> np.ndarray:
    rho = math.exp(-1 / tau)
    noise = np.random.default_rng(seed).standard_normal((2, n)) * math.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], noise)


def of(values: np.ndarray) -> Decorrelation:
    return decorrelation_of(values.astype(np.float32), 1.0)


ANSWERS = {
    "one": lambda: of(gauss_markov(50, 20_000, 1)),
    "mixture": lambda: of(gauss_markov(5, 40_000, 2) + gauss_markov(300, 40_000, 3)),
    "short": lambda: of(gauss_markov(400, 1500, 4)),
    "white": lambda: of(np.random.default_rng(5).standard_normal((2, 2000))),
    "refused": lambda: Decorrelation("", Refusal("no positions"), None, None, 0.95),
}


@pytest.fixture(scope="module", params=ANSWERS)
def named(request: pytest.FixtureRequest) -> tuple[str, Decorrelation]:
    return request.param, ANSWERS[request.param]()


def test_draws_on_the_given_axes_and_leaves_no_trace(named: tuple[str, Decorrelation]) -> None:
    from matplotlib import pyplot

    name, result = named
    settings, figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure(figsize=(4, 3.5))
    ax = figure.subplots()
    assert decorrelation_curve(result, ax=ax) is ax
    figure.canvas.draw()
    decorrelation_curve(result).figure.canvas.draw()
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == figures
    written = "\n".join(t.get_text() for t in ax.texts)
    legend = ax.get_legend()
    labels = "\n".join(t.get_text() for t in legend.get_texts()) if legend else ""
    if name == "refused":
        assert "no positions" in written
        return
    assert "360 s" in written
    assert ("one process" in labels) == (name in ("one", "mixture"))
    assert ("two, " in labels) == (name == "mixture")
    assert ("without an upper limit" in labels) == (name == "short" and result.tau_high_s is None)


def test_the_drawn_process_is_the_estimate() -> None:
    result = ANSWERS["one"]()
    ax = decorrelation_curve(result)
    (line,) = [line for line in ax.lines if str(line.get_label()).startswith("one process")]
    lag, r = line.get_data()
    assert r[0] == pytest.approx(1 - result.nugget)
    at = int(np.argmin(np.abs(np.asarray(lag) - result.tau_s.value)))
    expected = (1 - result.nugget) * np.exp(-lag[at] / result.tau_s.value)
    assert r[at] == pytest.approx(expected)
