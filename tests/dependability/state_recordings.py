"""Recordings whose receiver states are known, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.recording import MODES, Flag, Recording, mode_categories
from sbas.truth import FixedPoint

TRUTH = FixedPoint(50.0, 15.0, 300.0, frame="ITRF2014 2026.0")
BEGIN = np.datetime64("2026-01-01T00:00:00", "ns")
FAR_DEG = 1e-3
"""111 m north of the truth."""


def state_recording(
    states: str | Sequence[int] | NDArray[Any],
    *,
    labels: Sequence[str | None] | None = None,
    seconds: Sequence[float] | NDArray[Any] | None = None,
    **columns: Any,
) -> Recording:
    """1 correct, 2 wrong (111 m off), 3 no fix, 4 hardware fault, 5 lost by the logger, 6 mode
    none although there is a position; one epoch a second unless `seconds` says else."""
    code = np.array([int(c) for c in states])
    if seconds is None:
        seconds = np.arange(code.size)
    lat = np.where(code == 2, TRUTH.lat_deg + FAR_DEG, TRUTH.lat_deg)
    lat[np.isin(code, (3, 4, 5))] = np.nan
    incomplete = np.uint32(Flag.EPOCH_INCOMPLETE)
    table: dict[str, Any] = {
        "lat_deg": lat,
        "lon_deg": np.where(np.isnan(lat), np.nan, TRUTH.lon_deg),
        "height_m": TRUTH.height_m,
        "hardware_fault": code == 4,
        "flags": np.where(code == 5, incomplete, np.uint32(0)),
        "mode": mode_categories(np.where(code == 6, MODES.index("none"), -1)),
    }
    if labels is not None:
        table["environment"] = pd.Categorical(labels)
    time = BEGIN + np.round(np.asarray(seconds, float) * 1e9).astype("m8[ns]")
    index = pd.DatetimeIndex(time, name="time")
    return Recording(pd.DataFrame({**table, **columns}, index=index))


def chain_states(rows: Any, epochs: int, seed: int) -> NDArray[np.int64]:
    """(epochs,) states 1..3 drawn from a chain that starts in state 1."""
    limits = np.cumsum(np.asarray(rows, float), axis=1).tolist()
    state, found = 0, []
    for u in np.random.default_rng(seed).random(epochs).tolist():
        found.append(state + 1)
        law = limits[state]
        state = 0 if u < law[0] else 1 if u < law[1] else 2
    return np.array(found)
