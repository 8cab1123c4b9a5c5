"""Random sound models for property tests."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
    Or,
    Pand,
    Stage,
    Undeveloped,
)

RULES = ("age", "count", "strict")
texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
numbers = st.floats(0.0, 1e12)
shares = st.floats(0.0, 1.0)


@st.composite
def laws(draw: st.DrawFn, size: int) -> tuple[float, ...]:
    """Probabilities that are multiples of 1/64, exact in binary."""
    cuts = sorted(draw(st.lists(st.integers(0, 64), min_size=size - 1, max_size=size - 1)))
    return tuple((b - a) / 64 for a, b in zip([0, *cuts], [*cuts, 64], strict=True))


@st.composite
def sources(draw: st.DrawFn, components: tuple[Component, ...]) -> MarkovSource:
    size = draw(st.integers(1, 3))

    def rows() -> tuple[tuple[float, ...], ...]:
        return tuple(draw(laws(size)) for _ in range(size))

    return MarkovSource(
        "O",
        ("right", "wrong", "missing")[:size],
        rows(),
        draw(laws(size)),
        guard=tuple(c.name for c in components if draw(st.booleans())),
        first_fix_s=0.5 * draw(st.integers(0, 9)),
        restart=draw(st.sampled_from(("first", "row1")) | laws(size)),
        waiting=draw(st.sampled_from((None, "down", "first fix"))),
        stages=tuple(
            Stage(draw(texts), 0.5 * draw(st.integers(1, 9)), rows())
            for _ in range(draw(st.integers(0, 2)))
        ),
        source=draw(texts),
    )


@st.composite
def sound_models(draw: st.DrawFn) -> HybridFaultTree:
    """Models in steps of 0.5 s that `check_model` accepts."""
    components = tuple(
        Component(name, draw(numbers), draw(numbers), draw(shares), draw(texts))
        for name in ("A", "ä b", '"q"\\')[: draw(st.integers(1, 3))]
    )
    source = draw(sources(components))
    events = [Failed(f"{c.name} failed", c.name) for c in components]
    all_events: list[Any] = [
        *events,
        InState("state", "O", (source.states[0], source.down)),
        House("house", draw(st.booleans())),
        Undeveloped("open", draw(shares)),
    ]  # fmt: skip
    names = [event.name for event in all_events]
    gates: list[Gate] = []
    for i in range(draw(st.integers(1, 6))):
        fed = tuple(draw(st.lists(st.sampled_from(names), min_size=2, max_size=3)))
        seconds, count = draw(st.floats(0.0, 1e6)), draw(st.integers(1, 99))
        rule = draw(st.sampled_from((None, *RULES)))
        flags = draw(st.tuples(*[st.sampled_from((None, True, False))] * 2))
        name = f"g{i}"
        gates.append(draw(st.sampled_from([
            Or(name, fed), And(name, fed), Not(name, fed[0]), AtLeast(name, 2, fed),
            Con(name, count, fed[0]), Dur(name, seconds, fed[0], rule),
            CausalAnd(name, seconds, fed, rule), Pand(name, fed, *flags),
        ])))  # fmt: skip
        names.append(name)
    hold = draw(st.booleans())
    return HybridFaultTree(
        name="random",
        step_s=0.5,
        mission_s=0.5 * draw(st.integers(1, 40)),
        components=components,
        sources=(source,),
        events=tuple(all_events),
        gates=tuple(draw(st.permutations(gates))),
        top=draw(st.sampled_from(names)),
        cases=tuple(draw(st.lists(st.sampled_from(names), unique=True, max_size=3))),
        options=Options(
            draw(st.sampled_from(RULES)), draw(st.booleans()), draw(st.booleans()),
            "hold" if hold else "reset", (source.states[-1],) if hold else (),
            draw(st.sampled_from(("epochs", "left", "trapezoid", "integral"))),
        ),
        notes=tuple(draw(st.lists(texts, max_size=2))),
    )  # fmt: skip
