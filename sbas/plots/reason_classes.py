"""Reasons for leaving a satellite out, in a few classes that a picture can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.augmentation.reasons import WORDS, Reason
from sbas.plots.style import BLACK, BLUE, GREEN, MUTED, ORANGE, PURPLE, SKY, VERMILION


@dataclass(frozen=True)
class ReasonClass:
    """Words and look of a class: each has a mark of its own, so that none rests on colour."""

    words: str
    colour: str
    marker: str


CLASSES = (
    ReasonClass("used", BLUE, "o"),
    ReasonClass("below the elevation mask", MUTED, "v"),
    ReasonClass("no ionospheric correction", ORANGE, "s"),
    ReasonClass("no valid orbit, clock or fast correction", PURPLE, "D"),
    ReasonClass("not monitored, or not to be used", VERMILION, "X"),
    ReasonClass("weak, interrupted or outlying signal", SKY, "^"),
    ReasonClass("too few satellites for a position", BLACK, "P"),
    ReasonClass("other reason", GREEN, "*"),
)
"""From used to the rest; a reason in other words than ours is of the last."""
USED, OTHER = 0, len(CLASSES) - 1

_OF_REASON: dict[Reason, int] = {
    Reason.LOW_ELEVATION: 1,
    Reason.NO_SOLUTION: 6,
    **dict.fromkeys(
        (
            Reason.NO_IONO_MASK, Reason.IONO_MASK_EXPIRED, Reason.NOT_A_GRID_POINT,
            Reason.OUTSIDE_GRID, Reason.IONO_NOT_MONITORED, Reason.IONO_OUTSIDE_TRIANGLE,
        ),
        2,
    ),
    **dict.fromkeys(
        (
            Reason.NO_MASK, Reason.MASK_EXPIRED, Reason.NOT_IN_MASK, Reason.NO_DEGRADATION,
            Reason.DEGRADATION_EXPIRED, Reason.NO_FAST_CORRECTION, Reason.UDREI_EXPIRED,
            Reason.NO_FAST_DEGRADATION, Reason.FAST_DEGRADATION_EXPIRED,
            Reason.FAST_CORRECTION_EXPIRED, Reason.ONE_FAST_CORRECTION,
            Reason.ALARM_RANGE_RATE_STEP_TOO_LONG, Reason.ALARM_RANGE_RATE_TOO_OLD,
            Reason.RANGE_RATE_STEP_TOO_LONG, Reason.RANGE_RATE_TOO_OLD, Reason.SERVICE_EXPIRED,
            Reason.SERVICE_INCOMPLETE, Reason.NO_COVARIANCE, Reason.COVARIANCE_EXPIRED,
            Reason.NO_GEO_NAVIGATION, Reason.GEO_NAVIGATION_EXPIRED, Reason.NO_LONG_TERM,
            Reason.LONG_TERM_EXPIRED, Reason.NO_MATCHING_EPHEMERIS, Reason.NO_EPHEMERIS,
            Reason.LINK_LOST,
        ),
        3,
    ),
    **dict.fromkeys(
        (
            Reason.NOT_MONITORED, Reason.DO_NOT_USE, Reason.UDREI_TOO_LARGE, Reason.GEO_URA,
            Reason.IONO_DO_NOT_USE,
        ),
        4,
    ),
    **dict.fromkeys(
        (
            Reason.WEAK_SIGNAL, Reason.SHORT_ARC, Reason.CYCLE_SLIP, Reason.OUTLIER,
            Reason.NO_PSEUDORANGE,
        ),
        5,
    ),
}  # fmt: skip
_OF_WORDS = {WORDS[reason]: number for reason, number in _OF_REASON.items()}


def classes_of(satellites: pd.DataFrame) -> NDArray[np.int64]:
    """(n,) class (an index into `CLASSES`) of every row of a satellite table."""
    n = len(satellites)
    if "reason" in satellites:
        reason = satellites["reason"].astype("category").cat
        by_code = np.array([_OF_WORDS.get(w, OTHER) for w in reason.categories] + [OTHER])
        number = by_code[reason.codes.to_numpy()]
    else:
        number = np.full(n, OTHER)
    used = satellites["used"].to_numpy() if "used" in satellites else np.zeros(n, bool)
    return np.where(used, USED, number)
