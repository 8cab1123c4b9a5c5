"""The corpus: every kind of damage to every good log that it suits, each from a seed of its own."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.corruption.byte_damages import BYTE_DAMAGES
from tests.corruption.damage import Damaged, Kind
from tests.corruption.decimal_damages import DECIMAL_DAMAGES
from tests.corruption.foreign_damages import FOREIGN_DAMAGES
from tests.corruption.good_logs import GoodLog, good_log, good_logs
from tests.corruption.order_damages import ORDER_DAMAGES
from tests.corruption.packing_damages import PACKING_DAMAGES
from tests.corruption.value_damages import VALUE_DAMAGES

KINDS: tuple[Kind, ...] = (
    *BYTE_DAMAGES,
    *DECIMAL_DAMAGES,
    *ORDER_DAMAGES,
    *VALUE_DAMAGES,
    *FOREIGN_DAMAGES,
    *PACKING_DAMAGES,
)


@dataclass(frozen=True)
class Case:
    """A damaged file by its recipe; `made` is the file."""

    kind: Kind
    form: str
    moving: bool
    number: int

    @property
    def name(self) -> str:
        how = "moving" if self.moving else "standing"
        return f"{self.kind.name} / {self.form}, {how} / {self.number}"

    @property
    def log(self) -> GoodLog:
        return good_log(self.form, self.moving)

    def made(self) -> Damaged:
        return self.kind.make(self.log, np.random.default_rng(zlib.crc32(self.name.encode())))


def cases() -> Iterator[Case]:
    """All of them, kind by kind."""
    for kind in KINDS:
        for log in good_logs():
            if kind.suits(log):
                for number in range(kind.times):
                    yield Case(kind, log.form.name, log.moving, number)


def sample() -> list[Case]:
    """One case of each kind, of another form from kind to kind."""
    chosen = []
    for i, kind in enumerate(KINDS):
        of_kind = [case for case in cases() if case.kind is kind]
        chosen.append(of_kind[(5 * i) % len(of_kind)])
    return chosen
