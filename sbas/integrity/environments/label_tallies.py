"""One tally a label, filled in the same pass as that of the record, and which epochs are whose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.environment_labels.segments import UNLABELLED
from sbas.integrity.environments.record_part import RecordPart
from sbas.integrity.part_tally import EpochValues, PartTally

Ints = NDArray[np.int64]

MOST_LABELS = 32
"""More labels than these are no environments, and their counts would fill the memory."""


class LabelTallies:
    """Counts by environment label; `update` with batches in order, `merge` with what follows.

    Parameters
    ----------
    make : gives an empty tally.

    Notes
    -----
    `names` are in the order in which they come first, epochs without label under `UNLABELLED`.
    With more than `MOST_LABELS` of them `too_many` is set and all counts are dropped.
    """

    def __init__(self, make: Callable[[], PartTally]) -> None:
        self._make = make
        self.names: list[str] = []
        self.tallies: list[PartTally] = []
        self.too_many = False
        self._rows = 0
        self._last_code = -1
        self._end_ns = 0
        self._first: list[Ints] = []
        self._start_ns: list[Ints] = []
        self._codes: list[Ints] = []

    @property
    def labelled(self) -> bool:
        """True when any epoch has a label."""
        return self.too_many or any(name != UNLABELLED for name in self.names)

    def update(self, labels: pd.Series, values: EpochValues) -> None:
        """Count epochs that follow all earlier ones, at least one, by their (n,) categories."""
        codes = self._codes_of(labels)
        if self.too_many:
            return
        breaks = np.flatnonzero(np.diff(codes, prepend=self._last_code))
        self._first.append(self._rows + breaks)
        self._start_ns.append(values.time_ns[breaks])
        self._codes.append(codes[breaks])
        self._rows += codes.size
        self._last_code = int(codes[-1])
        self._end_ns = int(values.time_ns[-1])
        for code in np.unique(codes).tolist():
            rows = np.flatnonzero(codes == code)
            self.tallies[code].update(values if rows.size == codes.size else values.at(rows))

    def _codes_of(self, labels: pd.Series) -> Ints:
        """(n,) indices into `names`, which grows by the labels that are new."""
        own = labels.cat.codes.to_numpy()
        used, first = np.unique(own, return_index=True)
        table = np.zeros(len(labels.cat.categories) + 1, np.int64)
        for i in used[np.argsort(first)].tolist():
            name = UNLABELLED if i < 0 else str(labels.cat.categories[i]).strip() or UNLABELLED
            table[i] = self._code_of(name)
        codes: Ints = table[own]
        return codes

    def _code_of(self, name: str) -> int:
        if name not in self.names:
            if self.too_many or len(self.names) == MOST_LABELS:
                self._drop()
                return 0
            self.names.append(name)
            self.tallies.append(self._make())
        return self.names.index(name)

    def _drop(self) -> None:
        self.too_many = True
        self.names, self.tallies = [], []
        self._first, self._start_ns, self._codes = [], [], []

    def merge(self, other: LabelTallies) -> None:
        """Add the epochs that follow."""
        if self.too_many or other.too_many:
            self._drop()
            return
        table = np.array([self._code_of(name) for name in other.names], np.int64)
        if self.too_many or not other.names:
            return
        for code, tally in zip(table.tolist(), other.tallies, strict=True):
            self.tallies[code].merge(tally)
        first, start_ns, codes = other._stretches()
        # A stretch that goes on is one.
        new = slice(int(table[codes[0]] == self._last_code), None)
        self._first.append(first[new] + self._rows)
        self._start_ns.append(start_ns[new])
        self._codes.append(table[codes[new]])
        self._rows += other._rows
        self._last_code = int(table[other._last_code])
        self._end_ns = other._end_ns

    def _stretches(self) -> tuple[Ints, Ints, Ints]:
        first, start_ns, codes = map(np.concatenate, (self._first, self._start_ns, self._codes))
        return first, start_ns, codes

    def parts(self, interval_ns: int) -> dict[str, tuple[PartTally, RecordPart]]:
        """Tally and epochs by label in order of first appearance, those without label last."""
        if self.too_many or not self.labelled:
            return {}
        first, start_ns, codes = self._stretches()
        stop = np.append(first[1:], self._rows)
        end_ns = np.append(start_ns[1:], self._end_ns + interval_ns)
        found = {}
        for code in sorted(range(len(self.names)), key=lambda i: self.names[i] == UNLABELLED):
            here = codes == code
            part = RecordPart(first[here], stop[here], start_ns[here], end_ns[here])
            found[self.names[code]] = (self.tallies[code], part)
        return found
