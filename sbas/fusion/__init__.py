"""Causal analysis of multisensor positioning: which sensor faults matter, and how fast."""
