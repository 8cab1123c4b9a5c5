"""Which data hold for a range: issues, causality and what the two modes ask for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation import correction_timeline
from sbas.augmentation.reasons import Reason
from sbas.augmentation.tables import Mode
from sbas.positioning.corrected_ranges import CorrectedRanges, corrected_ranges
from sbas.positioning.measurements import measurements
from sbas.positioning.satellite_corrections import DataRules, udre_factors
from sbas.rinex.ephemerides import KeplerEphemerides, Navigation
from tests.positioning.reference_cases import between, inputs


def corrected(
    folder: Path,
    navigation: Navigation,
    mode: Mode = "pa",
    *,
    causal: bool = False,
    first: int = 4000,
) -> tuple[CorrectedRanges, np.ndarray]:
    """Corrections of ten epochs of Kamakura, and the slot number of each range."""
    observed, _, messages = inputs(folder, "kamakura")
    ranges = measurements(between(observed, first, first + 10), smoothing=False)
    timeline = correction_timeline(messages)
    instants = timeline.reception.instants(ranges.time_ns)
    degradation = timeline.degradation(instants, mode=mode).some(ranges.epoch)
    got = corrected_ranges(
        ranges, timeline, navigation.gps, instants.some(ranges.epoch), degradation,
        DataRules(mode, "glab", causal),
    )  # fmt: skip
    return got, ranges.slot[ranges.satellite]


def changed(navigation: Navigation, **values: np.ndarray) -> Navigation:
    return replace(navigation, gps=replace(navigation.gps, **values))


def test_a_correction_needs_the_record_of_its_issue(reference_data: Path) -> None:
    _, navigation, _ = inputs(reference_data, "kamakura")
    usual, slot = corrected(reference_data, navigation)
    prn = int(slot[usual.reason == 0][0])
    gps = navigation.gps
    other = changed(navigation, iode=np.where(gps.prn == prn, (gps.iode + 1) % 256, gps.iode))
    for mode in ("pa", "npa"):
        got, _ = corrected(reference_data, other, mode)  # type: ignore[arg-type]
        mine = slot == prn
        assert set(got.reason[mine]) == {Reason.NO_MATCHING_EPHEMERIS}
        assert not got.full[mine].any()
        assert not got.barred[mine].any()
        # Without its issue no long-term correction is added to the newest record.
        assert (got.clock_correction_m[mine] == 0).all()
        assert (got.iode[mine] == -1).all()
        assert np.isfinite(got.satellite_m[mine]).all()
        assert (
            got.reason[~mine] == corrected(reference_data, navigation, mode)[0].reason[~mine]
        ).all()  # type: ignore[arg-type]


def test_records_from_the_future_only_where_allowed(reference_data: Path) -> None:
    _, navigation, _ = inputs(reference_data, "kamakura")
    usual, _ = corrected(reference_data, navigation, causal=True)
    assert (usual.reason == 0).any()
    late = changed(navigation, transmission_s=navigation.gps.transmission_s + 86400.0)
    got, _ = corrected(reference_data, late, causal=True)
    assert set(got.reason) == {Reason.NO_EPHEMERIS}
    assert got.barred.all()
    assert np.isnan(got.satellite_m).all()
    allowed, _ = corrected(reference_data, late, causal=False)
    assert (allowed.reason == 0).any()


def test_precision_approach_needs_more(reference_data: Path) -> None:
    _, navigation, _ = inputs(reference_data, "kamakura")
    for first in (0, 40, 4000):
        pa, _ = corrected(reference_data, navigation, "pa", first=first)
        npa, _ = corrected(reference_data, navigation, "npa", first=first)
        assert not ((pa.reason == 0) & ~npa.full).any()
        assert not (pa.full & npa.barred).any()


def test_degradation_terms_are_missing_before_type_10(reference_data: Path) -> None:
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 4000, 4005), smoothing=False)
    silent = replace(
        messages, **{
            name: getattr(messages, name)[messages.kind != 10]
            for name in ("time_s", "prn", "kind", "frame", "crc_checked")
        },
    )  # fmt: skip
    timeline = correction_timeline(silent)
    instants = timeline.reception.instants(ranges.time_ns)
    degradation = timeline.degradation(instants, mode="pa").some(ranges.epoch)
    got = corrected_ranges(
        ranges, timeline, navigation.gps, instants.some(ranges.epoch), degradation,
        DataRules("pa", "glab", False),
    )  # fmt: skip
    late = got.reason >= Reason.NO_FAST_CORRECTION
    assert not late.any()
    assert (got.reason == Reason.NO_DEGRADATION).any()
    assert (got.eps_rrc_m == 0).all()


@pytest.mark.parametrize("profile", ["mops", "glab"])
def test_a_factor_is_waited_for_unless_glab_is_followed(reference_data: Path, profile: str) -> None:
    _, _, messages = inputs(reference_data, "kamakura")
    timeline = correction_timeline(messages)
    first = int(timeline.decoded.covariances.time_s[0])
    instants = timeline.reception.instants((first + np.array([-5, 0, 1, 50])) * 10**9)
    sent = udre_factors(timeline, instants, profile)  # type: ignore[arg-type]
    expected = [True] * 4 if profile == "mops" else [False, False, True, True]
    assert sent.by_covariance.tolist() == expected
    assert not sent.by_region.any()


def test_an_old_record_is_none(reference_data: Path) -> None:
    _, navigation, _ = inputs(reference_data, "kamakura")
    old = changed(
        navigation,
        toe_s=navigation.gps.toe_s - 14_500.0,
        toc_s=navigation.gps.toc_s - 14_500.0,
    )
    assert isinstance(old.gps, KeplerEphemerides)
    got, _ = corrected(reference_data, old, first=10_000)
    late, _ = corrected(reference_data, navigation, first=10_000)
    assert (got.reason == Reason.NO_EPHEMERIS).sum() > (late.reason == Reason.NO_EPHEMERIS).sum()
