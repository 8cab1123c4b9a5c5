"""One measure of some gates, and the part of a model below a gate."""

from __future__ import annotations

import pytest

from sbas.dependability.analysis.asked_measure import measured, part_below
from sbas.dependability.tree.model import And, Or
from sbas.exceptions import InputError
from tests.dependability.analysis.small_models import hardware_tree
from tests.dependability.path_enumeration import by_paths

MODEL = hardware_tree(
    {"x": 0.2, "y": 0.3, "z": 0.1}, And("G", ("X", "Y")), Or("T", ("G", "Z")),
    repair_rate_per_h=0.5, epochs=4, cases=("G", "T"),
)  # fmt: skip


def test_measures_by_every_history() -> None:
    paths = by_paths(MODEL)
    for name in ("G", "T"):
        expected = {
            "mean": paths[name].on[1:].mean(),
            "at_end": paths[name].on[-1],
            "at_least_once": paths[name].once,
            "occurrences_per_h": paths[name].occurrences / 4,
        }
        for measure, value in expected.items():
            found = measured(MODEL, ["G", "T"], measure)  # type: ignore[arg-type]
            assert found[name] == pytest.approx(value, rel=1e-11)
    with pytest.raises(InputError, match="no measure"):
        measured(MODEL, ["G"], "median")  # type: ignore[arg-type]


def test_only_what_is_below() -> None:
    part = part_below(MODEL, "G")
    assert part.top == "G"
    assert [e.name for e in part.events] == ["X", "Y"]
    assert [g.name for g in part.gates] == ["G"]
    assert part.cases == ("G",)
    assert part_below(MODEL, "X").gates == ()
    assert part_below(MODEL, None) == MODEL
    with pytest.raises(InputError, match="no event or gate"):
        part_below(MODEL, "nobody")
