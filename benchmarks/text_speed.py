"""Rates and memory of the text readers: delimited text (time and four numbers) and RTKLIB .pos.

    python benchmarks/text_speed.py                 # rates of 2 M and 1 M rows, best of three
    python benchmarks/text_speed.py large [GIB]     # check of files of GIB (default 2) in scan
    python benchmarks/text_speed.py packed          # rates of unpacking

Rates are of reading alone, after imports. `large` runs each check in a process of its own and
prints its peak memory; it needs twice the size of the files on the disk. Nothing is asserted.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import sbas
from sbas.logs.arrow import parquet
from sbas.logs.decompression import plain_file
from sbas.logs.delimited import delimited_text
from sbas.logs.rtklib import rtklib_pos
from sbas.recording import Recording

ROWS = 2_000_000
POS_HEADER = (
    "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=#)\n"
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)"
    "   sdu(m)  sdne(m)  sdeu(m)  sdun(m) hpl (m) vpl (m)\n"
)


def stamps(begin: int, rows: int, date_sign: str, between: str) -> list[str]:
    times = np.datetime64("2015-01-01") + np.arange(begin, begin + rows).astype("m8[s]")
    text = np.datetime_as_string(times, unit="ms")
    return [t.replace("-", date_sign).replace("T", between) for t in text.tolist()]


def csv_lines(begin: int, rows: int) -> str:
    noise = np.random.default_rng([1, begin]).normal(size=(4, rows))
    return "".join(
        f"{t},{50 + a * 1e-5:.9f},{15 + b * 1e-5:.9f},{289 + c:.4f},{11 + d:.2f}\n"
        for t, a, b, c, d in zip(stamps(begin, rows, "-", "T"), *noise.tolist(), strict=True)
    )


def pos_lines(begin: int, rows: int) -> str:
    noise = np.abs(np.random.default_rng([2, begin]).normal(size=(4, rows)))
    return "".join(
        f"{t} {50 + a * 1e-5:14.9f} {15 + b * 1e-5:14.9f} {289 + c:10.4f}   3   9"
        f" {1 + d:8.4f} {1 + a:8.4f} {2 + b:8.4f} {c:8.4f} {-d:8.4f} {a:8.4f}"
        f" {11 + a:6.2f} {15 + b:6.1f}\n"
        for t, a, b, c, d in zip(stamps(begin, rows, "/", " "), *noise.tolist(), strict=True)
    )


HEADERS = {"csv": "time,lat,lon,height,hpl\n", "pos": POS_HEADER}
LINES: dict[str, Callable[[int, int], str]] = {"csv": csv_lines, "pos": pos_lines}


def write(path: Path, *, rows: int | None = None, size: int | None = None) -> int:
    """A file of so many rows, or of at least so many bytes; returns its rows."""
    kind = path.suffix[1:]
    done = 0
    with open(path, "w") as file:
        file.write(HEADERS[kind])
        while done < rows if rows is not None else file.tell() < (size or 0):
            file.write(LINES[kind](done, 500_000))
            done += 500_000
    return done


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


def rates(folder: Path) -> None:
    csv, pos, packed = folder / "t.csv", folder / "t.pos", folder / "t.parquet"
    write(csv, rows=ROWS)
    write(pos, rows=ROWS // 2)
    recording: Recording = delimited_text.read(csv)
    start = time.perf_counter()
    parquet.write([recording], packed)
    print(f"parquet write  {ROWS / (time.perf_counter() - start) / 1e6:6.2f} M rows/s")
    for label, target, read in (
        ("csv", 2.0, lambda: len(delimited_text.read(csv))),
        ("csv sbas.read", 2.0, lambda: len(sbas.read(csv))),
        (".pos", 0.5, lambda: len(rtklib_pos.read(pos))),
        (".pos sbas.read", 0.5, lambda: len(sbas.read(pos))),
        ("parquet scan", None, lambda: scanned_rows(packed)),
    ):
        said = "" if target is None else f"  target {target}"
        print(f"{label:14s} {best_rate(read) / 1e6:6.2f} M rows/s{said}")


def check_file(path: Path) -> None:
    """In a process of its own: time and peak memory of `scan` and `check`."""
    start = time.perf_counter()
    source = sbas.scan(path)
    scanned = time.perf_counter() - start
    result = sbas.check(source)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{path.suffix} {path.stat().st_size / 2**30:.2f} GiB: {result.epochs:,} epochs, "
        f"scan {scanned:.1f} s ({result.epochs / scanned / 1e6:.2f} M rows/s), with check "
        f"{seconds:.1f} s, peak memory {peak:.0f} MiB"
    )


def large(folder: Path, gib: float) -> None:
    for kind in HEADERS:
        path = folder / f"large.{kind}"
        write(path, size=int(gib * 2**30))
        subprocess.run([sys.executable, __file__, "check", str(path)], check=True)
        path.unlink()


def packed(folder: Path) -> None:
    import ncompress

    write(folder / "t.csv", rows=ROWS)
    plain = (folder / "t.csv").read_bytes()
    packers: dict[str, Callable[[bytes], bytes]] = {
        "gzip": lambda data: gzip.compress(data, 6),
        "bzip2": bz2.compress,
        "xz": lambda data: lzma.compress(data, preset=1),
        "compress": ncompress.compress,
    }
    for name, pack in packers.items():
        path = folder / "t"
        path.write_bytes(pack(plain))
        start = time.perf_counter()
        plain_file(path)
        rate = len(plain) / (time.perf_counter() - start) / 1e6
        print(f"{name:9s} {rate:6.0f} MB/s of output, {len(plain) / path.stat().st_size:.1f}:1")


def main() -> None:
    what = sys.argv[1] if len(sys.argv) > 1 else "rates"
    if what == "check":
        check_file(Path(sys.argv[2]))
        return
    with tempfile.TemporaryDirectory() as name:
        if what == "large":
            large(Path(name), float(sys.argv[2]) if len(sys.argv) > 2 else 2.0)
        elif what == "packed":
            packed(Path(name))
        else:
            rates(Path(name))


if __name__ == "__main__":
    main()
