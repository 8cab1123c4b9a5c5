"""What a simulation of a hybrid fault tree or of a Petri net says about each row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

MEASURES = ("mean", "at_end", "first_passage", "occurrences")


@dataclass(frozen=True)
class Stratum:
    """Histories drawn under one condition.

    Parameters
    ----------
    failing : components that fail at least once.
    never : components that do not fail; all others are free.
    weight : probability of the condition [1].
    histories : number drawn.
    """

    failing: tuple[str, ...]
    never: tuple[str, ...]
    weight: float
    histories: int


@dataclass(frozen=True)
class SimulatedRow:
    """Estimates of one event, gate or observed expression, each with its standard error.

    Parameters
    ----------
    name : of the row.
    mean, mean_se : share of the mission in which it is true [1].
    at_end, at_end_se : probability at the last epoch [1].
    first_passage, first_passage_se : probability to be true at least once, F [1].
    occurrences, occurrences_se : expected number of times that it turns true, W [1].
    hits : for each stratum, histories in which it was true at least once.
    sometimes, always : for each stratum, histories whose share is above 0, is 1.
    possible : for each stratum, whether the row can be true there at all.
    unsampled : probability of the strata that were not drawn although the row can be true
        there [1]: the true mean and F exceed the estimates by at most that.
    """

    name: str
    mean: float
    mean_se: float
    at_end: float
    at_end_se: float
    first_passage: float
    first_passage_se: float
    occurrences: float
    occurrences_se: float
    hits: tuple[int, ...]
    sometimes: tuple[int, ...]
    always: tuple[int, ...]
    possible: tuple[bool, ...]
    unsampled: float = 0.0


@dataclass(frozen=True)
class PlaceMean:
    """Mean number of tokens of a place over time, and its standard error."""

    name: str
    tokens: float
    tokens_se: float


@dataclass(frozen=True)
class Simulation:
    """Result of `simulate_model` or `simulate_net`.

    Parameters
    ----------
    name : of the model or the net.
    mean_rule : how `mean` is read: an option of the model, or "time" for the share of time.
    strata : what was drawn; one with weight 1 where nothing was forced.
    rows : estimates.
    epochs : of one history; 0 for a net.
    firings : of all transitions of a net; 0 for a model.
    places : of a net.
    """

    name: str
    mean_rule: str
    strata: tuple[Stratum, ...]
    rows: tuple[SimulatedRow, ...]
    epochs: int = 0
    firings: int = 0
    places: tuple[PlaceMean, ...] = ()

    @property
    def histories(self) -> int:
        """Number drawn in all strata."""
        return sum(stratum.histories for stratum in self.strata)

    def row(self, name: str) -> SimulatedRow:
        """Estimates of one row.

        Raises
        ------
        KeyError : no row of that name.
        """
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    def summary(self) -> pd.DataFrame:
        """A row a name: the four measures, their standard errors, histories that hit."""
        columns = [part for key in MEASURES for part in (key, f"{key}_se")]
        return pd.DataFrame(
            [[getattr(r, c) for c in columns] + [sum(r.hits), r.unsampled] for r in self.rows],
            columns=[*columns, "histories_hit", "unsampled"],
            index=pd.Index([r.name for r in self.rows], name="row"),
        )


class Tally:
    """Sums over the histories of one stratum, from which means and variances follow."""

    def __init__(self, rows: int) -> None:
        self.histories = 0
        self.sums = np.zeros((len(MEASURES), rows))
        self.squares = np.zeros((len(MEASURES), rows))
        self.hits = np.zeros(rows, np.int64)
        self.sometimes = np.zeros(rows, np.int64)
        self.always = np.zeros(rows, np.int64)

    def add(
        self,
        mean: NDArray[np.float64],
        at_end: NDArray[np.bool_],
        hit: NDArray[np.bool_],
        occurrences: NDArray[np.int64],
    ) -> None:
        """Add histories: (histories, rows) arrays of each measure."""
        self.histories += len(mean)
        for i, values in enumerate((mean, at_end, hit, occurrences)):
            values = values.astype(np.float64)
            self.sums[i] += values.sum(axis=0)
            self.squares[i] += np.square(values).sum(axis=0)
        self.hits += hit.sum(axis=0)
        self.sometimes += (mean > 0.0).sum(axis=0)
        self.always += (mean >= 1.0).sum(axis=0)

    def moments(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Means and variances of the means, each (measures, rows)."""
        n = self.histories
        means = self.sums / n
        variances = (self.squares / n - np.square(means)).clip(min=0.0) / max(n - 1, 1)
        return means, variances


def estimate_rows(
    names: Sequence[str],
    strata: Sequence[Stratum],
    tallies: Sequence[Tally],
    *,
    possible: NDArray[np.bool_],
    unsampled: NDArray[np.float64],
) -> tuple[SimulatedRow, ...]:
    """Join the strata: sum of w mean, and of w^2 variance.

    Parameters
    ----------
    names : of the rows.
    strata, tallies : what was drawn and what came of it.
    possible : (strata, rows) whether a row can be true in a stratum.
    unsampled : (rows,) weight of strata not drawn in which a row can be true [1].

    References
    ----------
    Cochran 1977, Sampling Techniques, 5.3 and 5.4: stratified mean and its variance.
    """
    values = np.zeros((len(MEASURES), len(names)))
    variances = np.zeros_like(values)
    for stratum, tally in zip(strata, tallies, strict=True):
        mean, variance = tally.moments()
        values += stratum.weight * mean
        variances += stratum.weight**2 * variance
    figures = np.stack([values, np.sqrt(variances)], axis=1).reshape(2 * len(MEASURES), -1)
    keys = [part for key in MEASURES for part in (key, f"{key}_se")]
    return tuple(
        SimulatedRow(
            name=name,
            **dict(zip(keys, figures[:, j].tolist(), strict=True)),
            hits=tuple(int(t.hits[j]) for t in tallies),
            sometimes=tuple(int(t.sometimes[j]) for t in tallies),
            always=tuple(int(t.always[j]) for t in tallies),
            possible=tuple(bool(p) for p in possible[:, j]),
            unsampled=float(unsampled[j]),
        )
        for j, name in enumerate(names)
    )
