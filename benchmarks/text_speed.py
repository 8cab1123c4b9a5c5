"""Rates of the text readers: delimited text (time and four numbers) and RTKLIB .pos.

Run: python benchmarks/text_speed.py. Prints rows per second, best of three, and the targets.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sbas.logs.arrow import parquet
from sbas.logs.delimited import delimited_text
from sbas.logs.rtklib import rtklib_pos
from sbas.recording import Recording

ROWS = 2_000_000
POS_HEADER = (
    "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=#)\n"
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)"
    "   sdu(m)  sdne(m)  sdeu(m)  sdun(m) hpl (m) vpl (m)\n"
)


def stamps(rows: int, date_sign: str, between: str) -> list[str]:
    times = np.datetime64("2025-01-01") + np.arange(rows).astype("m8[s]")
    text = np.datetime_as_string(times, unit="ms")
    return [t.replace("-", date_sign).replace("T", between) for t in text.tolist()]


def write_csv(path: Path) -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(4, ROWS))
    with open(path, "w") as file:
        file.write("time,lat,lon,height,hpl\n")
        file.writelines(
            f"{t},{50 + a * 1e-5:.9f},{15 + b * 1e-5:.9f},{289 + c:.4f},{11 + d:.2f}\n"
            for t, a, b, c, d in zip(stamps(ROWS, "-", "T"), *noise.tolist(), strict=True)
        )


def write_pos(path: Path) -> None:
    rng = np.random.default_rng(2)
    rows = ROWS // 2
    noise = np.abs(rng.normal(size=(4, rows)))
    with open(path, "w") as file:
        file.write(POS_HEADER)
        file.writelines(
            f"{t} {50 + a * 1e-5:14.9f} {15 + b * 1e-5:14.9f} {289 + c:10.4f}   3   9"
            f" {1 + d:8.4f} {1 + a:8.4f} {2 + b:8.4f} {c:8.4f} {-d:8.4f} {a:8.4f}"
            f" {11 + a:6.2f} {15 + b:6.1f}\n"
            for t, a, b, c, d in zip(stamps(rows, "/", " "), *noise.tolist(), strict=True)
        )


def best_rate(read: Callable[[], int]) -> float:
    rates = []
    for _ in range(3):
        start = time.perf_counter()
        rows = read()
        rates.append(rows / (time.perf_counter() - start))
    return max(rates)


def scanned_rows(path: Path) -> int:
    batches = parquet.scan(path).batches(["lat_deg", "lon_deg", "height_m", "hpl_m"])
    return sum(len(batch) for batch in batches)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        csv, pos, packed = folder / "t.csv", folder / "t.pos", folder / "t.parquet"
        write_csv(csv)
        write_pos(pos)
        recording: Recording = delimited_text.read(csv)
        start = time.perf_counter()
        parquet.write([recording], packed)
        print(f"parquet write  {ROWS / (time.perf_counter() - start) / 1e6:6.2f} M rows/s")
        for label, target, read in (
            ("csv", 2.0, lambda: len(delimited_text.read(csv))),
            (".pos", 0.6, lambda: len(rtklib_pos.read(pos))),
            ("parquet scan", None, lambda: scanned_rows(packed)),
        ):
            said = "" if target is None else f"  target {target}"
            print(f"{label:14s} {best_rate(read) / 1e6:6.2f} M rows/s{said}")


if __name__ == "__main__":
    main()
