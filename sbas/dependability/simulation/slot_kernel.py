"""Compiled simulation of flat hybrid fault trees: one history after the other.

This module and `petri_kernel` load the compiler: import them where they are needed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.simulation.numba_cache import compiled

# What the kernel reads stands in its file: the cache on disk is renewed when this file changes.

FAILED, IN_STATE, FIXED, DRAWN, COUNT, NOT, RUN, PAND = range(8)
"""Kinds of nodes; COUNT is OR, AND and k-of-n: so many inputs are true."""

LATCHED, EXCLUSIVE = 1, 2
"""Flags of a PAND."""

FAR = np.iinfo(np.int64).max // 4
"""An epoch that no mission reaches."""


class SlotProgram(NamedTuple):
    """What the kernel reads.

    Parameters
    ----------
    epochs : N.
    failure_rate, repair_rate, failed_at_start : (components,) per epoch, per epoch, [1].
    guard_start, guard : components of source s are guard[guard_start[s]:guard_start[s + 1]].
    states, wait_epochs, initial_law : (sources,) number of states, first-fix wait, law at 0.
    stage_start : (sources + 1,) into the stage arrays.
    stage_end, stage_rows, stage_restart : last epoch of a stage, its first row law, its restart.
    law_start, law_state, law_cut : a law k draws law_state[j] by the first j with u >= law_cut[j].
    node_kind, node_of, node_value, node_flags, node_hold : (nodes,) kind, component or source,
        count or epochs of a run, PAND flags, node that suspends a run (-1: none).
    node_probability : (nodes,) of DRAWN.
    input_start, inputs : as guard, for nodes.
    mask_start, mask : states of a source in which an IN_STATE node is true; the last two are
        down and waiting.
    """

    epochs: int
    failure_rate: NDArray[np.float64]
    repair_rate: NDArray[np.float64]
    failed_at_start: NDArray[np.float64]
    guard_start: NDArray[np.int64]
    guard: NDArray[np.int64]
    states: NDArray[np.int64]
    wait_epochs: NDArray[np.int64]
    initial_law: NDArray[np.int64]
    stage_start: NDArray[np.int64]
    stage_end: NDArray[np.int64]
    stage_rows: NDArray[np.int64]
    stage_restart: NDArray[np.int64]
    law_start: NDArray[np.int64]
    law_state: NDArray[np.int64]
    law_cut: NDArray[np.float64]
    node_kind: NDArray[np.int64]
    node_of: NDArray[np.int64]
    node_value: NDArray[np.int64]
    node_flags: NDArray[np.int64]
    node_hold: NDArray[np.int64]
    node_probability: NDArray[np.float64]
    input_start: NDArray[np.int64]
    inputs: NDArray[np.int64]
    mask_start: NDArray[np.int64]
    mask: NDArray[np.bool_]


FREE, FORCED, NEVER = 0, 1, 2
"""What a component does in a stratum: as it likes, fail at least once, not fail."""


@compiled
def _draw(program: SlotProgram, law: int, rng: np.random.Generator) -> int:
    u = rng.random()
    j = program.law_start[law]
    while u < program.law_cut[j]:
        j += 1
    state: int = program.law_state[j]
    return state


@compiled
def _waiting_time(rate: float, rng: np.random.Generator) -> float:
    return rng.standard_exponential() / rate if rate > 0.0 else math.inf


@compiled
def _first_failure(program: SlotProgram, c: int, role: int, rng: np.random.Generator) -> float:
    """Time of the first failure [epochs]; forced: given that it lies within the mission."""
    if role == NEVER:
        return math.inf
    rate = program.failure_rate[c]
    if role == FORCED:
        share = -math.expm1(-rate * program.epochs)
        return -math.log1p(-rng.random() * share) / float(rate)
    return _waiting_time(rate, rng)


@compiled
def _evaluate(
    program: SlotProgram,
    n: int,
    failed: NDArray[np.bool_],
    state: NDArray[np.int64],
    value: NDArray[np.bool_],
    onset: NDArray[np.int64],
    since: NDArray[np.int64],
    held_from: NDArray[np.int64],
    true_epochs: NDArray[np.int64],
    onsets: NDArray[np.int64],
) -> int:
    """Truth of all nodes at epoch n; returns the next epoch at which a run becomes long enough.

    `since` is the first epoch of the run of a RUN's inputs, FAR while there is none; held epochs
    move it forward.
    """
    due = FAR
    for i in range(len(value)):
        kind = program.node_kind[i]
        first, end = program.input_start[i], program.input_start[i + 1]
        new = value[i]
        if kind == FAILED:
            new = failed[program.node_of[i]]
        elif kind == IN_STATE:
            new = program.mask[program.mask_start[i] + state[program.node_of[i]]]
        elif kind == COUNT:
            count = 0
            for j in range(first, end):
                count += value[program.inputs[j]]
            new = count >= program.node_value[i]
        elif kind == NOT:
            new = not value[program.inputs[first]]
        elif kind == RUN:
            hold = program.node_hold[i]
            if hold >= 0 and value[hold]:
                if held_from[i] == FAR:
                    held_from[i] = n
                new = False
            else:
                if held_from[i] != FAR:
                    if since[i] != FAR:
                        since[i] += n - held_from[i]
                    held_from[i] = FAR
                together = True
                for j in range(first, end):
                    together = together and value[program.inputs[j]]
                if not together:
                    since[i] = FAR
                elif since[i] == FAR:
                    since[i] = n
                ripe = since[i] + program.node_value[i] - 1
                new = together and n >= ripe
                if together and not new:
                    due = min(due, ripe)
        elif kind == PAND:
            left, right = program.inputs[first], program.inputs[first + 1]
            flags = program.node_flags[i]
            if not (value[i] and flags & LATCHED):
                in_order = onset[left] <= onset[right]
                if flags & EXCLUSIVE:
                    in_order = onset[left] < onset[right]
                new = value[left] and value[right] and in_order
        if new and not value[i]:
            onset[i] = n
            onsets[i] += n > 0
        elif value[i] and not new:
            true_epochs[i] += n - onset[i]
        value[i] = new
    return due


@compiled
def _move_hardware(
    program: SlotProgram,
    n: int,
    failed: NDArray[np.bool_],
    event_time: NDArray[np.float64],
    rng: np.random.Generator,
) -> float:
    """Run every component's clock up to epoch n; returns the earliest event after it."""
    earliest = math.inf
    for c in range(len(failed)):
        while event_time[c] <= n:
            failed[c] = not failed[c]
            rate = program.repair_rate[c] if failed[c] else program.failure_rate[c]
            event_time[c] += _waiting_time(rate, rng)
        earliest = min(earliest, event_time[c])
    return earliest


