"""Random hybrid fault trees without memory, and one with a shared source."""

from __future__ import annotations

from hypothesis import strategies as st

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Con,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Undeveloped,
)


@st.composite
def static_models(draw: st.DrawFn, *, plain: bool = False) -> HybridFaultTree:
    """Gates or, and, not, k-of-n over hardware; `plain`: what Galileo holds too."""
    rate = st.floats(0, 10) | st.floats(1e-12, 1e-6)
    components: list[Component] = []
    events: list[Event] = []
    for i in range(draw(st.integers(1, 4))):
        repair, start = (0.0, 0.0) if plain else (draw(rate), draw(st.floats(0, 1)))
        components.append(Component(f"e{i}-hardware", draw(rate), repair, start))
        events.append(Failed(f"e{i}", f"e{i}-hardware"))
    for i in range(draw(st.integers(0, 2))):
        events.append(Undeveloped(f"u {i}", draw(st.floats(0, 1))))
    if not plain and draw(st.booleans()):
        events.append(House("h", draw(st.booleans())))
    known = [event.name for event in events]
    gates: list[Gate] = []
    for i in range(draw(st.integers(1, 5))):
        name = f"gate {i}"
        inputs = tuple(draw(st.lists(st.sampled_from(known), min_size=1, max_size=4, unique=True)))
        kind = draw(st.sampled_from(["or", "and", "atleast"] + ([] if plain else ["not"])))
        if kind == "not":
            gates.append(Not(name, inputs[0]))
        elif kind == "atleast":
            gates.append(AtLeast(name, draw(st.integers(1, len(inputs))), inputs))
        else:
            gates.append((Or if kind == "or" else And)(name, inputs))
        known.append(name)
    return HybridFaultTree(
        name="random" if draw(st.booleans()) else "a model's <name>",
        step_s=draw(st.sampled_from([0.5, 1.0])),
        mission_s=draw(st.sampled_from([60.0, 3600.0])),
        components=tuple(components),
        sources=(),
        events=tuple(events),
        gates=tuple(gates),
        top=draw(st.sampled_from([gates[-1].name, known[0]])),
        cases=() if plain else tuple(draw(st.lists(st.sampled_from(known), unique=True))),
    )


def with_memory() -> HybridFaultTree:
    """Two runs of one source under an or, with hardware that guards the source."""
    return HybridFaultTree(
        name="runs",
        step_s=1.0,
        mission_s=30.0,
        components=(Component("A", 30.0), Component("B", 60.0), Component("unused", 1.0)),
        sources=(
            MarkovSource("O", ("good", "bad"), ((0.8, 0.2), (0.4, 0.6)), (1.0, 0.0), guard=("A",)),
        ),
        events=(Failed("a", "A"), Failed("b", "B"), InState("wrong", "O", ("bad",))),
        gates=(
            Con("two", 2, "wrong"),
            Con("three", 3, "wrong"),
            And("both", ("three", "b")),
            Or("T", ("both", "two", "a")),
        ),
        top="T",
        cases=("both",),
        notes=("a note",),
    )
