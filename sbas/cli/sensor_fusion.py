"""The verb on sensor architectures: multisensor."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.exceptions import InputError
from sbas.recording import Recording

if TYPE_CHECKING:
    from sbas.fusion import CausalAnalysis


def register(app: typer.Typer) -> None:
    app.command("multisensor")(multisensor_files)


@with_option_groups
def multisensor_files(
    model: Annotated[str, typer.Argument(help="Architecture (.toml), or a preset such as arch1.")],
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    runs: Annotated[int, typer.Option(min=2, help="Runs to simulate.")] = 2000,
    seed: Annotated[int, typer.Option(min=0, help="Of runs and intervals.")] = 0,
    recording: Annotated[
        list[Path] | None,
        typer.Option(help="Recording whose errors stand for the receiver; needs --truth."),
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(help="Direction of the track beside a standing antenna, in degrees."),
    ] = None,
    direction_above: Annotated[
        float | None,
        typer.Option(help="Take the direction of a trajectory above this speed, in m/s."),
    ] = None,
    receiver: Annotated[
        str | None, typer.Option(help="Sensor that the recording stands for, of several.")
    ] = None,
    resampling: Annotated[
        Literal["replay", "block_bootstrap"],
        typer.Option(help="Draw windows of the recording, or blocks of it."),
    ] = "replay",
    accept: inputs.Accept = None,
    target: Annotated[
        Literal["U", "DA"], typer.Option(help="Output state whose reaching is the event.")
    ] = "U",
    describe: Annotated[
        bool, typer.Option("--describe", help="Print the architecture and stop.")
    ] = False,
    tree: Annotated[
        Path | None, typer.Option(help="Write the fault tree for sbas depend: .json.")
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write the HTML report here.")] = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Which sensor faults matter, and how fast do they spoil the position?

    Example:  sbas multisensor arch1 --runs 20000 --report arch1.html

    With a receiver of your own:  sbas multisensor arch1 --recording roof.sbf
    --truth 50.03,15.77,289.4 --azimuth 90
    """
    from sbas.fusion import architecture_text, load_architecture, multisensor

    _check_outputs(tree, report, [model, *(recording or ()), truth.truth, truth.track,
                                  truth.environments])  # fmt: skip
    architecture = load_architecture(model)
    if describe:
        if json:
            from sbas.fusion import architecture_table

            output.print_json(architecture_table(architecture))
        else:
            print(architecture_text(architecture), end="")
        return
    opened = None
    if recording:
        opened = inputs.open_recording(
            recording, truth, reading, repairing, quiet=quiet, whole=True
        )
    elif (azimuth, direction_above, receiver, accept) != (
        None,
    ) * 4 or truth != inputs.TruthGiven():
        raise InputError(
            "a truth, track or direction without a recording",
            cure="--recording FILE --truth LAT,LON,H --azimuth DEGREES",
        )
    source = None if opened is None else opened.source
    # A source that streams would leave the receiver to its model, unseen.
    assert source is None or isinstance(source, Recording)
    with output.progress("simulating", quiet) as callback:
        found = multisensor(
            architecture,
            runs=runs,
            seed=seed,
            recording=source,
            truth=None if opened is None else opened.truth,
            track=None if opened is None else opened.track,
            azimuth_deg=azimuth,
            direction_above_mps=direction_above,
            receiver=receiver,
            resampling=resampling,
            target=target,
            accept_findings=accept or (),
            progress=callback,
        )
    if tree is not None:
        _write_tree(found, tree)
    page = None
    if report is not None:
        from sbas.reporting import causal_report  # drawing is loaded only where used

        page = causal_report(found, report)
    files = {"tree": tree, "report": page}
    if json:
        output.print_json(
            found.to_dict() | {k: None if v is None else str(v) for k, v in files.items()}
        )
        return
    print(found)
    for name, path in files.items():
        if path is not None:
            print(f"{name}  {path}")


def _check_outputs(tree: Path | None, report: Path | None, given: list[Path | str | None]) -> None:
    """Refuse before a long simulation what could not be written, or not be read again, after it."""
    for out in (tree, report):
        if out is not None:
            inputs.refuse_to_overwrite(out, given)
            if not out.absolute().parent.is_dir():
                raise InputError("no such folder to write to", where=str(out),
                                 cure="name a file in a folder that exists")  # fmt: skip
    if tree is not None and tree.suffix != ".json":
        raise InputError(
            "sbas depend knows a fault tree by its ending", where=f"--tree {tree}",
            cure=f"--tree {tree.with_suffix('.json')}",
        )  # fmt: skip
    if tree is not None and report is not None and tree.resolve() == report.resolve():
        raise InputError("fault tree and report in one file", where=str(tree),
                         cure="name two files")  # fmt: skip


def _write_tree(found: CausalAnalysis, path: Path) -> None:
    from sbas.dependability.tree.model_fields import to_table

    text = json_format.dumps(to_table(found.fault_tree()), indent=1)
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(
            "the fault tree cannot be written", where=str(path),
            evidence=error.strerror or str(error), cure="name a file in a folder that exists",
        ) from error  # fmt: skip
