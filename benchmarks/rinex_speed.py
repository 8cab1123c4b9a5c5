"""Rates of the RINEX readers, with and without Hatanaka decompression.

    python benchmarks/rinex_speed.py [FOLDER]    # of reference data, default ../shared

Best of five, after imports: wall time and CPU time of this process. Nothing is asserted.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sbas.logs.decompression import plain_file
from sbas.rinex.hatanaka_text import restored
from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observation_file import Engine, read_observations

ROOT = Path(__file__).resolve().parent.parent
CODES = ("C1C", "L1C", "D1C", "S1C", "C2W", "L2W", "D2W", "S2W")
TYPES = ("C1", "L1", "D1", "S1", "P2", "L2", "D2", "S2")


def hour_at_1_hz(path: Path, *, old: bool) -> None:
    """3600 epochs of twelve GPS satellites and eight codes, version 3 or 2."""
    label = "# / TYPES OF OBSERV" if old else "SYS / # / OBS TYPES"
    names = f"{8:6d}" + "".join(f"    {t}" for t in TYPES) if old else "G    8 " + " ".join(CODES)
    top = [
        (f"{'2.11' if old else '3.05':>9}{'':11}{'OBSERVATION DATA':<20}G", "RINEX VERSION / TYPE"),
        (names, label),
        ("", "END OF HEADER"),
    ]
    values = 2e7 + np.random.default_rng(1).random((3600, 12, 8)) * 1e6
    with open(path, "w", encoding="ascii") as file:
        file.writelines(f"{content:<60}{name}\n" for content, name in top)
        for k, satellites in enumerate(values.tolist()):
            minute, second = divmod(k, 60)
            if old:
                sats = "".join(f"G{n + 1:02d}" for n in range(12))
                file.write(f" 24  3  5 10 {minute:2d}{second:3d}.0000000  0 12{sats}\n")
            else:
                file.write(f"> 2024 03 05 10 {minute:02d}{second:3d}.0000000  0 12\n")
            for n, cells in enumerate(satellites):
                fields = [f"{cell:14.3f} 7" for cell in cells]
                if old:
                    file.write("".join(fields[:5]) + "\n" + "".join(fields[5:]) + "\n")
                else:
                    file.write(f"G{n + 1:02d}" + "".join(fields) + "\n")


def timed(
    path: Path, label: str, *, engine: Engine = "native", systems: str | None = None,
    codes: tuple[str, ...] | None = None, times: int = 5,
) -> None:  # fmt: skip
    best, least = np.inf, np.inf
    for _ in range(times):
        wall, cpu = time.perf_counter(), time.process_time()
        found = read_observations(path, systems=systems, codes=codes, engine=engine)
        best = min(best, time.perf_counter() - wall)
        least = min(least, time.process_time() - cpu)
    values = sum(int(np.isfinite(v).sum()) for s in found.systems.values()
                 for v in s.values.values())  # fmt: skip
    print(f"{label:44s} {best:7.3f} s wall {least:7.3f} s CPU {values:10,} values")


def imports() -> None:
    code = (
        "import time; import sbas; a = time.perf_counter();"
        "import sbas.rinex.observation_file, sbas.rinex.navigation_file;"
        "print(f'{time.perf_counter() - a:.3f}')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    print(f"imports of both readers after `import sbas`: {done.stdout.strip()} s")


def main() -> None:
    default = os.environ.get("SBAS_REFERENCE_DATA", ROOT.parent / "shared")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else default) / "data"
    imports()
    with tempfile.TemporaryDirectory() as temporary:
        for old in (False, True):
            path = Path(temporary) / "hour.obs"
            hour_at_1_hz(path, old=old)
            timed(path, f"1 h of 1 Hz, GPS, 8 codes, version {2 if old else 3}")
        packed = folder / "rinex" / "CEBR00ESP_R_20182000000_01D_30S_MO.crx.gz"
        if not packed.is_file():
            print(f"no reference data in {folder}")
            return
        timed(packed, "day, 30 s, five systems, Hatanaka and gzip")
        path = Path(temporary) / "day.rnx"
        unpacked = plain_file(packed)  # a temporary file, as long as it is held
        path.write_bytes(restored(unpacked.path, where="day")[0])
        timed(path, "day, 30 s, five systems")
        timed(path, "day, 30 s, GPS and SBAS, three codes", systems="GS", codes=CODES[:3])
        timed(path, "day, 30 s, SBAS, C1C, by georinex", engine="georinex", systems="S",
              codes=CODES[:1], times=1)  # fmt: skip
        for name in (
            "ELKO00USA_R_20182100000_01D_MN.rnx.gz",
            "VILL00ESP_R_20181700000_01D_MN.rnx.gz",
        ):
            start = time.perf_counter()
            found = read_navigation(folder / "rinex" / name)
            records = len(found.gps) + len(found.galileo) + len(found.geo)
            print(f"{name:44s} {time.perf_counter() - start:7.3f} s wall {records:10,} records")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")


if __name__ == "__main__":
    main()
