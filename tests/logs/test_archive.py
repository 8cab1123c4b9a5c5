"""Several files as one recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.input_check import accept, check
from sbas.logs.archive import join_sources, joined_recording
from sbas.recording import ProtectionLevelMeta, Recording
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


def test_levels_of_other_factors_are_told_in_words() -> None:
    early, late = halves()
    metas = [
        replace(early.meta, pl=ProtectionLevelMeta("do229", k_h=k_h, k_v=5.33))
        for k_h in (6.0, 6.18)
    ]
    sources = [part.replace(meta=meta) for part, meta in zip((early, late), metas, strict=True)]
    (found,) = join_sources(sources).meta.findings
    assert found.message.startswith("the files differ in their protection levels:")
    assert found.evidence == "kind do229, K_H 6 and K_V 5.33; kind do229, K_H 6.18 and K_V 5.33"


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


def meta_of(part: Recording, **pl: object) -> Recording:
    return part.replace(meta=replace(part.meta, pl=ProtectionLevelMeta(**pl)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("first", "second", "code"),
    [
        ({"kind": "do229"}, {"kind": "tmir", "risk": 0.05, "risk_per": "epoch"}, "E23"),
        ({"kind": "unknown"}, {"kind": "tmir", "risk": 0.05, "risk_per": "epoch"}, "E23"),
        ({"kind": "do229"}, {"kind": "receiver"}, "E23"),
        ({"kind": "tmir", "risk": 1e-4}, {"kind": "tmir", "risk": 1e-7}, "E23"),
        ({"kind": "tmir", "risk": 1e-7, "risk_per": "epoch"},
         {"kind": "tmir", "risk": 1e-7, "risk_per": "hour"}, "E23"),
        ({"kind": "do229"}, {"kind": "unknown"}, "E06"),
        ({"kind": "do229", "k_h": 6.0}, {"kind": "do229", "k_h": 6.18}, "E06"),
    ],
)  # fmt: skip
def test_levels_of_two_kinds_or_risks_are_never_pooled(
    first: dict[str, object], second: dict[str, object], code: str
) -> None:
    early, late = halves()
    pair = [meta_of(early, **first), meta_of(late, **second)]
    for source in (join_sources(pair), join_sources(pair[::-1]), joined_recording(pair)):
        findings = source.meta.findings
        assert [(f.code, f.severity) for f in findings] == [(code, "error")]
        if code == "E23":
            with pytest.raises(InputError, match="cannot be accepted"):
                accept(findings, [code])


def test_a_file_without_epochs_says_nothing_of_levels() -> None:
    early, late = halves()
    empty = meta_of(early.replace(table=early.table.iloc[:0]), kind="unknown")
    joined = join_sources([empty, meta_of(early, kind="do229"), meta_of(late, kind="do229")])
    assert joined.meta.findings == ()


@pytest.mark.parametrize(
    ("rows", "overlaps"),
    [
        ((slice(0, 100), slice(100, 200)), 0),
        ((slice(0, 101), slice(100, 200)), 0),  # one epoch in both: E05 tells
        ((slice(0, 102), slice(100, 200)), 1),
        ((slice(0, 200, 2), slice(1, 200, 2)), 1),
        ((slice(0, 200), slice(50, 60), slice(70, 80)), 2),
    ],
)
def test_overlaps_are_told(rows: tuple[slice, ...], overlaps: int) -> None:
    whole = quiet(200)
    parts = [whole.replace(table=whole.table.iloc[part]) for part in rows]
    for source in (join_sources(parts), joined_recording(parts)):
        found = [f for f in source.meta.findings if f.code == "E06"]
        assert len(found) == min(overlaps, 1)
        assert all(f.message.startswith(f"{overlaps} of {len(rows)} files") for f in found)
    codes = {f.code for f in check(join_sources(parts)).findings}
    assert bool(codes & {"E05", "E14"}) == (rows[0].stop != 100)


def test_columns_that_a_file_lacks_are_missing_in_its_rows() -> None:
    early, late = halves()
    early = early.replace(table=early.table.drop(columns=["n_sv", "mode"]))
    labels = pd.Categorical(["open"] * len(late))
    late = late.replace(table=late.table.assign(environment=labels, x_note=1.5))
    table = joined_recording([early, late]).table
    assert table["n_sv"].dtype == np.int16
    assert (table["n_sv"].iloc[:100] == -1).all()
    assert table["mode"].iloc[:100].isna().all()
    assert table["environment"].isna().tolist() == [True] * 100 + [False] * 100
    assert table["x_note"].isna().tolist() == [True] * 100 + [False] * 100


def test_what_was_done_to_one_file_is_not_said_of_all() -> None:
    early, late = halves()
    done = {"raim": "sigma 3", "truth": "roof"}
    first = early.replace(meta=replace(early.meta, options=done))
    for other, shared in (
        ({"raim": "sigma 9", "truth": "roof"}, {"truth": "roof"}),
        ({"truth": "roof"}, {"truth": "roof"}),
        (done, done),
        ({}, {}),
    ):
        second = late.replace(meta=replace(late.meta, options=other))
        assert join_sources([first, second]).meta.options == shared
        assert join_sources([second, first]).meta.options == shared
