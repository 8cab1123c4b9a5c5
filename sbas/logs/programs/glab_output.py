"""Output of gLAB 6: positions of OUTPUT joined with the protection levels of SBASOUT.

Position errors are not read: gLAB forms them against an a-priori position, without which they
are 0.0000. Nor are its formal errors, whose rotation to north, east and up is transposed.
Source: message help of gLAB 6.0.0; core/output.c of gLAB for the rotation.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.format import Format, Match, Progress
from sbas.logs.programs.epoch_join import joined_epochs
from sbas.logs.programs.glab_epochs import FIX, LEVELS, MODE_OF_WORD, SBAS_L1, by_row, epoch_columns
from sbas.logs.programs.glab_levels import protection_level_meta, stated_factors
from sbas.logs.programs.glab_lines import (
    Damage,
    Message,
    Rows,
    join_rows,
    list_items,
    read_rows,
    split_block,
)
from sbas.logs.programs.glab_satellites import (
    SATELLITE_MESSAGES,
    Chosen,
    known_satellites,
    listed_codes,
    satellites_of,
)
from sbas.logs.text_input import (
    TextBlocks,
    bad_line_finding,
    decode_head,
    plain_blanks,
    side_by_side,
)
from sbas.recording import (
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    with_columns,
)
from sbas.satellite_table import SIDE_TABLE
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S, WEEK_S

_MESSAGES = {
    FIX: Message(43, {
        6: "processing", 8: "n_sv", 12: "x", 13: "y", 14: "z", 21: "lat_deg", 22: "lon_deg",
        23: "height_m", 37: "pdop", 39: "hdop", 40: "vdop",
    }),
    LEVELS: Message(25, {
        6: "week", 7: "tow", 9: "processing", 10: "mode", 11: "geo_prn", 16: "hpl_m",
        17: "x_hal_m", 19: "vpl_m", 20: "x_val_m", 23: "n_sv_tracked", 24: "n_sv", 25: "list",
    }, ("mode", "list"), open_ended=True),
    **SATELLITE_MESSAGES,
}  # fmt: skip
_POSITION_DOUBT_M = 0.01
_METRES_PER_DEGREE = 111_320.0
_LINE = re.compile(
    r"^(?:(OUTPUT|SBASOUT|SBASVAR|SBASCORR|SBASIONO|SBASUNSEL|SATSEL|MODEL|SBASDFMC[A-Z]+)\*?"
    r"|[A-Z]{3,16}(?:_USER|_REF)?\*?) +\d{4} +\d{1,3} +\d+\.\d+ +\d\d:\d\d:\d\d\.\d+ .*$",
    re.MULTILINE,
)
_VERSION = re.compile(r"^INFO gLAB version (\S+?),?\s", re.MULTILINE)
_EQUIPMENT = re.compile(
    r"^INFO INPUT (Antenna|GPS Receiver) type:[ \t]*(.*?)[ \t]*(?:\[Unknown\])?$", re.MULTILINE
)


@dataclass(frozen=True)
class _Part:
    """What one block holds."""

    rows: dict[str, Rows]
    chosen: Chosen | None
    info: str
    lines: int
    damage: Damage = field(default_factory=Damage)


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of a gLAB output file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.

    Returns
    -------
    Recording with the alarm limits of the run as `x_hal_m` and `x_val_m`. The side table
    `satellites` holds the lines about single satellites: the terms of the error budget, the
    corrections, and why a satellite was left out.

    Raises
    ------
    InputError : no line of a solution or of a satellite.
    """
    blocks = TextBlocks(path, progress)
    parts = list(side_by_side(_block, blocks))
    first_lines = list(accumulate((part.lines for part in parts), initial=0))[:-1]
    rows = {
        name: joined
        for name in _MESSAGES
        if (joined := join_rows([p.rows.get(name) for p in parts], first_lines)) is not None
    }
    bad = sum(part.damage.lines for part in parts) + blocks.nul_lines
    example = next((part.damage.example for part in parts if part.damage.example), "")
    if blocks.unfinished.strip():
        # gLAB ends every line: a last line without its end was cut, and its last number with it.
        bad += 1
        shown = blocks.unfinished[-60:].decode("utf-8", "replace")
        example = example or f"last line without line end: {shown}"
    kept = sum(map(len, rows.values()))
    if not kept:
        raise InputError(
            "no line of the gLAB output can be read" if bad else "gLAB computed no solution",
            code="E10" if bad else "E15",
            where=str(path),
            evidence=example or f"{sum(part.lines for part in parts):,} lines",
            cure="run gLAB with OUTPUT and SBASOUT printed, and look at its INFO lines",
        )
    chosen_parts = [part.chosen for part in parts if part.chosen is not None]
    chosen = _chosen_of(chosen_parts) if chosen_parts else None
    info = "".join(part.info for part in parts)
    return _recording(
        rows,
        chosen,
        info,
        (*blocks.findings(), *bad_line_finding(bad, kept, example)),
        columns,
    )


