"""The verb on two recordings of the same epochs: compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.integrity.comparison.comparison import compare as compare_sources
from sbas.integrity.comparison.comparison_results import PAPER_TAU_S


def register(app: typer.Typer) -> None:
    app.command("compare")(compare)


@with_option_groups
def compare(
    a: Annotated[Path, typer.Argument(help="First recording, such as the one in PA mode.")],
    b: Annotated[Path, typer.Argument(help="Second recording of the same hours.")],
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    alert_limit: Annotated[str, typer.Option(help="Alert limits in metres.")] = "50,25,20",
    tau_s: Annotated[
        float, typer.Option("--tau-s", help="1/e time of what correlates epochs, in seconds.")
    ] = PAPER_TAU_S,
    confidence: Annotated[float, typer.Option(help="Of the two-sided intervals.")] = 0.95,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """PA or NPA, receiver 1 or 2? Positions, levels and availability at the same epochs.

    Example:  sbas compare pa.sbf npa.sbf --truth 50.03,15.77,289.4
    """
    first, second = (
        inputs.open_recording([path], truth, reading, repairing, quiet=quiet) for path in (a, b)
    )
    result = compare_sources(
        first.source,
        second.source,
        truth=first.truth,
        alert_limits_m=inputs.alert_limits(alert_limit),
        tau_s=tau_s,
        confidence=confidence,
        accept_findings=accept or (),
    )
    if json:
        output.print_json(result.to_dict())
    else:
        print(result)
