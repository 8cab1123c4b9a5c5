"""Environments side by side: what is drawn is what was found."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from sbas.estimate import Estimate
from sbas.integrity.evaluation import evaluate
from sbas.integrity.results import Evaluation
from sbas.plots import environment_rates, environment_sizes
from sbas.recording import Recording
from tests.examples import POINT, recording


def rail() -> Recording:
    n = 1200
    error = np.where(np.arange(n) % 10 == 0, 2.0, 0.5)
    error[500:520] = 60.0
    hpl = np.full(n, 11.0)
    labels = ["open"] * 400 + ["urban"] * 400 + ["tunnel"] * 400
    r = recording(error, np.zeros(n), hpl, environment=pd.Categorical(labels))
    return r.replace(table=r.table.assign(lat_deg=r.table["lat_deg"].mask(np.arange(n) >= 800)))


@cache
def evaluated() -> Evaluation:
    return evaluate(rail(), truth=POINT, alert_limits_m=(50.0, 20.0))


def texts(figure: Figure) -> str:
    return "\n".join(t.get_text() for ax in figure.axes for t in ax.texts)


def test_bars_reach_from_the_median_to_the_95_percent_value() -> None:
    found = evaluated()
    ax = environment_sizes(found, ax=Figure().subplots())
    bars = {bar.get_label(): bar for bar in ax.containers}  # type: ignore[attr-defined]
    assert set(bars) == {"HPE", "HPL"}
    drawn = [(p.get_y(), p.get_y() + p.get_height()) for p in bars["HPE"]]
    sizes = [e.hpe_m for e in found.environments.values() if e.hpe_m is not None]
    assert drawn == [pytest.approx((s.median, s.p95)) for s in sizes]
    # The tunnel has levels and no position, so no error.
    assert (len(bars["HPE"]), len(bars["HPL"])) == (2, 3)
    names = [t.get_text() for t in ax.get_xticklabels()]
    assert names == ["open\n6.667 min", "urban\n6.667 min", "tunnel\n6.667 min"]
    assert ax.get_legend().get_texts()[0].get_text() == "AL 50, 20 m"


def test_triangles_are_the_bounds_and_circles_the_counted_rates() -> None:
    found = evaluated()
    ax = environment_rates(found, ax=Figure().subplots())
    triangles = [line for line in ax.lines if line.get_marker() == "v"]
    circles = [line for line in ax.lines if line.get_marker() == "o"]
    for line, limit in zip(triangles, (50.0, 20.0), strict=True):
        bounds = [e.at(limit).rates["hmi"].demonstrated for e in found.environments.values()]
        uppers = [b.upper for b in bounds if isinstance(b, Estimate)]
        assert line.get_ydata().tolist() == uppers  # type: ignore[union-attr]
    counted = found.environments["urban"].at(50.0).rates["hmi"].demonstrated
    assert isinstance(counted, Estimate)
    assert [line.get_ydata().tolist() for line in circles] == [[counted.value]] * 2  # type: ignore[union-attr]
    assert texts(ax.figure) == "not\ndemonstrated"  # type: ignore[arg-type]


def test_what_cannot_be_drawn_is_said() -> None:
    r = rail()
    bare = evaluate(r.replace(table=r.table.drop(columns="environment")), truth=POINT)
    for draw in (environment_sizes, environment_rates):
        assert "no environment labels" in texts(draw(bare).figure)  # type: ignore[arg-type]
    moving = r.replace(table=r.table.assign(lon_deg=r.table["lon_deg"] + np.arange(len(r)) / 1e4))
    assert "no truth" in texts(environment_rates(evaluate(moving)).figure)  # type: ignore[arg-type]
    nothing = r.replace(table=r.table[["environment"]])
    drawn = environment_sizes(evaluate(nothing, truth=POINT))
    assert "no error and no level" in texts(drawn.figure)  # type: ignore[arg-type]


def test_many_and_long_names_stay_readable() -> None:
    labels = [f"station with a long name {i:02d}" for i in range(15)]
    r = rail()
    table = r.table.assign(environment=pd.Categorical(np.repeat(labels, 80)))
    ax = environment_sizes(evaluate(r.replace(table=table), truth=POINT))
    assert [t.get_rotation() for t in ax.get_xticklabels()] == [90.0] * 15
    assert all(len(t.get_text().split("\n")[0]) <= 12 for t in ax.get_xticklabels())
