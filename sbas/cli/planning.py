"""Verbs that need no recording: kfactor and plan."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from sbas.cli import output
from sbas.integrity.allocation import load_allocation
from sbas.integrity.k_factors import k_factor
from sbas.integrity.planning import plan_hours


def register(app: typer.Typer) -> None:
    app.command("kfactor")(kfactor)
    app.command("plan")(plan)


def kfactor(
    risk: Annotated[float | None, typer.Option(help="Risk per independent sample.")] = None,
    distribution: Annotated[
        Literal["rayleigh", "gaussian", "chi", "ellipse"],
        typer.Option(help="Of the error over its sigma; gaussian is two-sided."),
    ] = "rayleigh",
    one_sided: Annotated[bool, typer.Option("--one-sided", help="Gaussian: one tail.")] = False,
    dim: Annotated[int | None, typer.Option(help="Chi: number of dimensions.")] = None,
    axis_ratio: Annotated[
        float | None, typer.Option(help="Ellipse: minor over major axis, 0 to 1.")
    ] = None,
    allocation: Annotated[
        str | None,
        typer.Option(help="Integrity allocation tree: pa_do229, npa_do229 or a TOML file."),
    ] = None,
    json: output.Json = False,
) -> None:
    """Which K factor bounds an error with a given risk?

    Example:  sbas kfactor --risk 5e-9

    The trees of the EGNOS paper:  sbas kfactor --allocation npa_do229
    """
    if allocation is not None:
        if risk is not None:
            raise typer.BadParameter("give --risk or --allocation, not both")
        _allocation(allocation, json)
        return
    if risk is None:
        raise typer.BadParameter("give --risk or --allocation", param_hint="--risk")
    k = k_factor(
        risk, distribution=distribution, one_sided=one_sided, dim=dim, axis_ratio=axis_ratio
    )
    if json:
        answer: dict[str, Any] = {
            "k": float(k),
            "per_sample_risk": risk,
            "distribution": distribution,
            "one_sided": one_sided,
            "dim": dim,
            "axis_ratio": axis_ratio,
        }
        output.print_json(answer)
    else:
        print(f"K = {k:.10g}  ({distribution}, risk {risk:g} per independent sample)")


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
