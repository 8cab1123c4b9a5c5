"""Thresholds and shifts of the tests, from probabilities of false alarm and missed detection.

Source: W. Baarda, "A testing procedure for use in geodetic networks", 1968 (one-dimensional test,
B-method); the chi-square distributions are SciPy's, through their complements: no `1 - p`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sbas.exceptions import InputError
from sbas.monitoring.normal_equations import Floats, Ints

OverallAlarm = Literal["fixed", "b_method"]

_ONE_SIDED_BELOW = 0.01, 0.4
"""Alarm and miss up to which the far side of the two-sided test adds less than 1e-5 to a shift."""


def upper_quantile(probability: float) -> float:
    """Q^-1(p): what a standard normal variable exceeds with probability p."""
    from scipy.special import ndtri

    return -float(ndtri(probability))


def upper_tail(value: float) -> float:
    """Q(u): the probability that a standard normal variable exceeds u."""
    from scipy.special import ndtr

    return float(ndtr(-value))


def detectable_shift(alarm: float, missed: float) -> float:
    """Baarda's delta0: the shift [sigma] that a two-sided test misses with probability `missed`.

    Q^-1(alarm / 2) + Q^-1(missed); the far side of the test counts where it matters.
    """
    _check_pair(alarm, missed)
    threshold = upper_quantile(alarm / 2)
    shift = threshold + upper_quantile(missed)
    if alarm <= _ONE_SIDED_BELOW[0] and missed <= _ONE_SIDED_BELOW[1]:
        return shift
    from scipy.optimize import brentq
    from scipy.special import ndtr

    def missed_at(d: float) -> float:
        return float(ndtr(threshold - d) - ndtr(-threshold - d)) - missed

    # The far side rejects as well: the root lies below the one-sided shift.
    return float(brentq(missed_at, 0.0, max(shift, 0.0) + 1.0, xtol=1e-14))


def chi_square_threshold(alarm: float, dof: Ints | int) -> Floats:
    """What a chi-square variable exceeds with probability `alarm`; NaN where dof < 1."""
    from scipy.special import chdtri

    return _by_dof(lambda k: float(chdtri(k, alarm)), dof)


def detectable_noncentrality(alarm: float, missed: float, dof: Ints | int) -> Floats:
    """sqrt(lambda) of the chi-square that stays below the threshold with probability `missed`.

    Called pbias in the literature on RAIM; with one degree of freedom it is `detectable_shift`.
    """
    from scipy.special import chdtri, chndtrinc

    _check_pair(alarm, missed)
    return _by_dof(lambda k: math.sqrt(float(chndtrinc(chdtri(k, alarm), k, missed))), dof)


def equivalent_alarm(alarm: float, missed: float, dof: Ints | int) -> Floats:
    """False alarm of the overall test that finds, as surely as the test of one range with
    `alarm`, the shift which that one misses with probability `missed` (Baarda's B-method)."""
    from scipy.special import chdtrc, chndtrix

    square = detectable_shift(alarm, missed) ** 2
    return _by_dof(lambda k: float(chdtrc(k, chndtrix(missed, k, square))), dof)


def _by_dof(value: object, dof: Ints | int) -> Floats:
    """Values by degrees of freedom, each computed once; NaN below 1."""
    whole = np.asarray(dof)
    kinds, place = np.unique(whole, return_inverse=True)
    each = [value(k) if k > 0 else np.nan for k in kinds.tolist()]  # type: ignore[operator]
    found: Floats = np.array(each, np.float64)[place].reshape(whole.shape)
    return found


def _check_pair(alarm: float, missed: float) -> None:
    if not (0 < alarm < 1 and 0 < missed < 1 and alarm + missed < 1):
        raise InputError(
            "probabilities of false alarm and missed detection lie between 0 and 1, and below 1 "
            "together: a test that misses more than it would by chance is none",
            evidence=f"{alarm} and {missed}",
        )


@dataclass(frozen=True)
class MonitorDesign:
    """How ranges are tested.

    Parameters
    ----------
    false_alarm : of the overall model test, per epoch.
    missed_detection : of the fault that the reliability levels are stated for.
    outlier_alarm : false alarm of the w-test of one range, two-sided.
    overall : "fixed" takes `false_alarm` for the overall test; "b_method" gives it the alarm
        with which it finds the same fault as the w-test.
    exclusions : at most so many ranges are excluded, 0..2.
    largest_correlation, rival : of two ranges whose tests are correlated by more than the first,
        with the smaller test above `rival` times the larger, nobody knows which is at fault.

    Notes
    -----
    The defaults 1e-3, 1e-4 and 1e-4 are the centre values that a Septentrio receiver's manual
    prints for Reliability, Pfa and Pmd.
    """

    false_alarm: float = 1e-3
    missed_detection: float = 1e-4
    outlier_alarm: float = 1e-4
    overall: OverallAlarm = "fixed"
    exclusions: int = 1
    largest_correlation: float = 0.95
    rival: float = 0.9

    def __post_init__(self) -> None:
        _check_pair(self.false_alarm, self.missed_detection)
        _check_pair(self.outlier_alarm, self.missed_detection)
        if self.overall not in ("fixed", "b_method"):
            raise InputError(f"overall cannot be {self.overall!r}", cure="fixed or b_method")
        if self.exclusions not in (0, 1, 2):
            raise InputError("0, 1 or 2 ranges may be excluded", evidence=f"{self.exclusions}")
        if not (0 < self.largest_correlation <= 1 and 0 < self.rival <= 1):
            raise InputError(
                "correlation and rival are shares above 0, up to 1",
                evidence=f"{self.largest_correlation}, {self.rival}",
            )

    @property
    def shift(self) -> float:
        """delta0 of the w-test."""
        return detectable_shift(self.outlier_alarm, self.missed_detection)

    @property
    def outlier_threshold(self) -> float:
        """What the w-test of a range must reach to be an outlier."""
        return upper_quantile(self.outlier_alarm / 2)

    def overall_alarm(self, dof: Ints | int) -> Floats:
        """False alarm of the overall test by degrees of freedom."""
        if self.overall == "b_method":
            return equivalent_alarm(self.outlier_alarm, self.missed_detection, dof)
        return np.where(np.asarray(dof) > 0, self.false_alarm, np.nan)

    def threshold(self, dof: Ints | int) -> Floats:
        """Threshold of the overall test by degrees of freedom."""
        from scipy.special import chndtrix

        if self.overall == "b_method":
            square = self.shift**2
            return _by_dof(lambda k: float(chndtrix(self.missed_detection, k, square)), dof)
        return chi_square_threshold(self.false_alarm, dof)

    def bias(self, dof: Ints | int) -> Floats:
        """sqrt(lambda) that the overall test misses with probability `missed_detection`."""
        if self.overall == "b_method":
            return np.where(np.asarray(dof) > 0, self.shift, np.nan)
        return detectable_noncentrality(self.false_alarm, self.missed_detection, dof)
