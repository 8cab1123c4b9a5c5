"""Does a simulation agree with an exact solution, row by row, as far as it can tell?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy import special

from sbas.dependability.exact.solution import Solution
from sbas.dependability.simulation.simulation_result import SimulatedRow, Simulation
from sbas.dependability.simulation.slot_simulation import simulate_model
from sbas.dependability.tree.model import HybridFaultTree
from sbas.exceptions import InputError

Verdict = Literal["agrees", "disagrees", "not tested"]

Measure = Literal["mean", "first_passage"]
MEASURES: tuple[Measure, Measure] = ("mean", "first_passage")

LEAST_HITS = 30
"""Histories for the Gaussian law of z: fewer test nothing."""

LEVEL = 0.0005
"""One-sided probability that right results fail at all, shared among the rows."""


@dataclass(frozen=True)
class Comparison:
    """One measure of one row.

    Parameters
    ----------
    name, measure : of the row; "mean" or "first_passage".
    exact, simulated, standard_error : figures [1].
    z : (simulated - exact)/standard_error; None where it has no Gaussian law.
    hits : histories in which the row was true at an epoch that counts.
    bound : where not tested, 95 % upper bound on the true value from the number of hits [1].
    verdict : "not tested" also where histories too rare to be seen could explain the difference.
    """

    name: str
    measure: Measure
    exact: float
    simulated: float
    standard_error: float
    z: float | None
    hits: int
    bound: float | None
    verdict: Verdict


@dataclass(frozen=True)
class Agreement:
    """All comparisons.

    Parameters
    ----------
    comparisons : one a row and measure.
    limit : on |z|.
    histories : simulated.
    repeated : whether this is the repetition after a first failure.
    """

    comparisons: tuple[Comparison, ...]
    limit: float
    histories: int
    repeated: bool = False

    @property
    def agrees(self) -> bool:
        """Whether nothing disagrees and something was tested."""
        verdicts = {c.verdict for c in self.comparisons}
        return "disagrees" not in verdicts and "agrees" in verdicts

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "agrees": self.agrees,
            "histories": self.histories,
            "repeated": self.repeated,
            "z_limit": self.limit,
            "comparisons": [asdict(c) for c in self.comparisons],
        }

    def summary(self) -> pd.DataFrame:
        """A row a comparison."""
        return pd.DataFrame([asdict(c) for c in self.comparisons])


def agreement(exact: Mapping[str, tuple[float, float | None]], simulation: Simulation) -> Agreement:
    """Compare exact means and first passages with simulated ones.

    Parameters
    ----------
    exact : by name of the row: mean and F [1]; F None is not compared.
    simulation : with these rows; the mean by the same rule.

    Returns
    -------
    Agreement.

    Raises
    ------
    InputError : nothing to compare.
    KeyError : a name that was not simulated.

    Notes
    -----
    z is used where 30 histories or more hit the row and 30 or more did not (F), or were not
    true throughout (mean). It fails beyond Phi^-1(1 - 0.0005/m), m the number of z-values. With
    fewer hits h, P(hits <= h) is at most Q(h + 1, F/r), r the largest weight over histories of a
    stratum where the row is possible: below 0.0005/m the row disagrees, else it is not tested.

    References
    ----------
    Bonferroni's inequality; Poisson tail by the incomplete gamma function (Abramowitz and Stegun
    26.4.21); lower tails of a sum of Bernoulli variables: Hoeffding 1956.
    """
    wanted = [
        (simulation.row(name), measure, value)
        for name, (mean, passage) in exact.items()
        for measure, value in zip(MEASURES, (mean, passage), strict=True)
        if value is not None
    ]
    if not wanted:
        raise InputError("no row to compare", where="exact")
    tested = sum(_can_test(row, measure, simulation) for row, measure, _ in wanted)
    limit = -float(special.ndtri(LEVEL / max(tested, 1)))
    level = LEVEL / len(wanted)
    comparisons = tuple(
        _compare(row, measure, value, simulation, limit, level) for row, measure, value in wanted
    )
    return Agreement(comparisons, limit, simulation.histories)


def check_by_simulation(
    model: HybridFaultTree,
    solution: Solution,
    rng: np.random.Generator,
    *,
    histories: int = 40_000,
) -> Agreement:
    """Simulate a model and compare; where something disagrees, once more with 10 times as many.

    Parameters
    ----------
    model, solution : the model and its exact solution.
    rng : source of all randomness; the repetition has other seeds.
    histories : of the first simulation.

    Returns
    -------
    Agreement of the first simulation, or of the repetition: its limit is not widened.

    Raises
    ------
    InputError : the mean rule is "integral", which the simulation does not read.
    """
    exact = {row.name: (row.mean_unavailability, row.at_least_once)
             for row in solution.rows.values()}  # fmt: skip
    first = agreement(exact, simulate_model(model, histories=histories, rng=rng))
    if all(c.verdict != "disagrees" for c in first.comparisons):
        return first
    second = agreement(exact, simulate_model(model, histories=10 * histories, rng=rng))
    return Agreement(second.comparisons, second.limit, second.histories, repeated=True)


def _hits(row: SimulatedRow, measure: Measure) -> tuple[int, ...]:
    """For each stratum, histories that raise the measure above 0."""
    return row.sometimes if measure == "mean" else row.hits


def _others(row: SimulatedRow, measure: Measure, simulation: Simulation) -> tuple[int, ...]:
    """For each stratum, histories that keep the measure below 1."""
    full = row.always if measure == "mean" else row.hits
    return tuple(s.histories - n for s, n in zip(simulation.strata, full, strict=True))


def _can_test(row: SimulatedRow, measure: Measure, simulation: Simulation) -> bool:
    others = _others(row, measure, simulation)
    return min(sum(_hits(row, measure)), sum(others)) >= LEAST_HITS


def _most(hits: int, level: float) -> float:
    """Largest mean of a Poisson variable that gives so few with at least this probability."""
    return float(special.gammainccinv(hits + 1, level))


def _unseen(
    row: SimulatedRow, measure: Measure, simulation: Simulation, above: bool, level: float
) -> float:
    """How much strata whose histories were nearly all alike may add to a row, or take from it."""
    found = row.unsampled if above else 0.0
    seen = _hits(row, measure) if above else _others(row, measure, simulation)
    for stratum, possible, few in zip(simulation.strata, row.possible, seen, strict=True):
        if possible and few < LEAST_HITS:
            found += stratum.weight / stratum.histories * _most(few, level)
    return found


def _compare(
    row: SimulatedRow,
    measure: Measure,
    exact: float,
    simulation: Simulation,
    limit: float,
    level: float,
) -> Comparison:
    value: float = getattr(row, measure)
    error: float = getattr(row, f"{measure}_se")
    hits = sum(_hits(row, measure))
    scales = [
        stratum.weight / stratum.histories if possible else 0.0
        for stratum, possible in zip(simulation.strata, row.possible, strict=True)
    ]
    coarsest = max(scales, default=0.0)
    z = bound = None
    verdict: Verdict = "not tested"
    if _can_test(row, measure, simulation):
        # A row that is the same in every history has no error but rounding.
        error = max(error, 1e-12 * value)
        z = (value - exact) / error
        if abs(z) <= limit:
            verdict = "agrees"
        elif abs(value - exact) > limit * error + _unseen(row, measure, simulation, z < 0, level):
            verdict = "disagrees"
        else:
            z = None
    elif hits < LEAST_HITS:
        bound = coarsest * _most(hits, 0.05) + row.unsampled
        if exact > coarsest * _most(hits, level) + row.unsampled:
            verdict = "disagrees"
    elif len(scales) == 1:
        others = sum(_others(row, measure, simulation))
        # Histories outside the one stratum were not simulated: they are no part of its rest.
        if simulation.strata[0].weight - exact > coarsest * _most(others, level):
            verdict = "disagrees"
    return Comparison(row.name, measure, exact, value, error, z, hits, bound, verdict)
