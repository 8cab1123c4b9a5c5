"""The result as a table and as plain values."""

from __future__ import annotations

import json

from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import Con
from tests.dependability.exact.test_product_chain import two_state


def test_tables_and_plain_values() -> None:
    solution = solve(two_state(1, (Con("top", 2, "e0"),)), names=[], first_passage=True)
    table = solution.summary()
    assert list(table.index) == ["top"]
    row = json.loads(json.dumps(solution.to_dict()))["rows"][0]
    assert row["occurrences"] == table.loc["top", "occurrences"] == solution.top.occurrences
    assert solution.availability + solution.top.mean_unavailability == 1.0
    assert dict(solution.curves) == {}
