"""Pictures of results: one function a picture; each draws what an analysis has found."""

from sbas.plots.architectures_against_target import architecture_ladder
from sbas.plots.autocorrelation_picture import decorrelation_curve
from sbas.plots.availability_against_limit import availability_curve
from sbas.plots.budget_picture import variance_budget
from sbas.plots.combination_picture import combination_ribbon
from sbas.plots.comparison_picture import pair_strips
from sbas.plots.decision_tree_picture import decision_tree
from sbas.plots.environments_picture import environment_rates, environment_sizes
from sbas.plots.error_scatter import scatter
from sbas.plots.fault_tree_picture import tree_picture
from sbas.plots.importance_picture import importance_bars
from sbas.plots.incidence_picture import incidence_curve
from sbas.plots.k_against_tau_picture import k_curve
from sbas.plots.levels_picture import level_lines
from sbas.plots.messages_picture import message_timeline
from sbas.plots.plan_picture import ground_plan
from sbas.plots.probability_over_mission import probability_curve
from sbas.plots.raim_availability_picture import raim_availability
from sbas.plots.raim_levels_picture import raim_level_ratios, raim_levels
from sbas.plots.range_faults_picture import range_faults
from sbas.plots.rates_against_limit import rate_curve
from sbas.plots.ratio_survival import survival
from sbas.plots.recording_strips import strips
from sbas.plots.sky_picture import sky
from sbas.plots.sojourn_picture import sojourn_survival
from sbas.plots.stanford_diagram import stanford
from sbas.plots.state_importance_picture import sensitivity_bars, state_importance_bars
from sbas.plots.states_over_time import state_ribbon
from sbas.plots.tail_picture import tail_plot, threshold_stability

__all__ = [
    "architecture_ladder",
    "availability_curve",
    "combination_ribbon",
    "decision_tree",
    "decorrelation_curve",
    "environment_rates",
    "environment_sizes",
    "ground_plan",
    "importance_bars",
    "incidence_curve",
    "k_curve",
    "level_lines",
    "message_timeline",
    "pair_strips",
    "probability_curve",
    "raim_availability",
    "raim_level_ratios",
    "raim_levels",
    "range_faults",
    "rate_curve",
    "scatter",
    "sensitivity_bars",
    "sky",
    "sojourn_survival",
    "stanford",
    "state_importance_bars",
    "state_ribbon",
    "strips",
    "survival",
    "tail_plot",
    "threshold_stability",
    "tree_picture",
    "variance_budget",
]
