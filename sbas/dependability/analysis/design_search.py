"""Which delays and counts meet a hazard target: every point of a grid, solved exactly."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf, prod
from pathlib import Path
from typing import Any

import pandas as pd

from sbas.dependability.analysis.hazard_verdict import hazard_verdict
from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_files import load_model
from sbas.exceptions import InputError, ModelError
from sbas.integrity.counting import is_number

_MOST_POINTS = 100_000


@dataclass(frozen=True)
class DesignPoint:
    """One choice of parameters.

    Parameters
    ----------
    parameters : by name.
    hazard_per_h : occurrences of the hazard per hour, W/T [1/h]; None where refused.
    unavailability : mean of the top over the mission [1]; None where refused.
    meets : whether the hazard rate is below the target.
    refused : why the choice is no model, such as k <= l; empty where it is one.
    """

    parameters: Mapping[str, float]
    hazard_per_h: float | None
    unavailability: float | None
    meets: bool
    refused: str = ""


@dataclass(frozen=True)
class DesignSearch:
    """All points of a grid.

    Parameters
    ----------
    hazard : name of the event or gate.
    target_per_h : rate to stay below [1/h].
    points : in the order of the grid, the last parameter running fastest.
    """

    hazard: str
    target_per_h: float
    points: tuple[DesignPoint, ...]

    @property
    def feasible(self) -> tuple[DesignPoint, ...]:
        """Points that meet the target, most available first."""
        found = [p for p in self.points if p.meets]
        return tuple(sorted(found, key=lambda p: (p.unavailability, p.hazard_per_h)))

    @property
    def pareto_front(self) -> tuple[DesignPoint, ...]:
        """Points that no other beats in hazard rate or unavailability without losing in the
        other; safest first; of equal points all."""
        front: list[DesignPoint] = []
        solved = [p for p in self.points if not p.refused]
        solved.sort(key=lambda p: (p.hazard_per_h, p.unavailability))
        best, best_rate = inf, inf
        for point in solved:
            rate, missing = point.hazard_per_h, point.unavailability
            if rate is None or missing is None:
                continue
            if missing < best or (missing == best and rate == best_rate):
                front.append(point)
                best, best_rate = missing, rate
        return tuple(front)

    def summary(self) -> pd.DataFrame:
        """A row for each point."""
        front = {id(p) for p in self.pareto_front}
        return pd.DataFrame([{**_plain(p), "pareto": id(p) in front} for p in self.points])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "hazard": self.hazard,
            "target_per_h": self.target_per_h,
            "points": self.summary().astype(object).where(lambda f: f.notna(), None).to_dict(
                orient="records"),
        }  # fmt: skip


def _plain(point: DesignPoint) -> dict[str, Any]:
    return {
        **point.parameters,
        "hazard_per_h": point.hazard_per_h,
        "unavailability": point.unavailability,
        "meets": point.meets,
        "refused": point.refused,
    }


def file_parameters(
    path: str | Path, *, environment: str | None = None
) -> Callable[..., HybridFaultTree]:
    """The model of a file as a function of its parameters, for `design_search`.

    Parameters
    ----------
    path, environment : as `load_model`. The receiver stays calibrated to the file's own values:
        the environment does not change with the design.
    """

    def build(**parameters: float) -> HybridFaultTree:
        return load_model(path, environment=environment, parameters=parameters)

    return build


def design_search(
    build: Callable[..., HybridFaultTree],
    grid: Mapping[str, Sequence[float]],
    *,
    target_per_h: float,
    hazard: str = "Case C",
    progress: Callable[[int, int], None] | None = None,
) -> DesignSearch:
    """Solve a model at every point of a grid of parameters.

    Parameters
    ----------
    build : parameters by name to a model, such as `file_parameters("galoroi",
        environment="urban")`.
    grid : values of each parameter, such as `{"k": [4, 5, 6], "l": [1, 2], "T2_s": [30, 60]}`.
    target_per_h : rate that the hazard must stay below [1/h], above 0; a rate of just the target
        does not meet it.
    hazard : event or gate that must not happen.
    progress : told (points done, points in all) after each.

    Returns
    -------
    DesignSearch. A point at which `build` raises ModelError stays in it, refused.

    Raises
    ------
    InputError : an empty grid or one of more than 1e5 points; a target that is no number above 0;
        an unknown parameter or hazard; a point too large to solve exactly.
    """
    if not is_number(target_per_h) or not 0.0 < target_per_h < inf:
        raise InputError(
            "the target is no rate above 0", where="target_per_h", evidence=repr(target_per_h)
        )
    total = prod(len(values) for values in grid.values())
    if not grid or not 0 < total <= _MOST_POINTS:
        raise InputError(
            "a grid has 1 to 100000 points", where="grid", evidence=f"{total} of {[*grid]}"
        )
    points = []
    for done, values in enumerate(product(*grid.values()), start=1):
        point = dict(zip(grid, values, strict=True))
        points.append(_solved(build, point, hazard, target_per_h))
        if progress is not None:
            progress(done, total)
    return DesignSearch(hazard, float(target_per_h), tuple(points))


def _solved(
    build: Callable[..., HybridFaultTree],
    point: dict[str, float],
    hazard: str,
    target_per_h: float,
) -> DesignPoint:
    try:
        model = build(**point)
    except ModelError as error:
        return DesignPoint(point, None, None, False, str(error))
    solution = solve(model, names=(hazard, model.top))
    verdict = hazard_verdict(solution, hazard, thr_per_h=target_per_h)
    return DesignPoint(
        point, verdict.rate_per_h, solution.top.mean_unavailability, bool(verdict.meets)
    )
