"""The Petri net engine against nets whose laws are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.dependability.simulation.petri_net import (
    Arc,
    Delay,
    Exponential,
    Immediate,
    PetriNet,
    Place,
    Tokens,
    Transition,
)
from sbas.dependability.simulation.petri_simulation import simulate_net, tick_s
from sbas.dependability.simulation.simulation_result import Simulation
from sbas.exceptions import InputError, ModelError

Z = 4.0


def run(
    places: dict[str, int], *transitions: Transition, end_s: float, histories: int = 20_000,
    start_s: float = 0.0, **observed: Tokens,
) -> Simulation:  # fmt: skip
    net = PetriNet(
        "net", tuple(Place(n, k) for n, k in places.items()), transitions, end_s, start_s,  # type: ignore[arg-type]
        tuple(observed.items()),
    )  # fmt: skip
    return simulate_net(net, histories=histories, rng=np.random.default_rng(1))


def move(kind: type, name: str, a: str, b: str, **fields: object) -> Transition:
    return kind(name=name, inputs=(Arc(a),), outputs=(Arc(b),), **fields)  # type: ignore


def test_queue_of_four_against_its_stationary_law() -> None:
    # M/M/1/4 with load 1/2: P(n) = (1/2)^n / (1 + 1/2 + ... + 1/16).
    capacity, load = 4, 0.5
    simulation = run(
        {"room": capacity, "queue": 0},
        move(Exponential, "arrives", "room", "queue", rate_per_h=load * 3600.0),
        move(Exponential, "is served", "queue", "room", rate_per_h=3600.0),
        start_s=100.0, end_s=1100.0, histories=400, busy=Tokens("queue"),
        full=Tokens("queue", capacity),
    )  # fmt: skip
    weights = load ** np.arange(capacity + 1)
    p = weights / weights.sum()
    queue = next(place for place in simulation.places if place.name == "queue")
    assert abs(queue.tokens - p @ np.arange(capacity + 1)) <= Z * queue.tokens_se
    for name, exact in (("busy", p[1:].sum()), ("full", p[-1])):
        assert abs(simulation.row(name).mean - exact) <= Z * simulation.row(name).mean_se
    # Births into "full" happen at the rate of arrivals while three wait.
    row = simulation.row("full")
    assert abs(row.occurrences - 1000 * load * p[-2]) <= Z * row.occurrences_se


def test_race_of_an_exponential_and_a_constant_delay() -> None:
    simulation = run(
        {"start": 1, "early": 0, "late": 0},
        move(Exponential, "first", "start", "early", rate_per_h=1800.0),
        move(Delay, "second", "start", "late", seconds=1.5),
        end_s=10.0, early=Tokens("early"), late=Tokens("late"),
    )  # fmt: skip
    exact = -math.expm1(-0.5 * 1.5)
    row = simulation.row("early")
    assert abs(row.first_passage - exact) <= Z * row.first_passage_se
    # Share of time of "late": from 1.5 s to 10 s wherever the race is lost.
    late = simulation.row("late")
    assert abs(late.mean - 0.85 * (1 - exact)) <= Z * late.mean_se


def test_immediates_by_weight_and_priority() -> None:
    simulation = run(
        {"start": 1, "a": 0, "b": 0, "c": 0},
        move(Immediate, "to a", "start", "a", weight=1.0, priority=2),
        move(Immediate, "to b", "start", "b", weight=3.0, priority=2),
        move(Immediate, "to c", "start", "c", weight=100.0, priority=1),
        end_s=1.0, a=Tokens("a"), b=Tokens("b"), c=Tokens("c"),
    )  # fmt: skip
    row = simulation.row("b")
    assert abs(row.mean - 0.75) <= Z * row.mean_se
    assert simulation.row("a").mean + row.mean == 1.0
    assert simulation.row("c").first_passage == 0.0


def test_memory_of_a_timer_that_is_interrupted() -> None:
    # Enabled 0..3, 5..8, 10..13, ...; a delay of 4 s: by age at 6 s, by enabling never.
    for memory, onset in (("age", 6.0), ("enabling", 20.0)):
        simulation = run(
            {"on": 1, "off": 0, "todo": 1, "done": 0},
            move(Delay, "stops", "on", "off", seconds=3.0),
            move(Delay, "starts", "off", "on", seconds=2.0),
            Delay(name="works", seconds=4.0, memory=memory, inputs=(Arc("todo"),),  # type: ignore
                  outputs=(Arc("done"),), guard=Tokens("on")),
            end_s=20.0, histories=2, done=Tokens("done"),
        )  # fmt: skip
        assert simulation.row("done").mean == pytest.approx((20.0 - onset) / 20.0, rel=1e-12)


def test_at_one_instant_the_lower_turn_fires_first() -> None:
    for turn, hit in ((0, 0.0), (2, 1.0)):
        simulation = run(
            {"input": 1, "timing": 1, "out": 0},
            Delay(name="ends", seconds=2.0, turn=turn, inputs=(Arc("input"),)),
            Delay(name="ripens", seconds=2.0, turn=1, inputs=(Arc("timing"),),
                  outputs=(Arc("out"),), guard=Tokens("input")),
            end_s=5.0, histories=2, out=Tokens("out"),
        )  # fmt: skip
        assert simulation.row("out").first_passage == hit


def test_inhibitor_flush_and_arcs_with_several_tokens() -> None:
    # Every second one more token up to 5 (inhibitor); at 5 all are flushed and 2 put back.
    simulation = run(
        {"clock": 1, "count": 0},
        Delay(name="tick", seconds=1.0, inputs=(Arc("clock"),),
              outputs=(Arc("clock"), Arc("count")), inhibitors=(Arc("count", 5),)),
        Immediate(name="flush", flushes=("count",), outputs=(Arc("count", 2),),
                  guard=Tokens("count", 5)),
        end_s=9.0, histories=2,
    )  # fmt: skip
    # Tokens in the nine seconds: 0 1 2 3 4 2 3 4 2.
    count = next(place for place in simulation.places if place.name == "count")
    assert count.tokens == pytest.approx(21 / 9, rel=1e-12)


def test_a_marking_of_no_length_is_not_observed() -> None:
    simulation = run(
        {"a": 1, "b": 0, "c": 0},
        move(Delay, "to b", "a", "b", seconds=1.0),
        move(Immediate, "to c", "b", "c"),
        end_s=2.0, histories=2, b=Tokens("b"), c=Tokens("c"),
    )  # fmt: skip
    assert simulation.row("b").first_passage == 0.0
    assert simulation.row("c").occurrences == 1.0


def test_a_net_that_lets_no_time_pass_is_refused() -> None:
    for delay in (move(Immediate, "there", "a", "b"), move(Delay, "there", "a", "b", seconds=0.0)):
        with pytest.raises(ModelError, match="fire at one instant"):
            run({"a": 1, "b": 0}, delay, move(Immediate, "back", "b", "a"), end_s=1.0)


def test_ticks_are_those_of_the_decimals() -> None:
    delays = (Delay(name="x", seconds=0.1), Delay(name="y", seconds=0.25))
    assert tick_s(PetriNet("net", (), delays, end_s=1.0)) * 20 == 1
    with pytest.raises(InputError, match="common tick"):
        tick_s(PetriNet("net", (), (Delay(name="x", seconds=math.pi),), end_s=1000.0))
