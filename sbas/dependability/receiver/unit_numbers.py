"""The GNSS + ECS unit as the numbers that decide its rows, taken from its hybrid fault tree."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from sbas.dependability.tree.durations import duration_epochs, whole_epochs
from sbas.dependability.tree.model import (
    And,
    CausalAnd,
    Component,
    Con,
    Dur,
    DurationRule,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    MeanRule,
    Or,
    Pand,
    Undeveloped,
)
from sbas.exceptions import ModelError

RunWithFailedSensor = Literal["pand", "pand_exclusive", "and", "joint"]


@dataclass(frozen=True)
class UnitNumbers:
    """What the rows of the unit depend on beside the receiver's chain.

    Parameters
    ----------
    source : the receiver, states correct, wrong and missing in the order of `order`.
    order : (3,) rows of the source that are correct, wrong and missing.
    ecs, guard, fusion : components; the guard's must all work for the receiver to move; without
        `fusion` the top is not predicted.
    step_s, mission_s : epoch and mission [s].
    d1, d2 : epochs after which IE1 and IE2 are true.
    k, l : wrong positions of IE5 and of IE6.
    ie6 : "pand", "pand_exclusive" (the sensor must fail strictly before), "and", or "joint" (a
        run counted only while the sensor is failed).
    mean_rule : see `sbas.dependability.tree.model.Options`.
    dur_rule : reading of T1, named in messages.
    """

    source: MarkovSource
    order: tuple[int, int, int]
    ecs: Component
    guard: tuple[Component, ...]
    fusion: Component | None
    step_s: float
    mission_s: float
    d1: int
    d2: int
    k: int
    l: int  # noqa: E741 (the paper's letter)
    ie6: RunWithFailedSensor
    mean_rule: MeanRule
    dur_rule: DurationRule

    @property
    def epochs(self) -> int:
        """N, number of epochs after epoch 0."""
        return round(self.mission_s / self.step_s)

    @property
    def wait(self) -> int:
        """Epochs of the first-fix wait."""
        return whole_epochs(self.source.first_fix_s, self.step_s) or 0


def unit_numbers(model: HybridFaultTree) -> UnitNumbers:
    """Numbers of a tree that has the paper's gates IE1, IE2, IE5 and IE6 by these names.

    Parameters
    ----------
    model : IE1 a causal AND of the failed ECS and of GNSS missing; IE2 a DUR of GNSS missing;
        IE5 a CON of wrong positions; IE6 a PAND (or AND) of the failed ECS and a CON of wrong
        positions, or a CON of both together. GNSS missing: the source in its missing, down or
        waiting state.

    Raises
    ------
    ModelError : another structure, a source without three states or with an environment profile,
        or an option for which the closed rows do not hold.

    References
    ----------
    Nguyen, Beugin, Marais, ITST 2013, Fig. 2 (hybrid fault tree of the service failure).
    """
    return _Reader(model).numbers()


class _Reader:
    """Looks names up in a tree, and refuses what is not the paper's structure."""

    def __init__(self, model: HybridFaultTree) -> None:
        self.model = model
        self.nodes: dict[str, Event | Gate] = {n.name: n for n in (*model.events, *model.gates)}
        self.components = {c.name: c for c in model.components}
        if len(model.sources) != 1:
            raise _refusal("a calibration needs one Markov source", f"{len(model.sources)} sources")
        self.source = model.sources[0]

    def numbers(self) -> UnitNumbers:
        model, source = self.model, self.source
        if len(source.states) != 3 or len(set(source.states)) != 3 or source.stages:
            raise _refusal(
                f"source {source.name!r} must have three states and no profile",
                f"states {source.states}, {len(source.stages)} stages",
            )
        options = model.options
        if options.con_gap != "reset" or options.mean_rule == "integral":
            raise _refusal(
                "the calibration holds for con_gap 'reset' and means over epochs",
                f"con_gap {options.con_gap!r}, mean_rule {options.mean_rule!r}",
            )
        if source.first_fix_s and whole_epochs(source.first_fix_s, model.step_s) is None:
            raise _refusal("first_fix_s is no whole number of epochs", f"{source.first_fix_s} s")
        ie1, ie2, ie5 = self.gate("IE1"), self.gate("IE2"), self.gate("IE5")
        if not (isinstance(ie1, CausalAnd) and isinstance(ie2, Dur) and isinstance(ie5, Con)):
            kinds = ", ".join(type(g).__name__ for g in (ie1, ie2, ie5))
            raise _refusal("IE1, IE2, IE5 are CausalAnd, Dur, Con", f"found {kinds}")
        ecs = next((c for c in map(self.failed, ie1.inputs) if c is not None), None)
        lacking = [name for name in ie1.inputs if self.failed(name) is None]
        if ecs is None or len(ie1.inputs) != 2 or len(lacking) != 1:
            raise _refusal("IE1 joins one failed component and one event", f"{ie1.inputs}")
        missing = self.states_of(lacking[0])
        if missing != self.states_of(ie2.input):
            raise _refusal("IE1 and IE2 look at the same missing GNSS", f"{ie1.inputs}")
        outside = {source.down, source.waiting or source.down}
        wrong = self.states_of(ie5.input)
        lost = missing & set(source.states)
        if len(wrong) != 1 or len(lost) != 1 or wrong & lost or not outside <= missing:
            raise _refusal(
                "GNSS missing is one state of the source with its down and waiting states; "
                "wrong is another state",
                f"missing {sorted(missing)}, wrong {sorted(wrong)}",
            )
        order = [source.states.index(next(iter(s))) for s in (wrong, lost)]
        correct = next(i for i in range(3) if i not in order)
        l_count, kind = self.ie6(ecs, wrong)
        t1_rule, t2_rule = ie1.rule or options.dur_rule, ie2.rule or options.dur_rule
        if ecs.name in source.guard:
            raise _refusal("the ECS must not guard the receiver", ecs.name)
        return UnitNumbers(
            source=source,
            order=(correct, order[0], order[1]),
            ecs=ecs,
            guard=tuple(self.components[name] for name in source.guard),
            fusion=self.fusion({ecs.name, *source.guard}),
            step_s=model.step_s,
            mission_s=model.mission_s,
            d1=duration_epochs(ie1.seconds, model.step_s, t1_rule),
            d2=duration_epochs(ie2.seconds, model.step_s, t2_rule),
            k=ie5.count,
            l=l_count,
            ie6=kind,
            mean_rule=options.mean_rule,
            dur_rule=t1_rule,
        )

    def gate(self, name: str) -> Event | Gate:
        if name not in self.nodes:
            raise _refusal(f"no gate {name!r}", f"there are {', '.join(self.nodes)}")
        return self.nodes[name]

    def failed(self, name: str) -> Component | None:
        """The component of an event `Failed`, else None."""
        event = self.nodes.get(name)
        return self.components.get(event.component) if isinstance(event, Failed) else None

    def leaves(self, name: str) -> Iterable[Event | Gate]:
        """What an event or an OR of ORs is true for."""
        node = self.gate(name)
        if isinstance(node, Or):
            for below in node.inputs:
                yield from self.leaves(below)
        else:
            yield node

    def states_of(self, name: str) -> frozenset[str]:
        """States of the source in which an OR of its events is true."""
        found, broken = set(), set()
        for leaf in self.leaves(name):
            if isinstance(leaf, InState) and leaf.source == self.source.name:
                found |= set(leaf.states)
            elif isinstance(leaf, Failed) and leaf.component in self.source.guard:
                broken.add(leaf.component)
            else:
                raise _refusal(f"{name!r} looks at more than the receiver", leaf.name)
        if broken and self.source.down not in found:
            if broken != set(self.source.guard):
                raise _refusal(f"{name!r} names a part of the guard only", ", ".join(broken))
            if self.source.waiting is None and self.source.first_fix_s > 0.0:
                # The state `down` covers the wait as well, failed components do not.
                raise _refusal(f"{name!r} leaves out the wait for the first fix", f"{found}")
            found.add(self.source.down)
        return frozenset(found)

    def ie6(self, ecs: Component, wrong: frozenset[str]) -> tuple[int, RunWithFailedSensor]:
        gate = self.gate("IE6")
        if isinstance(gate, Con):
            joined = self.gate(gate.input)
            if isinstance(joined, And) and self._sensor_and_wrong(joined.inputs, ecs, wrong):
                return gate.count, "joint"
        elif isinstance(gate, Pand | And) and len(gate.inputs) == 2:
            runs = [name for name in gate.inputs if isinstance(self.gate(name), Con)]
            others = [name for name in gate.inputs if name not in runs]
            run = self.gate(runs[0]) if len(runs) == 1 else None
            if isinstance(run, Con) and self._sensor_and_wrong((*others, run.input), ecs, wrong):
                if isinstance(gate, And):
                    return run.count, "and"
                options = self.model.options
                latched = options.pand_latched if gate.latched is None else gate.latched
                strictly = options.pand_exclusive if gate.exclusive is None else gate.exclusive
                if not latched and gate.inputs[1] == run.name:
                    return run.count, "pand_exclusive" if strictly else "pand"
        raise _refusal(
            "IE6 is PAND(ECS failed, CON of wrong) not latched, AND of both, or CON of their AND",
            repr(gate),
        )

    def _sensor_and_wrong(
        self, inputs: tuple[str, ...], ecs: Component, wrong: frozenset[str]
    ) -> bool:
        if len(inputs) != 2:
            return False
        sensor = [name for name in inputs if self.failed(name) == ecs]
        others = [name for name in inputs if self.failed(name) is None]
        return len(sensor) == 1 and len(others) == 1 and self.states_of(others[0]) == wrong

    def fusion(self, taken: set[str]) -> Component | None:
        """The component of the top beside the four gates; None where the top has another form."""
        if self.model.top not in self.nodes:
            return None
        rest = []
        names = set()
        for leaf in self.leaves(self.model.top):
            silent = isinstance(leaf, Undeveloped) and leaf.probability == 0.0
            if leaf.name in ("IE1", "IE2", "IE5", "IE6"):
                names.add(leaf.name)
            elif not (silent or (isinstance(leaf, House) and not leaf.value)):
                rest.append(leaf)
        if len(names) != 4 or len(rest) != 1 or not isinstance(rest[0], Failed):
            return None
        name = rest[0].component
        return self.components.get(name) if name not in taken else None


def _refusal(what: str, evidence: str) -> ModelError:
    return ModelError(
        what,
        where="calibration",
        evidence=evidence,
        cure="give the transition rows of the source; only the paper's tree can be calibrated",
    )
