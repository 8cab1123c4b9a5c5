"""What is refused, with which words, and what is warned of."""

from __future__ import annotations

import contextlib
import itertools
import math
from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
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
from sbas.dependability.tree.model_check import check_model, in_order, supports
from sbas.exceptions import ModelError
from tests.dependability.model_strategies import sound_models

SOURCE = MarkovSource(
    "O", ("right", "wrong"), ((0.9, 0.1), (0.5, 0.5)), (1.0, 0.0), ("A",), first_fix_s=3.0
)
MODEL = HybridFaultTree(
    "unit", 1.0, 60.0, (Component("A", 4e-6, 0.04), Component("B", 2e-6)), (SOURCE,),
    (Failed("a", "A"), Failed("b", "B"), InState("w", "O", ("wrong", "down"))),
    (Con("run", 3, "w"), Pand("order", ("a", "run")), Dur("long", 5.0, "b"),
     CausalAnd("both", 2.0, ("a", "b")), AtLeast("two", 2, ("order", "long", "both")),
     Or("top", ("two", "order"))),
    "top",
)  # fmt: skip


def gate_put(gate: Any) -> HybridFaultTree:
    """The model with a gate in place of the one of its name."""
    return replace(MODEL, gates=tuple(gate if g.name == gate.name else g for g in MODEL.gates))


def source_put(**changes: Any) -> HybridFaultTree:
    return replace(MODEL, sources=(replace(SOURCE, **changes),))


def test_a_sound_model_has_no_findings() -> None:
    assert check_model(MODEL) == ()


