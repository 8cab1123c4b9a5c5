"""Integrity from redundant ranges alone: RAIM, external reliability and ARAIM."""

from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels, araim_modes
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.level_comparison import raim_against_sbas
from sbas.monitoring.range_faults import injected_faults
from sbas.monitoring.receiver_flags import with_raim_flags
from sbas.monitoring.recorded_araim import araim_of_recording
from sbas.monitoring.recording_monitor import raim

__all__ = [
    "AraimGeometry",
    "AraimSettings",
    "araim_levels",
    "araim_modes",
    "araim_of_recording",
    "injected_faults",
    "raim",
    "raim_against_sbas",
    "with_raim_flags",
]
