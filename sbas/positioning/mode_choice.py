"""Which mode's fix an epoch gives, and why it is not that of the first mode.

Source: Filip, Bazant, Mocek 2010, section 2.3 (precision approach, else non-precision approach).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.augmentation.reasons import WORDS, Reason
from sbas.augmentation.tables import Mode
from sbas.positioning.protection_levels import horizontal_level_m, vertical_level_m
from sbas.positioning.receiver_settings import ReceiverSettings
from sbas.positioning.software_receiver import Fixes

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_CODES = 100
CONTRADICTING, UNSETTLED, LEVEL_ABOVE_LIMIT = _CODES, _CODES + 1, _CODES + 2
EPOCH_WORDS = {
    **{int(reason): text for reason, text in WORDS.items()},
    CONTRADICTING: "ranges contradict each other, and nobody knows which are right",
    UNSETTLED: "no position was found that fits the ranges",
    LEVEL_ABOVE_LIMIT: "protection level of precision approach at or above the alert limit",
}
"""Why an epoch has no fix of the first mode; satellites have their own reasons."""
_TELLS_LITTLE = (Reason.LOW_ELEVATION, Reason.NO_SOLUTION)
"""Reasons of satellites that say nothing of what an epoch lacks."""


@dataclass(frozen=True, eq=False)
class ModeChoice:
    """`rows`: (n,) True by mode where its fix is given; `reason` (n,) why it is not that of the
    first mode, empty where it is."""

    rows: Mapping[Mode, Bools]
    reason: pd.Categorical


def choose_modes(fixes: Mapping[Mode, Fixes], settings: ReceiverSettings) -> ModeChoice:
    """The first mode that has a fix at each epoch.

    With alert limits in the settings a precision approach whose level reaches its limit gives way
    to a non-precision approach; where that has no fix, the first one's stays, with its level.
    """
    first_mode, first = next(iter(fixes.items()))
    n = first.solved.size
    code = _missing_fix(first)
    high = np.zeros(n, bool)
    if len(fixes) > 1:
        high = first.solved & _reaches_limit(first, settings, first_mode)
        code[high] = LEVEL_ABOVE_LIMIT
    taken = np.zeros(n, bool)
    rows: dict[Mode, Bools] = {}
    for mode, fix in fixes.items():
        rows[mode] = fix.solved & ~taken & (~high if mode == first_mode else True)
        taken |= rows[mode]
    rows[first_mode] |= first.solved & ~taken
    return ModeChoice(rows, _category(code))


def _reaches_limit(fix: Fixes, settings: ReceiverSettings, mode: Mode) -> Bools:
    reached = np.zeros(fix.solved.size, bool)
    if settings.hal_m is not None:
        reached |= horizontal_level_m(fix.covariance_m2, settings.k_h_of(mode)) >= settings.hal_m
    if settings.val_m is not None:
        reached |= vertical_level_m(fix.covariance_m2, settings.k_v) >= settings.val_m
    return reached


def _missing_fix(fix: Fixes) -> Ints:
    """(n,) code of what most satellites of an epoch without a fix lack; 0 where it has one."""
    n = fix.solved.size
    epoch = fix.measured.epoch
    lost = np.flatnonzero((fix.reason > 0) & ~fix.solved[epoch])
    counts = np.bincount(epoch[lost] * _CODES + fix.reason[lost], minlength=n * _CODES)
    counts = counts.reshape(n, _CODES)
    counts[:, list(_TELLS_LITTLE)] = 0
    code: Ints = np.argmax(counts, axis=1)
    code[counts.max(axis=1) == 0] = Reason.NO_SOLUTION
    code[np.bincount(epoch, minlength=n) == 0] = Reason.NO_PSEUDORANGE
    code[fix.contradicting] = CONTRADICTING
    code[fix.unsettled] = UNSETTLED
    code[fix.solved] = Reason.USED
    return code


def _category(code: Ints) -> pd.Categorical:
    present = np.unique(code)
    words = [EPOCH_WORDS[value] for value in present.tolist()]
    return pd.Categorical.from_codes(np.searchsorted(present, code), categories=words)


def usual_reason(fix: Fixes) -> Reason:
    """The reason most satellites were lost for, of those that tell what is missing."""
    counts = np.bincount(fix.reason[fix.reason > 0], minlength=_CODES)
    counts[list(_TELLS_LITTLE)] = 0
    if not counts.any():
        return Reason.NO_SOLUTION if len(fix.measured) else Reason.NO_PSEUDORANGE
    return Reason(int(np.argmax(counts)))
