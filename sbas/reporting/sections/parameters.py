"""What was asked, and which software answered."""

from __future__ import annotations

import platform
from importlib.metadata import version

from sbas.estimate import Refusal
from sbas.integrity.results import Evaluation
from sbas.numerals import percent
from sbas.reporting.content import Cell, Section, table

SOFTWARE = ("sbas", "numpy", "scipy", "pandas", "matplotlib")


def section(evaluation: Evaluation) -> Section:
    """Settings with their meaning, reader options, and versions."""
    s = evaluation.settings
    rows: list[tuple[Cell | str, ...]] = [
        ("alert limits", ", ".join(f"{al:g}" for al in s.alert_limits_m) + " m", "horizontal"),
        ("time to alert", f"{s.time_to_alert_s:g} s", "an HMI event lasts at least this"),
        ("merge time, rates", f"{evaluation.merge_s:.4g} s", _merge_words(evaluation)),
        ("merge time, event list", f"{s.reset_s:g} s", "reset time of the user system"),
        ("confidence", f"{percent(s.confidence)}", "of every one-sided bound"),
        ("findings accepted", ", ".join(s.accept) or "none", "errors taken as warnings"),
    ]
    rows += [(f"option {name}", value, "of the reader or generator") for name, value in
             sorted(evaluation.meta.options.items())]  # fmt: skip
    versions: list[tuple[Cell | str, ...]] = [("Python", platform.python_version(), "report")]
    versions += [(name, version(name), "report") for name in SOFTWARE]
    versions += [(name, value, "reading") for name, value in
                 sorted(evaluation.meta.versions.items())]  # fmt: skip
    return Section(
        "parameters",
        "Parameters and software",
        tables=(
            table("Parameters", "Parameter|Value|Meaning", rows),
            table("Software", "Program|Version|Used for", versions),
        ),
    )


def _merge_words(evaluation: Evaluation) -> str:
    if evaluation.settings.merge_s is not None:
        return "closer events are one in a rate"
    if isinstance(evaluation.process.decorrelation.tau_s, Refusal):
        return "closer events are one in a rate; 60 s, no decorrelation time is known"
    return "closer events are one in a rate; max(tau/2, 60 s) of the measured tau"
