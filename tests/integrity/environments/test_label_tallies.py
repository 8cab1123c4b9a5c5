"""Counts by label in any cut of the record, joined as if it had never been cut."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from sbas.integrity.environments.label_tallies import MOST_LABELS
from sbas.integrity.events import Runs
from sbas.integrity.tallies import RecordTally
from sbas.recording import Recording
from sbas.recording_survey import survey
from tests.examples import POINT, recording


def labelled(n: int = 600) -> Recording:
    rng = np.random.default_rng(8)
    error = np.where(rng.random(n) < 0.05, 60.0, 0.5)
    hpl = np.where(rng.random(n) < 0.05, 70.0, 11.0)
    labels = rng.choice(["a", "b", "", None], n // 6, p=[0.5, 0.3, 0.1, 0.1]).repeat(6)
    return recording(error, np.zeros(n), hpl, environment=pd.Categorical(labels))


def tallied(r: Recording, *cuts: int) -> RecordTally:
    """The tally of a recording, its pieces counted each on its own and then merged."""
    facts = survey(r)
    pieces = []
    for first, stop in zip((0, *cuts), (*cuts, len(r)), strict=True):
        piece = RecordTally(facts, POINT, (50.0,), labelled=True)
        table = r.table.iloc[first:stop]
        # Each piece knows its own labels, in its own order.
        own = table["environment"].cat.remove_unused_categories()
        table = table.assign(
            environment=own.cat.reorder_categories(own.cat.categories[::-1]),
            vpl_m=np.nan, flags=np.uint32(0),
        )  # fmt: skip
        piece.update(table)
        pieces.append(piece)
    whole = pieces[0]
    for piece in pieces[1:]:
        whole.merge(piece)
    return whole


def counts(tally: RecordTally) -> dict[str, Any]:
    assert tally.labels is not None
    found = {}
    for name, (part, where) in tally.labels.parts(tally.interval_ns).items():
        levels = part.levels.result()
        found[name] = (
            part.epochs, part.covered_ns, part.judged_ns, part.mi_epochs, part.begin_ns,
            part.end_ns, part.down_ns[50.0], part.regions[50.0].tolist(), part.modes,
            part.hpe.quantile(0.7), part.hpl.max, part.levels_below().tolist(),
            part.stanford.sum(), levels.counts.sum(), levels.fresh.sum(),
            [a.tolist() for a in vars(where).values()],
        )  # fmt: skip
    return found


@pytest.mark.parametrize("cuts", [(300,), (299, 303), (1, 2, 3), (6, 12, 18, 594)])
def test_pieces_merge_to_the_whole(cuts: tuple[int, ...]) -> None:
    r = labelled()
    whole, merged = tallied(r), tallied(r, *cuts)
    assert counts(merged) == counts(whole)
    assert list(counts(merged)) == list(counts(whole))
    for kind, al in (("hmi", 50.0), ("exceeds_al", 25.0), ("mi", 50.0)):
        a, b = (t.bad_runs(kind, al) for t in (whole, merged))  # type: ignore[arg-type]
        assert _plain(a) == _plain(b)


def _plain(runs: Runs) -> dict[str, Any]:
    return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(runs).items()}


def test_an_empty_label_is_none_and_comes_last() -> None:
    r = labelled()
    text = r.table["environment"].astype(object)
    by_name = counts(tallied(r))
    assert list(by_name)[-1] == "unlabelled"
    assert by_name["unlabelled"][0] == int((text.isna() | (text == "")).sum())
    assert by_name["a"][0] == int((text == "a").sum())


def test_too_many_labels_in_one_piece_or_together() -> None:
    n = 10 * (MOST_LABELS + 1)
    names = pd.Categorical([f"km {i // 10}" for i in range(n)])
    r = recording(np.zeros(n), np.zeros(n), np.full(n, 11.0), environment=names)
    for cuts in ((), (n // 2,), (n - 10,)):
        tally = tallied(r, *cuts)
        assert tally.labels is not None
        assert tally.labels.too_many
        assert tally.labels.labelled
        assert tally.labels.parts(tally.interval_ns) == {}
        assert tally.all.epochs == n
    fits = r.replace(table=r.table.iloc[: n - 10])
    assert len(counts(tallied(fits))) == MOST_LABELS
