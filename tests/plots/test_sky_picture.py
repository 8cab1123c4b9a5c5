"""Where the sky plot puts a satellite, and how it says what became of its ranges."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Wedge

from sbas.augmentation.reasons import WORDS, Reason
from sbas.plots.reason_classes import CLASSES, OTHER, classes_of
from sbas.plots.sky_picture import BREAK_DEG, TRACK_POINTS, sky
from sbas.plots.style import BLUE, ORANGE
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE
from tests.plots.protected import protected


def legend(ax: Axes) -> list[str]:
    found = ax.get_legend()
    assert found is not None
    return [text.get_text() for text in found.get_texts()]


def marks(ax: Axes) -> list[tuple[float, float, str]]:
    """(x, y, marker) of every satellite's last place."""
    return [
        (float(line.get_xdata()[0]), float(line.get_ydata()[0]), str(line.get_marker()))
        for line in ax.get_lines()
        if np.size(line.get_xdata()) == 1
    ]


def with_side(recording: Recording, **columns: object) -> Recording:
    side = recording.side_tables[SIDE_TABLE].assign(**columns)
    return recording.replace(side_tables={SIDE_TABLE: side})


def test_north_is_up_east_to_the_right_and_the_zenith_in_the_middle() -> None:
    found = marks(sky(protected(1)))
    assert len(found) == 5
    # G02 60 deg high in the east, G03 45 deg in the south, G04 30 deg in the west.
    np.testing.assert_allclose(found[1][:2], (30, 0), atol=1e-9)
    np.testing.assert_allclose(found[2][:2], (0, -45), atol=1e-9)
    np.testing.assert_allclose(found[3][:2], (-60, 0), atol=1e-9)
    assert np.hypot(*found[0][:2]) == pytest.approx(5)
    # G04 lacks its ionosphere at the only epoch, G05 stands below the mask.
    assert [marker for *_, marker in found] == ["o", "o", "o", "o", "v"]


def test_shares_are_those_of_the_table() -> None:
    ax = sky(protected(20))
    words = legend(ax)
    # 100 ranges: G05 20 times too low, G04 10 times without ionosphere.
    assert "used: 70 (70 %)" in words
    assert "below the elevation mask: 20 (20 %)" in words
    assert "no ionospheric correction: 10 (10 %)" in words
    assert "G04 50 %" in {text.get_text() for text in ax.texts}
    rings = [p for p in ax.patches if isinstance(p, Wedge)]
    halves = [p for p in rings if p.theta2 - p.theta1 == pytest.approx(180)]
    assert len(rings) == 6
    assert {matplotlib_hex(p) for p in halves} == {BLUE.lower(), ORANGE.lower()}


def matplotlib_hex(patch: Wedge) -> str:
    from matplotlib.colors import to_hex

    return to_hex(patch.get_facecolor())


@pytest.mark.parametrize("mask_deg", [0.0, 7.5, 15.0])
def test_the_mask_is_the_one_that_the_recording_states(mask_deg: float) -> None:
    ax = sky(protected(mask_deg=mask_deg))
    assert f"elevation mask, {mask_deg:g}°" in legend(ax)
    dashed = [p for p in ax.patches if isinstance(p, Circle) and p.get_linestyle() != "solid"]
    assert any(p.get_radius() == pytest.approx(90 - mask_deg) for p in dashed)


def test_no_mask_is_drawn_that_no_one_stated() -> None:
    recording = protected()
    bare = recording.replace(meta=type(recording.meta)())
    assert not any("mask," in words for words in legend(sky(bare)))


def test_one_lost_epoch_of_a_long_track_is_drawn() -> None:
    recording = protected(5 * TRACK_POINTS)
    side = recording.side_tables[SIDE_TABLE]
    first = np.flatnonzero(side["satellite"] == "G01")[1234]
    used = side["used"].to_numpy().copy()
    used[first] = False
    reason = side["reason"].cat.add_categories([WORDS[Reason.CYCLE_SLIP]])
    reason.iloc[first] = WORDS[Reason.CYCLE_SLIP]
    ax = sky(with_side(recording, used=used, reason=reason))
    signal = next(c for c in CLASSES if c.words.startswith("weak"))
    tracks = [line for line in ax.get_lines() if np.size(line.get_xdata()) == 3]
    assert signal.colour in {line.get_color() for line in tracks}
    assert any("weak" in words and ": 1 (" in words for words in legend(ax))
    assert "G01 99 %" in {text.get_text() for text in ax.texts}


def test_ranges_without_direction_are_counted_and_not_drawn() -> None:
    recording = protected(10)
    elevation = recording.side_tables[SIDE_TABLE]["elevation_deg"].to_numpy().copy()
    elevation[:7] = np.nan
    assert "7 ranges of unknown direction are not drawn" in legend(
        sky(with_side(recording, elevation_deg=elevation))
    )


def test_every_reason_has_a_class_and_foreign_words_are_other() -> None:
    recording = protected(10)
    side = recording.side_tables[SIDE_TABLE]
    words = [word for word in WORDS.values() if word]
    assert len(side) >= len(words)
    texts = np.array([*words, *["Sonnenflecken"] * (len(side) - len(words))], object)
    kinds = classes_of(side.assign(used=False, reason=texts))
    other = {text for text, kind in zip(texts, kinds.tolist(), strict=True) if kind == OTHER}
    assert other == {"Sonnenflecken", WORDS[Reason.NOT_A_RANGING_SATELLITE]}
    assert set(kinds.tolist()) == set(range(1, len(CLASSES)))
    assert len({(c.colour, c.marker) for c in CLASSES}) == len({c.marker for c in CLASSES})


def test_a_track_is_not_drawn_across_an_absence() -> None:
    recording = protected(10)
    azimuth = recording.side_tables[SIDE_TABLE]["azimuth_deg"].to_numpy().copy()
    azimuth[25:] += 40.0
    ax = sky(with_side(recording, azimuth_deg=azimuth))
    steps = []
    # The cross of the compass is no track.
    for line in ax.get_lines()[1:]:
        x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        steps += np.hypot(np.diff(x), np.diff(y)).tolist()
    # At 60 degrees of elevation and less, 40 degrees of azimuth are 20 and more.
    assert np.nanmax(steps) < BREAK_DEG
