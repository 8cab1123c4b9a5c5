"""RINEX and SBAS messages to a Recording with positions and protection levels: `protect`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.fast_corrections import Profile
from sbas.augmentation.message_files import Stamp, read_messages
from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.range_error import FALLBACK_SIGMA_M
from sbas.augmentation.reception import AlarmRule
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from sbas.exceptions import InputError
from sbas.logs.provenance import source_of
from sbas.positioning.measurements import Measurements, joined, measurements
from sbas.positioning.mode_choice import choose_modes
from sbas.positioning.protection_levels import K_V
from sbas.positioning.range_budget import LOW_ELEVATION_DEG, BudgetRules
from sbas.positioning.receiver_findings import receiver_findings
from sbas.positioning.receiver_noise import CLASS_2, ReceiverNoise
from sbas.positioning.receiver_settings import ReceiverSettings, SolutionMode
from sbas.positioning.software_receiver import Fixes, solve_fixes
from sbas.positioning.solution_tables import epoch_table, satellites_of
from sbas.recording import ProtectionLevelMeta, Recording, RecordingMeta
from sbas.rinex.ephemerides import Navigation
from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observation_file import read_observations
from sbas.rinex.observations import Observations
from sbas.satellite_table import SIDE_TABLE
from sbas.timescales import GPS_EPOCH_NS

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
PathLike = str | os.PathLike[str]
Files = PathLike | Sequence[PathLike]

NO_KLOBUCHAR = 4 * (0.0,), 4 * (0.0,)
_CODES = ("C1C", "L1C", "S1C")


def protect(
    observations: Files,
    navigation: Files,
    messages: Files | Recording | SbasMessages,
    *,
    geo: int,
    mode: SolutionMode = "pa",
    profile: Profile = "mops",
    place_m: tuple[float, float, float] | None = None,
    k_h: float | None = None,
    k_v: float = K_V,
    elevation_mask_deg: float = LOW_ELEVATION_DEG,
    smoothing: bool = False,
    noise: ReceiverNoise = CLASS_2,
    alarms: AlarmRule = "alarm",
    causal: bool = False,
    track_azimuth_deg: float | None = None,
    stamp: Stamp = "end",
    geo_ranging: bool = False,
    hal_m: float | None = None,
    val_m: float | None = None,
) -> Recording:
    """Positions and protection levels from RINEX observations, navigation and SBAS messages.

    Parameters
    ----------
    observations, navigation : RINEX files of one receiver, and of broadcast orbits.
    messages : EMS, `.sbs`, RINEX-B, SBF or UBX files, a Recording with SBAS frames, or messages.
    geo : PRN of the SBAS satellite whose corrections are used, 120..158.
    mode, profile, place_m, k_h, k_v, elevation_mask_deg, smoothing, noise, alarms, causal,
    track_azimuth_deg, geo_ranging, hal_m, val_m : see ReceiverSettings.
    stamp : whether message times stamp their end or their start.

    Returns
    -------
    Recording with every epoch of the observations. Without a fix position and levels are missing
    and the mode is "none"; `x_reason` says why, or why mode "auto" has fallen from precision
    approach to the other. The side table `satellites` says of every range whether it was used,
    why not, and every term of its budget. With `track_azimuth_deg` the column `x_level_along_m`
    is the level along the track, with the factor of `k_along`.

    Raises
    ------
    InputError : files that cannot be read, have no GPS C/A ranges, or do not overlap in time.

    References
    ----------
    RTCA DO-229D, appendices A and J; Filip, Bazant, Mocek 2010, section 2.3.
    """
    settings = ReceiverSettings(
        mode, profile, place_m, k_h, k_v, elevation_mask_deg, smoothing, noise, alarms, causal,
        track_azimuth_deg, geo_ranging, hal_m, val_m,
    )  # fmt: skip
    observed = read_observations(observations, systems="GS" if geo_ranging else "G", codes=_CODES)
    nav = read_navigation(navigation)
    if isinstance(messages, SbasMessages):
        heard = messages.of_prn(geo)
    else:
        heard = read_messages(messages, prn=geo, stamp=stamp)
    measured = _measured(observed, settings, geo)
    _check_overlap(measured, heard, geo)
    timeline = correction_timeline(heard, alarms=alarms)
    fixes = _solved(measured, timeline, nav, observed, settings)
    choice = choose_modes(fixes, settings)
    findings = (
        *observed.findings,
        *nav.findings,
        *heard.findings,
        *receiver_findings(settings, timeline, fixes, heard, no_klobuchar=nav.klobuchar is None),
    )
    meta = RecordingMeta(
        sources=tuple(
            source_of(path, kind)
            for given, kind in ((observations, "rinex_obs"), (navigation, "rinex_nav"),
                                (messages, "sbas_messages"))
            for path in _paths(given)
        ),
        frame="WGS 84 (broadcast orbits, SBAS corrections)",
        antenna="phase centre",
        receiver=observed.header.receiver,
        leap_seconds=nav.leap_seconds,
        pl=_pl_meta(settings),
        findings=findings,
        options={"protect": str(settings), "geo": str(geo)},
    )  # fmt: skip
    return Recording(
        epoch_table(fixes, choice, settings, geo), meta, {SIDE_TABLE: satellites_of(fixes, choice)}
    )


def _measured(observed: Observations, settings: ReceiverSettings, geo: int) -> Measurements:
    gps = observed.systems.get("G")
    if gps is None or "C1C" not in gps.values:
        raise InputError(
            "the observations have no GPS C/A code (C1C)",
            evidence=f"systems {', '.join(observed.systems) or 'none'}; codes "
            f"{', '.join(observed.header.codes.get('G', ())) or 'none'}",
            cure="log C1C; SBAS L1 corrections are for it alone",
        )
    measured = measurements(gps, smoothing=settings.smoothing)
    if not settings.geo_ranging:
        return measured
    name = f"S{geo - 100:02d}"
    own = observed.systems.get("S")
    if own is None or "C1C" not in own.values or name not in own.satellites:
        raise InputError(
            f"the observations have no range of the SBAS satellite itself ({name}, C1C)",
            evidence=f"SBAS satellites {', '.join(own.satellites) if own else 'none'}",
            cure="leave out --geo-ranging",
        )
    column = own.satellites.index(name)
    alone = replace(
        own,
        satellites=(name,),
        values={code: array[:, [column]] for code, array in own.values.items()},
    )
    return joined(measured, measurements(alone, smoothing=settings.smoothing))


def _paths(given: object) -> list[PathLike]:
    if isinstance(given, (str, os.PathLike)):
        return [given]
    return list(given) if isinstance(given, Sequence) else []


def _check_overlap(measured: Measurements, heard: SbasMessages, geo: int) -> None:
    if not len(heard):
        raise InputError(
            f"there is no message of PRN {geo}", code="E15", cure="--geo with a satellite heard"
        )
    if not len(measured):
        raise InputError(
            "the observations hold no range", code="E15", cure="check the receiver's log"
        )
    first, last = int(measured.time_ns[0]) // 10**9, int(measured.time_ns[-1]) // 10**9
    begin, end = int(heard.time_s[0]), int(heard.time_s[-1])
    if last < begin or first > end:
        raise InputError(
            "messages and observations are not of the same time",
            where=f"PRN {geo}",
            evidence=f"observations {_stamp(first)} to {_stamp(last)}, messages {_stamp(begin)} "
            f"to {_stamp(end)} GPST",
            cure="give files of the same hours",
        )


def _stamp(second: int) -> str:
    return str(np.datetime64(second * 10**9 + GPS_EPOCH_NS, "ns").astype("M8[s]"))


def _solved(
    measured: Measurements,
    timeline: CorrectionTimeline,
    nav: Navigation,
    observed: Observations,
    settings: ReceiverSettings,
) -> dict[Mode, Fixes]:
    """Fixes in each mode that the settings ask for."""
    modes: tuple[Mode, ...] = ("pa", "npa") if settings.mode == "auto" else (settings.mode,)
    place = None if settings.place_m is None else np.array(settings.place_m, float)
    approximate = observed.header.position_m
    found: dict[Mode, Fixes] = {}
    for mode in modes:
        rules = BudgetRules(
            mode, settings.profile, settings.elevation_mask_deg, settings.noise,
            nav.klobuchar or NO_KLOBUCHAR,
            FALLBACK_SIGMA_M if settings.profile == "glab" else None,
        )  # fmt: skip
        found[mode] = solve_fixes(
            measured, timeline, nav.gps, rules, place_m=place,
            approximate_m=None if approximate is None else np.array(approximate),
            causal=settings.causal,
        )  # fmt: skip
    return found


def _pl_meta(settings: ReceiverSettings) -> ProtectionLevelMeta:
    if settings.mode == "auto" and settings.k_h is None:
        return ProtectionLevelMeta("do229", k_v=settings.k_v)
    mode: Mode = "npa" if settings.mode == "npa" else "pa"
    return ProtectionLevelMeta("do229", k_h=settings.k_h_of(mode), k_v=settings.k_v)
