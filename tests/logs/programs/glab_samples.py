"""Lines as gLAB 6 writes them, in the widths of its message help."""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pymap3d

YEAR, DAY, WEEK = 2025, 46, 2353
"""2025-02-15, a Saturday: day 6 of week 2353."""

HEADER = """\
INFO gLAB version v6.0.0, built on Nov 21 2026 22:42:47
INFO INPUT Antenna type:   TRM59800.00
INFO INPUT GPS Receiver type:  SEPT POLARX5 [Unknown]
INFO MODELLING SBAS Kh factor PA: 6
INFO MODELLING SBAS Kv factor PA: 5.33
"""


def start(word: str, second: float) -> str:
    clock = f"{int(second) // 3600:02d}:{int(second) // 60 % 60:02d}:{second % 60:05.2f}"
    return f"{word:9s} {YEAR} {DAY:03d} {second:8.2f} {clock}"


def output(
    second: float,
    lat: float = 50.0345,
    lon: float = 15.7712,
    height: float = 289.8,
    *,
    used: int = 8,
    processing: int = 5,
    hdop: float = 1.0711,
) -> str:
    x, y, z = pymap3d.geodetic2ecef(lat, lon, height, deg=True)
    zeros = " ".join(["0.0000"] * 3)
    return (
        f"{start('OUTPUT', second)} {processing} 0 {used:2d} 1 GPS    4.0 {x:14.4f} {y:14.4f} "
        f"{z:14.4f} {zeros} 1.9 2.8 2.5 {lat:14.9f} {lon:14.9f} {height:12.4f} {zeros} 3.6 1.5 1.6"
        f" {zeros} GPS -0.09 2.66 2.3 2.0139 1.1 {hdop:.4f} 1.7834 {zeros}\n"
    )


def sbasout(
    second: float,
    hpl: float = 11.25,
    vpl: float = 18.5,
    *,
    mode: str = "PA",
    geo: int = 123,
    processing: int = 5,
    used: Sequence[str] = ("G09", "G04", "G06", "G11", "G12", "G17", "G19", "G20"),
    unused: Sequence[str] = ("G05", "G07"),
) -> str:
    listed = " ".join([*(f"+{name}" for name in used), *(f"-{name}" for name in unused)])
    tow = 6 * 86_400 + second
    return (
        f"{start('SBASOUT', second)} {WEEK} {tow:9.2f} synt {processing} {mode:>3s} {geo}"
        f"  0.0000  0.0000  0.0000  0.0000 {hpl:14.4f}  40.00  0.0000 {vpl:14.4f}  50.00  0.0000"
        f"  -4.3225 {len(used) + len(unused):2d} {len(used):2d} {listed}\n"
    )


def sbasvar(
    second: float,
    prn: int,
    *,
    elevation: float = 45.0,
    azimuth: float = -72.305,
    sigma: float = 2.5,
    star: str = "",
    mode: str = "PA",
) -> str:
    return (
        f"{start('SBASVAR' + star, second)} GPS {prn:3d} BLOCK_IIF 73 1 363 {elevation:8.3f} "
        f"{azimuth:8.3f} {mode:>3s} 123 {sigma:14.4f} 1.8723 1.8237 1.012 28 0.0261 0.0011 0.0022 "
        "0.0033 1 1.6206 0.1470 0.3835 0.360 0.132 0.001\n"
    )


def unselected(second: float, prn: int, code: int, text: str) -> str:
    return f'{start("SBASUNSEL", second)} GPS {prn:3d}  PA 123 {code:2d} "{text}"\n'


def satsel(second: float, prn: int, code: int, text: str) -> str:
    return f'{start("SATSEL", second)} GPS {prn:2d} {code:3d} "{text}"\n'


def run(count: int, first: float = 43_262.0) -> str:
    """A run of epochs with moving position and changing levels."""
    steps = np.arange(count)
    return HEADER + "".join(
        output(first + i, 50.0345 + 1e-6 * i, 15.7712, 289.8 + 0.01 * i)
        + sbasout(first + i, 11.25 + 0.5 * (i % 7), 18.5 + 0.25 * (i % 11))
        for i in steps.tolist()
    )


def plain_lines(text: str, word: str) -> Iterator[list[str]]:
    """Fields of the lines of one message, by splitting alone."""
    for line in text.splitlines():
        fields = line.split()
        if fields and fields[0] == word:
            yield fields


def unpacked(reference_data: Path, name: str, folder: Path) -> Path:
    """A reference output of gLAB as plain text."""
    path = folder / name
    with gzip.open(reference_data / "reference/glab" / f"{name}.gz") as packed:
        path.write_bytes(packed.read())
    return path
