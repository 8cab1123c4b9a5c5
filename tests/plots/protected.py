"""Small recordings with satellite tables of known content, as the software receiver makes them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sbas.augmentation.reasons import WORDS, Reason
from sbas.positioning.receiver_settings import ReceiverSettings
from sbas.recording import MODES, Recording, RecordingMeta
from sbas.satellite_table import SIDE_TABLE, satellite_table

BEGIN = np.datetime64("2020-01-01T00:00:00", "ns")
SATELLITES = ("G01", "G02", "G03", "G04", "G05")
ELEVATION_DEG = (85.0, 60.0, 45.0, 30.0, 3.0)
AZIMUTH_DEG = (10.0, 90.0, 180.0, 270.0, 0.0)
SIGMAS_M = {
    "sigma_flt_m": 3.0, "sigma_uire_m": 4.0, "sigma_tropo_m": 0.2, "sigma_air_m": 12.0,
}  # fmt: skip
"""Squares sum to 169.04: the root is 13.0015 m."""


def protected(epochs: int = 20, *, mask_deg: float = 5.0) -> Recording:
    """Five satellites, 1 Hz: G05 below the mask; G04 without ionosphere in the first half; the
    HPL is 10 m, and 40 m in the epoch before the last."""
    rows = epochs * len(SATELLITES)
    epoch = np.repeat(np.arange(epochs), len(SATELLITES))
    number = np.tile(np.arange(len(SATELLITES)), epochs)
    reason = np.full(rows, "", object)
    reason[number == 4] = WORDS[Reason.LOW_ELEVATION]
    reason[(number == 3) & (epoch < epochs // 2)] = WORDS[Reason.IONO_NOT_MONITORED]
    used = reason == ""
    total = float(np.sqrt(sum(value**2 for value in SIGMAS_M.values())))
    columns = {name: np.where(used, value, np.nan) for name, value in SIGMAS_M.items()}
    side = satellite_table(
        BEGIN + epoch * np.timedelta64(1, "s"),
        {
            "satellite": pd.Categorical.from_codes(number, categories=list(SATELLITES)),
            "elevation_deg": np.array(ELEVATION_DEG)[number] + 0.01 * epoch,
            "azimuth_deg": np.array(AZIMUTH_DEG)[number],
            **columns,
            "sigma_m": np.where(used, total, np.nan),
            "used": used,
            "reason": pd.Categorical(np.where(used, None, reason)),
        },
    )
    level = np.full(epochs, 10.0)
    if epochs > 1:
        level[-2] = 40.0
    table = pd.DataFrame(
        {
            "lat_deg": np.full(epochs, 50.0),
            "lon_deg": np.full(epochs, 15.0),
            "height_m": np.full(epochs, 300.0),
            "hpl_m": level,
            "mode": pd.Categorical(["sbas_pa"] * epochs, categories=list(MODES)),
        },
        index=pd.DatetimeIndex(BEGIN + np.arange(epochs) * np.timedelta64(1, "s"), name="time"),
    )
    settings = ReceiverSettings(elevation_mask_deg=mask_deg)
    meta = RecordingMeta(options={"protect": str(settings)})
    return Recording(table, meta, {SIDE_TABLE: side})


def without_satellites(recording: Recording) -> Recording:
    return recording.replace(side_tables={})
