"""The epoch table's contract."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.findings import CODES, Finding
from sbas.recording import (
    COLUMNS,
    MODES,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    Source,
    major_semi_axis_m,
    missing_values,
    mode_categories,
)


def times(n: int) -> pd.DatetimeIndex:
    return pd.date_range("2020-01-01", periods=n, freq="1s", unit="ns", name="time")


def test_missing_columns_come_filled_with_their_missing_value() -> None:
    recording = Recording(pd.DataFrame({"hpl_m": [1.0, 2.0]}, index=times(2)))
    (batch,) = recording.batches(tuple(COLUMNS))
    for name, column in COLUMNS.items():
        if name == "hpl_m" or column.dtype == "category":
            continue
        np.testing.assert_array_equal(batch[name], np.full(2, column.missing))
    assert batch["mode"].isna().all()
    assert list(batch["mode"].cat.categories) == list(MODES)


def test_batches_are_the_table_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 3)
    recording = Recording(pd.DataFrame({"hpl_m": np.arange(8.0)}, index=times(8)))
    parts = list(recording.batches(("hpl_m",)))
    assert [len(p) for p in parts] == [3, 3, 2]
    pd.testing.assert_frame_equal(pd.concat(parts), recording.table)
    empty = Recording(recording.table.iloc[:0])
    assert [len(p) for p in empty.batches(("hpl_m",))] == [0]


@pytest.mark.parametrize(
    "table",
    [
        pd.DataFrame({"hpl_m": [1.0]}),
        pd.DataFrame({"hpl_m": [1.0]}, index=times(1).rename("t")),
        pd.DataFrame({"hpl_m": [1.0]}, index=times(1).tz_localize("UTC")),
        pd.DataFrame({"hpl_m": [1.0]}, index=pd.DatetimeIndex([pd.NaT], name="time").as_unit("ns")),
        pd.DataFrame({"hpl": [1.0]}, index=times(1)),
        pd.DataFrame({"hpl_m": [1]}, index=times(1)),
        pd.DataFrame({"mode": ["sbas"]}, index=times(1)),
        pd.DataFrame({"mode": pd.Categorical(["sbas"])}, index=times(1)),
        pd.DataFrame(np.ones((1, 2)), columns=["hpl_m", "hpl_m"], index=times(1)),
    ],
)
def test_other_tables_are_refused(table: pd.DataFrame) -> None:
    with pytest.raises(InputError):
        Recording(table)


def test_a_side_table_needs_times() -> None:
    with pytest.raises(InputError, match="time"):
        Recording(
            pd.DataFrame(index=times(1)), side_tables={"satellites": pd.DataFrame({"a": [1]})}
        )


def test_the_repr_names_what_is_there() -> None:
    table = pd.DataFrame(
        {
            "hpl_m": [10.0, np.nan], "n_sv": np.array([7, -1], "i2"), "mode": mode_categories(
                np.array([3, -1])
            ), "x_note": [1, 2],
        },
        index=times(2),
    )  # fmt: skip
    meta = RecordingMeta(sources=(Source("roof.sbf", format="sbf"),))
    text = repr(Recording(table, meta).with_findings(Finding("E04", "warning", "one gap")))
    assert "Recording of 2 epochs from roof.sbf (sbf)" in text
    assert "hpl_m" in text
    assert "(1 epochs)" in text
    assert "E04 warning: one gap" in text


PLAIN = st.text(st.characters(codec="utf-8"), max_size=20)


@given(
    st.builds(
        RecordingMeta,
        sources=st.tuples(st.builds(Source, path=PLAIN, sha256=PLAIN, bytes=st.integers(0))),
        receiver=PLAIN,
        pl=st.builds(
            ProtectionLevelMeta, kind=st.sampled_from(["do229", "tmir"]), k_h=st.floats(1, 10)
        ),
        findings=st.tuples(
            st.builds(
                Finding, code=st.sampled_from(list(CODES)), severity=st.just("info"), message=PLAIN
            )
        ),
        options=st.dictionaries(PLAIN, PLAIN),
    )
)
def test_metadata_pass_through_json(meta: RecordingMeta) -> None:
    assert RecordingMeta.from_json(meta.to_json()) == meta


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", "[" * 200_000, "null", '{"schema": "x"}', '{"schema": 99}', "{" * 5000,
     json.dumps({"schema": 1, "sources": [{"paht": "x"}], "findings": [], "pl": {}})],
)  # fmt: skip
def test_foreign_metadata_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="metadata"):
        RecordingMeta.from_json(text)


@given(st.floats(0.01, 50), st.floats(0.01, 50), st.floats(-1, 1))
def test_the_major_semi_axis_is_the_largest_eigenvalue(
    sigma_e: float, sigma_n: float, rho: float
) -> None:
    cov = rho * sigma_e * sigma_n
    matrix = np.array([[sigma_e**2, cov], [cov, sigma_n**2]])
    expected = np.sqrt(np.linalg.eigvalsh(matrix)[-1])
    one = np.array([1.0])
    axis = major_semi_axis_m(sigma_e * one, sigma_n * one, cov * one)[0]
    assert axis == pytest.approx(expected, rel=1e-12)
    assert major_semi_axis_m(sigma_e * one, sigma_n * one, np.nan * one)[0] >= axis * (1 - 1e-12)


def test_unknown_columns_cannot_be_asked() -> None:
    with pytest.raises(InputError, match="unknown column"):
        missing_values("hpl", 1)
