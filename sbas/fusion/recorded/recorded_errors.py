"""The GNSS sensor of a recording: signed errors along the track, states, and what was declared.

One definition with `sbas.receiver_states`: an epoch is "wrong" there, at the alert limit as its
threshold, exactly where the state of the horizontal error is U here; see `along_track_errors`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.dependability.receiver.state_tally import one_step_ns, receiver_answers
from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.frames import decimal_year
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.recorded.detection_counts import DetectionCounts
from sbas.fusion.states import DA, NO_DATA, N, U, check_thresholds, states_of
from sbas.input_check import accept, check
from sbas.integrity.position_error import position_errors
from sbas.recording import Recording, left_out_levels, with_columns
from sbas.timescales import NS_PER_S
from sbas.track import Track
from sbas.truth import Truth, frame_findings

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
JudgedBy = Literal["horizontal", "along"]

_COLUMNS: Final = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "mode", "flags", "environment", "hardware_fault",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class RecordedErrors:
    """What a recording with truth says of its sensor, epoch by epoch.

    Parameters
    ----------
    time : (n,) GPS time.
    interval_s : median step [s].
    thresholds : of the states; hysteresis and dwell are left to the simulation.
    judged_by : "horizontal", states from the horizontal error, or "along", from |along_m|.
    along_m, across_m, up_m : (n,) signed errors towards the direction of travel, to its right,
        and up [m]; NaN where unknown, and where the fix is not to be used.
    hpe_m, hpl_m : (n,) horizontal error, and level of the service [m]; NaN where there is none.
    state : (n,) codes of `sbas.fusion.states`, of each epoch by itself.
    declared_usable : (n,) a position with a level below the alert limit.
    unknown : (n,) NO_DATA that tells nothing of the receiver: the truth does not reach the epoch,
        the logger lost the position, or hardware failed, the wait for a first fix included.
    follows : (n,) one interval after the epoch before, and neither `unknown`: a transition.
    environment : (n,) index into `labels`, -1 where unlabelled.
    labels : environment labels, in the order of their appearance in the recording's categories.
    counts : of states by declaration.
    findings : of the input check and of this analysis.
    sources : files.
    """

    time: NDArray[np.datetime64]
    interval_s: float
    thresholds: Thresholds
    judged_by: JudgedBy
    along_m: Floats
    across_m: Floats
    up_m: Floats
    hpe_m: Floats
    hpl_m: Floats
    state: NDArray[np.int8]
    declared_usable: Bools
    unknown: Bools
    follows: Bools
    environment: NDArray[np.int64]
    labels: tuple[str, ...]
    counts: DetectionCounts
    findings: tuple[Finding, ...]
    sources: tuple[Mapping[str, Any], ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the series."""
        return {
            "epochs": self.time.size,
            "interval_s": self.interval_s,
            "nominal_m": self.thresholds.nominal_m,
            "alert_limit_m": self.thresholds.alert_limit_m,
            "judged_by": self.judged_by,
            "counts": self.counts.to_dict(),
            "labels": list(self.labels),
            "findings": [f.to_dict() for f in self.findings],
            "sources": [dict(s) for s in self.sources],
        }


