"""Hardware, stationary laws and component chains against closed forms."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from sbas.dependability.exact.transitions import (
    component_chain,
    hardware_step,
    restart_law,
    source_phases,
    stationary_law,
    trimmed,
)
from sbas.dependability.tree.model import Component, HybridFaultTree, MarkovSource, Stage
from sbas.exceptions import InputError
from tests.dependability.paper_models import URBAN_EXACT


def test_hardware_of_the_page_after_an_hour() -> None:
    fail, repair = hardware_step(Component("e", 2e-6, 1 / 24), 3600.0)
    assert fail == pytest.approx(1.958904113459721e-6, rel=1e-15)
    with mpmath.workdps(40):
        s = mpmath.mpf(2e-6) + mpmath.mpf(1 / 24)
        exact = mpmath.mpf(1 / 24) / s * -mpmath.expm1(-s)
        assert abs(repair / exact - 1) < 1e-15
    assert hardware_step(Component("never", 0.0, 0.0), 1.0) == (0.0, 0.0)


def test_stationary_law_of_the_urban_chain() -> None:
    law = stationary_law(URBAN_EXACT)
    assert law == pytest.approx([0.9388, 0.0529179421875292, 0.008282057812470829], rel=1e-13)


def test_a_rare_state_keeps_its_digits() -> None:
    rows = ((1.0 - 1e-30, 1e-30, 0.0), (0.5, 0.25, 0.25), (1.0, 0.0, 0.0))
    law = stationary_law(rows)
    assert law[1] == pytest.approx(1e-30 / 0.75, rel=1e-14)
    assert law[2] == pytest.approx(law[1] / 4, rel=1e-14)


def test_states_that_are_left_for_ever_have_no_share() -> None:
    assert stationary_law(((0.5, 0.5), (0.0, 1.0))).tolist() == [0.0, 1.0]
    with pytest.raises(InputError, match="more than one stationary law"):
        stationary_law(((1.0, 0.0), (0.0, 1.0)))


def test_restart_laws() -> None:
    rows = ((0.25, 0.75), (1.0, 0.0))
    source = MarkovSource("s", ("a", "b"), rows, (1.0, 0.0))

    def law(restart: object) -> list[float]:
        return restart_law(MarkovSource(**{**vars(source), "restart": restart}), rows).tolist()

    assert law("first") == [1.0, 0.0]
    assert law("row1") == [0.25, 0.75]
    assert law((0.125, 0.875)) == [0.125, 0.875]
    assert law("stationary") == pytest.approx([4 / 7, 3 / 7], rel=1e-15)


def guarded(first_fix_s: float, stages: tuple[Stage, ...] = ()) -> HybridFaultTree:
    source = MarkovSource(
        "s", ("a", "b"), ((0.5, 0.5), (0.5, 0.5)), (1.0, 0.0), ("c",),
        first_fix_s=first_fix_s, waiting="wait", stages=stages,
    )  # fmt: skip
    return HybridFaultTree("m", 1.0, 10.0, (Component("c", 360.0, 720.0),), (source,), (), (), "")


def test_phases_of_a_guarded_source() -> None:
    model = guarded(3.0)
    assert source_phases(model.sources[0], 1.0) == ("a", "b", "down", "wait", "wait", "wait")
    chain = component_chain(model, {"c", "s"}, max_states=100)
    assert chain.size == 6  # failed means down, and nothing else does
    for values in chain.values:
        sums = np.add.reduceat(values, chain.indptr[:-1])
        assert sums == pytest.approx(1.0, abs=1e-15)


def test_stages_end_where_they_say_and_the_last_goes_on() -> None:
    rows = ((0.5, 0.5), (0.25, 0.75))
    stages = (Stage("x", 4.0, rows), Stage("y", 3.0, rows[::-1]))
    chain = component_chain(guarded(0.0, stages), {"c", "s"}, max_states=100)
    assert chain.ends == (4, 10)
    assert len(chain.values) == 2


def test_only_what_is_reached_is_kept() -> None:
    source = MarkovSource("s", ("a", "b", "c"), ((0.5, 0.5, 0.0),) * 3, (1.0, 0.0, 0.0))
    model = HybridFaultTree("m", 1.0, 10.0, (), (source,), (), (), "")
    chain = component_chain(model, {"s"}, max_states=100)
    assert chain.size == 2
    assert trimmed(chain) is chain


def test_too_many_components_at_once() -> None:
    components = tuple(Component(f"c{i}", 1.0, 1.0) for i in range(30))
    model = HybridFaultTree("m", 1.0, 10.0, components, (), (), (), "")
    with pytest.raises(InputError, match="more than 1000 states"):
        component_chain(model, {c.name for c in components}, max_states=1000)
