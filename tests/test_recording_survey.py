"""Facts of a recording, whichever way it is cut."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.recording_survey import Rows, Tail, epoch_rows, sampling_interval_ns, survey
from tests.examples import POINT, quiet, recording

S = 1_000_000_000


def test_the_facts_of_a_clean_recording_are_right() -> None:
    facts = survey(quiet(600))
    assert (facts.epochs, facts.interval_ns, facts.positions) == (600, S, 600)
    assert facts.static
    assert facts.hours == pytest.approx(600 / 3600)
    lat, lon, height = facts.median_position
    # Medians of 600 white errors of 0.5 m: standard error 0.026 m, so 0.15 m is beyond 5 sigma.
    assert abs(lat - POINT.lat_deg) * 111_000 < 0.15
    assert abs(lon - POINT.lon_deg) * 72_000 < 0.15
    assert height == pytest.approx(POINT.height_m, abs=0.01)


def test_batches_of_any_size_give_the_same_facts(monkeypatch: pytest.MonkeyPatch) -> None:
    time = np.concatenate([np.arange(100), np.arange(150, 300), np.arange(299, 350)])
    r = recording(*(np.sin(time / k) for k in (7, 9)), np.full(time.size, 11.0), time_s=time)
    whole = survey(r)
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 17)
    parts = survey(r)
    for name in ("epochs", "interval_ns", "repeated", "repeated_differing", "backward",
                 "repeated_contradicting", "first_repeated_row", "first_backward_row",
                 "positions"):  # fmt: skip
        assert getattr(parts, name) == getattr(whole, name), name
    assert parts.gaps.row.tolist() == whole.gaps.row.tolist() == [100]
    assert (whole.repeated, whole.first_repeated_row) == (1, 250)
    assert parts.median_position == pytest.approx(whole.median_position, rel=1e-12)


def test_the_interval_is_the_median_step() -> None:
    time = np.cumsum([0, 1, 1, 1, 5, 1, 0.5])
    r = recording(*np.zeros((2, 7)), np.full(7, 11.0), time_s=time)
    assert sampling_interval_ns(r) == S


def test_jittered_stamps_keep_their_interval_and_bounded_memory() -> None:
    rng = np.random.default_rng(4)
    n = 200_000
    time = np.arange(n) + rng.normal(0, 1e-3, n)
    r = recording(np.zeros(n), np.zeros(n), np.full(n, 11.0), time_s=time)
    assert sampling_interval_ns(r) == pytest.approx(S, rel=1e-4)


def test_a_moving_recording_is_not_static() -> None:
    n = 600
    assert not survey(recording(np.arange(n) * 1.0, np.zeros(n), np.full(n, 11.0))).static
    spike = np.zeros(n)
    spike[300:320] = 100.0
    assert survey(recording(spike, np.zeros(n), np.full(n, 11.0))).static


def test_static_does_not_hang_on_the_cut_nor_on_shortness(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 2001
    east = np.zeros(n)
    east[-1] = 35.0
    late_spike = recording(east, np.zeros(n), np.full(n, 11.0))
    for rows in (2000, 400, 7):
        monkeypatch.setattr("sbas.recording.BATCH_ROWS", rows)
        assert survey(late_spike).static
    short = recording(np.arange(59) * 40.0, np.zeros(59), np.full(59, 11.0))
    assert not survey(short).static
    slow = np.arange(60)
    far_apart = recording(slow * 800.0, slow * 0.0, slow * 0 + 11.0, time_s=slow * 10)
    assert not survey(far_apart).static
    r = quiet(200)
    assert not survey(r.replace(table=r.table.assign(speed_mps=20.0))).static


def test_a_watch_sees_every_epoch_once_and_categories_as_codes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 11)
    rows = list(epoch_rows(quiet(50), ("hpl_m", "mode")))
    assert [r.first for r in rows] == [0, 11, 22, 33, 44]
    assert sum(len(r) for r in rows) == 50
    assert {int(code) for r in rows for code in r.values["mode"]} == {3}


@pytest.mark.parametrize("cuts", [(5, 1, 4), (1,) * 10, (10,)])
def test_a_tail_puts_just_the_last_rows_in_front(cuts: tuple[int, ...]) -> None:
    tail, at = Tail(3, ("a",)), 0
    numbers = np.arange(10)
    for size in cuts:
        part = slice(at, at + size)
        joined, old = tail.before(Rows(at, numbers[part], {"a": numbers[part] * 2.0}))
        assert old == min(at, 3)
        assert joined.first == at - old
        assert joined.time_ns.tolist() == list(range(at - old, at + size))
        assert joined.values["a"].tolist() == [2.0 * i for i in range(at - old, at + size)]
        at += size


def test_repeated_epochs_that_differ_complete_or_contradict_each_other() -> None:
    base = quiet(3).table
    level = base["hpl_m"].to_numpy().copy()
    twice = base.iloc[[0, 0, 1, 1, 2, 2]]
    values = level[[0, 0, 1, 1, 2, 2]]
    values[3] = np.nan
    values[5] = 99.0
    facts = survey(quiet(3).replace(table=twice.assign(hpl_m=values)))
    assert (facts.repeated, facts.repeated_differing, facts.repeated_contradicting) == (3, 2, 1)
