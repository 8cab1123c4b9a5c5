"""How a figure answers to each parameter: elasticities d ln U / d ln parameter."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from sbas.dependability.analysis.asked_measure import Measure, measured, part_below
from sbas.dependability.analysis.model_parameters import (
    row_parameters,
    scalar_parameters,
    with_parameters,
)
from sbas.dependability.exact.plan import tree_of
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.stochastic_rows import Rows
from sbas.exceptions import ModelError

_STEP = 1e-3
_ROUNDING = 1e-12
"""Relative error of the exact solution."""
_HEADROOM = 0.005
"""Share of 1 - p that the largest step may take of a probability p."""


@dataclass(frozen=True)
class Elasticity:
    """Relative change of the figure for a relative change of one parameter.

    Parameters
    ----------
    parameter : name, as in `model_parameters`; `<source>.<from> -> <to>` scales the probability
        of that move, the rest of the row gives way in proportion.
    value : of the parameter [1/h or 1]; None where phases of one state move differently.
    elasticity : d ln U / d ln parameter [1].
    error : estimate of its numerical error: truncation and rounding [1].
    """

    parameter: str
    value: float | None
    elasticity: float
    error: float


@dataclass(frozen=True)
class Sensitivities:
    """Elasticities of a figure, the largest first.

    Parameters
    ----------
    of : event or gate.
    measure : which of its measures.
    value : of that measure [1 or 1/h].
    rows : a parameter each.
    left_out : parameters at 0, or probabilities at 1: they have no elasticity.
    """

    of: str
    measure: Measure
    value: float
    rows: tuple[Elasticity, ...]
    left_out: tuple[str, ...]

    def __getitem__(self, parameter: str) -> Elasticity:
        return next(row for row in self.rows if row.parameter == parameter)

    def summary(self) -> pd.DataFrame:
        """A row for each parameter."""
        columns = list(Elasticity.__dataclass_fields__)
        frame = pd.DataFrame([asdict(row) for row in self.rows], columns=columns)
        return frame.set_index("parameter")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "of": self.of,
            "measure": self.measure,
            "value": self.value,
            "elasticities": [asdict(row) for row in self.rows],
            "left_out": list(self.left_out),
        }


def sensitivities(
    model: HybridFaultTree, *, measure: Measure = "mean", of: str | None = None
) -> Sensitivities:
    """Elasticity of a figure to every rate, probability and move of a source below it.

    Parameters
    ----------
    model : any.
    measure : which figure.
    of : event or gate; None is the top.

    Returns
    -------
    Sensitivities. Parameters that change together (one repair rate for all) have the sum of
    their elasticities.

    Raises
    ------
    ModelError : the figure is 0: it has no logarithm.

    Notes
    -----
    With D(h) = ln(U(p e^h)/U(p e^-h))/(2 h): (4 D(h) - D(2 h))/3, h = 1e-3 or what leaves a
    probability below 1. The error is (D(h) - D(2 h))/3, that of the uncorrected D(h), and the
    rounding of U over h. Delays and counts are whole epochs and have no derivative.

    References
    ----------
    Richardson 1911 (extrapolation); elasticity as "criticality importance of a parameter":
    Birnbaum 1969.
    """
    part = part_below(model, of)
    below = tree_of(part).supports[part.top]
    part = replace(
        part,
        components=tuple(c for c in part.components if c.name in below),
        sources=tuple(s for s in part.sources if s.name in below),
    )

    def figure(changed: HybridFaultTree) -> float:
        return measured(changed, [part.top], measure)[part.top]

    value = figure(part)
    if value == 0.0:
        raise ModelError("a figure of zero has no elasticity", where=f"{measure} of {part.top}")
    rows, left_out = [], []
    for name, at in scalar_parameters(part).items():
        most = math.inf if name.endswith("_per_h") else 1.0
        if not 0.0 < at < most:
            left_out.append(name)
            continue

        def scaled(factor: float, name: str = name, at: float = at) -> HybridFaultTree:
            return with_parameters(part, {name: at * factor})

        step = _STEP if most == math.inf else _step_below_one(at)
        rows.append(Elasticity(name, at, *_slope(lambda f, s=scaled: figure(s(f)), step)))  # type: ignore[misc]
    for name, (source, matrix) in row_parameters(part).items():
        for origin in dict.fromkeys(source.states):
            for to in dict.fromkeys(source.states):
                move = f"{name.removesuffix('.rows')}.{origin} -> {to}"
                mask = np.outer(
                    [s == origin for s in source.states], [s == to for s in source.states]
                )
                chances = (np.array(matrix) * mask).sum(axis=1)
                free = chances[(chances > 0.0) & (chances < 1.0)]
                if not free.size:
                    left_out.append(move)
                    continue

                def moved(
                    factor: float,
                    name: str = name,
                    matrix: Rows = matrix,
                    mask: np.ndarray[Any, np.dtype[np.bool_]] = mask,
                ) -> HybridFaultTree:
                    return with_parameters(part, {}, {name: _scaled_rows(matrix, mask, factor)})

                slope = _slope(lambda f, m=moved: figure(m(f)), _step_below_one(float(free.max())))  # type: ignore[misc]
                one = float(free[0]) if np.all(free == free[0]) else None
                rows.append(Elasticity(move, one, *slope))
    rows.sort(key=lambda row: -abs(row.elasticity))
    return Sensitivities(part.top, measure, value, tuple(rows), tuple(left_out))


def _step_below_one(p: float) -> float:
    return min(_STEP, _HEADROOM * (1.0 - p) / p)


def _slope(figure: Callable[[float], float], step: float) -> tuple[float, float]:
    """d ln figure / d ln factor at 1, and an estimate of its error."""

    def difference(h: float) -> float:
        up, down = figure(math.exp(h)), figure(math.exp(-h))
        # log1p: the ratio is near 1.
        return math.log1p((up - down) / down) / (2.0 * h)

    near, far = difference(step), difference(2.0 * step)
    return (4.0 * near - far) / 3.0, abs(near - far) / 3.0 + _ROUNDING / step


def _scaled_rows(rows: Rows, mask: np.ndarray[Any, np.dtype[np.bool_]], factor: float) -> Rows:
    """Entries of the mask times a factor, the others of the row in proportion to keep its sum."""
    table = np.array(rows, dtype=float)
    for row, chosen in zip(table, mask, strict=True):
        p = row[chosen].sum()
        if 0.0 < p < 1.0:
            rest = row[~chosen].sum()
            row[chosen] *= factor
            row[~chosen] *= (1.0 - p * factor) / rest
    return tuple(tuple(row) for row in table.tolist())
