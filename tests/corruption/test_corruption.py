"""A sample of the corruption corpus, one file of each kind; benchmarks/corruption.py runs all."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd
import pytest

from sbas.logs import registry
from tests.corruption.corpus import KINDS, Case, cases, sample
from tests.corruption.good_logs import FORMS, good_log
from tests.corruption.verdict import difference, judged

WITHOUT_GENERATOR = {"novatel_oem"}
"""Formats whose reader needs an extra; their damage is tested beside the reader."""

UNSEEN = {"leap seconds corrected at a stop"}
"""Kinds that get a warning, but not the one that names the cause (docs/validation.md)."""


def test_the_corpus_is_large_enough_and_covers_every_format() -> None:
    all_cases = list(cases())
    assert len(KINDS) == len({kind.name for kind in KINDS}) >= 20
    assert len(all_cases) == len({case.name for case in all_cases}) >= 500
    assert {form.format for form in FORMS} == {f.name for f in registry.FORMATS} - WITHOUT_GENERATOR
    assert min(Counter(case.form for case in all_cases).values()) >= 50


@pytest.mark.parametrize("case", sample(), ids=lambda case: case.name.replace(" ", "-"))
def test_each_kind_of_damage_gets_the_right_finding(case: Case) -> None:
    verdict = judged(case)
    expected = {"other finding"} if case.kind.name in UNSEEN else {"right"}
    assert verdict.outcome in expected, verdict


def test_a_case_is_the_same_file_each_time() -> None:
    for case in sample()[::9]:
        assert case.made().files == case.made().files


def test_every_damaged_file_differs_from_the_good_one() -> None:
    for case in sample():
        made = case.made()
        same_bytes = all(data == case.log.pieces.data for _, data in made.files)
        same_name = len(made.files) == 1 and made.files[0][0] == f"roof{case.log.form.extension}"
        assert case.kind.analysed or not (same_bytes and same_name), case.name


def test_a_difference_is_told_by_its_kind() -> None:
    index = pd.DatetimeIndex(np.arange(4).astype("M8[s]").astype("M8[ns]"))
    columns = {name: np.arange(4.0) for name in ("lat_deg", "lon_deg", "height_m", "hpl_m",
                                                 "vpl_m")}  # fmt: skip
    good = pd.DataFrame(columns, index=index)
    assert difference(good, good) == ""
    assert difference(good, good.assign(hpl_m=[0, 1, 2, 4])) == "altered: 1 hpl_m"
    assert difference(good, good.assign(hpl_m=[0, 1, 2, np.nan])) == "1 values missing"
    assert difference(good, good.iloc[:3]) == "1 epochs lacking"
    assert difference(good, good.iloc[[0, 0, 1, 2, 3]]) == "1 epochs twice"
    moved = good.set_axis(index + np.timedelta64(1, "s"))
    assert difference(good, moved).startswith("altered: 3 lat_deg")
    assert "1 times" in difference(good, moved)


def test_the_good_logs_are_read_as_written() -> None:
    for form in FORMS:
        log = good_log(form.name, True)
        assert len(log.pieces.data) > 30_000
        assert log.rewritten(log.recording) == log.pieces.data or form.family == "table"
