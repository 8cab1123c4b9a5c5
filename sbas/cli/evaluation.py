"""Verbs that judge a recording: evaluate and rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from sbas.cli import inputs, output
from sbas.cli.option_groups import with_option_groups
from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.input_check import accept as accepted
from sbas.integrity.causes.causes import Causes, explain
from sbas.integrity.epoch_levels import whole_table
from sbas.integrity.evaluation import evaluate
from sbas.integrity.failure_rates import FailureRate, failure_rate
from sbas.integrity.rate_evidence import EVENT_KINDS
from sbas.integrity.results import Evaluation, EvaluationSettings
from sbas.numerals import percent, share, upward
from sbas.recording import EpochSource, Recording
from sbas.truth import Truth

if TYPE_CHECKING:
    from sbas.monitoring.level_comparison import LevelComparison

MOST_EXPLAINED = 5_000_000
"""Longer records are not explained in a report: their columns would have to be in memory."""

_RECEIVERS_RAIM = ("hpl_m", "hdop", "herl_m", "verl_m", "flags", "n_sv", "mode")

_DEFAULTS = EvaluationSettings()

TimeToAlert = Annotated[
    float, typer.Option("--time-to-alert", help="Shortest HMI event, in seconds.")
]
Merge = Annotated[
    float | None,
    typer.Option("--merge", help="Closer events are one; in seconds. Else max(tau/2, 60 s)."),
]
Reset = Annotated[
    float,
    typer.Option("--reset", help="Merge time of the event list, in seconds."),
]
Confidence = Annotated[float, typer.Option(help="Confidence of one-sided bounds.")]


def register(app: typer.Typer) -> None:
    app.command("evaluate")(evaluate_files)
    app.command("rate")(rate)


@with_option_groups
def evaluate_files(
    files: inputs.Files,
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    alert_limit: Annotated[str, typer.Option(help="Alert limits in metres.")] = "50,25,20",
    report: Annotated[Path | None, typer.Option(help="Write the HTML report here.")] = None,
    time_to_alert: TimeToAlert = _DEFAULTS.time_to_alert_s,
    merge: Merge = _DEFAULTS.merge_s,
    reset: Reset = _DEFAULTS.reset_s,
    confidence: Confidence = _DEFAULTS.confidence,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Errors, Stanford regions, events, availability and rates.

    Example:  sbas evaluate roof.sbf --truth 50.03,15.77,289.4 --report roof.html
    """
    limits = inputs.alert_limits(alert_limit)
    if report is not None:
        inputs.refuse_to_overwrite(report, [*files, truth.truth])
    opened = inputs.open_recording(files, truth, reading, repairing, quiet=quiet)
    with output.progress("evaluating", quiet) as callback:
        result = evaluate(
            opened.source,
            truth=opened.truth,
            alert_limits_m=limits,
            time_to_alert_s=time_to_alert,
            merge_s=merge,
            reset_s=reset,
            confidence=confidence,
            accept_findings=accept or (),
            progress=callback,
        )
    page = None
    if report is not None:
        from sbas.reporting import report as write_report  # drawing is loaded only where used

        causes = likely_causes(opened.source, result, truth=opened.truth, accept=accept or ())
        source = opened.source
        if result.epochs <= MOST_EXPLAINED and _has_companions(source):
            # Only a recording read whole has the table of the satellites that RAIM needs.
            again = inputs.open_recording(files, truth, reading, repairing, quiet=True, whole=True)
            source = again.source
            # What is wrong with its companion files shows only now.
            more = [f for f in source.meta.findings if f not in opened.source.meta.findings]
            more = [f for f in accepted(more, accept or ()) if f not in result.findings]
            result = replace(result, findings=(*result.findings, *more))
        page = write_report(result, report, causes=causes, raim=range_monitoring(source, result))
    if json:
        output.print_json({**result.to_dict(), "report": None if page is None else str(page)})
        return
    print_verdict(result)
    if page is not None:
        print(f"\nreport  {page}")


def likely_causes(
    source: EpochSource, result: Evaluation, *, truth: Truth | None, accept: Sequence[str] = ()
) -> Causes | Refusal:
    """Causes of the events of a recording that was evaluated, unless it is too long for memory."""
    if result.epochs > MOST_EXPLAINED:
        return Refusal(
            f"{result.epochs:,} epochs are more than {MOST_EXPLAINED:,}",
            "give parts of the record to sbas.explain",
        )
    try:
        return explain(source, truth=truth, accept_findings=accept)
    except InputError as error:
        return Refusal(error.what, error.cure)


def _has_companions(source: EpochSource) -> bool:
    """True where a source streams from a format whose side tables lie in files of their own."""
    from sbas.logs.arrow.parquet import FORMAT

    return not isinstance(source, Recording) and any(
        file.format == FORMAT.name for file in source.meta.sources
    )


def range_monitoring(source: EpochSource, result: Evaluation) -> LevelComparison | Refusal | None:
    """RAIM beside SBAS on a recording that was evaluated; None where it says nothing of RAIM."""
    from sbas.monitoring.level_comparison import raim_against_sbas  # loaded only where used
    from sbas.monitoring.recorded_ranges import has_ranges

    ranges = isinstance(source, Recording) and has_ranges(source)
    if not ranges and "herl_m" not in source.columns:
        return None
    if result.epochs > MOST_EXPLAINED:
        return Refusal(
            f"{result.epochs:,} epochs are more than {MOST_EXPLAINED:,}",
            "give parts of the record to sbas.raim_against_sbas",
        )
    if not isinstance(source, Recording):
        source = Recording(whole_table(source, _RECEIVERS_RAIM), source.meta)
    try:
        return raim_against_sbas(source)
    except InputError as error:
        return Refusal(error.what, error.cure)


