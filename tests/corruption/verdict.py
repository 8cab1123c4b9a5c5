"""Whether what was said of a damaged file is right, held against the undamaged one."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
import pandas as pd

from sbas import evaluate
from sbas.exceptions import InputError
from sbas.findings import Severity
from sbas.input_check import check
from sbas.logs import registry
from sbas.truth import Truth
from tests.corruption.corpus import Case
from tests.corruption.good_logs import GoodLog
from tests.input_check.journeys import TODAY

FIGURES = ("lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m")
"""What every figure is made of, beside the time."""

Outcome = Literal["right", "other finding", "altered beside a finding", "not found",
                  "wrong figure", "crash"]  # fmt: skip
"""From the best to the worst. "other finding": another code, or a lesser severity, than expected.
"altered beside a finding": the right code, but epochs that are left have other figures, which it
does not say. "not found": no new finding, and the figures are those of the good file. "wrong
figure": no new warning or error, and figures are wrong or epochs lacking. "crash": anything but
an InputError with a cure, or `read` and `scan` say different things."""

Said = tuple[str, Severity]
_RANK: dict[Severity, int] = {"info": 0, "warning": 1, "error": 2}


@dataclass(frozen=True)
class Verdict:
    """What became of a damaged file; `said` are its new codes with their severities."""

    outcome: Outcome
    said: tuple[Said, ...] = ()
    detail: str = ""


@dataclass(frozen=True)
class Reading:
    """What a file gave: epochs and findings, or a refusal, whose code may be ""."""

    said: tuple[Said, ...]
    table: pd.DataFrame | None = None
    refusal: str = ""


def reading(given: Any, *, truth: Truth | None, options: Mapping[str, Any]) -> Reading:
    """Epochs and findings of files as an analysis gets them: scanned, then checked.

    Raises
    ------
    AssertionError : a refusal without a cure, or `read` does not say what `scan` does.
    """
    try:
        source = registry.scan(given, **options)
        findings = check(source, truth=truth, today=TODAY).findings
        table = pd.concat(source.batches(FIGURES))
    except InputError as refusal:
        if not refusal.cure:
            raise AssertionError(f"no cure: {refusal}") from refusal
        return Reading(((refusal.code, "error"),), refusal=str(refusal))
    whole = registry.read(given, columns=FIGURES, **options).table
    pd.testing.assert_frame_equal(whole, table, check_freq=False)
    return Reading(tuple((f.code, f.severity) for f in findings), table)


@functools.cache
def _reading_of_good(log: GoodLog) -> Reading:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"roof{log.form.extension}"
        path.write_bytes(log.pieces.data)
        found = reading(path, truth=log.truth, options=log.form.options)
    assert found.table is not None, f"{log.name}: {found.refusal}"
    return found


def judged(case: Case) -> Verdict:
    """What the package says of a damaged file, and whether that is right."""
    made = case.made()
    good = made.good or case.log
    before = _reading_of_good(good)
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name, _ in made.files]
        for path, (_, data) in zip(paths, made.files, strict=True):
            path.write_bytes(data)
        given = paths if len(paths) > 1 else paths[0]
        try:
            if case.kind.analysed:
                source = registry.scan(given, **case.log.form.options)
                said = tuple((f.code, f.severity) for f in evaluate(source).findings)
                found = Reading(said, before.table)
            else:
                found = reading(given, truth=good.truth, options=case.log.form.options)
        except Exception as error:  # that is what a crash is
            return Verdict("crash", detail=f"{type(error).__name__}: {str(error)[:300]}")
    return _verdict(case, before, found)


def _verdict(case: Case, before: Reading, found: Reading) -> Verdict:
    made = case.made()
    # A packed file is held against its plain form, so that what is said of a packing is new.
    new = sorted((Counter(found.said) - Counter(before.said)).keys())
    change = "" if found.table is None else difference(before.table, found.table)
    altered = change.startswith("altered")
    right = any(c in made.codes and _RANK[s] >= _RANK[made.least] for c, s in new)
    told = any(s != "info" for _, s in new)
    refused = any(s == "error" for _, s in new)
    outcome: Outcome
    if change and not told:
        outcome = "wrong figure"
    elif right and made.keeps and altered and not refused:
        outcome = "altered beside a finding"
    elif right:
        outcome = "right"
    else:
        outcome = "other finding" if new else "not found"
    return Verdict(outcome, tuple(new), change or found.refusal)


def difference(good: pd.DataFrame | None, bad: pd.DataFrame) -> str:
    """How the epochs of a file differ from those of the good one; "" where they do not.

    "altered" begins the text where an epoch has a value that the good file does not have at that
    time, or a time that the good file does not have; epochs and values that are missing are told
    otherwise.
    """
    assert good is not None
    place = good.index.get_indexer(bad.index)
    strange = int(np.sum(place < 0))
    here, there = bad[place >= 0], good.iloc[place[place >= 0]]
    notes, missing = [], 0
    for name in FIGURES:
        a, b = here[name].to_numpy(float), there[name].to_numpy(float)
        missing += int(np.sum(np.isnan(a) & ~np.isnan(b)))
        if wrong := int(np.sum((a != b) & ~np.isnan(a))):
            notes.append(f"{wrong} {name}")
    if strange:
        notes.append(f"{strange} times")
    lacking = len(good) - len(np.unique(place[place >= 0]))
    again = len(bad) - strange - (len(good) - lacking)
    text = f"altered: {', '.join(notes)}" if notes else ""
    others = {"epochs lacking": lacking, "epochs twice": again, "values missing": missing}
    return "; ".join([*([text] if text else []), *(f"{n} {what}" for what, n in others.items()
                                                   if n)])  # fmt: skip
