"""Histories of a hybrid fault tree, epoch by epoch, and what they say about every row."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.simulation.forced_failures import choose_strata
from sbas.dependability.simulation.simulation_result import (
    Simulation,
    Stratum,
    Tally,
    estimate_rows,
)
from sbas.dependability.simulation.slot_program import compile_model
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError

if TYPE_CHECKING:
    from sbas.dependability.simulation.slot_kernel import SlotProgram

CHUNK = 20_000
"""Histories simulated at once: bounds the memory, and each chunk has a generator of its own."""


def simulate_model(
    model: HybridFaultTree,
    *,
    histories: int,
    rng: np.random.Generator,
    force: Iterable[Collection[str]] | None = None,
) -> Simulation:
    """Simulate a model; shares neither kernels nor counters with the exact solution.

    Parameters
    ----------
    model : any that `check_model` accepts.
    histories : number of missions, 2 or more; forced failures round it.
    rng : source of all randomness; its children of `spawn` are used, so that the result depends
        on its seed and on the number of its earlier calls only.
    force : sets of components that fail at least once; each set is a stratum with its exact
        weight, in which the other components of all sets never fail. Weight of sets left out is
        reported per row as `unsampled`. None takes all sets of the components that fail with a
        probability of 0.1 or less; () forces nothing.

    Returns
    -------
    Simulation: for every event and gate the mean over the mission by `mean_rule`, the
    probability at the end, at least once in epochs 1..N, and the number of onsets.

    Raises
    ------
    ModelError : the model means nothing.
    InputError : fewer than 2 histories, a `force` that cannot be, or the mean rule "integral",
        which looks inside the epoch.

    Notes
    -----
    Components have exponential clocks in continuous time that are read at the epochs; sources
    move by their rows once an epoch; gates compare the first epochs of runs. A forced first
    failure is t = -log1p(U expm1(-alpha T))/alpha. Standard errors: sd over histories/sqrt(M).

    References
    ----------
    Inverse of the truncated exponential law: exact. Strata: Cochran 1977, 5.3 and 5.4.
    """
    check_model(model)
    if histories < 2:
        raise InputError("a standard error takes 2 histories or more", where="histories")
    rule = model.options.mean_rule
    if rule == "integral":
        raise InputError(
            "the simulation reads hardware at the epochs, not between them",
            where="options.mean_rule", evidence=rule,
            cure='mean_rule = "epochs", "left" or "trapezoid"',
        )  # fmt: skip
    program, nodes = compile_model(model)
    strata, possible, unsampled = choose_strata(model, histories, force)
    rows = np.array(list(nodes.values()), np.intp)
    tallies = [
        _simulate_stratum(model, program, rows, stratum, child)
        for stratum, child in zip(strata, rng.spawn(len(strata)), strict=True)
    ]
    estimates = estimate_rows(list(nodes), strata, tallies, possible=possible, unsampled=unsampled)
    return Simulation(model.name, rule, strata, estimates, epochs=program.epochs)


def _simulate_stratum(
    model: HybridFaultTree,
    program: SlotProgram,
    rows: NDArray[np.intp],
    stratum: Stratum,
    rng: np.random.Generator,
) -> Tally:
    from sbas.dependability.simulation.slot_kernel import FORCED, FREE, NEVER, run_histories

    roles = np.array(
        [
            FORCED if c.name in stratum.failing else NEVER if c.name in stratum.never else FREE
            for c in model.components
        ],
        np.int64,
    )
    tally = Tally(len(rows))
    chunks = -(-stratum.histories // CHUNK)
    for i, child in enumerate(rng.spawn(chunks)):
        size = min(CHUNK, stratum.histories - i * CHUNK)
        shape = (size, len(program.node_kind))
        true_epochs, onsets = np.zeros((2, *shape), np.int64)
        at_start, at_end = np.zeros((2, *shape), np.bool_)
        run_histories(program, roles, child, true_epochs, onsets, at_start, at_end)
        true_epochs, onsets = true_epochs[:, rows], onsets[:, rows]
        at_start, at_end = at_start[:, rows], at_end[:, rows]
        left_out = {"epochs": at_start, "left": at_end}.get(
            model.options.mean_rule, 0.5 * (at_start + at_end.astype(np.float64))
        )
        mean = (true_epochs - left_out) / program.epochs
        tally.add(mean, at_end, true_epochs > at_start, onsets)
    return tally
