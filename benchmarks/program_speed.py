"""Rates of the readers of other programs' solutions: gLAB, PEGASUS-style tables, Ginan, NovAtel.

Run: python benchmarks/program_speed.py. Prints lines (messages) and megabytes per second, best of
three, and the target of half a million lines a second for text.
"""

from __future__ import annotations

import importlib.util
import tempfile
import time
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pymap3d

from sbas.logs.programs import ginan_spp, glab_output, novatel_oem, pegasus_csv

EPOCHS = 200_000
START = np.datetime64("2025-02-09T00:00:00")
WEEK = 2353
LAT, LON, HEIGHT = 50.0345, 15.7712, 289.8
X, Y, Z = pymap3d.geodetic2ecef(LAT, LON, HEIGHT, deg=True)
ZEROS = "     0.0000     0.0000     0.0000"


def write_glab(path: Path) -> int:
    days = np.arange(EPOCHS) // 86_400 + 40
    with open(path, "w") as file:
        for i, day in enumerate(days.tolist()):
            second = i % 86_400
            clock = f"{second // 3600:02d}:{second // 60 % 60:02d}:{second % 60:02d}.00"
            when = f"2025 {day:03d} {second:8.2f} {clock}"
            file.write(
                f"OUTPUT    {when} 5 0  8 1 GPS   11.4870 {X:14.4f} {Y:14.4f} {Z:14.4f}{ZEROS}"
                f"{ZEROS} {LAT:14.9f} {LON:14.9f} {HEIGHT:12.4f}{ZEROS}{ZEROS}{ZEROS} GPS -6.9445 "
                f"7.0245 4.0637 3.4545 2.1401 1.8276 2.9314{ZEROS}\n"
                f"SBASOUT   {when} {WEEK} {i:9.2f} synt 5  PA 137 {ZEROS} 0.0000 "
                f"{11 + i % 97 / 10:14.4f}  40.00         0.0000 {18 + i % 89 / 10:14.4f}  50.00 "
                "        0.0000        -6.9445 10  6 "
                "+G09 +G04 +G11 +G12 +G19 +G20 -G05 -G06 -G07 -G17\n"
            )
    return 2 * EPOCHS


def write_glab_satellites(path: Path) -> int:
    with open(path, "w") as file:
        for i in range(EPOCHS // 8):
            clock = f"{i // 3600:02d}:{i // 60 % 60:02d}:{i % 60:02d}.00"
            when = f"2025 040 {i:8.2f} {clock}"
            for prn in range(1, 11):
                file.write(
                    f"SBASVAR   {when} GPS {prn:3d} BLOCK_IIF 73 1 363 {8 * prn:8.3f} "
                    f"{30 * prn:8.3f}  PA 137 {2.5101:14.4f} {1.8723:14.4f} {1.8237:14.4f}    "
                    f"1.012  28 {0.0261:14.4f} {0:14.4f} {0:14.4f} {0:14.4f} 0 {1.6206:14.4f} "
                    f"{0.147:14.4f} {0.3835:14.4f}    0.360    0.132    0.000\n"
                )
    return EPOCHS // 8 * 10


def write_pegasus(path: Path) -> int:
    with open(path, "w") as file:
        file.write(f"{';'.join(pegasus_csv.HEADERS)}\n")
        file.writelines(
            f"{i};{WEEK};10;8;{LAT:.9f};{LON:.9f};{HEIGHT:.4f};3.00;4.00;-0.50;"
            f"{11 + i % 97 / 10:.3f};{18 + i % 89 / 10:.3f};{LAT:.9f};{LON:.9f};{HEIGHT:.4f}\n"
            for i in range(EPOCHS)
        )
    return EPOCHS


def write_ginan(path: Path) -> int:
    stamps = np.datetime_as_string(START + np.arange(EPOCHS).astype("m8[s]"), unit="ms")
    with open(path, "w") as file:
        file.write("\n*YYYY-MM-DDTHH:MM:SS.SSS YYYY.YYYYYYYYY")
        file.writelines(
            f"\n {t} 2025.110000000 {X:14.5f} {Y:14.5f} {Z:14.5f} {0.9:11.4f} {1.5:11.4f} "
            f"{2.1:11.4f} - - - {LAT:15.10f} {LON:15.10f} {HEIGHT:11.5f} - - - - "
            f"{11 + i % 97 / 10:11.5f} {18 + i % 89 / 10:11.5f} - - -"
            for i, t in enumerate(stamps.tolist())
        )
    return EPOCHS


def write_novatel(path: Path) -> int:
    body = bytearray(72)
    body[4] = 18
    body[8:16], body[16:24] = np.float64(LAT).tobytes(), np.float64(LON).tobytes()
    with open(path, "wb") as file:
        for i in range(EPOCHS):
            head = b"\xaa\x44\x12\x1c\x2a\0\0\0\x48\0\0\0\0\xb4" + WEEK.to_bytes(2, "little")
            data = head + (1000 * i).to_bytes(4, "little") + bytes(8) + body
            crc = zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
            file.write(data + crc.to_bytes(4, "little"))
    return EPOCHS


def best_seconds(read: Callable[[], object]) -> float:
    times = []
    for _ in range(3):
        start = time.perf_counter()
        read()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    cases = [
        ("gLAB solutions", write_glab, glab_output.read),
        ("gLAB satellites", write_glab_satellites, glab_output.read),
        ("PEGASUS style", write_pegasus, pegasus_csv.read),
        ("Ginan", write_ginan, ginan_spp.read),
    ]
    if importlib.util.find_spec("novatel_edie") is not None:
        cases.append(("NovAtel", write_novatel, novatel_oem.read))
    with tempfile.TemporaryDirectory() as name:
        for label, write, read in cases:
            path = Path(name) / "sample"
            count = write(path)
            seconds = best_seconds(partial(read, path))
            print(
                f"{label:16s} {count / seconds / 1e6:5.2f} M a second, "
                f"{path.stat().st_size / seconds / 1e6:5.0f} MB/s  (target 0.5 for text)"
            )


if __name__ == "__main__":
    main()
