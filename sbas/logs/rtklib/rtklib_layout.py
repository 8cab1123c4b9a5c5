"""What the header lines of an RTKLIB solution file say about its rows."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from sbas.exceptions import InputError

_METRES = (
    "height", "x-ecef", "y-ecef", "z-ecef", "hpl", "vpl",
    "sdn", "sde", "sdu", "sdne", "sdeu", "sdun",
    "sdx", "sdy", "sdz", "sdxy", "sdyz", "sdzx",
)  # fmt: skip
_SPEEDS = ("vn", "ve", "vu", "vx", "vy", "vz")
_SPEED_SIGMAS = ("sdvn", "sdve", "sdvu", "sdvne", "sdveu", "sdvun",
                 "sdvx", "sdvy", "sdvz", "sdvxy", "sdvyz", "sdvzx")  # fmt: skip
_ANGLES = ("latitude(deg)", "longitude(deg)", "latitude(d'\")", "longitude(d'\")")
KNOWN = frozenset((
    *_ANGLES, "Q", "ns", "age(s)", "ratio", *(f"{name}(m)" for name in _METRES),
    *(f"{name}(m/s)" for name in _SPEEDS), *_SPEED_SIGMAS,
    *(f"{name}(m/s)" for name in _SPEED_SIGMAS),
))  # fmt: skip
"""Every column that RTKLIB and rtklib_ws write, with its unit. Source: outhead in solution.c."""

COLUMN_HEADER = re.compile(
    r"^%\s+(GPST|UTC|JST)\s*([,;\t|]?)\s*"
    r"((?:latitude\((?:deg|d'\")\)|x-ecef\(m\)|e-baseline\(m\)).*?)\s*$",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Layout:
    """What the header of a file says.

    Parameters
    ----------
    scale : GPST, UTC or JST.
    separator : character between fields; a blank stands for any number of them.
    names : one name a field behind the time, d m s spread over three.
    datum, height : words of the frame line, "" where it is absent.
    header : the line that names the columns.
    by_week : times are week and seconds of week.
    """

    scale: str
    separator: str
    names: tuple[str, ...]
    datum: str
    height: str
    header: str
    by_week: bool = False

    @property
    def fields(self) -> tuple[str, ...]:
        return (("week", "tow") if self.by_week else ("date", "clock")) + self.names


def header_text(found: re.Match[str]) -> str:
    """The line that names the columns, blanks made one, for comparison."""
    return " ".join(found[0].split())


def parse_header(text: str, *, where: str) -> Layout:
    """Layout of a file from its first lines.

    Raises
    ------
    InputError : no line that names the columns, a baseline instead of positions, a name or unit
        that is not known, or no position or mode.
    """
    found = COLUMN_HEADER.search(text)
    if found is None:
        raise InputError(
            "no header line names the columns of the .pos file",
            where=where,
            evidence=text[:80],
            cure="write the solution again with its header (RTKLIB option out-outhead=on)",
        )
    scale, separator, columns = found.groups()
    if "e-baseline" in columns:
        raise InputError(
            "the file holds baselines to a base station, not positions",
            where=where,
            evidence=columns[:60],
            cure="write positions instead (RTKLIB option out-solformat=llh)",
        )
    listed = columns.replace(separator or " ", " ").replace(" (m)", "(m)").split()
    if unknown := [name for name in listed if name not in KNOWN]:
        near = difflib.get_close_matches(unknown[0], KNOWN, n=1)
        raise InputError(
            f"the header of the .pos file names unknown columns: {', '.join(unknown)}",
            where=where,
            evidence=found[0].strip(),
            cure=(f"did you mean {near[0]!r}? " if near else "")
            + f"Known are {', '.join(sorted(KNOWN))}",
        )
    names: list[str] = []
    for name in listed:
        if name in ("latitude(d'\")", "longitude(d'\")"):
            names += [f"{name[:3]}_{part}" for part in ("d", "m", "s")]
        else:
            names.append(name.partition("(")[0])
    frame = re.search(r"^%\s*\(lat/lon/height=(\w+)/(\w+)", text, re.MULTILINE)
    datum, height = frame.groups() if frame else ("", "")
    if "x-ecef" in names:
        ecef = re.search(r"^%\s*\(x/y/z-ecef=(\w+)", text, re.MULTILINE)
        datum, height = (ecef[1] if ecef else ""), "ellipsoidal"
    if len(set(names)) < len(names):
        raise InputError(
            "two columns of the .pos file have one name",
            where=where,
            evidence=columns,
            cure="rename the wrong one in the header line, or write the solution again",
        )
    position = ("x-ecef", "y-ecef", "z-ecef") if "x-ecef" in names else ("lon", "height")
    lacking = [n for n in (*position, "Q") if not any(name.startswith(n) for name in names)]
    if lacking:
        raise InputError(
            f"the header of the .pos file lacks {', '.join(lacking)}",
            where=where,
            evidence=found[0].strip(),
            cure="write the solution again with all its columns",
        )
    return Layout(scale, separator or " ", tuple(names), datum, height, header_text(found))


def fit_rows(layout: Layout, row: Sequence[str]) -> Layout:
    """The layout as the first data row shows it: dates or weeks, and rtklib_ws's ECEF rows."""
    names = layout.names
    if "x-ecef" in names and len(row) == len(names) + 4:
        # rtklib_ws writes age, ratio, hpl, vpl into ECEF rows, whichever pair its header names.
        names = (*names[:11], "age", "ratio", "hpl", "vpl", *names[13:])
    by_week = "/" not in row[0] and "-" not in row[0]
    return replace(layout, names=names, by_week=by_week)
