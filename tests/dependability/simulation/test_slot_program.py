"""The stationary law against exact fractions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.simulation.slot_program import restart_law, stationary_law
from tests.dependability.paper_models import URBAN_EXACT, check_unit


def test_stationary_law_of_a_cycle_and_of_a_rare_state() -> None:
    # Balance by hand: pi0 * 1e-20 = pi1 * 0.5.
    law = stationary_law([[1.0, 1e-20], [0.5, 0.5]])
    assert law[1] == pytest.approx(2e-20, rel=1e-14)
    # A chain with period 3 and a transient state that leads to it.
    law = stationary_law([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0.5, 0, 0.5]])
    np.testing.assert_allclose(law, [1 / 3, 1 / 3, 1 / 3, 0.0], rtol=1e-14)


def test_stationary_law_of_the_urban_chain_is_what_it_was_made_from() -> None:
    law = stationary_law(URBAN_EXACT)
    assert law[1] == pytest.approx(0.0529179421875292, rel=1e-12)
    assert law[2] == pytest.approx(0.008282057812470829, rel=1e-12)


def test_restart_laws() -> None:
    source = check_unit().sources[0]
    assert restart_law(replace(source, restart="first"), source.rows).tolist() == [1, 0, 0]
    assert restart_law(replace(source, restart="row1"), source.rows).tolist() == list(
        source.rows[0]
    )
    assert restart_law(replace(source, restart=(0.0, 0.0, 1.0)), source.rows).tolist() == [0, 0, 1]