def along_track_errors(
    recording: Recording,
    *,
    truth: Truth | None,
    track: Track | None = None,
    azimuth_deg: float | None = None,
    direction_above_mps: float | None = None,
    thresholds: Thresholds | None = None,
    judged_by: JudgedBy = "horizontal",
    accept_findings: Iterable[str] = (),
) -> RecordedErrors:
    """The signed errors of a recording along and across the track, with states and declarations.

    Parameters
    ----------
    recording : (n,) epochs.
    truth : where the antenna was.
    track, direction_above_mps : what tells the direction of travel, see `sbas.position_errors`;
        the `heading_deg` of a trajectory needs neither.
    azimuth_deg : direction for all epochs instead [deg], such as that of the track beside which
        an antenna stands.
    thresholds : bounds of the states; None takes the defaults.
    judged_by : the error whose size gives state and misleading information; "horizontal" is
        conservative for the error along the track, which it bounds.
    accept_findings : codes of errors in the input to accept as warnings.

    Returns
    -------
    RecordedErrors. With d the azimuth: along = dE sin d + dN cos d, across = dE cos d - dN sin d.
    N below `nominal_m`, U from `alert_limit_m` on; usable where HPL < `alert_limit_m`: ties go to
    the unsafe side. No gap is filled.

    Raises
    ------
    InputError : no truth (no sign), no direction or two, thresholds out of order, a level of 0 m
        or less, or an error found by the input check.

    Notes
    -----
    Judged by the horizontal error, and with x = `alert_limit_m` as the threshold of
    `sbas.receiver_states`: wrong there is U here, declared usable or not (hazard + detected + U
    without a level), since those states know no protection level; correct is N or DA; missing is
    NO_DATA that is not `unknown`, fixes that RAIM has failed included; hardware, first_fix_wait
    and unknown together are `unknown`.
    Sources: Railways 2014, section 3.1, steps 1 and 2 (states, detection); RTCA DO-229D, 1.7.2.
    """
    bounds = thresholds or Thresholds()
    check_thresholds(bounds)
    _check_arguments(judged_by, track, azimuth_deg, direction_above_mps)
    if truth is None or truth.lower_bound:
        raise InputError(
            "no truth: the errors have no sign",
            code="E01",
            evidence="against the recording's own median, or a track line, errors are a lower "
            "bound and their sign along the track is not known",
            cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
        )
    table = with_columns(recording.table, _COLUMNS)
    hpl = table["hpl_m"].to_numpy()
    if not_positive := int(np.sum(hpl <= 0)):
        raise InputError(
            "a protection level of 0 m or less protects nothing", code="E13",
            evidence=f"{not_positive:,} epochs, the lowest {np.nanmin(hpl):g} m",
            cure="--pl-zero missing, or sbas.repair",
        )  # fmt: skip
    checked = check(recording, truth=truth)
    survey = checked.survey
    year = float(decimal_year(np.datetime64(survey.begin_ns, "ns"))) if survey.epochs else None
    found = (*checked.findings, *frame_findings(recording.meta, truth, year=year))
    findings = list(accept(found, accept_findings))
    refuse_on_errors(findings)

    errors = position_errors(table, truth, track=track, direction_above_mps=direction_above_mps)
    east, north, hpe = (errors[name].to_numpy() for name in ("east_m", "north_m", "hpe_m"))
    azimuth = _azimuth_deg(errors, azimuth_deg)
    along = east * np.sin(np.radians(azimuth)) + north * np.cos(np.radians(azimuth))
    across = east * np.cos(np.radians(azimuth)) - north * np.sin(np.radians(azimuth))

    gave = receiver_answers(table)
    size = hpe if judged_by == "horizontal" else np.abs(along)
    judged = gave.fix & np.isfinite(size)
    unknown = gave.fault | gave.lost | gave.waiting | (gave.fix & ~judged)
    # Each epoch by itself, as in `sbas.receiver_states`: no state is held across gaps.
    plain = replace(bounds, hysteresis_m=0.0, min_dwell_s=0.0)
    state = states_of(np.where(judged, size, np.nan), plain)
    unacceptable = size >= bounds.alert_limit_m
    level = np.where(judged & ~left_out_levels(table), hpl, np.nan)
    usable = level < bounds.alert_limit_m
    no_level = np.isnan(level)

    usable_n, usable_da, usable_u = _by_state(state, usable)
    barred_n, barred_da, barred_u = _by_state(state, ~usable & ~no_level)
    open_n, open_da, open_u = _by_state(state, no_level)
    counts = DetectionCounts(
        safe=usable_n, available=usable_da, hazard=usable_u,
        false_alarm_n=barred_n, false_alarm_da=barred_da, detected=barred_u,
        misleading=int(np.sum(usable & (size >= level) & ~unacceptable)),
        no_level_n=open_n, no_level_da=open_da, no_level_u=open_u,
        raim_failed=int(np.sum(gave.alarmed)),
        raim_failed_u=int(np.sum(gave.alarmed & unacceptable)),
        no_data=int(np.sum((state == NO_DATA) & ~unknown)),
        unknown=int(np.sum(unknown)),
    )  # fmt: skip
    if not counts.judged:
        raise InputError(
            "no epoch has a known error", code="E01",
            evidence=f"{len(table):,} epochs, {int(np.sum(gave.fix)):,} with a fix",
            cure="check the times and the steps of the truth",
        )  # fmt: skip
    undirected = int(np.sum(judged & ~np.isfinite(along)))
    sigma = errors["truth_sigma_h_m"].to_numpy()[judged]
    findings += _remarks(counts, bounds, undirected, float(np.max(sigma)), state, unknown)
    environment = table["environment"].cat
    return RecordedErrors(
        time=table.index.to_numpy(),
        interval_s=survey.interval_ns / NS_PER_S,
        thresholds=bounds,
        judged_by=judged_by,
        along_m=np.where(judged, along, np.nan),
        across_m=np.where(judged, across, np.nan),
        up_m=np.where(judged, errors["up_m"].to_numpy(), np.nan),
        hpe_m=np.where(judged, hpe, np.nan),
        hpl_m=level,
        state=state,
        declared_usable=usable,
        unknown=unknown,
        follows=_follows(table, survey.interval_ns, unknown),
        environment=environment.codes.to_numpy().astype(np.int64),
        labels=tuple(map(str, environment.categories)),
        counts=counts,
        findings=tuple(findings),
        sources=tuple(dict(vars(s)) for s in recording.meta.sources),
    )


