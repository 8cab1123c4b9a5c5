"""The own reader against georinex, field by field."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.rinex.hatanaka_text import restored
from sbas.rinex.observation_file import read_observations
from sbas.rinex.observations import Observations
from tests.rinex.rinex_samples import CODES, epoch_2, epoch_3, header_2, header_3, ranges
from tests.rinex.test_version_2_text import TYPES, epoch


def assert_same(path: Path, **options: object) -> Observations:
    """Both engines see the same times, satellites, values and marks; the library has loss of
    lock of L1 and L2 only, and of version 2 no marks of S."""
    own = read_observations(path, **options)  # type: ignore[arg-type]
    other = read_observations(path, engine="georinex", **options)  # type: ignore[arg-type]
    assert set(own.systems) == set(other.systems)
    for letter, system in own.systems.items():
        peer = other.systems[letter]
        assert peer.satellites == system.satellites
        assert set(peer.values) == set(system.values)
        row = np.searchsorted(system.time, peer.time)
        assert np.array_equal(system.time[row], peer.time)
        # Epochs without a satellite of the system are not among the library's.
        unseen = np.setdiff1d(np.arange(system.time.size), row)
        for code, values in system.values.items():
            np.testing.assert_array_equal(values[row], peer.values[code])
            if own.header.version >= 3 or code[0] != "S":
                np.testing.assert_array_equal(system.strength[code][row], peer.strength[code])
            if code.startswith(("L1", "L2")):
                lock = system.loss_of_lock[code][row]
                np.testing.assert_array_equal(lock, peer.loss_of_lock[code])
            assert np.isnan(values[unseen]).all()
    return own


def test_version_3(tmp_path: Path) -> None:
    path = tmp_path / "a.rnx"
    body = [epoch_3(ranges(k, ("G05", "G12", "S36")[: 1 + k % 3])) for k in range(8)]
    event = ">                              4  1\n" + f"{'G05 comment':60}COMMENT\n"
    path.write_text(header_3(CODES) + "".join(body[:4]) + event + "".join(body[4:])[:-20])
    assert_same(path)


def test_tenths_of_a_second(tmp_path: Path) -> None:
    path = tmp_path / "a.rnx"
    stamps = [f"> 2024 03 05 10 00  {k / 10:.7f}  0  3" for k in range(10)]
    rows = epoch_3(ranges(0)).split("\n", 1)[1]
    path.write_text(header_3(CODES) + "".join(f"{stamp}\n{rows}" for stamp in stamps))
    found = assert_same(path)
    assert np.array_equal(np.diff(found.systems["G"].time).astype(int), [100_000_000] * 9)


@pytest.mark.parametrize("scale", ["GPS", "GLO", "BDT"])
def test_time_scales(tmp_path: Path, scale: str) -> None:
    path = tmp_path / "a.rnx"
    body = "".join(epoch_3(ranges(k)) for k in range(3))
    path.write_text(header_3(CODES, scale=scale) + body)
    assert_same(path)


def test_version_2(tmp_path: Path) -> None:
    path = tmp_path / "a.24o"
    path.write_text(header_2(TYPES) + "".join(epoch_2(epoch(k)) for k in range(4)))
    found = assert_same(path)
    assert set(found.systems) == {"G", "R", "S"}


def test_version_2_of_chosen_codes(tmp_path: Path) -> None:
    path = tmp_path / "a.24o"
    path.write_text(header_2(TYPES, "G") + "".join(epoch_2(epoch(k, ("G07",))) for k in range(3)))
    assert_same(path, codes=["C1C", "L1C"], systems="G")


def test_what_the_library_cannot_read_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.rnx"
    text = header_3(CODES, version="4.01") + epoch_3(ranges(0))
    path.write_text(text)
    assert read_observations(path).systems
    with pytest.raises(InputError, match="georinex cannot read") as caught:
        read_observations(path, engine="georinex")
    assert "native" in caught.value.cure


def cut(text: bytes, epochs: int, first: int = 0) -> bytes:
    """Header, and some epochs from a place on."""
    begin = text.find(b"\n>")
    at = start = text.find(b"\n>", max(first, begin))
    for _ in range(epochs):
        at = text.find(b"\n>", at + 1)
    return text[:begin] + text[start : at + 1]


def test_a_part_of_ceda(tmp_path: Path, reference_data: Path) -> None:
    folder = reference_data / "data" / "rinex"
    packed = folder / "CEDA00USA_R_20182100000_23H_15S_MO.rnx.gz"
    path = tmp_path / "ceda.rnx"
    text = gzip.decompress(packed.read_bytes())
    path.write_bytes(cut(text, 60, text.find(b"\nR", text.find(b"\n>")) - 2000))
    found = assert_same(path)
    assert found.systems["R"].time.size == 60
    assert np.isfinite(found.systems["R"].values["C1C"]).any()


@pytest.mark.parametrize("letter", ["G", "R", "E", "C", "S"])
def test_a_part_of_cebr(tmp_path: Path, reference_data: Path, letter: str) -> None:
    folder = reference_data / "data" / "rinex"
    packed = tmp_path / "cebr.crx"
    name = "CEBR00ESP_R_20182000000_01D_30S_MO.crx.gz"
    packed.write_bytes(cut_compact(gzip.decompress((folder / name).read_bytes())))
    text, _ = restored(packed, where="cebr")
    path = tmp_path / "cebr.rnx"
    path.write_bytes(cut(text, 40))
    assert_same(path, systems=letter)


def cut_compact(data: bytes) -> bytes:
    return data[: data.rfind(b"\n", 0, 120_000) + 1]
