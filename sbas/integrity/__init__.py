"""From a recording and its truth to errors, regions, events, availability and rates."""

from sbas.integrity.allocation import load_allocation
from sbas.integrity.evaluation import evaluate
from sbas.integrity.failure_rates import failure_rate
from sbas.integrity.k_factors import k_factor
from sbas.integrity.planning import plan_hours
from sbas.integrity.position_error import position_errors

__all__ = [
    "evaluate",
    "failure_rate",
    "k_factor",
    "load_allocation",
    "plan_hours",
    "position_errors",
]
