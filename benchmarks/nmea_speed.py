"""Speed of the NMEA reader on a log of 1.2 million sentences, beside pynmeagps on a part of it.

Run as `python benchmarks/nmea_speed.py`. The file (150,000 epochs of eight sentences, 83 MB) is
made in the temporary folder if it is not there. A run is a whole process; what the interpreter and
the imports take is measured apart and left out, as the target is for reading.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from functools import reduce
from io import BytesIO
from operator import xor
from pathlib import Path

import numpy as np

EPOCHS = 150_000
SENTENCES_AN_EPOCH = 8
PEER_EPOCHS = 2_000
RUNS = 5
TARGET_PER_S = 0.8e6
READ = """
import resource, sys, time
from pathlib import Path
from sbas.logs.nmea.nmea import read, scan
began = time.perf_counter()
if sys.argv[2] == "read":
    rows = len(read(Path(sys.argv[1])))
else:
    rows = sum(len(b) for b in scan(Path(sys.argv[1])).batches(["lat_deg", "lon_deg", "height_m"]))
seconds = time.perf_counter() - began
print(rows, seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
"""


def framed(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode()):02X}\r\n"


def generated(path: Path) -> Path:
    """The log as a file; made only where it is not there."""
    if path.is_file():
        return path
    rng = np.random.default_rng(1)
    partial = path.with_suffix(".partial")
    with partial.open("w", newline="") as file:
        for i in range(EPOCHS):
            day, second = divmod(i, 86_400)
            clock = f"{second // 3600:02d}{second // 60 % 60:02d}{second % 60:02d}.00"
            lat, lon, alt, spread = rng.normal(size=4)
            where = f"5002.{20700 + lat * 50:05.0f},N,01546.{27200 + lon * 50:05.0f},E"
            file.write(
                framed(f"GNRMC,{clock},A,{where},10.000,90.00,{20 + day:02d}0924,,,D")
                + framed(f"GNGGA,{clock},{where},2,12,0.80,{245.3 + alt:.2f},M,44.5,M,3.0,0120")
                + framed("GNGSA,A,3,01,02,12,14,24,32,,,,,,,1.50,0.80,1.27,1")
                + framed("GNGSA,A,3,65,66,72,81,82,,,,,,,,1.50,0.80,1.27,2")
                + framed("GPGSV,2,1,06,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,45,1")
                + framed("GPGSV,2,2,06,24,30,150,44,32,11,100,31,1")
                + framed("GLGSV,1,1,02,65,40,083,46,66,17,308,41,1")
                + framed(f"GNGST,{clock},1.2,1.10,0.70,40.0,0.95,0.89,{2 + 0.1 * spread:.3f}")
            )
    partial.replace(path)
    return path


def run(path: Path, how: str) -> tuple[float, int]:
    """Best time [s] of reading in some processes, and the highest peak memory [MiB]."""
    best, most = float("inf"), 0
    for _ in range(RUNS):
        done = subprocess.run(
            [sys.executable, "-c", READ, str(path), how], capture_output=True, text=True, check=True
        )
        rows, seconds, peak = done.stdout.split()
        if int(rows) != EPOCHS:
            raise SystemExit(f"read {rows} epochs instead of {EPOCHS}")
        best, most = min(best, float(seconds)), max(most, int(peak))
    return best, most


def peer_s(path: Path) -> float:
    """Time [s] that pynmeagps would take, scaled from a part of the file."""
    from pynmeagps import NMEAReader

    part = b"".join(path.open("rb").readlines()[: PEER_EPOCHS * SENTENCES_AN_EPOCH])
    began = time.perf_counter()
    for _ in NMEAReader(BytesIO(part)):
        pass
    return (time.perf_counter() - began) * EPOCHS / PEER_EPOCHS


def main() -> int:
    """Print the speeds; 1 where reading misses its target."""
    path = generated(Path(tempfile.gettempdir()) / "sbas_speed_nmea_150000_epochs.nmea")
    sentences = EPOCHS * SENTENCES_AN_EPOCH
    seconds, peak = run(path, "read")
    print(f"sbas       {seconds:7.2f} s {sentences / seconds:12,.0f} sentences/s, {peak} MiB, best")
    print(f"                     of {RUNS} processes; target {TARGET_PER_S:,.0f}")
    streamed, peak = run(path, "scan")
    print(f"sbas scan  {streamed:7.2f} s {2 * sentences / streamed:12,.0f} sentences/s, {peak} MiB")
    print("                     two passes: findings, then three columns")
    try:
        theirs = peer_s(path)
    except ImportError:
        print("pynmeagps  is not installed")
    else:
        print(f"pynmeagps  {theirs:7.2f} s {sentences / theirs:12,.0f} sentences/s, scaled")
    return int(sentences / seconds < TARGET_PER_S)


if __name__ == "__main__":
    sys.exit(main())
