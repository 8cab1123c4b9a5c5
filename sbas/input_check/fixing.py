"""Check, repair what is beyond doubt, and check again."""

from __future__ import annotations

import numpy as np

from sbas.input_check.checking import CheckResult, check
from sbas.input_check.repairs import Repairs, repair
from sbas.recording import Recording
from sbas.truth import Truth

ROUNDS = 5
"""One repair may lay another sign open, as degrees show that latitude and longitude are swapped;
no more than these stand behind one another."""


def fix(
    recording: Recording, *, truth: Truth | None = None, today: np.datetime64 | None = None
) -> tuple[Recording, CheckResult]:
    """The recording with every repair that the check proposes, and what is then still found.

    Parameters
    ----------
    recording : left as it is.
    truth, today : as for `check`.

    Returns
    -------
    The repaired recording, whose metadata list the repairs, and its own check.
    """
    result = check(recording, truth=truth, today=today)
    for _ in range(ROUNDS):
        if result.repairs == Repairs():
            break
        recording = repair(recording, result.repairs)
        result = check(recording, truth=truth, today=today)
    return recording, result
