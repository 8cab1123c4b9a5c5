"""What was asked, and which software answered."""

from __future__ import annotations

import platform
from importlib.metadata import version

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
        ("merge time, rates", f"{s.merge_s:g} s", "closer events are one in a rate"),
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
