from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given

from sbas.dependability.exchange.open_psa import read_open_psa, read_open_psa_model
from sbas.dependability.exchange.open_psa_export import open_psa_text
from sbas.dependability.static.static_tree import (
    BasicEvent,
    StaticGate,
    StaticTree,
    top_probability,
)
from sbas.dependability.tree.model import And, Component, Failed, House, Not, Undeveloped
from sbas.exceptions import InputError, ModelError
from tests.dependability.static_trees import static_trees


def mef(body: str, *, data: str = "") -> bytes:
    text = f"<opsa-mef><define-fault-tree name='ft'>{body}</define-fault-tree>{data}</opsa-mef>"
    return text.encode()


def gate(name: str, formula: str, extra: str = "") -> str:
    return f"<define-gate name='{name}' {extra}>{formula}</define-gate>"


def event(name: str, law: str = "<float value='0.1'/>", extra: str = "") -> str:
    return f"<define-basic-event name='{name}' {extra}>{law}</define-basic-event>"


SIMPLE = gate("T", "<or><event name='a'/></or>") + event("a")


@given(static_trees() | static_trees(names=("a b.", "house: ", "Ä <&\"'>")))
def test_what_is_written_comes_back_as_it_was(tree: StaticTree) -> None:
    assert read_open_psa(open_psa_text(tree).text.encode()).tree == tree


def test_a_repairable_tree(reference_data: Path) -> None:
    """5.935483165242355e-06: method page 10.8, also SCRAM 0.16.2 at --mission-time 1."""
    file = reference_data / "reference/fault_trees/repairable.xml"
    found = read_open_psa(file, mission_s=3600)
    assert float(top_probability(found.tree)) == pytest.approx(5.935483165242355e-06, rel=1e-14)
    assert [loss.treatment for loss in found.report.losses] == ["flattened"] * 4
    model = read_open_psa_model(file, step_s=1, mission_s=3600).model
    assert model.components[0] == Component("FUS-hardware", 6.06e-6, 1 / 24)
    assert model.components[3] == Component("REC-hardware", 4.08e-6)
    assert model.events[3] == Failed("REC", "REC-hardware")
    with pytest.raises(ModelError, match="system mission time"):
        read_open_psa(file)
    with pytest.raises(ModelError, match="neither epoch nor mission"):
        read_open_psa_model(file, mission_s=3600)


def test_nested_formulas_and_constants_become_gates_and_house_events() -> None:
    formula = (
        "<or><and><event name='a'/><not><basic-event name='b'/></not></and>"
        "<constant value='false'/><atleast min='2'><event name='a'/><event name='b'/>"
        "<house-event name='h'/></atleast></or>"
    )
    house = "<define-house-event name='h'><constant value='true'/></define-house-event>"
    body = gate("T", formula) + event("a") + event("b", "<float value='0.25'/>") + house
    tree = read_open_psa(mef(body)).tree
    assert tree.top == "T"
    assert {g.kind for g in tree.gates} == {"or", "and", "not", "atleast"}
    # a(1-b) or 2 of (a, b, true) = a or b.
    assert float(top_probability(tree)) == pytest.approx(1 - 0.9 * 0.75, rel=1e-15)
    model = read_open_psa_model(mef(body), step_s=1, mission_s=3600).model
    assert House("h", True) in model.events
    assert House("constant-false", False) in model.events
    assert Undeveloped("b", 0.25) in model.events
    assert [g.input for g in model.gates if isinstance(g, Not)] == ["b"]


def test_a_gate_that_is_only_a_reference_is_an_or_of_one() -> None:
    tree = read_open_psa(mef(gate("T", "<gate name='G'/>") + gate("G", "<event name='a'/>")
                             + event("a"))).tree  # fmt: skip
    assert tree.gates == (StaticGate("T", "or", ("G",)), StaticGate("G", "or", ("a",)))


