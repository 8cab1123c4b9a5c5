"""Speed of the SBF reader on the record of 3e5 epochs, beside pysbf2's on a part of it.

Run as `python benchmarks/sbf_speed.py`. The files are made in the temporary folder if they are
not there: one of 86 MB with six blocks and 288 bytes an epoch, one of 438 MB with three more
blocks, each of 8 satellites. A run is a whole process: start of the interpreter, imports, reading
with CRC, and the finished Recording; or, for `scan`, the first look and one further look at the
levels. `python benchmarks/sbf_speed.py --stream` adds a file of 2.07 GB, for its peak memory.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.logs.checksums import crc16_of_rows
from sbas.logs.septentrio.sbf_writer import write
from sbas.recording import Recording, mode_categories

EPOCHS = 300_000
BLOCKS_AN_EPOCH = 6
BYTES_AN_EPOCH = 288
PEER_EPOCHS = 2_000
RUNS = 3
TARGET_PER_S = 1.5e6
SATELLITES = 8
STREAM_PIECES = 24
"""Records in the long file, one day after the other."""
_HEAD = """
import resource, sys
from pathlib import Path
from sbas.logs.septentrio.septentrio_sbf import FILLED, read, scan
"""
_TAIL = """
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
print(epochs, others, peak)
"""
READ = (
    _HEAD
    + """
recording = read(Path(sys.argv[1]))
epochs = len(recording)
others = sum(len(side) for side in recording.side_tables.values())
"""
    + _TAIL
)
READ_COLUMNS = READ.replace("(sys.argv[1])", "(sys.argv[1]), columns=list(FILLED)")
SCAN = (
    _HEAD
    + """
source = scan(Path(sys.argv[1]))
epochs = sum(len(batch) for batch in source.batches(["hpl_m", "vpl_m", "flags"]))
others = 0
"""
    + _TAIL
)


def generated(path: Path, records: int = 1) -> Path:
    """Records one after the other as a file; made only where it is not there."""
    if not path.is_file() or path.stat().st_size != records * EPOCHS * BYTES_AN_EPOCH:
        began = time.perf_counter()
        record = _recording()
        write((_later(record, i) for i in range(records)), path)
        print(f"made {path} in {time.perf_counter() - began:.2f} s")
    return path


def _later(record: Recording, times: int) -> Recording:
    shift = np.timedelta64(times * EPOCHS, "s")
    side = record.side_tables["sbas_frames"]
    return record.replace(
        table=record.table.set_axis(record.table.index + shift),
        side_tables={"sbas_frames": side.assign(time=side["time"] + shift)},
    )


def with_satellites(record: Path, path: Path) -> Path:
    """The record with PVTSatCartesian, PVTResiduals and GEOCorrections behind each epoch's DOP."""
    position, residual, correction = (
        16 + 48 * SATELLITES,
        20 + 28 * SATELLITES,
        16 + 64 * SATELLITES,
    )
    size = BYTES_AN_EPOCH + position + residual + correction
    if path.is_file() and path.stat().st_size == EPOCHS * size:
        return path
    rng = np.random.default_rng(2)
    epochs = np.fromfile(record, np.uint8).reshape(EPOCHS, BYTES_AN_EPOCH)
    before = 96 + 56 + 32
    svid = np.arange(1, SATELLITES + 1)
    with path.open("wb") as file:
        for start in range(0, EPOCHS, 10_000):
            part = epochs[start : start + 10_000]
            rows = len(part), SATELLITES
            sky = rng.standard_normal((*rows, 3))
            sky *= 2.65e7 / np.linalg.norm(sky, axis=2, keepdims=True)
            blocks = [
                _sealed(part, 4008 | 1 << 13, 16, (48,), {0: svid, 4: sky}),
                _sealed(part, 4009 | 1 << 13, 20, (12, 8), {
                    0: svid, 5: np.full(rows, 21), 12: rng.standard_normal(rows).astype("<f4"),
                    16: rng.integers(0, 4000, rows).astype("<u2"),
                    18: rng.integers(50, 200, rows).astype("<u2"),
                }, extra=8),
                _sealed(part, 5935, 16, (64,), {0: svid, 48: rng.random((*rows, 4)).astype("<f4")}),
            ]  # fmt: skip
            file.write(np.hstack([part[:, :before], *blocks, part[:, before:]]).tobytes())
    return path


def _sealed(
    epochs: NDArray[np.uint8],
    block_id: int,
    first: int,
    sizes: tuple[int, ...],
    fields: dict[int, NDArray[Any]],
    extra: int = 0,
) -> NDArray[np.uint8]:
    """A block an epoch at its time: fields by their place in each satellite's sub-block."""
    step = sum(sizes) + extra
    rows = np.zeros((len(epochs), first + step * SATELLITES), np.uint8)
    rows[:, :2] = epochs[:, :2]
    rows[:, 4:6] = np.array([block_id], "<u2").view("u1")
    rows[:, 6:8] = np.array([rows.shape[1]], "<u2").view("u1")
    rows[:, 8:14] = epochs[:, 8:14]
    rows[:, 14] = SATELLITES
    rows[:, 15 : 15 + len(sizes)] = sizes
    sub = rows[:, first:].reshape(len(rows), SATELLITES, step)
    for place, values in fields.items():
        if values.dtype.kind == "i":
            sub[:, :, place] = values
        else:
            raw = np.ascontiguousarray(values).view("u1").reshape(len(rows), SATELLITES, -1)
            sub[:, :, place : place + raw.shape[2]] = raw
    rows[:, 2:4] = crc16_of_rows(rows[:, 4:])[:, None].view("u1")
    return rows


