"""Small RINEX files written field by field, apart from the readers they test."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence

Cell = tuple[float | None, str, str]
"""Value, loss of lock and strength: None and blanks where there is nothing."""
Epoch = tuple[dt.datetime, Mapping[str, Sequence[Cell]]]
START = dt.datetime(2024, 3, 5, 10, 0, 0)


def line(content: str, label: str) -> str:
    return f"{content:<60}{label}\n"


def header_3(
    codes: Mapping[str, Sequence[str]],
    *,
    version: str = "3.05",
    system: str = "M",
    scale: str = "GPS",
    extra: str = "",
) -> str:
    out = line(f"{version:>9}{'':11}{'OBSERVATION DATA':<20}{system}", "RINEX VERSION / TYPE")
    out += line("SITE", "MARKER NAME")
    for letter, names in codes.items():
        out += code_lines(letter, names)
    out += line(f"{'  2024     3     5    10     0    0.0000000':<48}{scale}", "TIME OF FIRST OBS")
    return out + extra + line("", "END OF HEADER")


def code_lines(letter: str, names: Sequence[str]) -> str:
    out = ""
    for first in range(0, len(names), 13):
        start = f"{letter}  {len(names):3d}" if first == 0 else " " * 6
        out += line(start + "".join(f" {n}" for n in names[first : first + 13]),
                    "SYS / # / OBS TYPES")  # fmt: skip
    return out


def cell(item: Cell) -> str:
    value, lock, strength = item
    number = " " * 14 if value is None else f"{value:14.3f}"
    return f"{number}{lock or ' '}{strength or ' '}"


def epoch_line(time: dt.datetime, count: int, flag: int = 0) -> str:
    seconds = f"{time.second:3d}.{time.microsecond * 10:07d}"
    return f"> {time:%Y %m %d %H %M}{seconds}  {flag}{count:3d}\n"


def epoch_3(epoch: Epoch, flag: int = 0, *, trim: bool = True) -> str:
    time, satellites = epoch
    out = epoch_line(time, len(satellites), flag)
    for name, cells in satellites.items():
        text = name + "".join(map(cell, cells))
        out += (text.rstrip() if trim else text) + "\n"
    return out


def ranges(k: int, names: Sequence[str] = ("G05", "G12", "S36"), codes: int = 4) -> Epoch:
    """Epoch k at 1 Hz, every value another one."""
    return (
        START + dt.timedelta(seconds=k),
        {
            name: [
                (
                    2.1e7 + 1000 * k + 10 * i + c + 0.125 * (c + 1),
                    "1" if c == 1 else "",
                    str((c + 4) % 10),
                )
                for c in range(codes)
            ]
            for i, name in enumerate(names)
        },
    )


CODES = {"G": ("C1C", "L1C", "D1C", "S1C"), "S": ("C1C", "L1C", "D1C", "S1C")}


def small_file(epochs: int = 5) -> str:
    return header_3(CODES) + "".join(epoch_3(ranges(k)) for k in range(epochs))


def header_2(types: Sequence[str], system: str = "M", scale: str = "GPS") -> str:
    out = line(f"{'2.11':>9}{'':11}{'OBSERVATION DATA':<20}{system}", "RINEX VERSION / TYPE")
    out += line("SITE", "MARKER NAME")
    for first in range(0, len(types), 9):
        start = f"{len(types):6d}" if first == 0 else " " * 6
        out += line(start + "".join(f"    {t}" for t in types[first : first + 9]),
                    "# / TYPES OF OBSERV")  # fmt: skip
    out += line(f"{'  2024     3     5    10     0    0.0000000':<48}{scale}", "TIME OF FIRST OBS")
    return out + line("", "END OF HEADER")


def epoch_2(epoch: Epoch, flag: int = 0) -> str:
    time, satellites = epoch
    names = list(satellites)
    seconds = f"{time.second:3d}.{time.microsecond * 10:07d}"
    out = f" {time:%y} {time.month:2d} {time.day:2d} {time.hour:2d} {time.minute:2d}{seconds}"
    out += f"  {flag}{len(names):3d}"
    for first in range(0, max(len(names), 1), 12):
        out += (" " * 32 if first else "") + "".join(names[first : first + 12]) + "\n"
    for cells in satellites.values():
        for first in range(0, len(cells), 5):
            out += "".join(map(cell, cells[first : first + 5])).rstrip() + "\n"
    return out


def nav_header(version: str, kind: str = "N", system: str = "G", extra: str = "") -> str:
    names = {"N": "NAVIGATION DATA", "H": "H: GEO NAV MSG DATA"}
    out = line(f"{version:>9}{'':11}{names.get(kind, kind):<20}{system}", "RINEX VERSION / TYPE")
    return out + extra + line("", "END OF HEADER")


def number(value: float | None, width: int = 19, exponent: str = "D") -> str:
    if value is None:
        return " " * width
    return f"{value:{width}.12E}".replace("E", exponent)


def kepler_numbers(
    *, toe: float = 208800.0, iode: float = 45.0, sent: float | None = 201618.0, fit: float = 4.0
) -> list[float | None]:
    """Numbers of a plausible record in the order of RINEX, all different."""
    return [
        -1.5e-4, 2.5e-12, 0.0, iode, -21.5, 4.2e-9, 1.25, -1.1e-6, 0.0125, 9.5e-6,
        5153.65, toe, 1.5e-7, -2.25, -8.5e-8, 0.965, 215.5, 0.75, -8.1e-9, 3.5e-10,
        1.0, 2304.0, 0.0, 2.0, 0.0, -1.1e-8, iode, sent, fit,
    ]  # fmt: skip


def geo_numbers(health: float = 0.0) -> list[float | None]:
    return [1.5e-8, 9e-13, 208770.0, 30000.5, 0.001, 1.25e-7, health, 29000.25, -0.002, -2.5e-7,
            2.0, 12.125, 0.003, 5e-8, 77.0]  # fmt: skip


def record(
    head: str,
    numbers: Sequence[float | None],
    *,
    indent: int,
    width: int = 19,
    exponent: str = "D",
    trim: bool = True,
) -> str:
    rows = [numbers[:3], *(numbers[i : i + 4] for i in range(3, len(numbers), 4))]
    out = ""
    for k, row in enumerate(rows):
        text = (" " * indent if k else head) + "".join(number(v, width, exponent) for v in row)
        out += (text.rstrip() if trim else text) + "\n"
    return out


def head_3(satellite: str, time: dt.datetime = START) -> str:
    return f"{satellite} {time:%Y %m %d %H %M %S}"


def head_2(satellite: int, time: dt.datetime = START) -> str:
    calendar = f"{time:%y} {time.month:2d} {time.day:2d} {time.hour:2d} {time.minute:2d}"
    return f"{satellite:2d} {calendar}{time.second:5.1f}"
