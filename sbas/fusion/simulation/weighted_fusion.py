"""Weighted mean of the sensors, axis by axis, and one error out of those of the axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sbas.fusion.architecture.model import AxisRule
from sbas.fusion.fused_runs import Bools, Floats
from sbas.fusion.simulation.missing_data import UsedErrors

_ROUNDING: Final = 1e-9


def fused_errors(
    sensors: Sequence[UsedErrors], weights: Floats, *, excluded: Bools | None = None
) -> Floats:
    """Error of the weighted mean of the sensors that the fusion takes at each epoch.

    Parameters
    ----------
    sensors : n sensors as the fusion takes them.
    weights : (a, n) or (a, t, n) [1], 0 or more; those of the sensors taken are scaled to add
        up to 1.
    excluded : (n, a, t, r) further sensors that are not taken, by fault detection.

    Returns
    -------
    (a, t, r) error of the fused position [m]; NaN where no sensor informs it, inf where one with
    a weight is infinitely wrong.

    Raises
    ------
    RuntimeError : a mean outside its terms, which no data can cause: an error of this program.

    Notes
    -----
    A mean with weights of 0 or more never exceeds the largest of its terms: as long as all
    errors are below the alert limit the fused one is, whatever the weights.

    References
    ----------
    Railways 2014, section 3.2; convexity.
    """
    shape = sensors[0].error_m.shape
    total, share, bound = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    informed = np.zeros(shape, dtype=bool)
    infinite: list[tuple[Bools, Floats]] = []
    for i, sensor in enumerate(sensors):
        weight = over_runs(weights, i)
        error, size = sensor.error_m, np.abs(sensor.error_m)
        taken = ~np.isnan(error)
        if excluded is not None:
            taken &= ~excluded[i]
        taken &= weight > 0
        if np.isinf(size).any():
            infinite.append((taken & np.isinf(size), error))
            error = np.where(np.isinf(size), 0.0, error)
        np.add(total, weight * error, out=total, where=taken)
        np.add(share, weight, out=share, where=taken)
        np.maximum(bound, size, out=bound, where=taken)
        informed |= taken if sensor.zeroed is None else taken & ~sensor.zeroed
    mean = np.full(shape, np.nan)
    np.divide(total, share, out=mean, where=informed)
    outside = np.abs(mean) > bound * (1 + _ROUNDING)
    if outside.any():
        raise RuntimeError(f"{outside.sum()} weighted means exceed all errors they are made of")
    np.clip(mean, -bound, bound, out=mean)  # rounding must not carry a mean over a limit
    for where, error in infinite:
        mean[where] = error[where]
    return mean


def over_runs(weights: Floats, sensor: int) -> Floats:
    """(a, 1 or t, 1) weights of one sensor out of (a, n) or (a, t, n), to go with (a, t, r)."""
    of_sensor: Floats = weights[..., sensor, np.newaxis]
    return of_sensor if weights.ndim == 3 else of_sensor[:, np.newaxis]


def over_axes(error_m: Floats, rule: AxisRule, *, every_axis: bool) -> Floats:
    """One error at each epoch out of those on the axes.

    Parameters
    ----------
    error_m : (a, t, r) [m], NaN where there is none.
    rule : "worst_axis" the signed error on the axis where it is largest; "norm" of the vector.
    every_axis : NaN where any axis has no error, as a position needs all its coordinates; else
        the axes that have one decide.

    Returns
    -------
    (t, r) [m].

    References
    ----------
    Railways 2014, section 3.2: to be correct a position needs all its coordinates correct.
    """
    if len(error_m) == 1:
        only: Floats = error_m[0]
        return np.abs(only) if rule == "norm" else only
    if rule == "norm":
        square = error_m**2
        if every_axis:
            whole: Floats = np.sqrt(square.sum(axis=0))
            return whole
        known = ~np.isnan(error_m)
        part: Floats = np.sqrt(np.sum(square, axis=0, where=known))
        part[~known.any(axis=0)] = np.nan
        return part
    size = np.abs(error_m)
    if not every_axis:
        size[np.isnan(size)] = -1.0
    worst = np.argmax(size, axis=0, keepdims=True)  # NaN counts as the largest
    picked: Floats = np.take_along_axis(error_m, worst, axis=0)[0]
    return picked
