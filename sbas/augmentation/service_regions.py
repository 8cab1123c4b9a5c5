"""Service regions (type 27) over time, and the factor on the UDRE that they give a place.

Source: RTCA DO-229D, A.4.4.13 and J.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_types import ServiceRegions
from sbas.augmentation.tables import DELTA_UDRE

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LEAST_REGION_DEG = 1
LARGEST_SPAN_DEG = 179
"""A region that seems wider lies across the 180th meridian."""
MOST_REGIONS = 5


@dataclass(frozen=True, eq=False)
class RegionSet:
    """Regions of one issue: (r,) corners [deg], shapes, priorities, factors inside; and the
    factor outside all of them."""

    corners_deg: Ints
    rectangle: Bools
    priority: Ints
    inside: Floats
    outside: float


@dataclass(frozen=True, eq=False)
class RegionState:
    """What is known of regions from a second on.

    Parameters
    ----------
    from_s : second of the message that brought it.
    complete : the latest set of which every message has come; None before the first.
    complete_s : messages of that set.
    begun : messages so far of a newer issue; None where there is none.
    """

    from_s: int
    complete: RegionSet | None
    complete_s: Ints
    begun: RegionSet | None


def region_states(messages: ServiceRegions, alarm_s: Ints) -> tuple[RegionState, ...]:
    """States in the order of time; an alarm wipes out what came before it."""
    states: list[RegionState] = []
    after_alarm = np.searchsorted(alarm_s, messages.time_s, side="left")
    changed = (np.diff(messages.iods) != 0) | (np.diff(after_alarm) != 0)
    ends = [0, *(np.flatnonzero(changed) + 1).tolist(), messages.time_s.size]
    complete, complete_s = None, messages.time_s[:0]
    for start, end in pairwise(ends):
        if start and after_alarm[start] != after_alarm[start - 1]:
            complete, complete_s = None, messages.time_s[:0]
        # The first message of each number counts; it comes again with the same content.
        held: dict[int, int] = {}
        wanted = int(messages.messages[start]) if end > start else 0
        for row in range(start, end):
            number = int(messages.number[row])
            if number in held:
                continue
            held[number] = row
            found = _region_set(messages, [held[k] for k in sorted(held)])
            second = int(messages.time_s[row])
            if len(held) < wanted:
                states.append(RegionState(second, complete, complete_s, found))
            elif len(held) == wanted:
                complete, complete_s = found, messages.time_s[start:end]
                states.append(RegionState(second, complete, complete_s, None))
    return tuple(states)


def _region_set(messages: ServiceRegions, rows: list[int]) -> RegionSet:
    corners, shapes, priorities, inside = [], [], [], []
    for row in rows:
        for k in range(min(int(messages.regions[row]), MOST_REGIONS)):
            lat1, lon1, lat2, lon2 = messages.corners_deg[row, k].tolist()
            width = abs(lon1 - lon2)
            narrow = min(width, 360 - width) < LEAST_REGION_DEG
            if abs(lat1 - lat2) < LEAST_REGION_DEG or narrow:
                continue
            corners.append((lat1, lon1, lat2, lon2))
            shapes.append(bool(messages.rectangle[row, k]))
            priorities.append(int(messages.priority[row]))
            inside.append(float(DELTA_UDRE[messages.inside[row]]))
    return RegionSet(
        np.array(corners, np.int64).reshape(-1, 4),
        np.array(shapes, bool),
        np.array(priorities, np.int64),
        np.array(inside, float),
        float(max(DELTA_UDRE[messages.outside[row]] for row in rows)),
    )


def inside_factor(regions: RegionSet, lat_deg: Floats, lon_deg: Floats) -> Floats:
    """(n,) the smallest factor of the regions with the highest priority that hold each place;
    NaN where none does.

    A triangle has its corners at (lat1, lon1), (lat2, lon2) and (lat1, lon2).
    """
    factor = np.full(lat_deg.size, np.nan)
    best = np.full(lat_deg.size, -1)
    for corners, rectangle, priority, inside in zip(
        regions.corners_deg, regions.rectangle, regions.priority, regions.inside, strict=True
    ):
        within = _within(corners, bool(rectangle), lat_deg, lon_deg)
        higher, equal = within & (priority > best), within & (priority == best)
        factor = np.where(higher, inside, np.where(equal, np.fmin(factor, inside), factor))
        best = np.where(higher, priority, best)
    return factor


def _within(corners: Ints, rectangle: bool, lat_deg: Floats, lon_deg: Floats) -> Bools:
    lat1, lon1, lat2, lon2 = (float(value) for value in corners)
    lon = (lon_deg + 180) % 360 - 180
    if abs(lon1 - lon2) > LARGEST_SPAN_DEG:
        lon1, lon2 = lon1 % 360, lon2 % 360
        lon = lon_deg % 360
    # Coordinates from the right-angled corner (lat1, lon2), 1 at the two others.
    y = (lat_deg - lat1) / (lat2 - lat1)
    x = (lon - lon2) / (lon1 - lon2)
    inside: Bools = (x >= 0) & (y >= 0)
    return inside & (x <= 1) & (y <= 1) if rectangle else inside & (x + y <= 1)


def region_factor(
    complete: RegionSet, begun: RegionSet | None, lat_deg: Floats, lon_deg: Floats
) -> Floats:
    """(n,) factor at places by a complete set and by what has come of a newer one.

    A smaller factor of a newer issue counts only once that issue is complete.
    """
    factor, outside = inside_factor(complete, lat_deg, lon_deg), complete.outside
    if begun is not None:
        factor = np.fmax(factor, inside_factor(begun, lat_deg, lon_deg))
        outside = max(outside, begun.outside)
    return np.where(np.isnan(factor), outside, factor)
