"""Histories of a Petri net, and what they say about its places and observed conditions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.simulation.petri_net import (
    Arc,
    AtLeastOf,
    Condition,
    Delay,
    Exponential,
    Immediate,
    NotOf,
    PetriNet,
    Tokens,
    Transition,
    check_net,
    places_of,
)
from sbas.dependability.simulation.simulation_result import (
    PlaceMean,
    Simulation,
    Stratum,
    Tally,
    estimate_rows,
)
from sbas.exceptions import InputError, ModelError

if TYPE_CHECKING:
    from sbas.dependability.simulation.petri_kernel import NetProgram

CHUNK = 5_000
MOST_TICKS = 2**50
"""Sums of whole ticks are exact in double precision up to 2^53."""


def simulate_net(net: PetriNet, *, histories: int, rng: np.random.Generator) -> Simulation:
    """Simulate a Petri net.

    Parameters
    ----------
    net : any that `check_net` accepts.
    histories : number of runs, 2 or more.
    rng : source of all randomness; its children of `spawn` are used.

    Returns
    -------
    Simulation: for each observed condition the share of time, truth at the end, at least once
    (for more than no time), onsets, all within the window; for each place its mean tokens.

    Raises
    ------
    ModelError : the net means nothing, or more than 100 000 transitions fire at one instant.
    InputError : fewer than 2 histories, or times without a common tick.

    Notes
    -----
    Race policy, one server a transition. Immediate transitions fire until none is enabled; then
    timers of transitions that became enabled start, those of disabled ones stop, one that stays
    enabled keeps its time; then the timer that ends first fires, at one instant by turn and
    order in the net. Constant delays are whole numbers of a common tick, so that equal times are
    equal. A guard is looked at again only when a place that it reads changed.

    References
    ----------
    Ajmone Marsan and Chiola 1987, deterministic and stochastic Petri nets.
    """
    from sbas.dependability.simulation.petri_kernel import MOST_FIRINGS, run_net

    check_net(net)
    if histories < 2:
        raise InputError("a standard error takes 2 histories or more", where="histories")
    program = _compile(net)
    window = program.end - program.start
    tally = Tally(len(net.observed))
    tokens, squares = np.zeros((2, len(net.places)))
    firings = 0
    for i, child in enumerate(rng.spawn(-(-histories // CHUNK))):
        size = min(CHUNK, histories - i * CHUNK)
        token_time = np.zeros((size, len(net.places)))
        true_time = np.zeros((size, len(net.observed)))
        onsets = np.zeros(true_time.shape, np.int64)
        at_end = np.zeros(true_time.shape, np.bool_)
        fired, culprit = run_net(program, child, token_time, true_time, onsets, at_end)
        if culprit >= 0:
            raise ModelError(
                f"more than {MOST_FIRINGS} transitions fire at one instant",
                where=f"transitions.{net.transitions[culprit].name}",
                cure="a cycle of immediate transitions or of delays of 0 s needs a way out",
            )
        firings += fired
        tally.add(true_time / window, at_end, true_time > 0.0, onsets)
        tokens += (token_time / window).sum(axis=0)
        squares += np.square(token_time / window).sum(axis=0)
    whole = Stratum((), (), 1.0, histories)
    names = [name for name, _ in net.observed]
    rows = estimate_rows(
        names, [whole], [tally],
        possible=np.ones((1, len(names)), np.bool_), unsampled=np.zeros(len(names)),
    )  # fmt: skip
    means = tokens / histories
    errors = np.sqrt((squares / histories - means**2).clip(min=0.0) / (histories - 1))
    places = tuple(
        PlaceMean(place.name, float(mean), float(error))
        for place, mean, error in zip(net.places, means, errors, strict=True)
    )
    return Simulation(net.name, "time", (whole,), rows, firings=firings, places=places)


# --- flat arrays ------------------------------------------------------------------------------


def _compile(net: PetriNet) -> NetProgram:
    from sbas.dependability.simulation.petri_kernel import DELAY, EXPONENTIAL, IMMEDIATE, NetProgram

    transitions = net.transitions
    index = {place.name: i for i, place in enumerate(net.places)}
    tick = tick_s(net)
    kind = np.zeros(len(transitions), np.int64)
    turn, priority = np.zeros((2, len(transitions)), np.int64)
    delay, rate, weight = np.zeros((3, len(transitions)))
    age = np.zeros(len(transitions), np.bool_)
    for i, transition in enumerate(transitions):
        match transition:
            case Immediate():
                kind[i] = IMMEDIATE
                priority[i], weight[i] = transition.priority, transition.weight
            case Delay():
                kind[i], turn[i] = DELAY, transition.turn
                delay[i] = int(_exact(transition.seconds) / tick)
                age[i] = transition.memory == "age"
            case Exponential():
                # At equal times, which have probability 0, after every delay.
                kind[i], turn[i] = EXPONENTIAL, np.iinfo(np.int64).max
                rate[i] = transition.rate_per_h / 3600.0 * float(tick)
    conditions = [[*_needs(t)] for t in transitions] + [[c] for _, c in net.observed]
    code_start, code = _flatten(conditions, index)
    readers: list[set[int]] = [set() for _ in net.places]
    for i, terms in enumerate(conditions):
        for place in {place for term in terms for place in places_of(term)}:
            readers[index[place]].add(i)
    reader_start, reader = _lists([sorted(part) for part in readers])
    effects = [_effect(t) for t in transitions]
    change_start, change_place, change_tokens = _arcs([effect[0] for effect in effects], index)
    flush_start, flush_place, flush_tokens = _arcs([effect[1] for effect in effects], index)
    immediates = [i for i in range(len(transitions)) if kind[i] == IMMEDIATE]
    timed = [i for i in range(len(transitions)) if kind[i] != IMMEDIATE]
    return NetProgram(
        marking=np.array([place.tokens for place in net.places], np.int64),
        kind=kind,
        delay=delay,
        rate=rate,
        weight=weight,
        priority=priority,
        age=age,
        immediates=np.array(sorted(immediates, key=lambda i: -priority[i]), np.int64),
        timed=np.array(sorted(timed, key=lambda i: turn[i]), np.int64),
        change_start=change_start,
        change_place=change_place,
        change_tokens=change_tokens,
        flush_start=flush_start,
        flush_place=flush_place,
        flush_tokens=flush_tokens,
        code_start=code_start,
        code=code,
        reader_start=reader_start,
        reader=reader,
        stack=len(code) + 1,
        start=float(_exact(net.start_s) / tick),
        end=float(_exact(net.end_s) / tick),
    )


def tick_s(net: PetriNet) -> Fraction:
    """Largest time of which every constant delay and both ends of the window are multiples [s].

    Raises
    ------
    InputError : the window would have more than 2^50 ticks.
    """
    times = [_exact(t.seconds) for t in net.transitions if isinstance(t, Delay)]
    times += [_exact(net.start_s), _exact(net.end_s)]
    common = math.lcm(*(time.denominator for time in times))
    tick = Fraction(math.gcd(*(int(time * common) for time in times)), common)
    if max(times) / tick > MOST_TICKS:
        raise InputError(
            "times without a common tick that doubles can count", where="seconds",
            evidence=f"common tick {float(tick):g} s", cure="write delays with fewer digits",
        )  # fmt: skip
    return tick


def _exact(seconds: float) -> Fraction:
    """The decimal number that was written, not the binary one next to it."""
    return Fraction(repr(float(seconds)))


def _effect(transition: Transition) -> tuple[tuple[Arc, ...], tuple[Arc, ...]]:
    """Changes of a firing, none where it gives back what it takes; tokens in flushed places."""
    change, given = Counter[str](), Counter[str]()
    for arc in transition.outputs:
        given[arc.place] += arc.tokens
        change[arc.place] += arc.tokens
    for arc in transition.inputs:
        change[arc.place] -= arc.tokens
    flushed = dict.fromkeys(transition.flushes)
    return (
        tuple(Arc(place, n) for place, n in change.items() if n and place not in flushed),
        tuple(Arc(place, given[place]) for place in flushed),
    )


def _arcs(
    lists: Sequence[Sequence[Arc]], index: dict[str, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    start, places = _lists([[index[arc.place] for arc in part] for part in lists])
    return start, places, _lists([[arc.tokens for arc in part] for part in lists])[1]


def _lists(lists: Sequence[Sequence[int]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    start = np.cumsum([0, *map(len, lists)], dtype=np.int64)
    return start, np.array([x for part in lists for x in part], np.int64)


def _needs(transition: Transition) -> Iterator[Condition]:
    """All that must hold for a transition to be enabled."""
    for arc in transition.inputs:
        yield Tokens(arc.place, arc.tokens)
    for arc in transition.inhibitors:
        yield NotOf(Tokens(arc.place, arc.tokens))
    if transition.guard is not None:
        yield from _conjuncts(transition.guard)


def _conjuncts(condition: Condition) -> Iterator[Condition]:
    if isinstance(condition, AtLeastOf) and condition.k == len(condition.terms):
        for term in condition.terms:
            yield from _conjuncts(term)
    else:
        yield condition


def _flatten(
    conditions: Sequence[Sequence[Condition]], index: dict[str, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Postfix code of conjunctions, and where each starts."""
    from sbas.dependability.simulation.petri_kernel import REQUIRE

    code: list[tuple[int, int, int]] = []
    start = [0]
    for terms in conditions:
        for term in terms:
            _postfix(term, index, code)
            code.append((REQUIRE, 0, 0))
        start.append(len(code))
    return np.array(start, np.int64), np.array(code, np.int64).reshape(-1, 3)


def _postfix(condition: Condition, index: dict[str, int], code: list[tuple[int, int, int]]) -> None:
    from sbas.dependability.simulation.petri_kernel import AT_LEAST, NOT, TOKENS

    match condition:
        case Tokens():
            code.append((TOKENS, index[condition.place], condition.at_least))
        case AtLeastOf():
            for term in condition.terms:
                _postfix(term, index, code)
            code.append((AT_LEAST, condition.k, len(condition.terms)))
        case NotOf():
            _postfix(condition.term, index, code)
            code.append((NOT, 0, 0))
