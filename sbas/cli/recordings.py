"""Verbs that make and look at recordings: check, simulate, demo."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.cli.writing import write_recording
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import CheckResult, accept, check, fix
from sbas.logs.registry import read
from sbas.recording import Recording
from sbas.timescales import NS_PER_S
from sbas.truth import FixedPoint

if TYPE_CHECKING:
    from sbas.laboratory import LaboratorySettings


def register(app: typer.Typer) -> None:
    app.command("demo")(demo)
    app.command("simulate")(simulate)
    app.command("check")(check_files)


@with_option_groups
def check_files(
    files: inputs.Files,
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    fix_out: Annotated[
        Path | None,
        typer.Option(
            "--fix",
            metavar="OUT.parquet",
            help="Make every repair that is beyond doubt as well, and write the recording here; "
            "its metadata list the repairs.",
        ),
    ] = None,
    accepted: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Can I trust this input? What is wrong with it, where, and the cure.

    Example:  sbas check roof.sbf --fix roof-repaired.parquet
    """
    if fix_out is not None:
        inputs.refuse_to_overwrite(fix_out, [*files, truth.truth])
        if fix_out.suffix.lower() != ".parquet":
            raise InputError(
                f"--fix {fix_out.name} would lose the list of repairs",
                cure="name a .parquet file: only it keeps metadata",
            )
    try:
        opened = inputs.open_recording(
            files, truth, reading, repairing, quiet=quiet, whole=fix_out is not None
        )
    except InputError as error:
        # What cannot be read is the plainest finding of all; programs get it as one.
        if json and error.code:
            finding = Finding(
                error.code, "error", error.what, error.where, error.evidence, error.cure
            )
            output.print_json({"epochs": 0, "format": None, "findings": [finding.to_dict()]})
        raise
    made = False
    if fix_out is None:
        result = check(opened.source, truth=opened.truth)
    else:
        assert isinstance(opened.source, Recording)
        recording, result = fix(opened.source, truth=opened.truth)
        write_recording(fix_out, [recording])
        made = recording.meta.options.get("repairs") != opened.source.meta.options.get("repairs")
    result = replace(result, findings=accept(result.findings, accepted or ()))
    if json:
        written = {} if fix_out is None else {"file": str(fix_out)}
        output.print_json({**result.to_dict(), **written})
    else:
        _print_check(result)
        if fix_out is not None:
            print(f"\n{'repaired ' if made else 'nothing repaired; a copy is'} {fix_out}")
    if not result.usable:
        raise typer.Exit(2)


def _print_check(result: CheckResult) -> None:
    survey = result.survey
    print(f"{result.epochs:,} epochs read as {result.format}")
    if survey.epochs > 1:
        span = np.array([survey.begin_ns, survey.end_ns]).astype("M8[ns]").astype("M8[s]")
        print(f"{span[0]} to {span[1]} GPST, every {survey.interval_ns / NS_PER_S:g} s")
        print(f"{survey.levels:,} epochs with HPL, {survey.positions:,} with position")
    output.print_findings(result.findings)
    if not result.findings:
        print("no finding")
    print("usable" if result.usable else "not usable as it is: see the cures above")


def simulate(
    out: Annotated[Path, typer.Option(help="File to write: .sbf or .parquet.")],
    hours: Annotated[float | None, typer.Option(help="Length of the recording in hours.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all randomness.")] = None,
    settings: Annotated[
        Path | None, typer.Option(help="TOML settings; without, those of the demo.")
    ] = None,
    failure_rate_per_h: Annotated[
        float | None, typer.Option(help="Rate of injected dangerous failures per hour.")
    ] = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Make a laboratory recording with known errors.

    Example:  sbas simulate --hours 24 --seed 7 --out lab.sbf
    """
    from sbas.laboratory import bundled_settings, load_settings

    chosen = bundled_settings() if settings is None else load_settings(settings)
    if hours is not None:
        chosen = replace(chosen, hours=hours)
    if seed is not None:
        chosen = replace(chosen, seed=seed)
    if failure_rate_per_h is not None:
        chosen = replace(chosen, failure_rate_per_h=failure_rate_per_h)
    epochs = write_simulation(chosen, out, quiet=quiet)
    truth = f"{chosen.lat_deg},{chosen.lon_deg},{chosen.height_m}"
    if json:
        output.print_json({"epochs": epochs, "file": str(out), "truth": truth})
    else:
        print(f"{epochs:,} epochs in {out}; evaluate them with\n"
              f"  sbas evaluate {out} --truth {truth}")  # fmt: skip


def write_simulation(settings: LaboratorySettings, out: Path, *, quiet: bool) -> int:
    """Write a simulated recording piece by piece; the number of epochs written."""
    from sbas.laboratory import simulate_pieces

    epochs = 0
    with output.progress(f"simulating {out.name}", quiet) as callback:

        def counted() -> Iterator[Recording]:
            nonlocal epochs
            for piece in simulate_pieces(settings):
                epochs += len(piece)
                yield piece
                if callback is not None:
                    callback(epochs, settings.epochs)

        write_recording(out, counted())
    return epochs


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the recording and its report.")] = Path(
        "sbas-demo"
    ),
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Show me the whole chain on the bundled 3.5-day laboratory recording.

    Example:  sbas demo --out demo
    """
    # Analyses and drawing are loaded only where they are used.
    from sbas.cli.evaluation import likely_causes, print_verdict, range_monitoring
    from sbas.integrity.evaluation import evaluate
    from sbas.laboratory import bundled_settings
    from sbas.reporting import report

    settings = bundled_settings()
    recording = out / "laboratory_2009.sbf"
    write_simulation(settings, recording, quiet=quiet)
    with output.progress(f"reading {recording.name}", quiet) as callback:
        source = read(recording, progress=callback)
    truth = FixedPoint(
        settings.lat_deg, settings.lon_deg, settings.height_m, frame="WGS 84, simulated"
    )
    with output.progress("evaluating", quiet) as callback:
        evaluation = evaluate(source, truth=truth, progress=callback)
    causes = likely_causes(source, evaluation, truth=truth)
    monitored = range_monitoring(source, evaluation)
    page = report(evaluation, out / "report.html", causes=causes, raim=monitored)
    if json:
        output.print_json({"report": str(page), "recording": str(recording)})
        return
    print_verdict(evaluation)
    print(f"\nrecording  {recording}\nreport     {page}  (open it in a browser)")
