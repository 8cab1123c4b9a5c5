"""Recordings with one injected event of a known cause, for tests and the benchmark of causes.

A clean laboratory recording is changed as its cause would change it: all columns together, with
noise, soft rises, and harmless changes of single satellites beside them.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd

from sbas.integrity.causes.causes import Causes, ExplainedEvent, explain
from sbas.laboratory import LaboratorySettings, simulate
from sbas.recording import MODES, Recording, mode_categories
from sbas.truth import FixedPoint

KINDS = (
    "satellite_loss", "geometry", "mode_change", "ionosphere_lost", "geo_change",
    "correction_age", "gap", "receiver_restart", "sentinel_or_unit", "place", "local_error",
    "unexplained",
)  # fmt: skip
SETTINGS = LaboratorySettings(hours=1.0, sbas_frames=False)
TRUTH = FixedPoint(SETTINGS.lat_deg, SETTINGS.lon_deg, SETTINGS.height_m, frame="simulated")
DEGREE_M = 111_200.0


@cache
def _clean(mode: str, seed: int) -> Recording:
    settings = LaboratorySettings(
        hours=1.0, sbas_frames=False, mode=mode, seed=seed,
        start=pd.Timestamp("2009-09-19").to_pydatetime() + pd.Timedelta(hours=5 * seed),
    )  # fmt: skip
    return simulate(settings)


def case(kind: str, seed: int) -> tuple[Recording, np.datetime64]:
    """A recording with one event of the kind, and the time at which it was put in."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    mode = "pa" if kind == "ionosphere_lost" or (kind != "mode_change" and seed % 2) else "npa"
    clean = _clean(mode, seed % 4)
    table = clean.table
    n = len(table)
    columns = {name: table[name].to_numpy().copy() for name in table.columns if name != "mode"}
    codes = table["mode"].cat.codes.to_numpy().copy()
    environment = np.full(n, "open", object)
    columns["hpl_m"] *= np.exp(rng.normal(0, 0.01, n))
    columns["correction_age_s"] += rng.uniform(0, 2, n)
    start = int(rng.integers(700, n - 900))
    length = int(np.exp(rng.uniform(np.log(3), np.log(150))))
    rows = slice(start, start + length)
    size = rng.uniform(3.6, 9.0)
    rise = np.full(length, size)
    if rng.random() < 0.3 and length > 12:
        soft = int(rng.integers(2, 6))
        rise[:soft] = np.geomspace(1.3, size, soft)
        rise[-soft:] = np.geomspace(size, 1.3, soft)
    keep = np.ones(n, bool)

    def raise_level(factor: np.ndarray, at: slice = rows) -> None:
        columns["hpl_m"][at] *= factor
        columns["vpl_m"][at] *= factor

    _disturb(columns, codes, keep, rng, start, length, spare_satellites=kind == "geometry")
    if kind == "satellite_loss":
        columns["n_sv"][rows] = np.maximum(columns["n_sv"][rows] - rng.integers(2, 6), 4)
        columns["hdop"][rows] *= rise
        raise_level(rise ** rng.uniform(0.85, 1.25))
    elif kind == "geometry":
        columns["hdop"][rows] *= rise
        raise_level(rise ** rng.uniform(0.85, 1.25))
    elif kind == "mode_change":
        codes[rows] = MODES.index(rng.choice(["standalone", "dgnss", "other"]))
        columns["hdop"][rows] *= rng.uniform(0.95, 1.1)
        raise_level(rise)
    elif kind == "ionosphere_lost":
        codes[rows] = MODES.index("sbas_npa")
        raise_level(rise * 6.18 / 6.0)
    elif kind == "geo_change":
        stop = n if rng.random() < 0.5 else start + length + 60
        columns["geo_prn"][start:stop] = 124
        fading = 1 + (size - 1) * np.exp(-np.arange(length) / max(length, 1))
        raise_level(fading)
        if rng.random() < 0.5:
            columns["correction_age_s"][rows] += rng.uniform(5, 30)
    elif kind == "correction_age":
        age = np.arange(1.0, length + 61)
        whole = slice(start, start + age.size)
        columns["correction_age_s"][whole] = 6 + age
        raise_level(1 + (size - 1) * (age / age[-1]) ** 2, whole)
    elif kind == "gap":
        keep[start - int(rng.integers(3, 120)) : start] = False
        raise_level(1 + (size - 1) * np.exp(-np.arange(length) / max(length / 2, 2)))
    elif kind == "receiver_restart":
        keep[start - int(rng.integers(10, 200)) : start] = False
        full = int(columns["n_sv"][start])
        steps = np.linspace(0, 1, length)
        columns["n_sv"][rows] = np.minimum(4 + ((full - 4) * steps).astype(int), full)
        columns["hdop"][rows] *= 1 + (size - 1) * (1 - steps)
        raise_level(1 + (size - 1) * (1 - steps))
        if rng.random() < 0.5:
            codes[start : start + length // 3] = MODES.index("standalone")
    elif kind == "sentinel_or_unit":
        if rng.random() < 0.5:
            columns["hpl_m"][rows] = rng.choice([655.35, 65535.0, 9999.0, 8000.0])
        else:
            raise_level(np.full(length, rng.choice([100.0, 1000.0])))
    elif kind == "place":
        environment[rows] = "cutting"
        raise_level(rise)
    elif kind == "local_error":
        ratio = rng.uniform(0.85, 0.95) if rng.random() < 0.3 else rng.uniform(1.2, 3.0)
        bearing = rng.uniform(0, 2 * np.pi)
        # The slow error of the recording stays under the injected one.
        metres = ratio * columns["hpl_m"][rows]
        east = metres * np.sin(bearing)
        north = metres * np.cos(bearing)
        columns["lat_deg"][rows] = TRUTH.lat_deg + north / DEGREE_M
        columns["lon_deg"][rows] = TRUTH.lon_deg + east / (
            DEGREE_M * np.cos(np.radians(TRUTH.lat_deg))
        )
    else:
        raise_level(rise)
    labels = pd.Categorical(environment)
    changed = pd.DataFrame(columns, index=table.index).assign(
        mode=mode_categories(codes), environment=labels
    )
    return clean.replace(table=changed[keep]), clean.time[start]


def _disturb(
    columns: dict[str, np.ndarray],
    codes: np.ndarray,
    keep: np.ndarray,
    rng: np.random.Generator,
    start: int,
    length: int,
    *,
    spare_satellites: bool,
) -> None:
    """What has nothing to do with the event, or little, and must not be taken for its cause."""
    if rng.random() < 0.3 and not spare_satellites:
        # One satellite lost just then, with what it costs.
        rows = slice(start, start + length + 20)
        lost = columns["n_sv"][rows] > 4
        worse = np.where(lost, rng.uniform(1.02, 1.2), 1.0)
        columns["n_sv"][rows] -= lost.astype(np.int16)
        for name in ("hdop", "hpl_m", "vpl_m"):
            columns[name][rows] *= worse
    if rng.random() < 0.3:
        columns["n_sv"][start + length // 2 : start + length // 2 + 40] += 1
    if rng.random() < 0.2:
        keep[start] = False
    if rng.random() < 0.3:
        # Another event, of another cause, some minutes away.
        away = start + length + int(rng.integers(150, 250))
        codes[away : away + 8] = MODES.index("standalone")
        columns["hpl_m"][away : away + 8] *= 2
    if rng.random() < 0.3:
        away = start - int(rng.integers(20, 250))
        keep[away - 5 : away] = False
    if rng.random() < 0.3:
        columns["geo_prn"][: start - int(rng.integers(30, 250))] = 126


def explained(kind: str, seed: int) -> ExplainedEvent | None:
    """The event that was put in, as `explain` finds it: the largest one near its time."""
    recording, start = case(kind, seed)
    causes: Causes = explain(recording, truth=TRUTH)
    near = [
        event
        for event in causes.events
        if abs(event.start_ns - int(start.astype("M8[ns]").astype(np.int64))) <= 250e9
    ]
    return max(near, key=lambda event: event.ratio, default=None)
