"""Detection, dispatch, options, provenance; a new format joins these tests by its sample."""

from __future__ import annotations

import gc
import gzip
import hashlib
import importlib.metadata
import importlib.util
import inspect
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.input_check import check, repair
from sbas.logs import registry
from sbas.logs.arrow import parquet
from sbas.logs.delimited import delimited_text
from sbas.logs.format import Format, Match
from sbas.logs.nmea import nmea
from sbas.logs.programs import ginan_spp, glab_output, novatel_oem, pegasus_csv
from sbas.logs.rtklib import rtklib_pos
from sbas.logs.septentrio import septentrio_sbf
from sbas.logs.ublox import ublox_ubx, ubx_hex_csv
from sbas.recording import EpochSource, Recording
from tests.logs.nmea import nmea_samples
from tests.logs.programs import glab_samples, test_ginan_spp, test_novatel_oem, test_pegasus_csv
from tests.logs.ublox import ubx_samples
from tests.logs.ublox.test_ubx_hex_csv import line as hex_line

# A DOP block of pysbf2's tests (methods page, section 11): HPL 3.889 m, VPL 5.675 m.
DOP = bytes.fromhex("244057f9a10f2000e052c91c3f0925004f0028002c004200f5e77840fc96b540")
POS = (
    "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=#)\n"
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)"
    "   sdu(m)  sdne(m)  sdeu(m)  sdun(m) hpl (m) vpl (m)\n"
) + "".join(
    f"2016/07/12 12:02:{s:02d}.000   47.530299305   21.628699868   183.8681   3   4   4.0950"
    "   2.9371   8.5337  -2.6241   3.7817  -5.5198  27.30   45.5\n"
    for s in range(60)
)
CSV = "time,lat,lon,height,hpl\n" + "".join(
    f"2025-05-23 14:09:{s:02d},50.5,15.5,289.5,11.25\n" for s in range(60)
)
NMEA = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"
RINEX = b"     3.03           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n"
UBX = b"\xb5\x62\x01\x22\x00\x00\x23\x6a"
UBX_LOG = b"".join(ubx_samples.epoch(1000 * i) for i in range(60))
NEEDS_LIBRARY = {novatel_oem.FORMAT.name}
"""Formats that need a library of an extra, which may be absent."""


def readable(samples: dict[str, bytes]) -> dict[str, bytes]:
    """The samples of formats that can be read here."""
    absent = importlib.util.find_spec("novatel_edie") is None
    return {k: v for k, v in samples.items() if not (absent and k in NEEDS_LIBRARY)}


def parquet_bytes(folder: Path) -> bytes:
    index = pd.DatetimeIndex(np.arange(60).astype("M8[s]").astype("M8[ns]"), name="time")
    path = folder / "made.parquet"
    parquet.write([Recording(pd.DataFrame({"hpl_m": np.arange(60.0)}, index=index))], path)
    return path.read_bytes()


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return {
        septentrio_sbf.FORMAT.name: DOP * 60,
        rtklib_pos.FORMAT.name: POS.encode(),
        parquet.FORMAT.name: parquet_bytes(tmp_path_factory.mktemp("samples")),
        delimited_text.FORMAT.name: CSV.encode(),
        nmea.FORMAT.name: b"".join(nmea_samples.log(60)),
        ublox_ubx.FORMAT.name: UBX_LOG,
        ubx_hex_csv.FORMAT.name: "".join(
            hex_line(ubx_samples.epoch(1000 * i)) for i in range(60)
        ).encode(),
        glab_output.FORMAT.name: glab_samples.run(60).encode(),
        ginan_spp.FORMAT.name: test_ginan_spp.run(60).encode(),
        pegasus_csv.FORMAT.name: test_pegasus_csv.table_of(60).encode(),
        novatel_oem.FORMAT.name: test_novatel_oem.RUN,
    }


def put(folder: Path, data: bytes, name: str = "file.bin") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def read_or_refusal(path: Path, name: str | None) -> Recording | None:
    """A recording, or None where the file was refused with a cure; any other error escapes."""
    try:
        return registry.read(path, name)
    except InputError as error:
        if not error.cure:
            raise AssertionError(f"no cure: {error}") from error
        return None


def test_every_format_has_a_sample(samples: dict[str, bytes]) -> None:
    assert set(samples) == {f.name for f in registry.FORMATS}


