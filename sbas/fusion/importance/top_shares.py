"""Shares of a top event by the levels of each sensor: exact under independence, counted in runs.

What importance measures are made of. The top events are those of a truth table: `notN`, the
output is not nominal, and `isU`, it is unacceptable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.fused_runs import Bools, Floats, States
from sbas.fusion.logic.boolean_form import Condition, holds, lowest_true
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import DA, N, U

Top = Condition
Counts = NDArray[np.int64]

_LEVELS: Final = (DA, U)
_SUM_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class TopShares:
    """Shares of a top event T among n sensors with states x; leading axes are free.

    Parameters
    ----------
    top : (...) P(T) [1].
    level : (..., n, 3) P(x_i = s) [1].
    given : (..., n, 3) P(T | x_i = s) [1]; NaN where x_i = s never was.
    change : (..., n, 2) P(T | x_i = s) - P(T | x_i = N), s = DA, U [1].
    by_cut : (..., n, 2) P(T, and a minimal cut vector with level s of sensor i holds) [1]; NaN
        where the table's top is not monotone.
    """

    top: Floats
    level: Floats
    given: Floats
    change: Floats
    by_cut: Floats

    def first(self) -> TopShares:
        """The shares at the first place of the leading axis."""
        return TopShares(self.top[0], self.level[0], self.given[0], self.change[0], self.by_cut[0])


@dataclass(frozen=True, eq=False)
class RunCounts:
    """Epochs by run with all states known: of each level, of the top, and of both.

    Parameters
    ----------
    epochs : (r,) epochs.
    level : (r, n, 3) epochs with x_i = s.
    top : (r,) epochs with the top.
    both : (r, n, 3) epochs with both.
    by_cut : (r, n, 2) epochs with the top in which a cut vector with (i, s) holds, else NaN.
    """

    epochs: Floats
    level: Floats
    top: Floats
    both: Floats
    by_cut: Floats

    def shares(self, weights: Floats) -> TopShares:
        """Shares with the runs counted `weights` (b, r) times; leading axis b."""

        def total(counts: Floats) -> Floats:
            flat = weights @ counts.reshape(len(counts), -1)
            return flat.reshape(len(weights), *counts.shape[1:])

        epochs, level = total(self.epochs), total(self.level)
        with np.errstate(invalid="ignore"):
            given = total(self.both) / level
            return TopShares(
                top=total(self.top) / epochs,
                level=level / epochs[:, None, None],
                given=given,
                change=given[..., 1:] - given[..., :1],
                by_cut=total(self.by_cut) / epochs[:, None, None],
            )


# --- the table --------------------------------------------------------------------------------


def marked(table: TruthTable, top: Top) -> Bools:
    """(3,) * n whether the table's output is in the top, one axis a sensor, the first first."""
    return holds(table, top).reshape((3,) * len(table.names))


def fixed_by_table(top: Bools) -> Bools:
    """(n, 3) whether the level of the sensor alone decides the top."""
    found = np.empty((top.ndim, 3), bool)
    for sensor in range(top.ndim):
        rows = np.moveaxis(top, sensor, 0).reshape(3, -1)
        found[sensor] = rows.all(axis=1) | ~rows.any(axis=1)
    return found


def cut_levels(top: Bools) -> Bools | None:
    """Where a minimal cut vector with level s of sensor i holds.

    A cut vector y is a combination in the top; it is minimal if no other one has every sensor
    at the same or a better level; it holds in x if every sensor is at y's level or worse.

    Parameters
    ----------
    top : (3,) * n combinations in the top.

    Returns
    -------
    (n, 2, 3, ..., 3) by sensor and level DA, U; None if the top is not monotone: a sensor that
    gets worse can end it.

    References
    ----------
    Multi-state cut vectors: Natvig 1982; Fussell-Vesely as the share of the top in which a
    minimal cut with the event holds: Fussell 1975.
    """
    n = top.ndim
    minimal = lowest_true(top)
    if minimal is None:
        return None
    found = np.zeros((n, 2, *top.shape), bool)
    for sensor in range(n):
        for level in _LEVELS:
            holds = found[sensor, level - 1]
            np.moveaxis(holds, sensor, 0)[level] = np.moveaxis(minimal, sensor, 0)[level]
            for axis in range(n):
                np.logical_or.accumulate(holds, axis=axis, out=holds)
    return found


