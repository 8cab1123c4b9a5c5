"""Ticks and their names."""

from __future__ import annotations

from matplotlib.figure import Figure

from sbas.plots.style import decades, log_axis, power_of_ten


def test_powers_of_ten_are_written_in_unicode() -> None:
    assert [power_of_ten(e) for e in (-12, -1, 0, 3)] == ["10⁻¹²", "10⁻¹", "1", "10³"]


def test_decades_lie_within_the_limits_and_are_thinned() -> None:
    assert decades(1e-3, 10).tolist() == [-3, -2, -1, 0, 1]
    assert decades(2e-3, 9).tolist() == [-2, -1, 0]
    assert len(decades(1e-30, 1, at_most=7)) <= 7


def test_a_short_log_axis_has_ticks_at_1_2_5() -> None:
    ax = Figure().subplots()
    log_axis(ax, "x", 8, 130)
    assert [t.get_text() for t in ax.get_xticklabels()] == ["10", "20", "50", "100"]
