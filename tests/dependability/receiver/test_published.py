"""The paper's rows as printed, and how they hang together."""

from __future__ import annotations

from pathlib import Path

import pytest

from sbas.dependability.receiver.published import PUBLISHED


def test_rows_as_printed(reference_data: Path) -> None:
    text = next((reference_data / "papers").glob("001*.txt")).read_text(encoding="utf-8")
    squeezed = "".join(text.split()).replace("\N{MINUS SIGN}", "-").replace("−", "-")
    for rows in PUBLISHED.values():
        for value in (rows.top, rows.be1, rows.ie1, rows.ie2, rows.ie5, rows.ie6):
            digits, power = f"{value:.2e}".split("e")
            printed = f"{float(digits):g}E-{-int(power)}" if value else "0"
            assert printed in squeezed, (rows.environment, value)
        assert f"{100 * rows.single_gnss_availability:.2f}%" in squeezed
        assert f"{100 * rows.unit_availability:.2f}%" in squeezed


@pytest.mark.parametrize("rows", PUBLISHED.values(), ids=lambda r: r.environment)
def test_the_printed_rows_add_up_to_the_printed_top(rows) -> None:  # type: ignore[no-untyped-def]
    total = rows.be1 + rows.ie1 + rows.ie2 + rows.ie5 + rows.ie6
    assert rows.top == pytest.approx(total, rel=6e-3)
    assert rows.unit_availability == pytest.approx(1 - rows.top, abs=6e-5)
