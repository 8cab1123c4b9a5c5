"""Recordings as sensors, and states as events of a fault tree."""