@compiled
def _works(program: SlotProgram, s: int, failed: NDArray[np.bool_]) -> bool:
    for j in range(program.guard_start[s], program.guard_start[s + 1]):
        if failed[program.guard[j]]:
            return False
    return True


@compiled
def run_histories(
    program: SlotProgram,
    roles: NDArray[np.int64],
    rng: np.random.Generator,
    true_epochs: NDArray[np.int64],
    onsets: NDArray[np.int64],
    at_start: NDArray[np.bool_],
    at_end: NDArray[np.bool_],
) -> None:
    """Simulate len(true_epochs) histories.

    Parameters
    ----------
    program, roles : the model and, for each component, FREE, FORCED or NEVER.
    rng : source of all randomness.
    true_epochs, onsets, at_start, at_end : (histories, nodes), zeros; filled with the number of
        true epochs among 0..N, of onsets among 1..N, and the truth at epochs 0 and N.

    Notes
    -----
    Components have exponential clocks in continuous time, read at the epochs. Truth can change
    only where a component or a source moved or a run becomes long enough: other epochs are not
    evaluated, and where no source is active they are skipped.
    """
    last = program.epochs
    components, sources = len(roles), len(program.states)
    nodes = len(program.node_kind)
    failed = np.zeros(components, np.bool_)
    works = np.zeros(sources, np.bool_)
    event_time = np.zeros(components)
    state = np.zeros(sources, np.int64)
    stage = np.zeros(sources, np.int64)
    wait_end = np.zeros(sources, np.int64)
    value = np.zeros(nodes, np.bool_)
    onset = np.zeros(nodes, np.int64)
    since = np.zeros(nodes, np.int64)
    held_from = np.zeros(nodes, np.int64)
    for h in range(len(true_epochs)):
        hardware_time = math.inf
        for c in range(components):
            start = program.failed_at_start[c]
            failed[c] = start > 0.0 and rng.random() < start
            if failed[c]:
                event_time[c] = _waiting_time(program.repair_rate[c], rng)
            else:
                event_time[c] = _first_failure(program, c, roles[c], rng)
            hardware_time = min(hardware_time, event_time[c])
        for s in range(sources):
            works[s] = _works(program, s, failed)
            stage[s] = program.stage_start[s]
            state[s] = program.states[s]
            if works[s]:
                state[s] = _draw(program, program.initial_law[s], rng)
        since[:] = FAR
        held_from[:] = FAR
        for i in range(nodes):
            value[i] = program.node_kind[i] == FIXED and program.node_value[i] == 1
            if program.node_kind[i] == DRAWN:
                value[i] = rng.random() < program.node_probability[i]
            onset[i] = 0
        due = _evaluate(
            program, 0, failed, state, value, onset, since, held_from, true_epochs[h], onsets[h]
        )
        at_start[h] = value
        n = 0
        while n < last:
            upcoming = min(float(due), float(np.ceil(hardware_time)), float(last))
            for s in range(sources):
                if state[s] < program.states[s]:
                    upcoming = n + 1.0
                elif state[s] > program.states[s]:
                    upcoming = min(upcoming, float(wait_end[s]))
            n = max(n + 1, int(upcoming))
            changed = n >= due
            if hardware_time <= n:
                hardware_time = _move_hardware(program, n, failed, event_time, rng)
                changed = True
                for s in range(sources):
                    works[s] = _works(program, s, failed)
            for s in range(sources):
                down, before = program.states[s], state[s]
                while program.stage_end[stage[s]] < n:
                    stage[s] += 1
                if not works[s]:
                    state[s] = down
                elif before < down:
                    state[s] = _draw(program, program.stage_rows[stage[s]] + before, rng)
                elif before == down and program.wait_epochs[s] > 0:
                    state[s] = down + 1
                    wait_end[s] = n + program.wait_epochs[s]
                elif before == down or n >= wait_end[s]:
                    state[s] = _draw(program, program.stage_restart[stage[s]], rng)
                changed = changed or state[s] != before
            if changed:
                due = _evaluate(
                    program, n, failed, state, value, onset, since, held_from,
                    true_epochs[h], onsets[h],
                )  # fmt: skip
        for i in range(nodes):
            if value[i]:
                true_epochs[h, i] += last + 1 - onset[i]
        at_end[h] = value
