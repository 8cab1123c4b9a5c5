"""The project is read back into a net of plain arcs, which must behave as the net with guards."""

from __future__ import annotations

import re
from collections import defaultdict
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from sbas.dependability.exchange.pnpro import pnpro_text
from sbas.dependability.simulation.petri_net import (
    Arc,
    AtLeastOf,
    Delay,
    Exponential,
    Immediate,
    NotOf,
    PetriNet,
    Place,
    Tokens,
    any_of,
)
from sbas.dependability.simulation.petri_simulation import simulate_net
from sbas.dependability.simulation.petri_translation import petri_net_of
from sbas.exceptions import ModelError
from tests.dependability.exchange.hybrid_models import with_memory


def plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]", "_", name)


def read_back(text: str, net: PetriNet) -> PetriNet:
    """A net of the project's nodes and arcs; only the order of delays comes from the original."""
    root = fromstring(text)
    turns = {plain(t.name): t.turn for t in net.transitions if isinstance(t, Delay)}
    places = tuple(
        Place(p.attrib["name"], int(p.attrib["marking"])) for p in root.iterfind(".//place")
    )
    arcs: dict[tuple[str, str], list[Arc]] = defaultdict(list)
    for arc in root.iterfind(".//arc"):
        kind, head, tail = arc.attrib["kind"], arc.attrib["head"], arc.attrib["tail"]
        transition, place = (tail, head) if kind == "OUTPUT" else (head, tail)
        arcs[kind, transition].append(Arc(place, int(arc.get("mult", "1"))))
    found: list[Immediate | Delay | Exponential] = []
    for node in root.iterfind(".//transition"):
        name, kind = node.attrib["name"], node.attrib["type"]
        ends = {
            "inputs": tuple(arcs["INPUT", name]),
            "outputs": tuple(arcs["OUTPUT", name]),
            "inhibitors": tuple(arcs["INHIBITOR", name]),
        }
        if kind == "EXP":
            rate = float(node.attrib["delay"]) * 3600
            found.append(Exponential(name=name, rate_per_h=rate, **ends))
        elif kind == "GEN":
            seconds = float(node.attrib["delay"].removeprefix("I[").removesuffix("]"))
            found.append(
                Delay(name=name, seconds=seconds, turn=turns[name.removesuffix("_2")], **ends)
            )
        else:
            priority, weight = int(node.attrib["priority"]), float(node.attrib["weight"])
            found.append(Immediate(name=name, priority=priority, weight=weight, **ends))
    return PetriNet("again", places, tuple(found), net.end_s, net.start_s)


def compare(net: PetriNet, *, histories: int, limit: float = 4.5) -> None:
    again = read_back(pnpro_text(net).text, net)
    first = simulate_net(net, histories=histories, rng=np.random.default_rng(1))
    second = simulate_net(again, histories=histories, rng=np.random.default_rng(2))
    means = {place.name: place for place in second.places}
    moved = 0
    for place in first.places:
        other = means[plain(place.name)]
        error = np.hypot(place.tokens_se, other.tokens_se)
        assert abs(place.tokens - other.tokens) <= limit * error + 1e-12, place.name
        moved += place.tokens_se > 0
    assert moved


@pytest.mark.parametrize("hardware", ["sampled", "continuous"])
def test_a_translated_tree_behaves_the_same(hardware: str) -> None:
    net = petri_net_of(with_memory(), hardware=hardware)  # type: ignore[arg-type]
    compare(net, histories=3000)


def counting() -> PetriNet:
    """Tokens arrive at random and are flushed by a clock, while a guard of two cases holds."""
    either = any_of(Tokens("many", 4), NotOf(Tokens("door")))
    return PetriNet(
        "counting net",
        (Place("many"), Place("door", 1), Place("clock", 1), Place("done", 2), Place("late")),
        (
            Exponential(name="comes", rate_per_h=1800, outputs=(Arc("many"),)),
            Exponential(name="shuts", rate_per_h=720, inputs=(Arc("door"),)),
            Exponential(name="opens", rate_per_h=900, outputs=(Arc("door"),),
                        inhibitors=(Arc("door"),)),
            Delay(name="tick", seconds=10.0, inputs=(Arc("clock"),),
                  outputs=(Arc("clock"), Arc("done", 3)), flushes=("many", "done"), guard=either),
            Delay(name="other tick", seconds=10.0, inputs=(Arc("clock"),), outputs=(Arc("clock"),),
                  guard=NotOf(either)),
            Delay(name="lasting", seconds=4.0, outputs=(Arc("late"),), inhibitors=(Arc("late"),),
                  guard=either),
            Immediate(name="gone", inputs=(Arc("late"),), guard=NotOf(either)),
        ),
        end_s=60.0,
    )  # fmt: skip


def test_flushes_come_before_outputs_and_cases_do_not_restart_timers() -> None:
    compare(counting(), histories=3000)


def test_rates_are_per_second_and_delays_constants() -> None:
    text = pnpro_text(counting()).text
    nodes = {node.attrib["name"]: node.attrib for node in fromstring(text).iter("transition")}
    assert nodes["comes"]["type"] == "EXP"
    assert float(nodes["comes"]["delay"]) == 0.5
    assert nodes["tick"]["type"] == "GEN"
    assert nodes["tick"]["delay"] == "I[10.0]"
    assert all(re.fullmatch(r"[A-Za-z]\w*", name) for name in nodes)


def test_the_report_names_what_is_read_otherwise() -> None:
    net = PetriNet(
        "n",
        (Place("a b", 1), Place("a_b")),
        (
            Delay(name="d", seconds=1.0, memory="age", inputs=(Arc("a b"),)),
            Immediate(name="never", guard=AtLeastOf(1, ())),
        ),
        1.0,
        observed=(("seen", Tokens("a b")),),
    )
    exported = pnpro_text(net)
    told = {loss.element: loss for loss in exported.report.lost}
    assert told["d"].construct == "memory of a delay"
    assert told["never"].treatment == "refused"
    assert told["seen"].construct == "observed condition"
    assert told["n"].treatment == "approximated"
    names = [node.attrib["name"] for node in fromstring(exported.text).iter("place")]
    assert names == ["a_b", "a_b_2"]


def test_a_guard_of_too_many_cases_is_refused() -> None:
    places = tuple(Place(f"p{i}") for i in range(40))
    half = AtLeastOf(20, tuple(Tokens(place.name) for place in places))
    net = PetriNet("n", places, (Immediate(name="t", guard=half),), 1.0)
    with pytest.raises(ModelError, match="more than 4096 cases"):
        pnpro_text(net)
