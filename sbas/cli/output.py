"""How answers and progress are shown: text for people, one JSON object for programs."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from sbas.findings import Finding
from sbas.logs.format import Progress as ProgressCallback

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress on standard error.")]


def print_json(answer: dict[str, Any]) -> None:
    """One JSON object with full precision; what is not a finite number is null."""
    print(json.dumps(_plain(answer), indent=2, allow_nan=False, default=str))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def print_findings(findings: Iterable[Finding]) -> None:
    """Findings as text, the errors first."""
    order = ("error", "warning", "info")
    for finding in sorted(findings, key=lambda f: order.index(f.severity)):
        print(finding)


def console() -> Console:
    """Standard output; tables keep their columns in a pipe too."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 110)


@contextmanager
def progress(label: str, quiet: bool) -> Iterator[ProgressCallback | None]:
    """A progress bar on standard error, only on a terminal and unless silenced."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=max(total, 1))
