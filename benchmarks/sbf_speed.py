"""Speed of the SBF reader on the record of 3e5 epochs, beside pysbf2's on a part of it.

Run as `python benchmarks/sbf_speed.py`. The file (86 MB, six blocks and 288 bytes an epoch) is
made in the temporary folder if it is not there. A run is a whole process: start of the
interpreter, imports, reading with CRC, and the finished Recording.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from sbas.logs.septentrio.sbf_writer import write
from sbas.recording import Recording, mode_categories

EPOCHS = 300_000
BLOCKS_AN_EPOCH = 6
BYTES_AN_EPOCH = 288
PEER_EPOCHS = 2_000
RUNS = 5
TARGET_PER_S = 1.5e6
READ = """
import resource, sys
from pathlib import Path
from sbas.logs.septentrio.septentrio_sbf import read
recording = read(Path(sys.argv[1]))
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
print(len(recording), len(recording.side_tables["sbas_frames"]), peak)
"""


def generated(path: Path) -> Path:
    """The record as a file; made only where it is not there."""
    if not path.is_file() or path.stat().st_size != EPOCHS * BYTES_AN_EPOCH:
        began = time.perf_counter()
        write([_recording()], path)
        print(f"made {path} in {time.perf_counter() - began:.2f} s")
    return path


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


def whole_process_s(path: Path) -> tuple[float, int]:
    """Best wall time [s] of some runs, and the peak memory of the last [MiB]."""
    best, peak = float("inf"), 0
    for _ in range(RUNS):
        began = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=True
        )
        best = min(best, time.perf_counter() - began)
        epochs, frames, peak = map(int, done.stdout.split())
        if (epochs, frames) != (EPOCHS, EPOCHS):
            raise SystemExit(f"read {epochs} epochs and {frames} frames instead of {EPOCHS}")
    return best, peak


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
    """Print both speeds; 1 where the reader misses its target."""
    path = generated(Path(tempfile.gettempdir()) / "sbas_speed_3e5_epochs.sbf")
    blocks = EPOCHS * BLOCKS_AN_EPOCH
    seconds, peak = whole_process_s(path)
    print(f"sbas    {seconds:8.2f} s  {blocks / seconds:12,.0f} blocks/s  whole process, best of")
    print(f"                  {RUNS} runs, {peak} MiB; target {TARGET_PER_S:,.0f} blocks/s")
    try:
        theirs = peer_s(path)
    except ImportError:
        print("pysbf2  is not installed")
    else:
        print(f"pysbf2  {theirs:8.2f} s  {blocks / theirs:12,.0f} blocks/s  parsing only, scaled")
    return int(blocks / seconds < TARGET_PER_S)


if __name__ == "__main__":
    sys.exit(main())
