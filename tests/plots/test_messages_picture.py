"""Gaps, damage and time-outs of a message time line, on messages put in by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from sbas.augmentation.messages import SbasMessages
from sbas.exceptions import InputError
from sbas.plots.messages_picture import BINS, expired_spans, message_timeline, timeout_s
from tests.augmentation.encoding import (
    START_S,
    degradation,
    fast,
    heard,
    hourly,
    integrity,
    mixed,
    null,
)

FAST = fast(2, 0, 1, [0] * 13, [5] * 13)
INTEGRITY = integrity([0] * 4, [5] * 51)


def legend(ax: Axes) -> list[str]:
    found = ax.get_legend()
    assert found is not None
    return [text.get_text() for text in found.get_texts()]


def spans(messages: SbasMessages, kind: int, mode: str = "pa") -> list[list[int]]:
    return (expired_spans(messages, kind, mode=mode) - START_S).tolist()  # type: ignore[arg-type]


def test_content_expires_at_its_time_out_and_not_before() -> None:
    """Table A-25 of DO-229D: UDREI 12 s in PA, 18 s in NPA."""
    at_limit = hourly({0: FAST, 12: FAST}, 20)
    assert spans(at_limit, 2) == []
    late = hourly({0: FAST, 13: FAST}, 20)
    assert spans(late, 2) == [[12, 13]]
    assert spans(late, 2, "npa") == []
    never_again = hourly({5: FAST}, 60)
    assert spans(never_again, 2) == [[17, 59]]
    assert spans(never_again, 2, "npa") == [[23, 59]]


def test_integrity_messages_renew_fast_corrections_only_after_the_first() -> None:
    assert spans(hourly({0: FAST, 10: INTEGRITY, 20: FAST}, 22), 2) == []
    assert spans(hourly({0: INTEGRITY, 5: INTEGRITY, 30: FAST}, 40), 2) == []
    assert spans(hourly({0: INTEGRITY}, 40), 6) == []


@pytest.mark.parametrize(("block", "expected"), [(0, []), (1, [[12, 20]])])
def test_type_24_renews_the_block_that_it_carries(block: int, expected: list[list[int]]) -> None:
    both = mixed(0, 1, block, [0] * 6, [5] * 6, [])
    assert spans(hourly({0: FAST, 10: both, 20: FAST}, 22), 2) == expected


def test_slow_data_have_four_minutes_in_pa_and_six_in_npa() -> None:
    slow = hourly({0: degradation()}, 400)
    assert spans(slow, 10) == [[240, 399]]
    assert spans(slow, 10, "npa") == [[360, 399]]
    assert [timeout_s(kind, mode="pa") for kind in (1, 18, 26, 27)] == [600, 1200, 600, 86400]
    assert timeout_s(63, mode="pa") is None


def test_gaps_are_told_apart_by_whether_they_void_the_corrections() -> None:
    seconds = [*range(10), *range(13, 20), *range(24, 40)]
    ax = message_timeline(heard(*((s, null()) for s in seconds)))
    # Seconds 10 to 12 are three lost messages; 20 to 23 are four.
    assert legend(ax)[1:] == ["4 or more lost, fast corrections void: 1", "1 to 3 lost: 1"]
    widths = sorted(round(p.get_width()) for p in ax.patches)
    assert widths == [3, 4]


def test_damage_is_marked_and_counted() -> None:
    messages = hourly({}, 30)
    bad = np.array([START_S + 7, START_S + 8])
    ax = message_timeline(replace(messages, bad_time_s=bad, bad_prn=np.full(2, 131)))
    assert "damaged: 2" in legend(ax)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["null  63", "damaged"]


def test_expired_content_is_drawn_where_it_is() -> None:
    ax = message_timeline(hourly({0: FAST}, 60))
    assert "all of this type expired" in legend(ax)
    (bars,) = (c for c in ax.collections if len(c.get_paths()))
    left, right = (f(bars.get_paths()[0].vertices[:, 0]) for f in (np.min, np.max))
    # The axis begins a second before the first message.
    assert (left, right) == pytest.approx((13, 60))
    assert "all of this type expired" not in legend(message_timeline(hourly({0: FAST}, 10)))


def test_every_message_of_a_long_record_is_within_a_bin_of_a_stroke() -> None:
    n = 4 * BINS
    ax = message_timeline(hourly(dict.fromkeys(range(0, n, 6), FAST), n))
    strokes = [np.asarray(line.get_xdata(), float)[::3] for line in ax.get_lines()]
    fast_rows = max(strokes, key=np.size)
    assert fast_rows.size <= BINS + 1
    x = np.arange(0, n, 6) + 1.0
    unit = n / float(ax.get_xlim()[1])
    nearest = np.abs(fast_rows[None, :] * unit - x[:, None]).min(axis=1)
    assert nearest.max() <= n / BINS


def test_several_satellites_are_refused_with_the_way_out() -> None:
    both = hourly({}, 4)
    both = replace(both, prn=np.array([131, 131, 133, 133]))
    with pytest.raises(InputError, match=r"of_prn\(131\)"):
        message_timeline(both)
