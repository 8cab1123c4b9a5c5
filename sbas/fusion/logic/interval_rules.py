"""States of an output from intervals: the rules that Railways 2014 may have meant by its Eq. 3.

The error of a sensor in state N lies in [0, beta], in DA in [beta, AL], in U in [AL, X]; that of a
weighted mean between S_lo and S_hi. How an interval becomes a state the paper says in words that
contradict its inequalities: each reading has a name here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.states import DA, DEFAULT_THRESHOLDS, N, States, U, check_thresholds

IntervalRule = Literal[
    "tree_bounds",
    "eq3_midpoint",
    "eq3_midpoint_signed",
    "eq3_literal_ndu",
    "eq3_literal_udn",
    "upper_end",
    "lower_end",
    "subset_else_da",
    "midpoint_free",
]
MAX_SENSORS = 12
"""3^12 = 531441 combinations."""
TOLERANCE_M = 1e-9
"""Ends that equal a bound by arithmetic may round to either side of it; they count as equal."""

Floats = NDArray[np.float64]


def interval_outcomes(
    rule: IntervalRule,
    weights: ArrayLike,
    *,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    unacceptable_end_m: float = math.inf,
    output_thresholds: Thresholds | None = None,
) -> States:
    """State of the output for every combination of sensor states, by one of the rules.

    Parameters
    ----------
    rule : "tree_bounds": U where S_lo >= AL; N where S_lo < beta and S_hi <= AL; else DA.
        "eq3_midpoint": the middle m of S_lo and S_hi against beta and AL, as the paper's text
        says. "eq3_midpoint_signed": the same with errors of unknown sign. "eq3_literal_ndu" and
        "eq3_literal_udn": the inequalities as printed (DA also where beta >= m, U also where
        AL >= m), asked in that order, the last state taken by what no condition claims.
        "upper_end", "lower_end": S_hi, or S_lo, against beta and AL. "subset_else_da": N or U
        where the whole interval lies in their range, else DA. "midpoint_free": m against
        `output_thresholds`.
    weights : (n,) of the mean, not negative, with sum 1.
    thresholds : beta and AL of the sensors, and of the output; hysteresis and dwell play no part.
    unacceptable_end_m : X, the largest error in state U [m].
    output_thresholds : beta and AL of the output, for "midpoint_free" alone.

    Returns
    -------
    (3^n,) int8 in the order of the combination codes. The end of an interval that lies on a bound
    leaves it in the range below; the lower end, or the middle, on a bound is the worse state.

    Raises
    ------
    InputError : an unknown rule, weights that are no mean, bounds out of order, or more than 12
        sensors.

    References
    ----------
    Railways 2014, section 3.1, step 4, Eq. 3; the names are choices of this package.
    """
    if rule not in get_args(IntervalRule):
        raise InputError(
            f"{rule!r} is no rule",
            where="rule",
            cure=f"known are {', '.join(get_args(IntervalRule))}",
        )
    if (rule == "midpoint_free") != (output_thresholds is not None):
        raise InputError(
            "output_thresholds belong to the rule 'midpoint_free', and it needs them",
            where="output_thresholds",
            evidence=f"rule {rule!r}, output_thresholds = {output_thresholds!r}",
        )
    bounds = thresholds if output_thresholds is None else output_thresholds
    check_thresholds(bounds)
    lowest, highest = output_intervals(
        weights,
        thresholds=thresholds,
        unacceptable_end_m=unacceptable_end_m,
        signed=rule == "eq3_midpoint_signed",
    )
    middle = (lowest + highest) / 2
    beta, limit = bounds.nominal_m, bounds.alert_limit_m
    if rule == "tree_bounds":
        return _first(
            [(U, _reaches(lowest, limit)), (N, ~_reaches(lowest, beta) & _within(highest, limit))],
            DA,
        )
    if rule == "upper_end":
        return _first([(N, _within(highest, beta)), (DA, _within(highest, limit))], U)
    if rule == "lower_end":
        return _against(lowest, beta, limit)
    nominal, unacceptable = _within(highest, beta), _reaches(lowest, limit)
    if rule == "subset_else_da":
        return _first([(N, nominal), (U, unacceptable)], DA)
    if rule in ("eq3_literal_ndu", "eq3_literal_udn"):
        inside = _reaches(lowest, beta) & _within(highest, limit)
        degraded = inside | _within(middle, beta)
        unacceptable |= _within(middle, limit)
        if rule == "eq3_literal_ndu":
            return _first([(N, nominal), (DA, degraded)], U)
        return _first([(U, unacceptable), (DA, degraded)], N)
    # An interval inside a range has its middle there: the text's first clause adds nothing.
    return _against(middle, beta, limit)


def output_intervals(
    weights: ArrayLike,
    *,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    unacceptable_end_m: float = math.inf,
    signed: bool = False,
) -> tuple[Floats, Floats]:
    """Bounds of the mean's error for every combination of sensor states.

    Parameters
    ----------
    weights : (n,) of the mean, not negative, with sum 1.
    thresholds : beta and AL of the sensors.
    unacceptable_end_m : X, the largest error in state U [m].
    signed : errors may cancel: the lower bound is what the largest cannot lose to the others.

    Returns
    -------
    S_lo, S_hi : (3^n,) each, in the order of the combination codes [m].

    Raises
    ------
    InputError : weights that are no mean, bounds out of order, or more than 12 sensors.

    Notes
    -----
    S_lo = sum w_i lo_i, S_hi = sum w_i hi_i; signed: S_lo = max(0, max_i(w_i lo_i - sum_{j!=i} w_j
    hi_j)). A sensor of weight 0 adds nothing, even with X infinite.
    """
    check_thresholds(thresholds)
    share = mean_weights(weights)
    beta, limit = thresholds.nominal_m, thresholds.alert_limit_m
    if not unacceptable_end_m > limit:
        raise InputError(
            "the largest error in state U must exceed the alert limit",
            where="unacceptable_end_m",
            evidence=f"{unacceptable_end_m!r} with alert_limit_m = {limit!r}",
            cure="math.inf is the default",
        )
    low = [_scaled(w, (0.0, beta, limit)) for w in share]
    high = [_scaled(w, (beta, limit, unacceptable_end_m)) for w in share]
    highest = _sums(high)
    if not signed:
        return _sums(low), highest
    lowest = np.zeros_like(highest)
    for i, own in enumerate(low):
        rest = [-ends if j != i else own for j, ends in enumerate(high)]
        np.maximum(lowest, _sums(rest), out=lowest)
    return lowest, highest


def mean_weights(weights: ArrayLike) -> Floats:
    """Weights of 1 to 12 sensors, checked to be finite, not negative, and to add up to 1."""
    share = np.asarray(weights, dtype=np.float64)
    if share.ndim != 1 or not 1 <= share.size <= MAX_SENSORS:
        raise InputError(
            f"all combinations are listed for 1 to {MAX_SENSORS} sensors",
            where="weights",
            evidence=f"shape {share.shape}",
        )
    if not np.all((share >= 0) & (share < math.inf)):
        raise InputError(
            "a weight is negative or no number", where="weights", evidence=f"{share.tolist()}"
        )
    total = float(share.sum())
    if abs(total - 1) > 1e-9:
        raise InputError(
            "the weights do not add up to 1",
            where="weights",
            evidence=f"{share.tolist()}, sum {total!r}",
            cure="divide them by their sum" if total > 0 else "give one of them a weight",
        )
    return share


def smallest_unacceptable_end_m(
    weights: ArrayLike, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> float:
    """Bound that X must exceed for "tree_bounds" to keep every combination with a U from N.

    Parameters
    ----------
    weights : (n,) of the mean, not negative, with sum 1.
    thresholds : beta and AL.

    Returns
    -------
    beta + (AL - beta)/min(w) [m]; infinite where a weight is 0.

    Notes
    -----
    The U of the smallest weight w among nominal sensors: (1 - w) beta + w X > AL.
    """
    check_thresholds(thresholds)
    smallest = float(mean_weights(weights).min())
    if smallest == 0:
        return math.inf
    return thresholds.nominal_m + (thresholds.alert_limit_m - thresholds.nominal_m) / smallest


def _scaled(weight: float, ends: Sequence[float]) -> Floats:
    # 0 times an infinite end is no number.
    return weight * np.array(ends) if weight > 0 else np.zeros(3)


def _sums(parts: Sequence[Floats]) -> Floats:
    total = np.zeros(1)
    for part in parts:
        total = (total[:, None] + part).ravel()
    return total


def _reaches(value: Floats, bound: float) -> NDArray[np.bool_]:
    return np.asarray(value >= bound - TOLERANCE_M)


def _within(value: Floats, bound: float) -> NDArray[np.bool_]:
    return np.asarray(value <= bound + TOLERANCE_M)


def _against(value: Floats, beta: float, limit: float) -> States:
    return _reaches(value, beta).astype(np.int8) + _reaches(value, limit).astype(np.int8)


def _first(cases: Sequence[tuple[int, NDArray[np.bool_]]], otherwise: int) -> States:
    chosen = np.select([case for _, case in cases], [state for state, _ in cases], otherwise)
    return chosen.astype(np.int8)
