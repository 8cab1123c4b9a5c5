"""UBX messages as hex in CSV: the rail samples, and damaged lines."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.findings import Finding
from sbas.logs import text_input
from sbas.logs.delimited import delimited_text
from sbas.logs.ublox import ublox_ubx
from sbas.logs.ublox.ubx_hex_csv import FORMAT, read, scan, sniff
from sbas.recording import Recording
from tests.logs.ublox.ubx_samples import ITOW, cov, dop, epoch, pvt

IMU = "00:00:43.463562,I,070197fe5cff1bfdd4fea540\n"
SAMPLES = ("20221019_1217_R90121_Modena_SN1", "20221020_1122_R90116_Formigine_SN2")


def line(*messages: bytes) -> str:
    return f"00:00:43.463562,U,{b''.join(messages).hex()}\n"


@pytest.fixture
def load(tmp_path: Path):  # type: ignore[no-untyped-def]
    def load_text(*lines: str) -> Recording:
        path = tmp_path / "run.csv"
        path.write_text("".join(lines), newline="")
        return read(path)

    return load_text


def finding(recording: Recording, code: str) -> Finding:
    (found,) = (f for f in recording.meta.findings if f.code == code)
    return found


def samples_of(path: Path) -> tuple[bytes, bytes, bytes, Path]:
    data = path.read_bytes()
    middle = max((len(data) - 65536) // 2, 0)
    return data[:65536], data[middle : middle + 65536], data[-4096:], path


class TestRailSamples:
    """ETH-PBL/Railway-Precise-Localization; the counts are those of PROVENANCE.md."""

    @pytest.fixture
    def paths(self, reference_data: Path) -> list[Path]:
        return [reference_data / f"data/rail_modena_2022/{name}_sample.csv" for name in SAMPLES]

    def test_modena(self, paths: list[Path]) -> None:
        r = read(paths[0])
        assert len(r) == 2
        assert finding(r, "E24").evidence == "1,998 lines"
        # The message says 2022-10-19 09:53:31 UTC; GPS time is 18 s ahead.
        assert r.time[0] == np.datetime64("2022-10-19T09:53:49")
        assert (np.diff(r.time) == np.timedelta64(1, "s")).all()
        assert r.table["mode"].tolist() == ["standalone"] * 2

    def test_formigine(self, paths: list[Path]) -> None:
        r = read(paths[1])
        assert len(r) == 1
        assert finding(r, "E24").evidence == "1,994 lines"
        row = r.table.iloc[0]
        # The receiver's own accuracies follow from its covariance, to their millimetre.
        assert math.hypot(row.sigma_n_m, row.sigma_e_m) == pytest.approx(
            row.x_h_accuracy_m, abs=6e-4
        )
        assert row.sigma_u_m == pytest.approx(row.x_v_accuracy_m, abs=6e-4)

    def test_sniffed_before_delimited_text(self, paths: list[Path]) -> None:
        for path in paths:
            pieces = samples_of(path)
            assert sniff(*pieces).score == 95
            assert delimited_text.FORMAT.sniff(*pieces).score < 80
            assert ublox_ubx.sniff(*pieces).score == 0


def test_same_as_the_log_that_it_holds(load, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    epochs = [epoch(ITOW + 1000 * i, lat=i) for i in range(1, 40)]
    r = load(*(IMU + line(e) for e in epochs))
    path = tmp_path / "log.ubx"
    path.write_bytes(b"".join(epochs))
    expected = ublox_ubx.read(path)
    pd.testing.assert_frame_equal(r.table, expected.table)
    assert r.meta.findings[:-1] == expected.meta.findings


def test_sniff_without_messages_in_the_samples() -> None:
    path = Path("run.csv")
    assert sniff(IMU.encode() * 99, b"", b"", path).score == 70
    assert sniff((IMU + line(pvt(ITOW))).encode(), b"", b"", path).score == 95
    assert sniff(b"time,lat,lon\n" * 99, b"", b"", path).score == 0
    assert sniff(b"", b"", b"", path).score == 0
    assert (FORMAT.sniff, FORMAT.read, FORMAT.scan) == (sniff, read, scan)


@pytest.mark.parametrize(
    "broken",
    [
        line(dop(ITOW + 1000)[:-3]),
        line(dop(ITOW + 1000)).replace("b562", "b563"),
        line(dop(ITOW + 1000))[:-2] + "\n",
        line(dop(ITOW + 1000)).replace("0104", "01x4"),
        "00:00:43.463562,U,\n",
        line(dop(ITOW + 1000), b"junk"),
    ],
    ids=["cut", "sync", "half a byte", "no hex", "empty", "junk behind"],
)
def test_broken_lines_are_counted(load, broken: str) -> None:  # type: ignore[no-untyped-def]
    good = [line(epoch(ITOW + 2000 * i)) for i in range(3)]
    r = load(*good, broken, IMU)
    cut = finding_with(r, "no whole UBX message")
    assert cut.severity == "error"
    assert cut.evidence.startswith("1 of 4 lines, first 00:00:43.463562,U,")
    assert len(r) == 3 + broken.endswith("6a756e6b\n")  # the whole message before "junk" counts


def test_a_message_never_runs_over_lines(load) -> None:  # type: ignore[no-untyped-def]
    whole = pvt(ITOW)
    r = load(line(whole[:60]), line(whole[60:]), line(dop(ITOW)), line(pvt(ITOW + 1000)))
    assert r.table["lat_deg"].notna().tolist() == [True]
    assert "2 of 4 lines" in finding_with(r, "no whole").evidence


def finding_with(recording: Recording, words: str) -> Finding:
    return next(f for f in recording.meta.findings if words in f.message)


def test_other_lines_and_windows_line_ends(load) -> None:  # type: ignore[no-untyped-def]
    lines = ["start of run\n", "\n", line(pvt(ITOW)).replace("\n", "\r\n"), IMU, "\r\n"]
    r = load(*lines)
    assert len(r) == 1
    assert finding(r, "E10").evidence == "1 lines"


def test_last_line_without_line_end(load) -> None:  # type: ignore[no-untyped-def]
    whole = line(pvt(ITOW)) + line(pvt(ITOW + 1000)).rstrip()
    assert len(load(whole)) == 2
    assert "1 of 2 lines" in finding(load(whole[:-1]), "E10").evidence
    assert len(load(whole[:-20])) == 1


def test_blocks_change_nothing(
    load,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,  # type: ignore[no-untyped-def]
) -> None:
    lines = [line(dop(ITOW + i), pvt(ITOW + i, lat=i)) + line(cov(ITOW + i)) + IMU * 3
             for i in range(1, 60)]  # fmt: skip
    whole = load(*lines, line(pvt(ITOW))[:50] + "\n")
    monkeypatch.setattr(text_input, "BLOCK_BYTES", 700)
    again = read(tmp_path / "run.csv")
    pd.testing.assert_frame_equal(again.table, whole.table)
    assert again.meta == whole.meta
    source = scan(tmp_path / "run.csv")
    assert source.meta == whole.meta
    batches = list(source.batches(list(whole.columns)))
    assert len(batches) > 10
    pd.testing.assert_frame_equal(pd.concat(batches), whole.table)


@settings(max_examples=60)
@given(st.lists(st.one_of(
    st.just(IMU), st.just(line(epoch(ITOW))), st.text("0123456789abcdef,UI:.\n", max_size=40),
    st.binary(max_size=30).map(line),
), max_size=8))  # fmt: skip
def test_any_lines(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    path = tmp_path_factory.mktemp("any") / "any.csv"
    path.write_text("".join(lines), newline="")
    assert len(read(path)) <= "".join(lines).count(line(epoch(ITOW))[18:-1])
    sniff(*samples_of(path))
