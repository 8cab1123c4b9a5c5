"""Nets that mean nothing are refused with the part that is wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest

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
    all_of,
    any_of,
    check_net,
    places_of,
)
from sbas.exceptions import ModelError

NET = PetriNet("net", (Place("a", 1), Place("b")), (), end_s=10.0)


def test_conditions_name_their_places() -> None:
    condition = all_of(Tokens("a"), NotOf(any_of(Tokens("b", 2), Tokens("a"))))
    assert list(places_of(condition)) == ["a", "b", "a"]
    assert all_of() == AtLeastOf(0, ())
    assert any_of() == AtLeastOf(1, ())


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"end_s": 0.0}, "start_s, end_s"),
        ({"places": (Place("a"), Place("a"))}, "places"),
        ({"places": (Place("a", -1),)}, "places.a.tokens"),
        ({"transitions": (Immediate(name="t", inputs=(Arc("x"),)),)}, "transitions.t.inputs"),
        ({"transitions": (Immediate(name="t", inputs=(Arc("a"), Arc("a"))),)},
         "transitions.t.inputs"),
        ({"transitions": (Immediate(name="t", outputs=(Arc("a", 0),)),)},
         "transitions.t.outputs.a.tokens"),
        ({"transitions": (Immediate(name="t", weight=0.0),)}, "transitions.t.weight"),
        ({"transitions": (Immediate(name="t", guard=Tokens("x")),)}, "transitions.t.guard"),
        ({"transitions": (Immediate(name="t", flushes=("x",)),)}, "transitions.t.flushes"),
        ({"transitions": (Delay(name="t", seconds=-1.0),)}, "transitions.t.seconds"),
        ({"transitions": (Exponential(name="t", rate_per_h=float("nan")),)},
         "transitions.t.rate_per_h"),
        ({"observed": (("o", NotOf(Tokens("x"))),)}, "observed.o"),
    ],
)  # fmt: skip
def test_nonsense_is_refused(change: dict[str, object], where: str) -> None:
    check_net(NET)
    with pytest.raises(ModelError) as caught:
        check_net(replace(NET, **change))  # type: ignore[arg-type]
    assert caught.value.where == where
