"""The tail that modelled rates rest on, or why there is none."""

from __future__ import annotations

import math

from sbas.estimate import Refusal
from sbas.integrity.results import Evaluation
from sbas.integrity.tails.tail_fit import TailFit
from sbas.integrity.tails.tail_reference import QUANTILES
from sbas.numerals import count, number
from sbas.plots import tail_picture
from sbas.reporting.content import Callout, Cell, Section, Table, table
from sbas.reporting.drawn import drawn


def section(evaluation: Evaluation) -> Section:
    """Fitted tail, its judgement, and how it depends on where it was cut."""
    tail = evaluation.process.tail
    refusal = tail if isinstance(tail, Refusal) else tail.refusal
    if refusal is None:
        callout = Callout(
            "modelled",
            "The tail of the errors is that of a Gaussian record",
            ("Modelled rates are given where the level lies within 12 decades of the record. They "
             "hold as far as the error stays Gaussian; only counting demonstrates.",),
        )  # fmt: skip
    else:
        callout = Callout("warning", "No rate is modelled", (f"{refusal}.",))
    if isinstance(tail, Refusal):
        return Section("tail", "Tail of the errors", callouts=(callout,))
    return Section(
        "tail",
        "Tail of the errors",
        callouts=(callout,),
        tables=(_fit(tail), _stability(tail)),
        pictures=(
            drawn(
                "tail", "Tail of the errors over sigma", tail_picture.SHEET,
                lambda axes: tail_picture.tail_plot(tail, ax=axes[0]),
                "Share of epochs beyond each error over sigma, with the fitted tail.",
                "Sigma is HPL/K of each epoch. The fitted line rests on all exceedances of the "
                "95 % quantile; its band allows for their correlation.",
            ),
            drawn(
                "stability", "Does the tail depend on the threshold?", tail_picture.SHEET,
                lambda axes: tail_picture.threshold_stability(tail, ax=axes[0]),
                "Fitted scale of the tail over the quantile at which it is cut.",
                "A scale that rises to the right is a heavy tail: no extrapolation would be safe.",
            ),
        ),
    )  # fmt: skip


def _fit(tail: TailFit) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        ("threshold u of y = (error/sigma)²/2, 95 % quantile", _known(tail.threshold), ""),
        ("mean excess b over u", _known(tail.excess), ""),
        ("scale of sigma²", _known(tail.scale), "1: errors are as large as HPL/K claims"),
        ("axis ratio of the error", _known(tail.axis_ratio), "minor over major axis"),
        ("shape by moments", _known(tail.shape), "for information: never used"),
        ("clusters beyond u", count(tail.clusters), "runs merged at tau/2; 10 are needed"),
        ("length", f"{_known(tail.taus)} tau", f"{count(tail.samples)} epochs"),
        ("goodness of fit", _known(tail.fit_p), "share of Gaussian records that fit worse"),
        ("crossings of u", _known(tail.crossings), "over those of the clock; 1.5 refuses"),
        ("white share of the variance", _known(tail.nugget), "in the clock"),
    ]
    if tail.bias is not None:
        rows.append(("bias", _known(tail.bias), "mean error over its spread"))
    return table("Fitted tail (modelled)", "Quantity|#Value|Meaning", rows)


def _stability(tail: TailFit) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (f"{100 * quantile:g}", _known(threshold), _known(scale), _known(spread))
        for quantile, (_, threshold, scale, spread) in zip(QUANTILES, tail.stability, strict=True)
    ]
    return table(
        "Threshold stability",
        "#Quantile [%]|#Threshold u|#Scale of sigma²|#Standard deviation of ln scale",
        rows,
    )


def _known(value: float) -> str:
    return number(value) if math.isfinite(value) else "none"
