"""A laboratory recording from a documented model, for demonstrations and coverage tests."""

from __future__ import annotations

from sbas.laboratory.settings import LaboratorySettings, bundled_settings, load_settings
from sbas.laboratory.simulation import simulate, simulate_pieces

__all__ = [
    "LaboratorySettings",
    "bundled_settings",
    "load_settings",
    "simulate",
    "simulate_pieces",
]
