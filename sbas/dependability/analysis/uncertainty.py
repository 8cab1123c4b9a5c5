"""How sure a figure is: laws of the parameters, drawn together, through the exact solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from sbas.dependability.analysis.asked_measure import Measure, measured
from sbas.dependability.analysis.model_parameters import (
    check_known,
    row_parameters,
    scalar_parameters,
    with_parameters,
)
from sbas.dependability.analysis.parameter_laws import (
    DirichletRows,
    Fixed,
    Law,
    law_of,
)
from sbas.dependability.exact.transitions import Floats
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.stochastic_rows import Rows
from sbas.estimate import Estimate
from sbas.exceptions import InputError

_BATCHES = 10
_FEWEST = 100
_QUANTILES = (0.05, 0.5, 0.95)

Progress = Callable[[int, int], None]
Laws = Mapping[str | tuple[str, ...], Law | Estimate]
"""By name of the parameter; parameters in one tuple share their sample."""


@dataclass(frozen=True)
class UncertainRow:
    """An event's or gate's figure over the samples.

    Parameters
    ----------
    name : of the event or gate.
    nominal : with the model's own parameters.
    mean, p05, p50, p95 : over the samples.
    mean_error, p05_error, p50_error, p95_error : standard errors from the sampling.
    """

    name: str
    nominal: float
    mean: float
    mean_error: float
    p05: float
    p05_error: float
    p50: float
    p50_error: float
    p95: float
    p95_error: float


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Figures under uncertain parameters.

    Parameters
    ----------
    measure : which figure.
    samples : number of parameter sets that were solved.
    rows : an event or gate each.
    drawn : by rate or probability, (samples,) values [1/h or 1].
    values : by event or gate, (samples,) figures.
    """

    measure: Measure
    samples: int
    rows: tuple[UncertainRow, ...]
    drawn: Mapping[str, Floats] = field(repr=False)
    values: Mapping[str, Floats] = field(repr=False)

    def __getitem__(self, name: str) -> UncertainRow:
        return next(row for row in self.rows if row.name == name)

    def summary(self) -> pd.DataFrame:
        """A row for each event and gate."""
        return pd.DataFrame([vars(row) for row in self.rows]).set_index("name")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the samples."""
        rows = [dict(vars(row)) for row in self.rows]
        return {"measure": self.measure, "samples": self.samples, "rows": rows}


def uncertainty(
    model: HybridFaultTree,
    laws: Laws,
    *,
    rng: np.random.Generator,
    names: Sequence[str] | None = None,
    measure: Measure = "mean",
    samples: int = 1000,
    progress: Progress | None = None,
) -> Uncertainty:
    """Propagate uncertain parameters to the top and others, solving exactly for each sample.

    Parameters
    ----------
    model : any.
    laws : what is known of parameters (`model_parameters`), such as {"E.failure_rate_per_h":
        RateFromCounts(2, 1e6), ("A.repair_rate_per_h", "R.repair_rate_per_h"): Lognormal(1/24, 3),
        "O.rows": DirichletRows(chain.dirichlet)}. An Estimate of a rate goes in as it is. The
        parameters of one tuple share their sample; the others are independent.
    rng : source of chance.
    names : events and gates; None is the top.
    measure : which figure.
    samples : parameter sets, 100 or more.
    progress : called with (samples done, samples in all).

    Returns
    -------
    Uncertainty.

    Raises
    ------
    InputError : an unknown parameter, one given twice, a law that does not fit it, too few
        samples.

    Notes
    -----
    Ten independent Latin hypercubes: within one, every parameter takes each of its n/10 slices
    of equal probability once. Standard errors are those of the mean over the ten.

    References
    ----------
    McKay, Beckman, Conover 1979 (Latin hypercube); Iman 1980 (replicated).
    """
    if samples < _FEWEST:
        raise InputError(
            f"at least {_FEWEST} samples", where="samples", evidence=str(samples),
            cure="1000 give the 95 % point to a few percent",
        )  # fmt: skip
    plan = _planned(model, laws)
    asked = [model.top] if names is None else list(dict.fromkeys(names))
    if not asked:
        raise InputError("no event or gate to follow", where="names")
    nominal = measured(model, asked, measure)
    sizes = [len(part) for part in np.array_split(np.arange(samples), _BATCHES)]
    values: dict[str, list[float]] = {name: [] for name in asked}
    drawn: dict[str, list[float]] = {}
    for size in sizes:
        for scalars, rows in _samples(plan, size, rng):
            found = measured(with_parameters(model, scalars, rows), asked, measure)
            for name, value in found.items():
                values[name].append(value)
            for name, value in scalars.items():
                drawn.setdefault(name, []).append(value)
            if progress is not None:
                progress(len(values[asked[0]]), samples)
    arrays = {name: np.array(found) for name, found in values.items()}
    return Uncertainty(
        measure,
        samples,
        tuple(_row(name, nominal[name], arrays[name], sizes) for name in asked),
        {name: np.array(found) for name, found in drawn.items()},
        arrays,
    )


def _row(name: str, nominal: float, values: Floats, sizes: Sequence[int]) -> UncertainRow:
    batches = np.split(values, np.cumsum(sizes)[:-1])

    def error(figures: list[float]) -> float:
        return float(np.std(figures, ddof=1) / math.sqrt(len(figures)))

    points = [float(np.quantile(values, q)) for q in _QUANTILES]
    errors = [error([float(np.quantile(batch, q)) for batch in batches]) for q in _QUANTILES]
    mean, mean_error = float(values.mean()), error([float(batch.mean()) for batch in batches])
    (low, mid, high), (low_error, mid_error, high_error) = points, errors
    return UncertainRow(
        name, nominal, mean, mean_error, low, low_error, mid, mid_error, high, high_error
    )


# --- drawing ----------------------------------------------------------------------------------

_Plan = list[tuple[tuple[str, ...], Law]]


def _planned(model: HybridFaultTree, laws: Laws) -> _Plan:
    """Names and law of each sample, all of them checked."""
    scalars, rows = scalar_parameters(model), row_parameters(model)
    plan: _Plan = []
    seen: set[str] = set()
    for key, given in laws.items():
        names = (key,) if isinstance(key, str) else key
        law = law_of(given, where=", ".join(names))
        for name in names:
            check_known(name, {**scalars, **rows})
            if name in seen:
                raise InputError("two laws of one parameter", where=name)
            seen.add(name)
            _check_fit(name, law, rows[name][1] if name in rows else None)
        plan.append((names, law))
    return plan


def _check_fit(name: str, law: Law, rows: Rows | None) -> None:
    if isinstance(law, DirichletRows):
        if rows is None:
            raise InputError(
                "a law of rows for a single figure", where=name,
                cure="RateFromCounts, Lognormal or Fixed",
            )  # fmt: skip
        if len(rows) != len(law.parameters):
            raise InputError(
                "a law of rows of another size", where=name,
                evidence=f"{len(law.parameters)} states in the law, {len(rows)} in the model",
                cure="count transitions among the source's own states",
            )  # fmt: skip
    elif rows is not None:
        raise InputError(
            "a law of one figure for rows", where=name, cure="DirichletRows(chain.dirichlet)"
        )
    elif not name.endswith("_per_h") and not (isinstance(law, Fixed) and law.value <= 1.0):
        raise InputError(
            "a law of rates for a probability", where=name, cure="Fixed(p), p from 0 to 1"
        )


def _samples(
    plan: _Plan, size: int, rng: np.random.Generator
) -> Iterator[tuple[dict[str, float], dict[str, Rows]]]:
    width = sum(law.columns for _, law in plan)
    uniform = latin_hypercube(size, width, rng)
    scalars: list[tuple[tuple[str, ...], Floats]] = []
    tables: list[tuple[tuple[str, ...], Floats]] = []
    at = 0
    for names, law in plan:
        block = uniform[:, at : at + law.columns]
        at += law.columns
        if isinstance(law, DirichletRows):
            tables.append((names, law.draw(block)))
        else:
            scalars.append((names, law.draw(block)))
    for i in range(size):
        yield (
            {name: float(values[i]) for names, values in scalars for name in names},
            {
                name: tuple(tuple(row) for row in table[i].tolist())
                for names, table in tables
                for name in names
            },
        )


def latin_hypercube(size: int, width: int, rng: np.random.Generator) -> Floats:
    """Points of the unit cube; each column has one in each of `size` equal slices.

    Parameters
    ----------
    size, width : points, columns.
    rng : source of chance.

    Returns
    -------
    (size, width), between 0 and 1, both excluded.

    References
    ----------
    McKay, Beckman, Conover 1979.
    """
    slices = np.argsort(rng.random((size, width)), axis=0)
    points = (slices + rng.random((size, width))) / size
    return np.clip(points, np.nextafter(0.0, 1.0), np.nextafter(1.0, 0.0))
