"""From one epoch to the next: hardware goes on in continuous time, all else is held."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.plan import Tree
from sbas.dependability.exact.transitions import Floats, Truth, hardware_step
from sbas.dependability.tree.model import And, AtLeast, Failed, HybridFaultTree, Not, Or


def instants(model: HybridFaultTree) -> tuple[Floats, Floats]:
    """Instants within an epoch and their weights.

    Returns
    -------
    (Q,) instants [s], (Q,) weights with sum 1: Gauss-Legendre, exact to rounding for products of
    the exponentials of the hardware.
    """
    rate = sum(c.failure_rate_per_h + c.repair_rate_per_h for c in model.components)
    count = min(60, 8 + int(np.ceil(2.0 * rate * model.step_s / 3600.0)))
    at, weight = np.polynomial.legendre.leggauss(count)
    return (at + 1.0) / 2.0 * model.step_s, weight / 2.0


def hardware_within(tree: Tree, name: str, truth: Truth, seconds: Floats) -> Floats:
    """Probability of an event or gate some time after each state, before the next epoch.

    Parameters
    ----------
    tree : the model.
    name : of the event or gate.
    truth : in each of S states, of all events and of all gates with memory.
    seconds : (Q,) times after the epoch [s].

    Returns
    -------
    (S, Q). Failures and repairs go on; signals and gates with memory keep their truth.
    """
    boolean = [g for g in _boolean_below(tree, name) if g in tree.gates]
    read = {n for g in boolean for n in tree.gates[g].inputs} | {name}
    moving = {
        e.name: e.component
        for e in tree.model.events
        if isinstance(e, Failed) and e.name in read and e.name in truth
    }
    memory = gate_memory([tree.gates[g] for g in boolean], tree.model)
    components = [c for c in tree.model.components if c.name in moving.values()]
    failed = {
        c.name: next(truth[event] for event, name_ in moving.items() if name_ == c.name)
        for c in components
    }
    size = len(truth[name])
    total = np.zeros((size, len(seconds)))
    for then in product((False, True), repeat=len(components)):
        state = dict(zip((c.name for c in components), then, strict=True))
        known = dict(truth)
        known.update({event: np.full(size, state[c]) for event, c in moving.items()})
        true: NDArray[np.bool_] = memory.step([], known)[1][name]
        for q, time in enumerate(seconds):
            chance = true.astype(float)
            for c in components:
                fail, repair = hardware_step(c, float(time))
                to_failed = np.where(failed[c.name], 1.0 - repair, fail)
                to_up = np.where(failed[c.name], repair, 1.0 - fail)
                chance = chance * (to_failed if state[c.name] else to_up)
            total[:, q] += chance
    return total


def _boolean_below(tree: Tree, name: str) -> list[str]:
    """Boolean gates from here down to events and gates with memory, each after its inputs."""
    gate = tree.gates.get(name)
    if not isinstance(gate, Or | And | Not | AtLeast):
        return []
    lower = [n for i in gate.inputs for n in _boolean_below(tree, i)]
    return list(dict.fromkeys([*lower, name]))