@pytest.mark.parametrize("index", range(len(registry.FORMATS)))
def test_the_right_sniffer_is_ahead_by_ten(
    tmp_path: Path, samples: dict[str, bytes], index: int
) -> None:
    right = registry.FORMATS[index]
    data = samples[right.name]
    path = put(tmp_path, data)
    middle = data[max(len(data) - (1 << 16), 0) // 2 :][: 1 << 16]
    scores = {
        f.name: f.sniff(data[: 1 << 16], middle, data[-(1 << 12) :], path).score
        for f in registry.FORMATS
    }
    best = scores.pop(right.name)
    assert best >= max([20, *(score + 10 for score in scores.values())])
    found = registry.detect(path)
    assert (found.format, found.findings) == (right, ())


@pytest.mark.parametrize("name", [f.name for f in registry.FORMATS])
def test_a_cut_sample_never_raises_anything_but_input_error(
    tmp_path: Path, samples: dict[str, bytes], name: str
) -> None:
    data = samples[name]
    path = tmp_path / "cut"
    positions = range(0, min(len(data), 4096), 1 if len(data) < 200 else 37)
    for length in positions:
        path.write_bytes(data[:length])
        for chosen in (None, name):
            recording = read_or_refusal(path, chosen)
            assert recording is None or len(recording) <= 60


def test_reading_fills_in_the_provenance(tmp_path: Path, samples: dict[str, bytes]) -> None:
    for name in readable(samples):
        chosen = registry.format_named(name)
        path = put(tmp_path, samples[chosen.name], "sample" + chosen.extensions[0])
        for call in (registry.read, registry.scan):
            meta = call(path).meta
            source = meta.sources[-1]
            assert source.path == str(path)
            assert source.bytes == path.stat().st_size
            assert source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
            assert source.format == chosen.name
            assert source.reader_version == importlib.metadata.version("sbas")
            assert set(meta.versions) >= {"sbas", "numpy", "pandas", "pyarrow"}


def test_scan_and_read_say_the_same(tmp_path: Path, samples: dict[str, bytes]) -> None:
    for name, data in readable(samples).items():
        path = put(tmp_path, data)
        whole = registry.read(path, name)
        batches = list(registry.scan(path, name).batches(["hpl_m", "n_sv"]))
        found = pd.concat(batches)
        assert found.index.equals(whole.table.index)
        pd.testing.assert_series_equal(found["hpl_m"], whole.table["hpl_m"], check_freq=False)


def test_asked_columns_are_all_there(tmp_path: Path) -> None:
    recording = registry.read(put(tmp_path, CSV.encode()), columns=["hpl_m", "herl_m"])
    assert list(recording.table) == ["hpl_m", "herl_m"]


def test_wrong_extension_is_a_warning_and_content_wins(tmp_path: Path) -> None:
    path = put(tmp_path, POS.encode(), "roof.parquet")
    recording = registry.read(path)
    assert len(recording) == 60
    finding = recording.meta.findings[0]
    assert (finding.code, finding.severity) == ("E17", "warning")
    assert "roof.pos" in finding.cure
    assert registry.detect(put(tmp_path, POS.encode(), "roof.dat")).findings == ()


def test_unusable_paths(tmp_path: Path) -> None:
    put(tmp_path, CSV.encode(), "roof.csv")
    cases = {
        "ruof.csv": "no such file",
        "bad\0name": "no such file",
        "no/such/folder.csv": "no such file",
        "no*such.csv": "no (such )?file",
    }
    with pytest.raises(InputError, match="a folder"):
        registry.detect(tmp_path)
    for name, message in cases.items():
        for call in (registry.read, registry.scan, registry.detect):
            with pytest.raises(InputError, match=message) as caught:
                call(tmp_path / name)
            assert caught.value.cure
    with pytest.raises(InputError, match=r"roof\.csv"):
        registry.read(tmp_path / "ruof.csv")
    put(tmp_path, b"", "empty.pos")
    for chosen in (None, "csv"):
        with pytest.raises(InputError, match="E15"):
            registry.read(tmp_path / "empty.pos", chosen)


def test_unknown_content(tmp_path: Path) -> None:
    noise = np.random.default_rng(5).integers(0, 256, 100_000, dtype=np.uint8).tobytes()
    with pytest.raises(InputError, match="E16") as caught:
        registry.read(put(tmp_path, noise))
    error = caught.value
    assert noise[:16].hex(" ") in error.evidence
    assert "printable" in error.evidence
    assert error.evidence.count("(") >= 3
    assert all(f.name in error.cure for f in registry.FORMATS)


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"\x28\xb5\x2f\xfd" + b"x" * 50, "zstd"),
        (b"7z\xbc\xaf\x27\x1c" + b"x" * 50, "7-Zip"),
        (b"x" * 257 + b"ustar\x0000" + b"x" * 300, "tar"),
        (RINEX * 2, "RINEX"),
        (b"1.0                 COMPACT RINEX FORMAT".ljust(60) + b"CRINEX VERS\n", "RINEX"),
        (b"137 25 02 15 12 00 00 3 C60D" + b"DFFD" * 15 + b"\n", "EMS"),
    ],
)  # fmt: skip
def test_known_formats_that_are_not_read_are_named(tmp_path: Path, data: bytes, name: str) -> None:
    with pytest.raises(InputError, match="this is") as caught:
        registry.detect(put(tmp_path, data))
    assert name in caught.value.what
    assert caught.value.cure


