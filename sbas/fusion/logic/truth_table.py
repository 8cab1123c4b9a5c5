"""A truth table of sensor states: what the output is in each combination, and what it obeys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.logic.interval_rules import (
    MAX_SENSORS,
    TOLERANCE_M,
    IntervalRule,
    interval_outcomes,
    output_intervals,
)
from sbas.fusion.states import (
    DA,
    DEFAULT_THRESHOLDS,
    LETTERS,
    NO_DATA,
    WORDS,
    N,
    States,
    U,
    combination_codes,
    combination_states,
    combination_words,
)

Codes = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class TruthTable:
    """State of the output in every combination of sensor states.

    Parameters
    ----------
    names : (n,) sensors, at most 12.
    outcomes : (3^n,) codes N, DA or U in the order of the combination codes; kept read-only.
    provenance : where the outcomes come from.

    Raises
    ------
    InputError : names that repeat, or a wrong number of outcomes, or one that is no state.
    """

    names: tuple[str, ...]
    outcomes: States
    provenance: str

    def __post_init__(self) -> None:
        n = len(self.names)
        if not 1 <= n <= MAX_SENSORS or len(set(self.names)) != n:
            raise InputError(
                f"a truth table has 1 to {MAX_SENSORS} sensors of different names",
                where="names",
                evidence=f"{self.names}",
            )
        given = np.asarray(self.outcomes)
        if given.shape != (3**n,) or not np.all(np.isin(given, (N, DA, U))):
            raise InputError(
                f"{n} sensors have {3**n} outcomes, each N, DA or U",
                where="outcomes",
                evidence=f"shape {given.shape}, codes {np.unique(given)[:6].tolist()}",
                cure="0 is N, 1 is DA, 2 is U",
            )
        outcomes = given.astype(np.int8)
        outcomes.flags.writeable = False
        object.__setattr__(self, "outcomes", outcomes)

    def outcome(self, states: Sequence[int]) -> int:
        """State of the output in one combination, given by its states in order."""
        if len(states) != len(self.names):
            raise InputError(
                f"a combination has {len(self.names)} states", where="states", evidence=f"{states}"
            )
        code = int(combination_codes(np.array(states, np.int8)))
        if code < 0:
            raise InputError(
                "a truth table says nothing without data", where="states", evidence=f"{states}"
            )
        return int(self.outcomes[code])

    def counts(self) -> tuple[int, int, int]:
        """Combinations whose output is N, DA and U."""
        found = np.bincount(self.outcomes, minlength=3)
        return int(found[N]), int(found[DA]), int(found[U])

    def frame(self) -> pd.DataFrame:
        """A row a combination: the state of each sensor, and of the output."""
        states = combination_states(np.arange(self.outcomes.size), len(self.names))
        words = np.array([WORDS[N], WORDS[DA], WORDS[U]], object)
        columns = {name: words[row] for name, row in zip(self.names, states, strict=True)}
        return pd.DataFrame(columns).assign(output=words[self.outcomes])


# --- where tables come from -------------------------------------------------------------------


def table_from_rule(
    names: Sequence[str],
    weights: ArrayLike,
    *,
    rule: IntervalRule = "tree_bounds",
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    unacceptable_end_m: float = math.inf,
    output_thresholds: Thresholds | None = None,
) -> TruthTable:
    """The table of an interval rule; options as in `interval_rules.interval_outcomes`."""
    outcomes = interval_outcomes(
        rule,
        weights,
        thresholds=thresholds,
        unacceptable_end_m=unacceptable_end_m,
        output_thresholds=output_thresholds,
    )
    shown = ", ".join(f"{w:.4g}" for w in np.asarray(weights, dtype=np.float64))
    bounds = thresholds if output_thresholds is None else output_thresholds
    return TruthTable(
        tuple(names),
        outcomes,
        f"rule {rule}: weights {shown}; beta {thresholds.nominal_m:g} m, AL "
        f"{thresholds.alert_limit_m:g} m, X {unacceptable_end_m:g} m"
        + ("" if bounds is thresholds else f"; output {bounds.nominal_m:g} m and "
           f"{bounds.alert_limit_m:g} m"),
    )  # fmt: skip


def table_from_letters(names: Sequence[str], letters: str, *, provenance: str) -> TruthTable:
    """A table written as one letter a combination, in the order of the codes; blanks are free.

    Parameters
    ----------
    names : (n,) sensors.
    letters : 3^n of "N", "D" (for DA) and "U".
    provenance : where they come from.

    Raises
    ------
    InputError : another letter, or a wrong number of them.
    """
    packed = "".join(letters.split())
    outcomes = np.array([LETTERS.get(letter, NO_DATA) for letter in packed], np.int8)
    if np.any(outcomes == NO_DATA):
        raise InputError(
            f"{packed[int(np.argmin(outcomes))]!r} is no state",
            where="letters",
            cure="N, D (for DA) or U each",
        )
    return TruthTable(tuple(names), outcomes, provenance)


def table_from_outcomes(
    names: Sequence[str], outcomes: Mapping[tuple[int, ...], int], *, provenance: str
) -> TruthTable:
    """A table from the output of each combination, such as {(N, N, U): DA, ...}.

    Parameters
    ----------
    names : (n,) sensors.
    outcomes : state of the output for every combination of n states.
    provenance : where they come from.

    Raises
    ------
    InputError : combinations that are missing, or of another length.
    """
    n = len(names)
    wrong = [states for states in outcomes if len(states) != n]
    if wrong:
        raise InputError(
            f"a combination of {n} sensors has {n} states", where="outcomes", evidence=f"{wrong[0]}"
        )
    found = {int(combination_codes(np.array(s, np.int8))): out for s, out in outcomes.items()}
    missing = sorted(set(range(3**n)) - found.keys())
    if missing or len(found) > 3**n:
        shown = ", ".join(combination_words(code, n) for code in missing[:4])
        raise InputError(
            f"{len(missing)} of {3**n} combinations have no outcome, or one has no data",
            where="outcomes",
            evidence=f"missing {shown}",
            cure="give an outcome to each",
        )
    return TruthTable(tuple(names), np.array([found[c] for c in range(3**n)]), provenance)


# --- what they obey ---------------------------------------------------------------------------


def monotony_violations(table: TruthTable) -> Codes:
    """Pairs of combinations where one sensor gets one level worse and the output gets better.

    Parameters
    ----------
    table : truth table.

    Returns
    -------
    (m, 2) codes, better input first, in order; none for a monotone table.
    """
    n = len(table.names)
    codes = np.arange(3**n).reshape((3,) * n)
    shaped = table.outcomes.reshape((3,) * n)
    pairs = []
    for axis in range(n):
        better = np.diff(shaped, axis=axis) < 0
        first = np.take(codes, (N, DA), axis=axis)[better]
        pairs.append(np.column_stack([first, first + 3 ** (n - 1 - axis)]))
    found = np.concatenate(pairs).astype(np.int64)
    return found[np.lexsort(found.T[::-1])]


def is_symmetric(table: TruthTable) -> bool:
    """Whether the output depends only on how many sensors are in each state."""
    n = len(table.names)
    shaped = table.outcomes.reshape((3,) * n)
    # Exchanges of neighbours generate every order of the sensors.
    return all(np.array_equal(shaped, shaped.swapaxes(k, k + 1)) for k in range(n - 1))


def differences(first: TruthTable, second: TruthTable) -> Codes:
    """Codes of the combinations in which two tables differ.

    Raises
    ------
    InputError : tables of other sensors, or in another order.
    """
    if first.names != second.names:
        raise InputError(
            "the tables are of different sensors",
            where="second",
            evidence=f"{first.names} and {second.names}",
            cure="dataclasses.replace(second, names=first.names) where they mean the same",
        )
    return np.flatnonzero(first.outcomes != second.outcomes).astype(np.int64)


def critical_by_midpoint(
    table: TruthTable,
    weights: ArrayLike,
    *,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    unacceptable_end_m: float,
) -> Codes:
    """Combinations with output DA whose interval has its middle at the alert limit or beyond.

    Parameters
    ----------
    table : truth table.
    weights : (n,) of the mean, not negative, with sum 1.
    thresholds : beta and AL.
    unacceptable_end_m : X, the largest error in state U [m].

    Returns
    -------
    Codes in order. Of the corrected Figure 9 at equal weights there are 15 for 8.0 m <= X <
    10.5 m, as the paper counts.

    Raises
    ------
    InputError : as `interval_rules.output_intervals`; another number of weights than sensors.

    References
    ----------
    Railways 2014, section 3.3.
    """
    lowest, highest = output_intervals(
        weights, thresholds=thresholds, unacceptable_end_m=unacceptable_end_m
    )
    if lowest.size != table.outcomes.size:
        raise InputError(
            "there must be a weight for each sensor",
            where="weights",
            evidence=f"{np.size(weights)} weights, {len(table.names)} sensors",
        )
    beyond = (lowest + highest) / 2 >= thresholds.alert_limit_m - TOLERANCE_M
    return np.flatnonzero(beyond & (table.outcomes == DA)).astype(np.int64)