def _block(block: bytes) -> _Part:
    damage = Damage()
    split = split_block(plain_blanks(block), (*_MESSAGES, "INFO"), damage)
    rows: dict[str, Rows] = {}
    chosen = None
    for name, message in _MESSAGES.items():
        found = read_rows(split, name, message, damage)
        if found is None:
            continue
        if name == FIX:
            found = _consistent_fixes(found, damage)
        elif name == LEVELS:
            found, chosen = _consistent_levels(found, damage)
        else:
            found = known_satellites(found, name, damage)
        rows[name] = found
    info = split.texts.get("INFO", b"").decode("utf-8")
    told = [m[0] for pattern in (_VERSION, _EQUIPMENT) for m in pattern.finditer(info)]
    told += [line for line in info.splitlines() if line.startswith("INFO MODELLING SBAS K")]
    return _Part(rows, chosen, "".join(f"{line}\n" for line in told), split.count, damage)


def _consistent_fixes(rows: Rows, damage: Damage) -> Rows:
    """The fixes whose two positions, ECEF and geodetic, are the same."""
    n = rows.numbers
    lat, lon, height = pymap3d.ecef2geodetic(n["x"], n["y"], n["z"], deg=True)
    turn = np.abs((lon - n["lon_deg"] + 180) % 360 - 180) * np.cos(np.radians(n["lat_deg"]))
    north = np.abs(lat - n["lat_deg"])
    apart = np.maximum(np.maximum(north, turn) * _METRES_PER_DEGREE, np.abs(height - n["height_m"]))
    nowhere = (n["x"] == 0) & (n["y"] == 0) & (n["z"] == 0)
    good = (apart <= _POSITION_DOUBT_M) | nowhere
    damage.add(int(np.count_nonzero(~good)), "OUTPUT line whose ECEF and geodetic positions differ")
    return rows[good]


