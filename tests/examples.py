"""Small recordings with known answers, for tests of every layer."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pymap3d

from sbas.recording import MODES, Recording, RecordingMeta, Source, mode_categories
from sbas.truth import FixedPoint

POINT = FixedPoint(50.03, 15.77, 289.4, frame="ITRF2014")


def recording(
    east_m: np.ndarray,
    north_m: np.ndarray,
    hpl_m: np.ndarray,
    *,
    time_s: np.ndarray | None = None,
    mode: str = "sbas_npa",
    **columns: np.ndarray,
) -> Recording:
    """Epochs whose errors from POINT are given, 1 Hz unless times are."""
    n = len(east_m)
    seconds = np.arange(n) if time_s is None else np.asarray(time_s)
    start = np.datetime64("2009-09-19", "ns")
    index = pd.DatetimeIndex(start + (seconds * 1e9).astype("m8[ns]"), name="time")
    lat, lon, height = pymap3d.enu2geodetic(
        np.asarray(east_m, float), np.asarray(north_m, float), np.zeros(n),
        POINT.lat_deg, POINT.lon_deg, POINT.height_m,
    )  # fmt: skip
    table = pd.DataFrame(
        {
            "lat_deg": lat,
            "lon_deg": lon,
            "height_m": height,
            "hpl_m": np.asarray(hpl_m, float),
            "vpl_m": np.asarray(hpl_m, float) * 1.5,
            "hdop": np.full(n, 1.1),
            "n_sv": np.full(n, 9, np.int16),
            "mode": mode_categories(np.full(n, MODES.index(mode))),
            "sigma_e_m": np.full(n, 1.0),
            "sigma_n_m": np.full(n, 1.2),
            "cov_en_m2": np.zeros(n),
            **columns,
        },
        index=index,
    )
    return Recording(table, RecordingMeta(sources=(Source("example", format="example"),)))


def quiet(n: int, seed: int = 1, **columns: np.ndarray) -> Recording:
    """White errors of 0.5 m and an HPL near 11 m: nothing ever happens."""
    rng = np.random.default_rng(seed)
    return recording(
        rng.normal(0, 0.5, n), rng.normal(0, 0.5, n), 11 + rng.normal(0, 0.3, n), **columns
    )
