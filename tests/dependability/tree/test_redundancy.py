"""Common causes and channels, against exact arithmetic and truth tables."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Literal

import numpy as np
import pytest

from sbas.dependability.tree.gate_truth import gate_truth
from sbas.dependability.tree.model import (
    Component,
    Con,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Options,
    Or,
    Undeveloped,
)
from sbas.dependability.tree.model_check import supports
from sbas.dependability.tree.redundancy import common_cause, duplicated, k_out_of_n
from sbas.exceptions import ModelError

CHANNEL = HybridFaultTree(
    "channel", 1.0, 7.0, (Component("A", 2e-6, 0.5), Component("U", 1e-6, 0.5)), (),
    (Failed("a", "A"), Failed("u", "U"), Undeveloped("software")),
    (Or("Off", ("a", "software")), Or("Unsafe", ("u",)), Or("Top", ("Off", "Unsafe"))),
    "Top", ("Off", "Unsafe"),
)  # fmt: skip
"""A channel that is off, or wrong without knowing, or both."""

RECEIVER = HybridFaultTree(
    "receiver", 1.0, 5.0, (Component("A", 2e-6, 0.5),),
    (MarkovSource("O", ("right", "wrong"), ((0.5, 0.5), (0.5, 0.5)), (1.0, 0.0), ("A",),
                  down="hardware", first_fix_s=1.0, waiting="fix"),),
    (InState("bad", "O", ("wrong",)), InState("out", "O", ("hardware", "fix")),
     InState("either", "O", ("wrong", "hardware"))),
    (Con("Unsafe", 2, "bad"), Or("Off", ("out",)), Or("Top", ("Off", "Unsafe", "either"))),
    "Top", ("Off", "Unsafe"),
)  # fmt: skip


def test_beta_divides_the_rate_and_keeps_the_repair() -> None:
    pair = k_out_of_n(CHANNEL, 1, 2, share_sources=False, unsafe="Unsafe")
    model = common_cause(pair, ("A_1", "A_2"), 0.25)
    rates = {c.name: (c.failure_rate_per_h, c.repair_rate_per_h) for c in model.components}
    assert rates == {
        "A_1": (1.5e-6, 0.5), "A_2": (1.5e-6, 0.5), "U_1": (1e-6, 0.5), "U_2": (1e-6, 0.5),
        "ccf_A_1_A_2": (0.5e-6, 0.5),
    }  # fmt: skip
    depends = supports(model)
    assert depends["a_1"] == {"A_1", "ccf_A_1_A_2"}
    assert depends["a_2"] == {"A_2", "ccf_A_1_A_2"}
    states = {c: np.array([[int(c == "ccf_A_1_A_2"), 0]]) for c in rates}
    truth = gate_truth(model, states)
    assert truth["a_1"].tolist() == truth["a_2"].tolist() == [[True, False]]


def test_a_guard_fails_by_the_common_cause_too() -> None:
    pair = k_out_of_n(RECEIVER, 1, 2, share_sources=False, unsafe="Unsafe")
    model = common_cause(pair, ("A_1", "A_2"), 0.1)
    assert [s.guard for s in model.sources] == [("A_1", "ccf_A_1_A_2"), ("A_2", "ccf_A_1_A_2")]


@pytest.mark.parametrize(
    ("members", "beta", "where"),
    [
        (("A",), 0.1, "members"),
        (("A", "A"), 0.1, "members"),
        (("A", "U"), 0.1, "members"),
        (("A", "X"), 0.1, "members"),
        (("A", "U"), 1.5, "beta"),
        (("A", "U"), float("nan"), "beta"),
    ],
)
def test_common_causes_that_mean_nothing(members: tuple[str, ...], beta: float, where: str) -> None:
    with pytest.raises(ModelError) as caught:
        common_cause(CHANNEL, members, beta)
    assert caught.value.where == where


@pytest.mark.parametrize("mode", ["2oo2", "1oo2"])
def test_pairs_by_their_truth_tables(mode: Literal["2oo2", "1oo2"]) -> None:
    """Section 8 of the method page: compared pair and switched pair, all 32 states."""
    model = duplicated(CHANNEL, mode, share_sources=False, unsafe="Unsafe")
    table = np.array(list(product((0, 1), repeat=5)))
    a1, u1, a2, u2, software = table.T.astype(bool)
    truth = gate_truth(
        model,
        {n: v[:, None].astype(int) for n, v in zip(
            ("A_1", "U_1", "A_2", "U_2", "software"), (a1, u1, a2, u2, software), strict=True)},
    )  # fmt: skip
    off1, off2 = a1 | software, a2 | software
    if mode == "2oo2":
        unsafe = u1 & u2
        unavailable = off1 | off2 | (u1 ^ u2)
    else:
        unsafe = u1 | u2
        unavailable = off1 & off2
    assert (truth["Unsafe"][:, 0] == unsafe).all()
    assert (truth["Unavailable"][:, 0] == unavailable).all()
    assert (truth["Top"][:, 0] == (unsafe | unavailable)).all()
    assert model.cases == ("Unavailable", "Unsafe")


def test_two_of_three_by_counting() -> None:
    model = k_out_of_n(CHANNEL, 2, 3, share_sources=False, unsafe="Unsafe")
    table = np.array(list(product((0, 1), repeat=6)))
    off, wrong = table[:, :3].astype(bool), table[:, 3:].astype(bool)
    states = {f"A_{i + 1}": table[:, [i]] for i in range(3)}
    states |= {f"U_{i + 1}": table[:, [3 + i]] for i in range(3)}
    truth = gate_truth(model, states)
    free = (~off & ~wrong).sum(axis=1)
    unsafe = wrong.sum(axis=1) >= 2
    assert (truth["Unsafe"][:, 0] == unsafe).all()
    assert (truth["Top"][:, 0] == (unsafe | (free < 2))).all()


def test_without_an_unsafe_case_only_the_count_of_channels_matters() -> None:
    model = k_out_of_n(CHANNEL, 2, 3, share_sources=False, unsafe=None)
    table = np.array(list(product((0, 1), repeat=3)))
    states = {f"A_{i + 1}": table[:, [i]] for i in range(3)}
    states |= {f"U_{i + 1}": np.zeros((8, 1), int) for i in range(3)}
    assert (gate_truth(model, states)["Top"][:, 0] == (table.sum(axis=1) >= 2)).all()


def test_undeveloped_events_are_common_to_all_channels() -> None:
    model = duplicated(CHANNEL, "1oo2", share_sources=False, unsafe="Unsafe")
    assert [e.name for e in model.events if isinstance(e, Undeveloped)] == ["software"]


def test_receivers_in_one_signal_state_differ_by_their_hardware_alone() -> None:
    model = duplicated(RECEIVER, "2oo2", share_sources=True, unsafe="Unsafe")
    assert {s.name: (s.guard, s.first_fix_s) for s in model.sources} == {
        "O": ((), 0.0), "O_1": (("A_1",), 1.0), "O_2": (("A_2",), 1.0),
    }  # fmt: skip
    # Own states: 0 receiving, 1 hardware failed, 2 first fix; the signal is wrong in 1..4.
    states = {
        "O": [[0, 1, 1, 1, 1, 0]], "O_1": [[0, 0, 0, 0, 0, 0]], "O_2": [[0, 0, 0, 1, 2, 0]],
        "A_1": [[0] * 6], "A_2": [[0, 0, 0, 1, 0, 0]],
    }  # fmt: skip
    truth = gate_truth(model, {name: np.array(values) for name, values in states.items()})
    shown = {name: "".join("01"[int(v)] for v in signal[0]) for name, signal in truth.items()}
    assert shown["bad_1"] == "011110"
    assert shown["bad_2"] == "011000"
    assert shown["out_2"] == "000110"
    assert shown["either_2"] == "011100"
    assert shown["Unsafe"] == "001000"
    # Epoch 1: "either" makes both tops true without a case; no channel is free of failure.
    assert shown["Unavailable"] == "010110"
    assert shown["Top"] == "011110"


def test_independent_receivers_share_nothing() -> None:
    model = duplicated(RECEIVER, "1oo2", share_sources=False, unsafe="Unsafe")
    depends = supports(model)
    assert depends["Top_1"] == {"O_1", "A_1"}
    assert depends["Top_2"] == {"O_2", "A_2"}
    shared = supports(duplicated(RECEIVER, "1oo2", share_sources=True, unsafe="Unsafe"))
    assert shared["Top_1"] & shared["Top_2"] == {"O"}


@pytest.mark.parametrize(("k", "n"), [(0, 2), (3, 2), (1, 0)])
def test_votes_that_mean_nothing(k: int, n: int) -> None:
    with pytest.raises(ModelError, match="no vote"):
        k_out_of_n(CHANNEL, k, n, share_sources=False, unsafe="Unsafe")


def test_what_channels_refuse() -> None:
    with pytest.raises(ModelError, match="no case of that name") as caught:
        k_out_of_n(CHANNEL, 1, 2, share_sources=False, unsafe="Unsaf")
    assert "did you mean 'Unsafe'?" in caught.value.cure
    held = replace(RECEIVER, options=Options(con_gap="hold", hold_states=("hardware",)))
    with pytest.raises(ModelError, match="cannot be held"):
        duplicated(held, "2oo2", share_sources=True, unsafe="Unsafe")
    with pytest.raises(ModelError, match="unknown choice"):
        duplicated(CHANNEL, "2oo3", share_sources=False, unsafe=None)  # type: ignore[arg-type]
