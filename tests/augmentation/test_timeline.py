"""The whole of one satellite's corrections, held against gLAB 6.0.0 satellite by satellite."""

from __future__ import annotations

import gzip
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation import correction_timeline, read_messages
from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.tables import UDRE_VARIANCE_M2, Mode
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.exceptions import InputError
from tests.augmentation import encoding as enc

CASES: dict[str, tuple[str, int, Mode]] = {
    "msas_kamakura_PA_breakdown30s": ("msas_kamakura_2025046/msas137_2025046.ems", 137, "pa"),
    "msas_kamakura_NPA_breakdown30s": ("msas_kamakura_2025046/msas137_2025046.ems", 137, "npa"),
    "waas_stanford_PA_breakdown30s": ("waas_2020001/waas131_2020001.ems", 131, "pa"),
    "vehicle_cres_129_PA_breakdown": ("msas_vehicle_2008147/msas_129.ems", 129, "pa"),
    "vehicle_cres_129_NPA_breakdown": ("msas_vehicle_2008147/msas_129.ems", 129, "npa"),
}
NO_CORRECTIONS_M = 60.0
FAST_CODES = range(7, 25)
WITHOUT_TYPE_10 = (10, 11)


@cache
def replayed(folder: Path, name: str, prn: int) -> CorrectionTimeline:
    return correction_timeline(read_messages(folder / "data" / name, prn=prn))


@cache
def rows_of(folder: Path, case: str) -> dict[str, list[list[str]]]:
    """Fields of gLAB's rows by their name; discarded iterations have a star after it."""
    rows: dict[str, list[list[str]]] = {"SBASVAR": [], "SBASCORR": [], "SBASUNSEL": []}
    with gzip.open(folder / "reference/glab" / f"glab_{case}.out.gz", "rt") as lines:
        for line in lines:
            fields = line.split()
            if fields and fields[0] in rows and fields[5] == "GPS":
                rows[fields[0]].append(fields)
    return rows


def times_ns(rows: list[list[str]]) -> np.ndarray:
    year = np.array([int(row[1]) - 1970 for row in rows]).astype("M8[Y]").astype("M8[D]")
    day = year + np.array([int(row[2]) - 1 for row in rows])
    since = (day - np.datetime64("1980-01-06")).astype(np.int64) * 86400
    of_day = np.array([round(float(row[3]) * 1e9) for row in rows], np.int64)
    return np.asarray(since * 10**9 + of_day)


@pytest.mark.parametrize("case", CASES)
def test_fast_corrections_and_their_terms(reference_data: Path, case: str) -> None:
    """PRC, RRC, sigma_UDRE, eps_fc and eps_rrc of every satellite, to the printed digit."""
    name, prn, mode = CASES[case]
    line = replayed(reference_data, name, prn)
    table = rows_of(reference_data, case)
    checked = 0
    pairs = list(zip(table["SBASVAR"], table["SBASCORR"], strict=True))
    pairs = [(var, corr) for var, corr in pairs if float(var[16]) != NO_CORRECTIONS_M]
    for satellite in sorted({int(var[6]) for var, _ in pairs}):
        own = [(var, corr) for var, corr in pairs if int(var[6]) == satellite]
        instants = line.reception.instants(times_ns([var for var, _ in own]))
        found = line.fast_corrections(satellite, instants, mode=mode, profile="glab")
        assert found.usable.all(), satellite
        have = np.column_stack(
            [np.sqrt(UDRE_VARIANCE_M2[found.udrei]), found.eps_fc_m, found.eps_rrc_m, found.prc_m,
             found.rrc_m]
        )  # fmt: skip
        want = [[*map(float, (v[17], v[20], v[21])), float(c[26]), float(c[27])] for v, c in own]
        np.testing.assert_allclose(have, want, atol=1.01e-4)
        checked += len(own)
    assert checked > 150


@pytest.mark.parametrize("case", [case for case, (*_, mode) in CASES.items() if mode == "pa"])
def test_satellites_that_glab_does_not_use(reference_data: Path, case: str) -> None:
    """By the code of the first reason."""
    name, prn, mode = CASES[case]
    line = replayed(reference_data, name, prn)
    rows = rows_of(reference_data, case)["SBASUNSEL"]
    rows = [row for row in rows if int(row[9]) not in WITHOUT_TYPE_10]
    assert rows
    for satellite in sorted({int(row[6]) for row in rows}):
        own = [row for row in rows if int(row[6]) == satellite]
        instants = line.reception.instants(times_ns(own))
        found = line.fast_corrections(satellite, instants, mode=mode, profile="glab")
        codes = np.array([int(row[9]) for row in own])
        fast = np.isin(codes, FAST_CODES)
        np.testing.assert_array_equal(found.reason, np.where(fast, codes, 0), str(satellite))


def test_messages_of_several_satellites_are_refused() -> None:
    one = enc.heard((0, enc.null()), (1, enc.null()))
    both = replace(one, prn=np.array([131, 137]))
    with pytest.raises(InputError, match="one SBAS satellite"):
        correction_timeline(both)
    with pytest.raises(InputError, match="one SBAS satellite"):
        correction_timeline(one.of_prn(150))


def test_content_that_is_not_allowed_is_counted() -> None:
    line = correction_timeline(enc.heard((0, enc.mask(0, range(1, 53))), (1, enc.null())))
    assert line.void == {1: 1}


def test_satellites_without_any_message_of_a_kind() -> None:
    """Nothing but null messages: every look-up answers, with a reason."""
    line = correction_timeline(enc.hourly({}, 20))
    instants = line.reception.instants(enc.epochs_ns(-5, 3, 10, 40))
    for mode in ("pa", "npa"):
        found = line.fast_corrections(5, instants, mode=mode, profile="mops")
        assert found.reason.tolist() == [60, 7, 7, 60]
        assert found.barred.all()
        assert line.long_term(5, instants, mode=mode).row.tolist() == [-1] * 4
        degradation = line.degradation(instants, mode=mode)
        assert isinstance(degradation, DegradationAt)
        assert degradation.missing.all()


@pytest.mark.parametrize(
    "messages", [{0: enc.mask(0, (5,))}, {0: enc.fast(2, 0, 0, [0] * 13, [5] * 13)}]
)
def test_a_mask_alone_and_corrections_alone(messages: dict[int, bytes]) -> None:
    line = correction_timeline(enc.hourly(messages, 20))
    instants = line.reception.instants(enc.epochs_ns(3))
    reason = line.fast_corrections(5, instants, mode="pa", profile="mops").reason[0]
    assert reason == (12 if line.masks.time_s.size else 7)