@pytest.mark.parametrize(
    ("model", "where", "words"),
    [
        (gate_put(Or("top", ())), "gates.top.inputs", "without inputs"),
        (gate_put(Or("top", ("two", "ordr"))), "gates.top.inputs", "did you mean 'order'?"),
        (gate_put(Or("top", ("A",))), "gates.top.inputs", "no event or gate"),
        (gate_put(Or("top", "two")), "gates.top.inputs", "a tuple"),
        (gate_put(Con("run", 3, "top")), "gates.", "cycle"),
        (gate_put(Not("run", "run")), "gates.run", "run -> run"),
        (gate_put(Pand("order", ("a",))), "gates.order.inputs", "two inputs"),
        (gate_put(Pand("order", ("a", "b"), latched=1)), "gates.order.latched", "true or false"),
        (gate_put(AtLeast("two", 4, ("a", "b", "w"))), "gates.two.k", "from 1 to 3"),
        (gate_put(AtLeast("two", 0, ("a", "b"))), "gates.two.k", "from 1 to 2"),
        (gate_put(AtLeast("two", 1.0, ("a", "b"))), "gates.two.k", "integer"),
        (gate_put(Con("run", 0, "w")), "gates.run.count", "1 or more"),
        (gate_put(Con("run", 2.5, "w")), "gates.run.count", "integer"),
        (gate_put(Con("run", True, "w")), "gates.run.count", "integer"),
        (gate_put(Dur("long", -1.0, "b")), "gates.long.seconds", "0 or more"),
        (gate_put(Dur("long", math.nan, "b")), "gates.long.seconds", "finite"),
        (gate_put(Dur("long", 1e300, "b")), "gates.long.seconds", "counted"),
        (gate_put(Dur("long", 1.0, "b", "later")), "gates.long.rule", "age, count, strict"),
        (gate_put(CausalAnd("both", math.inf, ("a",))), "gates.both.seconds", "finite"),
        (replace(MODEL, mission_s=60.5), "time.mission_s", "write 60"),
        (replace(MODEL, mission_s=0.25), "time.mission_s", "write 1"),
        (replace(MODEL, mission_s=1e300, step_s=1e-300), "time.mission_s", "counted"),
        (replace(MODEL, step_s=0.0), "time.step_s", "more than 0"),
        (replace(MODEL, step_s="1"), "time.step_s", "finite number"),
        (replace(MODEL, top="nothing"), "top", "no event or gate"),
        (replace(MODEL, cases=("two", "two")), "cases", "once"),
        (replace(MODEL, cases=("tow",)), "cases", "did you mean 'two'?"),
        (replace(MODEL, events=(*MODEL.events, Failed("two", "A"))), "gates.two", "events"),
        (replace(MODEL, events=(*MODEL.events, Failed("x", "C"))), "events.x.component", "A, B"),
        (replace(MODEL, events=(*MODEL.events, InState("x", "O", ("worng",)))),
         "events.x.states", "did you mean 'wrong'?"),
        (replace(MODEL, events=(*MODEL.events, InState("x", "O", ()))), "events.x.states", "one"),
        (replace(MODEL, events=(*MODEL.events, House("x", 1))), "events.x.value", "true"),
        (replace(MODEL, events=(*MODEL.events, Undeveloped("x", 1.5))), "events.x.p", "at most 1"),
        (replace(MODEL, components=(Component("A", -1.0),)), "components.A.failure", "0 or more"),
        (replace(MODEL, components=(Component(" A", 1.0),)), "components[0].name", "printable"),
        (replace(MODEL, components=(Failed("A", "A"),)), "components[0]", "Component"),
        (source_put(rows=((0.9, 0.1), (0.5, 0.50001))), "sources.O.rows[1]", "sum 1.00001"),
        (source_put(rows=((1.1, -0.1), (0.5, 0.5))), "sources.O.rows[0][0]", "at most 1"),
        (source_put(rows=((0.9, 0.1),)), "sources.O.rows", "one row for each"),
        (source_put(rows=((0.9, 0.1), (math.nan, 0.5))), "sources.O.rows[1][0]", "finite"),
        (source_put(initial=(0.5, 0.4)), "sources.O.initial", "sum 0.9"),
        (source_put(guard=("a",)), "sources.O.guard", "no component"),
        (source_put(guard=("O",)), "sources.O.guard", "no component"),
        (source_put(first_fix_s=2.5), "sources.O.first_fix_s", "write 2"),
        (source_put(down="wrong"), "sources.O.down", "name of its own"),
        (source_put(waiting="right"), "sources.O.waiting", "name of its own"),
        (source_put(restart="now"), "sources.O.restart", "stationary, first, row1"),
        (source_put(restart=(1.0,)), "sources.O.restart", "one for each"),
        (source_put(restart=None), "sources.O.restart", "tuple"),
        (source_put(rows=((1.0, 0.0), (0.0, 1.0))), "sources.O.rows", 'restart = "first"'),
        (source_put(stages=(Stage("s", 1.5, SOURCE.rows),)), "sources.O.stages[0].seconds", "2"),
        (source_put(stages=(Stage("s", 0.0, SOURCE.rows),)), "sources.O.stages[0].seconds", "0"),
        (source_put(stages=(SOURCE,)), "sources.O.stages[0]", "Stage"),
        (source_put(stages=(Stage("s", 2.0, ((1.0, 0.0), (0.0, 1.0))),)),
         "sources.O.stages[0].rows", "more than one"),
        (replace(MODEL, options=Options(dur_rule="more")), "options.dur_rule", "age"),  # type: ignore[arg-type]
        (replace(MODEL, options=Options(con_gap="hold")), "options.hold_states", "right, wrong"),
        (replace(MODEL, options=Options(hold_states=("mising",))), "options.hold_states", "down"),
    ],
)  # fmt: skip
def test_errors_name_the_key_and_the_cure(model: Any, where: str, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        check_model(model)
    assert where in caught.value.where
    assert words in str(caught.value)


def test_a_cycle_is_named_with_its_path() -> None:
    with pytest.raises(ModelError) as caught:
        in_order(gate_put(Con("run", 3, "top")))
    steps = caught.value.evidence.split(" -> ")
    assert steps[0] == steps[-1]
    gates = {g.name: g for g in gate_put(Con("run", 3, "top")).gates}
    assert all(b in gates[a].inputs for a, b in itertools.pairwise(steps))


def test_a_guard_that_cannot_fail_needs_no_stationary_law() -> None:
    assert check_model(source_put(rows=((1.0, 0.0), (0.0, 1.0)), guard=())) == ()
    # A transient state does no harm: one closed class is enough.
    assert check_model(source_put(rows=((0.9, 0.1), (0.0, 1.0)))) == ()


@pytest.mark.parametrize(
    ("model", "where", "words"),
    [
        (gate_put(Dur("long", 2.5, "b")), "gates.long.seconds", "2.5 s at 1 s: 4 epochs"),
        (gate_put(CausalAnd("both", 0.1, ("a", "b"))), "gates.both.seconds", "multiple"),
        (replace(MODEL, events=(*MODEL.events, House("x", True))), "events.x", "no effect"),
        (gate_put(Or("top", ("long",))), "gates.two", "no effect"),
        (gate_put(Con("run", 62, "w")), "gates.run", "never true"),
        (replace(MODEL, components=(Component("A", 0.0), Component("B", 1.0))), "both", "never"),
        (source_put(stages=(Stage("s", 59.0, SOURCE.rows),)), "stages", "its last stage goes on"),
        (source_put(stages=(Stage("s", 61.0, SOURCE.rows),)), "stages", "cut off"),
        (source_put(rows=((0.9, 0.1 - 5e-10), (0.5, 0.5))), "sources.O", "1 of 3 laws"),
    ],
)  # fmt: skip
def test_warnings(model: HybridFaultTree, where: str, words: str) -> None:
    assert any(where in f.where and words in str(f) for f in check_model(model))


def test_undeveloped_events_are_listed_as_not_analysed() -> None:
    model = replace(
        MODEL, events=(*MODEL.events, Undeveloped("ue"), Undeveloped("p", 0.25)),
        gates=(*MODEL.gates[:-1], Or("top", ("two", "order", "ue", "p"))),
    )  # fmt: skip
    found = {f.where: f.evidence for f in check_model(model) if "not analysed" in f.message}
    assert found["events.ue"] == "taken as never"
    assert "0.25" in found["events.p"]


def test_constant_gates_by_their_inputs() -> None:
    gates = (
        And("never", ("no", "a")), Or("always", ("yes", "a")), Not("not", "never"),
        AtLeast("two", 2, ("yes", "not", "a")), Con("first", 1, "yes"), Con("later", 2, "yes"),
        Pand("itself", ("a", "a"), exclusive=True), Dur("lasts", 0.0, "yes"),
        Or("top", ("a", "never", "always", "two", "first", "later", "itself", "lasts")),
    )  # fmt: skip
    events = (Failed("a", "A"), House("no", False), House("yes", True))
    model = replace(MODEL, events=events, gates=gates)
    found = {f.where.removeprefix("gates."): f.message.split()[2] for f in check_model(model)}
    assert found == {
        "never": "never", "always": "always", "not": "always", "two": "always",
        "first": "always", "itself": "never", "lasts": "always", "top": "always",
    }  # fmt: skip


@pytest.mark.parametrize(("k", "short", "warned"), [(6, 2, False), (2, 6, True), (3, 3, True)])
def test_counts_of_the_misprint_are_recognised(k: int, short: int, warned: bool) -> None:
    """Table I of Nguyen, Beugin, Marais 2013 prints k = 2 and l = 6 the wrong way round."""
    gates = (Con("IE5", k, "w"), Con("l", short, "w"), Pand("IE6", ("a", "l")),
             Or("top", ("IE5", "IE6", "b")))  # fmt: skip
    found = [f for f in check_model(replace(MODEL, gates=gates)) if "Table I" in f.evidence]
    assert [f.where for f in found] == (["gates.l.count"] if warned else [])


def test_a_run_that_holds_nothing_is_warned_of() -> None:
    options = Options(con_gap="hold", hold_states=("right",))
    assert check_model(replace(MODEL, options=options)) == ()
    model = replace(gate_put(Con("run", 3, "a")), options=options)
    assert any("skips no epoch" in f.message for f in check_model(model))


def test_inputs_come_first_and_supports_hold_guards() -> None:
    shuffled = replace(MODEL, gates=tuple(reversed(MODEL.gates)))
    ordered = [gate.name for gate in in_order(shuffled)]
    for gate in MODEL.gates:
        for name in gate.inputs:
            assert name not in ordered or ordered.index(name) < ordered.index(gate.name)
    depends = supports(MODEL)
    assert depends["w"] == depends["run"] == {"O", "A"}
    assert depends["long"] == {"B"}
    assert depends["top"] == {"O", "A", "B"}
    assert depends["O"] == {"O", "A"}


def test_a_shared_undeveloped_event_ties_gates_together() -> None:
    events = (*MODEL.events, Undeveloped("ue"), Undeveloped("p", 0.25))
    depends = supports(replace(MODEL, events=events))
    assert depends["ue"] == frozenset()
    assert depends["p"] == {"p"}


def test_a_deep_tree_is_no_recursion() -> None:
    gates = tuple(Or(f"g{i}", (f"g{i + 1}" if i < 4999 else "a",)) for i in range(5000))
    model = replace(MODEL, gates=gates, top="g0")
    assert in_order(model)[0].name == "g4999"


WRONG = st.sampled_from(
    [None, -1.0, math.nan, math.inf, "", "A", (), ("A",), 0, 10**400, True, b"x", [1], {}, 1j,
     ((1.0,),), (None,), "x\ny"],
)  # fmt: skip


@given(sound_models())
def test_sound_models_pass(model: HybridFaultTree) -> None:
    for finding in check_model(model):
        assert finding.severity in ("warning", "info")


@given(st.data())
def test_a_broken_model_gives_a_model_error_and_nothing_else(data: st.DataObject) -> None:
    model = data.draw(sound_models())
    group = data.draw(st.sampled_from(["model", "components", "sources", "events", "gates"]))
    value = data.draw(WRONG)
    if group == "model":
        name = data.draw(st.sampled_from([f.name for f in fields(model)]))
        broken = replace(model, **{name: value})
    else:
        things = list(getattr(model, group))
        i = data.draw(st.integers(0, len(things) - 1))
        name = data.draw(st.sampled_from([f.name for f in fields(things[i])]))
        things[i] = replace(things[i], **{name: value})
        broken = replace(model, **{group: tuple(things)})
    with contextlib.suppress(ModelError):
        check_model(broken)
