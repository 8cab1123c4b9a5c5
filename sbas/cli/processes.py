"""Verbs on the process behind the errors: decorrelation."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.estimate import Refusal
from sbas.integrity.correlation.correlation import decorrelation as decorrelation_of_source


def register(app: typer.Typer) -> None:
    app.command("decorrelation")(decorrelation)


@with_option_groups
def decorrelation(
    files: inputs.Files,
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    segments: Annotated[
        str | None,
        typer.Option(help="'environment', or seconds: one further result a label or a piece."),
    ] = None,
    confidence: Annotated[float, typer.Option(help="Of the two-sided interval.")] = 0.95,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """How long do errors stay correlated, and does that agree with the 360 s of K = 6.18?

    Example:  sbas decorrelation roof.sbf --truth 50.03,15.77,289.4
    """
    opened = inputs.open_recording(files, truth, reading, repairing, quiet=quiet)
    result = decorrelation_of_source(
        opened.source,
        truth=opened.truth,
        segments=_segments(segments),
        confidence=confidence,
        accept_findings=accept or (),
    )
    if json:
        output.print_json(result.to_dict())
    else:
        print(result)
    if isinstance(result.tau_s, Refusal) and any(f.severity == "error" for f in result.findings):
        raise typer.Exit(2)


def _segments(text: str | None) -> Literal["environment"] | float | None:
    if text is None or text == "environment":
        return text  # type: ignore[return-value]
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter("--segments is 'environment' or a number of seconds") from None
