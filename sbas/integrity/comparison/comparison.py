"""Two recordings of the same hours side by side: PA against NPA, or receiver 1 against 2."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.input_check import CheckResult, accept, check
from sbas.integrity.comparison.comparison_results import (
    PAPER_TAU_S,
    Comparison,
    ComparisonSettings,
    Differences,
    ErrorSummary,
    LevelRatio,
    Spread,
)
from sbas.integrity.comparison.comparison_words import caveats_of, verdict_of
from sbas.integrity.comparison.mode_losses import pa_drop_outs
from sbas.integrity.comparison.paired_availability import (
    availability_comparison,
    up_at_common_epochs,
)
from sbas.integrity.comparison.paired_differences import (
    PositionDifference,
    constant_offset,
    position_difference,
)
from sbas.integrity.comparison.pairing import CommonEpochs, common_epochs
from sbas.integrity.counting import checked_alpha
from sbas.integrity.epoch_levels import (
    k_of_epochs,
    mode_codes,
    usable_hpl_m,
    whole_table,
)
from sbas.integrity.exposure.exposure import require
from sbas.integrity.position_error import position_errors
from sbas.integrity.results import EvaluationSettings
from sbas.integrity.shares.block_bootstrap import merge_time_s, quantile_estimate
from sbas.recording import MODES, EpochSource
from sbas.streaming import ThinnedSeries
from sbas.timescales import NS_PER_S
from sbas.truth import Truth

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

COLUMNS = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "hdop", "n_sv", "mode", "geo_prn", "flags",
    "speed_mps", "vel_e_mps", "vel_n_mps", "correction_age_s",
)  # fmt: skip
STRIPS = ("speed_a", "speed_b", "distance", "hdop_a", "hdop_b", "n_sv_a", "n_sv_b")
STRIP_BINS = 1200


def compare(
    a: EpochSource,
    b: EpochSource,
    *,
    truth: Truth | None = None,
    alert_limits_m: Sequence[float] = EvaluationSettings.alert_limits_m,
    tau_s: float = PAPER_TAU_S,
    confidence: float = 0.95,
    accept_findings: Iterable[str] = (),
) -> Comparison:
    """Positions, protection levels and availability of two recordings at the same epochs.

    Parameters
    ----------
    a, b : recordings of the same hours, static or moving, of any rates; wholly in memory.
    truth : where the antennas were, if known; adds the errors of both.
    alert_limits_m : horizontal alert limits [m].
    tau_s : 1/e time of what makes the epochs correlated [s]; the default is the paper's
        assumption, and a measured time (its upper limit) is better.
    confidence : of every interval (two-sided), in [0.5, 1).
    accept_findings : codes of errors in the input to accept as warnings.

    Returns
    -------
    Comparison.

    Raises
    ------
    InputError : the input check found an error in one of them, they share no epoch, or an
        argument is out of range.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 3 and Fig. 4; integrity statistics, 7.
    """
    limits = EvaluationSettings(tuple(float(al) for al in alert_limits_m)).alert_limits_m
    require("tau_s", tau_s, above=0)
    checked_alpha(confidence)
    settings = ComparisonSettings(
        limits, float(tau_s), merge_time_s(tau_s), float(confidence), tuple(accept_findings)
    )
    (checked_a, found_a), (checked_b, found_b) = (
        _checked(source, name, truth, settings.accept) for source, name in ((a, "A"), (b, "B"))
    )
    survey_a, survey_b = checked_a.survey, checked_b.survey
    table_a, table_b = whole_table(a, COLUMNS), whole_table(b, COLUMNS)
    common = common_epochs(
        _time_ns(table_a), _time_ns(table_b),
        interval_a_ns=survey_a.interval_ns, interval_b_ns=survey_b.interval_ns,
    )  # fmt: skip
    paired = common.paired
    if not paired.any():
        raise InputError(
            "no epoch of the two recordings lies within half an interval of another",
            evidence=f"{common.unpaired_a} epochs of A and {common.unpaired_b} of B in the "
            "shared span",
            cure="compare recordings of the same hours",
        )
    moving = not (survey_a.static and survey_b.static)
    apart = position_difference(
        table_a, table_b, common,
        interval_a_ns=survey_a.interval_ns, interval_b_ns=survey_b.interval_ns, moving=moving,
    )  # fmt: skip
    interval_s = common.interval_ns / NS_PER_S
    difference = _differences(apart, common, settings)
    offset = constant_offset(apart, interval_s=interval_s, tau_s=tau_s, moving=moving)
    findings = [*found_a, *found_b, *_remarks(apart)]
    hpl_a, hpl_b = usable_hpl_m(table_a), usable_hpl_m(table_b)
    rows_a, rows_b = common.row_a[paired], common.row_b[paired]
    ratio = _level_ratio(
        hpl_a[rows_a], hpl_b[rows_b], k_of_epochs(table_a, a.meta.pl)[rows_a],
        k_of_epochs(table_b, b.meta.pl)[rows_b], interval_s, settings,
    )  # fmt: skip
    errors: list[ErrorSummary | None] = [None, None]
    if truth is not None:
        errors = [
            _errors(table_a.iloc[rows_a], hpl_a[rows_a], truth),
            _errors(table_b.iloc[rows_b], hpl_b[rows_b], truth),
        ]
    fix_a, fix_b = _fix(table_a), _fix(table_b)
    availabilities = tuple(
        availability_comparison(
            al,
            up_at_common_epochs(fix_a, hpl_a, al, common.row_a),
            up_at_common_epochs(fix_b, hpl_b, al, common.row_b),
            common,
            tau_s=settings.tau_s,
            confidence=settings.confidence,
        )
        for al in settings.alert_limits_m
    )
    drop_outs = [
        pa_drop_outs(
            table.iloc[slice(*_span_rows(_time_ns(table), common))],
            interval_ns=survey.interval_ns, merge_s=settings.merge_s, confidence=confidence,
        )
        for table, survey in ((table_a, survey_a), (table_b, survey_b))
    ]  # fmt: skip
    labels = [f"{name}{_mode_name(table)}" for name, table in (("A", table_a), ("B", table_b))]
    result = Comparison(
        settings=settings,
        label_a=labels[0],
        label_b=labels[1],
        truth=truth,
        static=not moving,
        interval_s=interval_s,
        begin_ns=int(common.time_ns[0]),
        end_ns=int(common.time_ns[-1]),
        epochs_a=survey_a.epochs,
        epochs_b=survey_b.epochs,
        paired=int(paired.sum()),
        outside_a=common.outside_a,
        outside_b=common.outside_b,
        unpaired_a=common.unpaired_a,
        unpaired_b=common.unpaired_b,
        between_a=common.between_a,
        between_b=common.between_b,
        max_offset_s=float(np.abs(common.offset_ns).max()) / NS_PER_S,
        difference=difference,
        offset=offset,
        hpl_ratio=ratio,
        error_a=errors[0],
        error_b=errors[1],
        alert_limits=availabilities,
        drop_outs_a=drop_outs[0],
        drop_outs_b=drop_outs[1],
        verdict=(),
        caveats=(),
        findings=tuple(findings),
        strips=_strips(table_a, table_b, common, apart),
    )
    return _with_words(result)


def _with_words(result: Comparison) -> Comparison:
    return replace(result, verdict=verdict_of(result), caveats=caveats_of(result))


def _checked(
    source: EpochSource, name: str, truth: Truth | None, accepted: tuple[str, ...]
) -> tuple[CheckResult, list[Finding]]:
    checked = check(source, truth=truth)
    found = [
        replace(f, where=f"{name}: {f.where}" if f.where else name)
        for f in accept(checked.findings, accepted)
    ]
    refuse_on_errors(found)
    return checked, found


def _time_ns(table: pd.DataFrame) -> NDArray[np.int64]:
    time: NDArray[np.int64] = table.index.to_numpy().astype(np.int64)
    return time


def _span_rows(time_ns: NDArray[np.int64], common: CommonEpochs) -> tuple[int, int]:
    """Rows [first, stop) within the shared span."""
    half = common.interval_ns // 2
    first = int(np.searchsorted(time_ns, common.time_ns[0] - half, side="left"))
    return first, int(np.searchsorted(time_ns, common.time_ns[-1] + half, side="right"))


def _fix(table: pd.DataFrame) -> Bools:
    known: Bools = np.isfinite(table["lat_deg"].to_numpy()) & np.isfinite(
        table["lon_deg"].to_numpy()
    )
    return known


def _mode_name(table: pd.DataFrame) -> str:
    """The mode of at least half the epochs, for a label; empty where there is none."""
    counts = np.bincount(mode_codes(table) + 1, minlength=len(MODES) + 1)[1:]
    if counts.max() * 2 < len(table):
        return ""
    name = MODES[int(counts.argmax())]
    return f" ({ {'sbas_pa': 'PA', 'sbas_npa': 'NPA'}.get(name, name) })"


def _effective(count: int, interval_s: float, tau_s: float) -> float:
    """Effective values of a mean among correlated ones, T/(2 tau), at most their number."""
    return min(count * interval_s / (2 * tau_s), float(count))


def _differences(
    apart: PositionDifference, common: CommonEpochs, settings: ComparisonSettings
) -> Differences | Refusal:
    horizontal = apart.horizontal_m
    known = np.isfinite(horizontal)
    if not known.any():
        return Refusal("no epoch has a position in both recordings")
    values = horizontal[known]
    interval_s = common.interval_ns / NS_PER_S
    hours = values.size * interval_s / 3600

    def quantile(q: float) -> Estimate:
        return quantile_estimate(
            values, q, n_effective=_effective(values.size, interval_s, settings.tau_s),
            hours=hours, confidence=settings.confidence, unit="m",
        )  # fmt: skip

    largest = int(np.nanargmax(horizontal))
    has_up = bool(np.isfinite(apart.up_m).any())
    return Differences(
        epochs=values.size,
        median=quantile(0.5),
        p95=quantile(0.95),
        max=float(horizontal[largest]),
        max_time_ns=int(common.time_ns[common.paired][largest]),
        east=_spread(apart.east_m),
        north=_spread(apart.north_m),
        up=_spread(apart.up_m) if has_up else None,
        interpolated=apart.interpolated,
        max_shift_s=apart.max_shift_s,
    )


def _spread(values: Floats) -> Spread:
    values = values[np.isfinite(values)]
    size = np.abs(values)
    return Spread(
        float(np.median(values)), float(np.quantile(size, 0.95)), float(size.max()), values.size
    )


def _remarks(apart: PositionDifference) -> list[Finding]:
    if not apart.interpolated:
        return []
    return [
        Finding(
            "E26", "info",
            f"{apart.interpolated} positions were brought to the other recording's times",
            evidence=f"by a cubic through four epochs, by at most {apart.max_shift_s:.6g} s",
        )
    ]  # fmt: skip


def _level_ratio(
    hpl_a: Floats,
    hpl_b: Floats,
    k_a: Floats,
    k_b: Floats,
    interval_s: float,
    settings: ComparisonSettings,
) -> LevelRatio | Refusal:
    known = np.isfinite(hpl_a) & np.isfinite(hpl_b) & (hpl_a > 0) & (hpl_b > 0)
    if not known.any():
        return Refusal("no epoch has a protection level in both recordings")

    def median(values: Floats) -> Estimate:
        return quantile_estimate(
            values, 0.5, n_effective=_effective(values.size, interval_s, settings.tau_s),
            hours=values.size * interval_s / 3600, confidence=settings.confidence, unit="1",
        )  # fmt: skip

    ratio = hpl_a[known] / hpl_b[known]
    k_ratio = k_a[known] / k_b[known]
    with_k = np.isfinite(k_ratio)
    if not with_k.any():
        unknown = Refusal(
            "the K factor behind the levels of A or B is not known",
            "state it in the recording's metadata (pl.k_h), or the mode of every epoch",
        )
        return LevelRatio(median(ratio), unknown, unknown)
    return LevelRatio(
        median(ratio), float(np.median(k_ratio[with_k])), median((ratio / k_ratio)[with_k])
    )


def _errors(table: pd.DataFrame, hpl: Floats, truth: Truth) -> ErrorSummary | None:
    hpe = position_errors(table, truth)["hpe_m"].to_numpy()
    known = np.isfinite(hpe)
    if not known.any():
        return None
    values = hpe[known]
    return ErrorSummary(
        float(np.median(values)), float(np.quantile(values, 0.95)), float(values.max()),
        int(np.sum(hpe >= hpl)), values.size,
    )  # fmt: skip


def _strips(
    a: pd.DataFrame, b: pd.DataFrame, common: CommonEpochs, apart: PositionDifference
) -> ThinnedSeries:
    """What the picture shows, over the shared span."""
    span = int(common.time_ns[0]), int(common.time_ns[-1])
    # Not more bins than epochs: empty ones would break the lines of a short record.
    bins = min(STRIP_BINS, common.time_ns.size)
    series = ThinnedSeries(*span, STRIPS, bins)
    for name, table in (("a", a), ("b", b)):
        part = table.iloc[slice(*_span_rows(_time_ns(table), common))]
        n_sv = part["n_sv"].to_numpy().astype(float)
        values = {column: np.full(len(part), np.nan) for column in STRIPS}
        values |= {
            f"speed_{name}": _speed(part),
            f"hdop_{name}": part["hdop"].to_numpy(),
            f"n_sv_{name}": np.where(n_sv < 0, np.nan, n_sv),
        }
        series.update(_time_ns(part), values)
    paired = common.paired
    values = {column: np.full(int(paired.sum()), np.nan) for column in STRIPS}
    series.update(common.time_ns[paired], values | {"distance": apart.horizontal_m})
    return series


def _speed(table: pd.DataFrame) -> Floats:
    """(n,) speed over ground [m/s]: as reported, else from the horizontal velocity."""
    stated = table["speed_mps"].to_numpy()
    velocity = np.hypot(table["vel_e_mps"].to_numpy(), table["vel_n_mps"].to_numpy())
    speed: Floats = np.where(np.isfinite(stated), stated, velocity)
    return speed
