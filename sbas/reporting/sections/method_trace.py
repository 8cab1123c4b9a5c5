"""From every figure to the function that made it and the source of its method."""

from __future__ import annotations

from typing import NamedTuple

from sbas.integrity.results import Evaluation
from sbas.reporting.content import Cell, Section, table


class Method(NamedTuple):
    """A figure, the importable function behind it and the method's source."""

    key: str
    figure: str
    function: str
    source: str


METHODS = (
    Method("errors", "HPE, VPE, mean error", "sbas.integrity.position_error.position_errors",
           "RTCA DO-229D, 1.7.2; local tangent plane at the truth (WGS 84 ellipsoid)"),
    Method("levels", "HPL, VPL: min, median, 95 %, max", "sbas.streaming.Distribution.quantile",
           "levels as reported by the receiver; order statistics, linear between them"),
    Method("ellipse", "error ellipse", "sbas.integrity.results.ErrorEllipse.axes",
           "eigenvalues of the covariance of the horizontal error; 95 %: K = sqrt(-2 ln 0.05)"),
    Method("sigma", "sigma_H (d_major)", "sbas.recording.major_semi_axis_m",
           "RTCA DO-229D, J.1: major semi-axis of the error ellipse"),
    Method("regions", "Stanford regions, MI epochs", "sbas.integrity.stanford.stanford_regions",
           "T. Walter, Stanford chart hplstat.m, 1998; ties to the unsafe side"),
    Method("events", "events and their durations", "sbas.integrity.events.find_events",
           "runs of epochs; merged, then held against the time to alert (Navipedia, EGNOS "
           "Performances: 10 s NPA, 6 s PA)"),
    Method("exposure", "exposure in hours", "sbas.integrity.evaluation.evaluate",
           "an epoch covers its step, at most the median one; gap: step above 1.5 median steps"),
    Method("rates", "demonstrated rate and its bound", "sbas.integrity.counting.poisson_bounds",
           "F. Garwood, Biometrika 28 (1936) 437"),
    Method("classes", "evidence classes, claimed rate",
           "sbas.integrity.rate_evidence.rate_evidence",
           "claim: Filip, Bazant, Mocek 2010, 2.1.2 and Fig. 2"),
    Method("modelled", "modelled rates", "sbas.integrity.modelled_rates.modelled_event_rate",
           "exponential tail of all exceedances (Hoyt 1947), Gauss-Markov clock"),
    Method("decorrelation", "decorrelation time and its interval",
           "sbas.integrity.correlation.correlation.decorrelation_of",
           "inversion of the estimator's simulated distribution; the question: Filip, Bazant, "
           "Mocek 2010, 2.1.2"),
    Method("k-models", "K under each process model",
           "sbas.integrity.exposure.exposure_models.k_models",
           "Filip, Bazant, Mocek 2010, 2.1.2; Siegmund 1985; Rice 1945"),
    Method("k-verdict", "verdict on K = 6.18", "sbas.integrity.exposure.k_verdicts.k_verdict",
           "chi-square interval of sigma; interval of tau"),
    Method("target", "verdict on the claim", "sbas.integrity.sil.meets",
           "upper bound below the claim; a tie is not demonstrated"),
    Method("sil", "SIL by the bound", "sbas.integrity.sil.sil_verdict",
           "IEC 61508-1, 7.6.2, high demand or continuous mode; half-open bands"),
    Method("plan", "hours that counting needs", "sbas.integrity.planning.plan_hours",
           "F. Garwood, Biometrika 28 (1936) 437; a year has 8766 h"),
    Method("availability", "availability, MTTF, MTTR",
           "sbas.integrity.availability.availability",
           "up time / total; MTTF, MTTR: EN 50126-1; bounds as for rates; share of time: block "
           "bootstrap (Politis and Romano 1992) or Clopper and Pearson 1934"),
    Method("continuity", "continuity risk", "sbas.integrity.availability.continuity_risk",
           "gLAB 6, definition; wording of Navipedia, EGNOS Performances"),
    Method("findings", "findings", "sbas.input_check.check",
           "thresholds in the finding's evidence and in the documentation of formats"),
)  # fmt: skip


def section(evaluation: Evaluation) -> Section:
    """The trace table; its rows are the targets of the links in the figures."""
    return Section(
        "trace",
        "Trace from figure to method",
        paragraphs=(
            "Each function's documentation gives the equation, its source and its units; the "
            "methods pages name the test that holds it against a value from elsewhere.",
        ),
        tables=(
            table(
                "Methods",
                "Figure|Function|Source",
                [
                    (
                        Cell(m.figure, anchor=f"trace-{m.key}"),
                        Cell(m.function, breaks=True),
                        m.source,
                    )
                    for m in METHODS
                ],
            ),
        ),
    )
