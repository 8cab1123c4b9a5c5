"""Parameters by name, there and back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sbas.dependability.analysis.model_parameters import (
    row_parameters,
    scalar_parameters,
    with_parameters,
)
from sbas.dependability.tree.model import MarkovSource, Or, Stage, Undeveloped
from sbas.exceptions import InputError
from tests.dependability.analysis.small_models import hardware_tree

A, B, C = (((1 - p, p), (0.5, 0.5)) for p in (0.1, 0.2, 0.3))


def test_every_scalar_there_and_back() -> None:
    model = hardware_tree({"x": 0.1, "y": 0.2}, Or("T", ("X", "Y")))
    model = replace(model, events=(*model.events, Undeveloped("U", 0.1)))
    found = scalar_parameters(model)
    assert found["y.failure_rate_per_h"] == 0.2
    other = {name: 0.25 + value / 2 for name, value in found.items()}
    assert scalar_parameters(with_parameters(model, other)) == other
    assert with_parameters(model, found) == model


def test_rows_of_stages_by_label() -> None:
    stages = (Stage("town", 1, A), Stage("wood", 1, B), Stage("town", 1, A), Stage("wood", 1, C))
    source = MarkovSource("S", ("good", "bad"), A, (1.0, 0.0), stages=stages)
    model = replace(hardware_tree({"x": 0.1}, Or("T", ("X",))), sources=(source,))
    found = {name: rows for name, (_, rows) in row_parameters(model).items()}
    assert found == {"S.town.rows": A, "S.wood[1].rows": B, "S.wood[3].rows": C}
    changed = with_parameters(model, {}, {"S.town.rows": B, "S.wood[3].rows": A}).sources[0]
    assert [stage.rows for stage in changed.stages] == [B, B, B, A]
    plain = replace(model, sources=(replace(source, stages=()),))
    assert with_parameters(plain, {}, {"S.rows": C}).sources[0].rows == C


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(InputError, match="no parameter") as error:
        with_parameters(hardware_tree({"x": 0.1}, Or("T", ("X",))), {"x.failure_rate": 1.0})
    assert "x.failure_rate_per_h" in error.value.cure
