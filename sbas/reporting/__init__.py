"""The self-contained HTML report of a result."""

from sbas.reporting.document import Report, render_html, report, report_of

__all__ = ["Report", "render_html", "report", "report_of"]
