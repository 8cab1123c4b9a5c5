"""The recordings that gLAB 6.0.0 has solved, read once for all tests."""

from __future__ import annotations

import functools
import gzip
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from sbas.augmentation import SbasMessages, correction_timeline, read_messages
from sbas.augmentation.tables import Mode
from sbas.positioning.measurements import Measurements, measurements
from sbas.positioning.range_budget import BudgetRules
from sbas.positioning.receiver_noise import CLASS_2
from sbas.positioning.software_receiver import Fixes, solve_fixes
from sbas.rinex.ephemerides import Navigation
from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observation_file import read_observations
from sbas.rinex.observations import SystemObservations
from sbas.timescales import GPS_EPOCH_NS

KAMAKURA_M = (-3962069.5578, 3381374.5698, 3668677.1522)
STANFORD_M = (-2700391.2521, -4292592.9138, 3855154.7321)


@dataclass(frozen=True)
class Case:
    """Files below `data` and `reference/glab`."""

    observations: str
    navigation: tuple[str, ...]
    messages: str
    geo: int
    place_m: tuple[float, float, float] | None


_KAMAKURA = Case(
    "msas_kamakura_2025046/kamakura_synthetic_ranges.obs.gz",
    ("msas_kamakura_2025046/gps_lnav_12-15h_rinex3.nav",),
    "msas_kamakura_2025046/msas137_2025046.ems",
    137,
    KAMAKURA_M,
)
_STANFORD = Case(
    "waas_2020001/stanford_synthetic_ranges.obs.gz",
    ("waas_2020001/gps_nav_consolidated.nav",),
    "waas_2020001/waas131_2020001.ems",
    131,
    STANFORD_M,
)
_VEHICLE = Case(
    "msas_vehicle_2008147/cres_20080526.obs",
    ("msas_vehicle_2008147/cres_20080526.nav", "msas_vehicle_2008147/all.nav"),
    "msas_vehicle_2008147/msas_129.ems",
    129,
    None,
)
CASES = {"kamakura": _KAMAKURA, "stanford": _STANFORD, "vehicle": _VEHICLE}
SOLUTIONS = (
    ("kamakura", "pa", "glab_msas_kamakura_PA"),
    ("kamakura", "npa", "glab_msas_kamakura_NPA"),
    ("stanford", "pa", "glab_waas_stanford_PA"),
    ("vehicle", "pa", "glab_vehicle_cres_129_PA"),
    ("vehicle", "npa", "glab_vehicle_cres_129_NPA"),
)
"""Case, mode and gLAB's output."""


@functools.cache
def inputs(folder: Path, name: str) -> tuple[SystemObservations, Navigation, SbasMessages]:
    """GPS observations, navigation and messages of a case."""
    case, data = CASES[name], folder / "data"
    observed = read_observations(data / case.observations, systems="G", codes=("C1C", "L1C", "S1C"))
    navigation = read_navigation([data / path for path in case.navigation])
    return observed.systems["G"], navigation, read_messages(data / case.messages, prn=case.geo)


def between(observed: SystemObservations, first: int, last: int) -> SystemObservations:
    """Some of the epochs, by number."""
    rows = slice(first, last)
    return replace(
        observed,
        time=observed.time[rows],
        values={code: array[rows] for code, array in observed.values.items()},
        loss_of_lock={code: array[rows] for code, array in observed.loss_of_lock.items()},
        strength={code: array[rows] for code, array in observed.strength.items()},
    )


def rules(
    mode: Mode = "pa", navigation: Navigation | None = None, **changes: object
) -> BudgetRules:
    """gLAB's rules, with changes."""
    klobuchar = (navigation and navigation.klobuchar) or ((0.0,) * 4, (0.0,) * 4)
    base = BudgetRules(mode, "glab", 5.0, CLASS_2, klobuchar, 60.0)
    return replace(base, **changes)  # type: ignore[arg-type]


def solved(
    ranges: Measurements,
    messages: SbasMessages,
    navigation: Navigation,
    budget_rules: BudgetRules,
    place_m: tuple[float, float, float] | None,
    *,
    causal: bool = False,
) -> Fixes:
    """Fixes of ranges."""
    return solve_fixes(
        ranges,
        correction_timeline(messages),
        navigation.gps,
        budget_rules,
        place_m=None if place_m is None else np.array(place_m),
        approximate_m=None,
        causal=causal,
    )


@functools.cache
def case_fixes(folder: Path, name: str, mode: Mode) -> Fixes:
    """All epochs of a case as gLAB solved them."""
    observed, navigation, messages = inputs(folder, name)
    return solved(
        measurements(observed, smoothing=False), messages, navigation,
        rules(mode, navigation), CASES[name].place_m,
    )  # fmt: skip


def seconds_of_day(fixes: Fixes) -> np.ndarray:
    """(n,) seconds of the day of epochs."""
    seconds: np.ndarray = fixes.measured.time_ns / 1e9 % 86400
    return seconds


def gps_second(text: str) -> int:
    """Seconds since 1980-01-06 of a GPS time."""
    return int(np.datetime64(text, "ns").astype(np.int64) - GPS_EPOCH_NS) // 10**9


@functools.cache
def glab_solutions(folder: Path, output: str) -> pd.DataFrame:
    """HPL, VPL, satellites and position of each epoch that gLAB solved, by GPS second.

    Written from `glab_messages.txt`: it shares nothing with the package's own reader.
    """
    levels: dict[float, tuple[object, ...]] = {}
    places: dict[float, tuple[float, ...]] = {}
    with gzip.open(folder / "reference" / "glab" / f"{output}.out.gz", "rt") as lines:
        for line in lines:
            f = line.split()
            if f[0] == "SBASOUT":
                used = " ".join(sorted(name[1:] for name in f[24:] if name[0] == "+"))
                second = int(f[5]) * 604800 + float(f[6])
                levels[float(f[3])] = (second, float(f[15]), float(f[18]), used)
            elif f[0] == "OUTPUT":
                places[float(f[3])] = tuple(float(value) for value in f[11:14])
    names = ["second", "hpl_m", "vpl_m", "used", "x_m", "y_m", "z_m"]
    rows = [(*values, *places[of_day]) for of_day, values in levels.items()]
    return pd.DataFrame(rows, columns=names).set_index("second")


def used_sets(fixes: Fixes) -> list[str]:
    """Names of the satellites used at each epoch, as in `glab_solutions`."""
    sets: list[list[str]] = [[] for _ in range(fixes.solved.size)]
    m = fixes.measured
    for epoch, satellite in zip(m.epoch[fixes.used], m.satellite[fixes.used], strict=True):
        sets[epoch].append(m.names[satellite])
    return [" ".join(sorted(names)) for names in sets]
