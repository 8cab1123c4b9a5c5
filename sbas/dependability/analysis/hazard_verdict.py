"""Hazard rates of a model against a tolerable hazard rate and the safety integrity levels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sbas.dependability.exact.solution import Solution
from sbas.exceptions import InputError
from sbas.integrity.counting import is_number
from sbas.integrity.sil import SilLevel, sil_band
from sbas.numerals import upward


@dataclass(frozen=True)
class HazardVerdict:
    """What a modelled hazard rate means; never more than the model does.

    Parameters
    ----------
    hazard : name of the event or gate.
    rate_per_h : occurrences per hour [1/h].
    thr_per_h : tolerable hazard rate [1/h]; None where none was given.
    meets : whether the rate is below it; None where none was given.
    sil : level whose band holds the rate; None for 1e-5/h and more, and for 0, where the model
        excludes the hazard.
    text : the verdict in words.
    """

    hazard: str
    rate_per_h: float
    thr_per_h: float | None
    meets: bool | None
    sil: SilLevel | None
    text: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return dict(vars(self))

    def __str__(self) -> str:
        return self.text


def hazard_verdict(
    solution: Solution, hazard: str, *, thr_per_h: float | None = None
) -> HazardVerdict:
    """Compare how often a hazard occurs with a tolerable hazard rate.

    Parameters
    ----------
    solution : with a row for the hazard.
    hazard : name of an event or gate, such as "Case C".
    thr_per_h : tolerable hazard rate for this function [1/h], above 0.

    Returns
    -------
    HazardVerdict from the expected occurrences per hour, W/T; never from the mean unavailability,
    which is smaller by as much as the hazard is short.

    Raises
    ------
    InputError : no row of that name; a THR that is no number above 0.

    References
    ----------
    EN 50129, table A.1 (the bands of IEC 61508-1, continuous mode): half-open, exactly 1e-8/h is
    SIL 3. A rate of just the THR does not meet it. A hazard that is there at the start counts as
    an occurrence.
    """
    if hazard not in solution.rows:
        raise InputError(
            "no row of that name", where="hazard", evidence=f"{hazard!r} of {[*solution.rows]}",
            cure=f"solve(model, names=({hazard!r},))",
        )  # fmt: skip
    row = solution.rows[hazard]
    hours = solution.model.mission_s / 3600.0
    return rate_verdict((row.occurrences + row.at_start) / hours, hazard, thr_per_h=thr_per_h)


def rate_verdict(
    rate_per_h: float, hazard: str, *, thr_per_h: float | None = None
) -> HazardVerdict:
    """The verdict on a rate [1/h] that a model gave; parameters and errors as `hazard_verdict`."""
    if thr_per_h is not None and not (is_number(thr_per_h) and 0.0 < thr_per_h < math.inf):
        raise InputError(
            "a tolerable hazard rate is a number above 0", where="thr_per_h",
            evidence=repr(thr_per_h),
        )  # fmt: skip
    sil: SilLevel | None = sil_band(rate_per_h)
    meets = None if thr_per_h is None else rate_per_h < thr_per_h
    text = f"{hazard}: {upward(rate_per_h)} occurrences per hour in the model"
    if thr_per_h is not None:
        text += f" {'meets' if meets else 'does not meet'} the THR of {thr_per_h:g}/h"
    if rate_per_h == 0:
        # The model excludes it, which is a statement on the model and earns no level.
        sil, text = None, f"{hazard}: never true in this model, which excludes it: no SIL follows"
    else:
        text += f"; in the band of SIL {sil}" if sil else "; no SIL (1e-05/h or more)"
    return HazardVerdict(hazard, float(rate_per_h), thr_per_h, meets, sil, text)


def rate_of_or(rates_per_h: Iterable[float]) -> float:
    """Rate of a hazard that any of several functions causes: the sum.

    Parameters
    ----------
    rates_per_h : hazard rates of the functions [1/h].

    Returns
    -------
    [1/h]; an upper bound where they may occur together.

    References
    ----------
    EN 50129, annex A.
    """
    return math.fsum(_not_negative(rate, "rates_per_h") for rate in rates_per_h)


def rate_of_and(
    rate_1_per_h: float, safe_down_1_h: float, rate_2_per_h: float, safe_down_2_h: float
) -> float:
    """Rate of a hazard that needs the failure of two independent functions at once.

    Parameters
    ----------
    rate_1_per_h, rate_2_per_h : failure rates FR of the functions [1/h].
    safe_down_1_h, safe_down_2_h : safe down times SDT: detection and negation [h].

    Returns
    -------
    FR1 FR2 (SDT1 + SDT2) [1/h].

    References
    ----------
    EN 50129, annex A (read second-hand, unverified). For two repairable components it is an upper
    bound: in the long run W/T is this over (1 + FR1 SDT1)(1 + FR2 SDT2).
    """
    rates = [_not_negative(r, "rate_per_h") for r in (rate_1_per_h, rate_2_per_h)]
    downs = [_not_negative(d, "safe_down_h") for d in (safe_down_1_h, safe_down_2_h)]
    return rates[0] * rates[1] * (downs[0] + downs[1])


def _not_negative(value: float, where: str) -> float:
    if not is_number(value) or not 0.0 <= value < math.inf:
        raise InputError("a number of 0 or more is expected", where=where, evidence=repr(value))
    return float(value)
