"""RINEX observations and navigation, as arrays."""

from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observation_file import read_observations

__all__ = ["read_navigation", "read_observations"]