# --- independent sensors ----------------------------------------------------------------------


def independent_shares(top: Bools, marginals: Floats) -> TopShares:
    """Shares of the top when the sensors' states are independent, by summing all combinations.

    Parameters
    ----------
    top : (3,) * n combinations in the top.
    marginals : (n, 3) P(x_i = s) [1].

    Notes
    -----
    All sums but those of `change` of a top that is not monotone have positive terms only: rare
    tops keep their digits.
    """
    n = top.ndim
    given, change = np.empty((n, 3)), np.empty((n, 2))
    signed = top.astype(float)
    for sensor in range(n):
        given[sensor] = _averaged(signed, marginals, keep=sensor)
        rows = np.moveaxis(signed, sensor, 0)
        against_nominal = np.moveaxis(rows - rows[N], 0, sensor)
        change[sensor] = _averaged(against_nominal, marginals, keep=sensor)[1:]
    cuts = cut_levels(top)
    by_cut = np.full((n, 2), np.nan)
    if cuts is not None:
        for place in np.ndindex(n, 2):
            by_cut[place] = _averaged(cuts[place].astype(float), marginals)
    return TopShares(
        top=_averaged(signed, marginals), level=marginals, given=given, change=change, by_cut=by_cut
    )


def _averaged(values: Floats, marginals: Floats, *, keep: int = -1) -> Floats:
    """Mean over all axes but `keep`, the last axis first so that the numbers of others stay."""
    for axis in reversed(range(values.ndim)):
        if axis != keep:
            values = np.tensordot(values, marginals[axis], axes=([axis], [0]))
    return np.asarray(values)


def checked_marginals(marginals: Floats, names: tuple[str, ...]) -> Floats:
    """(n, 3) probabilities of N, DA and U of each sensor, or InputError."""
    array = np.asarray(marginals, dtype=float)
    cure = "a row (P(N), P(DA), P(U)) for each of " + ", ".join(names)
    if array.shape != (len(names), 3):
        raise InputError(
            "marginals have a row a sensor and a column a state",
            where="marginals", evidence=f"shape {array.shape}", cure=cure,
        )  # fmt: skip
    wrong = ~((array >= 0.0).all(axis=1) & (np.abs(array.sum(axis=1) - 1.0) <= _SUM_TOLERANCE))
    if wrong.any():
        at = int(np.argmax(wrong))
        raise InputError(
            "probabilities of the states of a sensor are 0 or more and add up to 1",
            where=f"marginals of {names[at]}", evidence=str(array[at].tolist()), cure=cure,
        )  # fmt: skip
    return array


# --- counted in runs --------------------------------------------------------------------------


def run_counts(
    table_top: Bools, happened: Bools, states: States, codes: Counts, known: Bools
) -> RunCounts:
    """Count, run by run, epochs of levels, of the top and of both.

    Parameters
    ----------
    table_top : (3,) * n combinations in the table's top, whose cut vectors are counted.
    happened : (t, r) the top, be it the table's or the simulated one.
    states : (n, t, r) codes of the states.
    codes : (t, r) of the combinations, any where not known.
    known : (t, r) epochs that count.
    """
    n, runs = len(states), known.shape[1]
    happened = happened & known
    level, both = np.empty((runs, n, 3)), np.empty((runs, n, 3))
    for sensor, code in np.ndindex(n, 3):
        at_level = known & (states[sensor] == code)
        level[:, sensor, code] = at_level.sum(axis=0)
        both[:, sensor, code] = (at_level & happened).sum(axis=0)
    by_cut = np.full((runs, n, 2), np.nan)
    cuts = cut_levels(table_top)
    if cuts is not None:
        for place in np.ndindex(n, 2):
            by_cut[:, *place] = (cuts[place].ravel()[codes] & happened).sum(axis=0)
    epochs = known.sum(axis=0).astype(float)
    return RunCounts(epochs, level, happened.sum(axis=0).astype(float), both, by_cut)
