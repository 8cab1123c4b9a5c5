"""How long do errors stay correlated? The question, from a recording to its answer."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Estimate, Fitted, Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import accept, check
from sbas.integrity.correlation.autocorrelation import (
    Autocorrelation,
    autocorrelation,
    bartlett_sigma,
)
from sbas.integrity.correlation.decorrelation_results import MISFITS, Curve, Decorrelation, Misfit
from sbas.integrity.correlation.error_grid import ErrorGrid, error_grid, room
from sbas.integrity.correlation.process_shape import process_shape, shape_verdict
from sbas.integrity.correlation.robust_tau import (
    LEAST_SAMPLES,
    clean,
    fit_exponentials,
    longest_lag,
    other_definitions,
)
from sbas.integrity.correlation.tau_interval import TauInterval, tau_interval
from sbas.integrity.correlation.two_processes import fit_two_processes
from sbas.recording import EpochSource
from sbas.truth import Truth

LEAST_LENGTHS = 20
"""A record shorter than this many decorrelation times gives an interval only."""
WHITE_R1 = 0.3
"""First r below this: mostly white."""
OUTLIER_SHARE = 1e-4
"""With more clipped epochs than this share, the misfit is judged without them."""
COMPONENTS = ("east", "north")


def decorrelation(
    source: EpochSource,
    *,
    truth: Truth | None = None,
    segments: Literal["environment"] | float | None = None,
    confidence: float = 0.95,
    accept_findings: Iterable[str] = (),
) -> Decorrelation:
    """How long the position errors of a recording stay correlated.

    Parameters
    ----------
    source : a Recording, or a source of `sbas.scan` that streams.
    truth : where the antenna was. A static recording needs none, since a constant has no part
        in a correlation; a moving one without truth gets a refusal.
    segments : "environment" for one further result a label, or seconds for one a piece of this
        length.
    confidence : of the two-sided interval, at most 0.99: the simulated tails hold no more.
    accept_findings : codes of errors in the input to accept as warnings.

    Returns
    -------
    Decorrelation. What the data do not bear (too few epochs, no truth, a constant, repeated
    times) comes back as a Refusal with findings, never as a number.

    Raises
    ------
    InputError : an argument out of range.

    Notes
    -----
    East and north errors, signed, never their size (its correlation time is about half).
    Clipped, freed of drift and daily terms, correlated across gaps; a Gauss-Markov process
    with white noise is fitted where r falls from 0.9 to 0.3; the estimator's simulated
    distribution on the same gaps gives the median-unbiased value and the interval.
    Source: docs/methods/decorrelation.md; Filip, Bazant, Mocek 2010, 2.1.2 (the question).
    """
    if not 0.5 <= confidence <= 0.99:
        raise InputError(
            "the confidence must lie between 0.5 and 0.99", evidence=f"got {confidence}",
            cure="confidence=0.95",
        )  # fmt: skip
    by_label = segments == "environment"
    if not (segments is None or by_label or (isinstance(segments, (int, float)) and segments > 0)):
        raise InputError(
            "segments are 'environment' or a length in seconds", evidence=f"got {segments!r}",
            cure="segments='environment', or segments=86400.0",
        )  # fmt: skip
    checked = check(source, truth=truth)
    findings = list(accept(checked.findings, accept_findings))
    error = next((f for f in findings if f.severity == "error"), None)
    if error is not None:
        return _refused(Refusal(error.message, error.cure), confidence, findings)
    facts = checked.survey
    if truth is None:
        remark = _without_truth(facts.static, facts.positions, facts.extent_m)
        findings.append(remark)
        if not facts.static:
            return _refused(Refusal(remark.message, remark.cure), confidence, findings)
    grid, remarks = error_grid(source, facts, truth, labelled=by_label)
    findings += remarks
    if isinstance(grid, Refusal):
        return _refused(grid, confidence, findings)
    if by_label and not grid.names:
        findings.append(
            Finding(
                "E25", "warning", "no epoch has an environment label: no segments",
                cure="add a column 'environment'",
            )
        )  # fmt: skip
    pieces = tuple(
        decorrelation_of(values, grid.step_s, label=label, confidence=confidence)
        for label, values in _pieces(grid, segments)
    )
    return decorrelation_of(
        grid.values, grid.step_s, confidence=confidence, findings=findings, pieces=pieces
    )


def decorrelation_of(
    values: NDArray[np.floating[Any]],
    step_s: float,
    *,
    label: str = "",
    confidence: float = 0.95,
    findings: Iterable[Finding] = (),
    pieces: tuple[Decorrelation, ...] = (),
) -> Decorrelation:
    """The decorrelation of east and north errors on a regular grid.

    Parameters
    ----------
    values : (2, n) signed errors [m], NaN in both where missing.
    step_s : step of the grid [s].
    label, confidence, findings, pieces : passed into the result.
    """
    found = list(findings)
    cleaned = clean(values, step_s)
    if isinstance(cleaned, Refusal):
        few = int(np.isfinite(values[0]).sum()) < LEAST_SAMPLES
        found.append(Finding("E15" if few else "E10", "warning", cleaned.reason, cure=cleaned.cure))
        return _refused(cleaned, confidence, found, label=label, pieces=pieces)
    cells = values.shape[1]
    recorded_s = cleaned.samples * step_s
    max_lag = longest_lag(cells, step_s)
    acf = autocorrelation(cleaned.values, step_s=step_s, max_lag=max_lag)
    fits = fit_exponentials(np.vstack([acf.mean, acf.components]), step_s)
    robust, amplitude = float(fits.tau_s[0]), float(fits.amplitude[0])
    judged = acf
    clipped = int(cleaned.clipped.sum())
    if clipped > OUTLIER_SHARE * cleaned.samples:
        # Bursts of outliers, though clipped, would pass for a second, short process.
        far = min(max_lag, 4 * int(fits.stop[0])) if math.isfinite(robust) else max_lag
        judged = autocorrelation(
            cleaned.values, step_s=step_s, max_lag=far, leave_out=cleaned.clipped
        )
    shape = process_shape(judged)
    white = bool(acf.mean[1] < WHITE_R1)
    interval = None
    if not white:
        pilot = robust if math.isfinite(robust) else max_lag * step_s
        interval = tau_interval(cleaned, step_s, pilot_s=pilot, confidence=confidence)
    value = None if interval is None else interval.value_s
    scarce = not math.isfinite(robust) or value is None
    scarce = scarce or recorded_s < LEAST_LENGTHS * max(robust, value or 0.0)
    misfit: Misfit
    if white:
        misfit = "mostly_white"
    elif scarce:
        misfit = "record_too_short"
        found.append(_too_short(recorded_s, robust, value))
    else:
        misfit = shape_verdict(shape, recorded_s=recorded_s, step_s=step_s)
    return Decorrelation(
        label=label,
        tau_s=_estimate(misfit, interval, recorded_s, robust, amplitude, confidence),
        tau_low_s=None if interval is None else interval.low_s,
        tau_high_s=None if interval is None else interval.high_s,
        confidence=confidence,
        misfit=misfit,
        nugget=max(0.0, 1 - amplitude) if math.isfinite(amplitude) else None,
        short_lag_exponent=_known(shape.short_lag_exponent),
        late_over_early=_known(shape.late_over_early),
        two_processes=fit_two_processes(judged.mean, step_s) if misfit == "mixture" else None,
        component_tau_s=dict(zip(COMPONENTS, map(_known, fits.tau_s[1:].tolist()), strict=True)),
        definitions={"robust_fit_s": _known(robust), **other_definitions(acf)},
        cross_correlation=cleaned.cross,
        step_s=step_s,
        samples=cleaned.samples,
        span_s=cells * step_s,
        recorded_s=recorded_s,
        clipped=clipped,
        curve=_curve(acf, value, recorded_s, cleaned.cross),
        findings=tuple(found),
        pieces=pieces,
    )


def _estimate(
    misfit: Misfit,
    interval: TauInterval | None,
    recorded_s: float,
    robust: float,
    amplitude: float,
    confidence: float,
) -> Estimate | Refusal:
    if misfit == "mostly_white":
        return Refusal(
            "the errors are mostly white at this step; what is left has no clear time",
            "average the positions over some seconds, or look for noise in the receiver",
        )
    if not math.isfinite(robust):
        return Refusal(
            "the correlation does not end within this record: r stays above 0.3 wherever enough "
            "pairs of epochs are known",
            "record longer",
        )
    if interval is not None and interval.value_s is None and recorded_s >= LEAST_LENGTHS * robust:
        return Refusal(
            f"the correlation fades within {robust:.4g} s, yet no Gauss-Markov record of this "
            "length looks like this one: bursts among the errors may be the cause",
            "look at the curve; a longer record need not help",
        )
    if misfit == "record_too_short" or interval is None or interval.value_s is None:
        return Refusal(
            f"{recorded_s:.6g} s are fewer than {LEAST_LENGTHS} decorrelation times",
            "record longer; the interval says what this record bears",
        )
    caveats = []
    if misfit in ("mixture", "smooth"):
        caveats.append(f"{MISFITS[misfit]}; the interval supposes one Gauss-Markov process")
    if interval.high_s is None:
        caveats.append("the record sets no upper limit")
    parameters = {
        "nugget": max(0.0, 1 - amplitude),
        "record_s": recorded_s,
        "simulated_records": float(interval.simulated),
        "simulated_step_s": interval.step_s,
    }
    return Estimate(
        interval.value_s,
        interval.low_s,
        interval.high_s,
        confidence,
        "s",
        Fitted("Gauss-Markov process with white noise", parameters, 0.0),
        sided="two",
        caveats=tuple(caveats),
    )


def _curve(acf: Autocorrelation, value: float | None, recorded_s: float, cross: float) -> Curve:
    """What a picture draws; the sampling error is that of the average of two components."""
    sigma = np.empty(0)
    if value is not None:
        one = bartlett_sigma(acf.lag_s, tau_s=value, length_s=recorded_s)
        sigma = one * math.sqrt((1 + cross**2) / 2)
    return Curve(acf.lag_s, acf.mean, acf.components, sigma)


def _pieces(
    grid: ErrorGrid, segments: Literal["environment"] | float | None
) -> Iterator[tuple[str, NDArray[np.float32]]]:
    """Label and (2, m) errors of each piece."""
    if isinstance(segments, (int, float)):
        cells = max(int(segments / grid.step_s), 1)
        for first in range(0, grid.values.shape[1], cells):
            begin = np.datetime64(grid.begin_ns + first * grid.step_ns, "ns")
            label = f"{begin.astype('M8[s]')} GPST, {segments:g} s"
            yield label, grid.values[:, first : first + cells]
    elif segments is not None and grid.labels is not None:
        for code, name in enumerate(grid.names):
            here = np.flatnonzero(grid.labels == code)
            first, stop = int(here[0]), int(here[-1]) + 1
            values = room((2, stop - first))
            values[:] = grid.values[:, first:stop]
            values[:, grid.labels[first:stop] != code] = np.nan
            yield name, values


def _too_short(recorded_s: float, robust: float, value: float | None) -> Finding:
    if math.isfinite(robust):
        longest = max(robust, value or 0.0)
        evidence = f"{recorded_s:.6g} s recorded, about {recorded_s / longest:.3g} times tau"
    else:
        evidence = f"{recorded_s:.6g} s recorded; r never falls below 0.3"
    return Finding(
        "E15", "warning", "the record is too short for its decorrelation time",
        evidence=evidence, cure=f"record at least {LEAST_LENGTHS} decorrelation times",
    )  # fmt: skip


def _without_truth(static: bool, positions: int, extent_m: float) -> Finding:
    if static:
        return Finding(
            "E01", "info",
            "no truth: the recording's own median stands in; a constant has no part in tau",
        )  # fmt: skip
    what = "has no positions" if positions == 0 else f"moves ({extent_m:.3g} m)"
    return Finding(
        "E01", "warning", f"no truth, and the recording {what}: no errors to correlate",
        cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
    )  # fmt: skip


def _refused(
    reason: Refusal,
    confidence: float,
    findings: Iterable[Finding],
    *,
    label: str = "",
    pieces: tuple[Decorrelation, ...] = (),
) -> Decorrelation:
    return Decorrelation(
        label, reason, None, None, confidence, findings=tuple(findings), pieces=pieces
    )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
