"""Pictures of results: one function a picture; each draws what an analysis has found."""

from sbas.plots.availability_against_limit import availability_curve
from sbas.plots.error_scatter import scatter
from sbas.plots.rates_against_limit import rate_curve
from sbas.plots.ratio_survival import survival
from sbas.plots.recording_strips import strips
from sbas.plots.stanford_diagram import stanford

__all__ = ["availability_curve", "rate_curve", "scatter", "stanford", "strips", "survival"]
