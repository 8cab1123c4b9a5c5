from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sbas.integrity.causes.causes import explain
from sbas.integrity.epoch_levels import k_of_epochs, usable_hpl_m, whole_table
from sbas.recording import (
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    mode_categories,
)
from tests.examples import quiet


@dataclass
class Pieces:
    """A source that streams several recordings."""

    parts: tuple[Recording, ...]

    @property
    def meta(self) -> RecordingMeta:
        return self.parts[0].meta

    @property
    def columns(self) -> tuple[str, ...]:
        return self.parts[0].columns

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        for part in self.parts:
            yield from part.batches(columns)


def test_batches_with_other_labels_stay_categories() -> None:
    whole = quiet(2000)
    level = np.full(2000, 10.0)
    level[1500:1510] = 60.0
    labels = pd.Categorical(np.where(level > 20, "cutting", "open"))
    whole = whole.replace(table=whole.table.assign(hpl_m=level, environment=labels))
    parts = tuple(
        whole.replace(
            table=part.assign(environment=part["environment"].cat.remove_unused_categories())
        )
        for part in (whole.table.iloc[:1000], whole.table.iloc[1000:])
    )
    joined = whole_table(Pieces(parts), ("hpl_m", "environment"))
    assert list(joined["environment"]) == list(labels)
    assert isinstance(joined["environment"].dtype, pd.CategoricalDtype)
    (event,) = explain(Pieces(parts)).events
    (same,) = explain(whole).events
    assert str(event) == str(same)
    assert event.cause == "place"


def table(codes: list[int], **columns: np.ndarray) -> pd.DataFrame:
    return quiet(len(codes)).table.assign(mode=mode_categories(np.array(codes)), **columns)


PA, NPA, ALONE = (MODES.index(m) for m in ("sbas_pa", "sbas_npa", "standalone"))


def test_k_is_the_modes_own_or_the_stated_one() -> None:
    """6.0 and 6.18: Filip, Bazant, Mocek 2010, 2.1; a level of RAIM has no such K."""
    epochs = table([PA, PA, NPA, ALONE, -1])
    k = k_of_epochs(epochs, ProtectionLevelMeta())
    np.testing.assert_array_equal(k, [6.0, 6.0, 6.18, np.nan, np.nan])
    stated = k_of_epochs(epochs, ProtectionLevelMeta(kind="do229", k_h=5.9))
    np.testing.assert_array_equal(stated, [5.9, 5.9, 6.18, np.nan, np.nan])
    assert np.isnan(k_of_epochs(epochs, ProtectionLevelMeta(kind="raim", k_h=5.9))).all()


def test_levels_outside_sbas_or_invalid_are_not_usable() -> None:
    flags = np.array([0, Flag.PL_OUTSIDE_SBAS, Flag.PL_DECLARED_INVALID, Flag.AFTER_GAP])
    epochs = table([NPA] * 4, flags=flags.astype(np.uint32))
    assert np.isfinite(usable_hpl_m(epochs)).tolist() == [True, False, False, True]
