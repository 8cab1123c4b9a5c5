"""Faults put into the ranges of a recording: what RAIM finds of them, and what it does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from sbas.exceptions import InputError
from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.fault_detection import detect
from sbas.monitoring.levels import external_levels_m
from sbas.monitoring.normal_equations import Bools, Floats, Ints, geometry, ranges
from sbas.monitoring.recorded_ranges import RecordedRanges, Sigma, recorded_ranges
from sbas.monitoring.verdicts import Verdict
from sbas.recording import Recording

FaultKind = Literal["step", "ramp", "two"]
FaultNoise = Literal["recorded", "modelled"]

STEPS_M = (5.0, 10.0, 20.0, 50.0, 100.0)
RAMPS_MPS = (0.1, 0.5, 1.0, 5.0)
CHUNK_EPOCHS = 2048


@dataclass(frozen=True, eq=False, repr=False)
class InjectedFaults:
    """What became of the faults.

    Parameters
    ----------
    table : one row a kind and size: `kind`; `size_m` of a step or of each of two faults, or
        `rate_mps` of a ramp; `trials`; `detected`; of those that passed after an exclusion,
        `excluded_right` (all faulty ranges and nothing else), `excluded_part` (some of the faulty
        ranges and nothing else: a fault stays in the fix) and `excluded_good` (a good range among
        the excluded); `missed` (passed as it was); `unavailable`; `error_median_m` and
        `error_max_m` of horizontal position errors that the faults alone make in fixes that
        passed; `beyond_herl` of them beyond the HERL. Of ramps: `delay_median_s` from the start
        to the detection, and the errors at the epoch before it.
    noise : "recorded" residuals, or "modelled" by the sigmas.
    seed : of the random choices.
    """

    table: pd.DataFrame
    design: MonitorDesign
    noise: FaultNoise
    seed: int

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; figures that do not exist are None."""
        rows = [
            {name: None if pd.isna(value) else value for name, value in row.items()}
            for row in self.table.to_dict("records")
        ]
        return {
            "faults": rows, "noise": self.noise, "seed": self.seed,
            "design": dict(vars(self.design)),
        }  # fmt: skip

    def __repr__(self) -> str:
        return f"Faults in ranges, noise {self.noise}, seed {self.seed}\n{self.table.to_string()}"


def injected_faults(
    recording: Recording,
    *,
    kinds: Sequence[FaultKind] = ("step", "ramp", "two"),
    sizes_m: Sequence[float] = STEPS_M,
    rates_mps: Sequence[float] = RAMPS_MPS,
    trials: int = 2000,
    longest_s: float = 60.0,
    noise: FaultNoise = "recorded",
    seed: int = 1,
    sigma: Sigma = None,
    design: MonitorDesign | None = None,
) -> InjectedFaults:
    """Detection and exclusion of simulated range faults by kind and size.

    Parameters
    ----------
    recording : with ranges of its fixes, see `raim`.
    kinds : "step" a bias of one range at an epoch; "two" biases of the same size and random sign
        on two ranges; "ramp" a bias of one range that grows from 0 until it is found, or for
        `longest_s`.
    sizes_m, rates_mps : biases of steps [m], growth of ramps [m/s].
    trials : random epochs and ranges for each size.
    noise : "recorded" keeps the residuals of the recording; "modelled" draws them by the sigmas,
        where the recording has none or none that is real.
    seed : of the choices; the same seed gives the same table.

    Raises
    ------
    InputError : no epoch with a test, or arguments out of range.
    """
    _check(kinds, (*sizes_m, *rates_mps), trials, longest_s, noise)
    design = MonitorDesign() if design is None else design
    given = recorded_ranges(recording, sigma=sigma)
    if noise == "recorded" and not given.has_residuals:
        raise InputError("the recording has no residuals", cure="noise='modelled'")
    part = _Epochs(given, given.used & (given.reason == 0), np.arange(given.reason.size))
    testable = np.flatnonzero(_testable(part))
    if not testable.size:
        raise InputError(
            "no epoch has a test: faults cannot be found in any",
            evidence=f"{given.reason.size} epochs",
            cure="five satellites or more are needed",
        )
    rng = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    for kind in kinds:
        if kind == "ramp":
            time_s = recording.time.astype("M8[ns]").astype(np.int64) / 1e9
            rows += [
                _ramps(part, testable, time_s, rate, trials, longest_s, noise, rng, design)
                for rate in rates_mps
            ]
        else:
            rows += [
                _steps(part, testable, kind, size, trials, noise, rng, design) for size in sizes_m
            ]
    return InjectedFaults(pd.DataFrame(rows), design, noise, seed)


