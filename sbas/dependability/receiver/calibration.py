"""The receiver's chain that reproduces published rows: what is fitted, and what is predicted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.dependability.receiver.published import PublishedRows
from sbas.dependability.receiver.unit_numbers import UnitNumbers, unit_numbers
from sbas.dependability.receiver.window_rows import UnitRows, hardware_curves, unit_rows
from sbas.dependability.tree.model import HybridFaultTree, MarkovSource
from sbas.exceptions import ModelError
from sbas.findings import Finding

Floats = NDArray[np.float64]
Role = Literal["calibrated", "predicted"]

RESIDUAL = 1e-12
"""Largest log(row/published) of a fitted row."""

_STEPS = 60
_DIFFERENCE = 1e-6


@dataclass(frozen=True)
class CalibratedRow:
    """One published row beside the computed one; a calibrated row agrees by construction."""

    name: str
    published: float
    computed: float
    role: Role

    @property
    def relative(self) -> float | None:
        """computed/published - 1; None where 0 is published."""
        return (self.computed - self.published) / self.published if self.published else None

    def to_dict(self) -> dict[str, Any]:
        return {**vars(self), "relative": self.relative}


@dataclass(frozen=True)
class CalibratedSource:
    """A receiver's chain found from published rows.

    Parameters
    ----------
    environment : of the rows.
    source : the Markov source with the rows found, to take the template's place.
    stationary : (3,) shares of correct, wrong and missing; the first is published.
    stay_wrong, stay_missing : probabilities to stay in the state for one epoch.
    rows : published beside computed; only predicted ones test the model.
    residual : largest |log(computed/published)| of the fitted rows.
    findings : entries that had to be clipped.
    reference : where the rows were published.
    """

    environment: str
    source: MarkovSource
    stationary: tuple[float, float, float]
    stay_wrong: float
    stay_missing: float
    rows: tuple[CalibratedRow, ...]
    residual: float
    findings: tuple[Finding, ...]
    reference: str

    @property
    def note(self) -> str:
        """One sentence that must travel with every result of the chain."""
        fitted = ", ".join(r.name for r in self.rows if r.role == "calibrated")
        return (
            f"{self.environment}: transition rows are calibrated, not published; these rows agree "
            f"by construction: {fitted} ({self.reference})"
        )

    def row(self, name: str) -> CalibratedRow:
        """The row of this name."""
        return next(r for r in self.rows if r.name == name)

    def to_dict(self) -> dict[str, Any]:
        return {
            "environment": self.environment,
            "states": list(self.source.states),
            "transition": [list(row) for row in self.source.rows],
            "stationary": list(self.stationary),
            "stay_wrong": self.stay_wrong,
            "stay_missing": self.stay_missing,
            "rows": [r.to_dict() for r in self.rows],
            "residual": self.residual,
            "note": self.note,
            "findings": [f.to_dict() for f in self.findings],
        }

    def summary(self) -> pd.DataFrame:
        """One row a published figure."""
        heads = ("name", "published", "computed", "relative", "role")
        return pd.DataFrame([r.to_dict() for r in self.rows], columns=heads).set_index("name")

    def __str__(self) -> str:
        return f"{self.note}\n{self.summary().to_string()}"


def calibrated_source(
    published: PublishedRows,
    system: HybridFaultTree | UnitNumbers,
    *,
    free: tuple[float, float] | None = None,
) -> CalibratedSource:
    """The receiver's chain with which the unit has the published rows.

    Parameters
    ----------
    published : rows of one environment.
    system : the paper's tree, whose source's rows are replaced, or its numbers.
    free : transition probabilities wrong -> missing and missing -> wrong, which no row fixes; by
        default each in proportion to the stationary shares of its two destinations.

    Returns
    -------
    CalibratedSource. Fitted are IE1, IE5, IE6 and the stationary share of correct positions; where
    IE5 = IE6 = 0 are published, "wrong" is left at once, and IE1 and IE2 are fitted instead.

    Raises
    ------
    ModelError : no chain has these rows (infeasible), or the tree is not the paper's.

    Notes
    -----
    IE5 ~ pi2 a^(k-1), IE6 ~ Ue pi2 a^(l-1), IE1 ~ Ue pi3 b^(d1-1) + alpha_E alpha_G T^2/3 and
    IE2 ~ pi3 b^(d2-1) + alpha_G T/2 (1 - T2/T)^2 give the start (a = p22, b = p33, Ue the mean
    unavailability of the ECS, alpha_G the failure rate of the guard), Newton's method on
    log(row/published) with the exact rows the end.

    References
    ----------
    Nguyen, Beugin, Marais, ITST 2013, Tables II and III; their chain is not printed.
    """
    numbers = system if isinstance(system, UnitNumbers) else unit_numbers(system)
    fit = _Fit(published, numbers, free)
    never_wrong = published.ie5 == 0.0 and published.ie6 == 0.0
    pi, a, b = fit.without_wrong_runs() if never_wrong else fit.with_wrong_runs()
    chain, clipped = _chain(pi, a, b, free)
    found = unit_rows(numbers, fit.hardware, chain, pi)
    fitted = ("IE1", "IE2", "IE5", "IE6") if never_wrong else ("IE1", "IE5", "IE6")
    rows = _rows(published, found, pi, fitted)
    residual = max(
        abs(math.log(r.computed / r.published))
        for r in rows
        if r.role == "calibrated" and r.published
    )
    place = numbers.order
    own = np.empty((3, 3))
    own[np.ix_(place, place)] = chain
    source = replace(
        numbers.source,
        rows=tuple(tuple(row) for row in own.tolist()),
        source=f"calibrated to {published.source}, {published.environment}",
    )
    return CalibratedSource(
        environment=published.environment,
        source=source,
        stationary=(float(pi[0]), float(pi[1]), float(pi[2])),
        stay_wrong=a,
        stay_missing=b,
        rows=rows,
        residual=residual,
        findings=tuple(
            Finding(
                "E26", "warning", f"{published.environment}: {text}",
                evidence="the free entries move no fitted row but through the chain's memory",
                cure="free=(wrong to missing, missing to wrong)",
            )
            for text in clipped
        ),
        reference=published.source,
    )  # fmt: skip


def _rows(
    published: PublishedRows, found: UnitRows, pi: Floats, fitted: tuple[str, ...]
) -> tuple[CalibratedRow, ...]:
    pairs: list[tuple[str, float, float | None]] = [
        ("TOP", published.top, found.top),
        ("BE1", published.be1, found.be1),
        ("IE2", published.ie2, found.ie2),
        ("IE1", published.ie1, found.ie1),
        ("IE6", published.ie6, found.ie6),
        ("IE5", published.ie5, found.ie5),
        ("stationary correct", published.single_gnss_availability, float(pi[0])),
        ("single GNSS", published.single_gnss_availability, found.correct),
        ("unit", published.unit_availability, None if found.top is None else 1.0 - found.top),
    ]
    names = (*fitted, "stationary correct")
    return tuple(
        CalibratedRow(name, given, value, "calibrated" if name in names else "predicted")
        for name, given, value in pairs
        if value is not None
    )


class _Fit:
    """Starting values and Newton's method for one environment."""

    def __init__(
        self, published: PublishedRows, numbers: UnitNumbers, free: tuple[float, float] | None
    ) -> None:
        self.published, self.numbers, self.free = published, numbers, free
        self.hardware = hardware_curves(numbers)
        self.pi1 = published.single_gnss_availability
        if not 0.0 < self.pi1 < 1.0:
            raise self.infeasible(f"the share of correct positions is {self.pi1}")
        mission_h = numbers.mission_s / 3600.0
        guard = sum(c.failure_rate_per_h for c in numbers.guard)
        self.ue = unit_rows(numbers, self.hardware, np.eye(3), np.eye(3)[0]).be2
        left = max(0.0, 1.0 - (numbers.d2 - 1) * numbers.step_s / numbers.mission_s)
        self.ie1 = published.ie1 - numbers.ecs.failure_rate_per_h * guard * mission_h**2 / 3
        self.ie2 = published.ie2 - guard * mission_h / 2 * left**2
        if numbers.d1 < 2 or self.ue == 0.0:
            raise self.infeasible("without a failing ECS and T1 of an epoch, IE1 fixes nothing")
        if self.ie1 <= 0.0:
            raise self.infeasible(f"hardware alone gives more than IE1 = {published.ie1:g}")

    def infeasible(self, why: str) -> ModelError:
        return ModelError(
            f"infeasible: no chain has the rows of {self.published.environment!r}",
            where="calibration",
            evidence=f"{why} (dur_rule {self.numbers.dur_rule!r})",
            cure="check k, l, T1, T2 and the rates against the paper, or take another dur_rule",
        )

    def with_wrong_runs(self) -> tuple[Floats, float, float]:
        """pi, a, b from IE5, IE6, IE1."""
        numbers, rows = self.numbers, self.published
        if rows.ie5 <= 0.0 or rows.ie6 <= 0.0 or numbers.k == numbers.l:
            raise self.infeasible(f"IE5 = {rows.ie5:g}, IE6 = {rows.ie6:g}, k = {numbers.k}")
        a = (rows.ie5 * self.ue / rows.ie6) ** (1.0 / (numbers.k - numbers.l))
        pi2 = rows.ie6 / (self.ue * a ** (numbers.l - 1))
        pi3 = 1.0 - self.pi1 - pi2
        if not (a < 1.0 and pi3 > 0.0):
            raise self.infeasible(
                f"k = {numbers.k} and l = {numbers.l} give p22 = {a:.6g}, pi2 = {pi2:.6g}, "
                f"pi3 = {pi3:.6g}"
            )
        b = (self.ie1 / (self.ue * pi3)) ** (1.0 / (numbers.d1 - 1))

        def chain(x: Floats) -> tuple[Floats, float, float]:
            pi2, a, b = np.exp(x).tolist()
            return np.array([self.pi1, pi2, 1.0 - self.pi1 - pi2]), a, b

        return self.newton(np.log([pi2, a, b]), chain, ("ie5", "ie6", "ie1"))

    def without_wrong_runs(self) -> tuple[Floats, float, float]:
        """pi, a = 0, b from IE1, IE2."""
        numbers = self.numbers
        if self.ie2 <= 0.0 or numbers.d2 <= numbers.d1:
            raise self.infeasible(f"hardware alone gives more than IE2 = {self.published.ie2:g}")
        b = (self.ie2 * self.ue / self.ie1) ** (1.0 / (numbers.d2 - numbers.d1))
        pi3 = self.ie1 / (self.ue * b ** (numbers.d1 - 1))

        def chain(x: Floats) -> tuple[Floats, float, float]:
            pi3, b = np.exp(x).tolist()
            return np.array([self.pi1, 1.0 - self.pi1 - pi3, pi3]), 0.0, b

        return self.newton(np.log([pi3, b]), chain, ("ie1", "ie2"))

    def newton(
        self,
        x: Floats,
        chain: Callable[[Floats], tuple[Floats, float, float]],
        names: tuple[str, ...],
    ) -> tuple[Floats, float, float]:
        """Solve log(row/published) = 0 for the named rows from x = logs of the unknowns."""
        goal = np.log([getattr(self.published, name) for name in names])

        def miss(x: Floats) -> Floats:
            pi, a, b = self.feasible(chain(x))
            rows = unit_rows(self.numbers, self.hardware, _chain(pi, a, b, self.free)[0], pi)
            return np.log([getattr(rows, name) for name in names]) - goal

        at = miss(x)
        for _ in range(_STEPS):
            if np.abs(at).max() < RESIDUAL / 4:
                break
            slopes = np.column_stack([
                (miss(x + step) - miss(x - step)) / (2 * _DIFFERENCE)
                for step in np.eye(x.size) * _DIFFERENCE
            ])  # fmt: skip
            move = np.linalg.solve(slopes, at)
            new = x - move
            then = miss(new)
            if np.abs(at).max() < RESIDUAL and np.abs(then).max() >= np.abs(at).max():
                break
            x, at = new, then
        if not np.abs(at).max() < RESIDUAL:
            raise self.infeasible(f"the rows are missed by {np.abs(at).max():.3g} at least")
        return chain(x)

    def feasible(self, found: tuple[Floats, float, float]) -> tuple[Floats, float, float]:
        pi, a, b = found
        if pi.min() < 0.0 or not (0.0 <= a < 1.0 and 0.0 < b < 1.0):
            shares = ", ".join(f"{p:.6g}" for p in pi)
            raise self.infeasible(f"pi = {shares}, p22 = {a:.6g}, p33 = {b:.6g}")
        try:
            _chain(pi, a, b, self.free)
        except ValueError as error:
            raise self.infeasible(str(error)) from None
        return found


