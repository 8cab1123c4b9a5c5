"""Which fix an epoch gives, and in which words it says why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sbas.augmentation.reasons import WORDS, Reason
from sbas.positioning.mode_choice import (
    CONTRADICTING,
    EPOCH_WORDS,
    UNSETTLED,
    choose_modes,
    usual_reason,
)
from sbas.positioning.receiver_settings import ReceiverSettings
from sbas.positioning.software_receiver import Fixes
from tests.positioning.reference_cases import case_fixes


def unsolved(fixes: Fixes, epoch: int, reasons: list[Reason]) -> Fixes:
    """One epoch without a fix, its first ranges lost for these reasons, the others sound."""
    rows = np.flatnonzero(fixes.measured.epoch == epoch)
    reason, solved = fixes.reason.copy(), fixes.solved.copy()
    reason[rows] = Reason.NO_SOLUTION
    reason[rows[: len(reasons)]] = reasons
    solved[epoch] = False
    return replace(fixes, reason=reason, solved=solved)


def words_at(fixes: Fixes, epoch: int) -> str:
    return str(choose_modes({"pa": fixes}, ReceiverSettings()).reason[epoch])


def test_the_reason_is_what_most_satellites_lack(reference_data: Path) -> None:
    fixes = case_fixes(reference_data, "vehicle", "pa")
    assert words_at(fixes, 200) == ""
    fast, grid, low = (
        Reason.FAST_CORRECTION_EXPIRED, Reason.OUTSIDE_GRID, Reason.LOW_ELEVATION,
    )  # fmt: skip
    for reasons, expected in (
        ([fast, fast, grid], fast),
        ([low, low, low, grid], grid),  # a low satellite tells nothing of the corrections
        ([low] * 6, Reason.NO_SOLUTION),
        ([], Reason.NO_SOLUTION),
    ):
        assert words_at(unsolved(fixes, 200, reasons), 200) == WORDS[expected]


def test_epochs_withheld_say_so(reference_data: Path) -> None:
    fixes = unsolved(case_fixes(reference_data, "vehicle", "pa"), 200, [])
    here = np.arange(fixes.solved.size) == 200
    assert words_at(replace(fixes, contradicting=here), 200) == EPOCH_WORDS[CONTRADICTING]
    assert words_at(replace(fixes, unsettled=here), 200) == EPOCH_WORDS[UNSETTLED]


def test_an_epoch_without_ranges(reference_data: Path) -> None:
    fixes = unsolved(case_fixes(reference_data, "vehicle", "pa"), 200, [])
    kept = np.flatnonzero(fixes.measured.epoch != 200)
    empty = replace(fixes, measured=fixes.measured.some(kept), reason=fixes.reason[kept])
    assert words_at(empty, 200) == WORDS[Reason.NO_PSEUDORANGE]


def test_each_epoch_has_one_mode(reference_data: Path) -> None:
    pa, npa = (case_fixes(reference_data, "vehicle", mode) for mode in ("pa", "npa"))
    choice = choose_modes({"pa": pa, "npa": npa}, ReceiverSettings(mode="auto"))
    assert (choice.rows["pa"] == pa.solved).all()
    assert (choice.rows["npa"] == (npa.solved & ~pa.solved)).all()
    # A precision approach above the limit stays where the other mode has nothing.
    neither = replace(npa, solved=np.zeros_like(npa.solved))
    strict = ReceiverSettings(mode="auto", hal_m=1.0)
    choice = choose_modes({"pa": pa, "npa": neither}, strict)
    assert (choice.rows["pa"] == pa.solved).all()
    assert set(np.asarray(choice.reason)[pa.solved]) == {
        "protection level of precision approach at or above the alert limit"
    }


def test_the_usual_reason(reference_data: Path) -> None:
    fixes = case_fixes(reference_data, "vehicle", "pa")
    assert usual_reason(fixes) == Reason.OUTSIDE_GRID
    none = replace(fixes, reason=np.zeros_like(fixes.reason))
    assert usual_reason(none) == Reason.NO_SOLUTION
    nothing = np.arange(0)
    empty = replace(fixes, measured=fixes.measured.some(nothing), reason=fixes.reason[nothing])
    assert usual_reason(empty) == Reason.NO_PSEUDORANGE