def test_containers_hide_private_names_and_share_public_ones() -> None:
    inner = (
        "<define-component name='c' role='private'>"
        + event("x", "<float value='0.5'/>")
        + gate("G", "<or><event name='x'/></or>")
        + "</define-component>"
    )
    body = (
        gate("T", "<and><gate name='c.G'/><basic-event name='ft.c.x'/><event name='x'/></and>")
        + inner
        + event("x", "<float value='0.25'/>")
    )
    tree = read_open_psa(mef(body)).tree
    assert set(tree.events) == {BasicEvent("ft.c.x", 0.5), BasicEvent("x", 0.25)}
    assert tree.gates[0] == StaticGate("T", "and", ("ft.c.G", "ft.c.x", "x"))
    assert float(top_probability(tree)) == 0.125
    with pytest.raises(ModelError, match="'G' is used and not defined"):
        read_open_psa(mef(gate("T", "<gate name='G'/>") + inner))


def test_beta_factor_group() -> None:
    """0.00207984 by SCRAM 0.16.2 with --ccf true --probability true --bdd."""
    body = gate("T", "<or><and><event name='A'/><event name='B'/></and><event name='C'/></or>")
    group = (
        "<define-CCF-group name='G' model='beta-factor'><members><basic-event name='A'/>"
        "<basic-event name='B'/></members><distribution><float value='0.01'/></distribution>"
        "<factor level='2'><float value='0.1'/></factor></define-CCF-group>"
    )
    content = mef(body + event("C", "<float value='1e-3'/>") + group)
    tree = read_open_psa(content).tree
    # C or common or both alone, by hand.
    both = 1e-3 + (1 - 1e-3) * 0.009**2
    assert float(top_probability(tree)) == pytest.approx(1e-3 + (1 - 1e-3) * both, rel=1e-14)
    assert float(top_probability(tree)) == pytest.approx(0.00207984, rel=2e-6)
    with pytest.raises(ModelError, match="common-cause group 'G'"):
        read_open_psa_model(content, step_s=1, mission_s=3600)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("beta-factor", "MGL"), "model 'MGL' is not supported"),
        (("level='2'", "level='3'"), "level is not the number"),
        (("value='0.1'", "value='1.5'"), "beta is not between"),
        (("<float value='0.01'/>", ""), "needs members, one distribution"),
    ],
)
def test_common_cause_groups_that_say_too_little(change: tuple[str, str], message: str) -> None:
    group = (
        "<define-CCF-group name='G' model='beta-factor'><members><basic-event name='A'/>"
        "<basic-event name='B'/></members><distribution><float value='0.01'/></distribution>"
        "<factor level='2'><float value='0.1'/></factor></define-CCF-group>"
    )
    body = gate("T", "<and><event name='A'/><event name='B'/></and>")
    with pytest.raises(ModelError, match=message):
        read_open_psa(mef(body + group.replace(*change)))


