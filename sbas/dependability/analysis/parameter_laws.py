"""Laws of uncertain parameters, drawn by their quantiles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import gammainccinv, gammaincinv, ndtri

from sbas.dependability.exact.transitions import Floats
from sbas.estimate import Counted, Estimate
from sbas.exceptions import InputError

_EF_POINT = 0.95


@dataclass(frozen=True)
class RateFromCounts:
    """A rate of which `failures` were counted in `hours`: gamma(failures + added, hours).

    Parameters
    ----------
    failures : counted, 0 or more.
    hours : of exposure [h].
    added : 1 (the default, the safe side) gives at every probability the upper bound of the
        chi-square interval; 1/2 is Jeffreys' law, between the bounds; 0 gives the lower bound.
    """

    failures: float
    hours: float
    added: float = 1.0
    columns: ClassVar[int] = 1

    def __post_init__(self) -> None:
        counted = math.isfinite(self.failures) and self.failures >= 0.0
        if not (counted and math.isfinite(self.hours) and self.hours > 0.0):
            raise InputError(
                "a rate needs counted failures and hours above 0",
                where="RateFromCounts",
                evidence=f"{self.failures} in {self.hours} h",
            )
        if not (0.0 <= self.added <= 1.0 and self.failures + self.added > 0.0):
            raise InputError(
                "no law of a rate", where="RateFromCounts.added",
                evidence=f"{self.failures} failures + {self.added}", cure="added=1 or added=0.5",
            )  # fmt: skip

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Two-sided bounds chi2(q; 2n)/(2t), chi2(1 - q; 2n + 2)/(2t), q = (1 - confidence)/2.

        Returns
        -------
        Lower (0 for no failure) and upper bound [1/h].

        References
        ----------
        Garwood 1936.
        """
        q = (1.0 - confidence) / 2.0
        n = self.failures
        low = float(gammaincinv(n, q)) / self.hours if n > 0 else 0.0
        # The upper point by its complement: 1 - q would lose digits of a small q.
        return low, float(gammainccinv(n + 1.0, q)) / self.hours

    def draw(self, uniform: Floats) -> Floats:
        """(n,) rates [1/h] from (n, 1) uniform numbers."""
        return np.asarray(gammaincinv(self.failures + self.added, uniform[:, 0])) / self.hours


@dataclass(frozen=True)
class Lognormal:
    """Lognormal law by its median and error factor.

    Parameters
    ----------
    median : in the parameter's unit.
    error_factor : p95/p50, above 1.
    """

    median: float
    error_factor: float
    columns: ClassVar[int] = 1

    def __post_init__(self) -> None:
        if not (0.0 < self.median < math.inf and 1.0 < self.error_factor < math.inf):
            raise InputError(
                "a lognormal law needs a median above 0 and an error factor p95/p50 above 1",
                where="Lognormal",
                evidence=f"median {self.median}, error factor {self.error_factor}",
                cure="Fixed(value) for what is known",
            )

    def draw(self, uniform: Floats) -> Floats:
        """(n,) values from (n, 1) uniform numbers."""
        sigma = math.log(self.error_factor) / float(ndtri(_EF_POINT))
        return np.asarray(self.median * np.exp(sigma * ndtri(uniform[:, 0])))


@dataclass(frozen=True)
class Fixed:
    """A figure taken as known, in place of the model's."""

    value: float
    columns: ClassVar[int] = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.value < math.inf:
            raise InputError("a figure is 0 or more", where="Fixed", evidence=repr(self.value))

    def draw(self, uniform: Floats) -> Floats:
        """(n,) times the value."""
        return np.full(len(uniform), self.value)


@dataclass(frozen=True)
class DirichletRows:
    """Rows of transition probabilities, each Dirichlet.

    Parameters
    ----------
    parameters : (s, s), 1/2 + counts as `StateChain.dirichlet` gives them; 0 is a move that
        cannot be.
    """

    parameters: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        table = self.parameters
        square = len(table) > 0 and all(len(row) == len(table) for row in table)
        if not square or not all(
            all(0.0 <= a < math.inf for a in row) and any(a > 0.0 for a in row) for row in table
        ):
            raise InputError(
                "Dirichlet rows are square, of figures 0 or more with one above 0 in each row",
                where="DirichletRows",
                evidence=repr(table),
            )

    @property
    def columns(self) -> int:
        """One uniform number for each entry."""
        return len(self.parameters) ** 2

    def draw(self, uniform: Floats) -> Floats:
        """(n, s, s) rows from (n, s s) uniform numbers: gamma figures over their sum."""
        shape = np.array(self.parameters, dtype=float)
        u = uniform.reshape(len(uniform), *shape.shape)
        gammas = np.where(shape > 0.0, gammaincinv(np.where(shape > 0.0, shape, 1.0), u), 0.0)
        return np.asarray(gammas / gammas.sum(axis=2, keepdims=True))


Law = RateFromCounts | Lognormal | Fixed | DirichletRows


def law_of(given: Law | Estimate, *, where: str) -> Law:
    """The law itself, or that of an estimate of a rate by what was counted.

    Parameters
    ----------
    given : a law, or an Estimate [1/h] whose basis is Counted.
    where : said in the refusal.

    Raises
    ------
    InputError : an estimate of something else, or that was not counted.
    """
    if not isinstance(given, Estimate):
        return given
    if given.unit != "per_h" or not isinstance(given.basis, Counted):
        raise InputError(
            "only an estimate of a rate that was counted has a law by itself",
            where=where,
            evidence=f"unit {given.unit!r}, {given.evidence}: {given.basis}",
            cure="say the law: Lognormal(median, error_factor), or Fixed(value)",
        )
    return RateFromCounts(given.basis.events, given.basis.hours)
