"""Parts of a tree that share nothing: solved one by one, put together epoch by epoch.

Every part is a `Course`: probability to be true at each epoch and to become true there. From the
two follow the four pairs (before, now) of a part; a difference is taken only where an equally
large term without one is added beside it, so that sums keep their digits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from sbas.dependability.exact.transitions import Floats

MOST_OFTEN_TRUE = 0.999
"""1 - p keeps 13 digits up to here."""


@dataclass(frozen=True)
class Course:
    """A gate or event over the mission.

    Parameters
    ----------
    on : (N + 1,) probability to be true at n.
    rise : (N + 1,) probability to be false at n - 1 and true at n; 0 at n = 0.
    inside : (N + 1, Q) probability to be true at Q instants from each epoch to the next, where
        hardware moves between epochs; None where they are not asked for.
    """

    on: Floats
    rise: Floats
    inside: Floats | None = None


def independent_groups(
    names: Sequence[str], supports: Mapping[str, frozenset[str]]
) -> list[list[str]]:
    """Names in groups so that only names of one group depend on anything in common.

    Parameters
    ----------
    names : events or gates, each once.
    supports : what each depends on.
    """
    groups: list[tuple[set[str], list[str]]] = []
    for name in names:
        below, members = set(supports[name]), [name]
        apart = []
        for other, listed in groups:
            if below & other:
                below |= other
                members = [*listed, *members]
            else:
                apart.append((other, listed))
        groups = [*apart, (below, members)]
    return [members for _, members in groups]


def at_least(k: int, parts: Sequence[Course]) -> Course:
    """At least k of independent parts (1: OR; all: AND).

    Parameters
    ----------
    k : 1 to the number of parts.
    parts : of one length.

    Returns
    -------
    Course: on by convolution of counts, rise by convolution of pairs (before, now).

    References
    ----------
    Barlow, Heidtmann 1984, k-out-of-n systems by recursive convolution.
    """
    if len(parts) == 1:
        return parts[0]
    inside = [part.inside for part in parts if part.inside is not None]
    return Course(
        _at_least(k, [part.on for part in parts]),
        _rises(k, parts),
        _at_least(k, inside) if len(inside) == len(parts) else None,
    )


def any_passage(probabilities: Sequence[Floats]) -> Floats:
    """First passage of an OR of independent parts: u + (1 - u) v."""
    return reduce(lambda u, v: u + (1.0 - u) * v, probabilities)


def _at_least(k: int, parts: Sequence[Floats]) -> Floats:
    """P(count >= k); counts from k on are one."""
    if k == 1:
        return any_passage(parts)
    counts = [np.ones_like(parts[0]), *(np.zeros_like(parts[0]) for _ in range(k))]
    for p in parts:
        top = counts[k] + counts[k - 1] * p
        counts = [
            counts[0] * (1.0 - p),
            *(counts[c] * (1.0 - p) + counts[c - 1] * p for c in range(1, k)),
            top,
        ]
    return counts[k]


def _rises(k: int, parts: Sequence[Course]) -> Floats:
    """P(count < k before, count >= k now)."""
    n = len(parts[0].on)
    table = {(0, 0): np.ones(n - 1)}
    for part in parts:
        before, now, rise = part.on[:-1], part.on[1:], part.rise[1:]
        stays = np.maximum(now - rise, 0.0)
        pairs = {
            (0, 0): np.maximum(1.0 - before - rise, 0.0),
            (0, 1): rise,
            (1, 0): np.maximum(before - stays, 0.0),
            (1, 1): stays,
        }
        grown: dict[tuple[int, int], Floats] = {}
        for (b, a), weight in table.items():
            for (was, is_now), p in pairs.items():
                if b + was < k:  # a count that reached k before cannot become a rise
                    key = (b + was, min(a + is_now, k))
                    grown[key] = grown.get(key, 0.0) + weight * p
        table = grown
    risen = [weight for (_, a), weight in table.items() if a >= k]
    return np.concatenate([[0.0], np.sum(risen, axis=0)])
