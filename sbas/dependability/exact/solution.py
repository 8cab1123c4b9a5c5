"""What the exact solver answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from sbas.dependability.exact.transitions import Floats
from sbas.dependability.tree.model import HybridFaultTree
from sbas.findings import Finding


@dataclass(frozen=True)
class SolutionRow:
    """Measures of an event or gate over the mission.

    Parameters
    ----------
    name : of the event or gate.
    mean_unavailability : share of the mission in which it is true, expected [1].
    at_start, at_end : probability to be true at epoch 0, at epoch N [1].
    at_least_once : probability to be true at some epoch 1..N [1]; None where not asked for.
    occurrences : expected number of times that it becomes true [1].
    mean_duration_s : mean_unavailability times mission over occurrences [s]; None where it never
        becomes true.
    method : how it was obtained: "chain" (read off the states), "window" (runs by powers of
        P_BB), "look-back" (product over as many epochs as the gates remember), "product"
        (product over the mission), "modules" (independent parts put together), "doubling"
        (squares of the transition matrix, for long missions).
    states : of the largest chain that was built for it.
    """

    name: str
    mean_unavailability: float
    at_start: float
    at_end: float
    at_least_once: float | None
    occurrences: float
    mean_duration_s: float | None
    method: str
    states: int


@dataclass(frozen=True)
class Solution:
    """Exact measures of a hybrid fault tree.

    Parameters
    ----------
    model : that was solved, with its options.
    rows : by name of event or gate.
    curves : by name, (N + 1,) probability to be true at each epoch; empty where not asked for.
    passage_curves : by name, (N + 1,) probability to have been true by each epoch; empty where
        not asked for.
    findings : warnings of the model check.
    """

    model: HybridFaultTree
    rows: Mapping[str, SolutionRow]
    curves: Mapping[str, Floats]
    passage_curves: Mapping[str, Floats]
    findings: tuple[Finding, ...] = ()

    @property
    def top(self) -> SolutionRow:
        """Row of the top."""
        return self.rows[self.model.top]

    @property
    def availability(self) -> float:
        """Complement of the mean unavailability of the top [1]."""
        return 1.0 - self.top.mean_unavailability

    def occurrences_per_h(self, name: str) -> float:
        """Expected occurrences over the mission [1/h], to compare with a tolerable hazard rate."""
        return self.rows[name].occurrences * 3600.0 / self.model.mission_s

    def summary(self) -> pd.DataFrame:
        """A row for each event and gate."""
        frame = pd.DataFrame([vars(row) for row in self.rows.values()])
        return frame.set_index("name")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without curves."""
        return {
            "model": self.model.name,
            "step_s": self.model.step_s,
            "mission_s": self.model.mission_s,
            "options": vars(self.model.options),
            "rows": [dict(vars(row)) for row in self.rows.values()],
        }
