"""The SBAS satellite as a ranging source: closed forms, and a range constructed by hand on real
WAAS messages whose own UDREI is lowered (the broadcast one bars it)."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation import SbasMessages, correction_timeline
from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.message_types import GeoNavigation
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import NEVER, Instants
from sbas.augmentation.tables import UDRE_VARIANCE_M2, Mode
from sbas.positioning.geo_orbits import geo_navigation_at, geo_state
from sbas.positioning.measurements import Measurements, joined, measurements
from sbas.positioning.protection_levels import horizontal_level_m, vertical_level_m
from sbas.positioning.software_receiver import Fixes
from tests.positioning.reference_cases import STANFORD_M, between, inputs, rules, solved

LIGHT, TURN = 299792458.0, 7.2921151467e-5
FIRST, LAST = 2400, 2430
NAME, PRN, PLACE = "S31", 131, 32
"""Place of PRN 131 in the mask: the 32nd satellite, field 6 of type 4."""
LENDER = 1
"""Place in the mask of a satellite that is not in view."""


def instants(seconds: list[float], since: int = int(NEVER)) -> Instants:
    ns = (np.array(seconds) * 1e9).round().astype(np.int64)
    return Instants(ns, (ns - 120_000_000) // 10**9, np.full(ns.size, since), 120_000_000)


def navigation(**changes: object) -> GeoNavigation:
    plain: dict[str, object] = {
        "time_s": np.array([1000, 1100]), "t0_s": np.array([960, 1104]), "ura": np.array([2, 2]),
        "position_m": np.array([[4.2e7, 1e5, -3e4], [4.2e7, 1.1e5, -3e4]]),
        "velocity_mps": np.array([[1.0, -2.0, 0.5], [0.0, 0.0, 0.0]]),
        "acceleration_mps2": np.array([[1e-4, 2e-4, -3e-4], [0.0, 0.0, 0.0]]),
        "clock_s": np.array([1e-7, 2e-7]), "drift": np.array([1e-11, 0.0]),
    }  # fmt: skip
    return GeoNavigation(**{**plain, **changes})  # type: ignore[arg-type]


def none_void(n: int) -> np.ndarray:
    return np.full(n, NEVER)


def test_orbit_and_clock_are_polynomials() -> None:
    at = np.array([1000.0])
    state = geo_state(navigation(), np.array([0]), at, degradation(1))
    d = 40.0
    for axis in range(3):
        m = navigation()
        exact = (
            m.position_m[0, axis] + m.velocity_mps[0, axis] * d
            + m.acceleration_mps2[0, axis] * d * d / 2
        )  # fmt: skip
        assert state.position_m[0, axis] == pytest.approx(exact, abs=1e-8)
    assert state.clock_s[0] == pytest.approx(1e-7 + 40e-11, rel=1e-12)


def degradation(n: int, **values: float) -> DegradationAt:
    """Parameters of type 10 at n epochs: 0 but those given."""
    no = np.zeros(n, bool)
    numbers = [np.full(n, values.get(field.name, 0.0)) for field in fields(DegradationAt)[2:]]
    return DegradationAt(no, no, *numbers)


def test_degradation_only_outside_the_interval() -> None:
    """DO-229D, A.4.5.1.4: 0 within (t0, t0 + I_geo), else the step and the rate."""
    d = degradation(5, c_geo_lsb_m=0.5, c_geo_v_mps=0.04, i_geo_s=100.0)
    since = np.array([-10.0, 0.0, 50.0, 100.0, 130.0])
    state = geo_state(navigation(), np.zeros(5, np.int64), 960.0 + since, d)
    assert state.eps_geo_m == pytest.approx([0.5 + 0.4, 0.5, 0.0, 0.5, 0.5 + 1.2])


def test_the_time_of_applicability_wraps_at_midnight() -> None:
    messages = navigation(t0_s=np.array([86384, 86384]))
    state = geo_state(messages, np.array([0]), np.array([86400.0 * 5 + 24.0]), degradation(1))
    assert state.clock_s[0] == pytest.approx(1e-7 + 40e-11, rel=1e-9)


@pytest.mark.parametrize(("mode", "timeout"), [("pa", 240), ("npa", 360)])
def test_messages_expire(mode: Mode, timeout: int) -> None:
    seconds = [1000.1, 1000.2, 1101.0, 1100.0 + timeout, 1101.0 + timeout]
    got = geo_navigation_at(navigation(), instants(seconds), none_void(5), mode=mode)
    assert got.row.tolist() == [-1, 0, 1, 1, 1]
    assert got.expired.tolist() == [False, False, False, False, True]


def test_what_bars_the_satellite() -> None:
    barred = geo_navigation_at(
        navigation(ura=np.array([15, 14])), instants([1050.0, 1150.0]), none_void(2), mode="pa"
    )
    assert barred.barred.tolist() == [True, False]
    damaged = geo_navigation_at(
        navigation(), instants([1050.0, 1150.0]), np.array([1000, 1000]), mode="npa"
    )
    assert damaged.row.tolist() == [-1, 1]
    after_alarm = geo_navigation_at(
        navigation(), instants([1050.0], since=1000), none_void(1), mode="npa"
    )
    assert after_alarm.row.tolist() == [-1]
    empty = GeoNavigation(*(values[:0] for values in vars(navigation()).values()))
    assert geo_navigation_at(empty, instants([1050.0]), none_void(1), mode="pa").row.tolist() == [
        -1
    ]


def with_own_udrei(messages: SbasMessages, udrei: int) -> SbasMessages:
    """WAAS with another UDREI for its own satellite, in types 4 and 6, and with the covariance of
    type 28 that it sends of a satellite not in view: of itself it sends none."""
    bits = np.unpackbits(messages.frame, axis=1)
    value = [int(bit) for bit in format(udrei, "04b")]
    field = (PLACE - 1) % 13
    bits[messages.kind == 4, 174 + 4 * field : 178 + 4 * field] = value
    bits[messages.kind == 6, 22 + 4 * (PLACE - 1) : 26 + 4 * (PLACE - 1)] = value
    covariance = messages.kind == 28
    for start in (16, 121):
        position = bits[:, start : start + 6] @ (1 << np.arange(5, -1, -1))
        mine = covariance & (position == LENDER)
        bits[mine, start : start + 6] = [int(bit) for bit in format(PLACE, "06b")]
    return replace(messages, frame=np.packbits(bits, axis=1))


def plain_range_m(navigation_of: GeoNavigation, received_s: float) -> float:
    """Pseudorange of the satellite at Stanford: geometry and clock alone, in plain steps."""
    row = int(np.flatnonzero(navigation_of.time_s + 0.12 <= received_s)[-1])
    flight = 0.12
    for _ in range(6):
        since = (received_s - flight) % 86400 - navigation_of.t0_s[row]
        since = since - 86400 if since > 43200 else since + 86400 if since < -43200 else since
        x, y, z = (
            navigation_of.position_m[row, i]
            + navigation_of.velocity_mps[row, i] * since
            + navigation_of.acceleration_mps2[row, i] * since**2 / 2
            for i in range(3)
        )
        a = TURN * flight
        turned = (x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a), z)
        distance = sum((p - q) ** 2 for p, q in zip(turned, STANFORD_M, strict=True)) ** 0.5
        flight = distance / LIGHT
    clock = navigation_of.clock_s[row] + navigation_of.drift[row] * since
    return float(distance - LIGHT * clock)


def with_geo(
    folder: Path, udrei: int, mode: Mode = "pa", error_m: float = 0.0
) -> tuple[Measurements, Fixes]:
    observed, nav, messages = inputs(folder, "stanford")
    part = between(observed, FIRST, LAST)
    changed = with_own_udrei(messages, udrei)
    own = correction_timeline(changed).decoded.geo_navigation
    seconds = part.time.astype("M8[ns]").astype(np.int64) / 1e9 - 315964800
    code = np.array([[plain_range_m(own, second) + error_m] for second in seconds])
    geo = measurements(replace(part, satellites=(NAME,), values={"C1C": code}), smoothing=False)
    ranges = joined(measurements(part, smoothing=False), geo)
    return ranges, solved(ranges, changed, nav, rules(mode, nav), STANFORD_M)


def test_a_constructed_range_fits_its_model(reference_data: Path) -> None:
    _, fixes = with_geo(reference_data, 5)
    m, b, c = fixes.measured, fixes.budget, fixes.corrected
    rows = (m.satellite == m.names.index(NAME)) & (m.epoch >= 2)
    assert fixes.used[rows].all()
    left = b.prefit_m + b.iono_m + b.tropo_m - c.prc_m - c.rrc_m
    assert np.abs(left[rows]).max() < 1e-4
    assert c.relativity_m[rows].tolist() == c.tgd_m[rows].tolist() == [0.0] * rows.sum()
    elevation = b.elevation_deg[rows]
    multipath = 0.13 + 0.53 * np.exp(-elevation / 10)
    # gLAB's path through the atmosphere is that before the Earth's rotation: a hundredth degree.
    assert b.sigma_air_m[rows] == pytest.approx(np.hypot(1.8, multipath), rel=1e-4)
    assert c.sigma_udre_m[rows] == pytest.approx(np.sqrt(UDRE_VARIANCE_M2[5]))
    assert (c.eps_ltc_m[rows] >= 0).all()


def test_one_more_range_makes_levels_smaller(reference_data: Path) -> None:
    _, used = with_geo(reference_data, 5)
    _, barred = with_geo(reference_data, 15)
    assert not barred.used[barred.measured.satellite == barred.measured.names.index(NAME)].any()
    for level in (horizontal_level_m, vertical_level_m):
        small, large = (level(fixes.covariance_m2[2:], 6.0) for fixes in (used, barred))
        assert (small < large).all()


@pytest.mark.parametrize(
    ("udrei", "mode", "reason"),
    [
        (15, "pa", Reason.DO_NOT_USE), (14, "npa", Reason.NOT_MONITORED),
        (12, "pa", Reason.UDREI_TOO_LARGE), (12, "npa", Reason.USED),
    ],
)  # fmt: skip
def test_its_own_udrei_decides(
    reference_data: Path, udrei: int, mode: Mode, reason: Reason
) -> None:
    ranges, fixes = with_geo(reference_data, udrei, mode)
    rows = (ranges.satellite == ranges.names.index(NAME)) & (ranges.epoch >= 2)
    assert set(fixes.reason[rows]) == {reason}
