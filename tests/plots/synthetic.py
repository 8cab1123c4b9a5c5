"""Small recordings with known content for the tests of pictures and report."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from sbas.integrity.evaluation import evaluate
from sbas.integrity.results import Evaluation
from sbas.recording import Recording, RecordingMeta, Source
from sbas.truth import FixedPoint

BEGIN = np.datetime64("2009-09-19T00:00:00", "ns")
TRUTH = FixedPoint(50.03, 15.77, 289.4, frame="ITRF2005 2009.7")
DEGREE_M = 111_200.0


def synthetic_recording(
    epochs: int = 3000, *, spikes: dict[int, float] | None = None, path: str = "roof.sbf"
) -> Recording:
    """Gauss-Markov errors (tau 360 s, sigma 0.7 m), HPL 10 to 12 m, and HPL spikes by row."""
    rng = np.random.default_rng(7)
    step = 0.7 * np.sqrt(1 - np.exp(-2 / 360))
    noise = rng.standard_normal((2, epochs)) * step
    east, north = lfilter([1.0], [1.0, -np.exp(-1 / 360)], noise)
    seconds = np.arange(epochs)
    hpl = 11 + np.sin(seconds / 7000) + rng.normal(0, 0.05, epochs)
    n_sv = (9 + np.round(1.5 * np.sin(seconds / 4000))).astype(np.int16)
    for row, value in (spikes or {}).items():
        hpl[row] = value
    table = pd.DataFrame(
        {
            "lat_deg": TRUTH.lat_deg + north / DEGREE_M,
            "lon_deg": TRUTH.lon_deg + east / (DEGREE_M * np.cos(np.radians(TRUTH.lat_deg))),
            "height_m": TRUTH.height_m + rng.normal(0, 1, epochs),
            "hpl_m": hpl,
            "vpl_m": 1.5 * hpl,
            "hdop": 9.0 / n_sv,
            "n_sv": n_sv,
            "sigma_e_m": np.full(epochs, 0.8),
            "sigma_n_m": np.full(epochs, 1.1),
            "cov_en_m2": np.full(epochs, 0.2),
        },
        index=pd.DatetimeIndex(BEGIN + seconds * np.timedelta64(1, "s"), name="time"),
    )
    source = Source(path, bytes=epochs * 100, sha256="ab" * 32, format="sbf", reader_version="1")
    return Recording(table, RecordingMeta(sources=(source,), receiver="PolaRx3"))


@cache
def evaluated(kind: str) -> Evaluation:
    """An evaluation of a recording of the named kind; the names are in `KINDS`.

    From 1000 epochs on records are simulated for the interval of tau: only "ordinary" has it.
    """
    return KINDS[kind]()


def _ordinary() -> Evaluation:
    recording = synthetic_recording(spikes={1500: 100.0})
    table = recording.table.drop(recording.table.index[1000:1100])
    table = table.assign(lat_deg=table["lat_deg"] + np.where(_rows(table, 300, 330), 3e-4, 0))
    return evaluate(recording.replace(table=table), truth=TRUTH)


def _moving_without_truth() -> Evaluation:
    recording = synthetic_recording(500)
    drift = np.linspace(0, 0.1, len(recording))
    return evaluate(_with(recording, lat_deg=recording.table["lat_deg"] + drift))


def _bare() -> Evaluation:
    """Positions alone: no level, no satellites, no DOP, no sigma."""
    recording = synthetic_recording(500)
    return evaluate(
        recording.replace(table=recording.table[["lat_deg", "lon_deg", "height_m"]]), truth=TRUTH
    )


def _nothing_known() -> Evaluation:
    recording = synthetic_recording(500)
    return evaluate(recording.replace(table=recording.table[[]]), truth=TRUTH)


KINDS = {
    "ordinary": _ordinary,
    "own_median": lambda: evaluate(synthetic_recording(500)),
    "moving_without_truth": _moving_without_truth,
    "without_levels": _bare,
    "nothing_known": _nothing_known,
    "two_epochs": lambda: evaluate(synthetic_recording(2), truth=TRUTH),
}


def _rows(table: pd.DataFrame, first: int, stop: int) -> Any:
    rows = np.arange(len(table))
    return (rows >= first) & (rows < stop)


def _with(recording: Recording, **columns: Any) -> Recording:
    return recording.replace(table=recording.table.assign(**columns))
