"""Definitional truth of gates, against sequences written out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.tree.gate_truth import gate_truth, onsets, run_lengths, state_names
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
    Undeveloped,
)
from sbas.exceptions import InputError

X = "011011000111000011110110"
Y = "001111101110001111100111"


def bits(text: str) -> np.ndarray:
    return np.array([[c == "1" for c in text]])


def text(signal: np.ndarray) -> str:
    return "".join("01"[int(v)] for v in signal[0])


def truth_of(*gates: Gate, options: Options | None = None, **signals: str) -> dict[str, str]:
    components = tuple(Component(name.upper(), 0.1, 0.1) for name in signals)
    model = HybridFaultTree(
        "sequences", 1.0, len(next(iter(signals.values()))) - 1.0, components, (),
        tuple(Failed(name, name.upper()) for name in signals), gates, gates[-1].name,
        options=options or Options(),
    )  # fmt: skip
    found = gate_truth(model, {name.upper(): bits(signal) for name, signal in signals.items()})
    return {name: text(signal) for name, signal in found.items()}


@pytest.mark.parametrize(
    ("gates", "expected"),
    [
        ((Con("g", 3, "y"),), "000011100010000011100001"),
        ((Dur("g", 2.0, "y", "age"),), "000011100010000011100001"),
        ((Con("g", 2, "y"),), "000111100110000111100011"),
        ((Dur("g", 2.0, "y", "count"),), "000111100110000111100011"),
        ((Dur("g", 2.0, "y", "strict"),), "000001100000000001100000"),
        ((Dur("g", 2.5, "y", "age"),), "000001100000000001100000"),
        ((CausalAnd("g", 1.0, ("x", "y"), "age"),), "000001000010000001100010"),
        ((Pand("g", ("x", "y")),), "001000000000000000000110"),
        ((Pand("g", ("x", "y"), exclusive=True),), "001000000000000000000000"),
        ((Con("c", 2, "y"), Pand("g", ("x", "c"))), "000000000110000000000010"),
        ((Con("c", 2, "y"), And("g", ("x", "c"))), "000011000110000011100010"),
        ((And("c", ("x", "y")), Con("g", 2, "c")), "000001000010000001100010"),
    ],
)
def test_sequences_of_the_method_page(gates: tuple[Gate, ...], expected: str) -> None:
    assert truth_of(*gates, x=X, y=Y)["g"] == expected


def test_the_models_options_hold_where_a_gate_has_none() -> None:
    options = Options(dur_rule="strict", pand_exclusive=True, pand_latched=True)
    found = truth_of(
        Dur("d", 2.0, "y"), Dur("own", 2.0, "y", "count"), Pand("p", ("x", "y")),
        Pand("current", ("x", "y"), latched=False), options=options, x=X, y=Y,
    )  # fmt: skip
    assert found["d"] == "000001100000000001100000"
    assert found["own"] == "000111100110000111100011"
    assert found["p"] == "001111111111111111111111"
    assert found["current"] == "001000000000000000000000"


def test_memoryless_gates() -> None:
    found = truth_of(
        Or("or", ("a", "b", "c")), AtLeast("two", 2, ("a", "b", "c")), Not("not", "a"),
        AtLeast("twice", 2, ("a", "a", "b")),
        a="00001111", b="00110011", c="01010101",
    )  # fmt: skip
    assert found["or"] == "01111111"
    assert found["two"] == "00010111"
    assert found["not"] == "11110000"
    assert found["twice"] == "00001111"


def test_a_repair_during_one_run_of_the_right_input_breaks_the_order() -> None:
    found = truth_of(Pand("p", ("x", "y")), x="0110110", y="0011111")
    assert found["p"] == "0010000"
    found = truth_of(Pand("p", ("x", "y")), x="0111111", y="0010110")
    assert found["p"] == "0010110"


def test_an_order_of_an_event_with_itself() -> None:
    found = truth_of(Pand("i", ("x", "x")), Pand("e", ("x", "x"), exclusive=True), x=X, y=Y)
    assert found["i"] == X
    assert "1" not in found["e"]


def test_left_cascade_is_the_chain_of_onsets_and_stronger_than_the_right_one() -> None:
    signals = {"x": "0111111", "y": "0001111", "z": "0000111", "w": "1100111"}
    found = truth_of(
        Pand("left", ("x", "y", "z")), Pand("inner", ("y", "w")), Pand("right", ("x", "inner")),
        Pand("flat", ("x", "y", "w")), **signals,
    )  # fmt: skip
    assert found["left"] == "0000111"
    assert found["flat"] == found["right"] == "0000111"
    # y before x before z: the right-nested gate only asks that z is after both.
    weak = {"x": "0011", "y": "0111", "z": "0001"}
    found = truth_of(
        Pand("left", ("x", "y", "z")), Pand("inner", ("y", "z")), Pand("right", ("x", "inner")),
        **weak,
    )  # fmt: skip
    assert found["left"] == "0000"
    assert found["right"] == "0001"


def test_the_whole_of_a_gate_is_latched_not_its_steps() -> None:
    signals = {"x": "0100000", "y": "0110000", "z": "0000100"}
    found = truth_of(Pand("p", ("x", "y", "z"), latched=True), **signals)
    assert "1" not in found["p"]
    signals = {"x": "0111000", "y": "0011000", "z": "0001010"}
    found = truth_of(Pand("p", ("x", "y", "z"), latched=True), **signals)
    assert found["p"] == "0001111"
    found = truth_of(Pand("p", ("x", "y"), latched=True, exclusive=True), x="0110", y="0100")
    assert "1" not in found["p"]


@given(st.lists(st.tuples(*[st.booleans()] * 3), min_size=1, max_size=12), st.booleans())
def test_more_inputs_are_the_left_cascade_of_pairs(
    epochs: list[tuple[bool, ...]], exclusive: bool
) -> None:
    signals = {name: "".join("01"[epoch[i]] for epoch in epochs) for i, name in enumerate("xyz")}
    found = truth_of(
        Pand("flat", ("x", "y", "z")), Pand("pair", ("x", "y")), Pand("left", ("pair", "z")),
        options=Options(pand_exclusive=exclusive), **signals,
    )  # fmt: skip
    assert found["flat"] == found["left"]


def test_epoch_0_is_history_and_nothing_is_true_before_it() -> None:
    found = truth_of(
        Con("con", 2, "x"), Dur("dur", 1.0, "x"), Pand("p", ("x", "y")), x="110", y="100"
    )
    assert found["con"] == found["dur"] == "010"
    assert found["p"] == "100"


# --- sources ----------------------------------------------------------------------------------

RECEIVER = MarkovSource(
    "O", ("correct", "wrong", "missing", "wrong"), ((0.25,) * 4,) * 4, (1.0, 0.0, 0.0, 0.0),
    ("A",), down="hardware", first_fix_s=2.0, waiting="first_fix",
)  # fmt: skip


def receiver(options: Options, states: list[int]) -> dict[str, str]:
    model = HybridFaultTree(
        "receiver", 1.0, len(states) - 1.0, (Component("A", 0.1),), (RECEIVER,),
        (InState("wrong", "O", ("wrong",)), InState("out", "O", ("hardware", "first_fix")),
         House("yes", True), Undeveloped("ue", 0.5)),
        (Con("con", 3, "wrong"), Or("any", ("wrong", "out"))), "con", options=options,
    )  # fmt: skip
    found = gate_truth(model, {"O": np.array([states]), "A": np.zeros((1, len(states)), bool)})
    return {name: text(signal) for name, signal in found.items()}


def test_states_of_one_name_are_one_and_down_and_waiting_follow_them() -> None:
    assert state_names(RECEIVER) == (
        "correct",
        "wrong",
        "missing",
        "wrong",
        "hardware",
        "first_fix",
    )
    found = receiver(Options(), [0, 1, 3, 1, 4, 5, 2, 1])
    assert found["wrong"] == "01110001"
    assert found["out"] == "00001100"
    assert found["con"] == "00010000"
    assert found["yes"] == "11111111"
    assert found["ue"] == "00000000"


def test_a_held_epoch_neither_ends_nor_extends_a_run() -> None:
    states = [2, 1, 2, 1, 2, 2, 1, 2, 1, 0, 1, 1, 2]
    hold = Options(con_gap="hold", hold_states=("missing",))
    assert receiver(Options(), states)["con"] == "0000000000000"
    assert receiver(hold, states)["con"] == "0000001010000"


def test_run_lengths_and_onsets() -> None:
    signal = bits("0111011")
    assert run_lengths(signal).tolist() == [[0, 1, 2, 3, 0, 1, 2]]
    assert onsets(signal).tolist() == [[1, 1, 1, 1, 5, 5, 5]]


def test_histories_that_do_not_fit() -> None:
    model = HybridFaultTree(
        "m", 1.0, 3.0, (Component("A", 0.1), Component("B", 0.1)), (),
        (Failed("a", "A"), Failed("b", "B")), (And("g", ("a", "b")),), "g",
    )  # fmt: skip
    good = np.zeros((2, 4), dtype=int)
    with pytest.raises(InputError, match="no history of 'B'"):
        gate_truth(model, {"A": good})
    with pytest.raises(InputError, match="one shape"):
        gate_truth(model, {"A": good, "B": good[:, :3]})
    with pytest.raises(InputError, match="has no name"):
        gate_truth(model, {"A": good, "B": good + 2})
    several = replace(model, gates=(Or("g", ("a", "b")),))
    assert gate_truth(several, {"A": good, "B": np.eye(2, 4, dtype=int)})["g"].sum() == 2
