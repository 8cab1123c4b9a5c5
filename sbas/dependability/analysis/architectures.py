"""Architectures side by side: how available they are and how often they are wrong unawares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from sbas.dependability.analysis.hazard_verdict import HazardVerdict, hazard_verdict
from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import Failed, HybridFaultTree, InState, Or
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.redundancy import k_out_of_n
from sbas.exceptions import InputError

_MOST_STATES = 500_000
"""A ladder is for a look: seconds a row."""


@dataclass(frozen=True)
class ArchitectureRow:
    """One architecture.

    Parameters
    ----------
    name : of the architecture.
    unavailability : mean of the top over the mission [1].
    hazard_unavailability : mean of the hazard over the mission [1].
    at_least_once : probability of the hazard at some epoch 1..N [1]; None where not asked for.
    verdict : on the hazard's occurrences per hour.
    refused : why there are no figures; empty where there are.
    """

    name: str
    unavailability: float | None
    hazard_unavailability: float | None
    at_least_once: float | None
    verdict: HazardVerdict | None
    refused: str = ""


@dataclass(frozen=True)
class ArchitectureLadder:
    """Architectures against one hazard.

    Parameters
    ----------
    hazard : name of the event or gate.
    thr_per_h : tolerable hazard rate [1/h]; None where none was given.
    rows : in the order given.
    """

    hazard: str
    thr_per_h: float | None
    rows: tuple[ArchitectureRow, ...]

    def summary(self) -> pd.DataFrame:
        """A row for each architecture; hazard_per_h is W/T."""
        return pd.DataFrame([_plain(row) for row in self.rows]).set_index("architecture")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "hazard": self.hazard,
            "thr_per_h": self.thr_per_h,
            "rows": [_plain(row) for row in self.rows],
        }


def _plain(row: ArchitectureRow) -> dict[str, Any]:
    verdict = row.verdict
    return {
        "architecture": row.name,
        "unavailability": row.unavailability,
        "hazard_per_h": None if verdict is None else verdict.rate_per_h,
        "hazard_unavailability": row.hazard_unavailability,
        "hazard_at_least_once": row.at_least_once,
        "sil": None if verdict is None else verdict.sil,
        "meets_thr": None if verdict is None else verdict.meets,
        "verdict": row.refused if verdict is None else verdict.text,
    }


def compare_architectures(
    models: Mapping[str, HybridFaultTree],
    *,
    hazard: str = "Case C",
    thr_per_h: float | None = None,
    first_passage: bool = False,
    max_states: int = _MOST_STATES,
) -> ArchitectureLadder:
    """Solve architectures exactly and compare their hazard with a tolerable rate.

    Parameters
    ----------
    models : by name of the architecture; each has an event or gate named `hazard`.
    hazard : what must not happen.
    thr_per_h : tolerable hazard rate [1/h].
    first_passage : also the probability of the hazard at least once; takes joint chains.
    max_states : largest chain that may be built.

    Returns
    -------
    ArchitectureLadder; an architecture too large for the exact solution has a row without
    figures that says so.

    Raises
    ------
    ModelError : a model that means nothing.
    InputError : no model; a model without that hazard.
    """
    if not models:
        raise InputError("no architectures to compare", where="models", evidence="{}")
    for name, model in models.items():
        check_model(model)
        if hazard not in {thing.name for kind in (model.events, model.gates) for thing in kind}:
            raise InputError(
                "an architecture without the hazard", where=name, evidence=hazard,
                cure="name a gate or event that every architecture has",
            )  # fmt: skip
    rows = []
    for name, model in models.items():
        try:
            solution = solve(
                model, names=(hazard, model.top), first_passage=first_passage, max_states=max_states
            )
        except InputError as error:
            rows.append(ArchitectureRow(name, None, None, None, None, str(error)))
            continue
        row = solution.rows[hazard]
        verdict = hazard_verdict(solution, hazard, thr_per_h=thr_per_h)
        rows.append(
            ArchitectureRow(
                name,
                solution.top.mean_unavailability,
                row.mean_unavailability,
                row.at_least_once,
                verdict,
            )
        )
    return ArchitectureLadder(hazard, thr_per_h, tuple(rows))


def receiver_alone(
    model: HybridFaultTree,
    *,
    source: str = "O",
    wrong: tuple[str, ...] = ("wrong",),
    hazard: str = "Case C",
) -> HybridFaultTree:
    """The receiver of a unit with nothing beside it.

    Parameters
    ----------
    model : of the unit.
    source : name of the receiver.
    wrong : its states in which a position is output that is too far off.
    hazard : name to give to them.

    Returns
    -------
    The receiver with its guards. Nothing recognises a wrong position: each is the hazard from its
    first epoch on. Every other state but the first is "Unavailable"; the top is either.

    Raises
    ------
    InputError : no source of that name, or no such state.

    Notes
    -----
    The mean of the top is then the complement of the single GNSS availability of the paper.
    """
    found = {s.name: s for s in model.sources}
    if source not in found:
        raise InputError(
            "no source of that name", where="source", evidence=f"{source!r} of {[*found]}"
        )
    receiver = found[source]
    if not wrong or not set(wrong) <= set(receiver.states[1:]):
        raise InputError(
            "no such state of the receiver", where="wrong", evidence=f"{wrong} of {receiver.states}"
        )
    silent = (*receiver.states[1:], receiver.down, receiver.waiting or receiver.down)
    states = tuple(s for s in dict.fromkeys(silent) if s not in wrong)
    alone = replace(
        model,
        name=f"{model.name}, receiver alone",
        components=tuple(c for c in model.components if c.name in receiver.guard),
        sources=(receiver,),
        events=(
            *(Failed(f"{name} failed", name) for name in receiver.guard),
            InState("Wrong position", source, wrong),
            InState("No position", source, states),
        ),
        gates=(
            Or(hazard, ("Wrong position",)),
            Or("Unavailable", ("No position", *(f"{name} failed" for name in receiver.guard))),
            Or(model.top, (hazard, "Unavailable")),
        ),
        cases=("Unavailable", hazard),
    )
    check_model(alone)
    return alone


def gnss_architectures(
    model: HybridFaultTree, *, hazard: str = "Case C", source: str = "O"
) -> dict[str, HybridFaultTree]:
    """The paper's unit, its receiver alone and redundant channels of it.

    Parameters
    ----------
    model : the unit, such as `load_model("galoroi", environment="urban")`.
    hazard : its unsafe case.
    source : its receiver.

    Returns
    -------
    By name: "GNSS alone", "GNSS + ECS", then 2oo2, 1oo2 and 2oo3, each with independent receivers
    and with receivers in one signal state: the limits between which the truth lies. For shared
    signals the first-fix wait is left out: with it the joint chain of two channels has 78 million
    moves. The name of those says so.

    Raises
    ------
    ModelError, InputError : as `receiver_alone` and `redundancy.k_out_of_n`.
    """
    found = {
        "GNSS alone": receiver_alone(model, source=source, hazard=hazard),
        "GNSS + ECS": model,
    }
    at_once = replace(model, sources=tuple(replace(s, first_fix_s=0.0) for s in model.sources))
    for k, n in ((2, 2), (1, 2), (2, 3)):
        found[f"{k}oo{n}, independent signals"] = k_out_of_n(
            model, k, n, share_sources=False, unsafe=hazard
        )
        found[f"{k}oo{n}, shared signals, no first-fix wait"] = k_out_of_n(
            at_once, k, n, share_sources=True, unsafe=hazard
        )
    return found