def test_several_tops_must_be_told_apart() -> None:
    body = SIMPLE + gate("U", "<or><event name='a'/></or>")
    with pytest.raises(ModelError, match="2 gates are used by no other: T, U") as caught:
        read_open_psa(mef(body))
    assert "top='T'" in caught.value.cure
    assert read_open_psa(mef(body), top="U").tree.top == "U"
    with pytest.raises(ModelError, match="top 'X' is not defined"):
        read_open_psa(mef(body), top="X")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (gate("T", "<or><gate name='U'/></or>") + gate("U", "<or><gate name='T'/></or>"),
         "form a cycle"),
        (gate("T", "<or><gate name='U'/></or>") + gate("U", "<or><gate name='V'/></or>")
         + gate("V", "<or><gate name='U'/></or>"), "U -> V -> U"),
        (event("a"), "defines no gate"),
        (gate("T", "<or><event name='b'/></or>"), "'b' is used and not defined"),
        (gate("T", "<or><gate name='a'/></or>") + event("a"), "is a basic-event, used as a gate"),
        (gate("T", "<or><event name='a' type='x'/></or>") + event("a"), "event type 'x'"),
        (gate("T", "<pand><event name='a'/></pand>") + event("a"), "formula 'pand'"),
        (gate("T", "<or/>"), "has no input"),
        (gate("T", "<atleast min='-1'><event name='a'/></atleast>") + event("a"), "no whole"),
        (gate("T", "<atleast><event name='a'/></atleast>") + event("a"), "has no 'min'"),
        (gate("T", "<xor><event name='a'/><event name='a'/><event name='a'/></xor>")
         + event("a"), "takes 2 inputs"),
        (gate("T", "") + event("a"), "needs one formula"),
        (SIMPLE + event("a"), "'ft.a' is defined twice"),
        (gate("T", "<or><event name='a'/></or>") + event("a", ""), "needs one expression"),
        (gate("T", "<or><event name='a'/></or>") + event("a", "<float value='2'/>"),
         "not between 0 and 1"),
        (SIMPLE + gate("a.b", "<event name='a'/>"), "holds a dot"),
        (SIMPLE + event("z", extra="role='secret'"), "role 'secret'"),
        (SIMPLE + "<define-thing name='x'/>", "<define-thing> is not supported"),
        (SIMPLE + "<define-gate><event name='a'/></define-gate>", "has no 'name'"),
    ],
)  # fmt: skip
def test_impossible_files_are_refused_by_name(body: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        read_open_psa(mef(body))


def test_other_documents_are_refused() -> None:
    with pytest.raises(ModelError, match="root element is <pnml>"):
        read_open_psa(b"<pnml/>")
    with pytest.raises(ModelError, match="<define-event-tree> is not supported"):
        read_open_psa(b"<opsa-mef><define-event-tree name='e'/></opsa-mef>")
    with pytest.raises(InputError, match="cannot be read"):
        read_open_psa("no such file.xml")


def test_a_hybrid_tree_takes_no_gate_or_law_that_it_does_not_have() -> None:
    both = "<event name='a'/><event name='b'/>"
    body = gate("T", f"<xor>{both}</xor>") + event("a") + event("b")
    with pytest.raises(ModelError, match="kind 'xor'"):
        read_open_psa_model(mef(body), step_s=1, mission_s=10)
    weibull = "<Weibull><float value='10'/><float value='2'/><float value='0'/><system-mission-time/></Weibull>"  # noqa: E501
    body = gate("T", f"<or>{both}</or>") + event("a", weibull) + event("b")
    with pytest.raises(ModelError, match="not one of constant rates"):
        read_open_psa_model(mef(body), step_s=1, mission_s=10)


def test_a_hundred_thousand_gates_in_a_chain() -> None:
    n = 100_000
    chain = [gate(f"g{i}", f"<or><gate name='g{i + 1}'/><event name='a'/></or>")
             for i in range(n)]  # fmt: skip
    content = mef("".join(chain) + gate(f"g{n}", "<event name='a'/>") + event("a"))
    tree = read_open_psa(content).tree
    assert tree.top == "g0"
    assert float(top_probability(tree)) == 0.1


def test_models_with_own_types_come_back() -> None:
    body = gate("T", "<and><event name='a'/><event name='b'/></and>")
    exponential = "<exponential><float value='2'/><system-mission-time/></exponential>"
    body += event("a", exponential) + event("b", exponential)
    model = read_open_psa_model(mef(body), step_s=1, mission_s=60).model
    assert model.gates == (And("T", ("a", "b")),)
    again = read_open_psa_model(open_psa_text(model).text.encode()).model
    assert again == model


def test_a_formula_of_many_formulas() -> None:
    parts = "<and><event name='a'/><event name='a'/></and>" * 30_000
    tree = read_open_psa(mef(gate("T", f"<or>{parts}</or>") + event("a"))).tree
    assert len(tree.gates) == 30_001
    assert float(top_probability(tree)) == 0.1
