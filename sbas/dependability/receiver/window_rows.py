"""Rows of the GNSS + ECS unit in closed form: fast enough to be solved for the receiver's chain.

The receiver's output is correct, wrong or missing, or missing by hardware, or waits for its first
fix. All sums are of positive terms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.receiver.unit_numbers import UnitNumbers
from sbas.dependability.tree.model import Component, MeanRule

Floats = NDArray[np.float64]

_NEGLIGIBLE = 1e-18
"""Share of the first term of a geometric sum below which the rest is left out."""


@dataclass(frozen=True)
class UnitRows:
    """Means over the mission [1]; `top` None where the tree's top is not the paper's."""

    ie1: float
    ie2: float
    ie5: float
    ie6: float
    be1: float | None
    be2: float
    top: float | None
    correct: float


@dataclass(frozen=True, eq=False)
class HardwareCurves:
    """What hardware does over the mission, whatever the receiver's chain.

    Parameters
    ----------
    stay : probability that all components of the guard work on for one epoch.
    leave : (q,) from "all work" to each way in which some are failed, in one epoch.
    among, back : (q, q) between those ways, and (q,) back to "all work".
    up : (N+1,) probability that the guard held from epoch 0 on.
    failed : (q, N+1) law of those ways.
    waits : (N+1,) probability that the wait begins at an epoch.
    redraws : (N+1,) that it ends with a new state.
    later : (N+1,) that the receiver works in a later period than its first.
    ecs, ecs_stay : (N+1,) probability that the ECS is failed; that it stays so for an epoch.
    fusion : (N+1,) likewise, or None.
    """

    stay: float
    leave: Floats
    among: Floats
    back: Floats
    up: Floats
    failed: Floats
    waits: Floats
    redraws: Floats
    later: Floats
    ecs: Floats
    ecs_stay: float
    fusion: Floats | None


def hardware_curves(numbers: UnitNumbers) -> HardwareCurves:
    """Laws of the components at all epochs, and of the receiver's waits for a first fix.

    Parameters
    ----------
    numbers : of the unit.

    Notes
    -----
    With s = alpha + mu and h the epoch: P(0->1) = alpha/s (1 - exp(-s h)), and failed at t:
    alpha/s (1 - exp(-s t)) + p0 exp(-s t), the two-state Markov process in continuous time.
    """
    count = numbers.epochs + 1
    laws = [_failed_law(c, numbers.step_s, count) for c in numbers.guard]
    moves = [_moves(c, numbers.step_s) for c in numbers.guard]
    law, kernel = np.ones((1, count)), np.ones((1, 1))
    for failed, (fail, mend) in zip(laws, moves, strict=True):
        law = np.concatenate([law * (1.0 - failed), law * failed])
        kernel = np.kron(np.array([[1.0 - fail, fail], [mend, 1.0 - mend]]), kernel)
    log_stay = sum(math.log1p(-fail) for fail, _ in moves)
    epoch = np.arange(count)
    stays = np.exp(log_stay * epoch)
    waits = np.zeros(count)
    waits[1:] = law[1:, :-1].T @ kernel[1:, 0]
    redraws = np.zeros(count)
    if numbers.wait < count:
        redraws[numbers.wait :] = waits[: count - numbers.wait] * stays[numbers.wait]
    ecs_fail_mend = _moves(numbers.ecs, numbers.step_s)
    fusion = numbers.fusion
    return HardwareCurves(
        stay=float(stays[1]) if count > 1 else math.exp(log_stay),
        leave=kernel[0, 1:],
        among=kernel[1:, 1:],
        back=kernel[1:, 0],
        up=law[0, 0] * stays,
        failed=law[1:],
        waits=waits,
        redraws=redraws,
        later=np.convolve(redraws, stays)[:count],
        ecs=_failed_law(numbers.ecs, numbers.step_s, count),
        ecs_stay=1.0 - ecs_fail_mend[1],
        fusion=None if fusion is None else _failed_law(fusion, numbers.step_s, count),
    )


def _moves(component: Component, step_s: float) -> tuple[float, float]:
    """Probabilities to fail and to be repaired within one epoch."""
    total = component.failure_rate_per_h + component.repair_rate_per_h
    if total == 0.0:
        return 0.0, 0.0
    moved = -math.expm1(-total * step_s / 3600.0)
    return (
        component.failure_rate_per_h / total * moved,
        component.repair_rate_per_h / total * moved,
    )


def _failed_law(component: Component, step_s: float, count: int) -> Floats:
    total = component.failure_rate_per_h + component.repair_rate_per_h
    time_h = np.arange(count) * (step_s / 3600.0)
    start = component.initially_failed
    if total == 0.0:
        return np.full(count, start)
    grown = component.failure_rate_per_h / total * -np.expm1(-total * time_h)
    law: Floats = grown + start * np.exp(-total * time_h)
    return law


def unit_rows(
    numbers: UnitNumbers, hardware: HardwareCurves, chain: Floats, stationary: Floats
) -> UnitRows:
    """Means over the mission of the unit's rows, exactly, for one chain of the receiver.

    Parameters
    ----------
    numbers, hardware : of the unit.
    chain : (3, 3) transition probabilities in one epoch among correct, wrong, missing.
    stationary : (3,) stationary law of the chain.

    Notes
    -----
    Run of B lasting d epochs at n: x_(n-d+1)|B (P_BB)^(d-1) 1. PAND(E, CON_l(B)): sum over r >= l
    of P(run of B exactly r at n) P(run of E at least r-l+1 at n). TOP without fusion: IE2 + IE5 +
    P(E lasts d1) P(missing lasts d1 and not d2) + P(IE6 and the run of B below k), which exclude
    each other, since wrong and missing do.
    """
    n = numbers.epochs
    law = _restart_law(numbers, chain, stationary)
    state = _state_law(numbers, hardware, chain, law, stationary)
    ecs = _shifted_runs(hardware.ecs, hardware.ecs_stay)
    lasting = hardware.stay * chain[1, 1]
    entries = np.empty(n + 1)
    entries[0] = state[0, 1]
    entries[1:] = (
        hardware.stay * (state[:-1, 0] * chain[0, 1] + state[:-1, 2] * chain[2, 1])
        + hardware.redraws[1:] * law[1]
    )

    def run_of_wrong(first: int, last: int | None) -> Floats:
        """IE6 restricted to runs of wrong of `first` to `last` epochs."""
        total = np.zeros(n + 1)
        length, weight = first, lasting ** (first - 1)
        least = weight * _NEGLIGIBLE
        while length <= (n + 1 if last is None else last) and weight > least:
            shifted = _delayed(entries, length - 1) * weight
            total += shifted * ecs(_epochs_of_failed_sensor(numbers, length))
            length, weight = length + 1, weight * lasting
        return total

    ie6 = run_of_wrong(numbers.l, None)
    ie5 = _delayed(state[:, 1], numbers.k - 1) * lasting ** (numbers.k - 1)
    missing_1 = _missing_run(numbers, hardware, chain, law, state, numbers.d1)
    missing_2 = _missing_run(numbers, hardware, chain, law, state, numbers.d2)
    ie1 = missing_1 * ecs(numbers.d1)
    fusion = hardware.fusion
    top = None
    if fusion is not None:
        signal = ie5 + missing_2 + run_of_wrong(numbers.l, numbers.k - 1)
        if numbers.d1 < numbers.d2:
            signal += ecs(numbers.d1) * np.maximum(missing_1 - missing_2, 0.0)
        top = mean_over_mission(fusion + (1.0 - fusion) * signal, numbers.mean_rule)

    def mean(curve: Floats) -> float:
        return mean_over_mission(curve, numbers.mean_rule)

    return UnitRows(
        ie1=mean(ie1),
        ie2=mean(missing_2),
        ie5=mean(ie5),
        ie6=mean(ie6),
        be1=None if fusion is None else mean(fusion),
        be2=mean(hardware.ecs),
        top=top,
        correct=mean(state[:, 0]),
    )


def mean_over_mission(curve: Floats, rule: MeanRule) -> float:
    """Mean of (N+1,) probabilities over the mission by "epochs", "left" or "trapezoid"."""
    if rule == "left":
        return float(curve[:-1].mean())
    if rule == "trapezoid":
        return float((curve[0] / 2 + curve[1:-1].sum() + curve[-1] / 2) / (curve.size - 1))
    return float(curve[1:].mean())


def _epochs_of_failed_sensor(numbers: UnitNumbers, run: int) -> int:
    """Epochs that the sensor must have been failed when a run of wrong has lasted so long."""
    return {
        "pand": run - numbers.l + 1,
        "pand_exclusive": run - numbers.l + 2,
        "and": 1,
        "joint": numbers.l,
    }[numbers.ie6]


def _restart_law(numbers: UnitNumbers, chain: Floats, stationary: Floats) -> Floats:
    restart = numbers.source.restart
    if restart == "stationary":
        return stationary
    # "first" is the first state of the source, whichever of the three that is.
    first = numbers.order.index(0)
    if restart == "first":
        return np.array([float(i == first) for i in range(3)])
    if restart == "row1":
        return np.array(chain[first])
    return np.array([restart[i] for i in numbers.order])


def _state_law(
    numbers: UnitNumbers, hardware: HardwareCurves, chain: Floats, law: Floats, stationary: Floats
) -> Floats:
    """(N+1, 3) probabilities that the receiver works and is correct, wrong, missing."""
    initial = np.array([numbers.source.initial[i] for i in numbers.order])
    first = hardware.up[:, None] * _powers(initial, chain, numbers.epochs)
    if law is stationary:
        return first + hardware.later[:, None] * stationary
    stays = hardware.stay ** np.arange(numbers.epochs + 1)
    after = stays[:, None] * _powers(law, chain, numbers.epochs)
    later = [np.convolve(hardware.redraws, after[:, i])[: numbers.epochs + 1] for i in range(3)]
    return first + np.stack(later, axis=1)


def _powers(law: Floats, chain: Floats, last: int) -> Floats:
    """(last+1, 3) law P^n for n = 0..last, by doubling."""
    out = np.empty((last + 1, law.size))
    out[0] = law
    done, power = 1, chain
    while done <= last:
        take = min(done, last + 1 - done)
        out[done : done + take] = out[:take] @ power
        done, power = done + take, power @ power
    return out


def _delayed(curve: Floats, epochs: int) -> Floats:
    """The curve so many epochs earlier; 0 before epoch 0."""
    if epochs == 0:
        return curve
    out = np.zeros_like(curve)
    out[epochs:] = curve[:-epochs]
    return out


def _shifted_runs(failed: Floats, stay: float) -> Callable[[int], Floats]:
    """Function of q: (N+1,) probability that a component has been failed for q epochs at least."""

    def at_least(q: int) -> Floats:
        return _delayed(failed, q - 1) * stay ** (q - 1)

    return at_least


def _missing_run(
    numbers: UnitNumbers,
    hardware: HardwareCurves,
    chain: Floats,
    law: Floats,
    state: Floats,
    d: int,
) -> Floats:
    """(N+1,) probability that the output has been missing, by whatever cause, for d epochs."""
    wait = numbers.wait
    # Probabilities to stay missing for d-1 further epochs, from each way to be missing.
    by_signal, by_hardware, by_wait = 1.0, np.ones(hardware.leave.size), np.ones(wait)
    for _ in range(d - 1):
        broken = float(hardware.leave @ by_hardware)
        redrawn = law[2] * by_signal
        mended = by_wait[0] if wait else redrawn
        by_signal = hardware.stay * chain[2, 2] * by_signal + broken
        by_hardware = hardware.among @ by_hardware + hardware.back * mended
        by_wait = hardware.stay * np.append(by_wait[1:], redrawn)[:wait] + broken
    missing = state[:, 2] * by_signal + by_hardware @ hardware.failed
    if wait:
        ages = hardware.stay ** np.arange(wait) * by_wait
        missing += np.convolve(hardware.waits, ages)[: missing.size]
    return _delayed(missing, d - 1)
