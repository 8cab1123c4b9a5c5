"""Petri nets as projects of the GreatSPN editor (PNPRO): guards and flushes written with arcs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from sbas.dependability.exchange.identifiers import TakenNames
from sbas.dependability.exchange.losses import Exported, Loss, LossReport
from sbas.dependability.exchange.marking_cases import Bounds, Cases, separate_cases
from sbas.dependability.simulation.petri_net import (
    Delay,
    Exponential,
    Immediate,
    PetriNet,
    check_net,
)

_COLUMNS = 20


def pnpro_text(net: PetriNet) -> Exported:
    """A Petri net as a project of the GreatSPN editor.

    Parameters
    ----------
    net : times become seconds: `delay` of an EXP transition holds its rate per second, that of
        a GEN transition a constant, "I[6.0]".

    Returns
    -------
    Exported: the project; the report names what GreatSPN reads otherwise.

    Raises
    ------
    ModelError : an invalid net, or a guard with too many cases for arcs.

    Notes
    -----
    A guard that is one conjunction becomes test and inhibitor arcs; any other becomes a place
    that two sets of immediate transitions keep up to date, so that a timer does not see a
    change of case. A flush is done by immediate transitions above all others, before the
    outputs are given. Ties between delays and the memory "age" cannot be said.

    References
    ----------
    GreatSPN editor, PNPRO (read by Storm: GreatSpnEditorProjectParser); I[T] not verified there.
    """
    check_net(net)
    writer = _Writer(net)
    for transition in net.transitions:
        writer.add(transition)
    rows = [
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
        f'<project name={quoteattr(net.name)} version="121">',
        f'<gspn name={quoteattr(_identifier(net.name))} show-color-cmd="false" '
        'show-fluid-cmd="false">',
        "<nodes>",
        *writer.nodes,
        "</nodes>",
        "<edges>",
        *writer.edges,
        "</edges>",
        "</gspn>",
        "</project>",
    ]
    losses = list(writer.losses)
    losses += [
        Loss(name, "observed condition", "refused", "a project has no place for it: ask anew")
        for name, _ in net.observed
    ]
    if any(isinstance(t, Delay) for t in net.transitions):
        losses.append(
            Loss(
                net.name,
                "order of delays at one instant",
                "approximated",
                "GreatSPN fires simultaneous delays in an order of its own",
            )
        )
    return Exported("\n".join(rows) + "\n", LossReport("PNPRO", tuple(losses)))


@dataclass
class _Writer:
    """Nodes and edges as they come."""

    net: PetriNet
    nodes: list[str] = field(default_factory=list)
    edges: list[str] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)

    def __post_init__(self) -> None:
        immediate = [t.priority for t in self.net.transitions if isinstance(t, Immediate)]
        # Above all of the net's own: first flushes, then guards.
        self._flush = max(immediate, default=0) + 3
        self._guard = self._flush - 1
        self._taken = TakenNames()
        self._places = {p.name: self._place(p.name, p.tokens) for p in self.net.places}

    def add(self, transition: Immediate | Delay | Exponential) -> None:
        """One transition, its guard and its flushes."""
        where = f"transitions.{transition.name}"
        held: Bounds = {}
        guard_place = None
        if transition.guard is not None:
            cases = separate_cases(transition.guard, where)
            if not cases.true:
                self.losses.append(
                    Loss(transition.name, "transition", "refused", "left out: it never fires")
                )
                return
            if len(cases.true) == 1:
                held = cases.true[0]
            else:
                guard_place = self._keep_guard(transition.name, cases)
        name = self._name(transition.name)
        self._transition(name, self._kind(transition))
        inputs = [(self._places[arc.place], arc.tokens) for arc in transition.inputs]
        outputs = [(self._places[arc.place], arc.tokens) for arc in transition.outputs]
        bars = [(self._places[arc.place], arc.tokens) for arc in transition.inhibitors]
        reads = [(self._places[p], low) for p, (low, _) in held.items() if low > 0]
        bars += [(self._places[p], high) for p, (_, high) in held.items() if high is not None]
        if guard_place is not None:
            reads.append((guard_place, 1))
        if transition.flushes:
            begun = self._place(f"{transition.name} flush", 0)
            self._arcs(name, inputs, [(begun, 1)], bars, reads)
            self._empty(transition.name, begun, transition.flushes, outputs)
        else:
            self._arcs(name, inputs, outputs, bars, reads)

    def _kind(self, transition: Immediate | Delay | Exponential) -> str:
        if isinstance(transition, Exponential):
            rate = transition.rate_per_h / 3600
            return f'type="EXP" delay="{rate:.17g}" nservers="1"'
        if isinstance(transition, Immediate):
            return (
                f'type="IMM" priority="{transition.priority + 1}" weight="{transition.weight:.17g}"'
            )
        if transition.memory == "age":
            self.losses.append(
                Loss(
                    transition.name,
                    "memory of a delay",
                    "approximated",
                    "a timer that is disabled begins anew instead of going on",
                )
            )
        return f'type="GEN" delay="I[{float(transition.seconds)!r}]" nservers="1"'

    def _keep_guard(self, owner: str, cases: Cases) -> str:
        """A place that holds a token while a guard is true."""
        place = self._place(f"{owner} guard", 0)
        for to, group in ((1, cases.true), (0, cases.false)):
            for bounds in group:
                name = self._name(f"{owner} guard {'on' if to else 'off'}")
                self._transition(name, f'type="IMM" priority="{self._guard}" weight="1"')
                reads = [(self._places[p], low) for p, (low, _) in bounds.items() if low > 0]
                bars = [
                    (self._places[p], high) for p, (_, high) in bounds.items() if high is not None
                ]
                if to:
                    self._arcs(name, [], [(place, 1)], [*bars, (place, 1)], reads)
                else:
                    self._arcs(name, [(place, 1)], [], bars, reads)
        return place

    def _empty(
        self, owner: str, begun: str, flushes: Iterable[str], outputs: list[tuple[str, int]]
    ) -> None:
        """Take all tokens out of places, then give the outputs."""
        places = list(dict.fromkeys(self._places[name] for name in flushes))
        style = f'type="IMM" priority="{self._flush}" weight="1"'
        for place in places:
            name = self._name(f"{owner} empties {place}")
            self._transition(name, style)
            self._arcs(name, [(place, 1)], [], [], [(begun, 1)])
        done = self._name(f"{owner} flushed")
        self._transition(done, style)
        self._arcs(done, [(begun, 1)], outputs, [(place, 1) for place in places], [])

    def _arcs(
        self,
        transition: str,
        inputs: list[tuple[str, int]],
        outputs: list[tuple[str, int]],
        bars: list[tuple[str, int]],
        reads: list[tuple[str, int]],
    ) -> None:
        takes: Counter[str] = Counter()
        gives: Counter[str] = Counter()
        for place, tokens in inputs:
            takes[place] += tokens
        for place, tokens in outputs:
            gives[place] += tokens
        for place, tokens in reads:
            # A test takes what is missing to its count and gives it back.
            missing = max(tokens - takes[place], 0)
            takes[place] += missing
            gives[place] += missing
        least: dict[str, int] = {}
        for place, tokens in bars:
            least[place] = min(tokens, least.get(place, tokens))
        self.edges += [_arc(place, transition, "INPUT", n) for place, n in takes.items() if n]
        self.edges += [_arc(transition, place, "OUTPUT", n) for place, n in gives.items() if n]
        self.edges += [_arc(place, transition, "INHIBITOR", n) for place, n in least.items()]

    def _place(self, name: str, tokens: int) -> str:
        own = self._name(name)
        self.nodes.append(f'<place marking="{tokens}" name="{own}" {self._where()}/>')
        return own

    def _transition(self, name: str, kind: str) -> None:
        self.nodes.append(f'<transition name="{name}" {kind} {self._where()}/>')

    def _where(self) -> str:
        row, column = divmod(len(self.nodes), _COLUMNS)
        return f'x="{5.0 * column + 2}" y="{4.0 * row + 2}"'

    def _name(self, wish: str) -> str:
        return self._taken.new(_identifier(wish), "_")


def _identifier(name: str) -> str:
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if plain[:1].isalpha() else f"n_{plain}"


def _arc(tail: str, head: str, kind: str, tokens: int) -> str:
    # An inhibitor runs from the place too.
    multiple = "" if tokens == 1 else f' mult="{tokens}"'
    return f'<arc head="{head}" kind="{kind}" tail="{tail}"{multiple}/>'
