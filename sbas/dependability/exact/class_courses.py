"""Boolean functions of parts that share nothing, from the classes that each part can be in.

A part of a vote over redundant channels says more than true or false: a channel is free of
failure, recognised as failed, or wrong. Classes are kept apart at an epoch and at the epoch
before, so that only products and sums of probabilities are taken, never 1 - p.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.modules import Course
from sbas.dependability.exact.transitions import Floats

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class ClassCourse:
    """Classes over the mission, exactly one of which holds at each epoch.

    Parameters
    ----------
    on : (N + 1, K) probability of each class at n.
    pairs : (N + 1, K, K) probability of one class at n - 1 and one at n; 0 at n = 0.
    inside : (N + 1, K, Q) probability of each class at Q instants after each epoch; None where
        they are not asked for.
    """

    on: Floats
    pairs: Floats
    inside: Floats | None = None

    def course(self) -> Course:
        """Of the last of two classes."""
        inside = None if self.inside is None else self.inside[:, -1]
        return Course(self.on[:, -1], self.pairs[:, 0, -1], inside)


def combined(table: Bools, parts: Sequence[ClassCourse]) -> ClassCourse:
    """A boolean function of the classes of independent parts.

    Parameters
    ----------
    table : (K_1, ..., K_m) truth of the function.
    parts : m courses of one length, with K_1 to K_m classes.

    Returns
    -------
    ClassCourse of two classes: false, true.

    Notes
    -----
    Exact. Part after part is fixed; what is left of the function decides which ways run together
    (Bryant 1986, reduced decision diagrams; here at two epochs at once).
    """
    length = len(parts[0].on)
    on = _folded((table,), [part.on[:, None, :] for part in parts], (length, 1))
    pairs = _folded((table, table), [part.pairs[1:, None] for part in parts], (length - 1, 1))
    inside = [part.inside for part in parts if part.inside is not None]
    within = None
    if len(inside) == len(parts):
        instants = inside[0].shape[2]
        within = _folded((table,), [np.moveaxis(p, 1, 2) for p in inside], (length, instants))
    return ClassCourse(
        np.concatenate([on[False,], on[True,]], axis=1),
        np.concatenate([
            np.zeros((1, 2, 2)),
            np.stack([np.concatenate([pairs[was, now] for now in (False, True)], axis=1)
                      for was in (False, True)], axis=1),
        ]),
        None if within is None else np.stack([within[False,], within[True,]], axis=1),
    )  # fmt: skip


def _folded(
    tables: tuple[Bools, ...], laws: Sequence[Floats], shape: tuple[int, ...]
) -> dict[tuple[bool, ...], Floats]:
    """Sums over all classes of the products of laws (*shape, K, ...), by the functions' values."""
    ways: dict[tuple[bytes, ...], tuple[tuple[Bools, ...], Floats]] = {
        tuple(t.tobytes() for t in tables): (tables, np.ones(shape))
    }
    for law in laws:
        grown: dict[tuple[bytes, ...], tuple[tuple[Bools, ...], Floats]] = {}
        for left, weight in ways.values():
            for classes in np.ndindex(*law.shape[len(shape) :]):
                rest = tuple(np.asarray(t[c]) for t, c in zip(left, classes, strict=True))
                key = tuple(t.tobytes() for t in rest)
                value = weight * law[(..., *classes)]
                grown[key] = (rest, grown[key][1] + value if key in grown else value)
        ways = grown
    found = {values: np.zeros(shape) for values in np.ndindex(*([2] * len(tables)))}
    for rest, weight in ways.values():
        found[tuple(int(t) for t in rest)] = weight
    return {tuple(bool(v) for v in values): weight for values, weight in found.items()}
