"""Which parameters of an architecture drive a figure of its simulation: Sobol indices.

The first index of a parameter is the share of the figure's variance, over the ranges of all
parameters, that goes with it alone; the total index the share that goes with it in any company.
Their difference is interaction. The figure is Monte Carlo itself: the same seed at every point
makes it a function of the parameters, and the indices are of that function.

References
----------
Sobol 1993; Saltelli et al. 2010, Comput. Phys. Commun. 181, Table 2: (b) for the first index and
(f), by Jansen 1999, for the total one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import ndtri

from sbas.exceptions import InputError
from sbas.fusion.architecture.architecture_parameters import with_parameter
from sbas.fusion.architecture.model import Architecture
from sbas.fusion.fused_runs import Floats
from sbas.fusion.states import U
from sbas.numerals import number, percent

Progress = Callable[[int, int], None]

LEAST_POINTS = 8
_CONSTANT = 1e-12
"""Relative spread of the figure below which it is rounding."""
_CHUNK = 1 << 22


@dataclass(frozen=True)
class Parameter:
    """A number of an architecture and the range in which it may lie, all of it alike.

    Parameters
    ----------
    path : such as "gps.multipath.largest", see `architecture_parameters`.
    low, high : ends of the range, in the unit of the field.
    log : the logarithm is uniform, not the number.

    Raises
    ------
    InputError : a range that is empty, not finite, or with `log` not above 0.
    """

    path: str
    low: float
    high: float
    log: bool = False

    def __post_init__(self) -> None:
        finite = math.isfinite(self.low) and math.isfinite(self.high)
        if not (finite and self.low < self.high and (self.low > 0.0 or not self.log)):
            raise InputError(
                "a range has low < high, both finite, and with log above 0",
                where=self.path, evidence=f"low {self.low}, high {self.high}, log {self.log}",
            )  # fmt: skip

    def at(self, quantile: float) -> float:
        """The number at a quantile in [0, 1] of its range."""
        if self.log:
            value = math.exp(math.log(self.low) + quantile * math.log(self.high / self.low))
        else:
            value = self.low + quantile * (self.high - self.low)
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class ParameterIndices:
    """Sobol indices of one parameter [1]; NaN where undefined.

    Estimates scatter: one near zero may come out below it, and is left so.
    """

    path: str
    low: float
    high: float
    log: bool
    first: float
    first_half_width: float
    total: float
    total_half_width: float


@dataclass(frozen=True)
class ParameterSensitivity:
    """Sobol indices of a figure to the parameters of an architecture.

    Parameters
    ----------
    of : the figure.
    rows : in the order of the parameters.
    base_points, evaluations : N, and N (k + 2) points at which the figure was computed.
    mean, sd : of the figure over the ranges, in its unit.
    confidence : of the half-widths, which come from resampled base points: they hold the design's
        chance, not that of the figure's seed.
    undefined : why there are no indices, or empty.
    """

    of: str
    rows: tuple[ParameterIndices, ...]
    base_points: int
    evaluations: int
    mean: float
    sd: float
    seed: int
    confidence: float
    undefined: str = ""

    def summary(self) -> pd.DataFrame:
        """A row for each parameter; NaN where undefined."""
        return pd.DataFrame([vars(row) for row in self.rows]).set_index("path")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is undefined is None."""
        rows = [
            {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in vars(row).items()}
            for row in self.rows
        ]
        return vars(self) | {"rows": rows}

    def __str__(self) -> str:
        lines = [
            f"Sobol indices of {self.of}, mean {number(self.mean)}, standard deviation "
            f"{number(self.sd)}; {self.evaluations} points, seed {self.seed}, half-widths at "
            f"{percent(self.confidence)}"
        ]
        if self.undefined:
            return "\n".join([*lines, f"not given: {self.undefined}"])
        for row in sorted(self.rows, key=lambda r: -r.total):
            lines.append(
                f"  {row.path} ({row.low:g} to {row.high:g}): first "
                f"{_index(row.first, row.first_half_width)}, total "
                f"{_index(row.total, row.total_half_width)}"
            )
        return "\n".join(lines)


