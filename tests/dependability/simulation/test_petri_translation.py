"""The translated net has the law of the model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.simulation.agreement import agreement
from sbas.dependability.simulation.petri_simulation import simulate_net
from sbas.dependability.simulation.petri_translation import petri_net_of
from sbas.dependability.tree.model import And, Options
from sbas.exceptions import InputError
from tests.dependability.paper_models import check_unit
from tests.dependability.path_enumeration import by_paths, random_model
from tests.dependability.simulation.test_slot_simulation import CHECK_SET, near


@pytest.mark.parametrize("hardware", ["sampled", "continuous"])
def test_check_set_of_the_method_page(hardware: str) -> None:
    net = petri_net_of(check_unit(), hardware=hardware)  # type: ignore[arg-type]
    simulation = simulate_net(net, histories=60, rng=np.random.default_rng(1))
    for name, (mean, at_end, _, occurrences) in CHECK_SET.items():
        row = simulation.row(name)
        assert near(row.mean, row.mean_se, mean), name
        assert near(row.at_end, math.sqrt(at_end * (1 - at_end) / 60), at_end), name
        assert near(row.occurrences, row.occurrences_se, occurrences), name


def test_first_passage_of_the_check_set_in_40_s() -> None:
    net = petri_net_of(check_unit(mission_s=40.0))
    row = simulate_net(net, histories=3000, rng=np.random.default_rng(2)).row("TOP")
    assert near(row.first_passage, row.first_passage_se, 0.5570164102)


@pytest.mark.parametrize("seed", range(3, 200, 8))
def test_random_models_against_every_history(seed: int) -> None:
    model = random_model(seed)
    paths = by_paths(model)
    exact = {name: (float(p.on[1:].mean()), p.once) for name, p in paths.items()}
    simulation = simulate_net(petri_net_of(model), histories=5000, rng=np.random.default_rng(seed))
    found = agreement(exact, simulation)
    assert [c for c in found.comparisons if c.verdict == "disagrees"] == []
    for name, p in paths.items():
        row = simulation.row(name)
        assert abs(row.occurrences - p.occurrences) <= 5 * row.occurrences_se + 1e-3


def test_steps_that_are_no_binary_fractions_have_a_common_tick() -> None:
    model = check_unit(step_s=0.1, mission_s=6.0, t1_s=0.3, t2_s=0.7, first_fix_s=0.6)
    net = petri_net_of(model)
    simulation = simulate_net(net, histories=50, rng=np.random.default_rng(3))
    assert simulation.row("correct output").mean > 0.1


def test_a_net_has_one_mean_rule() -> None:
    with pytest.raises(InputError, match="over epochs"):
        petri_net_of(check_unit(options=Options(mean_rule="left")))


def test_gates_that_explode_are_refused() -> None:
    gates = [And("g0", ("BE1", "BE2"))]
    gates += [And(f"g{i}", (f"g{i - 1}",) * 2) for i in range(1, 40)]
    model = check_unit()
    with pytest.raises(InputError, match="more than 100000 terms"):
        petri_net_of(replace(model, gates=(*model.gates, *gates)))
