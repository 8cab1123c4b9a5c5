"""A train's journey with its truth, and a receiver standing on a roof: both free of findings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pymap3d

from sbas.input_check import CheckResult, check
from sbas.recording import MODES, Recording, RecordingMeta, Source, mode_categories
from sbas.truth import FixedPoint, Trajectory

TODAY = np.datetime64("2026-03-01")
START = np.datetime64("2025-06-01T08:00:00", "ns")
POINT = FixedPoint(50.03, 15.77, 289.4, frame="ITRF2014")


def slow_noise(rng: np.random.Generator, n: int, tau: float, sigma: float) -> np.ndarray:
    """First-order Gauss-Markov noise, the shape of SBAS errors."""
    rho = np.exp(-1 / tau)
    x = np.empty(n)
    x[0] = rng.normal(0, sigma)
    steps = rng.normal(0, sigma * np.sqrt(1 - rho**2), n)
    for i in range(1, n):
        x[i] = rho * x[i - 1] + steps[i]
    return x


def route(seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """East and north [m] of a line with curves, run with speeds of 0 to 30 m/s and stops."""
    fine = np.arange(0, seconds[-1] + 2.0, 0.1)
    speed = np.clip(20 + 25 * np.sin(2 * np.pi * fine / 600), 0, 30)
    way = np.concatenate([[0], np.cumsum(speed[:-1] * 0.1)])
    heading = 0.6 * np.sin(way / 3000) + 0.3
    east = np.concatenate([[0], np.cumsum(np.sin(heading[:-1]) * np.diff(way))])
    north = np.concatenate([[0], np.cumsum(np.cos(heading[:-1]) * np.diff(way))])
    return np.interp(seconds, fine, east), np.interp(seconds, fine, north)


def receiver(
    east_m: np.ndarray, north_m: np.ndarray, seconds: np.ndarray, seed: int, **columns: Any
) -> Recording:
    """What a receiver writes of a way: slow errors, a level by geometry, HDOP and satellites."""
    n = seconds.size
    rng = np.random.default_rng(seed)
    errors = [slow_noise(rng, n, 120, 0.7) + rng.normal(0, 0.1, n) for _ in range(3)]
    hdop = np.round(1.1 + 0.15 * np.sin(np.arange(n) / 900 + seed), 2)
    hpl = 10 * hdop + slow_noise(rng, n, 30, 0.3) + rng.normal(0, 0.01, n)
    lat, lon, height = pymap3d.enu2geodetic(
        east_m + errors[0], north_m + errors[1], 1.5 * errors[2],
        POINT.lat_deg, POINT.lon_deg, POINT.height_m,
    )  # fmt: skip
    table = pd.DataFrame(
        {
            "lat_deg": lat,
            "lon_deg": lon,
            "height_m": height,
            "hpl_m": hpl,
            "vpl_m": 1.6 * hpl,
            "hdop": hdop,
            "n_sv": (9 + (np.arange(n) // 700) % 3).astype("i2"),
            "mode": mode_categories(np.full(n, MODES.index("sbas_npa"))),
            **columns,
        },
        index=pd.DatetimeIndex(START + (seconds * 1e9).astype("m8[ns]"), name="time"),
    )
    return Recording(table, RecordingMeta(sources=(Source("example", format="example"),)))


def standing(n: int = 1200, seed: int = 1, **columns: Any) -> Recording:
    """A receiver on a roof at `POINT`, 1 Hz."""
    return receiver(np.zeros(n), np.zeros(n), np.arange(n) * 1.0, seed, **columns)


def journey(
    n: int = 1200, seed: int = 1, *, step_s: float = 1.0, truth_step_s: float = 0.5
) -> tuple[Recording, Trajectory]:
    """A train's journey and its reference trajectory, which begins before and ends after."""
    seconds = np.arange(n) * step_s
    moving = receiver(*route(seconds + 60), seconds, seed)
    true_s = np.arange(0, n * step_s + 120, truth_step_s)
    lat, lon, height = pymap3d.enu2geodetic(
        *route(true_s), np.zeros(true_s.size), POINT.lat_deg, POINT.lon_deg, POINT.height_m
    )
    index = pd.DatetimeIndex(START + ((true_s - 60) * 1e9).astype("m8[ns]"), name="time")
    table = pd.DataFrame({"lat_deg": lat, "lon_deg": lon, "height_m": height}, index=index)
    return moving, Trajectory(table, frame="ITRF2014")


def moved(recording: Recording, seconds: float) -> Recording:
    """The same epochs with other times."""
    shift = np.timedelta64(round(seconds * 1e9), "ns")
    return recording.replace(table=recording.table.set_axis(recording.table.index + shift))


def checked(recording: Recording, truth: Any = None) -> CheckResult:
    """The check on a day on which no example lies in the future."""
    return check(recording, truth=truth, today=TODAY)


def said(result: CheckResult) -> list[tuple[str, str]]:
    """Codes and severities."""
    return [(f.code, f.severity) for f in result.findings]
