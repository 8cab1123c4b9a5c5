"""The first guess of a place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation import correction_timeline
from sbas.positioning.corrected_ranges import CorrectedRanges, corrected_ranges
from sbas.positioning.measurements import Measurements, measurements
from sbas.positioning.rough_places import rough_places
from sbas.positioning.satellite_corrections import DataRules
from tests.positioning.reference_cases import KAMAKURA_M, between, inputs


def rough_case(folder: Path) -> tuple[Measurements, CorrectedRanges]:
    observed, navigation, messages = inputs(folder, "kamakura")
    ranges = measurements(between(observed, 4000, 4010), smoothing=False)
    timeline = correction_timeline(messages)
    instants = timeline.reception.instants(ranges.time_ns)
    degradation = timeline.degradation(instants, mode="pa").some(ranges.epoch)
    return ranges, corrected_ranges(
        ranges, timeline, navigation.gps, instants.some(ranges.epoch), degradation,
        DataRules("pa", "mops", False),
    )  # fmt: skip


@pytest.mark.parametrize("start", [None, KAMAKURA_M, (6.4e6, 0.0, 0.0)])
def test_found_from_anywhere(reference_data: Path, start: tuple[float, ...] | None) -> None:
    ranges, data = rough_case(reference_data)
    places = rough_places(ranges, data, None if start is None else np.array(start))
    assert np.linalg.norm(places - KAMAKURA_M, axis=1).max() < 20.0


def test_epochs_without_a_solution_take_their_neighbours(reference_data: Path) -> None:
    ranges, data = rough_case(reference_data)
    places = rough_places(ranges, data, None)
    assert (places[:2] == places[2]).all()
    keep = np.flatnonzero(ranges.epoch != 5)
    fewer = rough_places(ranges.some(keep), data.some(keep), None)
    assert (fewer[5] == fewer[4]).all()
    assert fewer[6] == pytest.approx(places[6], abs=1e-6)


def test_nothing_to_go_on(reference_data: Path) -> None:
    ranges, data = rough_case(reference_data)
    barred = replace(ranges, reason=np.ones(len(ranges), np.int64))
    assert np.isnan(rough_places(barred, data, np.array(KAMAKURA_M))).all()
    nothing = np.arange(0)
    assert np.isnan(rough_places(ranges.some(nothing), data.some(nothing), None)).all()
