from __future__ import annotations

from typing import get_args

import pytest

from sbas.dependability.exchange.losses import (
    CAPABILITIES,
    Format,
    Loss,
    LossReport,
    capability_table,
    loss_of,
)
from tests.conftest import ROOT


def test_the_table_answers_for_every_format() -> None:
    for construct, holdings in CAPABILITIES.items():
        assert set(holdings) == set(get_args(Format)), construct


def test_the_documentation_prints_the_table() -> None:
    page = (ROOT / "docs/methods/fault-tree-exchange.md").read_text(encoding="utf-8")
    assert capability_table() in page


def test_a_report_lists_what_is_not_kept() -> None:
    kept = loss_of("a", "not", "Open-PSA")
    lost = loss_of("b", "not", "Galileo", besides="n")
    report = LossReport("Galileo", (kept, lost))
    assert report.lost == (lost,)
    assert str(report).splitlines()[1] == "  b (not): refused; the format has no such thing; n"
    assert list(report.summary()["element"]) == ["a", "b"]
    assert str(LossReport("Galileo", (kept,))) == "Galileo: everything is kept."
    assert LossReport("Galileo", ()).summary().empty


def test_a_treatment_is_one_of_four() -> None:
    with pytest.raises(ValueError, match="unknown treatment"):
        Loss("a", "not", "dropped", "")  # type: ignore[arg-type]
