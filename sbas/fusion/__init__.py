"""Causal analysis of multisensor positioning: which sensor faults matter, and how fast."""

from sbas.fusion.architecture.architecture_fields import to_table as architecture_table
from sbas.fusion.architecture.architecture_files import (
    architecture_text,
    load_architecture,
    presets,
)
from sbas.fusion.architecture.model import Architecture
from sbas.fusion.causal_analysis import CausalAnalysis, multisensor
from sbas.fusion.simulation.simulated_runs import simulate_runs

__all__ = [
    "Architecture",
    "CausalAnalysis",
    "architecture_table",
    "architecture_text",
    "load_architecture",
    "multisensor",
    "presets",
    "simulate_runs",
]
