"""Pictures of RAIM: they draw what was found, where they are told, and leave no trace."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import sbas.plots
from sbas.monitoring.level_comparison import LevelComparison, raim_against_sbas
from sbas.monitoring.range_faults import InjectedFaults, injected_faults
from sbas.recording import Flag, Recording
from tests.monitoring.recordings import START, noisy, recording_of

NAMES = ("raim_levels", "raim_level_ratios", "raim_availability")


def shrinking() -> Recording:
    """40 epochs, 1 Hz: four satellites in the first ten, five in the next, then seven; the last
    five without HPL."""
    full = noisy(4, 7, 40)
    side = full.side_tables["satellites"]
    elevation, azimuth, sigma, residual = (
        side[name].to_numpy().reshape(7, 40)
        for name in ("elevation_deg", "azimuth_deg", "sigma_m", "residual_m")
    )
    elevation = elevation.copy()
    elevation[4:, :10] = np.nan
    elevation[5:, 10:20] = np.nan
    hpl = np.where(np.arange(40) < 35, 15.0, np.nan)
    return recording_of(elevation, azimuth, sigma, residual, hpl_m=hpl, hdop=np.full(40, 1.5))


def growing() -> Recording:
    """20 epochs with 4 to 23 satellites."""
    side = noisy(3, 23, 20).side_tables["satellites"]
    elevation, azimuth, sigma, residual = (
        side[name].to_numpy().reshape(23, 20)
        for name in ("elevation_deg", "azimuth_deg", "sigma_m", "residual_m")
    )
    up = np.where(np.arange(23)[:, None] < np.arange(4, 24), elevation, np.nan)
    return recording_of(up, azimuth, sigma, residual, hpl_m=10.0)


def receivers_own() -> Recording:
    time = START + np.arange(3) * np.timedelta64(1, "s")
    flags = [Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_NOT_AVAILABLE]
    table = pd.DataFrame(
        {"flags": np.array(flags, "u4"), "herl_m": [5.0, 6.0, -2e10], "verl_m": 7.0, "hpl_m": 4.0},
        index=pd.DatetimeIndex(time, name="time"),
    )
    return Recording(table)


def hidden() -> Recording:
    """Four epochs, at the last two a satellite alone holds the east: its fault would not show."""
    azimuth = np.repeat([[0.0], [0.0], [180.0], [180.0], [90.0], [270.0]], 4, 1)
    elevation = np.repeat([[20.0], [60.0], [20.0], [60.0], [10.0], [15.0]], 4, 1)
    elevation[5, 2:] = np.nan
    return recording_of(elevation, azimuth, 1.0, np.zeros((6, 4)), hpl_m=15.0)


def unknown() -> Recording:
    """Ten epochs with eight ranges, one of them without azimuth at the first two."""
    recording = noisy(1, 8, 10, hpl_m=12.0)
    side = recording.side_tables["satellites"].copy()
    rows = (side["satellite"] == "G02") & (side["time"] < recording.time[2])
    side.loc[rows, "azimuth_deg"] = np.nan
    return recording.replace(side_tables={"satellites": side})


def recordings() -> dict[str, Recording]:
    usual = shrinking()
    first = noisy(1, 8, 1, hpl_m=10.0)
    side = {name: table.iloc[:0] for name, table in first.side_tables.items()}
    return {
        "usual": usual,
        "one epoch": first,
        "no epoch": first.replace(table=first.table.iloc[:0], side_tables=side),
        "no level": noisy(1, 4, 5, hpl_m=np.nan),
        "equal times": usual.replace(table=usual.table.set_axis(usual.table.index[[7] * 40])),
        "many numbers of satellites": growing(),
        "the receiver's own": receivers_own(),
        "levels of 0 and infinity": noisy(1, 8, 4, hpl_m=[0.0, -1.0, np.inf, 12.0]),
        "no level above 0": noisy(1, 8, 4, hpl_m=[0.0, -1.0, np.inf, np.inf]),
        "a fault that would not show": hidden(),
        "ranges not known": unknown(),
    }


def compared(kind: str) -> LevelComparison:
    given = recordings()[kind]
    return raim_against_sbas(given, risk=None if "herl_m" in given.columns else 5e-9)


def drawn(name: str, result: Any, figure: Figure | None) -> Any:
    picture = getattr(sbas.plots, name)
    if figure is None:
        return picture(result)
    if name == "raim_levels":
        return picture(result, axes=list(figure.subplots(2)))
    return picture(result, ax=figure.subplots())


def leaves_no_trace(name: str, result: Any, tables: list[pd.DataFrame]) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    before = [table.copy() for table in tables]
    figure = Figure(figsize=(7, 5))
    axes = np.atleast_1d(drawn(name, result, figure))
    assert set(axes) == set(figure.axes)
    assert all(ax.get_ylabel() for ax in axes)
    figure.canvas.draw()
    own = np.atleast_1d(drawn(name, result, None))[0].figure
    assert own is not figure
    own.canvas.draw()
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures
    for a, b in zip(before, tables, strict=True):
        pd.testing.assert_frame_equal(a, b)


@pytest.mark.parametrize("kind", list(recordings()))
@pytest.mark.parametrize("name", NAMES)
def test_draws_on_the_given_axes_and_touches_nothing_else(name: str, kind: str) -> None:
    result = compared(kind)
    leaves_no_trace(name, result, [result.levels, result.by_satellites])


def words(*axes: Any) -> str:
    return "\n".join(t.get_text() for ax in axes for t in ax.texts)


def legend(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_levels_are_drawn_and_what_is_not_available_is_a_gap_with_a_bar() -> None:
    result = compared("usual")
    upper, lower = sbas.plots.raim_levels(result)
    lines = {str(line.get_label()).split(":")[0].split(",")[0]: line for line in upper.get_lines()}
    heights = np.asarray(lines["HERL"].get_ydata())[::3]
    # An epoch is a stroke of its own: begin, end, NaN.
    np.testing.assert_allclose(heights, result.levels["herl_m"].to_numpy()[10:])
    x = np.asarray(lines["HERL"].get_xdata())
    middle = (x[::3] + x[1::3]) / 2
    np.testing.assert_allclose(middle, np.arange(10, 40), atol=1e-6)
    assert np.size(lines["HPL of SBAS"].get_xdata()) == 3 * 35
    bars = [path.vertices[:, 0] for c in upper.collections for path in c.get_paths()]
    assert min(v.min() for v in bars) == pytest.approx(-0.5, abs=1e-6)
    assert max(v.max() for v in bars) == pytest.approx(9.5, abs=1e-6)
    assert "HERL is not a bound" in words(upper)
    assert "not available (10 epochs)" in words(upper)
    assert any("alpha=0.0001, beta=0.0001" in text for text in legend(upper))
    np.testing.assert_allclose(lower.get_lines()[0].get_ydata()[::3], 1.5)


def test_a_receivers_own_probabilities_are_not_made_up() -> None:
    upper, _ = sbas.plots.raim_levels(compared("the receiver's own"))
    assert any("beta not stated: 1 of 3 epochs" in text for text in legend(upper))
    ax = sbas.plots.raim_availability(compared("the receiver's own"))
    assert [t.get_text().split() for t in ax.get_xticklabels()] == [["unknown", "3"], ["all", "3"]]
    assert legend(ax) == ["RAIM available: 1"]


def test_ratios_end_at_one_and_are_counted() -> None:
    result = compared("usual")
    ax = sbas.plots.raim_level_ratios(result)
    for name, label in (("herl_m", "HERL"), ("like_hpl_m", "solution separation")):
        ratio = result.ratio(name)
        assert ratio.size == 25
        line = next(x for x in ax.get_lines() if label in str(x.get_label()))
        # The share at or below each ratio, counted; of equal ones the last step counts.
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        assert y[-1] == 1
        assert x[-1] == pytest.approx(ratio.max())
        last = np.append(np.diff(x) > 0, True)
        shares = [(ratio <= value).mean() for value in x[last]]
        np.testing.assert_allclose(y[last], shares, atol=1e-12)
        assert f"larger at {(ratio > 1).sum()} of 25" in str(line.get_label())
    assert any("own risk 5e-09" in text for text in legend(ax))


def test_bars_are_the_shares_of_each_number_of_satellites() -> None:
    result = compared("usual")
    ax = sbas.plots.raim_availability(result)
    heights = {
        str(c.get_label()).split(":")[0]: [bar.get_height() for bar in c] for c in ax.containers
    }  # fmt: skip
    # 4, 5, 7 satellites, all.
    assert heights["fix, no test"] == [100, 0, 0, 25]
    assert heights["detection only"] == [0, 100, 0, 25]
    assert heights["identification"] == [0, 0, 100, 50]
    assert heights["RAIM available"] == [
        *(100 * result.by_satellites["available"] / result.by_satellites["epochs"]),
        100 * result.raim.available / 40,
    ]
    assert [t.get_text().split() for t in ax.get_xticklabels()] == [
        ["4", "10"], ["5", "10"], ["7", "20"], ["all", "40"],
    ]  # fmt: skip
    assert f"SBAS and RAIM: {result.both[1, 1]}" in words(ax)
    assert f"SBAS alone: {result.both[1, 0]}" in words(ax)


def faults() -> InjectedFaults:
    return injected_faults(noisy(5, 8, 60), trials=60, sizes_m=(1.0, 50.0), rates_mps=(0.5, 5.0))


@pytest.mark.parametrize("kind", ["usual", "one kind", "one trial", "none"])
def test_faults_are_drawn_on_the_given_axes(kind: str) -> None:
    table = {
        "usual": lambda: faults().table,
        "one kind": lambda: faults().table.query("kind == 'ramp'"),
        "one trial": lambda: injected_faults(noisy(5, 8, 3), trials=1).table,
        "none": lambda: faults().table.iloc[:0],
    }[kind]()
    leaves_no_trace("range_faults", table, [table])


def test_the_outcomes_of_each_fault_fill_its_bar() -> None:
    result = faults()
    ax = sbas.plots.range_faults(result)
    heights = {c.get_label(): np.array([bar.get_height() for bar in c]) for c in ax.containers}
    np.testing.assert_allclose(sum(heights.values()), 100)
    order = result.table.iloc[[0, 1, 4, 5, 2, 3]]
    assert order["kind"].tolist() == ["step", "step", "two", "two", "ramp", "ramp"]
    for name, column in (
        ("found, all faults excluded", "excluded_right"), ("missed", "missed"),
        ("one fault excluded, one left in", "excluded_part"),
        ("good range excluded", "excluded_good"), ("no test", "unavailable"),
    ):  # fmt: skip
        np.testing.assert_allclose(heights[name], 100 * order[column] / order["trials"])
    found = heights["found, nothing excluded"] + heights["found, all faults excluded"]
    found += heights["one fault excluded, one left in"] + heights["good range excluded"]
    np.testing.assert_allclose(found, 100 * order["detected"] / order["trials"])
    assert [t.get_text() for t in ax.get_xticklabels()] == ["1", "50", "1", "50", "0.5", "5"]
    for text in ("one step [m]", "two steps at once [m]", "one ramp [m/s]"):
        assert text in words(ax)
    assert f"{order['error_max_m'].iloc[0]:.3g}" in words(ax)


@pytest.mark.parametrize(
    ("name", "kind", "said"),
    [
        ("raim_levels", "no epoch", "no epoch in this recording"),
        ("raim_levels", "no level", "no HERL and no HPL"),
        ("raim_level_ratios", "no level", "no epoch with a level of RAIM"),
        ("raim_availability", "no epoch", "no epoch with a known number"),
    ],
)
def test_what_cannot_be_drawn_is_said(name: str, kind: str, said: str) -> None:
    assert said in words(*np.atleast_1d(drawn(name, compared(kind), None)))


def test_an_infinite_herl_has_a_bar_at_the_head() -> None:
    result = compared("a fault that would not show")
    assert np.isinf(result.levels["herl_m"]).tolist() == [False, False, True, True]
    upper, _ = sbas.plots.raim_levels(result)
    heads = [
        path.vertices for c in upper.collections for path in c.get_paths()
        if path.vertices[:, 1].min() > 0.9
    ]  # fmt: skip
    assert min(v[:, 0].min() for v in heads) == pytest.approx(1.5, abs=1e-6)
    assert any("infinite at 2" in text for text in legend(upper))
    assert "HERL infinite (2)" in words(upper)


def test_ranges_that_are_not_known_are_not_no_satellites() -> None:
    ax = sbas.plots.raim_availability(compared("ranges not known"))
    assert [t.get_text().split() for t in ax.get_xticklabels()] == [
        ["unknown", "2"], ["8", "8"], ["all", "10"],
    ]  # fmt: skip
    assert any(text.startswith("no fix, or not known: 2") for text in legend(ax))


def test_a_receivers_own_raim_counts_by_its_verdict() -> None:
    assert "RAIM (its verdict)" in words(
        sbas.plots.raim_availability(compared("the receiver's own"))
    )
