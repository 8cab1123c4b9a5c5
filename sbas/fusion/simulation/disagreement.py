"""Which sensors contradict the others, and may the position be used?

Both tests see values, never the truth. A sensor that fails leaves the fusion on that axis at that
epoch. The position is usable when the sensors that are left agree; a single sensor, which nothing
can contradict, counts as agreeing. Where they do not agree all that are left stay in the fusion,
and the position is declared unusable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy import special

from sbas.exceptions import ModelError
from sbas.fusion.fused_runs import Bools, Floats
from sbas.fusion.simulation.missing_data import UsedErrors
from sbas.fusion.simulation.weighted_fusion import over_runs

FALSE_ALARM: Final = 1e-3
"""Probability, two-sided, that one test of a healthy sensor among healthy ones fails."""

_T_LIMIT: Final = float(-special.ndtri(FALSE_ALARM / 2))
_WEAK: Final = 0.5
_STANDS_STILL: Final = 1e-9
_LARGEST: Final = 1e150
"""Stands for an infinite error: its normalised residuals stay finite and keep their order."""

Signal = Literal["positions", "increments", "residuals"]


@dataclass(frozen=True)
class Correlation:
    """What the correlation test leaves open in its source.

    Parameters
    ----------
    signal : what is correlated over the window: "positions" as measured; their "increments"
        between epochs; or their "residuals" to the plain mean of the sensors.
    window_s : length of the window, which ends at the epoch tested [s].
    mixed_signs : weak correlations of either sign make a fault; else all must have one sign, as
        printed.
    """

    signal: Signal = "positions"
    window_s: float = 10.0
    mixed_signs: bool = False


AS_PRINTED: Final = Correlation()


@dataclass(frozen=True, eq=False)
class Disagreement:
    """Verdict on each sensor and on the position.

    Parameters
    ----------
    excluded : (n, a, t, r) sensors that leave the fusion.
    usable : (a, t, r) those that are left agree.
    """

    excluded: Bools
    usable: Bools


# --- normalised difference to the others ------------------------------------------------------


def leave_one_out_test(sensors: Sequence[UsedErrors], variances: Floats) -> Disagreement:
    """Compare each sensor with the weighted mean of the others; drop the worst, and again.

    Parameters
    ----------
    sensors : n sensors as the fusion takes them; supplied values are tested like measured ones.
    variances : (a, n) or (a, t, n) of their errors [m^2]; inf on axes not measured.

    Returns
    -------
    Disagreement: usable where no |t| above the limit is left. Of two sensors that contradict
    each other neither is dropped, as nothing tells which is wrong.

    Notes
    -----
    t_i = (m_i - mean of the others)/sqrt(s_i^2 + 1/sum_{j != i} s_j^-2), limit 3.291, two-sided
    1e-3. The truth cancels, so errors stand for measurements.

    References
    ----------
    Normalised residual of one observation in a weighted mean.
    """
    shape = sensors[0].error_m.shape
    error = np.stack([np.clip(s.error_m, -_LARGEST, _LARGEST).ravel() for s in sensors])
    taken = np.stack([s.informed.ravel() for s in sensors])
    inverse = np.stack(
        [np.broadcast_to(over_runs(1.0 / variances, i), shape).ravel() for i in range(len(sensors))]
    )
    usable = np.ones(error.shape[1], dtype=bool)
    kept = taken.copy()
    cells = np.arange(error.shape[1])
    while cells.size:
        size = np.abs(_normalised(error[:, cells], inverse[:, cells], kept[:, cells]))
        worst = np.argmax(size, axis=0)
        over = size[worst, np.arange(cells.size)] > _T_LIMIT
        cells, worst = cells[over], worst[over]
        several = kept[:, cells].sum(axis=0) > 2
        usable[cells[~several]] = False
        cells = cells[several]
        kept[worst[several], cells] = False
    excluded = (taken & ~kept).reshape(len(sensors), *shape)
    return Disagreement(excluded, usable.reshape(shape))


def _normalised(error: Floats, inverse: Floats, kept: Bools) -> Floats:
    """(n, m) t of each sensor kept; 0 of the others and where there is nothing to compare with."""
    weight = np.where(kept, inverse, 0.0)
    without = 1.0 - np.eye(len(error))
    others = without @ weight  # added up afresh: a difference to the whole would cancel
    comparable = (weight > 0) & (others > 0)
    mean = without @ (weight * np.where(kept, error, 0.0))
    np.divide(mean, others, out=mean, where=comparable)
    scale = np.zeros_like(mean)
    np.divide(weight * others, weight + others, out=scale, where=comparable)
    return np.where(comparable, (np.where(kept, error, 0.0) - mean) * np.sqrt(scale), 0.0)


# --- correlation ------------------------------------------------------------------------------


def correlation_test(
    sensors: Sequence[UsedErrors],
    true_position_m: Floats,
    *,
    step_s: float,
    options: Correlation = AS_PRINTED,
) -> Disagreement:
    """Find sensors that correlate only weakly with every other one over a sliding window.

    Parameters
    ----------
    sensors : n sensors as the fusion takes them.
    true_position_m : (t,) along the track, axis x; the train stands still on the others [m].
    step_s : between epochs [s].
    options : signal, window and signs.

    Returns
    -------
    Disagreement: usable where a sensor is left that is not flagged. Where all are flagged none
    is dropped. Nothing is flagged before the first full window. An undefined correlation, as with
    a signal that stands still, is passed over: the defined ones decide, and without any nothing
    is flagged.

    Raises
    ------
    ModelError : a window of fewer than three epochs.

    Notes
    -----
    Eq. 1: 0 < r_ij < 0.5 for all j, or -0.5 < r_ij < 0 for all j; Eq. 2: r_ij = s_ij/(s_i s_j).
    Sensors that follow one motion correlate strongly whatever their faults.

    References
    ----------
    Railways 2014, Eq. 1 and 2.
    """
    window = round(options.window_s / step_s)
    if window < 3:
        raise ModelError(
            f"a window of {options.window_s:g} s holds {max(window, 0)} epochs: a correlation "
            "needs three",
            where="correlation.window_s",
            cure=f"write a window of {3 * step_s:g} s or more",
        )
    axes = sensors[0].error_m.shape[0]
    verdicts = []
    for axis in range(axes):
        values = np.stack([np.where(s.informed[axis], s.error_m[axis], np.nan) for s in sensors])
        values[~np.isfinite(values)] = np.nan
        if axis == 0 and options.signal != "residuals":
            values += true_position_m[:, np.newaxis]
        verdicts.append(_weakly_correlated(_signal(values, options.signal), window, options))
    flagged = np.stack(verdicts, axis=1)
    taken = np.stack([s.informed for s in sensors])
    usable: Bools = np.asarray((taken & ~flagged).any(axis=0))
    return Disagreement(flagged & usable, usable)


def _signal(values: Floats, signal: Signal) -> Floats:
    """(n, t, r) what is correlated, out of positions; NaN where it is undefined."""
    if signal == "increments":
        return np.diff(values, axis=1, prepend=np.nan)
    if signal == "residuals":
        known = ~np.isnan(values)
        count = np.maximum(known.sum(axis=0), 1)
        return np.asarray(values - np.sum(values, axis=0, where=known) / count)
    return values


def _weakly_correlated(signal: Floats, window: int, options: Correlation) -> Bools:
    """(n, t, r) sensors whose correlations with all others are weak, at the end of each window."""
    sensors, epochs, runs = signal.shape
    flagged = np.zeros(signal.shape, dtype=bool)
    if epochs < window:
        return flagged
    ends = epochs - window + 1
    parts = [signal[:, k : k + ends] for k in range(window)]
    mean = sum(parts[1:], parts[0]) / window
    covariance = np.zeros((sensors, sensors, ends, runs))
    for part in parts:
        centred = part - mean
        covariance += centred[:, np.newaxis] * centred
    sd = np.sqrt(np.einsum("iitr->itr", covariance))
    # A signal that stands still has no correlation: what is left of it is rounding.
    size = np.max(np.abs(signal), initial=0.0, where=~np.isnan(signal))
    sd[sd <= _STANDS_STILL * (1.0 + size) * np.sqrt(window)] = np.nan
    with np.errstate(invalid="ignore", divide="ignore"):
        r = covariance / (sd[:, np.newaxis] * sd)
    own = np.eye(sensors, dtype=bool)[:, :, np.newaxis, np.newaxis]
    passed_over = own | np.isnan(r)
    compared = ~passed_over.all(axis=1)
    if options.mixed_signs:
        weak = (passed_over | (np.abs(r) < _WEAK)).all(axis=1)
    else:
        up = (passed_over | ((r > 0) & (r < _WEAK))).all(axis=1)
        down = (passed_over | ((r < 0) & (r > -_WEAK))).all(axis=1)
        weak = up | down
    flagged[:, window - 1 :] = weak & compared
    return flagged
