"""Recordings with a satellite table, made from given ranges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from sbas.recording import MODES, ProtectionLevelMeta, Recording, RecordingMeta, mode_categories
from sbas.satellite_table import SIDE_TABLE, satellite_table

START = np.datetime64("2024-03-05T10:00:00", "ns")


def recording_of(
    elevation_deg: Any,
    azimuth_deg: Any,
    sigma_m: Any,
    residual_m: Any,
    *,
    names: list[str] | None = None,
    hpl_m: Any = None,
    **columns: Any,
) -> Recording:
    """Epochs of (s, n) ranges, 1 Hz; NaN elevations are satellites that are not there."""
    s, n = np.shape(elevation_deg)
    time = START + np.arange(n) * np.timedelta64(1, "s")
    slot, epoch = np.nonzero(~np.isnan(elevation_deg))
    at = (slot, epoch)
    names = [f"G{i + 1:02d}" for i in range(s)] if names is None else names
    side = satellite_table(
        time[epoch],
        {
            "satellite": pd.Categorical.from_codes(slot, categories=names),
            "elevation_deg": np.asarray(elevation_deg, float)[at],
            "azimuth_deg": np.asarray(azimuth_deg, float)[at],
            "sigma_m": np.broadcast_to(sigma_m, (s, n)).astype(float)[at],
            "residual_m": np.asarray(residual_m, float)[at],
            "used": np.ones(slot.size, bool),
        },
    )
    mode = mode_categories(np.full(n, MODES.index("sbas_npa")))
    table = pd.DataFrame({"mode": mode, **columns}, index=pd.DatetimeIndex(time, name="time"))
    if hpl_m is not None:
        table["hpl_m"] = np.broadcast_to(hpl_m, n).astype(float)
    meta = RecordingMeta(pl=ProtectionLevelMeta("do229", k_h=6.18, k_v=5.33))
    return Recording(table, meta, {SIDE_TABLE: side})


def noisy(seed: int, satellites: int, epochs: int, **more: Any) -> Recording:
    """One sky, noise of the stated sigmas."""
    rng = np.random.default_rng(seed)
    elevation = np.rad2deg(np.arcsin(rng.uniform(0.15, 1, (satellites, 1))))
    azimuth = np.linspace(0, 360, satellites, endpoint=False)[:, None] + rng.uniform(0, 20)
    sigma = rng.uniform(0.8, 3, (satellites, 1))
    shape = (satellites, epochs)
    residual = rng.normal(size=shape) * sigma
    return recording_of(
        np.broadcast_to(elevation, shape), np.broadcast_to(azimuth, shape), sigma, residual, **more
    )
