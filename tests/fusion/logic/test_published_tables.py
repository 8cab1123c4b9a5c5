"""Published figures as data: counts, and what ties the tables to Figure 9."""

from __future__ import annotations

import pytest

from sbas.exceptions import InputError
from sbas.fusion.logic.published_tables import (
    CRITICAL_TABLES,
    CRITICAL_TIMES,
    NOMINAL_ROWS,
    STATED_COUNTS,
    TREATMENT_ERRORS_M,
    codes_of,
    figure_9,
)
from sbas.fusion.states import DA, N, U, combination_states


def test_leaves_of_the_printed_figure_one_by_one() -> None:
    """Railways 2014, Figure 9, read from O1 to O27."""
    nominal = {1, 2, 5, 6, 10, 11, 13}
    for version, leaves in (("printed", nominal), ("corrected", nominal - {6} | {4})):
        outcomes = figure_9(version).outcomes  # type: ignore[arg-type]
        for leaf in range(1, 28):
            expected = N if leaf in leaves else U if leaf == 27 else DA
            assert outcomes[leaf - 1] == expected, (version, leaf)
    with pytest.raises(InputError, match="no version"):
        figure_9("other")  # type: ignore[arg-type]


def test_the_corrected_version_says_so() -> None:
    assert "as printed" in figure_9("printed").provenance
    assert "O4 and O6 exchanged" in figure_9().provenance


def test_each_table_has_eight_different_rows_of_its_sensors() -> None:
    for number, table in CRITICAL_TABLES.items():
        assert table.number == number
        codes = table.codes()
        assert len(set(codes.tolist())) == 8
        states = combination_states(codes, len(table.names)).T
        assert ["".join("NDU"[s] for s in row) for row in states] == list(table.rows)


def test_rows_of_table_2_are_degraded_in_the_corrected_figure_only() -> None:
    codes = CRITICAL_TABLES[2].codes()
    assert int((figure_9().outcomes[codes] == DA).sum()) == 8
    assert int((figure_9("printed").outcomes[codes] == DA).sum()) == 7


def test_the_three_nominal_rows_are_nominal_in_the_corrected_figure_only() -> None:
    assert figure_9().outcomes[codes_of(NOMINAL_ROWS)].tolist() == [N, N, N]
    assert figure_9("printed").outcomes[codes_of(NOMINAL_ROWS)].tolist() == [N, N, DA]


def test_redundant_sensors_agree_in_every_row_of_tables_3_and_4() -> None:
    for number in (3, 4):
        assert all(row[0] == row[1] for row in CRITICAL_TABLES[number].rows)


def test_critical_times_and_treatments_of_the_paper() -> None:
    (first, readjusted, second) = CRITICAL_TIMES
    assert (first.shortest_s, first.longest_s) == (2.0, 2.0)
    assert first.rows[0] in CRITICAL_TABLES[2].rows
    # (phi, phi, U): the receiver is U and the others are in any state.
    states = combination_states(codes_of(readjusted.rows), 3)
    assert set(states[2].tolist()) == {U}
    assert len(set(readjusted.rows)) == 9
    assert second.rows[0] in CRITICAL_TABLES[4].rows
    assert STATED_COUNTS["degraded"] == figure_9().counts()[1] + 1
    worst_first = sorted(TREATMENT_ERRORS_M, key=lambda key: -TREATMENT_ERRORS_M[key])
    assert worst_first == ["remove", "hold", "substitute"]