def _check(
    kinds: Sequence[str], sizes: Sequence[float], trials: int, longest_s: float, noise: str
) -> None:
    unknown = [kind for kind in kinds if kind not in ("step", "ramp", "two")]
    if unknown or noise not in ("recorded", "modelled"):
        raise InputError(
            "no such kind of fault or noise", evidence=f"{', '.join(unknown) or noise}",
            cure="kinds step, ramp, two; noise recorded or modelled",
        )  # fmt: skip
    if not all(0 < size < np.inf for size in sizes) or trials < 1 or not 0 < longest_s < np.inf:
        raise InputError(
            "sizes, rates and the longest time are numbers above 0, and one trial is the least",
            evidence=f"{sizes}, {trials} trials, {longest_s} s",
        )


@dataclass(frozen=True, eq=False)
class _Epochs:
    """Ranges of some epochs: `column` of each in the recorded ones."""

    given: RecordedRanges
    used: Bools
    column: Ints

    def some(self, at: Ints) -> _Epochs:
        return _Epochs(self.given, self.used, self.column[at])

    def arrays(self, cut: slice) -> tuple[Floats, Floats, Floats, Ints, Bools, Floats]:
        g, at = self.given, self.column[cut]
        return (
            g.elevation_deg[:, at], g.azimuth_deg[:, at], g.sigma_m[:, at], g.clock[:, at],
            self.used[:, at], g.residual_m[:, at],
        )  # fmt: skip


def _testable(part: _Epochs) -> Bools:
    found = []
    for low in range(0, part.column.size, CHUNK_EPOCHS):
        e, a, s, c, used, _ = part.arrays(slice(low, low + CHUNK_EPOCHS))
        g = geometry(ranges(e, a, s, clock=c, used=used))
        found.append(g.solved & (g.dof >= 1))
    return np.concatenate([*found, np.zeros(0, bool)])


@dataclass(frozen=True, eq=False)
class _Outcome:
    """(t,) outcomes of trials; `right` where all faulty ranges and nothing else were excluded,
    `good` where a good one was; `error_m` the horizontal error that the faults alone make in the
    fix that stands, `herl_m` its HERL."""

    verdict: Ints
    detected: Bools
    right: Bools
    good: Bools
    error_m: Floats
    herl_m: Floats


def _try(
    part: _Epochs, bias_m: Floats, noise: FaultNoise, rng: np.random.Generator, d: MonitorDesign
) -> _Outcome:
    """Tests of epochs with (s, t) biases added to their ranges."""
    pieces = []
    for low in range(0, part.column.size, CHUNK_EPOCHS):
        cut = slice(low, low + CHUNK_EPOCHS)
        e, a, s, c, used, y = part.arrays(cut)
        if noise == "modelled":
            y = rng.standard_normal(s.shape) * s
        bias = bias_m[:, cut]
        y = np.where(used, y + bias, np.nan)
        found = detect(ranges(e, a, s, clock=c, used=used, residual_m=y), y, d)
        slots = np.arange(len(used))[:, None]
        out = np.logical_or.reduce([slots == one for one in found.excluded])
        g = found.geometry
        step = (g.gain[:2] * np.where(g.weight > 0, bias, 0.0)).sum(axis=1)
        faulty = bias != 0
        right, good = (out == faulty).all(axis=0), (out & ~faulty).any(axis=0)
        herl, _ = external_levels_m(g, d.shift)
        pieces.append(_Outcome(found.verdict, found.detected, right, good, np.hypot(*step), herl))
    return _Outcome(
        *(np.concatenate([getattr(p, name) for p in pieces]) for name in vars(pieces[0]))
    )


def _chosen_slots(used: Bools, count: int, rng: np.random.Generator) -> Ints:
    """(count, t) different slots of every column, drawn among its used ones."""
    lot = np.where(used, rng.random(used.shape), 2.0)
    return np.argsort(lot, axis=0)[:count]