def test_sbf_among_nmea_stays_sbf(tmp_path: Path) -> None:
    found = registry.detect(put(tmp_path, (DOP + NMEA * 3) * 20))
    assert found.format is septentrio_sbf.FORMAT


def test_unknown_format_name(tmp_path: Path) -> None:
    path = put(tmp_path, CSV.encode())
    with pytest.raises(InputError, match="unknown format 'parket'") as caught:
        registry.read(path, "parket")
    assert "'parquet'" in caught.value.evidence
    assert "csv" in caught.value.cure


def test_an_option_of_another_format(tmp_path: Path) -> None:
    path = put(tmp_path, POS.encode())
    with pytest.raises(InputError, match="no option mode_map") as caught:
        registry.read(path, mode_map={"3": "sbas"})
    assert "csv" in caught.value.evidence
    assert "parquet" in caught.value.evidence


def test_options_are_recorded(tmp_path: Path) -> None:
    path = put(tmp_path, CSV.replace("hpl", "mode").replace("11.25", "3").encode())
    options = registry.read(path, mode_map={"3": "sbas"}, time_scale="UTC").meta.options
    assert options["time_scale"] == "UTC"
    assert "3=sbas" in options["mode_map"]


def test_every_option_of_read_is_one_of_some_format() -> None:
    options = set(inspect.signature(registry.read).parameters) - {
        "paths", "format", "columns", "progress", "max_output",
    }  # fmt: skip
    of_formats = {name for f in registry.FORMATS for name in registry.options_of(f)}
    assert of_formats == options
    assert inspect.signature(registry.read).parameters.keys() == (
        inspect.signature(registry.scan).parameters.keys()
    )


class FakeEntry:
    def __init__(self, name: str, value: object) -> None:
        self.name, self.value, self._loaded = name, f"package:{name}", value

    def load(self) -> object:
        if isinstance(self._loaded, Exception):
            raise self._loaded
        return self._loaded


@pytest.fixture
def plug_ins(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    twin = Format(
        "twin", (".twin",), "reads what csv reads", delimited_text.sniff, delimited_text.read
    )
    shout = Format(
        "shout", (".shout",), "", lambda h, m, t, p: Match(70 * h.startswith(b"SHOUT"), ""),
        lambda path, *, columns=None, progress=None: Recording(
            pd.DataFrame(index=pd.DatetimeIndex([], dtype="M8[ns]", name="time"))
        ),
    )  # fmt: skip
    entries = [
        FakeEntry("twin", twin),
        FakeEntry("shout", shout),
        FakeEntry("broken", ImportError("no module named gnss")),
        FakeEntry("wrong", 7),
        FakeEntry("again", parquet.FORMAT),
    ]
    real = importlib.metadata.entry_points
    monkeypatch.setattr(
        importlib.metadata,
        "entry_points",
        lambda **k: entries if k.get("group") == "sbas.formats" else real(**k),
    )
    registry._plug_ins.cache_clear()
    yield
    registry._plug_ins.cache_clear()


@pytest.mark.usefixtures("plug_ins")
def test_formats_of_other_packages(tmp_path: Path) -> None:
    found = registry.detect(put(tmp_path, b"SHOUT\n"))
    assert found.format.name == "shout"
    assert [f.code for f in found.findings] == ["E16", "E16", "E16"]
    assert all(f.severity == "warning" for f in found.findings)
    assert "no module named gnss" in found.findings[0].evidence
    assert len(registry.read(tmp_path / "file.bin")) == 0
    with pytest.raises(InputError, match="no option geoid"):
        registry.read(tmp_path / "file.bin", geoid=44.5)
    with pytest.raises(InputError, match="could be csv or twin"):
        registry.detect(put(tmp_path, CSV.encode()))
    assert registry.detect(put(tmp_path, POS.encode())).format is rtklib_pos.FORMAT


@given(
    st.binary(max_size=2000), st.sampled_from([b"", DOP, b"PAR1", POS.encode()[:300], NMEA, UBX])
)
def test_sniffers_never_raise(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, start: bytes
) -> None:
    path = tmp_path_factory.mktemp("sniff") / "x.csv"
    path.write_bytes(start + data or b"x")
    for chosen in registry.FORMATS:
        match = chosen.sniff(start + data, data, data[-100:], path)
        assert 0 <= match.score <= 100
        assert match.reason
    read_or_refusal(path, None)


def test_pipes_and_devices_are_no_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InputError, match="no regular file"):
            registry.read(path)
    with pytest.raises(InputError, match="folder holds no file"):
        registry.read(tmp_path)


