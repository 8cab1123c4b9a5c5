"""The self-contained HTML report of a result."""

from sbas.reporting.dependability_report import dependability_report, dependability_report_of
from sbas.reporting.document import Report, render_html, report, report_of

__all__ = [
    "Report",
    "dependability_report",
    "dependability_report_of",
    "render_html",
    "report",
    "report_of",
]
