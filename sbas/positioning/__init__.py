"""From ranges and corrections to positions, geometry and protection levels."""

from sbas.positioning.protected_recording import protect
from sbas.positioning.receiver_noise import CLASS_1, CLASS_2, ReceiverNoise
from sbas.positioning.satellite_levels import levels_from_satellites
from sbas.positioning.satellite_subsets import StanfordEsa, stanford_esa
from sbas.positioning.unaugmented_recording import unaugmented

__all__ = [
    "CLASS_1",
    "CLASS_2",
    "ReceiverNoise",
    "StanfordEsa",
    "levels_from_satellites",
    "protect",
    "stanford_esa",
    "unaugmented",
]
