"""Faults that come and go: bursts of a two-state chain, by its sojourn times.

A sojourn that ends in each step with probability 1 - exp(-h / mean) lasts k steps with the law of
an exponential time of that mean, rounded up to whole steps: P(more than k) = exp(-k h / mean).
So a handful of exponential times a run gives exactly the law of the chain stepped through.

Source: docs/methods/multisensor.md.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.fusion.architecture.model import Bursts, CommonCause
from sbas.fusion.fused_runs import Bools, Floats

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class BurstRuns:
    """Bursts over a batch of runs.

    Parameters
    ----------
    steps, runs : size of the batch.
    run : (e,) run of each burst.
    start, stop : (e,) its first step, and the one after its last; within the batch.
    """

    steps: int
    runs: int
    run: Ints
    start: Ints
    stop: Ints

    def of_runs(self, chosen: Bools) -> BurstRuns:
        """Bursts of the runs that the mask (runs,) chooses."""
        mine = chosen[self.run]
        return dataclasses.replace(
            self, run=self.run[mine], start=self.start[mine], stop=self.stop[mine]
        )

    def joined(self, other: BurstRuns) -> BurstRuns:
        """Bursts of both; they may overlap."""
        return dataclasses.replace(
            self,
            run=np.concatenate([self.run, other.run]),
            start=np.concatenate([self.start, other.start]),
            stop=np.concatenate([self.stop, other.stop]),
        )

    def grid(self, amplitude: Floats) -> Floats:
        """Amplitude (e,) of the bursts as (steps, runs): 0 where none, the largest of several."""
        values = np.zeros(self.steps * self.runs)
        # Of values assigned to one cell the last one stays: the largest in size.
        order = np.argsort(np.abs(amplitude), kind="stable")
        cell, burst = self._cells(order)
        values[cell] = amplitude[burst]
        return values.reshape(self.steps, self.runs)

    def on(self) -> Bools:
        """Where a burst is on, as (steps, runs)."""
        mask = np.zeros(self.steps * self.runs, dtype=np.bool_)
        mask[self._cells(np.arange(self.run.size))[0]] = True
        return mask.reshape(self.steps, self.runs)

    def _cells(self, order: Ints) -> tuple[Ints, Ints]:
        """Flat cells of the bursts, in the given order of these, and the burst of each cell."""
        length = (self.stop - self.start)[order]
        burst = np.repeat(order, length)
        within = np.arange(burst.size) - np.repeat(np.cumsum(length) - length, length)
        return (self.start[burst] + within) * self.runs + self.run[burst], burst


def draw_bursts(
    bursts: Bursts, *, step_s: float, steps: int, runs: int, rng: np.random.Generator
) -> BurstRuns:
    """Bursts of the chain that is off before the first step, over a batch of runs.

    Parameters
    ----------
    bursts : rate and mean duration.
    step_s : step of the chain [s].
    steps, runs : size of the batch.
    rng : draws two exponential times a burst.

    Returns
    -------
    When which run has a burst.
    """
    rate, mean_on = bursts.rate_per_s * step_s, bursts.mean_duration_s / step_s
    run = np.arange(runs if rate > 0.0 else 0)
    # The step before the first belongs to the first stretch without a burst.
    stop = np.full(run.size, -1)
    found = []
    while run.size:
        start = stop + _sojourns(1 / rate, run.size, steps, rng)
        inside = start < steps
        run, start = run[inside], start[inside]
        stop = start + _sojourns(mean_on, run.size, steps, rng)
        found.append((run, start, np.minimum(stop, steps)))
    if not found:
        return BurstRuns(steps, runs, *(np.empty(0, dtype=np.int64) for _ in range(3)))
    return BurstRuns(steps, runs, *(np.concatenate(part) for part in zip(*found, strict=True)))


def _sojourns(mean_steps: float, count: int, steps: int, rng: np.random.Generator) -> Ints:
    """Lengths of stretches: 1 or more; more than a run is as good as a run and a step."""
    length = np.ceil(rng.standard_exponential(count) * mean_steps)
    return np.clip(length, 1, steps + 1).astype(np.int64)


def draw_shared_bursts(
    bursts: Bursts,
    *,
    common_cause: CommonCause,
    share: float,
    step_s: float,
    steps: int,
    runs: int,
    own: np.random.Generator,
    common: np.random.Generator,
    coin: Floats,
) -> BurstRuns:
    """Bursts of one sensor of a redundant group: its own, and those of the whole group.

    Parameters
    ----------
    bursts : rate and mean duration of one sensor.
    common_cause : "per_run": with probability `share` the bursts of a run are the group's, else
        the sensor's own; "beta_factor": the group's come at `share` of the rate, its own at the
        rest of it; "independent": its own only.
    share : probability or beta factor [1].
    step_s : step of the chain [s].
    steps, runs : size of the batch.
    own : stream of the sensor.
    common : stream of the group, in the same state for each of its sensors.
    coin : (runs,) uniform numbers of the group, by which "per_run" chooses its runs.

    Returns
    -------
    When which run has a burst; the amplitudes are each sensor's own.
    """

    def drawn(part: float, rng: np.random.Generator) -> BurstRuns:
        scaled = dataclasses.replace(bursts, rate_per_s=part * bursts.rate_per_s)
        return draw_bursts(scaled, step_s=step_s, steps=steps, runs=runs, rng=rng)

    if common_cause == "per_run":
        follows = coin < share
        return drawn(1.0, own).of_runs(~follows).joined(drawn(1.0, common).of_runs(follows))
    if common_cause == "beta_factor":
        return drawn(1 - share, own).joined(drawn(share, common))
    return drawn(1.0, own)


def draw_amplitudes(
    bursts: Bursts, count: int, rng: np.random.Generator, *, either_sign: bool = False
) -> Floats:
    """One amplitude a burst, uniform between the smallest and the largest.

    Parameters
    ----------
    bursts : range of the amplitudes, in the unit of what they disturb.
    count : number of bursts.
    rng : draws the amplitudes.
    either_sign : turn half of them round.

    Returns
    -------
    (count,) amplitudes.
    """
    amplitude = rng.uniform(bursts.smallest, bursts.largest, count)
    if either_sign:
        amplitude *= np.where(rng.random(count) < 0.5, -1.0, 1.0)
    return amplitude
