"""The pictures of a tail: drawn where told, misfits and refusals said."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from sbas.estimate import Refusal
from sbas.plots.tail_picture import tail_plot, threshold_stability
from tests.integrity.tails.test_tail_fit import TAU, amplitude, fitted, gauss_markov

FITS = {
    "fits": fitted(gauss_markov(21)),
    "misfits": fitted(gauss_markov(5) * amplitude(5, TAU)),
    "none": Refusal("10 epochs, 0.4 decorrelation times, are too few for a tail"),
}


@pytest.mark.parametrize("draw", [tail_plot, threshold_stability])
@pytest.mark.parametrize("kind", FITS)
def test_draws_on_the_given_axes_and_touches_nothing_else(draw: object, kind: str) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure()
    ax = figure.subplots()
    assert draw(FITS[kind], ax=ax) is ax  # type: ignore[operator]
    assert ax.get_xlabel()
    assert ax.get_ylabel()
    figure.canvas.draw()
    assert draw(FITS[kind]).figure is not figure  # type: ignore[operator]
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures


def test_evidence_and_refusal_are_written() -> None:
    ax = tail_plot(FITS["fits"], level_k=6.18)
    assert any("modelled" in t.get_text() for t in ax.get_legend().get_texts())
    refused = tail_plot(FITS["misfits"])
    labels = [t.get_text() for t in refused.get_legend().get_texts()]
    assert not any("modelled" in text for text in labels)
    assert any("misfits" in t.get_text() for t in refused.texts)
    assert "too few" in tail_plot(FITS["none"]).texts[0].get_text().replace("\n", " ")


def test_the_curve_is_the_fitted_tail() -> None:
    fit = FITS["fits"]
    line = tail_plot(fit).get_lines()[0]
    # Just beyond the threshold 5 % of the epochs, at the level of the fit.
    assert line.get_xdata()[0] == pytest.approx(np.sqrt(2 * fit.threshold))  # type: ignore[union-attr]
    assert line.get_ydata()[0] == pytest.approx(0.05, rel=0.1)