def _index(value: float, half_width: float) -> str:
    bare = math.isnan(half_width)
    return f"{value:.3f}" + (" (no half-width)" if bare else f" ± {number(half_width, 2)}")


# --- the question -----------------------------------------------------------------------------


def unacceptable_share(*, runs: int = 300, seed: int = 0) -> Callable[[Architecture], float]:
    """P(output U) of an architecture by simulation, with the same seed whatever it is given.

    Parameters
    ----------
    runs : simulated at each point.
    seed : of the simulation.

    Returns
    -------
    A function of an architecture: share of all epochs in which its output is unacceptable [1].
    """

    def share(architecture: Architecture) -> float:
        from sbas.fusion.simulation.simulated_runs import simulate_runs

        fused = simulate_runs(architecture, runs=runs, seed=seed)
        return float(np.mean(fused.output_state == U))

    return share


def sensitivity_to_parameters(
    architecture: Architecture,
    parameters: Sequence[Parameter],
    *,
    simulate: Callable[[Architecture], float] | None = None,
    of: str = "P(output U)",
    base_points: int = 64,
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
    progress: Progress | None = None,
) -> ParameterSensitivity:
    """Sobol indices, first and total, of a figure of a simulation to parameters.

    Parameters
    ----------
    architecture : its other numbers stay as they are.
    parameters : k numbers with their ranges, independent of each other.
    simulate : an architecture to a figure, by the same seed at each call; None is
        `unacceptable_share()`.
    of : what `simulate` returns, for the texts.
    base_points : N, a power of 2; the figure is computed N (k + 2) times.
    replicates : of the bootstrap of base points.
    confidence : of the half-widths, in (0, 1).
    seed : of the design and of the bootstrap.
    progress : called with (points done, points in all).

    Returns
    -------
    ParameterSensitivity; without indices, and with the reason, if the figure is constant.

    Raises
    ------
    InputError : no parameter or one twice, an option out of range, a figure that is not finite.
    ModelError : no number of that path.
    """
    _check(parameters, base_points, replicates, confidence)
    simulate = simulate or unacceptable_share()
    for parameter in parameters:
        with_parameter(architecture, parameter.path, parameter.low)
    design = saltelli_design(len(parameters), base_points, seed=seed)
    outputs = np.empty(design.shape[:2])
    for done, place in enumerate(np.ndindex(outputs.shape), start=1):
        outputs[place] = _figure(architecture, parameters, design[place], simulate)
        if progress is not None:
            progress(done, outputs.size)
    first, total = sobol_indices(outputs)
    half_widths = _half_widths(outputs, replicates, confidence, seed)
    rows = (
        ParameterIndices(p.path, p.low, p.high, p.log, *map(float, figures))
        for p, *figures in zip(
            parameters, first, half_widths[0], total, half_widths[1], strict=True
        )
    )
    own = outputs[:, [0, -1]]
    flat = _is_constant(own)
    return ParameterSensitivity(
        of, tuple(rows), base_points, outputs.size, float(own.mean()), float(own.std()), seed,
        confidence,
        f"{of} is {number(float(own.mean()))} at all {own.size} base points: no variance to share"
        if flat else "",
    )  # fmt: skip


def _figure(
    architecture: Architecture,
    parameters: Sequence[Parameter],
    quantiles: Floats,
    simulate: Callable[[Architecture], float],
) -> float:
    values = [p.at(float(q)) for p, q in zip(parameters, quantiles, strict=True)]
    for parameter, value in zip(parameters, values, strict=True):
        architecture = with_parameter(architecture, parameter.path, value)
    figure = simulate(architecture)
    if not math.isfinite(figure):
        at = ", ".join(f"{p.path} {v:.6g}" for p, v in zip(parameters, values, strict=True))
        raise InputError(
            "indices need a finite figure at every point",
            where="simulate", evidence=f"{figure} at {at}",
        )  # fmt: skip
    return figure


# --- design and estimators --------------------------------------------------------------------


