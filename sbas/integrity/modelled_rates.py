"""Rates per hour by the fitted tail, for every kind of event."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sbas.estimate import Estimate, Refusal
from sbas.integrity.error_process import ErrorProcess
from sbas.integrity.level_counts import LevelCounts
from sbas.integrity.rate_evidence import EventKind
from sbas.integrity.tails.tail_model import modelled_rate


def modelled_event_rate(
    kind: EventKind,
    alert_limit_m: float,
    *,
    process: ErrorProcess,
    levels: LevelCounts,
    confidence: float,
) -> Estimate | Refusal:
    """Rate per hour of one kind of event by the fitted tail, over the levels as they were.

    Parameters
    ----------
    kind : "mi" (the error reaches HPL = K sigma), "exceeds_al" (it reaches the alert limit) or
        "hmi" (it does while HPL is below the alert limit).
    alert_limit_m : horizontal alert limit [m].
    process : of the errors, its tail in units of sigma = HPL/K.
    levels : epochs with a level, counted finely; each counts with the edge of its bin that makes
        the rate larger.
    confidence : of the one-sided upper bound.

    Returns
    -------
    Estimate in "per_h" of `modelled` evidence, or why there is none. Every exceedance counts,
    however short: the time to alert is no part of the model.

    References
    ----------
    `sbas.integrity.tails.tail_model.modelled_rate`.
    """
    if isinstance(process.tail, Refusal):
        return process.tail
    pairs = levels.by_k(process.k_of_mode)
    level_k = pairs.k if kind == "mi" else alert_limit_m * pairs.k / pairs.upper_m
    rises = pairs.fresh if kind == "mi" else pairs.rises
    if kind == "hmi":
        level_k = np.where(pairs.lower_m < alert_limit_m, level_k, np.inf)
        rises = pairs.rises_below(alert_limit_m)
    rate = modelled_rate(
        process.tail, level_k, counts=pairs.epochs, rises=rises, confidence=confidence
    )
    if kind == "mi" or isinstance(rate, Refusal):
        return rate
    return replace(rate, caveats=(*rate.caveats, "errors are taken to grow as HPL does"))
