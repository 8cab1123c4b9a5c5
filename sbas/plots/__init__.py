"""Pictures of results: one function a picture; each draws what an analysis has found."""

from sbas.plots.autocorrelation_picture import decorrelation_curve
from sbas.plots.availability_against_limit import availability_curve
from sbas.plots.comparison_picture import pair_strips
from sbas.plots.error_scatter import scatter
from sbas.plots.k_against_tau_picture import k_curve
from sbas.plots.rates_against_limit import rate_curve
from sbas.plots.ratio_survival import survival
from sbas.plots.recording_strips import strips
from sbas.plots.stanford_diagram import stanford
from sbas.plots.tail_picture import tail_plot, threshold_stability

__all__ = [
    "availability_curve",
    "decorrelation_curve",
    "k_curve",
    "pair_strips",
    "rate_curve",
    "scatter",
    "stanford",
    "strips",
    "survival",
    "tail_plot",
    "threshold_stability",
]
