"""Is K = 6.18 enough on this recording, which K is, and what that K leaves of availability?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sbas.estimate import Refusal
from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.exposure_models import KModels, exposure_k, k_models
from sbas.integrity.exposure.k_verdicts import KVerdict, k_verdict
from sbas.integrity.results import Evaluation

RAILWAY_RISK_PER_H = 5e-8
"""Horizontal fault-free share of 1e-7 per hour (Filip, Bazant, Mocek 2010, 2.1.2)."""
HOUR_S = 3600.0
LARGEST_RATIO = 3.0
"""Errors so much larger than their levels claim have left the model; the verdict is plain."""


@dataclass(frozen=True)
class RailwayJudgement:
    """What the measured decorrelation time means for K and for availability.

    Parameters
    ----------
    risk_per_h : target [1/h].
    models : K for it at the measured decorrelation time, under each process model.
    as_claimed : verdict on 6.18 if errors measured as here had just the sigma that the levels
        claim, HPL/K (ratio 1, with the sampling error of this record).
    as_seen : the same with the sigma that the errors had, or why it cannot be given.
    k : K for the target at the lower limit of tau, sampled Gauss-Markov with the white share of
        the record: the safe side of the measured process [1].
    availability : by alert limit [m], share of all epochs (gaps left out) with HPL below it as
        recorded, and re-scaled to `k` ("railway HPL").
    """

    risk_per_h: float
    models: KModels
    as_claimed: KVerdict
    as_seen: KVerdict | Refusal
    k: float
    availability: dict[float, tuple[float, float]]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "risk_per_h": self.risk_per_h,
            "models": self.models.to_dict(),
            "as_claimed": self.as_claimed.to_dict(),
            "as_seen": self.as_seen.to_dict(),
            "k": self.k,
            "availability": {
                f"{limit:g}": {"as_recorded": recorded, "railway_hpl": railway}
                for limit, (recorded, railway) in self.availability.items()
            },
        }


def railway_judgement(
    evaluation: Evaluation, *, risk_per_h: float = RAILWAY_RISK_PER_H
) -> RailwayJudgement | Refusal:
    """What K the measured errors need for a railway target, and what becomes of availability.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    risk_per_h : probability per hour that the error may exceed the level.

    Returns
    -------
    RailwayJudgement, or a Refusal where the decorrelation time is not known, has no upper limit,
    or is no single time (a mixture).

    Raises
    ------
    InputError : a risk that no K between 1 and 12 has.

    Notes
    -----
    Availability is counted from levels in bins of 0.05 %, each at its upper edge; a level whose
    K is unknown counts as above every limit.

    References
    ----------
    Filip, Bazant, Mocek 2010, 2.1.2 and section 4 (the question); methods: exposure.
    """
    process = evaluation.process
    found = process.decorrelation
    tau = found.tau_s
    if isinstance(tau, Refusal):
        return tau
    if found.misfit == "mixture":
        return Refusal("the errors are a mixture: one decorrelation time gives no K",
                       "analyse its parts, by environment or by time")  # fmt: skip
    low, high, step_s, recorded_s = tau.lower, tau.upper, found.step_s, found.recorded_s
    if low is None or high is None or step_s is None or recorded_s is None:
        return Refusal("the decorrelation time has no upper limit", "record longer")
    if low <= step_s or high >= HOUR_S:
        return Refusal(
            f"a decorrelation time of {low:.4g} to {high:.4g} s lies outside what an hour at "
            f"steps of {step_s:g} s can tell"
        )
    white = found.white_share
    exposure = Exposure(HOUR_S, tau.value, step_s, nugget=white)
    safe = replace(exposure, tau_s=low)

    def verdict(sigma_ratio: float, pooled_ratio: float | None = None) -> KVerdict:
        return k_verdict(
            risk_per_h,
            exposure,
            tau_lower_s=low,
            tau_upper_s=high,
            record_s=recorded_s,
            sigma_ratio=sigma_ratio,
            pooled_ratio=pooled_ratio,
        )

    k = exposure_k(risk_per_h, safe, model="nugget" if white > 0 else "ar1")
    own, railway = np.ones_like(process.k_of_mode), k / process.k_of_mode
    below = evaluation.levels.share_below
    return RailwayJudgement(
        risk_per_h=risk_per_h,
        models=k_models(
            risk_per_h,
            exposure_s=HOUR_S,
            tau_s=tau.value,
            interval_s=step_s,
            nugget=white,
        ),
        as_claimed=verdict(1.0),
        as_seen=_as_seen(evaluation, verdict),
        k=k,
        availability={
            limit: (below(limit, own), below(limit, railway))
            for limit in evaluation.settings.alert_limits_m
        },
    )


def _as_seen(
    evaluation: Evaluation, verdict: Callable[[float, float | None], KVerdict]
) -> KVerdict | Refusal:
    ratio = evaluation.process.sigma_ratio
    if evaluation.errors_are_lower_bound:
        return Refusal(
            "errors against this truth are only a lower bound",
            "--truth LAT,LON,HEIGHT of the antenna",
        )
    if ratio is None:
        return Refusal("no epoch has both an error and a level with a known K")
    if ratio > LARGEST_RATIO:
        return Refusal(f"the errors are {ratio:.3g} times what the levels claim: no K of a "
                       "Gaussian error describes that")  # fmt: skip
    return verdict(ratio, evaluation.process.pooled_ratio)
