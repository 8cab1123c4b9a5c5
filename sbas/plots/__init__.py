"""Pictures of results: one function a picture; each draws what an analysis has found."""

from sbas.plots.architectures_against_target import architecture_ladder
from sbas.plots.autocorrelation_picture import decorrelation_curve
from sbas.plots.availability_against_limit import availability_curve
from sbas.plots.comparison_picture import pair_strips
from sbas.plots.environments_picture import environment_rates, environment_sizes
from sbas.plots.error_scatter import scatter
from sbas.plots.fault_tree_picture import tree_picture
from sbas.plots.importance_picture import importance_bars
from sbas.plots.k_against_tau_picture import k_curve
from sbas.plots.probability_over_mission import probability_curve
from sbas.plots.rates_against_limit import rate_curve
from sbas.plots.ratio_survival import survival
from sbas.plots.recording_strips import strips
from sbas.plots.sojourn_picture import sojourn_survival
from sbas.plots.stanford_diagram import stanford
from sbas.plots.states_over_time import state_ribbon
from sbas.plots.tail_picture import tail_plot, threshold_stability

__all__ = [
    "architecture_ladder",
    "availability_curve",
    "decorrelation_curve",
    "environment_rates",
    "environment_sizes",
    "importance_bars",
    "k_curve",
    "pair_strips",
    "probability_curve",
    "rate_curve",
    "scatter",
    "sojourn_survival",
    "stanford",
    "state_ribbon",
    "strips",
    "survival",
    "tail_plot",
    "threshold_stability",
    "tree_picture",
]
