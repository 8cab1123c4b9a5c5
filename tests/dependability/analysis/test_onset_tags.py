"""Histories of onsets, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.analysis.onset_tags import CUT, OnsetTags, Sequence_, contains
from sbas.exceptions import InputError


def walk(tags: OnsetTags, *truth: str) -> Sequence_:
    """The history after epochs at which the named events are true."""
    tag, before = np.zeros(1, dtype=np.int64), 0
    for true in truth:
        now = sum(1 << tags.events.index(name) for name in true)
        tag = tags.step(tag, np.array([now & ~before]), np.array([now]))
        before = now
    return tags.sequence(int(tag[0]))


def test_onsets_in_order_since_all_were_false() -> None:
    tags = OnsetTags("xyz", 4)
    assert walk(tags, "x", "xy", "y", "yz") == (("x",), ("y",), ("z",))
    assert walk(tags, "x", "", "y") == (("y",),)
    assert walk(tags, "xy", "xyz") == (("x", "y"), ("z",))
    assert walk(tags, "x", "xy", "y", "xy") == (("y",), ("x",))
    assert walk(tags, "xz", "z", "xz") == (("z",), ("x",))


def test_repeats_are_kept_where_asked_for() -> None:
    tags = OnsetTags("xyz", 4, repeating="xy")
    assert walk(tags, "x", "xy", "y", "xy") == (("x",), ("y",), ("x",))
    long = walk(tags, "x", "xy", "y", "xy", "x", "xy", "xyz")
    assert long == (CUT, ("y",), ("x",), ("y",), ("z",))
    assert {"x", "y", "z"} <= {name for step in long for name in step}


def test_a_short_memory_drops_the_oldest() -> None:
    assert walk(OnsetTags("xyz", 2), "x", "xy", "xyz") == (CUT, ("y",), ("z",))


def test_containing() -> None:
    x, y, xy = ("x",), ("y",), ("x", "y")
    assert contains((x, y), (x,))
    assert contains((x, y), (x, y))
    assert contains((xy, y), (x, y))
    assert not contains((y, x), (x, y))
    assert not contains((xy,), (x, y))
    assert contains((x,), ())


def test_refusals() -> None:
    with pytest.raises(InputError):
        OnsetTags([f"e{i}" for i in range(63)], 4)
    with pytest.raises(InputError):
        OnsetTags("x", 0)
