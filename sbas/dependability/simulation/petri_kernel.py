"""Compiled simulation of flat Petri nets: one history after the other."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.simulation.numba_cache import compiled

IMMEDIATE, DELAY, EXPONENTIAL = range(3)
TOKENS, AT_LEAST, NOT, REQUIRE = range(4)

MOST_FIRINGS = 100_000
"""At one instant; a net that fires more does not let time pass."""


class NetProgram(NamedTuple):
    """What the kernel reads; times in ticks, whole for constant delays.

    Parameters
    ----------
    marking : (places,) at the start.
    kind, delay, rate, weight, priority, age : (transitions,) `age` is memory.
    immediates, timed : transitions, highest priority first and lowest turn first.
    change_start, change_place, change_tokens : outputs less inputs, where that is not 0.
    flush_start, flush_place, flush_tokens : places that a firing empties, what it puts there.
    code_start, code : conditions in postfix order, of the transitions (inputs, inhibitors, guard)
        and then of the observed; rows (TOKENS, place, count), (AT_LEAST, k, terms), (NOT, 0, 0)
        and (REQUIRE, 0, 0), which ends a false conjunction at once.
    reader_start, reader : conditions (transitions, then observed) that look at a place.
    stack : depth that the deepest condition needs.
    start, end : window.
    """

    marking: NDArray[np.int64]
    kind: NDArray[np.int64]
    delay: NDArray[np.float64]
    rate: NDArray[np.float64]
    weight: NDArray[np.float64]
    priority: NDArray[np.int64]
    age: NDArray[np.bool_]
    immediates: NDArray[np.int64]
    timed: NDArray[np.int64]
    change_start: NDArray[np.int64]
    change_place: NDArray[np.int64]
    change_tokens: NDArray[np.int64]
    flush_start: NDArray[np.int64]
    flush_place: NDArray[np.int64]
    flush_tokens: NDArray[np.int64]
    code_start: NDArray[np.int64]
    code: NDArray[np.int64]
    reader_start: NDArray[np.int64]
    reader: NDArray[np.int64]
    stack: int
    start: float
    end: float


@compiled
def _holds(
    code_start: NDArray[np.int64],
    code: NDArray[np.int64],
    condition: int,
    tokens: NDArray[np.int64],
    stack: NDArray[np.int64],
) -> bool:
    top = 0
    for i in range(code_start[condition], code_start[condition + 1]):
        op = code[i, 0]
        if op == TOKENS:
            stack[top] = tokens[code[i, 1]] >= code[i, 2]
            top += 1
        elif op == REQUIRE:
            top -= 1
            if stack[top] == 0:
                return False
        elif op == NOT:
            stack[top - 1] = 1 - stack[top - 1]
        else:
            count = 0
            for _ in range(code[i, 2]):
                top -= 1
                count += stack[top]
            stack[top] = count >= code[i, 1]
            top += 1
    return True


@compiled
def _overlap(start: float, end: float, since: float, until: float) -> float:
    """Part of an interval that lies in the window."""
    return max(0.0, min(until, end) - max(since, start))


@compiled
def _fire(
    net: NetProgram,
    t: int,
    now: float,
    tokens: NDArray[np.int64],
    since: NDArray[np.float64],
    token_time: NDArray[np.float64],
    dirty: NDArray[np.bool_],
    on: NDArray[np.bool_],
    stack: NDArray[np.int64],
) -> None:
    changes = net.change_start[t + 1] - net.change_start[t]
    flushes = net.flush_start[t + 1] - net.flush_start[t]
    for i in range(changes + flushes):
        if i < changes:
            j = net.change_start[t] + i
            place, change = net.change_place[j], net.change_tokens[j]
        else:
            j = net.flush_start[t] + i - changes
            place = net.flush_place[j]
            change = net.flush_tokens[j] - tokens[place]
        if change == 0:
            continue
        token_time[place] += tokens[place] * _overlap(net.start, net.end, since[place], now)
        since[place] = now
        tokens[place] += change
        for j in range(net.reader_start[place], net.reader_start[place + 1]):
            dirty[net.reader[j]] = True
    code_start, code = net.code_start, net.code
    for other in range(len(on)):
        if dirty[other]:
            on[other] = _holds(code_start, code, other, tokens, stack)
            dirty[other] = False


@compiled
def _next_immediate(net: NetProgram, on: NDArray[np.bool_], rng: np.random.Generator) -> int:
    """Enabled immediate transition of the highest priority, by weight among equals; -1: none."""
    for i in range(len(net.immediates)):
        t = net.immediates[i]
        if not on[t]:
            continue
        total, rivals, last = net.weight[t], 0, i
        for j in range(i + 1, len(net.immediates)):
            other = net.immediates[j]
            if net.priority[other] != net.priority[t]:
                break
            if on[other]:
                total += net.weight[other]
                rivals += 1
                last = j
        if rivals == 0:
            return int(t)
        u = rng.random() * total
        for j in range(i, last):
            other = net.immediates[j]
            if on[other]:
                if u < net.weight[other]:
                    return int(other)
                u -= net.weight[other]
        return int(net.immediates[last])
    return -1


@compiled
def _set_timers(
    net: NetProgram,
    now: float,
    on: NDArray[np.bool_],
    expiry: NDArray[np.float64],
    remaining: NDArray[np.float64],
    rng: np.random.Generator,
) -> int:
    """Start and stop timers by what is enabled; returns the one that ends first, -1 for none."""
    first = -1
    for t in net.timed:
        if on[t] and expiry[t] == math.inf:
            if net.kind[t] == EXPONENTIAL:
                expiry[t] = now + rng.standard_exponential() / net.rate[t]
            else:
                expiry[t] = now + remaining[t]
        elif not on[t] and expiry[t] < math.inf:
            remaining[t] = expiry[t] - now if net.age[t] else net.delay[t]
            expiry[t] = math.inf
        if expiry[t] < math.inf and (first < 0 or expiry[t] < expiry[first]):
            first = t
    return first


@compiled
def run_net(
    net: NetProgram,
    rng: np.random.Generator,
    token_time: NDArray[np.float64],
    true_time: NDArray[np.float64],
    onsets: NDArray[np.int64],
    at_end: NDArray[np.bool_],
) -> tuple[int, int]:
    """Simulate len(token_time) histories.

    Parameters
    ----------
    net, rng : the net and the source of all randomness.
    token_time : (histories, places), zeros; filled with tokens times ticks in the window.
    true_time, onsets, at_end : (histories, observed), zeros; filled with ticks true in the
        window, number of onsets in it, truth at its end. A marking that lasts no time is not
        observed.

    Returns
    -------
    Number of firings, and -1 or the transition that fired last when time stopped passing.
    """
    transitions, observed = len(net.kind), true_time.shape[1]
    tokens = np.zeros(len(net.marking), np.int64)
    since = np.zeros(len(net.marking))
    on = np.zeros(transitions, np.bool_)
    expiry = np.zeros(transitions)
    remaining = np.zeros(transitions)
    dirty = np.zeros(transitions + observed, np.bool_)
    true_since = np.zeros(observed)
    stack = np.zeros(net.stack, np.int64)
    firings = 0
    for h in range(len(token_time)):
        tokens[:] = net.marking
        since[:] = 0.0
        dirty[:] = False
        dirty[transitions:] = True
        for t in range(transitions):
            on[t] = _holds(net.code_start, net.code, t, tokens, stack)
        expiry[:] = math.inf
        remaining[:] = net.delay
        now, at_once = 0.0, 0
        while True:
            t = _next_immediate(net, on, rng)
            if t < 0:
                t = _set_timers(net, now, on, expiry, remaining, rng)
                upcoming = expiry[t] if t >= 0 else math.inf
                if upcoming > now:
                    for o in range(observed):
                        if dirty[transitions + o]:
                            dirty[transitions + o] = False
                            true = _holds(net.code_start, net.code, transitions + o, tokens, stack)
                            if true and not at_end[h, o]:
                                true_since[o] = now
                                onsets[h, o] += now > 0.0 and net.start <= now < net.end
                            elif at_end[h, o] and not true:
                                true_time[h, o] += _overlap(net.start, net.end, true_since[o], now)
                            at_end[h, o] = true
                    at_once = 0
                    if upcoming >= net.end:
                        break
                now = upcoming
                expiry[t] = math.inf
                remaining[t] = net.delay[t]
            _fire(net, t, now, tokens, since, token_time[h], dirty, on, stack)
            firings += 1
            at_once += 1
            if at_once > MOST_FIRINGS:
                return firings, t
        for p in range(len(tokens)):
            token_time[h, p] += tokens[p] * _overlap(net.start, net.end, since[p], net.end)
        for o in range(observed):
            if at_end[h, o]:
                true_time[h, o] += _overlap(net.start, net.end, true_since[o], net.end)
    return firings, -1
