from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.exchange.explicit_chain import (
    ExplicitChain,
    explicit_chain,
    lab_text,
    read_explicit_chain,
    tra_text,
)
from sbas.dependability.tree.model import Stage
from sbas.exceptions import InputError, ModelError
from tests.dependability.exchange.hybrid_models import with_memory


def first_passage(chain: ExplicitChain, label: str, steps: int) -> float:
    """P(F<=steps label) by the definition: dense powers with the label absorbing."""
    matrix = np.zeros((chain.states, chain.states))
    matrix[chain.origins, chain.targets] = chain.probabilities
    goal = chain.labels[label]
    matrix[goal] = 0
    matrix[goal, goal] = 1
    law = np.zeros(chain.states)
    law[chain.labels["init"]] = 1
    return float((law @ np.linalg.matrix_power(matrix, steps))[goal].sum())


def same(first: ExplicitChain, second: ExplicitChain) -> bool:
    return (
        first.states == second.states
        and np.array_equal(first.origins, second.origins)
        and np.array_equal(first.targets, second.targets)
        and np.array_equal(first.probabilities, second.probabilities)
        and list(first.labels) == list(second.labels)
        and all(np.array_equal(first.labels[k], second.labels[k]) for k in first.labels)
    )


@pytest.mark.parametrize("initial", [(1.0, 0.0), (0.7, 0.3)])
def test_first_passages_of_the_chain_are_those_of_the_solver(
    initial: tuple[float, float],
) -> None:
    model = with_memory()
    model = replace(model, sources=(replace(model.sources[0], initial=initial),))
    exported = explicit_chain(model)
    chain = exported.chain
    assert exported.extra_steps == (0 if initial[1] == 0 else 1)
    rows = solve(model, first_passage=True).rows
    steps = model.epochs + exported.extra_steps
    for label, name in (("top", "T"), ("both", "both")):
        expected = rows[name].at_least_once
        assert expected is not None
        assert first_passage(chain, label, steps) == pytest.approx(expected, rel=1e-12)
    assert same(read_explicit_chain(tra_text(chain).encode(), lab_text(chain).encode()), chain)


def test_text_of_a_small_chain() -> None:
    chain = ExplicitChain(
        3,
        np.array([0, 0]),
        np.array([0, 2]),
        np.array([0.1, 0.9]),
        {"init": np.array([0]), "top": np.array([0, 2])},
    )
    assert (
        tra_text(chain) == "dtmc\n0 0 0.10000000000000001\n0 2 0.90000000000000002\n1 1 1\n2 2 1\n"
    )
    assert lab_text(chain) == "#DECLARATION\ninit top\n#END\n0 init top\n2 top\n"
    read = read_explicit_chain(tra_text(chain).encode(), lab_text(chain).encode())
    assert (read.states, len(read.origins)) == (3, 4)
    with pytest.raises(ModelError, match="'a b' cannot be a label"):
        lab_text(replace(chain, labels={"a b": np.array([0])}))


LAB = b"#DECLARATION\ninit\n#END\n0 init\n"
TRA = b"dtmc\n0 0 0.5\n0 1 0.5\n1 1 1\n"


@pytest.mark.parametrize(
    ("tra", "lab", "message"),
    [
        (b"", LAB, "first line is not 'dtmc'"),
        (b"2 3\n0 1 1\n", LAB, "first line is not 'dtmc'"),
        (b"dtmc\n", LAB, "no move"),
        (b"dtmc\n0 0\n", LAB, "not 'from to probability'"),
        (b"dtmc\n0 0 1 1\n", LAB, "not 'from to probability'"),
        (b"dtmc\n0 0 0\n", LAB, "not 'from to probability'"),
        (b"dtmc\n0 0 nan\n", LAB, "not 'from to probability'"),
        (b"dtmc\n-1 0 1\n", LAB, "not 'from to probability'"),
        (b"dtmc\n0 1 0.5\n0 0 0.5\n1 1 1\n", LAB, "ascending order"),
        (b"dtmc\n0 0 0.5\n0 0 0.5\n", LAB, "ascending order"),
        (b"dtmc\n0 2000000000 1\n", LAB, "states without a row"),
        (b"dtmc\n0 0 0.5\n0 1 0.5\n", LAB, "do not add up to 1"),
        (b"dtmc\n0 0 0.5\n0 1 0.4\n1 1 1\n", LAB, "do not add up to 1"),
        (TRA, b"", "not declared"),
        (TRA, b"#DECLARATION\ninit\n0 init\n", "not declared"),
        (TRA, b"#DECLARATION\ninit\n#END\n0 top\n", "'top' is not declared"),
        (TRA, b"#DECLARATION\ninit\n#END\n5 init\n", "not a state"),
        (TRA, b"#DECLARATION\ninit\n#END\n1 init\n0 init\n", "ascending"),
        (TRA, b"#DECLARATION\ninit\n#END\nx init\n", "not a state"),
    ],
)
def test_files_that_are_no_chain(tra: bytes, lab: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_explicit_chain(tra, lab)


def test_what_one_chain_cannot_hold_is_refused() -> None:
    model = with_memory()
    rows = model.sources[0].rows
    stages = (Stage("one", 10.0, rows), Stage("two", 10.0, rows[::-1]))
    staged = replace(model, sources=(replace(model.sources[0], stages=stages),))
    with pytest.raises(ModelError, match="change during the mission"):
        explicit_chain(staged)
    with pytest.raises(ModelError, match="'x' is no event or gate"):
        explicit_chain(model, labels=["x"])
    with pytest.raises(InputError, match="more than 5 states"):
        explicit_chain(model, max_states=5)
