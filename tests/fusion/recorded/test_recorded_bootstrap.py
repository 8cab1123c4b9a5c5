"""Sources of recorded errors: windows and blocks as they were, drawn evenly, gaps kept."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Architecture, Odometer, SatelliteReceiver
from sbas.fusion.recorded import recorded_bootstrap
from sbas.fusion.recorded.recorded_bootstrap import RecordedSource, block_bootstrapped, replayed
from sbas.fusion.simulation.sensor_errors import draw_sensors
from tests.fusion.recorded.test_recorded_grid import record


def draw(source: RecordedSource, runs: int, seed: int = 1) -> NDArray[np.float64]:
    return source(np.random.default_rng(seed), runs)


def gauss_markov(epochs: int, tau_s: float, seed: int, sigma_m: float = 1.0) -> Any:
    """Exact AR(1) of unit steps; Gelb, Applied Optimal Estimation, 1974, eq. 3.8-18."""
    rng, f = np.random.default_rng(seed), np.exp(-1 / tau_s)
    noise = rng.standard_normal(epochs) * np.sqrt(1 - f**2)
    noise[0] = rng.standard_normal()
    series = np.empty(epochs)
    state = 0.0
    for i, z in enumerate(noise.tolist()):
        state = f * state + z
        series[i] = state
    return sigma_m * series


# --- replay -----------------------------------------------------------------------------------


def test_a_replay_shows_windows_of_the_record() -> None:
    source = replayed(record(np.arange(50.0)), step_s=1.0, duration_s=8.0)
    errors = draw(source, 500)
    assert errors.shape == (8, 500)
    assert np.all(np.diff(errors, axis=0) == 1.0)
    assert set(errors[0]) == set(np.arange(43.0))


def test_every_begin_is_equally_likely() -> None:
    source = replayed(record(np.arange(20.0)), step_s=1.0, duration_s=10.0)
    begins = draw(source, 110_000)[0]
    counts = np.bincount(begins.astype(int), minlength=11)
    assert counts.size == 11
    # Binomial, five sigma: 10000 +- 5 sqrt(110000 * 1/11 * 10/11).
    assert np.all(np.abs(counts - 10_000) < 5 * np.sqrt(10_000 * 10 / 11))


def test_no_window_crosses_an_interruption_and_outages_stay() -> None:
    seconds = [*range(10), *range(13, 23), *range(200, 220)]
    errors = draw(
        replayed(record(np.array(seconds, float), seconds=seconds), step_s=1.0, duration_s=12.0),
        2000,
    )
    known = np.isfinite(errors)
    offset = errors - np.arange(12)[:, None]
    begin = np.nanmin(offset, axis=0)
    assert np.nanmax(np.abs(offset - begin)) == 0.0, "time runs on through an outage"
    at = begin + np.arange(12)[:, None]
    assert np.array_equal(~known, (at >= 10) & (at <= 12)), "the outage, and nothing else"
    assert set(begin) == {*range(12), *range(200, 209)}


@given(
    st.lists(st.sampled_from([1, 1, 1, 1, 3, 90]), min_size=12, max_size=40),
    st.integers(1, 6),
    st.booleans(),
)
def test_windows_are_stretches_of_any_record(steps: list[int], window: int, blocks: bool) -> None:
    seconds = np.concatenate([[0], np.cumsum([*steps, 1, 1, 1, 1, 1, 1, 1, 1])])
    # The interval is the median step.
    series = np.append(seconds, [seconds[-1] + i for i in range(1, 45)]).astype(float)
    errors = record(series, seconds=series, limit_m=1e9)
    if blocks:
        source = block_bootstrapped(
            errors, step_s=1.0, duration_s=3.0 * window, block_s=window, tau_s=0.0
        )
    else:
        source = replayed(errors, step_s=1.0, duration_s=float(window))
    drawn = draw(source, 50).reshape(-1, window, 50)
    at = np.arange(window)[None, :, None]
    begin = np.nanmax(np.where(np.isfinite(drawn), drawn - at, -np.inf), axis=1, keepdims=True)
    inside = np.isfinite(begin[:, 0])
    assert inside.any()
    expected = np.where(np.isin(begin + at, series), begin + at, np.nan)
    same = (expected == drawn) | (np.isnan(expected) & np.isnan(drawn))
    assert np.all(same.all(axis=1)[inside])
    # A window without any error lies in an outage of 2 s, the only one that is no interruption.
    assert window <= 2 or inside.all()


def test_steps_longer_and_shorter_than_the_interval() -> None:
    errors = record(np.arange(50.0))
    every_second = draw(replayed(errors, step_s=2.0, duration_s=10.0), 50)
    assert every_second.shape == (5, 50)
    assert np.all(np.diff(every_second, axis=0) == 2.0)
    fine = draw(replayed(errors, step_s=0.25, duration_s=3.0), 50)
    assert np.isnan(fine).sum(axis=0).tolist() == [9] * 50
    assert np.all(np.diff(fine[3::4], axis=0) == 1.0), "fixes at 1, 2 and 3 s; nothing between"


def test_three_axes_fall_silent_together() -> None:
    errors = record([1.0, 2.0, np.nan, 4.0, 5.0])
    drawn = draw(replayed(errors, step_s=1.0, duration_s=3.0, axes=3), 40)
    assert drawn.shape == (3, 3, 40)
    assert np.array_equal(np.isnan(drawn[0]), np.isnan(drawn[2]))
    assert np.array_equal(drawn[1], drawn[0] / 2, equal_nan=True)


def test_too_short_a_record_is_refused_in_words() -> None:
    errors = record(np.arange(50.0), seconds=[*range(30), *range(200, 220)])
    with pytest.raises(InputError, match="no stretch is as long as a run") as caught:
        replayed(errors, step_s=1.0, duration_s=31.0)
    assert "a run takes 31 s, the longest stretch 30 s" in caught.value.evidence
    assert "block_bootstrap" in caught.value.cure


def test_few_windows_and_lost_fixes_are_told() -> None:
    values = np.zeros(50)
    values[32:35] = 9.0
    errors = record(values, seconds=[*range(30), *range(200, 220)], limit_m=2.5)
    source = replayed(errors, step_s=1.0, duration_s=25.0)
    text = " ".join(f"{f.message} {f.evidence}" for f in source.findings)
    assert "20 of 50 fixes lie in stretches shorter than 25 s" in text
    assert "3 of them are unacceptable; share of U 0.06 recorded, 0 drawn" in text
    assert "about 1 windows" in text
    assert (source.recorded_u_share, source.drawn_u_share) == (0.06, 0.0)
    assert not replayed(record(np.zeros(400)), step_s=1.0, duration_s=20.0).findings


def test_the_expected_share_of_u_is_the_drawn_one() -> None:
    values = np.where(np.arange(300) % 60 < 7, 9.0, 0.0)
    source = replayed(record(values, limit_m=2.5), step_s=1.0, duration_s=40.0)
    drawn = float(np.mean(draw(source, 40_000) >= 2.5))
    assert source.recorded_u_share == pytest.approx(35 / 300)
    assert drawn == pytest.approx(source.drawn_u_share, abs=5 * 0.06 / np.sqrt(40_000))


# --- blocks -----------------------------------------------------------------------------------


def test_blocks_come_from_one_environment_a_run() -> None:
    labels = ["open"] * 30 + ["town"] * 10 + ["open"] * 20
    values = np.array([1000.0 * (name == "town") for name in labels]) + np.arange(60)
    source = block_bootstrapped(
        record(values, labels=labels), step_s=1.0, duration_s=40.0, block_s=8.0, tau_s=0.0
    )
    errors = draw(source, 601)
    town = errors >= 1000
    assert np.all(town.all(axis=0) | ~town.any(axis=0))
    # Ten of sixty epochs: systematic sampling leaves less than one run of chance.
    assert abs(int(town[0].sum()) - 601 / 6) < 1
    steps = np.diff(errors.reshape(5, 8, -1), axis=1)
    assert np.all(steps == 1.0)
    town_only = block_bootstrapped(
        record(values, labels=labels), step_s=1.0, duration_s=40.0, block_s=8.0, tau_s=0.0,
        environment="town",
    )  # fmt: skip
    assert np.all(draw(town_only, 50) >= 1000)
    one_run = [bool(draw(source, 1, seed)[0, 0] >= 1000) for seed in range(600)]
    assert 60 < sum(one_run) < 140, "a single run has no favourite"


def test_unlabelled_epochs_are_an_environment() -> None:
    labels = ["open"] * 30 + [None] * 30
    source = block_bootstrapped(
        record(np.arange(60.0), labels=labels), step_s=1.0, duration_s=20.0, block_s=5.0, tau_s=0.0
    )
    assert dict(zip(source.labels, source.shares, strict=True)) == {
        "(unlabelled)": 0.5, "open": 0.5,
    }  # fmt: skip
    with pytest.raises(InputError, match="as long as a block") as caught:
        block_bootstrapped(
            record(np.arange(60.0), labels=["open"] * 57 + ["town"] * 3),
            step_s=1.0, duration_s=20.0, block_s=5.0, tau_s=0.0,
        )  # fmt: skip
    assert caught.value.where == "town"
    assert "the longest stretch 3 s" in caught.value.evidence


def test_blocks_keep_the_correlation_that_the_block_length_allows() -> None:
    # Of pairs k apart in blocks of b a share k/b lies in two blocks: expected r(k)(1 - k/b),
    # Kuensch 1989, section 2, up to the record's own sampling error (the same on both sides).
    series = gauss_markov(20_000, 10.0, seed=5)
    series -= series.mean()
    source = block_bootstrapped(
        record(series), step_s=1.0, duration_s=400.0, block_s=40.0, tau_s=10.0
    )
    drawn = draw(source, 2000)
    for lag in (5, 20):
        own = float(np.mean(series[:-lag] * series[lag:]) / np.mean(series**2))
        got = float(np.mean(drawn[:-lag] * drawn[lag:]) / np.mean(drawn**2))
        # Blocks meet 9 times in a run of 400, not 10 times.
        within = 1 - lag * 9 / (400 - lag)
        assert got == pytest.approx(own * within, abs=0.01)


def test_blocks_are_as_long_as_errors_last() -> None:
    values = np.zeros(4000)
    for i in range(100):
        values[40 * i : 40 * i + 1 + i % 20] = 5.0  # U for 1 to 20 s, each 5 times
    errors = record(values, limit_m=2.5)
    by_bursts = block_bootstrapped(errors, step_s=1.0, duration_s=100.0, tau_s=2.0)
    # The 95 % quantile of 1..20, five times each, the longer of two: the 95th (from 0) is 20.
    assert by_bursts.block_cells == 20
    by_tau = block_bootstrapped(errors, step_s=1.0, duration_s=100.0, tau_s=11.5)
    assert by_tau.block_cells == 35
    with pytest.raises(InputError, match="blocks too short") as caught:
        block_bootstrapped(errors, step_s=1.0, duration_s=100.0, tau_s=2.0, block_s=19.0)
    assert "last 20 s or less" in caught.value.evidence
    with pytest.raises(InputError, match="decorrelation time is 0 s or more"):
        block_bootstrapped(errors, step_s=1.0, duration_s=100.0, tau_s=np.nan)
    short = block_bootstrapped(errors, step_s=1.0, duration_s=10.0, tau_s=11.5)
    assert short.block_cells == 10, "a run shorter than a block is a window"


def test_an_unknown_decorrelation_time_is_estimated_or_refused() -> None:
    tau = 20.0
    errors = record(gauss_markov(7200, tau, seed=2))
    found = recorded_bootstrap.block_bootstrapped(errors, step_s=1.0, duration_s=600.0)
    # 7200 s are 360 tau: its estimate scatters by about sqrt(2/360), 7 %; three sigma and bias.
    assert 3 * tau * 0.7 < found.block_cells < 3 * tau * 1.4
    with pytest.raises(InputError, match="decorrelation time of the errors is not known") as caught:
        block_bootstrapped(record(gauss_markov(60, tau, seed=2)), step_s=1.0, duration_s=10.0)
    assert "--resampling replay" in caught.value.cure


# --- in the simulation ------------------------------------------------------------------------


def test_a_source_takes_the_place_of_a_sensor() -> None:
    architecture = Architecture("two", (Odometer("odo"), SatelliteReceiver("gps")), duration_s=20)
    source = replayed(record(np.arange(300.0)), step_s=1.0, duration_s=20.0)
    seed = np.random.SeedSequence(4)
    drawn = draw_sensors(architecture, 30, seed, sources={"gps": source})
    own = draw_sensors(architecture, 30, seed)
    assert drawn["gps"].error_m.shape == (1, 20, 30)
    assert np.all(np.diff(drawn["gps"].error_m, axis=1) == 1.0)
    assert np.array_equal(drawn["odo"].error_m, own["odo"].error_m)
    again = draw_sensors(architecture, 30, seed, sources={"gps": source})
    assert np.array_equal(again["gps"].error_m, drawn["gps"].error_m)


def test_plain_values() -> None:
    source = replayed(record(np.arange(50.0)), step_s=1.0, duration_s=8.0)
    plain = json.loads(json.dumps(source.to_dict(), allow_nan=False))
    assert plain["kind"] == "replay"
    assert plain["starts"] == [43]
