"""Speed of the UBX reader on 1e6 messages of 2.5e5 epochs, beside pyubx2's on a part of it.

Run as `python benchmarks/ubx_speed.py`, or with `--large` for the peak memory on a file of 2 GB.
The file (64.5 MB; NAV-PVT, NAV-DOP, NAV-COV and NAV-PL, 258 bytes an epoch) is made in the
temporary folder if it is not there. A run is a process of its own; timed is reading with
checksums to the finished Recording, without the start of the interpreter and the imports.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from io import BytesIO
from pathlib import Path

import numpy as np

from sbas.logs.ublox import ubx_messages as ubx

EPOCHS = 250_000
LARGE_EPOCHS = 8_000_000
LENGTHS = {ubx.NAV_PVT: 92, ubx.NAV_DOP: 18, ubx.NAV_COV: 64, ubx.NAV_PL: 52}
BYTES_AN_EPOCH = sum(LENGTHS.values()) + 8 * len(LENGTHS)
PEER_EPOCHS = 2_000
RUNS = 5
TARGET_PER_S = 1e6
START = np.datetime64("2026-03-02T00:00:00", "ms")
LEAP_S = 18
READ = """
import re, sys, time
from pathlib import Path
import numpy as np
from sbas.logs.ublox import ublox_ubx
path = Path(sys.argv[1])
began = time.perf_counter()
if sys.argv[2] == "read":
    recording = ublox_ubx.read(path)
    rows = len(recording)
else:
    source = ublox_ubx.scan(path)
    rows = sum(len(batch) for batch in source.batches(["hpl_m", "lat_deg", "mode", "flags"]))
seconds = time.perf_counter() - began
# Not ru_maxrss, in which the parent's memory counts.
status = Path("/proc/self/status").read_text()
print(rows, seconds, int(re.search(r"VmHWM:\\s*(\\d+)", status)[1]) // 1024)
"""


def generated(path: Path, epochs: int) -> Path:
    """The log as a file; made only where it is not there."""
    if not path.is_file() or path.stat().st_size != epochs * BYTES_AN_EPOCH:
        rng = np.random.default_rng(1)
        with path.open("wb") as file:
            for first in range(0, epochs, EPOCHS):
                file.write(_epochs(first, min(EPOCHS, epochs - first), rng).tobytes())
        print(f"made {path}")
    return path


def _epochs(first: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, bytes) epochs at 10 Hz with random but possible values."""
    gps = START + (first + np.arange(count)) * np.timedelta64(100, "ms")
    itow = ((gps - np.datetime64("1980-01-06", "ms")) % np.timedelta64(7, "D")).astype(np.int64)
    utc = gps - np.timedelta64(LEAP_S, "s")
    day, month, year = utc.astype("M8[D]"), utc.astype("M8[M]"), utc.astype("M8[Y]")
    clock = (utc - day).astype(np.int64)
    integers = rng.integers
    values = {
        ubx.NAV_PVT: {
            "year": year.astype(np.int64) + 1970, "month": (month - year).astype(np.int64) + 1,
            "day": (day - month).astype(np.int64) + 1, "hour": clock // 3_600_000,
            "minute": clock // 60_000 % 60, "second": clock // 1000 % 60,
            "nano": clock % 1000 * 1_000_000, "valid": 7, "fix_type": 3, "fix_flags": 3,
            "n_sv": integers(6, 20, count), "lat": 500_345_000 + integers(-99, 99, count),
            "lon": 157_712_000 + integers(-99, 99, count), "height": integers(0, 10**6, count),
            "altitude": 245_000, "h_accuracy": integers(500, 3000, count), "v_accuracy": 2000,
            "vn": integers(-9, 9, count), "ve": integers(-9, 9, count), "vd": 3, "speed": 12,
            "pdop": 150, "fix_flags_3": 6,
        },
        ubx.NAV_DOP: {"pdop": 150, "vdop": 120, "hdop": integers(70, 160, count)},
        ubx.NAV_COV: {"position_valid": 1, **{n: rng.random(count) for n in ("nn", "ne", "ee",
                                                                             "dd")}},
        ubx.NAV_PL: {"risk_digits": 5, "risk_exponent": 0, "valid": 1, "axes": 1, "reason": 0,
                     **{f"level_{k}": integers(5_000, 30_000, count) for k in (1, 2, 3)}},
    }  # fmt: skip
    pieces = []
    for key, length in LENGTHS.items():
        rows = np.zeros((count, length + 8), np.uint8)
        rows[:, :6] = 0xB5, 0x62, key >> 8, key & 255, length & 255, length >> 8
        for name, (offset, kind) in ubx.MESSAGES[key].fields.items():
            value = np.broadcast_to(itow if name == "itow_ms" else values[key][name], count)
            place = rows[:, 6 + offset : 6 + offset + np.dtype(kind).itemsize]
            place[:] = value.astype(kind).view(np.uint8).reshape(count, -1)
        body = rows[:, 2:-2]
        rows[:, -2] = body.sum(axis=1) % 256
        rows[:, -1] = (body * np.arange(length + 4, 0, -1)).sum(axis=1) % 256
        pieces.append(rows)
    return np.concatenate(pieces, axis=1)


def _run(path: Path, how: str, epochs: int) -> tuple[float, int]:
    """Wall time [s] and peak memory [MiB] of one process."""
    done = subprocess.run(
        [sys.executable, "-c", READ, str(path), how], capture_output=True, text=True, check=True
    )
    rows, seconds, peak = done.stdout.split()
    if int(rows) != epochs:
        raise SystemExit(f"{how}: {rows} epochs instead of {epochs}")
    return float(seconds), int(peak)


def peer_s(path: Path) -> float:
    """Time [s] that pyubx2 would take, scaled from a part of the file."""
    from pyubx2 import UBXReader

    with path.open("rb") as file:
        part = BytesIO(file.read(PEER_EPOCHS * BYTES_AN_EPOCH))
    began = time.perf_counter()
    for _ in UBXReader(part, quitonerror=0):
        pass
    return (time.perf_counter() - began) * EPOCHS / PEER_EPOCHS


def main(arguments: list[str]) -> int:
    """Print the speeds; 1 where the reader misses its target."""
    folder = Path(tempfile.gettempdir())
    if "--large" in arguments:
        path = generated(folder / "sbas_speed_ubx_2gb.ubx", LARGE_EPOCHS)
        for how in ("scan", "read"):
            seconds, peak = _run(path, how, LARGE_EPOCHS)
            print(f"{how}  {path.stat().st_size / 1e9:.2f} GB  {seconds:.1f} s  {peak} MiB")
        return 0
    path = generated(folder / "sbas_speed_ubx_1e6_messages.ubx", EPOCHS)
    messages = EPOCHS * len(LENGTHS)
    best = float("inf")
    for how in ("scan", "read"):
        runs = [_run(path, how, EPOCHS) for _ in range(RUNS)]
        best, peak = min(seconds for seconds, _ in runs), runs[-1][1]
        print(
            f"sbas {how}  {best:6.2f} s  {messages / best:12,.0f} messages/s  {peak} MiB, best of"
        )
    print(f"           {RUNS} runs; target of read {TARGET_PER_S:,.0f} messages/s")
    try:
        theirs = peer_s(path)
    except ImportError:
        print("pyubx2 is not installed")
    else:
        print(f"pyubx2     {theirs:6.2f} s  {messages / theirs:12,.0f} messages/s, scaled")
    return int(messages / best < TARGET_PER_S)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
