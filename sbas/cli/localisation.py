"""Verbs on the localisation unit: states of its receiver, and how dependable it is."""

from __future__ import annotations

import json as json_format
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.estimate import Refusal
from sbas.exceptions import InputError, SbasError
from sbas.numerals import number

if TYPE_CHECKING:
    from sbas.dependability import Dependability, ReceiverStates
    from sbas.dependability.exact.solution import Solution
    from sbas.dependability.simulation.agreement import Agreement

_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0, "": 1.0}


def register(app: typer.Typer) -> None:
    app.command("states")(states)
    app.command("depend")(depend)


@with_option_groups
def states(
    files: inputs.Files,
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    threshold_m: Annotated[
        float, typer.Option("--threshold-m", help="An error of this size or more is wrong.")
    ],
    boundary: Annotated[
        Literal["drop", "destination"],
        typer.Option(help="Of steps between two environments: not counted, or with the second."),
    ] = "drop",
    confidence: Annotated[float, typer.Option(help="Of the intervals.")] = 0.95,
    tail_runs: Annotated[int, typer.Option(help="Length of the runs in the tail test.")] = 6,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Receiver states for the fault tree: correct, wrong, missing, and how it moves among them.

    Example:  sbas states roof.sbf --truth 50.03,15.77,289.4 --threshold-m 50 --json > states.json
    """
    from sbas.dependability import receiver_states

    opened = inputs.open_recording(files, truth, reading, repairing, quiet=quiet)
    with output.progress("reading states", quiet) as callback:
        found = receiver_states(
            opened.source,
            truth=opened.truth,
            threshold_m=threshold_m,
            boundary=boundary,
            confidence=confidence,
            tail_runs=tail_runs,
            accept_findings=accept or (),
            progress=callback,
        )
    if json:
        output.print_json(found.to_dict())
        return
    print(found)
    output.print_findings(found.findings)


def depend(
    model: Annotated[
        str,
        typer.Argument(help="TOML, JSON, Open-PSA (.xml) or Galileo (.dft) file, or galoroi."),
    ],
    receiver: Annotated[
        Path | None, typer.Option(help="States of a recording (sbas states --json).")
    ] = None,
    environment: Annotated[
        str | None, typer.Option(help="Only this environment of the model, or of the states.")
    ] = None,
    semi_markov: Annotated[
        bool, typer.Option("--semi-markov", help="Of the states: their own laws of duration.")
    ] = False,
    estimate: Annotated[
        Literal["counts", "posterior"],
        typer.Option(help="Of the states: posterior makes nothing impossible that was not seen."),
    ] = "counts",
    mission: Annotated[str | None, typer.Option(help="Such as 1h, 30min, 3600s.")] = None,
    step: Annotated[str | None, typer.Option(help="Epoch, such as 1s.")] = None,
    first_passage: Annotated[
        bool, typer.Option("--first-passage", help="Also: at least once in the mission.")
    ] = False,
    check: Annotated[
        Literal["simulate"] | None,
        typer.Option(help="simulate: hold an independent simulation against the solution."),
    ] = None,
    histories: Annotated[int, typer.Option(min=1, help="Of that simulation.")] = 40_000,
    seed: Annotated[int, typer.Option(min=0, help="Of that simulation.")] = 20130701,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the model file."),
    ] = None,
    override_rules: Annotated[
        bool, typer.Option("--override-rules", help="Let parameters break the file's rules.")
    ] = False,
    time_unit: Annotated[
        Literal["s", "min", "h", "d", "y"] | None,
        typer.Option(help="Of the rates of a Galileo file."),
    ] = None,
    top: Annotated[str | None, typer.Option(help="Top gate of an Open-PSA file.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write the HTML report here.")] = None,
    json: output.Json = False,
) -> None:
    """How dependable is the localisation unit?

    Example:  sbas depend galoroi --environment urban --first-passage

    With a receiver of your own:  sbas depend galoroi --receiver states.json --mission 1h
    """
    from sbas.dependability import load_any, with_receiver
    from sbas.dependability.questions import depend as depend_on
    from sbas.dependability.questions import static_answer

    if report is not None:
        given = [Path(model), *([] if receiver is None else [receiver])]
        inputs.refuse_to_overwrite(report, given)
    loaded = load_any(
        model,
        environment=None if receiver is not None else environment,
        parameters=_parameters(parameter),
        override_rules=override_rules,
        step_s=_seconds(step, "--step"),
        mission_s=_seconds(mission, "--mission"),
        time_unit=time_unit,
        top=top,
    )
    losses = None if loaded.losses is None else str(loaded.losses)
    if loaded.static is not None:
        if report is not None:
            raise InputError(
                "a static tree has no report: its answer is one probability",
                where="--report", cure="the same call without --report",
            )  # fmt: skip
        plain = static_answer(loaded.static)
        if json:
            output.print_json({**plain, "losses": losses})
        else:
            print(f"{plain['model']}: static tree, exact by a binary decision diagram")
            print(f"P({plain['top']['name']}) = {plain['top']['at_end']!r}")
            _print_losses(losses)
        return
    models = dict(loaded.models)
    states = None if receiver is None else _states_of(receiver)
    if states is not None:
        first = next(iter(models.values()))
        models = {
            environment or "recording": with_receiver(
                first,
                states,
                environment=environment,
                semi_markov=semi_markov,
                estimate=estimate,
            )
        }
    answer = depend_on(
        models,
        first_passage=first_passage,
        simulate=histories if check == "simulate" else 0,
        seed=seed,
    )
    findings = list(dict.fromkeys([*loaded.findings, *answer.findings]))
    page = None
    if report is not None:
        page = _write_report(replace(answer, findings=tuple(findings)), report, states)
    if json:
        output.print_json(
            answer.to_dict()
            | {"findings": [f.to_dict() for f in findings], "losses": losses}
            | {"report": None if page is None else str(page)}
        )
    else:
        for name, solution in answer.solutions.items():
            _print_solution(solution, answer.agreements.get(name))
        output.print_findings(findings)
        _print_losses(losses)
        if page is not None:
            print(f"\nreport  {page}")
    if not answer.agrees:
        raise typer.Exit(1)


def _write_report(answer: Dependability, path: Path, states: ReceiverStates | None) -> Path:
    """The page; importance of one environment only, since it solves the model many times."""
    from sbas.dependability.analysis.importance import Importances, importance
    from sbas.reporting import dependability_report  # drawing is loaded only where used

    found: Importances | Refusal | None = None
    if len(answer.solutions) == 1:
        (solution,) = answer.solutions.values()
        try:
            found = importance(solution.model)
        except SbasError as error:
            found = Refusal(error.what, error.cure or "another model")
    return dependability_report(answer, path, states=states, importances=found)


def _print_solution(solution: Solution, agreement: Agreement | None) -> None:
    model = solution.model
    print(f"{model.name}: {model.mission_s:g} s in epochs of {model.step_s:g} s, exact")
    table = Table(box=box.SIMPLE, pad_edge=False)
    heads = ("event", "mean", "at the end", "at least once", "times per hour", "lasts [s]")
    for head in heads:
        table.add_column(escape(head), justify="left" if head == "event" else "right")
    for row in solution.rows.values():
        once, lasts = row.at_least_once, row.mean_duration_s
        label = f"[bold]{escape(row.name)}[/bold]" if row.name == model.top else escape(row.name)
        table.add_row(
            label, number(row.mean_unavailability, 5), number(row.at_end, 5),
            "-" if once is None else number(once, 5),
            number(solution.occurrences_per_h(row.name), 5),
            "-" if lasts is None else number(lasts, 4),
        )  # fmt: skip
    output.console().print(table)
    print("mean: share of the mission; times per hour: to compare with a tolerable hazard rate")
    for note in model.notes:
        print(f"note  {note}")
    if agreement is not None:
        tested = sum(c.verdict != "not tested" for c in agreement.comparisons)
        words = "agrees" if agreement.agrees else "DISAGREES" if tested else "COULD TEST NOTHING"
        print(f"simulation of {agreement.histories:,} histories {words}: {tested} of "
              f"{len(agreement.comparisons)} figures tested, |z| below "
              f"{agreement.limit:.2f}")  # fmt: skip


def _print_losses(losses: str | None) -> None:
    if losses:
        print(losses)


def _parameters(given: list[str] | None) -> dict[str, float] | None:
    if given is None:
        return None
    found: dict[str, float] = {}
    for text in given:
        name, equals, value = text.partition("=")
        try:
            found[name.strip()] = int(value) if value.strip().isdecimal() else float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError(
                "a parameter is set as NAME=VALUE", evidence=f"--set {text}", cure="--set k=6"
            )
    return found


def _seconds(text: str | None, option: str) -> float | None:
    if text is None:
        return None
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(s|min|h|d|)\s*", text)
    try:
        value = float(match[1]) * _SECONDS[match[2]] if match else 0.0
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise InputError(
            f"{option} is a time above 0", evidence=f"got {text!r}", cure=f"{option} 1h"
        )
    return value


def _states_of(path: Path) -> ReceiverStates:
    from sbas.dependability import ReceiverStates

    try:
        plain = json_format.loads(path.read_bytes())
    except ValueError as error:
        raise InputError(
            "the receiver's states are no JSON", where=str(path), evidence=str(error)[:120],
            cure="sbas states FILE --threshold-m 50 --json > states.json",
        ) from error  # fmt: skip
    return ReceiverStates.from_dict(plain)
