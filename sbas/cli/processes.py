"""Verbs on the process behind the errors: decorrelation."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from sbas.cli import inputs, output
from sbas.estimate import Refusal
from sbas.integrity.correlation.correlation import decorrelation as decorrelation_of_source


def register(app: typer.Typer) -> None:
    app.command("decorrelation")(decorrelation)


def decorrelation(
    files: inputs.Files,
    truth: inputs.TruthText = None,
    segments: Annotated[
        str | None,
        typer.Option(help="'environment', or seconds: one further result a label or a piece."),
    ] = None,
    confidence: Annotated[float, typer.Option(help="Of the two-sided interval.")] = 0.95,
    frame: inputs.Frame = "",
    antenna_height: inputs.AntennaHeight = 0.0,
    truth_max_step: inputs.MaxStep = 1.0,
    accept: inputs.Accept = None,
    format_name: inputs.FormatName = None,
    time_scale: inputs.TimeScaleName = None,
    mode_map: inputs.ModeMap = None,
    geoid: inputs.Geoid = None,
    sort: inputs.Sort = False,
    duplicates: inputs.Duplicates = None,
    pl_zero: inputs.PlZero = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """How long do errors stay correlated, and does that agree with the 360 s of K = 6.18?

    Example:  sbas decorrelation roof.sbf --truth 50.03,15.77,289.4
    """
    known = inputs.open_truth(
        truth,
        frame=frame,
        antenna_height_m=antenna_height,
        max_step_s=truth_max_step,
        time_scale=time_scale,
        geoid=geoid,
    )
    source = inputs.open_source(
        files,
        format_name=format_name,
        time_scale=time_scale,
        mode_map=mode_map,
        geoid=geoid,
        sort=sort,
        duplicates=duplicates,
        pl_zero=pl_zero,
        quiet=quiet,
    )
    result = decorrelation_of_source(
        source,
        truth=known,
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
