"""Is a K enough for a target risk, when sigma and the decorrelation time are known in intervals?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import pandas as pd
from scipy import special

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import MIN_K, Exposure, n_eff_variance, require
from sbas.integrity.exposure.exposure_models import MODELS, PUBLISHED_K, exposure_risk
from sbas.integrity.exposure.gauss_markov_sampled import MAX_QUADRATURE_K

Verdict = Literal["enough", "not enough", "undecided"]
_WORDS: dict[Verdict, str] = {
    "enough": "is enough even at the upper sigma and the lower tau",
    "not enough": "is not enough even at the lower sigma and the upper tau",
    "undecided": "is neither shown nor refuted: the intervals of sigma and tau straddle the target",
}


@dataclass(frozen=True)
class SigmaFactors:
    """Limits of sigma over its estimate; each bound is one-sided at the stated confidence."""

    lower: float
    upper: float


def sigma_factors(
    *, record_s: float, tau_s: float, components: int = 1, confidence: float = 0.95
) -> SigmaFactors:
    """How far the true sigma may lie from the estimate of a correlated record.

    Parameters
    ----------
    record_s : length of the record [s].
    tau_s : 1/e time [s]: its upper limit, the safe one.
    components : number of components whose variances are pooled, 1 to 3.
    confidence : of each one-sided bound, in [0.5, 1).

    Returns
    -------
    SigmaFactors: multiply the estimate by `upper` for the upper bound of sigma.

    Raises
    ------
    InputError : an argument out of range, or a record shorter than tau.

    Notes
    -----
    nu sigma_hat^2/sigma^2 is about chi-square with nu = `n_eff_variance` degrees of freedom:
    factors sqrt(nu/chi2) at its lower and upper quantile.

    References
    ----------
    Chi-square interval of a variance; degrees of freedom by Bayley and Hammersley 1946.
    """
    require("confidence", confidence, least=0.5, below=1)
    nu = n_eff_variance(exposure_s=record_s, tau_s=tau_s, components=components)
    low = 2 * float(special.gammaincinv(nu / 2, 1 - confidence))
    high = 2 * float(special.gammainccinv(nu / 2, 1 - confidence))
    return SigmaFactors(lower=math.sqrt(nu / high), upper=math.sqrt(nu / low))


@dataclass(frozen=True)
class RiskInterval:
    """Risk of a K over an exposure under one model, at the ends of sigma and tau.

    Parameters
    ----------
    point : at the estimates of sigma and tau.
    upper_sigma : at the upper bound of sigma.
    upper_sigma_lower_tau : at the upper bound of sigma and the lower limit of tau, the worst.
    lower_sigma_upper_tau : at the lower bound of sigma and the upper limit of tau, the best.
    verdict : "enough" (the worst is below the target), "not enough" (the best is not) or
        "undecided".
    """

    point: float
    upper_sigma: float
    upper_sigma_lower_tau: float
    lower_sigma_upper_tau: float
    verdict: Verdict


@dataclass(frozen=True)
class KVerdict:
    """Whether a K is enough for a target, under each model; the answer of `k_verdict`."""

    k: float
    target: float
    exposure: Exposure
    tau_lower_s: float
    tau_upper_s: float
    sigma_ratio: float
    sigma: SigmaFactors
    confidence: float
    risks: Mapping[str, RiskInterval]

    @property
    def verdict(self) -> str:
        """The answer in words, for all models."""
        start = f"K = {self.k:g} for {self.target:g} per {self.exposure.exposure_s:g} s"
        parts = []
        for verdict, words in _WORDS.items():
            names = [name for name, r in self.risks.items() if r.verdict == verdict]
            if names:
                parts.append(f"under {', '.join(names)} it {words}")
        if len(parts) > 1:
            parts.append("the models disagree: how rough the error is decides")
        return f"{start}: {'; '.join(parts)}."

    def summary(self) -> pd.DataFrame:
        """A row for each model."""
        rows = {name: asdict(interval) for name, interval in self.risks.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("model")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "k": self.k,
            "target": self.target,
            **asdict(self.exposure),
            "tau_lower_s": self.tau_lower_s,
            "tau_upper_s": self.tau_upper_s,
            "sigma_ratio": self.sigma_ratio,
            "sigma_factors": asdict(self.sigma),
            "confidence": self.confidence,
            "risks": {name: asdict(interval) for name, interval in self.risks.items()},
            "verdict": self.verdict,
        }


def k_verdict(
    target: float,
    exposure: Exposure,
    *,
    tau_lower_s: float,
    tau_upper_s: float,
    record_s: float,
    k: float = PUBLISHED_K,
    sigma_ratio: float = 1.0,
    pooled_ratio: float | None = None,
    components: int = 2,
    confidence: float = 0.95,
) -> KVerdict:
    """Is K enough for a target risk, with the intervals of tau and sigma carried through?

    Parameters
    ----------
    target : tolerable probability per exposure [1], in (0, 1).
    exposure : length, sampling and error process at the estimate of tau.
    tau_lower_s, tau_upper_s : limits of tau [s], around the estimate.
    record_s : length of the record that sigma was estimated from [s].
    k : K factor in question, 1 to 20.
    sigma_ratio : estimated sigma of the error over the sigma that K multiplies (HPL/K) [1].
    pooled_ratio : where `sigma_ratio` is that of the major axis alone, the root mean square over
        all components, at most as large [1]: its lower bound is one of the major axis too. None:
        `sigma_ratio` itself is pooled, the axes are equal.
    components : number of components pooled in the estimate of sigma.
    confidence : of each one-sided bound of sigma.

    Returns
    -------
    KVerdict.

    Raises
    ------
    InputError : an argument out of range, limits of tau that do not hold its estimate, or a K
        below 1 in units of the true sigma.

    Notes
    -----
    sigma larger by a factor f makes K smaller by f. The bounds of sigma take n_eff_variance at
    the upper limit of tau. Errors are assumed Gaussian. A K above 20 in units of the true sigma
    counts as 20, whose risk is higher (below 1e-80).
    """
    require("target", target, above=0, below=1)
    require("k", k, least=MIN_K, most=MAX_QUADRATURE_K)
    require("sigma_ratio", sigma_ratio, above=0)
    require("tau_lower_s", tau_lower_s, above=0, most=exposure.tau_s)
    require("tau_upper_s", tau_upper_s, least=exposure.tau_s)
    sigma = sigma_factors(
        record_s=record_s, tau_s=tau_upper_s, components=components, confidence=confidence
    )
    if pooled_ratio is not None:
        require("pooled_ratio", pooled_ratio, above=0, most=sigma_ratio)
        # One axis has the samples of one component; the larger of two estimates errs upwards.
        alone = sigma_factors(record_s=record_s, tau_s=tau_upper_s, confidence=confidence)
        sigma = SigmaFactors(lower=pooled_ratio / sigma_ratio * sigma.lower, upper=alone.upper)
    worst, point, best = (
        min(k / (sigma_ratio * f), MAX_QUADRATURE_K) for f in (sigma.upper, 1.0, sigma.lower)
    )
    if worst < 1:
        raise InputError(
            "K in units of the true sigma can be below 1",
            where="sigma_ratio",
            evidence=f"K = {k:g}, sigma_ratio = {sigma_ratio:g}, lower bound {worst:.4g}",
            cure="check that sigma_ratio is the error's sigma over HPL/K, both in m",
        )
    fast = replace(exposure, tau_s=tau_lower_s)
    slow = replace(exposure, tau_s=tau_upper_s)
    risks = {}
    for name in (name for name in MODELS if name != "nugget" or exposure.nugget > 0):
        high = exposure_risk(worst, fast, model=name)
        low = exposure_risk(best, slow, model=name)
        verdict: Verdict = (
            "enough" if high < target else "not enough" if low >= target else "undecided"
        )
        risks[name] = RiskInterval(
            point=exposure_risk(point, exposure, model=name),
            upper_sigma=exposure_risk(worst, exposure, model=name),
            upper_sigma_lower_tau=high,
            lower_sigma_upper_tau=low,
            verdict=verdict,
        )
    return KVerdict(
        k=k,
        target=target,
        exposure=exposure,
        tau_lower_s=tau_lower_s,
        tau_upper_s=tau_upper_s,
        sigma_ratio=sigma_ratio,
        sigma=sigma,
        confidence=confidence,
        risks=MappingProxyType(risks),
    )
