"""SBAS protection levels and integrity risk for railway signalling.

The questions are functions: `read` a recording, `check` it, `evaluate` it against a truth,
ask for its `failure_rate`, a `k_factor` or the hours to `plan_hours`, `simulate` a laboratory
and write a `report`.
"""

from __future__ import annotations

from typing import Any

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError, ModelError, SbasError
from sbas.findings import Finding
from sbas.input_check import check, repair
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
from sbas.logs import read, read_truth_table, scan
from sbas.recording import Recording, RecordingMeta
from sbas.truth import FixedPoint, Trajectory
from sbas.version import __version__

__all__ = [
    "Estimate",
    "Finding",
    "FixedPoint",
    "InputError",
    "ModelError",
    "Recording",
    "RecordingMeta",
    "Refusal",
    "SbasError",
    "Trajectory",
    "__version__",
    "check",
    "compare",
    "decorrelation",
    "evaluate",
    "explain",
    "failure_rate",
    "k_factor",
    "k_models",
    "k_verdict",
    "load_allocation",
    "plan_hours",
    "position_errors",
    "railway_hpl",
    "read",
    "read_truth_table",
    "repair",
    "report",
    "scan",
    "simulate",
]


def __getattr__(name: str) -> Any:
    # Drawing is loaded when the first report is asked for: `import sbas` stays light.
    if name == "report":
        from sbas.reporting import report

        return report
    raise AttributeError(f"module 'sbas' has no attribute {name!r}")
