"""What a damaged file is, what must be found in it, and what a kind of damage is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sbas.findings import Severity
from sbas.truth import Truth
from tests.corruption.good_logs import GoodLog


@dataclass(frozen=True)
class Damaged:
    """Damaged files, read together, and what must be said of them.

    Parameters
    ----------
    files : name and bytes of each.
    codes : codes of which one must be found.
    least : severity that it must have; a refusal counts as an error.
    keeps : whether the epochs that are left must have the undamaged figures in any case; else
        they may differ once a new finding says so.
    truth : of the check, where it is not that of the good log.
    good : the log to compare with, where it is not the one that was damaged.
    """

    files: tuple[tuple[str, bytes], ...]
    codes: frozenset[str]
    least: Severity = "warning"
    keeps: bool = True
    truth: Truth | None = None
    good: GoodLog | None = None


Make = Callable[[GoodLog, np.random.Generator], Damaged]


@dataclass(frozen=True)
class Kind:
    """One kind of damage.

    Parameters
    ----------
    name : in words.
    make : damages a good log; all randomness comes from the generator.
    suits : whether a log can be damaged so.
    times : files per log.
    analysed : whether the finding is one of the analysis, not of reading and checking.
    """

    name: str
    make: Make
    suits: Callable[[GoodLog], bool] = lambda log: True
    times: int = 1
    analysed: bool = False


def file_of(log: GoodLog, data: bytes, *codes: str, name: str = "", **more: Any) -> Damaged:
    """One damaged file, under the name a good one would have."""
    return Damaged(((name or f"roof{log.form.extension}", data),), frozenset(codes), **more)
