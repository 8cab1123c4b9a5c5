"""Pictures of results: one function a picture; each draws what an analysis has found."""

from sbas.plots.architectures_against_target import architecture_ladder
from sbas.plots.autocorrelation_picture import decorrelation_curve
from sbas.plots.availability_against_limit import availability_curve
from sbas.plots.budget_picture import variance_budget
from sbas.plots.comparison_picture import pair_strips
from sbas.plots.environments_picture import environment_rates, environment_sizes
from sbas.plots.error_scatter import scatter
from sbas.plots.fault_tree_picture import tree_picture
from sbas.plots.importance_picture import importance_bars
from sbas.plots.k_against_tau_picture import k_curve
from sbas.plots.levels_picture import level_lines
from sbas.plots.messages_picture import message_timeline
from sbas.plots.plan_picture import ground_plan
from sbas.plots.probability_over_mission import probability_curve
from sbas.plots.rates_against_limit import rate_curve
from sbas.plots.ratio_survival import survival
from sbas.plots.recording_strips import strips
from sbas.plots.sky_picture import sky
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
    "ground_plan",
    "importance_bars",
    "k_curve",
    "level_lines",
    "message_timeline",
    "pair_strips",
    "probability_curve",
    "rate_curve",
    "scatter",
    "sky",
    "sojourn_survival",
    "stanford",
    "state_ribbon",
    "strips",
    "survival",
    "tail_plot",
    "threshold_stability",
    "tree_picture",
    "variance_budget",
]
