"""The pictures, each with what to read from it."""

from __future__ import annotations

from sbas.integrity.results import Evaluation
from sbas.numerals import count
from sbas.plots import (
    availability_against_limit,
    error_scatter,
    rates_against_limit,
    ratio_survival,
    recording_strips,
    stanford_diagram,
)  # fmt: skip
from sbas.reporting.content import Section
from sbas.reporting.drawn import drawn


def section(evaluation: Evaluation) -> Section:
    """Six pictures, drawn on figures of their own."""
    limits = ", ".join(f"{al:g}" for al in evaluation.settings.alert_limits_m)
    widest = max(evaluation.settings.alert_limits_m)
    errors = "errors (a lower bound)" if evaluation.errors_are_lower_bound else "errors"
    return Section(
        "pictures",
        "Pictures",
        pictures=(
            drawn(
                "strips", "The recording over time", recording_strips.SHEET,
                lambda axes: recording_strips.strips(evaluation, axes=axes),
                "Four strips over time: protection level, satellites, HDOP, error with its sigma.",
                f"Each stroke spans all values of its time bin, so that no spike is lost; empty "
                f"stretches are gaps. Look for spikes of HPL (a) that go with lost satellites (b) "
                f"or a jump of HDOP (c), and for {errors} (d) that come near the level. "
                f"Alert limits: {limits} m.",
                wide=True,
            ),
            drawn(
                "stanford", "Stanford diagram", stanford_diagram.SHEET,
                lambda axes: stanford_diagram.stanford(evaluation, ax=axes[0]),
                f"Protection level against error, coloured by epochs, alert limit {widest:g} m.",
                f"Safe epochs lie above the diagonal. Right of and below it the level did not "
                f"bound the error (MI), and beyond {widest:g} m unnoticed (HMI). The numbers count "
                f"raw epochs for an alert limit of {widest:g} m.",
            ),
            drawn(
                "scatter", "Scatter of the horizontal error", error_scatter.SHEET,
                lambda axes: error_scatter.scatter(evaluation, ax=axes[0]),
                "Density of east and north errors with mean, 1-sigma and 95 percent ellipse.",
                "A mean away from the cross is a constant offset (antenna, frame, truth); points "
                "far outside the dashed ellipse are tails that a Gauss model misses.",
            ),
            drawn(
                "survival", "How much of the level the error uses", ratio_survival.SHEET,
                lambda axes: ratio_survival.survival(evaluation, ax=axes[0]),
                "Share of epochs whose ratio of error to level is at or above each value.",
                "The distance between the foot of the curve and the line at 1 is the margin that "
                "was seen. Epochs are correlated: the curve describes, it does not extrapolate.",
            ),
            drawn(
                "availability", "Availability against alert limit",
                availability_against_limit.SHEET,
                lambda axes: availability_against_limit.availability_curve(evaluation, ax=axes[0]),
                "Availability against the alert limit on a log scale of unavailability.",
                f"Each tick upwards is ten times less time without service; 100 % means that none "
                f"of {count(evaluation.epochs)} epochs was lost. The distance from open to filled "
                f"marks is what gaps cost.",
            ),
            drawn(
                "rates", "Rate of events against alert limit", rates_against_limit.SHEET,
                lambda axes: rates_against_limit.rate_curve(evaluation, ax=axes[0]),
                "Demonstrated, modelled and claimed rates against the alert limit.",
                "At the stated confidence the true rate lies below the triangles. From there down "
                "to the dotted claim this recording proves nothing. Modelled rates, where given, "
                "hold as far as the error stays Gaussian. Bands: IEC 61508-1, 7.6.2.",
                wide=True,
            ),
        ),
    )  # fmt: skip