def _recording() -> Recording:
    rng = np.random.default_rng(1)
    time_ = np.datetime64("2009-09-19", "ns") + np.arange(EPOCHS) * np.timedelta64(1, "s")
    normal = rng.standard_normal
    table = pd.DataFrame(
        {
            "lat_deg": 50.0345 + 1e-5 * normal(EPOCHS),
            "lon_deg": 15.7712 + 1e-5 * normal(EPOCHS),
            "height_m": 289.4 + 2 * normal(EPOCHS),
            "hpl_m": 11 + 0.5 * normal(EPOCHS),
            "vpl_m": 17 + 0.8 * normal(EPOCHS),
            **{name: 1.2 + 0.1 * normal(EPOCHS) for name in ("hdop", "vdop", "pdop")},
            **{f"sigma_{axis}_m": 0.9 + 0.1 * rng.random(EPOCHS) for axis in "enu"},
            "cov_en_m2": 0.1 * normal(EPOCHS),
            **{f"vel_{axis}_mps": 0.02 * normal(EPOCHS) for axis in "enu"},
            **{name: 4 + rng.random(EPOCHS) for name in ("herl_m", "verl_m", "correction_age_s")},
            "n_sv": rng.integers(6, 11, EPOCHS).astype("i2"),
            "geo_prn": np.full(EPOCHS, 120, "i2"),
            "mode": mode_categories(np.full(EPOCHS, 2)),
            "flags": np.full(EPOCHS, 16, "u4"),
        },
        index=pd.DatetimeIndex(time_, name="time"),
    )
    raw = pa.py_buffer(rng.integers(0, 256, 32 * EPOCHS, dtype=np.uint8))
    frames = pa.FixedSizeBinaryArray.from_buffers(pa.binary(32), EPOCHS, [None, raw])
    side = pd.DataFrame(
        {
            "time": time_,
            "prn": np.full(EPOCHS, 120, "i2"),
            "crc_passed": np.ones(EPOCHS, np.bool_),
            "signal": pd.Categorical.from_codes(np.zeros(EPOCHS, np.int8), categories=["L1"]),
            "frame": pd.arrays.ArrowExtensionArray(pa.chunked_array([frames])),
        }
    )
    return Recording(table, side_tables={"sbas_frames": side})


def whole_process_s(
    code: str, path: Path, expected: tuple[int, int], runs: int
) -> tuple[float, float, int]:
    """Least wall time and processor time [s] of some runs, and the peak memory [MiB]."""
    best, least, peak = float("inf"), float("inf"), 0
    for _ in range(runs):
        began, before = time.perf_counter(), _processor_s()
        done = subprocess.run(
            [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
        )
        best = min(best, time.perf_counter() - began)
        least = min(least, _processor_s() - before)
        epochs, others, peak = map(int, done.stdout.split())
        if (epochs, others) != expected:
            raise SystemExit(f"{epochs} epochs and {others} other rows instead of {expected}")
    return best, least, peak


def _processor_s() -> float:
    """Processor time of all processes started so far [s]; other load on the machine adds none."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def peer_s(path: Path) -> float:
    """Time [s] that pysbf2 would take, scaled from a part of the file."""
    from pysbf2 import SBFReader

    with path.open("rb") as file:
        part = BytesIO(file.read(PEER_EPOCHS * BYTES_AN_EPOCH))
    began = time.perf_counter()
    for _ in SBFReader(part, quitonerror=0):
        pass
    return (time.perf_counter() - began) * EPOCHS / PEER_EPOCHS


def main() -> int:
    """Print the speeds; 1 where the reader misses its target on the plain record."""
    folder = Path(tempfile.gettempdir())
    plain = generated(folder / "sbas_speed_3e5_epochs.sbf")
    rich = with_satellites(plain, folder / "sbas_speed_3e5_epochs_satellites.sbf")
    rows = EPOCHS * (1 + SATELLITES)
    runs = [
        ("read", READ, plain, EPOCHS, (EPOCHS, EPOCHS), RUNS),
        ("scan and a look", SCAN, plain, EPOCHS, (EPOCHS, 0), RUNS),
        ("read, satellites", READ, rich, EPOCHS, (EPOCHS, rows), RUNS),
        ("read, columns named", READ_COLUMNS, rich, EPOCHS, (EPOCHS, EPOCHS), RUNS),
        ("scan, satellites", SCAN, rich, EPOCHS, (EPOCHS, 0), RUNS),
    ]
    if "--stream" in sys.argv:
        long = generated(folder / "sbas_speed_2_gb.sbf", STREAM_PIECES)
        epochs = EPOCHS * STREAM_PIECES
        runs.append(("scan, 2 GB", SCAN, long, epochs, (epochs, 0), 1))
    speeds = []
    for name, code, path, epochs, expected, times in runs:
        seconds, processor_s, peak = whole_process_s(code, path, expected, times)
        blocks = epochs * (BLOCKS_AN_EPOCH + 3 * (path == rich))
        speeds.append(blocks / seconds)
        print(
            f"{name:20s}{seconds:8.2f} s  {blocks / seconds:12,.0f} blocks/s"
            f"  {path.stat().st_size / 1e6 / seconds:6.0f} MB/s"
            f"  {processor_s:6.2f} s of processors  {peak:5d} MiB"
        )
    print(f"whole processes, best of {RUNS} runs; target of read {TARGET_PER_S:,.0f} blocks/s")
    try:
        theirs = peer_s(plain)
    except ImportError:
        print("pysbf2 is not installed")
    else:
        blocks = EPOCHS * BLOCKS_AN_EPOCH
        print(f"{'pysbf2':20s}{theirs:8.2f} s  {blocks / theirs:12,.0f} blocks/s  parsing, scaled")
    return int(speeds[0] < TARGET_PER_S)


if __name__ == "__main__":
    sys.exit(main())
