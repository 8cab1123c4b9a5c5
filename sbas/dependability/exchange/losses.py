"""What a format of another program can hold of a model, and the report of what it could not."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal, get_args

import pandas as pd

from sbas.dependability.static.static_tree import StaticTree
from sbas.dependability.tree.model import HybridFaultTree
from sbas.exceptions import ModelError

Format = Literal["Open-PSA", "Galileo", "tra/lab", "PNPRO"]
Treatment = Literal["kept", "flattened", "approximated", "refused"]
OnLoss = Literal["refuse", "flatten"]


@dataclass(frozen=True)
class Holding:
    """What becomes of one construct in one format, and how."""

    treatment: Treatment
    how: str


_NONE = Holding("refused", "the format has no such thing")
_CHAIN = Holding("kept", "in the states of the chain")
_NET = Holding("kept", "as places and guards")

CAPABILITIES: dict[str, dict[Format, Holding]] = {
    "or, and, k-of-n": {
        "Open-PSA": Holding("kept", "or, and, atleast"),
        "Galileo": Holding("kept", "or, and, KofN"),
        "tra/lab": _CHAIN,
        "PNPRO": _NET,
    },
    "not": {"Open-PSA": Holding("kept", "not"), "Galileo": _NONE, "tra/lab": _CHAIN, "PNPRO": _NET},
    "house event": {
        "Open-PSA": Holding("kept", "define-house-event"),
        "Galileo": Holding("approximated", "prob=0 or 1, comes back as an undeveloped event"),
        "tra/lab": _CHAIN,
        "PNPRO": _NET,
    },
    "undeveloped event": {
        "Open-PSA": Holding("kept", "basic event with a float"),
        "Galileo": Holding("kept", "prob="),
        "tra/lab": _CHAIN,
        "PNPRO": _NONE,
    },
    "constant failure rate": {
        "Open-PSA": Holding("kept", "exponential"),
        "Galileo": Holding("kept", "lambda="),
        "tra/lab": Holding("kept", "probabilities of one epoch"),
        "PNPRO": Holding("kept", "EXP transition"),
    },
    "repairable component": {
        "Open-PSA": Holding("kept", "GLM: probability at t; no joint behaviour over time"),
        "Galileo": Holding("kept", "repair= in the DFTCalc dialect; the Storm dialect refuses"),
        "tra/lab": Holding("kept", "probabilities of one epoch"),
        "PNPRO": Holding("kept", "EXP transition"),
    },
    "component failed at the start": {
        "Open-PSA": Holding("kept", "gamma of the GLM"),
        "Galileo": _NONE,
        "tra/lab": Holding("kept", "in the law of the first epoch"),
        "PNPRO": Holding("refused", "an initial marking is certain"),
    },
    "second event on a component": {
        "Open-PSA": Holding("kept", "an or of the first, and comes back as one"),
        "Galileo": Holding("kept", "an or of the first, and comes back as one"),
        "tra/lab": _CHAIN,
        "PNPRO": _NET,
    },
    "component without an event": {
        "Open-PSA": Holding("refused", "left out: no figure depends on it"),
        "Galileo": Holding("refused", "left out: no figure depends on it"),
        "tra/lab": Holding("refused", "left out: no figure depends on it"),
        "PNPRO": _NET,
    },
    "Markov source": {
        "Open-PSA": Holding("refused", "a marginal probability is all it could be"),
        "Galileo": _NONE,
        "tra/lab": Holding("kept", "guard and first fix as slots"),
        "PNPRO": Holding("kept", "as a net; the first fix as GEN I[T]"),
    },
    "priority and": {
        "Open-PSA": _NONE,
        "Galileo": Holding("kept", "pand-incl or pand-excl, where nothing below is repaired"),
        "tra/lab": _CHAIN,
        "PNPRO": _NET,
    },
    "duration or causal and": {
        "Open-PSA": _NONE,
        "Galileo": Holding("refused", "phases= does not start anew when the input ends"),
        "tra/lab": Holding("kept", "as slots"),
        "PNPRO": Holding("kept", "GEN I[T], dropped when disabled"),
    },
    "consecutive epochs": {
        "Open-PSA": _NONE,
        "Galileo": _NONE,
        "tra/lab": _CHAIN,
        "PNPRO": Holding("kept", "a counter place"),
    },
    "epoch and mission": {
        "Open-PSA": Holding("kept", "as attributes of the fault tree"),
        "Galileo": Holding("refused", "say them at the import: no figure at one instant changes"),
        "tra/lab": Holding("refused", "the number of epochs stands in the property asked"),
        "PNPRO": Holding("kept", "the clock's delay; the mission is the simulator's"),
    },
    "names of components": {
        "Open-PSA": Holding("kept", "as attributes of the basic events"),
        "Galileo": Holding("refused", "the event's name takes its place"),
        "tra/lab": Holding("refused", "states are numbers"),
        "PNPRO": Holding("kept", "in the names of places"),
    },
    "cases": {
        "Open-PSA": Holding("kept", "as attributes of the fault tree"),
        "Galileo": Holding("refused", "a file has one top"),
        "tra/lab": Holding("kept", "as labels"),
        "PNPRO": Holding("refused", "the net has no list of results"),
    },
    "options, notes and sources of figures": {
        "Open-PSA": Holding("refused", "left out: no figure at one instant depends on them"),
        "Galileo": Holding("refused", "left out: what they say is in the gates' types"),
        "tra/lab": Holding("refused", "left out: what they say is in the chain"),
        "PNPRO": Holding("refused", "left out: what they say is in the net"),
    },
}
"""What each format holds; the reports and the table in the documentation come from here."""


@dataclass(frozen=True)
class Loss:
    """What became of one element of a model on its way into or out of a format.

    Parameters
    ----------
    element : its name.
    construct : a key of `CAPABILITIES`, or a construct of the foreign format.
    treatment : "kept", "flattened" (a basic event with the computed point probability),
        "approximated" or "refused" (left out).
    consequence : what that means for the figures.
    """

    element: str
    construct: str
    treatment: Treatment
    consequence: str

    def __post_init__(self) -> None:
        if self.treatment not in get_args(Treatment):
            raise ValueError(f"unknown treatment {self.treatment!r}")


@dataclass(frozen=True)
class LossReport:
    """What an import or export did with each element; the kept ones are listed too."""

    format: str
    losses: tuple[Loss, ...]

    @property
    def lost(self) -> tuple[Loss, ...]:
        """The elements that were not kept as they are."""
        return tuple(loss for loss in self.losses if loss.treatment != "kept")

    def summary(self) -> pd.DataFrame:
        """A row for each element."""
        columns = ["element", "construct", "treatment", "consequence"]
        return pd.DataFrame([asdict(loss) for loss in self.losses], columns=columns)

    def __str__(self) -> str:
        if not self.lost:
            return f"{self.format}: everything is kept."
        rows = [f"  {x.element} ({x.construct}): {x.treatment}; {x.consequence}" for x in self.lost]
        return "\n".join([f"{self.format}: {len(rows)} elements are not kept as they are", *rows])


@dataclass(frozen=True)
class Exported:
    """Text in a foreign format, with the report of what it does not hold."""

    text: str
    report: LossReport


@dataclass(frozen=True)
class ImportedTree:
    """A static tree from a foreign format, with the report of what was not taken over."""

    tree: StaticTree
    report: LossReport


@dataclass(frozen=True)
class ImportedModel:
    """A hybrid fault tree from a foreign format, with the report of what was not taken over."""

    model: HybridFaultTree
    report: LossReport


def loss_of(element: str, construct: str, into: Format, *, besides: str = "") -> Loss:
    """The table's treatment of a construct, for one element.

    Parameters
    ----------
    element : its name.
    construct : a key of `CAPABILITIES`.
    into : the format.
    besides : what more there is to say about this element.
    """
    holding = CAPABILITIES[construct][into]
    consequence = f"{holding.how}; {besides}" if besides else holding.how
    return Loss(element, construct, holding.treatment, consequence)


def capability_table() -> str:
    """The capability table in Markdown, a row for each construct."""
    formats = get_args(Format)
    lines = [f"| construct | {' | '.join(formats)} |", "|---" * (len(formats) + 1) + "|"]
    for construct, holdings in CAPABILITIES.items():
        cells = (f"{holdings[name].treatment}: {holdings[name].how}" for name in formats)
        lines.append(f"| {construct} | {' | '.join(cells)} |")
    return "\n".join(lines)


def check_on_loss(on_loss: str, allowed: tuple[str, ...] = get_args(OnLoss)) -> None:
    """Raise ModelError for an unknown way to treat what a format cannot hold."""
    if on_loss not in allowed:
        raise ModelError(
            f"on_loss = {on_loss!r} is unknown", cure=f"known are {', '.join(allowed)}"
        )


def refuse(losses: list[Loss], into: Format, *, model: str, cure: str) -> None:
    """Raise ModelError with every element that stands in the way of an export.

    Parameters
    ----------
    losses : of the elements that the format cannot hold; none passes.
    into : the format.
    model : name of the model.
    cure : what to do instead.
    """
    if losses:
        raise ModelError(
            f"{into} cannot hold {len(losses)} elements of the model",
            where=f"model {model!r}",
            evidence="; ".join(
                f"{x.element} ({x.construct}: {x.consequence})" for x in losses[:12]
            ),
            cure=cure,
        )
