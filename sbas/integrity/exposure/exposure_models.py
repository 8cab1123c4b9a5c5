"""The risk of a K over an exposure, and the K of a risk, under each process model side by side.

The models disagree by a factor of hundreds in risk, because the 1/e time alone does not say how
often a high level is reached anew: that is decided by how rough the error is. Hence none is ever
given alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any

import pandas as pd

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure, naive_risk, per_sample_risk, require
from sbas.integrity.exposure.gauss_markov import continuous_risk, siegmund_risk
from sbas.integrity.exposure.gauss_markov_sampled import ar1_risk, nugget_risk
from sbas.integrity.exposure.smooth_process import smooth_risk

PUBLISHED_K = 6.18
"""K of the non-precision approach, whose risk per hour every model is asked for."""

MODELS: Mapping[str, tuple[Callable[[float, Exposure], float], str]] = MappingProxyType(
    {
        "naive": (naive_risk, "T/tau independent samples, as the standard assumes"),
        "ar1": (ar1_risk, "Gauss-Markov sampled at the interval, exact for equal axes"),
        "ou": (continuous_risk, "Gauss-Markov watched in continuous time"),
        "ou_dt": (siegmund_risk, "Gauss-Markov sampled at the interval, asymptotic (Siegmund)"),
        "rice": (smooth_risk, "second-order Gauss-Markov with this 1/e time (smooth error)"),
        "nugget": (nugget_risk, "Gauss-Markov sampled at the interval plus white noise, exact"),
    }
)
"""Process models by name: the risk of K over an exposure, and what the model says."""

_SMALLEST_RISK = 1e-15
_K_RANGE = (1.0, 12.0)


def exposure_risk(k: float, exposure: Exposure, *, model: str = "ar1") -> float:
    """Probability that the error exceeds K sigma at least once in an exposure.

    Parameters
    ----------
    k : K factor, 1e-3 to 20 ("rice": from 1 on).
    exposure : length, sampling and error process.
    model : "naive", "ar1", "ou", "ou_dt", "rice" or "nugget" (see `MODELS`).

    Returns
    -------
    float [1].

    Raises
    ------
    InputError : K out of range, or an unknown model.

    Examples
    --------
    >>> hour = Exposure(exposure_s=3600, tau_s=360, interval_s=1)
    >>> f"{exposure_risk(6.18, hour):.2e}"
    '1.43e-06'
    """
    return _risk_of(model)(k, exposure)


def exposure_k(risk: float, exposure: Exposure, *, model: str = "ar1") -> float:
    """K whose risk over an exposure is the given one; the inverse of `exposure_risk`.

    Parameters
    ----------
    risk : probability per exposure [1], from 1e-15 on and below the risk of K = 1.
    exposure : length, sampling and error process.
    model : as in `exposure_risk`.

    Returns
    -------
    float, 1 to 12, to 1e-9.

    Raises
    ------
    InputError : a risk that needs a K outside 1 to 12, or an unknown model.
    """
    of = _risk_of(model)
    require("risk", risk, least=_SMALLEST_RISK, below=1)
    low, high = _K_RANGE
    at_low = of(low, exposure)
    if risk >= at_low:
        raise InputError(
            "the risk is reached with a K of 1 already",
            where="risk",
            evidence=f"risk = {risk:g}, risk of K = 1 under {model!r}: {at_low:.4g}",
            cure="give the probability per exposure that may be tolerated, such as 5e-8",
        )
    asymptotic = model in ("ar1", "nugget") and exposure.axis_ratio == 1
    start = (
        exposure_k(risk, exposure, model="ou_dt") if asymptotic else math.sqrt(-2 * math.log(risk))
    )
    return _root(lambda k: _log_hazard(of(k, exposure)) - _log_hazard(risk), start, low, high)


def _risk_of(model: str) -> Callable[[float, Exposure], float]:
    if model not in MODELS:
        raise InputError(
            f"unknown model {model!r}", where="model", cure=f"allowed are {', '.join(MODELS)}"
        )
    return MODELS[model][0]


def _log_hazard(risk: float) -> float:
    """ln(-ln(1 - risk)): nearly a parabola in K, from risks of 1e-300 to almost 1."""
    return math.log(-math.log1p(-risk)) if risk < 1 else math.inf


def _root(excess: Callable[[float], float], start: float, low: float, high: float) -> float:
    """Root of a falling function of K, by the secant method within a shrinking bracket."""
    k = min(max(start, low), high)
    value = excess(k)
    before: tuple[float, float] | None = None
    for _ in range(100):
        if value == 0:
            return k
        low, high = (k, high) if value > 0 else (low, k)
        # The first slope is that of exp(-K^2/2).
        slope = -k if before is None else (value - before[1]) / (k - before[0])
        step = -value / slope if math.isfinite(slope) and slope < 0 else math.inf
        if abs(step) < 1e-10 or high - low < 1e-12:
            return k + (step if math.isfinite(step) else 0.0)
        before = (k, value)
        k = k + step if low < k + step < high else (low + high) / 2
        value = excess(k)
    raise ArithmeticError("the K factor did not converge; please report the arguments")


# --- side by side -----------------------------------------------------------------------------


@dataclass(frozen=True)
class ModelK:
    """K for a target under one model, its effective samples, and what 6.18 gives there."""

    k: float
    n_es: float
    hourly_risk_of_6_18: float


@dataclass(frozen=True)
class KModels:
    """K for a target risk under each process model; the answer of `k_models`.

    Parameters
    ----------
    risk : target, probability per exposure [1].
    exposure : length, sampling and error process.
    models : by name, see `MODELS`; "nugget" only where a share of white noise is given.
    caveats : sentences that must travel with the figures.
    """

    risk: float
    exposure: Exposure
    models: Mapping[str, ModelK]
    caveats: tuple[str, ...]

    @property
    def k(self) -> float:
        """K of the sampled Gauss-Markov process: "ar1", with white noise "nugget"."""
        return self.models["nugget" if "nugget" in self.models else "ar1"].k

    @property
    def per_sample_risk(self) -> float:
        """Probability that one sample exceeds `k`."""
        return per_sample_risk(self.k, self.exposure)

    def summary(self) -> pd.DataFrame:
        """A row for each model."""
        rows = {name: asdict(model) for name, model in self.models.items()}
        table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("model")
        return table.assign(meaning=[MODELS[name][1] for name in rows])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "k": self.k,
            "per_sample_risk": self.per_sample_risk,
            "risk": self.risk,
            **asdict(self.exposure),
            "models": {name: asdict(model) for name, model in self.models.items()},
            "caveats": list(self.caveats),
        }


def k_models(
    risk: float,
    *,
    exposure_s: float,
    tau_s: float,
    interval_s: float,
    dim: int = 2,
    axis_ratio: float = 1.0,
    nugget: float = 0.0,
) -> KModels:
    """K for a target risk per exposure under each process model, and the risk that 6.18 has.

    Parameters
    ----------
    risk : probability per exposure [1], from 1e-15 on.
    exposure_s : length of the exposure [s], at least tau.
    tau_s : 1/e time of one error component [s], above the interval.
    interval_s : time between samples [s].
    dim : number of components, 1 (two-sided) to 3.
    axis_ratio : minor over major axis of the error ellipse, in [0, 1], for dim = 2; K then
        multiplies the major axis.
    nugget : share of the variance that is white, in [0, 0.99].

    Returns
    -------
    KModels.

    Raises
    ------
    InputError : an argument out of range, tau <= interval, or exposure < tau.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 2.1.2: 0.5e-7 per hour and ten samples an hour give 6.18.

    Examples
    --------
    >>> answer = k_models(5e-8, exposure_s=3600, tau_s=360, interval_s=1)
    >>> {name: round(model.k, 3) for name, model in answer.models.items()}
    {'naive': 6.183, 'ar1': 6.724, 'ou': 6.767, 'ou_dt': 6.723, 'rice': 6.456}
    """
    exposure = Exposure(exposure_s, tau_s, interval_s, dim, axis_ratio, nugget)
    if exposure_s < tau_s:
        raise InputError(
            "the exposure is shorter than the decorrelation time",
            where="exposure_s",
            evidence=f"exposure_s = {exposure_s:g}, tau_s = {tau_s:g}",
            cure="the models cannot be compared there; exposure_k of the same module with "
            'model="ar1" is exact for any length',
        )
    hour = replace(exposure, exposure_s=max(3600.0, interval_s))
    names = [name for name in MODELS if name != "nugget" or nugget > 0]
    models = {}
    for name in names:
        k = exposure_k(risk, exposure, model=name)
        models[name] = ModelK(
            k=k,
            n_es=exposure_risk(k, exposure, model=name) / per_sample_risk(k, exposure),
            hourly_risk_of_6_18=exposure_risk(PUBLISHED_K, hour, model=name),
        )
    return KModels(risk, exposure, MappingProxyType(models), _caveats(exposure, models["rice"].k))


def _caveats(exposure: Exposure, rice_k: float) -> tuple[str, ...]:
    caveats = [
        "Gaussian errors with the true sigma are assumed",
        f"rice: {MODELS['rice'][1]}",
    ]
    if 2.15 * exposure.interval_s / exposure.tau_s * rice_k > 0.5:
        caveats.append("rice: the interval is too long for a smooth error; its risk is too high")
    if exposure.axis_ratio < 1:
        caveats.append(
            "ar1 uses the asymptotic form for unequal axes; equal axes are the safe side"
        )
    if exposure.nugget > 0:
        caveats.append("the white share multiplies the chances: the K of nugget is the safe one")
    return tuple(caveats)