def _chain(
    pi: Floats, a: float, b: float, free: tuple[float, float] | None
) -> tuple[Floats, list[str]]:
    """(3, 3) chain with stationary law pi, p22 = a and p33 = b; and what had to be clipped.

    Balance of each state's flows leaves p23 and p32 free within 0 <= p23 <= min(1 - a,
    pi3 (1 - b)/pi2), likewise p32. Raises ValueError where no p11 >= 0 is left.
    """
    pi1, pi2, pi3 = pi.tolist()
    out2, out3 = pi2 * (1.0 - a), pi3 * (1.0 - b)
    p23 = (1.0 - a) * pi3 / (pi1 + pi3) if free is None else free[0]
    p32 = (1.0 - b) * pi2 / (pi1 + pi2) if free is None else free[1]
    clipped = []
    most23 = min(1.0 - a, out3 / pi2) if pi2 else 1.0 - a
    most32 = min(1.0 - b, out2 / pi3) if pi3 else 1.0 - b
    for name, value, most in (("p23", p23, most23), ("p32", p32, most32)):
        if not 0.0 <= value <= most:
            clipped.append(f"{name} = {value:.6g} clipped to 0..{most:.6g}")
    p23, p32 = min(max(p23, 0.0), most23), min(max(p32, 0.0), most32)
    p12 = max((out2 - pi3 * p32) / pi1, 0.0)
    p13 = max((out3 - pi2 * p23) / pi1, 0.0)
    if p12 + p13 > 1.0:
        raise ValueError(f"p12 + p13 = {p12 + p13:.6g}: correct would be left too often")
    rows = [
        [1.0 - p12 - p13, p12, p13],
        [1.0 - a - p23, a, p23],
        [1.0 - b - p32, p32, b],
    ]
    return np.maximum(np.array(rows), 0.0), clipped
