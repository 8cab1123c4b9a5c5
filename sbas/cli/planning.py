"""Verbs that need no recording: kfactor and plan."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from sbas.cli import output
from sbas.integrity.allocation import load_allocation
from sbas.integrity.exposure.exposure_models import KModels, k_models
from sbas.integrity.k_factors import k_factor
from sbas.integrity.planning import plan_hours
from sbas.numerals import upward


def register(app: typer.Typer) -> None:
    app.command("kfactor")(kfactor)
    app.command("plan")(plan)


def kfactor(
    risk: Annotated[
        float | None,
        typer.Option(help="Risk per independent sample; with an exposure, per exposure."),
    ] = None,
    distribution: Annotated[
        Literal["rayleigh", "gaussian", "chi", "ellipse"],
        typer.Option(help="Of the error over its sigma; gaussian is two-sided."),
    ] = "rayleigh",
    one_sided: Annotated[bool, typer.Option("--one-sided", help="Gaussian: one tail.")] = False,
    dim: Annotated[int | None, typer.Option(help="Chi: number of dimensions.")] = None,
    axis_ratio: Annotated[
        float | None, typer.Option(help="Ellipse: minor over major axis, 0 to 1.")
    ] = None,
    exposure_s: Annotated[
        float | None, typer.Option("--exposure-s", help="Length of the exposure, in seconds.")
    ] = None,
    tau_s: Annotated[
        float | None, typer.Option("--tau-s", help="1/e time of the errors, in seconds.")
    ] = None,
    interval_s: Annotated[
        float, typer.Option("--interval-s", help="Time between samples, in seconds.")
    ] = 1.0,
    nugget: Annotated[float, typer.Option(help="Share of the variance that is white noise.")] = 0.0,
    allocation: Annotated[
        str | None,
        typer.Option(help="Integrity allocation tree: pa_do229, npa_do229 or a TOML file."),
    ] = None,
    json: output.Json = False,
) -> None:
    """Which K factor bounds an error with a given risk?

    Example:  sbas kfactor --risk 5e-9

    Per hour, under each process model:  sbas kfactor --risk 5e-8 --exposure-s 3600 --tau-s 360

    The trees of the EGNOS paper:  sbas kfactor --allocation npa_do229
    """
    if allocation is not None:
        if risk is not None:
            raise typer.BadParameter("give --risk or --allocation, not both")
        _allocation(allocation, json)
        return
    if risk is None:
        raise typer.BadParameter("give --risk or --allocation", param_hint="--risk")
    if exposure_s is not None or tau_s is not None:
        if exposure_s is None or tau_s is None:
            raise typer.BadParameter("an exposure needs both --exposure-s and --tau-s")
        if one_sided:
            raise typer.BadParameter("--one-sided has no exposure model; use the two-sided one")
        answer = k_models(
            risk,
            exposure_s=exposure_s,
            tau_s=tau_s,
            interval_s=interval_s,
            dim=_dimensions(distribution, dim),
            axis_ratio=1.0 if axis_ratio is None else axis_ratio,
            nugget=nugget,
        )
        _print_models(answer, json)
        return
    if nugget or interval_s != 1.0:
        raise typer.BadParameter("--nugget and --interval-s need --exposure-s and --tau-s")
    k = k_factor(
        risk, distribution=distribution, one_sided=one_sided, dim=dim, axis_ratio=axis_ratio
    )
    if json:
        plain: dict[str, Any] = {
            "k": float(k),
            "per_sample_risk": risk,
            "distribution": distribution,
            "one_sided": one_sided,
            "dim": dim,
            "axis_ratio": axis_ratio,
        }
        output.print_json(plain)
    else:
        print(f"K = {k:.10g}  ({distribution}, risk {risk:g} per independent sample)")


def _dimensions(distribution: str, dim: int | None) -> int:
    if distribution == "chi" and dim is None:
        raise typer.BadParameter("--distribution chi needs --dim")
    return {"gaussian": 1, "chi": dim or 0}.get(distribution, 2)


def _print_models(answer: KModels, json: bool) -> None:
    if json:
        output.print_json(answer.to_dict())
        return
    white = " with white noise" if "nugget" in answer.models else ""
    print(f"K = {answer.k:.6g} for a risk of {answer.risk:g} in {answer.exposure.exposure_s:g} s "
          f"(sampled Gauss-Markov errors{white})")  # fmt: skip
    table = Table(box=box.SIMPLE, pad_edge=False)
    for head in ("model", "K", "effective samples at K", "risk of 6.18 in an hour", "errors are"):
        table.add_column(head, justify="left" if head in ("model", "errors are") else "right")
    for name, row in answer.summary().iterrows():
        table.add_row(
            str(name), f"{row.k:.6g}", f"{row.n_es:.5g}", upward(row.hourly_risk_of_6_18),
            row.meaning,
        )  # fmt: skip
    output.console().print(table)
    for caveat in answer.caveats:
        print(caveat)


def _allocation(name: str, json: bool) -> None:
    tree = load_allocation(name)
    leaves = tree.k_factors()
    if json:
        output.print_json({"allocation": tree.to_dict(), "leaves": [f.to_dict() for f in leaves]})
        return
    print(f"{tree.name}: {tree.title}")
    table = Table(box=box.SIMPLE, pad_edge=False)
    for head in ("node", "risk per sample", "K", "published K", "risk of published K"):
        table.add_column(escape(head), justify="left" if head == "node" else "right")
    for leaf in leaves:
        published = "-" if leaf.published_k is None else f"{leaf.published_k:g}"
        achieved = (
            "-"
            if leaf.published_per_sample_risk is None
            else f"{leaf.published_per_sample_risk:.6g}"
        )
        table.add_row(
            leaf.node, f"{leaf.per_sample_risk:.6g}", f"{leaf.k:.9g}", published, achieved
        )
    output.console().print(table)


def plan(
    rate: Annotated[float, typer.Option(help="Rate to be demonstrated per hour.")],
    confidence: Annotated[float, typer.Option(help="One-sided confidence.")] = 0.95,
    events: Annotated[int, typer.Option(help="Events that may occur meanwhile.")] = 0,
    assumed_rate: Annotated[
        float | None, typer.Option(help="True rate assumed for the chance to pass per hour.")
    ] = None,
    json: output.Json = False,
) -> None:
    """How long must I record to demonstrate a rate?

    Example:  sbas plan --rate 1e-7 --confidence 0.95
    """
    result = plan_hours(rate, confidence=confidence, events=events, assumed_rate_per_h=assumed_rate)
    if json:
        output.print_json(result.to_dict())
    else:
        print(result)