def test_a_refusal_tells_what_each_format_found(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not recognised") as caught:
        registry.detect(put(tmp_path, b"word\n" * 9))
    for name in ("septentrio_sbf", "rtklib_pos", "parquet", "csv"):
        assert f"{name} " in caught.value.evidence
    with pytest.raises(InputError, match="columns") as caught:
        registry.read(put(tmp_path, b"1," * 32_000 + b"\n"))
    assert caught.value.code == "E18"


# Compressed files


@pytest.mark.parametrize("call", [registry.read, registry.scan])
def test_compressed_files_read_as_what_is_in_them(
    tmp_path: Path, samples: dict[str, bytes], call: Callable[..., EpochSource]
) -> None:
    for chosen in map(registry.format_named, readable(samples)):
        plain = put(tmp_path, samples[chosen.name], "plain" + chosen.extensions[0])
        packed = put(tmp_path, gzip.compress(samples[chosen.name]), plain.name + ".gz")
        expected, found = call(plain), call(packed)
        assert found.columns == expected.columns
        pd.testing.assert_frame_equal(
            pd.concat(found.batches(found.columns)), pd.concat(expected.batches(expected.columns))
        )
        assert found.meta.findings == expected.meta.findings
        source = found.meta.sources[-1]
        assert (source.path, source.bytes) == (str(packed), packed.stat().st_size)
        assert source.sha256 == hashlib.sha256(packed.read_bytes()).hexdigest()
        assert source.format == chosen.name


def test_a_temporary_file_lasts_as_long_as_its_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    packed = put(tmp_path, gzip.compress(parquet_bytes(tmp_path)), "roof.parquet.gz")
    batches = registry.scan(packed).batches(["hpl_m"])  # nobody holds the source itself
    gc.collect()
    assert sum(len(batch) for batch in batches) == 60
    del batches
    registry.read(packed)
    gc.collect()
    assert not list(tmp_path.glob("sbas-*"))


def test_errors_and_findings_name_the_file_that_was_given(tmp_path: Path) -> None:
    packed = put(tmp_path, gzip.compress(b"time,lat,lon\n"), "roof.csv.gz")
    with pytest.raises(InputError, match="no data") as caught:
        registry.read(packed)
    assert caught.value.where == str(packed)
    odd = put(tmp_path, gzip.compress(POS.encode()), "roof.parquet.gz")
    (finding,) = registry.read(odd).meta.findings
    assert (finding.code, finding.where) == ("E17", str(odd))
    assert "roof.pos" in finding.cure


def test_max_output_is_an_option_of_every_format(tmp_path: Path) -> None:
    packed = put(tmp_path, gzip.compress(POS.encode()), "roof.pos.gz")
    with pytest.raises(InputError, match="E21"):
        registry.read(packed, max_output=1000)
    assert registry.read(packed, max_output=100_000).meta.options["max_output"] == "100000"
    assert registry.detect(packed).format is rtklib_pos.FORMAT


# Several files


def hours(folder: Path, count: int = 4) -> list[Path]:
    return [
        put(folder, CSV.replace(" 14:", f" {10 + k}:").encode(), f"hour{count - k}.csv")
        for k in range(count)
    ]


@pytest.mark.parametrize("call", [registry.read, registry.scan])
@pytest.mark.parametrize("how", ["list", "pattern", "folder", "deep"])
def test_several_files_are_one_recording_in_the_order_of_their_times(
    tmp_path: Path, how: str, call: Callable[..., EpochSource]
) -> None:
    files = hours(tmp_path)
    paths: object = {
        "list": files[::-1], "pattern": str(tmp_path / "hour*.csv"), "folder": tmp_path,
        "deep": [tmp_path / "**" / "*.csv"],
    }[how]  # fmt: skip
    source = call(paths)
    table = pd.concat(source.batches(["hpl_m", "lat_deg"]))
    assert len(table) == 240
    assert table.index.is_monotonic_increasing
    assert [s.path for s in source.meta.sources] == [str(f) for f in files]
    assert source.meta.findings == ()
    assert check(source).survey.epochs == 240


def test_a_folder_counts_what_it_leaves_out(tmp_path: Path) -> None:
    hours(tmp_path, 2)
    put(tmp_path, b"", "empty.sbf")
    put(tmp_path, b"Notes, made on the roof\nat noon, cloudy\n" * 3, "README.txt")
    (tmp_path / ".hidden").mkdir()
    put(tmp_path / ".hidden", CSV.encode(), "old.csv")
    for call in (registry.read, registry.scan):
        (finding,) = call(tmp_path).meta.findings
        assert (finding.code, finding.severity) == ("E16", "warning")
        assert finding.message.startswith("2 of 4 files")
        assert "README.txt" in finding.evidence
        assert "empty.sbf: the file is empty" in finding.evidence
    put(tmp_path / ".hidden", b"words\n", "old.csv")
    with pytest.raises(InputError, match="no file of a known format"):
        registry.read(tmp_path / ".hidden")
    with pytest.raises(InputError, match="column"):  # named, it is no bystander
        registry.read([tmp_path / "hour1.csv", tmp_path / "README.txt"])


def test_a_folder_of_one_format_by_name(tmp_path: Path) -> None:
    hours(tmp_path, 2)
    put(tmp_path, DOP * 60, "roof.sbf")
    recording = registry.read(tmp_path, "csv")
    assert len(recording) == 120
    assert [f.code for f in recording.meta.findings] == ["E16"]


def test_the_same_bytes_count_once(tmp_path: Path) -> None:
    files = hours(tmp_path, 2)
    copy = put(tmp_path, files[0].read_bytes(), "copy.csv")
    for call in (registry.read, registry.scan):
        source = call([*files, copy, files[1]])
        assert len(pd.concat(source.batches(()))) == 120
        (finding,) = source.meta.findings
        assert (finding.code, finding.severity) == ("E26", "warning")
        assert finding.message.startswith("2 of 4")
        assert str(copy) in finding.evidence


def test_overlapping_files_are_never_mixed_silently(tmp_path: Path) -> None:
    even = "".join(CSV.splitlines(keepends=True)[:1] + CSV.splitlines(keepends=True)[1::2])
    odd = "".join(CSV.splitlines(keepends=True)[:1] + CSV.splitlines(keepends=True)[2::2])
    files = [put(tmp_path, even.encode(), "even.csv"), put(tmp_path, odd.encode(), "odd.csv")]
    found = {f.code: f.severity for f in check(registry.scan(files)).findings}
    assert found["E14"] == found["E06"] == "error"
    joined = repair(registry.read(files), sort=True)
    assert joined.table.index.is_monotonic_increasing
    assert ("E06", "error") in [(f.code, f.severity) for f in joined.meta.findings]


def test_long_sets_are_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = hours(tmp_path)
    whole = registry.scan(files)
    monkeypatch.setattr(registry, "WHOLE_BYTES", 100)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    aside = registry.scan(files)
    assert len(list(tmp_path.glob("sbas-*"))) == 4
    assert aside.columns == whole.columns
    pd.testing.assert_frame_equal(
        pd.concat(aside.batches(aside.columns)), pd.concat(whole.batches(whole.columns))
    )
    assert aside.meta.findings == whole.meta.findings
    del aside
    gc.collect()
    assert not list(tmp_path.glob("sbas-*"))


def test_progress_over_several_files_goes_on_to_the_end(tmp_path: Path) -> None:
    files = hours(tmp_path)
    total = sum(f.stat().st_size for f in files)
    seen: list[tuple[int, int]] = []
    registry.read(files, progress=lambda done, of: seen.append((done, of)))
    assert seen == sorted(seen)
    assert seen[-1] == (total, total)
