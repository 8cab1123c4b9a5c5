"""Ranges as rows, and what makes them unfit."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.reasons import Reason
from sbas.positioning.measurements import joined, measurements
from sbas.positioning.orbits import LIGHT_MPS
from sbas.rinex.observations import SystemObservations

WAVE_M = LIGHT_MPS / 1575.42e6


def observed(
    names: tuple[str, ...], code: np.ndarray, seconds: np.ndarray | None = None, **more: np.ndarray
) -> SystemObservations:
    times = np.arange(code.shape[0]) if seconds is None else seconds
    stamps = np.datetime64("2026-01-01", "ns") + (np.asarray(times) * 1e9).astype("m8[ns]")
    return SystemObservations(stamps, names, {"C1C": code, **more}, {}, {})


def test_what_is_no_range_is_no_row() -> None:
    code = np.full((8, 3), 2.2e7)
    code[4, 0], code[5, 0], code[6, 1], code[7, 2] = np.nan, 0.0, -5.0, np.inf
    rows = measurements(observed(("G01", "G02", "G03"), code), smoothing=False)
    assert len(rows) == 24 - 4
    assert np.isfinite(rows.code_m).all()
    assert (rows.code_m > 0).all()
    assert (np.diff(rows.epoch * 10 + rows.satellite) > 0).all()


def test_weak_short_and_jumping_ranges_have_a_reason() -> None:
    code = np.full((12, 1), 2.2e7)
    cn0 = np.full((12, 1), 45.0)
    cn0[3:5], cn0[9] = 32.9, np.nan
    carrier = np.full((12, 1), 2.2e7 / WAVE_M)
    carrier[7:] += 21.0 / WAVE_M
    rows = measurements(observed(("G07",), code, S1C=cn0, L1C=carrier), smoothing=False)
    expected = [Reason.SHORT_ARC] * 2 + [Reason.USED] + [Reason.WEAK_SIGNAL] * 2
    # The weak ones are no part of the arc; 21 m are a slip, which begins another.
    expected += [Reason.USED] * 2 + [Reason.SHORT_ARC] * 2 + [Reason.USED] * 3
    assert rows.reason.tolist() == expected


def test_smoothed_satellites_serve_after_six_minutes() -> None:
    for interval, first in ((1, 361), (30, 13)):
        k = 400 if interval == 1 else 20
        seconds = np.arange(k) * interval
        code = 2.2e7 + np.where(np.arange(k) % 2, 1.0, -1.0)[:, None]
        carrier = np.full((k, 1), 2.2e7 / WAVE_M)
        rows = measurements(observed(("G07",), code, seconds, L1C=carrier), smoothing=True)
        assert np.flatnonzero(rows.reason == 0)[0] == first
        assert np.abs(rows.code_m[first:] - 2.2e7).max() < (0.02 if interval == 1 else 0.5)
        assert np.abs(rows.raw_code_m - code[:, 0]).max() == 0


def test_sbas_satellites_have_slots_of_their_own() -> None:
    rows = measurements(observed(("S20", "S37"), np.full((4, 2), 3.8e7)), smoothing=False)
    assert rows.slot.tolist() == [120, 137]


def test_two_systems_joined_keep_their_epochs() -> None:
    gps = measurements(
        observed(("G01", "G02"), np.full((4, 2), 2.2e7), np.array([0, 1, 2, 4])), smoothing=False
    )
    geo = measurements(
        observed(("S20",), np.full((3, 1), 3.8e7), np.array([1, 3, 4])), smoothing=False
    )
    both = joined(gps, geo)
    assert both.names == ("G01", "G02", "S20")
    assert both.slot.tolist() == [1, 2, 120]
    assert (both.time_ns - both.time_ns[0]).tolist() == [i * 10**9 for i in range(5)]
    pairs = list(zip(both.epoch.tolist(), both.satellite.tolist(), strict=True))
    assert pairs == [
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
        (1, 2),
        (2, 0),
        (2, 1),
        (3, 2),
        (4, 0),
        (4, 1),
        (4, 2),
    ]
    assert both.code_m[both.satellite == 2] == pytest.approx(3.8e7)


def test_some_rows() -> None:
    rows = measurements(observed(("G01", "G02"), np.full((3, 2), 2.2e7)), smoothing=False)
    part = rows.some(rows.satellite == 1)
    assert len(part) == 3
    assert part.names == rows.names
    assert part.time_ns is rows.time_ns


def test_no_epoch_at_all() -> None:
    rows = measurements(observed(("G01",), np.empty((0, 1))), smoothing=True)
    assert len(rows) == 0
