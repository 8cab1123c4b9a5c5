"""What a rate means: safety integrity levels and targets.

A verdict comes from an upper confidence bound only, and only counting demonstrates: what a
model says or a document claims is named as such and never reads "demonstrated".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from sbas.estimate import Counted, Estimate, Evidence
from sbas.exceptions import InputError
from sbas.integrity.counting import is_number
from sbas.integrity.planning import plan_hours
from sbas.numerals import percent, upward

SIL_BANDS_PER_H = ((4, 1e-9, 1e-8), (3, 1e-8, 1e-7), (2, 1e-7, 1e-6), (1, 1e-6, 1e-5))
"""Level, lower limit (inside) and upper limit (outside) [1/h]: IEC 61508-1, 7.6.2, high demand."""

SilLevel = Literal[1, 2, 3, 4]
NOT_DEMONSTRATED = "NOT DEMONSTRATED"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """An answer in words and the bound that it rests on; `demonstrated` alone is a yes."""

    demonstrated: bool
    upper_per_h: float | None
    confidence: float | None
    evidence: Evidence
    text: str
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {**vars(self), "notes": list(self.notes)}

    def __str__(self) -> str:
        return "\n".join((self.text, *self.notes))


@dataclass(frozen=True, kw_only=True)
class SilVerdict(Verdict):
    """Whether a safety integrity level is demonstrated.

    `level` is the band of the upper bound whatever the evidence; None where the bound is 1e-5/h
    or more, or where there is none.
    """

    level: SilLevel | None


@dataclass(frozen=True, kw_only=True)
class TargetVerdict(Verdict):
    """Whether a rate is demonstrated to lie below a target."""

    target_per_h: float


def sil_band(rate_per_h: float) -> SilLevel | None:
    """Safety integrity level whose band holds a rate.

    Parameters
    ----------
    rate_per_h : dangerous failures [1/h], 0 or more.

    Returns
    -------
    4, 3, 2, 1, or None for 1e-5/h and more. The bands are half-open, so that exactly 1e-7/h is
    SIL 2; rates below 1e-9/h, for which there is no band, are SIL 4.

    Raises
    ------
    InputError : a negative rate or NaN.

    References
    ----------
    IEC 61508-1, 7.6.2 (high demand or continuous mode).

    Examples
    --------
    >>> sil_band(5e-8), sil_band(1e-7), sil_band(2e-5)
    (3, 2, None)
    """
    if not is_number(rate_per_h) or not rate_per_h >= 0:
        raise InputError(
            "a rate is a number of 0 or more", where="rate_per_h", evidence=repr(rate_per_h)
        )
    for level, _, above in SIL_BANDS_PER_H:
        if rate_per_h < above:
            return level  # type: ignore[return-value]
    return None


def sil_verdict(estimate: Estimate) -> SilVerdict:
    """The safety integrity level that an estimated rate demonstrates.

    Parameters
    ----------
    estimate : a rate in "per_h" with an upper bound.

    Returns
    -------
    SilVerdict: demonstrated only for counted events whose upper bound is below 1e-5/h.

    Raises
    ------
    InputError : another unit; no upper bound, unless the estimate is a claim, which demonstrates
        nothing anyhow.

    References
    ----------
    IEC 61508-1, 7.6.2; ties go to the lower level.
    """
    upper = _upper_per_h(estimate)
    level = None if upper is None else sil_band(upper)
    notes = list(estimate.caveats)
    if level == 4 and upper is not None and upper < SIL_BANDS_PER_H[0][1]:
        notes.append("below 1e-9/h: the standard has no band there, SIL 4 is the highest level")
    shown = estimate.evidence == "demonstrated" and level is not None
    bound = _bound_text(estimate)
    if shown:
        text = f"SIL {level} demonstrated at {_percent(estimate.confidence)}: {bound}"
    elif estimate.evidence == "demonstrated":
        text = f"{NOT_DEMONSTRATED}: {bound}, and SIL 1 needs less than 1e-05/h"
    else:
        text = f"{NOT_DEMONSTRATED}: {_basis_text(estimate)}"
        if upper is not None:
            text += f"; {bound} is " + (f"in the band of SIL {level}" if level else "no SIL")
    return SilVerdict(
        demonstrated=shown,
        level=level,
        upper_per_h=upper,
        confidence=estimate.confidence,
        evidence=estimate.evidence,
        text=text,
        notes=tuple(notes),
    )


def meets(estimate: Estimate, target_per_h: float) -> TargetVerdict:
    """Whether an estimated rate is demonstrated to lie below a target.

    Parameters
    ----------
    estimate : a rate in "per_h" with an upper bound.
    target_per_h : the rate to stay below [1/h], above 0.

    Returns
    -------
    TargetVerdict: demonstrated only if the events were counted and the upper bound is below the
    target. A bound on the target itself is not: ties go to the unsafe side, as in the half-open
    bands of `sil_band` (a target of 1e-7/h is the limit of SIL 3, which 1e-7/h misses).

    Raises
    ------
    InputError : as `sil_verdict`, or a target that is no number above 0.
    """
    if not is_number(target_per_h) or not 0 < target_per_h < math.inf:
        raise InputError(
            "the target is no rate above 0", where="target_per_h", evidence=repr(target_per_h)
        )
    target = float(target_per_h)
    upper = _upper_per_h(estimate)
    counted = estimate.evidence == "demonstrated"
    below = upper is not None and upper < target
    notes = list(estimate.caveats)
    bound = _bound_text(estimate)
    if counted and below:
        text = f"a rate below {target:g}/h demonstrated at {_percent(estimate.confidence)}: {bound}"
    elif counted:
        text = f"{NOT_DEMONSTRATED}: {bound} is not below the target of {target:g}/h"
        notes += _shortfall(estimate, target)
    else:
        text = f"{NOT_DEMONSTRATED}: {_basis_text(estimate)}"
        if upper is not None:
            text += f"; {bound} is {'' if below else 'not '}below the target of {target:g}/h"
    return TargetVerdict(
        demonstrated=counted and below,
        target_per_h=target,
        upper_per_h=upper,
        confidence=estimate.confidence,
        evidence=estimate.evidence,
        text=text,
        notes=tuple(notes),
    )


def _upper_per_h(estimate: Estimate) -> float | None:
    """The bound that a verdict rests on; None only for a claim without one."""
    if estimate.unit != "per_h":
        raise InputError(
            "a verdict needs a rate per hour", where="estimate", evidence=f"unit {estimate.unit!r}"
        )
    if estimate.confidence is not None and estimate.confidence < 0.5:
        raise InputError(
            "a verdict needs a confidence of 50 % or more",
            where="estimate",
            evidence=percent(estimate.confidence),
            cure="estimate the rate with confidence=0.95",
        )
    basis = estimate.basis
    if isinstance(basis, Counted) and not math.isclose(
        estimate.value * basis.hours, basis.events, rel_tol=1e-9, abs_tol=1e-300
    ):
        raise InputError(
            "the rate is not its own count over its hours",
            where="estimate",
            evidence=f"{estimate.value!r} per hour beside {basis}",
            cure="make it with poisson_bounds",
        )
    bounded = estimate.upper is not None and estimate.sided != "lower"
    if not bounded and estimate.evidence != "claimed":
        raise InputError(
            "a verdict needs an upper confidence bound",
            where="estimate",
            evidence=str(estimate),
            cure="estimate the rate with sided='upper'",
        )
    return estimate.upper if bounded else None


def _shortfall(estimate: Estimate, target: float) -> list[str]:
    """How much more a count would need, for the count at hand; empty where that is not simple."""
    basis = estimate.basis
    if not isinstance(basis, Counted) or estimate.sided != "upper" or estimate.confidence is None:
        return []
    plan = plan_hours(target, confidence=estimate.confidence, events=math.ceil(basis.events))
    return [
        f"with {plan.events} {basis.of} this takes {upward(plan.hours)} h "
        f"({upward(plan.years)} years); "
        f"recorded are {basis.hours:.6g} h"
    ]


def _bound_text(estimate: Estimate) -> str:
    if estimate.upper is None:
        return "no bound is given"
    two = " of a two-sided interval" if estimate.sided == "two" else ""
    return f"upper bound{two} {upward(estimate.upper, 6)}/h at {_percent(estimate.confidence)}"


def _basis_text(estimate: Estimate) -> str:
    if estimate.evidence == "modelled":
        return f"a model is no count ({estimate.basis})"
    return f"a claim is no evidence ({estimate.basis})"


def _percent(confidence: float | None) -> str:
    return "unknown confidence" if confidence is None else percent(confidence)
