"""Several files as one recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sbas.input_check import accept, check
from sbas.logs.archive import join_sources, joined_recording
from sbas.recording import Recording
from tests.examples import quiet


def halves(n: int = 200) -> tuple[Recording, Recording]:
    whole = quiet(n)
    return (
        whole.replace(table=whole.table.iloc[: n // 2]),
        whole.replace(table=whole.table.iloc[n // 2 :]),
    )


def test_pieces_in_any_order_are_the_whole() -> None:
    early, late = halves()
    table = pd.concat(join_sources([late, early]).batches(("hpl_m", "lat_deg")))
    pd.testing.assert_frame_equal(table, quiet(200).table[["hpl_m", "lat_deg"]])
    assert check(join_sources([late, early])).findings == ()


def test_another_receiver_is_an_error_until_accepted() -> None:
    early, late = halves()
    other = late.replace(meta=replace(late.meta, receiver="B", frame="NAD27"))
    findings = check(join_sources([early, other])).findings
    assert [(f.code, f.severity) for f in findings] == [("E06", "error"), ("E06", "error")]
    assert {f.severity for f in accept(findings, ["E06"])} == {"warning"}


def test_labels_and_side_tables_are_joined() -> None:
    early, late = halves()
    parts = []
    for part, label in ((early, "open"), (late, "cutting")):
        labels = pd.Categorical([label] * len(part))
        side = pd.DataFrame({"time": part.time[:3], "prn": np.int16(120)})
        parts.append(
            part.replace(
                table=part.table.assign(environment=labels), side_tables={"sbas_frames": side}
            )
        )
    joined = joined_recording(parts[::-1])
    assert joined.table["environment"].value_counts().to_dict() == {"open": 100, "cutting": 100}
    assert len(joined.side_tables["sbas_frames"]) == 6
    assert joined.table.index.is_monotonic_increasing


@pytest.mark.parametrize("n", [1, 2])
def test_empty_pieces_do_no_harm(n: int) -> None:
    early, _ = halves()
    none = early.replace(table=early.table.iloc[:0])
    assert check(join_sources([none] * n + [early])).epochs == 100
