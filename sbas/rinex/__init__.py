"""RINEX observations and navigation, as arrays."""
