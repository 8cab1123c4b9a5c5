"""Several files of one receiver."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sbas.rinex.observation_file import read_observations
from tests.rinex.rinex_samples import CODES, epoch_3, header_3, ranges
from tests.rinex.test_observation_file import assert_epochs, codes_of


def files(folder: Path, *bodies: str) -> list[Path]:
    paths = [folder / f"{i}.rnx" for i in range(len(bodies))]
    for path, body in zip(paths, bodies, strict=True):
        path.write_text(body if "RINEX" in body else header_3(CODES) + body)
    return paths


def epochs(*numbers: int) -> str:
    return "".join(epoch_3(ranges(k)) for k in numbers)


@pytest.mark.parametrize("reverse", [False, True])
def test_files_in_any_order_overlapping(tmp_path: Path, reverse: bool) -> None:
    paths = files(tmp_path, epochs(0, 1, 2), epochs(2, 3), epochs(5, 6))
    found = read_observations(paths[::-1] if reverse else paths)
    assert_epochs(found, [0, 1, 2, 3, 5, 6])
    assert codes_of(found) == ["E05 warning"]
    assert "0 of them with other observations" in found.findings[0].message


def test_an_overlap_that_differs_is_an_error(tmp_path: Path) -> None:
    other = epoch_3((ranges(1)[0], ranges(3)[1]))
    found = read_observations(files(tmp_path, epochs(0, 1, 2), other))
    assert_epochs(found, [0, 1, 2])
    assert codes_of(found) == ["E05 error"]


def test_systems_codes_and_satellites_of_either_file(tmp_path: Path) -> None:
    one = header_3({"G": ("C1C", "L1C")}) + epoch_3(ranges(0, ("G05",), 2))
    two = header_3({"G": ("S1C", "C1C"), "S": ("C1C", "L1C")}) + epoch_3(
        ranges(1, ("G07", "S36"), 2)
    )
    found = read_observations(files(tmp_path, one, two))
    gps, geo = found.systems["G"], found.systems["S"]
    assert gps.time is geo.time
    assert gps.time.size == 2
    assert gps.satellites == ("G05", "G07")
    first, second = ranges(0, ("G05",), 2)[1]["G05"], ranges(1, ("G07",), 2)[1]["G07"]
    nan = np.nan
    np.testing.assert_array_equal(gps.values["C1C"], [[first[0][0], nan], [nan, second[1][0]]])
    np.testing.assert_array_equal(gps.values["L1C"], [[first[1][0], nan], [nan, nan]])
    np.testing.assert_array_equal(gps.values["S1C"], [[nan, nan], [nan, second[0][0]]])
    np.testing.assert_array_equal(gps.loss_of_lock["L1C"], [[1, -1], [-1, -1]])
    assert np.isnan(geo.values["C1C"][0, 0])
    assert np.isfinite(geo.values["C1C"][1, 0])
    assert not found.findings


def test_several_markers_are_told(tmp_path: Path) -> None:
    two = header_3(CODES).replace("SITE ", "OTHER", 1) + epochs(4)
    found = read_observations(files(tmp_path, epochs(0), two))
    assert codes_of(found) == ["E06 error"]
