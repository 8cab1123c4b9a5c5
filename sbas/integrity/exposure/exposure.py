"""From the risk of a sample or a window to the risk of an exposure, and what sets the two apart.

Without a process model there are only limits. With one, the effective number of samples for
exposure, `n_es`, carries the probability of a single sample over to the whole exposure. It is
neither the effective sample size of a mean nor that of a variance: three names, three functions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sbas.exceptions import InputError
from sbas.integrity.k_factors import exceedance

MIN_K, MAX_K = 1e-3, 35.0
"""K for exposure risks: outside, the risk per sample is no longer apart from 1 or 0 in a double."""


@dataclass(frozen=True)
class Exposure:
    """How long a user is exposed, how often the error is sampled, and how it moves.

    Parameters
    ----------
    exposure_s : length of the exposure T [s], at least one interval.
    tau_s : 1/e time of the autocorrelation of one error component [s], above the interval.
    interval_s : time between samples dt [s].
    dim : number of components: 1 (two-sided), 2 (horizontal error) or 3.
    axis_ratio : minor over major axis of the horizontal error ellipse, in [0, 1]; below 1 only
        with dim = 2, and K then multiplies the major axis.
    nugget : share of each component's variance that is white, in [0, 1).

    Raises
    ------
    InputError : an argument out of range, named.
    """

    exposure_s: float
    tau_s: float
    interval_s: float
    dim: int = 2
    axis_ratio: float = 1.0
    nugget: float = 0.0

    def __post_init__(self) -> None:
        for name in ("exposure_s", "tau_s", "interval_s"):
            require(name, getattr(self, name), above=0)
        if self.tau_s <= self.interval_s:
            raise InputError(
                "the decorrelation time is not longer than the interval between samples",
                where="tau_s",
                evidence=f"tau_s = {self.tau_s:g}, interval_s = {self.interval_s:g}",
                cure="such samples are independent: the risk is -expm1(n * log1p(-p))",
            )
        if self.exposure_s < self.interval_s:
            raise InputError(
                "the exposure is shorter than the interval between samples",
                where="exposure_s",
                evidence=f"exposure_s = {self.exposure_s:g}, interval_s = {self.interval_s:g}",
            )
        require_dim(self.dim)
        require("axis_ratio", self.axis_ratio, least=0, most=1)
        if self.axis_ratio < 1 and self.dim != 2:
            raise InputError(
                "axis_ratio belongs to the horizontal error, dim = 2",
                where="axis_ratio",
                evidence=f"dim = {self.dim}",
            )
        require("nugget", self.nugget, least=0, below=1)

    @property
    def samples(self) -> int:
        """Number of samples in the exposure; a begun interval counts, the safe side."""
        steps = self.exposure_s / self.interval_s
        # 3600 / 0.2 must not become 18001 by rounding.
        return max(1, math.ceil(steps * (1 - 1e-12)))

    @property
    def correlation(self) -> float:
        """Correlation of successive samples of the slow part."""
        return math.exp(-self.interval_s / self.tau_s)


def require(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    below: float = math.inf,
    most: float = math.inf,
) -> None:
    """Refuse what is not a finite number within the given limits.

    Parameters
    ----------
    name : of the argument, for the message.
    value : argument.
    above, least, below, most : limits that the value must exceed, reach, stay under, not exceed.

    Raises
    ------
    InputError : naming the argument, its value and what is allowed.
    """
    try:
        number = math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if math.isfinite(number) and above < number < below and least <= number <= most:
        return
    words = {"above": above, "at least": least, "below": below, "at most": most}
    limits = [f"{word} {limit:g}" for word, limit in words.items() if math.isfinite(limit)]
    raise InputError(
        f"{name} is out of range",
        where=name,
        evidence=repr(value)[:80],
        cure=f"give a finite number{' ' if limits else ''}{' and '.join(limits)}",
    )


def require_dim(dim: Any) -> None:
    """Refuse a number of components other than 1, 2 or 3.

    Raises
    ------
    InputError : naming `dim`.
    """
    if isinstance(dim, bool) or dim not in (1, 2, 3):
        raise InputError("dim is 1, 2 or 3 components", where="dim", evidence=repr(dim)[:80])


# --- limits without a process model -----------------------------------------------------------


@dataclass(frozen=True)
class RiskLimits:
    """Risk of an exposure from the risk of a window, without a process model.

    `lower` and `upper` hold for every stationary process. The two named readings of the same
    requirement, `full_correlation` and `independent_windows`, lie between them; `rate_per_h` is
    the rate of independent windows.
    """

    lower: float
    upper: float
    full_correlation: float
    independent_windows: float
    rate_per_h: float


def risk_limits(window_risk: float, *, window_s: float, exposure_s: float) -> RiskLimits:
    """Both ends of the risk of an exposure, given the risk of a window of another length.

    Parameters
    ----------
    window_risk : probability [1] of at least one exceedance in a window, in (0, 1).
    window_s : length of the window [s]: a sample's interval, 15 s, 150 s, an hour.
    exposure_s : length of the exposure [s], longer or shorter than the window.

    Returns
    -------
    RiskLimits.

    Raises
    ------
    InputError : an argument out of range.

    Notes
    -----
    With n = T/T_w: full correlation P_w; independent windows 1 - (1 - P_w)^n; rate
    -ln(1 - P_w)/T_w. Stationary bounds: P_w to ceil(n) P_w for n >= 1, P_w/ceil(1/n) to P_w for
    n < 1. The independent reading is the upper end for Gaussian errors and symmetric limits
    (Gaussian correlation inequality), not for every process.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 2.2 (independent reading, and that strong correlation
    makes it invalid); Royen 2014, Far East J. Theor. Stat. 48, 139 (inequality).

    Examples
    --------
    >>> round(risk_limits(2e-7, window_s=150, exposure_s=3600).independent_windows, 12)
    4.799989e-06
    """
    require("window_risk", window_risk, above=0, below=1)
    require("window_s", window_s, above=0)
    require("exposure_s", exposure_s, above=0)
    windows = exposure_s / window_s
    # Quotients such as 3600 / 0.2 must not be rounded up to one window more.
    whole = math.ceil(max(windows, 1 / windows) * (1 - 1e-12))
    if windows >= 1:
        lower, upper = window_risk, min(1.0, whole * window_risk)
    else:
        lower, upper = window_risk / whole, window_risk
    hazard = -math.log1p(-window_risk)
    return RiskLimits(
        lower=lower,
        upper=upper,
        full_correlation=window_risk,
        independent_windows=-math.expm1(-windows * hazard),
        rate_per_h=hazard * 3600 / window_s,
    )


# --- three effective sample sizes -------------------------------------------------------------


def n_eff_mean(*, exposure_s: float, tau_s: float) -> float:
    """Effective sample size of the mean of a Gauss-Markov component, T/(2 tau).

    Parameters
    ----------
    exposure_s : length of the record [s].
    tau_s : 1/e time [s]; its upper limit is the safe one.

    Returns
    -------
    float [1]; var(mean) = sigma^2 / n_eff_mean for T >> tau.

    Raises
    ------
    InputError : an argument out of range, or T < tau.

    References
    ----------
    Bayley and Hammersley 1946, J. R. Stat. Soc. Suppl. 8, 184, for an exponential ACF.
    """
    _require_exposure_of_tau(exposure_s, tau_s)
    return exposure_s / (2 * tau_s)


def n_eff_variance(*, exposure_s: float, tau_s: float, components: int = 1) -> float:
    """Effective sample size of a Gauss-Markov variance estimate, T/tau for each component.

    Parameters
    ----------
    exposure_s : length of the record [s].
    tau_s : 1/e time [s]; its upper limit is the safe one.
    components : number of components pooled, 1 to 3 (2 for east and north).

    Returns
    -------
    float [1]: degrees of freedom of the chi-square distribution of the estimate. This is the
    "ten independent samples per hour" of the paper at tau = 360 s; it is not `n_es`.

    Raises
    ------
    InputError : an argument out of range, or T < tau.

    References
    ----------
    Bayley and Hammersley 1946, J. R. Stat. Soc. Suppl. 8, 184: integral of the squared ACF.
    """
    _require_exposure_of_tau(exposure_s, tau_s)
    if isinstance(components, bool) or components not in (1, 2, 3):
        raise InputError("components is 1, 2 or 3", where="components", evidence=repr(components))
    return components * exposure_s / tau_s


def n_es(risk: float, per_sample_risk: float) -> float:
    """Effective number of samples for exposure: how often the risk of one sample is taken.

    Parameters
    ----------
    risk : probability of at least one exceedance in the exposure [1], in (0, 1].
    per_sample_risk : probability of exceedance at one sample [1], in (0, risk].

    Returns
    -------
    float [1], at least 1: risk / per_sample_risk.

    Raises
    ------
    InputError : an argument out of range.
    """
    require("risk", risk, above=0, most=1)
    require("per_sample_risk", per_sample_risk, above=0, most=risk)
    return risk / per_sample_risk


def _require_exposure_of_tau(exposure_s: float, tau_s: float) -> None:
    require("exposure_s", exposure_s, above=0)
    require("tau_s", tau_s, above=0)
    if exposure_s < tau_s:
        raise InputError(
            "the exposure is shorter than the decorrelation time",
            where="exposure_s",
            evidence=f"exposure_s = {exposure_s:g}, tau_s = {tau_s:g}",
            cure="it then holds less than one effective sample, and the formula is void",
        )


# --- closed forms -----------------------------------------------------------------------------


def per_sample_risk(k: float, exposure: Exposure) -> float:
    """Probability that one sample exceeds K, for the dimension and axis ratio of an exposure.

    Parameters
    ----------
    k : K factor, 1e-3 to 35.
    exposure : its `dim` and `axis_ratio` count.

    Returns
    -------
    float [1].

    Raises
    ------
    InputError : K out of range.
    """
    require("k", k, least=MIN_K, most=MAX_K)
    if exposure.dim == 2:
        return exceedance(float(k), distribution="ellipse", axis_ratio=exposure.axis_ratio)
    return exceedance(float(k), distribution="chi", dim=exposure.dim)


def naive_risk(k: float, exposure: Exposure) -> float:
    """Risk if the exposure held T/tau independent samples, as the standard assumes.

    Parameters
    ----------
    k : K factor, 1e-3 to 35.
    exposure : length, tau, dimension and axis ratio; an exposure under tau counts as one sample.

    Returns
    -------
    float [1]. It is far too low for a Gauss-Markov error: exceedances of a high level
    decorrelate much faster than the error itself.

    Raises
    ------
    InputError : K out of range.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 2.1.2: ten independent samples per hour at tau = 360 s.
    """
    samples = max(1.0, exposure.exposure_s / exposure.tau_s)
    return -math.expm1(samples * math.log1p(-per_sample_risk(k, exposure)))


def risk_from_hazard(per_sample_risk: float, *, hazard_per_s: float, exposure_s: float) -> float:
    """Risk of an exposure from the risk at its first sample and a constant hazard after it.

    Parameters
    ----------
    per_sample_risk : probability of exceedance at the start [1], in (0, 1).
    hazard_per_s : rate of first exceedances [1/s], not negative.
    exposure_s : length of the exposure [s], above 0.

    Returns
    -------
    float [1]: 1 - (1 - p) exp(-h T), as p + (1 - p)(1 - exp(-h T)).

    Raises
    ------
    InputError : an argument out of range.
    """
    require("per_sample_risk", per_sample_risk, above=0, below=1)
    require("hazard_per_s", hazard_per_s, least=0)
    require("exposure_s", exposure_s, above=0)
    later = -math.expm1(-hazard_per_s * exposure_s)
    return per_sample_risk + (1 - per_sample_risk) * later
