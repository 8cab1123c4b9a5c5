"""The bars of a variance budget are the variances of the table."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes

from sbas.exceptions import InputError
from sbas.plots.budget_picture import variance_budget
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE
from tests.plots.protected import SIGMAS_M, protected


def with_side(recording: Recording, **columns: object) -> Recording:
    side = recording.side_tables[SIDE_TABLE].assign(**columns)
    return recording.replace(side_tables={SIDE_TABLE: side})


def words(ax: Axes) -> str:
    legend = ax.get_legend()
    texts = [*ax.texts, ax.title, *(legend.get_texts() if legend else [])]
    return "\n".join([*(t.get_text() for t in texts), ax.get_title(loc="left")])


def test_terms_are_stacked_up_to_the_square_of_the_total() -> None:
    """9 + 16 + 0.04 + 144 = 169.04, the square of 13.0015 (exact arithmetic)."""
    ax = variance_budget(protected())
    widths = np.array([patch.get_width() for patch in ax.patches]).reshape(4, -1)
    assert widths.shape == (4, 4)
    np.testing.assert_allclose(widths, np.repeat([[9], [16], [0.04], [144]], 4, axis=1))
    ends = [line.get_xdata()[0] for line in ax.get_lines()]
    np.testing.assert_allclose(ends, 169.04)
    assert words(ax).count("σ 13.00 m") == 4
    assert "not given by source" not in words(ax)
    assert f"troposphere, σ {SIGMAS_M['sigma_tropo_m']:.2f} m" in words(ax)


def test_the_highest_satellite_stands_above() -> None:
    ax = variance_budget(protected())
    names = [label.get_text() for label in ax.get_yticklabels()]
    assert [name.split()[0] for name in names] == ["G04", "G03", "G02", "G01"]


def test_the_usual_epoch_is_that_of_the_largest_level() -> None:
    ax = variance_budget(protected(20))
    assert "2020-01-01 00:00:18 GPST, PA: HPL 40.00 m, the largest" in words(ax)
    chosen = variance_budget(protected(20), "2020-01-01T00:00:03")
    assert "2020-01-01 00:00:03 GPST, PA: HPL 10.00 m" in words(chosen)
    assert "the largest" not in words(chosen)
    assert "G04 (ionospheric grid points not monitored)" in words(chosen).replace("\n", " ")
    same = variance_budget(protected(20), np.datetime64("2020-01-01T00:00:03", "ms"))
    assert same.get_title(loc="left") == chosen.get_title(loc="left")


def test_a_time_that_is_no_epoch_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"00:00:03.*00:00:04"):
        variance_budget(protected(), "2020-01-01T00:00:03.5")


def test_terms_that_are_not_given_are_not_taken_for_zero() -> None:
    recording = protected()
    side = recording.side_tables[SIDE_TABLE].drop(columns=["sigma_air_m"])
    ax = variance_budget(recording.replace(side_tables={SIDE_TABLE: side}))
    assert "not given by source" in words(ax)
    rest = [p.get_width() for p in ax.patches][-4:]
    np.testing.assert_allclose(rest, 144)


def test_a_bar_far_beyond_the_others_is_cut_and_says_so() -> None:
    recording = protected()
    side = recording.side_tables[SIDE_TABLE]
    one = (side["satellite"] == "G03").to_numpy()
    ax = variance_budget(
        with_side(
            recording,
            sigma_flt_m=np.where(one, 60.0, side["sigma_flt_m"]),
            sigma_m=np.where(one, 61.3, side["sigma_m"]),
        )
    )
    assert "σ 61.30 m →" in words(ax)
    assert ax.get_xlim()[1] < 300
    # Where all are as large none is cut.
    every = variance_budget(with_side(recording, sigma_m=side["sigma_m"] * 5))
    assert "→" not in words(every)


def test_an_epoch_without_any_used_satellite_says_so() -> None:
    recording = protected()
    ax = variance_budget(with_side(recording, used=False))
    assert "no satellite was used at this epoch" in words(ax)
    bare = recording.replace(table=recording.table.drop(columns="hpl_m"))
    assert "no protection level in this recording" in words(variance_budget(bare))
    assert "no HPL" in words(variance_budget(bare, "2020-01-01T00:00:03"))
