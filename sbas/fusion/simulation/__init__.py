"""Runs of an architecture: sensors drawn, missing data treated, fused."""
