"""From a recording and its truth to errors, regions, events, availability and rates."""

from sbas.integrity.allocation import load_allocation
from sbas.integrity.causes.causes import explain
from sbas.integrity.comparison.comparison import compare
from sbas.integrity.correlation.correlation import decorrelation
from sbas.integrity.evaluation import evaluate
from sbas.integrity.exposure.exposure_models import k_models
from sbas.integrity.exposure.k_verdicts import k_verdict
from sbas.integrity.exposure.railway_levels import railway_hpl
from sbas.integrity.failure_rates import failure_rate
from sbas.integrity.k_factors import k_factor
from sbas.integrity.planning import plan_hours
from sbas.integrity.position_error import position_errors

__all__ = [
    "compare",
    "decorrelation",
    "evaluate",
    "explain",
    "failure_rate",
    "k_factor",
    "k_models",
    "k_verdict",
    "load_allocation",
    "plan_hours",
    "position_errors",
    "railway_hpl",
]