def _consistent_levels(rows: Rows, damage: Damage) -> tuple[Rows, Chosen]:
    """The levels whose two times and whose numbers of satellites agree, and their satellites."""
    n = rows.numbers
    by_week = np.rint((n["week"] * WEEK_S + n["tow"]) * 1000)
    by_day = np.rint((rows.time_ns - GPS_EPOCH_NS) / (NS_PER_S // 1000))
    items, of = list_items(rows.texts["list"])
    code, used = listed_codes(items)
    listed = np.bincount(of, minlength=len(rows))
    in_use = np.bincount(of, used, len(rows))
    strange = np.bincount(of, code < 0, len(rows)) > 0
    words = rows.texts["mode"].dictionary_encode()
    known = np.array([word in MODE_OF_WORD for word in words.dictionary.to_pylist()], bool)
    good = (by_week == by_day) & (listed == n["n_sv_tracked"]) & (in_use == n["n_sv"])
    good &= ~strange & known[words.indices.to_numpy(zero_copy_only=False)]
    damage.add(
        int(np.count_nonzero(~good)), "SBASOUT line that contradicts itself (time, satellites)"
    )
    inside = good[of]
    return rows[good], Chosen(rows.time_ns[of[inside]], code[inside], used[inside])


def _chosen_of(parts: Sequence[Chosen]) -> Chosen:
    return Chosen(
        np.concatenate([part.time_ns for part in parts]),
        np.concatenate([part.code for part in parts]),
        np.concatenate([part.used for part in parts]),
    )


def _recording(
    rows: Mapping[str, Rows],
    chosen: Chosen | None,
    info: str,
    damage: tuple[Finding, ...],
    columns: Sequence[str] | None,
) -> Recording:
    none = np.zeros(0, np.int64)
    both = [rows.get(name) for name in (FIX, LEVELS)]
    time_ns, (of_fix, of_levels) = joined_epochs(
        [none if part is None else part.time_ns for part in both],
        [none if part is None else part.line for part in both],
    )
    table, findings = epoch_columns(rows, of_fix, of_levels)
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(time_ns.view("M8[ns]"), name="time"))
    satellites, more = satellites_of(
        {name: part for name, part in rows.items() if name in SATELLITE_MESSAGES}, chosen, time_ns
    )
    findings += more
    pl = ProtectionLevelMeta()
    if LEVELS in rows:
        single = by_row(rows[LEVELS].numbers["processing"], of_levels, np.nan) == SBAS_L1
        if not single[of_levels >= 0].all():
            findings += (_dual_frequency(int(np.count_nonzero(~single[of_levels >= 0]))),)
        else:
            levels = frame.loc[of_levels >= 0, ["hpl_m", "vpl_m", "mode"]]
            pl, more = protection_level_meta(
                levels[~levels.index.duplicated(keep=False)], satellites, stated_factors(info)
            )
            findings += more
    elif FIX in rows:
        findings += (_no_levels(len(frame)),)
    equipment = dict(_EQUIPMENT.findall(info))
    meta = RecordingMeta(
        frame="WGS84",
        antenna=equipment.get("Antenna", ""),
        receiver=equipment.get("GPS Receiver", ""),
        pl=pl,
        findings=(*damage, *findings),
        versions={"gLAB": found[1]} if (found := _VERSION.search(info)) else {},
    )
    sides = {} if satellites is None else {SIDE_TABLE: satellites}
    return Recording(frame if columns is None else with_columns(frame, columns), meta, sides)


def _no_levels(epochs: int) -> Finding:
    return Finding(
        "E25",
        "warning",
        "the file has no SBASOUT lines: every epoch counts as without protection level",
        evidence=f"{epochs:,} epochs",
        cure="process in an SBAS mode of gLAB, with -print:sbasout",
    )


def _dual_frequency(epochs: int) -> Finding:
    return Finding(
        "E23",
        "warning",
        "protection levels of dual-frequency SBAS, which DO-229 does not define",
        evidence=f"{epochs:,} epochs with processing mode 6",
        cure="evaluate them apart from single-frequency levels",
    )


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 for lines of gLAB's messages with the right number of fields."""
    text = decode_head(head).replace("\r", "")
    if _VERSION.search(text):
        return Match(95, "header of gLAB")
    for sample in (text, decode_head(middle).replace("\r", "")):
        for found in _LINE.finditer(sample):
            message = _MESSAGES.get(found[1] or "")
            if message is None:
                continue
            fields = len(found[0].split())
            if fields == message.fields or (message.open_ended and fields > message.fields):
                return Match(95, f"line {found[1]} of gLAB with {fields} fields")
    return Match(0, "no line of gLAB")


FORMAT = Format(
    name="glab_output",
    extensions=(".out", ".glab"),
    description="gLAB 6 output: OUTPUT, SBASOUT and the lines about single satellites",
    sniff=sniff,
    read=read,
)
