"""What is taken apart, and what is not."""

from __future__ import annotations

from sbas.dependability.exact.plan import split, tree_of
from sbas.dependability.tree.model import And, AtLeast, CausalAnd, Con, Dur, Not, Or, Pand
from tests.dependability.exact.test_product_chain import two_state
from tests.dependability.paper_models import localisation_unit


def test_the_unit_of_the_paper_without_its_fusion() -> None:
    part = split("TOP", tree_of(localisation_unit()))
    assert part.k == 1
    assert part.leaves() == (("BE1",), ("Or(IE1, IE2, IE5, IE6)",))


def test_a_run_of_an_and_is_the_and_of_runs() -> None:
    gates = (And("both", ("e0", "e1")), CausalAnd("c", 3.0, ("e0", "e1")), Dur("top", 3.0, "both"))
    tree = tree_of(two_state(2, gates))
    for name in ("c", "top"):
        part = split(name, tree)
        assert (part.k, part.leaves()) == (2, (("Run(4; e0)",), ("Run(4; e1)",)))


def test_not_at_least_2_of_3_is_2_of_3_not() -> None:
    gates = (AtLeast("two", 2, ("e0", "e1", "e2")), Not("top", "two"))
    part = split("top", tree_of(two_state(3, gates)))
    assert (part.k, part.leaves()) == (2, (("Not(e0)",), ("Not(e1)",), ("Not(e2)",)))


def test_order_and_shared_inputs_are_not_taken_apart() -> None:
    gates = (Pand("p", ("e0", "e1")), Con("run", 2, "e0"), Or("top", ("e0", "run")))
    tree = tree_of(two_state(2, gates))
    assert split("p", tree).parts == () == split("top", tree).parts
    assert tree.unforgetting("p") == {"p"}
    assert tree.horizon("top", ()) == 1
