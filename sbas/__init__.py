"""SBAS protection levels and integrity risk for railway signalling.

The questions are functions: `read` a recording, `check` it, `evaluate` it against a truth,
ask for its `failure_rate`, its `decorrelation` or a `k_factor`, `compare` two receivers,
`simulate` a laboratory and write a `report`; `receiver_states` of a recording feed a fault
tree, which says how far one may `depend` on a localisation unit; `multisensor` says which faults
of which sensors spoil the position of an architecture, and how fast.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from sbas.environment_labels import EnvironmentSegments, label_epochs, load_segments
from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError, ModelError, SbasError
from sbas.findings import Finding
from sbas.input_check import Repairs, check, repair
from sbas.logs import load_track, read, read_truth_table, scan
from sbas.recording import Recording, RecordingMeta
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory, transformed
from sbas.version import __version__

if TYPE_CHECKING:
    from sbas.augmentation import read_messages
    from sbas.dependability import depend, load_models, receiver_states
    from sbas.fusion import load_architecture, multisensor
    from sbas.integrity import (
        compare,
        decorrelation,
        evaluate,
        explain,
        failure_rate,
        k_factor,
        k_models,
        k_verdict,
        load_allocation,
        plan_hours,
        position_errors,
        railway_hpl,
    )
    from sbas.laboratory import simulate
    from sbas.monitoring import raim, raim_against_sbas, with_raim_flags
    from sbas.positioning import levels_from_satellites, protect, stanford_esa, unaugmented
    from sbas.reporting import report
    from sbas.rinex import read_navigation, read_observations

__all__ = [
    "EnvironmentSegments",
    "Estimate",
    "Finding",
    "FixedPoint",
    "InputError",
    "ModelError",
    "Recording",
    "RecordingMeta",
    "Refusal",
    "Repairs",
    "SbasError",
    "Track",
    "TrackLine",
    "Trajectory",
    "__version__",
    "check",
    "compare",
    "decorrelation",
    "depend",
    "evaluate",
    "explain",
    "failure_rate",
    "k_factor",
    "k_models",
    "k_verdict",
    "label_epochs",
    "levels_from_satellites",
    "load_allocation",
    "load_architecture",
    "load_models",
    "load_segments",
    "load_track",
    "multisensor",
    "plan_hours",
    "position_errors",
    "protect",
    "railway_hpl",
    "raim",
    "raim_against_sbas",
    "read",
    "read_messages",
    "read_navigation",
    "read_observations",
    "read_truth_table",
    "receiver_states",
    "repair",
    "report",
    "scan",
    "simulate",
    "stanford_esa",
    "transformed",
    "unaugmented",
    "with_raim_flags",
]

_LATER = {
    **dict.fromkeys(
        (
            "compare", "decorrelation", "evaluate", "explain", "failure_rate", "k_factor",
            "k_models", "k_verdict", "load_allocation", "plan_hours", "position_errors",
            "railway_hpl",
        ),
        "sbas.integrity",
    ),
    **dict.fromkeys(("depend", "load_models", "receiver_states"), "sbas.dependability"),
    **dict.fromkeys(("load_architecture", "multisensor"), "sbas.fusion"),
    "read_messages": "sbas.augmentation",
    **dict.fromkeys(
        ("levels_from_satellites", "protect", "stanford_esa", "unaugmented"), "sbas.positioning"
    ),
    **dict.fromkeys(("read_navigation", "read_observations"), "sbas.rinex"),
    **dict.fromkeys(("raim", "raim_against_sbas", "with_raim_flags"), "sbas.monitoring"),
    "simulate": "sbas.laboratory",
    "report": "sbas.reporting",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    # Analyses and drawing are loaded when the first of them is asked for: reading needs neither.
    if name in _LATER:
        return getattr(importlib.import_module(_LATER[name]), name)
    raise AttributeError(f"module 'sbas' has no attribute {name!r}")