def print_verdict(result: Evaluation) -> None:
    """The short answer: sizes of errors and levels, a row an alert limit, the findings."""
    print(result)
    if result.errors_are_lower_bound:
        print(f"errors are {result.lower_bound_words}")
    table = Table(box=box.SIMPLE, pad_edge=False)
    heads = ("AL [m]", "available", "incl. gaps", "HMI epochs", "HMI events",
             f"HMI rate, upper {percent(result.settings.confidence)} [1/h]")  # fmt: skip
    for head in heads:
        table.add_column(escape(head), justify="right")
    for limit in result.alert_limits:
        up, rate = limit.availability, limit.rates.get("hmi")
        table.add_row(
            f"{limit.alert_limit_m:g}",
            share(up.availability_excluding_gaps.value),
            share(up.availability.value),
            "-" if limit.regions is None else f"{limit.regions['hmi']:,}",
            "-" if rate is None else str(rate.events),
            "-" if rate is None else _upper(rate.demonstrated),
        )
    output.console().print(table)
    if result.environments:
        output.console().print(_by_environment(result))
        print("an event across a border counts under each label\n")
    print(_processes(result))
    output.print_findings(result.findings)


def _by_environment(result: Evaluation) -> Table:
    """A row a label: sizes, availability and HMI at the smallest alert limit."""
    table = Table(box=box.SIMPLE, pad_edge=False)
    least = min(result.settings.alert_limits_m)
    for head in ("environment", "hours", "HPE 95 % [m]", "HPL median [m]",
                 f"incl. gaps, AL {least:g} m", "HMI events", "HMI rate, upper [1/h]"):  # fmt: skip
        table.add_column(escape(head), justify="left" if head == "environment" else "right")
    for name, part in result.environments.items():
        at = part.at(least)
        rate = at.rates.get("hmi")
        table.add_row(
            escape(name),
            f"{part.hours:.4g}",
            "-" if part.hpe_m is None else f"{part.hpe_m.p95:.2f}",
            "-" if part.hpl_m is None else f"{part.hpl_m.median:.2f}",
            share(at.availability.availability.value),
            "-" if rate is None else str(rate.events),
            "-" if rate is None else _upper(rate.demonstrated),
        )
    return table


def _processes(result: Evaluation) -> str:
    """The decorrelation time and what it means for the published K, in two lines."""
    found = result.process.decorrelation
    if isinstance(found.tau_s, Refusal):
        tau = found.verdict_text if found.tau_low_s is not None else str(found.tau_s)
    else:
        tau = (f"tau {found.tau_s.value:.4g} s, {found.interval_text}; events of a rate are runs "
               f"merged over {result.merge_s:.4g} s")  # fmt: skip
    judged = result.railway
    words = judged if isinstance(judged, Refusal) else judged.as_claimed.verdict
    return f"decorrelation  {tau}\npublished K    {words}"


def _upper(figure: Estimate | Refusal) -> str:
    if isinstance(figure, Refusal):
        return "not demonstrated"
    return "-" if figure.upper is None else upward(figure.upper)


@with_option_groups
def rate(
    files: inputs.Files,
    truth: inputs.TruthGiven,
    reading: inputs.Reading,
    repairing: inputs.Repairing,
    alert_limit: Annotated[float, typer.Option(help="Horizontal alert limit in metres.")],
    confidence: Confidence = _DEFAULTS.confidence,
    environment: Annotated[
        str | None,
        typer.Option(help="Only the epochs of this label; see --environments."),
    ] = None,
    event: Annotated[
        str, typer.Option(help="; ".join(f"{k}: {v}" for k, v in EVENT_KINDS.items()))
    ] = "hmi",
    target_per_h: Annotated[
        float | None, typer.Option("--target-per-h", help="Rate to be demonstrated per hour.")
    ] = None,
    time_to_alert: TimeToAlert = _DEFAULTS.time_to_alert_s,
    merge: Merge = _DEFAULTS.merge_s,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """Which failure rate per hour can I claim, and is the target demonstrated (else exit 1)?

    Example:  sbas rate roof.sbf --truth 50.03,15.77,289.4 --alert-limit 25 --target-per-h 1e-7
    """
    if event not in EVENT_KINDS:
        raise InputError(
            f"unknown event {event!r}", cure=f"--event with one of {', '.join(EVENT_KINDS)}"
        )
    opened = inputs.open_recording(files, truth, reading, repairing, quiet=quiet)
    with output.progress("evaluating", quiet) as callback:
        result = failure_rate(
            opened.source,
            truth=opened.truth,
            alert_limit_m=alert_limit,
            confidence=confidence,
            event=event,
            environment=environment,
            target_per_h=target_per_h,
            time_to_alert_s=time_to_alert,
            merge_s=merge,
            accept_findings=accept or (),
            progress=callback,
        )
    if json:
        output.print_json(result.to_dict())
    else:
        _print_rate(result)
    if not result.demonstrated:
        raise typer.Exit(1)


def _print_rate(result: FailureRate) -> None:
    evidence = result.evidence
    print(f"{evidence.event}: {EVENT_KINDS[evidence.event]}; AL {evidence.alert_limit_m:g} m")
    print(f"{evidence.events} events in {evidence.hours:.6g} h of exposure")
    for name in ("demonstrated", "modelled", "claimed"):
        print(f"{name:13s} {getattr(evidence, name)}")
    if isinstance(evidence.modelled, Estimate):
        print("\n".join(evidence.modelled.caveats))
    print(f"SIL           {result.sil}")
    if result.target is not None:
        print(f"target        {result.target}")
    output.print_findings(result.findings)