def _check_arguments(
    judged_by: str,
    track: Track | None,
    azimuth_deg: float | None,
    direction_above_mps: float | None,
) -> None:
    if judged_by not in ("horizontal", "along"):
        raise InputError(
            "an unknown error to judge by", evidence=repr(judged_by), cure="horizontal or along"
        )
    if azimuth_deg is not None and not abs(azimuth_deg) <= 360:
        raise InputError(
            "an azimuth lies between -360 and 360 degrees", evidence=f"{azimuth_deg} deg",
            cure="--azimuth 90 for a track to the east",
        )  # fmt: skip
    if azimuth_deg is not None and (track is not None or direction_above_mps is not None):
        raise InputError(
            "two directions of travel",
            cure="give an azimuth (--azimuth), or what tells it, not both",
        )


def _azimuth_deg(errors: pd.DataFrame, given: float | None) -> Floats | float:
    """Direction of travel: that given for all epochs, or (n,), NaN where nothing tells it."""
    if given is not None:
        return given
    if "track_azimuth_deg" not in errors:
        raise InputError(
            "nothing tells the direction of travel: an error along it has no sign",
            cure="--track; a trajectory with heading_deg, or --direction-above 1 (m/s) for a "
            "trajectory without, or --azimuth for an antenna that stands",
        )
    azimuth: Floats = errors["track_azimuth_deg"].to_numpy(float)
    if "track_ambiguous" not in errors:
        return azimuth
    return np.where(errors["track_ambiguous"].to_numpy(bool), np.nan, azimuth)


def _by_state(state: NDArray[np.int8], where: Bools) -> tuple[int, int, int]:
    n, da, u = (int(np.sum((state == code) & where)) for code in (N, DA, U))
    return n, da, u


def _follows(table: pd.DataFrame, interval_ns: int, unknown: Bools) -> Bools:
    """(n,) True where a step of one interval, by the rules of `sbas.receiver_states`, links two
    epochs whose state is told."""
    time_ns = table.index.to_numpy().astype(np.int64)
    step = time_ns[1:] - time_ns[:-1]
    shortest, longest = one_step_ns(interval_ns)
    near = (step >= shortest) & (step <= longest)
    return np.concatenate([[False], near & ~unknown[1:] & ~unknown[:-1]])


def _remarks(
    counts: DetectionCounts,
    bounds: Thresholds,
    undirected: int,
    truth_sigma_m: float,
    state: NDArray[np.int8],
    unknown: Bools,
) -> Iterable[Finding]:
    """What the errors themselves show to be doubtful in the input."""
    if truth_sigma_m > 0.1 * bounds.nominal_m:
        yield Finding(
            "E09", "warning",
            f"the truth is uncertain by up to {truth_sigma_m:.3g} m (1-sigma), more than a tenth "
            f"of the nominal bound {bounds.nominal_m:g} m",
            cure="give a better truth",
        )  # fmt: skip
    if undirected:
        yield Finding(
            "E01", "warning",
            f"the direction of travel is unknown at {undirected:,} epochs with an error: no "
            "window of a replay or bootstrap holds them",
            evidence="the vehicle stands, the trajectory is too coarse, or the track is ambiguous",
            cure="give a track, or a trajectory with heading_deg",
        )  # fmt: skip
    if counts.unknown:
        yield Finding(
            "E01", "warning",
            f"{counts.unknown:,} epochs tell nothing of the receiver: truth, direction, log or "
            "hardware failed there",
            evidence="they are no outages, and no window holds them",
        )  # fmt: skip
    if counts.raim_failed:
        yield Finding(
            "E07", "info",
            f"{counts.raim_failed:,} epochs have a position whose RAIM found a fault: detected, "
            "hence no data",
            evidence=f"{counts.raim_failed_u:,} of them reach the alert limit",
        )  # fmt: skip
    if without := counts.no_level_n + counts.no_level_da + counts.no_level_u:
        yield Finding(
            "E25", "warning" if without == counts.judged else "info",
            f"{without:,} of {counts.judged:,} positions have no protection level of the service: "
            "nothing is detected by one there",
            evidence=f"{counts.no_level_u:,} of them are unacceptable; they count apart",
        )  # fmt: skip
    answered = np.flatnonzero((state != NO_DATA) | unknown)
    if answered[0]:
        yield Finding(
            "E04", "warning",
            f"{int(answered[0]):,} epochs without a fix open the record: counted as no data",
            evidence="a receiver that was just switched on looks the same",
            cure="cut them off, or flag hardware_fault before them",
        )  # fmt: skip
