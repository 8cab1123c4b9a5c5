"""Calibration to the paper's tables against the chain and rows of the reference page, 10.5."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.receiver.calibration import RESIDUAL, CalibratedSource, calibrated_source
from sbas.dependability.receiver.published import PUBLISHED
from sbas.dependability.receiver.unit_numbers import unit_numbers
from sbas.exceptions import ModelError
from tests.dependability.galoroi_tree import galoroi_tree

FITTED = {"urban": ("IE1", "IE5", "IE6"), "tunnel": ("IE1", "IE2")}


@pytest.fixture(scope="module")
def found() -> dict[str, CalibratedSource]:
    return {name: calibrated_source(rows, galoroi_tree()) for name, rows in PUBLISHED.items()}


def test_the_urban_chain(found: dict[str, CalibratedSource]) -> None:
    urban = found["urban"]
    assert urban.stationary == pytest.approx(
        (0.9388, 0.0529179421875292, 0.008282057812470829), rel=1e-11
    )
    assert urban.stay_wrong == pytest.approx(0.31231263084320343, rel=1e-11)
    assert urban.stay_missing == pytest.approx(0.21241903271273882, rel=1e-11)
    expected = (
        (0.9549983983, 0.0383925705, 0.0066090312),
        (0.6816736700, 0.3123126308, 0.0060136991),
        (0.7455557479, 0.0420252194, 0.2124190327),
    )
    assert np.array(urban.source.rows) == pytest.approx(np.array(expected), abs=6e-11)


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ("urban", {"TOP": 1.6386482e-4, "BE1": 2.9891698e-6, "IE2": 3.8599143e-6,
                   "single GNSS": 0.93880, "unit": 0.999836}),
        ("tunnel", {"TOP": 1.5303590e-2, "BE1": 2.9891698e-6, "single GNSS": 0.15611,
                    "unit": 0.984696}),
    ],
)  # fmt: skip
def test_predicted_rows(
    found: dict[str, CalibratedSource], environment: str, expected: dict[str, float]
) -> None:
    for name, value in expected.items():
        row = found[environment].row(name)
        digits = 3e-5 if row.name in ("single GNSS", "unit") else 5e-8
        assert row.computed == pytest.approx(value, rel=digits), name
        assert row.role == "predicted"


@pytest.mark.parametrize("environment", PUBLISHED)
def test_fitted_rows_agree_and_the_chain_is_one(
    found: dict[str, CalibratedSource], environment: str
) -> None:
    result = found[environment]
    fitted = {r.name for r in result.rows if r.role == "calibrated"}
    assert {*FITTED.get(environment, FITTED["urban"]), "stationary correct"} <= fitted
    for row in result.rows:
        if row.role == "calibrated":
            assert row.computed == pytest.approx(row.published, rel=2 * RESIDUAL, abs=0.0)
    rows, pi = np.array(result.source.rows), np.array(result.stationary)
    assert rows.min() >= 0.0
    assert rows.sum(axis=1) == pytest.approx(np.ones(3), abs=1e-15)
    assert pi @ rows == pytest.approx(pi, rel=1e-14)
    assert pi[0] == PUBLISHED[environment].single_gnss_availability
    assert result.findings == ()
    assert result.note.count(environment) >= 1


@pytest.mark.parametrize("environment", PUBLISHED)
def test_the_general_solver_gives_the_same_rows(
    found: dict[str, CalibratedSource], environment: str
) -> None:
    """Closed rows against `solve`, which shares no code with them."""
    result = found[environment]
    tree = replace(galoroi_tree(), sources=(result.source,))
    solved = solve(tree, names=("BE1", "IE1", "IE2", "IE5", "IE6", "TOP"))
    for name in ("TOP", "BE1", "IE1", "IE2", "IE5", "IE6"):
        row = result.row(name)
        assert solved.rows[name].mean_unavailability == pytest.approx(
            row.computed, rel=1e-11, abs=0.0
        )


def test_the_other_readings_of_more_than_t() -> None:
    for rule, b in (("count", 0.0978712927), ("strict", 0.3129410263)):
        urban = calibrated_source(PUBLISHED["urban"], galoroi_tree(dur_rule=rule))
        assert urban.stay_missing == pytest.approx(b, rel=1e-9)


def test_the_tunnel_is_infeasible_when_strict() -> None:
    with pytest.raises(ModelError, match="infeasible") as error:
        calibrated_source(PUBLISHED["tunnel"], galoroi_tree(dur_rule="strict"))
    assert "strict" in str(error.value)


def test_the_printed_k_and_l_have_no_chain() -> None:
    with pytest.raises(ModelError, match="infeasible"):
        calibrated_source(PUBLISHED["urban"], galoroi_tree(k=2, run=6))


def test_free_entries_move_the_top_little_and_are_clipped_with_a_finding() -> None:
    system = unit_numbers(galoroi_tree())
    usual = calibrated_source(PUBLISHED["urban"], system)
    for free in ((0.0, 0.0), (0.02, 0.2)):
        other = calibrated_source(PUBLISHED["urban"], system, free=free)
        assert other.findings == ()
        assert other.source.rows[1][2] == free[0]
        top = other.row("TOP").computed
        assert top == pytest.approx(usual.row("TOP").computed, rel=5e-4)
    clipped = calibrated_source(PUBLISHED["urban"], system, free=(0.9, 0.0))
    assert "p23 = 0.9 clipped" in clipped.findings[0].message
    assert clipped.source.rows[0][2] == pytest.approx(0.0, abs=1e-16)


def test_noise_of_the_published_rows_moves_the_chain() -> None:
    rows = PUBLISHED["urban"]
    for by, pi2 in ((0.9, 0.060), (1.25, 0.040)):
        noisy = replace(rows, ie1=rows.ie1 / by, ie6=rows.ie6 / by)
        found = calibrated_source(noisy, galoroi_tree())
        assert found.stationary[1] == pytest.approx(pi2, abs=2e-3)


def test_order_of_the_states_does_not_matter() -> None:
    tree = galoroi_tree()
    source = replace(
        tree.sources[0], states=("missing", "correct", "wrong"), initial=(0.0, 1.0, 0.0)
    )
    turned = calibrated_source(PUBLISHED["cutting"], replace(tree, sources=(source,)))
    usual = calibrated_source(PUBLISHED["cutting"], tree)
    place = [2, 0, 1]
    rows = np.array(usual.source.rows)[np.ix_(place, place)]
    assert np.array(turned.source.rows) == pytest.approx(rows, rel=1e-11)


@pytest.mark.parametrize(
    "change",
    [
        {"ie6": 0.0}, {"ie5": 0.0}, {"ie1": 1e-12}, {"single_gnss_availability": 1.0},
        {"single_gnss_availability": 0.97},
    ],
)  # fmt: skip
def test_rows_without_a_chain_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match="infeasible"):
        calibrated_source(replace(PUBLISHED["urban"], **change), galoroi_tree())


def test_the_table_and_json(found: dict[str, CalibratedSource]) -> None:
    tunnel = found["tunnel"]
    assert list(tunnel.summary()["role"]).count("calibrated") == 5
    assert tunnel.row("IE5").relative is None
    assert tunnel.to_dict()["rows"][0]["name"] == "TOP"
    assert "calibrated" in str(tunnel)
