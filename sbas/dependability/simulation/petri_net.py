"""Dynamic stochastic Petri nets as plain data: places, arcs, guards, three types of transitions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from sbas.exceptions import ModelError

# --- conditions on the marking ----------------------------------------------------------------


@dataclass(frozen=True)
class Tokens:
    """True while a place holds `at_least` tokens or more."""

    place: str
    at_least: int = 1


@dataclass(frozen=True)
class AtLeastOf:
    """True while k or more of the terms are; k = 0 always is."""

    k: int
    terms: tuple[Condition, ...]


@dataclass(frozen=True)
class NotOf:
    """True while its term is false."""

    term: Condition


Condition = Tokens | AtLeastOf | NotOf


def all_of(*terms: Condition) -> Condition:
    """True while all terms are; without terms always."""
    return terms[0] if len(terms) == 1 else AtLeastOf(len(terms), terms)


def any_of(*terms: Condition) -> Condition:
    """True while any term is; without terms never."""
    return terms[0] if len(terms) == 1 else AtLeastOf(1, terms)


# --- the net ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """A place and its tokens at the start."""

    name: str
    tokens: int = 0


@dataclass(frozen=True)
class Arc:
    """Tokens that an input takes, an output gives; an inhibitor bars from so many on."""

    place: str
    tokens: int = 1


@dataclass(frozen=True, kw_only=True)
class Transition:
    """What all transitions have.

    A transition is enabled while every input place holds its tokens, no inhibitor place does and
    the guard is true. It takes from inputs, empties the places of `flushes`, gives to outputs.
    """

    name: str
    inputs: tuple[Arc, ...] = ()
    outputs: tuple[Arc, ...] = ()
    inhibitors: tuple[Arc, ...] = ()
    flushes: tuple[str, ...] = ()
    guard: Condition | None = None


@dataclass(frozen=True, kw_only=True)
class Immediate(Transition):
    """Type 1: fires at once; the highest priority first, among equals by weight."""

    priority: int = 1
    weight: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Delay(Transition):
    """Type 2: fires after a constant time of being enabled.

    Parameters
    ----------
    seconds : the delay [s], 0 or more.
    memory : "enabling" forgets the time passed when it is disabled, "age" keeps it.
    turn : among delays that end at one instant the lower turn fires first, then the earlier in
        the net; immediate transitions fire in between. A sampling clock has turn 0, what must
        find the marking of that sample settled has turn 1.
    """

    seconds: float
    memory: Literal["enabling", "age"] = "enabling"
    turn: int = 1


@dataclass(frozen=True, kw_only=True)
class Exponential(Transition):
    """Type 3: fires at a constant rate [1/h] while enabled."""

    rate_per_h: float


@dataclass(frozen=True)
class PetriNet:
    """A net, and what is observed of it in a window of time.

    Parameters
    ----------
    name : of the net.
    places : with the initial marking.
    transitions : in the order that settles ties; one server each, race policy.
    end_s, start_s : means and first passages are those of start <= t < end [s]; the net runs
        from 0.
    observed : conditions with names.
    """

    name: str
    places: tuple[Place, ...]
    transitions: tuple[Immediate | Delay | Exponential, ...]
    end_s: float
    start_s: float = 0.0
    observed: tuple[tuple[str, Condition], ...] = ()


def terms_of(condition: Condition) -> Iterator[Condition]:
    """A condition and all that it is made of, a term as often as it stands there."""
    yield condition
    match condition:
        case AtLeastOf():
            for term in condition.terms:
                yield from terms_of(term)
        case NotOf():
            yield from terms_of(condition.term)


def places_of(condition: Condition) -> Iterator[str]:
    """Places that a condition looks at."""
    return (term.place for term in terms_of(condition) if isinstance(term, Tokens))


def check_net(net: PetriNet) -> None:
    """Refuse a net that means nothing.

    Raises
    ------
    ModelError : a name unknown or used twice, a negative or infinite number, an empty window;
        `where` is the part of the net.
    """
    if not 0.0 <= net.start_s < net.end_s < math.inf:
        raise ModelError(
            "a window ends after it starts", where="start_s, end_s",
            evidence=f"{net.start_s!r} to {net.end_s!r}",
        )  # fmt: skip
    places = {place.name for place in net.places}
    for key, names in (
        ("places", [p.name for p in net.places]),
        ("transitions", [t.name for t in net.transitions]),
        ("observed", [name for name, _ in net.observed]),
    ):
        twice = [name for name, times in Counter(names).items() if times > 1]
        if twice:
            raise ModelError("names are unique", where=key, evidence=", ".join(twice))
    for place in net.places:
        _whole(place.tokens, 0, f"places.{place.name}.tokens")
    for transition in net.transitions:
        _check_transition(transition, places)
    for name, condition in net.observed:
        _check_condition(condition, places, f"observed.{name}")


def _check_transition(transition: Immediate | Delay | Exponential, places: set[str]) -> None:
    where = f"transitions.{transition.name}"
    for key in ("inputs", "outputs", "inhibitors"):
        arcs: tuple[Arc, ...] = getattr(transition, key)
        if len({arc.place for arc in arcs}) < len(arcs):
            raise ModelError(
                "two arcs of one kind at one place", where=f"{where}.{key}",
                evidence=", ".join(arc.place for arc in arcs),
                cure="write one arc with the sum of the tokens",
            )  # fmt: skip
        for arc in arcs:
            _known(arc.place, places, f"{where}.{key}")
            _whole(arc.tokens, 1, f"{where}.{key}.{arc.place}.tokens")
    for name in transition.flushes:
        _known(name, places, f"{where}.flushes")
    if transition.guard is not None:
        _check_condition(transition.guard, places, f"{where}.guard")
    match transition:
        case Immediate():
            _whole(transition.priority, 0, f"{where}.priority")
            _positive(transition.weight, f"{where}.weight")
        case Delay():
            _whole(transition.turn, 0, f"{where}.turn")
            if transition.seconds != 0.0:
                _positive(transition.seconds, f"{where}.seconds")
            if transition.memory not in ("enabling", "age"):
                raise ModelError(
                    'memory is "enabling" or "age"', where=where, evidence=repr(transition.memory)
                )
        case Exponential():
            _positive(transition.rate_per_h, f"{where}.rate_per_h")


def _check_condition(condition: Condition, places: set[str], where: str) -> None:
    match condition:
        case Tokens():
            _known(condition.place, places, where)
            _whole(condition.at_least, 0, where)
        case AtLeastOf():
            _whole(condition.k, 0, where)
            for term in condition.terms:
                _check_condition(term, places, where)
        case NotOf():
            _check_condition(condition.term, places, where)
        case _:
            raise ModelError("this is no condition", where=where, evidence=repr(condition))


def _known(name: str, places: set[str], where: str) -> None:
    if name not in places:
        raise ModelError(
            "no place of that name", where=where, evidence=repr(name),
            cure=f"one of {', '.join(sorted(places))}",
        )  # fmt: skip


def _whole(value: object, least: int, where: str) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise ModelError(f"a whole number, {least} or more", where=where, evidence=repr(value))


def _positive(value: float, where: str) -> None:
    if not 0.0 < value < math.inf:
        raise ModelError("a number above 0, finite", where=where, evidence=repr(value))
