"""What a receiver gave, epoch by epoch, against a table written by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.dependability.receiver.state_tally import Answers, one_step_ns, receiver_answers
from sbas.recording import MODES, Flag

KINDS = {
    "fix": (True, "sbas_npa", 0, False),
    "alarmed": (True, "sbas_npa", Flag.RAIM_FAILED, False),
    "declared_none": (True, "none", 0, False),
    "lost": (False, "sbas_npa", Flag.EPOCH_INCOMPLETE, False),
    "silent": (False, "none", Flag.EPOCH_INCOMPLETE, False),
    "fault": (True, "sbas_npa", Flag.RAIM_FAILED, True),
}


def table(kinds: list[str]) -> pd.DataFrame:
    delivered, mode, flags, fault = zip(*(KINDS[k] for k in kinds), strict=True)
    return pd.DataFrame(
        {
            "lat_deg": np.where(delivered, 47.0, np.nan),
            "lon_deg": 19.0,
            "mode": pd.Categorical(mode, categories=MODES),
            "flags": np.array(flags, np.uint32),
            "hardware_fault": np.array(fault, bool),
        }
    )


def where(mask: np.ndarray) -> list[int]:
    return np.flatnonzero(mask).tolist()


def check(gave: Answers, expected: dict[str, list[int]]) -> None:
    assert {name: where(getattr(gave, name)) for name in expected} == expected


def test_each_epoch_has_one_answer_and_a_failure_is_followed_by_waiting() -> None:
    kinds = ["silent", "fix", "fault", "silent", "lost", "declared_none", "alarmed", "silent",
             "fault", "fix", "lost"]  # fmt: skip
    check(
        receiver_answers(table(kinds)),
        {
            "fix": [1, 9], "alarmed": [6], "declared_none": [5], "lost": [4, 10], "fault": [2, 8],
            # Until RAIM's alarm, which is an answer too; what the logger lost is not told.
            "waiting": [3, 5], "after_fault": [2, 3, 4, 5, 8],
        },
    )  # fmt: skip


def test_waiting_goes_on_into_the_next_batch() -> None:
    rest = table(["silent", "lost", "fix", "silent"])
    check(receiver_answers(rest, after_fault=True), {"waiting": [0], "after_fault": [0, 1]})
    check(receiver_answers(rest), {"waiting": [], "after_fault": []})
    check(receiver_answers(rest.iloc[:0]), {"fix": [], "waiting": [], "after_fault": []})


@pytest.mark.parametrize(
    ("interval_ns", "bounds"), [(10**9, (500_000_000, 1_500_000_000)), (3, (2, 4))]
)
def test_one_step_is_half_to_one_and_a_half_of_an_interval(
    interval_ns: int, bounds: tuple[int, int]
) -> None:
    assert one_step_ns(interval_ns) == bounds