def saltelli_design(parameters: int, base_points: int, *, seed: int = 0) -> Floats:
    """Points at which indices of first and total order are estimated, in the unit cube.

    Parameters
    ----------
    parameters : k.
    base_points : N, a power of 2.
    seed : of the scrambling of the Sobol sequence, of 2k columns: A and B.

    Returns
    -------
    (N, k + 2, k): A; A with column i of B, for each i; B.

    References
    ----------
    Saltelli et al. 2010, section 3.
    """
    from scipy.stats import qmc

    sequence = qmc.Sobol(2 * parameters, scramble=True, rng=np.random.default_rng(seed))
    both = sequence.random_base2(base_points.bit_length() - 1)
    a, b = both[:, :parameters], both[:, parameters:]
    design = np.repeat(a[:, None, :], parameters + 2, axis=1)
    for i in range(parameters):
        design[:, i + 1, i] = b[:, i]
    design[:, -1] = b
    return design


def sobol_indices(outputs: Floats) -> tuple[Floats, Floats]:
    """First and total indices from the figure at the points of `saltelli_design`.

    Parameters
    ----------
    outputs : (..., N, k + 2), the figure.

    Returns
    -------
    (..., k) first and (..., k) total indices [1]; NaN where the figure is constant.

    Notes
    -----
    With f centred, S_i = mean(f(B) (f(A_B^i) - f(A)))/V, ST_i = mean((f(A) - f(A_B^i))^2)/(2V),
    V the variance over A and B.

    References
    ----------
    Saltelli et al. 2010, Table 2 (b) and (f).
    """
    own = outputs[..., [0, -1]]
    constant = _is_constant(own)
    centred = outputs - outputs.mean(axis=(-2, -1), keepdims=True)
    a, mixed, b = centred[..., :1], centred[..., 1:-1], centred[..., -1:]
    variance = np.where(constant, np.nan, own.var(axis=(-2, -1)))[..., None]
    first = (b * (mixed - a)).mean(axis=-2) / variance
    total = 0.5 * ((a - mixed) ** 2).mean(axis=-2) / variance
    return first, total


def _is_constant(own: Floats) -> Any:
    spread = np.ptp(own, axis=(-2, -1))
    return spread <= _CONSTANT * np.abs(own).max(axis=(-2, -1))


def _half_widths(outputs: Floats, replicates: int, confidence: float, seed: int) -> Floats:
    """(2, k) of first and total: normal quantile times the scatter over resampled base points.

    NaN as soon as the figure is constant in one replicate: too few points carry the variance.
    """
    points = len(outputs)
    rng = np.random.default_rng([seed, 1])
    at_once = max(1, _CHUNK // outputs.size)
    found = []
    for start in range(0, replicates, at_once):
        drawn = rng.integers(points, size=(min(at_once, replicates - start), points))
        found.append(np.stack(sobol_indices(outputs[drawn]), axis=1))
    scatter: Floats = np.concatenate(found).std(axis=0, ddof=1)
    return float(ndtri(0.5 + confidence / 2)) * scatter


def _check(
    parameters: Sequence[Parameter], base_points: int, replicates: int, confidence: float
) -> None:
    paths = [parameter.path for parameter in parameters]
    if not paths or len(set(paths)) < len(paths):
        raise InputError(
            "parameters are one or more, each once",
            where="parameters", evidence=", ".join(paths) or "none",
        )  # fmt: skip
    if base_points < LEAST_POINTS or base_points & (base_points - 1):
        power = max(LEAST_POINTS, 1 << round(math.log2(max(base_points, 1))))
        raise InputError(
            f"a Sobol sequence is balanced at powers of 2, {LEAST_POINTS} or more",
            where="base_points", evidence=str(base_points), cure=f"base_points={power}",
        )  # fmt: skip
    if replicates < 2 or not 0.0 < confidence < 1.0:
        raise InputError(
            "a half-width needs replicates, 2 or more, and a confidence in (0, 1)",
            where="replicates, confidence", evidence=f"{replicates}, {confidence}",
        )  # fmt: skip
