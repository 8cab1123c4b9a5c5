"""The self-contained HTML report of a result."""

from sbas.reporting.causal_report import causal_report, causal_report_of
from sbas.reporting.dependability_report import dependability_report, dependability_report_of
from sbas.reporting.document import Report, render_html, report, report_of

__all__ = [
    "Report",
    "causal_report",
    "causal_report_of",
    "dependability_report",
    "dependability_report_of",
    "render_html",
    "report",
    "report_of",
]
