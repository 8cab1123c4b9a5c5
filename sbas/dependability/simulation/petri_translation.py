"""A hybrid fault tree as a dynamic stochastic Petri net.

Every component, source and gate with memory has a few places. A sampling clock gives each of
them a token once an epoch, and priorities let them move in the order of the model: hardware,
sources, gates after their inputs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import islice
from typing import Any, Literal

from sbas.dependability.simulation.petri_net import (
    Arc,
    AtLeastOf,
    Condition,
    Delay,
    Exponential,
    Immediate,
    NotOf,
    PetriNet,
    Place,
    Tokens,
    all_of,
    any_of,
    terms_of,
)
from sbas.dependability.simulation.slot_program import hold_of, restart_law
from sbas.dependability.tree.durations import duration_epochs, whole_epochs
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.model_check import check_model, in_order
from sbas.exceptions import InputError

MOST_TERMS = 100_000
"""Of one condition: gates without memory are written out wherever they are read."""

FIRST, CLOCK, LAST = 0, 1, 2
"""Turns at an instant: waits that end at an epoch, the clock, what finds the epoch settled."""


def petri_net_of(
    model: HybridFaultTree, *, hardware: Literal["sampled", "continuous"] = "sampled"
) -> PetriNet:
    """Translate a model into a net that observes every event and gate.

    Parameters
    ----------
    model : any that `check_model` accepts, with the mean rule "epochs".
    hardware : "sampled" moves components, sources and gates at the sampling instants and has
        exactly the law of the model; "continuous" lets hardware and what depends on it react at
        once, as in the paper, which moves results by about one epoch.

    Returns
    -------
    PetriNet: its window starts one step after 0 and lasts the mission, so that the share of time
    is the mean over the epochs 1..N.

    Raises
    ------
    ModelError : the model means nothing.
    InputError : another mean rule, an unknown `hardware`, conditions of more than 100 000 terms.

    Notes
    -----
    Component: places OK and failed. Source: a place a state, down, waiting, ready. DUR and causal
    AND: idle, timing (constant delay), ripe, out. PAND: 0, L, R, B a pair. CON: a counter that a
    false input flushes. Sampled timers end before the clock of their epoch and are taken up by
    it, so that an input that ends at that epoch gives no output of no length.

    References
    ----------
    Nguyen, Beugin, Marais 2013, Figs 3 to 5 (hal-00930588).
    """
    check_model(model)
    if hardware not in ("sampled", "continuous"):
        raise InputError(
            'hardware is "sampled" or "continuous"', where="hardware", evidence=repr(hardware)
        )
    if model.options.mean_rule != "epochs":
        raise InputError(
            "a net gives the mean over epochs 1..N only", where="options.mean_rule",
            evidence=model.options.mean_rule, cure='mean_rule = "epochs"',
        )  # fmt: skip
    return _Builder(model, hardware == "sampled").net()


class _Builder:
    """Places and transitions gathered so far; each part has a priority below those before it."""

    def __init__(self, model: HybridFaultTree, sampled: bool) -> None:
        self.model, self.sampled = model, sampled
        self.gates = in_order(model)
        self.priority = 2 + sum(
            map(len, (model.components, model.sources, model.events, model.gates))
        )
        self.priority += sum(len(g.inputs) for g in model.gates)
        self.places = [Place("clock", 1)]
        self.transitions: list[Immediate | Delay | Exponential] = []
        self.ticked: list[str] = []
        self.truth: dict[str, Condition] = {}

    def net(self) -> PetriNet:
        model = self.model
        for component in model.components:
            self.priority -= 1
            self._component(component)
        for source in model.sources:
            self.priority -= 1
            self._source(source)
        for event in model.events:
            self.priority -= 1
            self._keep(event.name, self._event(event))
        for gate in self.gates:
            self.priority -= 1
            self._keep(gate.name, self._gate(gate))
        clock = Delay(
            name="clock", seconds=model.step_s, turn=CLOCK, inputs=(Arc("clock"),),
            outputs=(Arc("clock"), *map(Arc, self.ticked)),
        )  # fmt: skip
        return PetriNet(
            model.name,
            tuple(self.places),
            (clock, *self.transitions),
            end_s=self._seconds(model.epochs + 1),
            start_s=model.step_s,
            observed=tuple(self.truth.items()),
        )

    def _seconds(self, epochs: int) -> float:
        """Decimal multiples of the step: 3 steps of 0.1 s are 0.3 s, which a net can count."""
        return float(epochs * Fraction(repr(float(self.model.step_s))))

    def _keep(self, name: str, condition: Condition) -> None:
        if sum(1 for _ in islice(terms_of(condition), MOST_TERMS + 1)) > MOST_TERMS:
            raise InputError(
                f"a condition of more than {MOST_TERMS} terms", where=f"gates.{name}",
                cure="gates without memory share too many inputs for a net: use simulate_model",
            )  # fmt: skip
        self.truth[name] = condition

    def _add(self, *names: str, start: int = 0) -> None:
        """Places, the first with tokens."""
        self.places += [Place(name, start if i == 0 else 0) for i, name in enumerate(names)]

    def _tick(self, name: str, *, start: int = 0) -> tuple[Arc, ...]:
        """Input arc from a place that the clock fills."""
        self._add(f"{name} tick", start=start)
        self.ticked.append(f"{name} tick")
        return (Arc(f"{name} tick"),)

    def _gate_tick(self, name: str) -> tuple[Arc, ...]:
        """Gates with timers or order: once an epoch, from epoch 0 on, or at once."""
        return self._tick(name, start=1) if self.sampled else ()

    def _move(self, name: str, **fields: Any) -> None:
        self.transitions.append(Immediate(name=name, priority=self.priority, **fields))

    def _wait(self, name: str, seconds: float, begin: str, end: str, *, turn: int) -> None:
        self.transitions.append(
            Delay(name=name, seconds=seconds, turn=turn, inputs=(Arc(begin),), outputs=(Arc(end),))
        )

    # --- what moves ---------------------------------------------------------------------------

    def _component(self, component: Component) -> None:
        name, share = component.name, component.initially_failed
        ok, failed, start = f"{name} OK", f"{name} failed", f"{name} start"
        self._add(*((failed, ok) if share == 1.0 else (ok, failed)), start=int(share in (0.0, 1.0)))
        if 0.0 < share < 1.0:
            self._add(start, start=1)
            self._move(f"{name} starts", weight=1 - share, inputs=(Arc(start),), outputs=(Arc(ok),))
            self._move(
                f"{name} starts failed", weight=share, inputs=(Arc(start),), outputs=(Arc(failed),)
            )
        both = (
            (f"{name} fails", ok, failed, component.failure_rate_per_h),
            (f"{name} is repaired", failed, ok, component.repair_rate_per_h),
        )
        if not self.sampled:
            self.transitions += [
                Exponential(name=what, rate_per_h=rate, inputs=(Arc(a),), outputs=(Arc(b),))
                for what, a, b, rate in both if rate > 0.0
            ]  # fmt: skip
            return
        tick = self._tick(name)
        total = component.failure_rate_per_h + component.repair_rate_per_h
        for what, a, b, rate in both:
            p = -rate / total * math.expm1(-total * self.model.step_s / 3600.0) if rate else 0.0
            if p > 0.0:
                self._move(what, weight=p, inputs=(*tick, Arc(a)), outputs=(Arc(b),))
            if p < 1.0:
                self._move(f"not {what}", weight=1.0 - p, inputs=(*tick, Arc(a)), outputs=(Arc(a),))

    def _source(self, source: MarkovSource) -> None:
        name = source.name
        states = [f"{name} {i} {state}" for i, state in enumerate(source.states)]
        start, down, waiting, ready = (f"{name} {x}" for x in ("start", "down", "waiting", "ready"))
        works = all_of(*(Tokens(f"{c} OK") for c in source.guard))
        tick = self._tick(name)
        self._add(start, start=1)
        self._add(*states, down, waiting, ready)
        held = () if not self.sampled else tick
        self._scatter(f"{name} starts", (Arc(start),), states, source.initial, works)
        anywhere = (start, *states, waiting, ready)
        self._move(
            f"{name} down", inputs=held, flushes=(*anywhere, down), outputs=(Arc(down),),
            guard=all_of(NotOf(works), any_of(*map(Tokens, (*anywhere, *(down,) * self.sampled)))),
        )  # fmt: skip
        self._move(
            f"{name} starts down", inputs=(Arc(start),), outputs=(Arc(down),), guard=NotOf(works)
        )
        unused = all_of(works, Tokens(waiting))
        if not self.sampled:
            unused = NotOf(any_of(*map(Tokens, (start, *states))))
        self._move(f"{name} idle", inputs=tick, guard=unused)
        restart_from = down
        wait = whole_epochs(source.first_fix_s, self.model.step_s) or 0
        if wait:
            restart_from = ready
            self._move(
                f"{name} waits", inputs=(*held, Arc(down)), outputs=(Arc(waiting),), guard=works
            )
            self._wait(
                f"{name} first fix", self._seconds(wait), waiting, ready,
                turn=FIRST if self.sampled else LAST,
            )  # fmt: skip
        profile = [(s.seconds, s.rows) for s in source.stages] or [(0.0, source.rows)]
        for g, (seconds, rows) in enumerate(profile):
            stage = f"{name} stage {g}"
            guard = works
            if len(profile) > 1:
                self._add(stage, start=int(g == 0))
                guard = all_of(works, Tokens(stage))
                if g + 1 < len(profile):
                    length = self._seconds(whole_epochs(seconds, self.model.step_s) or 0)
                    self._wait(f"{stage} ends", length, stage, f"{name} stage {g + 1}", turn=LAST)
            for state, row in zip(states, rows, strict=True):
                self._scatter(f"{stage} {state}", (*tick, Arc(state)), states, row, guard)
            law = restart_law(source, rows).tolist()
            self._scatter(f"{stage} first fix", (*held, Arc(restart_from)), states, law, guard)

    def _scatter(
        self, name: str, inputs: tuple[Arc, ...], places: Sequence[str], law: Sequence[float],
        guard: Condition,
    ) -> None:  # fmt: skip
        """One move to one of the places by a law."""
        for place, p in zip(places, law, strict=True):
            if p > 0.0:
                self._move(
                    f"{name} to {place}", weight=p, inputs=inputs, outputs=(Arc(place),),
                    guard=guard,
                )  # fmt: skip

    # --- what is observed of it ---------------------------------------------------------------

    def _event(self, event: Event) -> Condition:
        match event:
            case Failed():
                return Tokens(f"{event.component} failed")
            case InState():
                return self._in_state(event)
            case House():
                return AtLeastOf(0 if event.value else 1, ())
            case Undeveloped():
                return self._undeveloped(event)

    def _in_state(self, event: InState) -> Condition:
        source = next(s for s in self.model.sources if s.name == event.source)
        found = [
            f"{source.name} {i} {state}"
            for i, state in enumerate(source.states)
            if state in event.states
        ]
        if source.down in event.states:
            found.append(f"{source.name} down")
        if (source.waiting or source.down) in event.states:
            found += [f"{source.name} waiting", f"{source.name} ready"]
        return any_of(*map(Tokens, found))

    def _undeveloped(self, event: Undeveloped) -> Condition:
        if event.probability in (0.0, 1.0):
            return AtLeastOf(1 - int(event.probability), ())
        start, true = f"{event.name} start", f"{event.name} true"
        self._add(start, true, start=1)
        p = event.probability
        self._move(f"{event.name} is so", weight=p, inputs=(Arc(start),), outputs=(Arc(true),))
        self._move(f"{event.name} is not so", weight=1.0 - p, inputs=(Arc(start),))
        return Tokens(true)

    # --- gates --------------------------------------------------------------------------------

    def _gate(self, gate: Gate) -> Condition:
        inputs = tuple(self.truth[name] for name in gate.inputs)
        match gate:
            case Or():
                return any_of(*inputs)
            case And():
                return all_of(*inputs)
            case Not():
                return NotOf(inputs[0])
            case AtLeast():
                return AtLeastOf(gate.k, inputs)
            case Con():
                return self._con(gate, inputs[0])
            case Dur() | CausalAnd():
                return self._dur(gate, all_of(*inputs))
            case Pand():
                left = inputs[0]
                latched = self.model.options.pand_latched if gate.latched is None else gate.latched
                for i, right in enumerate(inputs[1:]):
                    self.priority -= 1
                    holds = latched and i == len(inputs) - 2
                    left = self._pand(gate, f"{gate.name} {i}", left, right, latched=holds)
                return left

    def _con(self, gate: Con, x: Condition) -> Condition:
        name, counter = gate.name, f"{gate.name} counter"
        tick = self._tick(name, start=1)
        self._add(counter)
        hold = hold_of(self.model, gate)
        free: tuple[Condition, ...] = ()
        if hold is not None:
            held = self._in_state(hold)
            free = (NotOf(held),)
            self._move(f"{name} skips", inputs=tick, guard=held)
        full = Tokens(counter, gate.count)
        self._move(
            f"{name} counts", inputs=tick, outputs=(Arc(counter),),
            inhibitors=(Arc(counter, gate.count),), guard=all_of(x, *free),
        )  # fmt: skip
        self._move(f"{name} stays full", inputs=tick, guard=all_of(x, full, *free))
        self._move(f"{name} ends", inputs=tick, flushes=(counter,), guard=all_of(NotOf(x), *free))
        return all_of(full, *free)

    def _dur(self, gate: Dur | CausalAnd, x: Condition) -> Condition:
        name = gate.name
        idle, timing, ripe, out = (f"{name} {part}" for part in ("idle", "timing", "ripe", "out"))
        rule = gate.rule or self.model.options.dur_rule
        epochs = duration_epochs(gate.seconds, self.model.step_s, rule)
        whole = self._seconds(epochs - 1)
        seconds = whole if self.sampled or rule != "age" else gate.seconds
        self._add(idle, timing, out, start=1)
        tick = self._gate_tick(name)
        self._move(
            f"{name} begins", inputs=(*tick, Arc(idle)), guard=x,
            outputs=(Arc(timing if seconds > 0.0 else out),),
        )  # fmt: skip
        busy: tuple[str, ...] = (timing, out)
        if self.sampled:
            busy = (timing, ripe, out)
            self._add(ripe)
            self._move(f"{name} lasts", inputs=(*tick, Arc(ripe)), outputs=(Arc(out),), guard=x)
            self._move(
                f"{name} goes on", inputs=tick, guard=all_of(x, any_of(Tokens(timing), Tokens(out)))
            )
            self._move(f"{name} stays idle", inputs=tick, guard=all_of(NotOf(x), Tokens(idle)))
        if seconds > 0.0:
            self._wait(
                f"{name} ripens", seconds, timing, ripe if self.sampled else out,
                turn=FIRST if self.sampled else LAST,
            )  # fmt: skip
        self._move(
            f"{name} ends", inputs=tick, flushes=busy, outputs=(Arc(idle),),
            guard=all_of(NotOf(x), any_of(*map(Tokens, busy))),
        )  # fmt: skip
        return Tokens(out)

    def _pand(
        self, gate: Pand, name: str, x: Condition, y: Condition, *, latched: bool
    ) -> Condition:
        """Memory of one pair: 0 none, L left only, R right was first, B both in order."""
        exclusive = gate.exclusive
        if exclusive is None:
            exclusive = self.model.options.pand_exclusive
        at = {state: f"{name} {state}" for state in "0LRB"}
        self._add(*at.values(), start=1)
        tick = self._gate_tick(name)
        both, left = all_of(x, y), all_of(x, NotOf(y))
        right, none = all_of(NotOf(x), y), all_of(NotOf(x), NotOf(y))
        usual = {"L": left, "R": right, "0": none}
        moves = {
            "0": usual | ({"R": y} if exclusive else {"B": both}),
            "L": usual | {"B": both},
            "R": usual | {"R": y},
            "B": {"B": AtLeastOf(0, ())} if latched else usual | {"B": both},
        }
        for old, choices in moves.items():
            for new, condition in choices.items():
                if old != new:
                    self._move(
                        f"{name} {old} to {new}", inputs=(*tick, Arc(at[old])),
                        outputs=(Arc(at[new]),), guard=condition,
                    )  # fmt: skip
                elif self.sampled:
                    self._move(
                        f"{name} stays {old}", inputs=tick,
                        guard=all_of(Tokens(at[old]), condition),
                    )  # fmt: skip
        return Tokens(at["B"])
