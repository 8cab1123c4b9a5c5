"""How dependable is the localisation unit? The question, from a model to its answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.solution import Solution, SolutionRow
from sbas.dependability.simulation.agreement import Agreement, check_by_simulation
from sbas.dependability.static.static_tree import StaticTree, top_probability
from sbas.dependability.tree.model import HybridFaultTree
from sbas.findings import Finding


@dataclass(frozen=True)
class Dependability:
    """The answer of `depend`.

    Parameters
    ----------
    solutions : exact measures by environment; one entry for a model without environments.
    agreements : by environment, of the simulation that was asked for.
    findings : of the check of the models.
    """

    solutions: Mapping[str, Solution]
    agreements: Mapping[str, Agreement]
    findings: tuple[Finding, ...]

    @property
    def agrees(self) -> bool:
        """False where a simulation contradicts the exact solution, or could test nothing."""
        return all(agreement.agrees for agreement in self.agreements.values())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON: `top` and `events`, of several environments one level below."""
        plain = {name: self._environment(name) for name in self.solutions}
        findings = [f.to_dict() for f in self.findings]
        if len(plain) == 1:
            return {**next(iter(plain.values())), "findings": findings}
        return {"environments": plain, "findings": findings}

    def _environment(self, name: str) -> dict[str, Any]:
        solution = self.solutions[name]
        plain: dict[str, Any] = {
            "model": solution.model.name,
            "step_s": solution.model.step_s,
            "mission_s": solution.model.mission_s,
            "options": dict(vars(solution.model.options)),
            "notes": list(solution.model.notes),
            "availability": solution.availability,
            "top": {"name": solution.model.top, **_row(solution, solution.top)},
            "events": {row.name: _row(solution, row) for row in solution.rows.values()},
        }
        if name in self.agreements:
            plain["simulation"] = self.agreements[name].to_dict()
        return plain

    def summary(self) -> pd.DataFrame:
        """A row an event and environment."""
        return pd.concat(
            {name: solution.summary() for name, solution in self.solutions.items()},
            names=["environment"],
        )


def _row(solution: Solution, row: SolutionRow) -> dict[str, Any]:
    plain = {key: value for key, value in vars(row).items() if key != "name"}
    return plain | {"occurrences_per_h": solution.occurrences_per_h(row.name)}


def depend(
    models: HybridFaultTree | Mapping[str, HybridFaultTree],
    *,
    first_passage: bool = False,
    simulate: int = 0,
    seed: int = 20130701,
) -> Dependability:
    """How dependable a localisation unit is: exact measures, checked by simulation where asked.

    Parameters
    ----------
    models : one model, or one an environment.
    first_passage : also the probability of "at least once in the mission".
    simulate : histories of an independent simulation held against the exact solution; 0 for none.
    seed : of that simulation.

    Returns
    -------
    Dependability.

    Raises
    ------
    ModelError : a model means nothing.
    InputError : a chain too large for the exact solution; the text names alternatives.

    References
    ----------
    Nguyen, Beugin, Marais, ITST 2013, hal-00930588 (the model and its measures).

    Examples
    --------
    >>> from sbas.dependability import load_models
    >>> urban = depend(load_models("galoroi")["urban"])
    >>> f"{urban.solutions['urban'].top.mean_unavailability:.4e}"
    '1.6386e-04'
    """
    if isinstance(models, HybridFaultTree):
        models = {models.name: models}
    solutions, agreements = {}, {}
    findings: dict[Finding, None] = {}
    for number, (name, model) in enumerate(models.items()):
        solution = solve(model, first_passage=first_passage)
        solutions[name] = solution
        findings |= dict.fromkeys(solution.findings)
        if simulate:
            generator = np.random.default_rng([seed, number])
            agreements[name] = check_by_simulation(model, solution, generator, histories=simulate)
    return Dependability(solutions, agreements, tuple(findings))


def static_answer(tree: StaticTree) -> dict[str, Any]:
    """Plain values of a static tree of fixed probabilities, under the keys of `depend`.

    What is true with a fixed probability is so at the end, on average and at least once alike.
    """
    events = {event.name: event.probability for event in tree.events}
    top = float(top_probability(tree))
    return {
        "model": tree.name,
        "top": {"name": tree.top, **_fixed(top)},
        "events": {name: _fixed(p) for name, p in events.items()},
        "availability": 1.0 - top,
    }


def _fixed(p: float) -> dict[str, float]:
    return {"mean_unavailability": p, "at_end": p, "at_least_once": p}