def _steps(
    part: _Epochs,
    testable: Ints,
    kind: str,
    size_m: float,
    trials: int,
    noise: FaultNoise,
    rng: np.random.Generator,
    design: MonitorDesign,
) -> dict[str, Any]:
    own = part.some(rng.choice(testable, trials))
    slots = _chosen_slots(own.used[:, own.column], 2 if kind == "two" else 1, rng)
    bias = np.zeros((len(own.used), trials))
    for slot in slots:
        bias[slot, np.arange(trials)] = size_m * rng.choice([-1.0, 1.0], trials)
    out = _try(own, bias, noise, rng, design)
    return _row({"kind": kind, "size_m": size_m, "rate_mps": np.nan}, out, np.nan)


def _ramps(
    part: _Epochs,
    testable: Ints,
    time_s: Floats,
    rate_mps: float,
    trials: int,
    longest_s: float,
    noise: FaultNoise,
    rng: np.random.Generator,
    design: MonitorDesign,
) -> dict[str, Any]:
    """Ramps from random epochs on, followed while their range stays in the fix."""
    start = rng.choice(testable, trials)
    slot = _chosen_slots(part.used[:, part.column[start]], 1, rng)[0]
    satellite = part.given.satellite[slot, part.column[start]]
    sign = rng.choice([-1.0, 1.0], trials)
    testing = np.isin(np.arange(part.column.size), testable)
    alive = np.ones(trials, bool)
    delay = np.full(trials, np.nan)
    followed = np.zeros(trials, bool)
    whole = _Outcome(
        np.zeros(trials, np.int8),
        np.zeros(trials, bool), np.zeros(trials, bool), np.zeros(trials, bool),
        np.full(trials, np.nan), np.full(trials, np.nan),
    )  # fmt: skip
    for ahead in range(1, part.column.size):
        epoch = start + ahead
        alive = alive & (epoch < part.column.size)
        at = np.where(alive, epoch, start)
        since = time_s[at] - time_s[start]
        alive &= (since > 0) & (since <= longest_s) & testing[at]
        here = part.given.satellite[:, part.column[at]] == satellite
        here &= part.used[:, part.column[at]]
        alive &= here.any(axis=0)
        go = np.flatnonzero(alive)
        if not go.size:
            break
        bias = np.where(here[:, go], sign[go] * rate_mps * since[go], 0.0)
        now = _try(part.some(at[go]), bias, noise, rng, design)
        followed[go] = True
        for name, values in vars(now).items():
            # The error that stood is that of the last epoch without detection.
            rows = ~now.detected if name in ("error_m", "herl_m") else np.ones(go.size, bool)
            getattr(whole, name)[go[rows]] = values[rows]
        delay[go[now.detected]] = since[go][now.detected]
        alive[go[now.detected]] = False
    out = _Outcome(**{name: values[followed] for name, values in vars(whole).items()})
    row = {"kind": "ramp", "size_m": np.nan, "rate_mps": rate_mps}
    found = delay[np.isfinite(delay)]
    return _row(row, out, float(np.median(found)) if found.size else np.nan, stood=True)


def _row(
    row: dict[str, Any], out: _Outcome, delay_s: float, *, stood: bool = False
) -> dict[str, Any]:
    passed = out.verdict == Verdict.PASSED
    after = out.verdict == Verdict.PASSED_AFTER_EXCLUSION
    error = out.error_m[np.isfinite(out.error_m) & (stood | passed | after)]
    beyond = (out.error_m > out.herl_m) & (stood | passed | after)
    return row | {
        "trials": int(out.verdict.size),
        "detected": int(out.detected.sum()),
        "excluded_right": int((after & out.right).sum()),
        "excluded_part": int((after & ~out.right & ~out.good).sum()),
        "excluded_good": int((after & out.good).sum()),
        "missed": int(passed.sum()),
        "unavailable": int((out.verdict == Verdict.NOT_AVAILABLE).sum()),
        "error_median_m": float(np.median(error)) if error.size else np.nan,
        "error_max_m": float(error.max()) if error.size else np.nan,
        "beyond_herl": int(beyond.sum()),
        "delay_median_s": delay_s,
    }
