"""Ginan's `.SPP`: single point positions with SBAS protection levels.

23 fields: time, decimal year, X Y Z, HDOP VDOP GDOP, three dashes, latitude longitude height,
four differences or dashes, HPL VPL, three dashes. Positions are taken from X Y Z: latitude,
longitude and height are those of the a-priori position in earlier versions. Source: `writeSPP`
and `estimateSBASProtLvl` in src/cpp/sbas/sbas.cpp of Ginan.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.delimited.column_map import word_findings
from sbas.logs.format import Format, Match, Progress
from sbas.logs.sentinels import remove_sentinels, sentinel_findings
from sbas.logs.text_input import (
    TextBlocks,
    bad_line_finding,
    collapse_blanks,
    decode_head,
    parse_lines,
    plain_blanks,
    side_by_side,
)
from sbas.logs.time_stamps import Stamps, concatenate, parse_stamps, stamps_to_gps
from sbas.recording import (
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    mode_categories,
    with_columns,
)

FIELDS = (
    "time", "year", "x", "y", "z", "hdop", "vdop", "gdop", "dash1", "dash2", "dash3",
    "lat_deg", "lon_deg", "height_m", "dn", "de", "du", "dh", "hpl_m", "vpl_m",
    "dash4", "dash5", "dash6",
)  # fmt: skip
"""The fields of a record, in order."""

_WANTED = ("x", "y", "z", "hdop", "vdop", "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m")
_DASHES = tuple(name for name in FIELDS if name.startswith("dash"))
_NEEDED = ("x", "y", "z")
_K_V = 5.33
_POSITION_DOUBT_M = 0.01
_HEADER = re.compile(r"^\*YYYY-MM-DDTHH:MM:SS", re.MULTILINE)
_RECORD = re.compile(
    r"^ *\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d+ +\d{4}\.\d+(?: +-?\d+\.\d+){3}(?: +\S+){3} +- +- +-"
    r"(?: +-?\d+\.\d+){3}(?: +\S+){4}(?: +\S+){2} +- +- +-",
    re.MULTILINE,
)


@dataclass(frozen=True)
class _Part:
    stamps: Stamps
    values: dict[str, NDArray[np.float64]]
    bad_lines: int
    example: str
    words: dict[str, int]


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of a Ginan `.SPP` file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.

    Raises
    ------
    InputError : no whole record.
    """
    blocks = TextBlocks(path, progress)
    parts = list(side_by_side(_block, blocks))
    if blocks.unfinished.strip():
        # Every record begins with a line end, so the last one has none; its dashes end it.
        parts.append(_block(blocks.unfinished.rstrip(b"\n") + b"\n"))
    bad = sum(part.bad_lines for part in parts) + blocks.nul_lines
    example = next((part.example for part in parts if part.example), "")
    stamps = concatenate([part.stamps for part in parts])
    if not len(stamps.ns):
        raise InputError(
            "no record of the .SPP file can be read"
            if bad
            else "the file has a header and no data",
            code="E10" if bad else "E15",
            where=str(path),
            evidence=example or f"{path.stat().st_size:,} bytes",
            cure="run Ginan again, and look whether it found a position",
        )
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in _WANTED}
    times, _, _ = stamps_to_gps(stamps, "GPST")
    table, keep, findings = _columns(values)
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(times[keep], name="time"))
    lost = int(np.count_nonzero(~keep))
    meta = RecordingMeta(
        frame="",
        pl=ProtectionLevelMeta(kind="unknown", k_v=_K_V),
        findings=(
            *blocks.findings(),
            *bad_line_finding(
                bad + lost, len(frame), example or "record whose two positions differ"
            ),
            *_word_findings(parts),
            *findings,
            *_meaning_findings(),
        ),
    )
    return Recording(frame if columns is None else with_columns(frame, columns), meta)


def _word_findings(parts: Sequence[_Part]) -> tuple[Finding, ...]:
    counts = {name: sum(part.words[name] for part in parts) for name in _WANTED}
    return word_findings({name: number for name, number in counts.items() if number})


def _block(block: bytes) -> _Part:
    if b"*" in block:
        lines = block.splitlines(keepends=True)
        block = b"".join(line for line in lines if not line.lstrip().startswith(b"*YYYY"))
    fields = parse_lines(
        collapse_blanks(plain_blanks(block)),
        FIELDS,
        texts=("time", *_DASHES),
        wanted=("time", *_WANTED, *_DASHES),
        delimiter=" ",
    )
    stamps = parse_stamps(fields.texts["time"])
    good = stamps.readable & ~stamps.leap & ~stamps.zoned
    for name in _DASHES:
        good &= np.asarray(fields.texts[name].to_numpy(zero_copy_only=False) == "-", bool)
    for wrong in fields.unreadable.values():
        good &= ~wrong
    for name in _NEEDED:
        good &= ~np.isnan(fields.numbers[name])
    for name in _WANTED:
        good &= ~np.isinf(fields.numbers[name])
    bad, example = fields.bad_lines, fields.first_bad
    if not good.all():
        bad += int(np.count_nonzero(~good))
        at = int(np.argmin(good))
        example = example or f"record of {fields.texts['time'][at]}: a field is not as it should be"
    values = {name: fields.numbers[name][good] for name in _WANTED}
    words = {name: int(np.count_nonzero(np.isnan(array))) for name, array in values.items()}
    return _Part(stamps[good], values, bad, example, words)


def _columns(
    values: dict[str, NDArray[np.float64]],
) -> tuple[dict[str, Any], NDArray[np.bool_], tuple[Finding, ...]]:
    """Documented columns, which records to keep, and what was found."""
    lat, lon, height = pymap3d.ecef2geodetic(values["x"], values["y"], values["z"], deg=True)
    apart = _distance_m(values, np.asarray(lat), np.asarray(lon), np.asarray(height))
    differing = apart > _POSITION_DOUBT_M
    keep = np.ones(len(apart), bool)
    findings: tuple[Finding, ...] = ()
    if np.mean(differing) > 0.5:
        findings = (_other_position(apart[differing], len(apart)),)
    else:
        keep = ~differing
    raw = {
        "lat_deg": np.asarray(lat),
        "lon_deg": np.asarray(lon),
        "height_m": np.asarray(height),
        **{name: values[name] for name in ("hpl_m", "vpl_m", "hdop", "vdop")},
    }
    flags = np.zeros(len(apart), np.uint32)
    counts: dict[str, dict[str, int]] = {}
    for name in ("hpl_m", "vpl_m", "hdop", "vdop"):
        none = raw[name] <= 0
        if none[keep].any():
            counts[name] = {"0 or less (not computed)": int(np.count_nonzero(none[keep]))}
        raw[name] = np.where(none, np.nan, raw[name])
        if name in ("hpl_m", "vpl_m"):
            flags[none] |= np.uint32(Flag.PL_SENTINEL)
    with_level = ~np.isnan(raw["hpl_m"])
    raw, flags = {name: array[keep] for name, array in raw.items()}, flags[keep]
    removed, flags = remove_sentinels(raw, flags)
    for name, found in removed.items():
        counts[name] = {**counts.get(name, {}), **found}
    table: dict[str, Any] = dict(raw)
    table["mode"] = mode_categories(np.where(with_level[keep], MODES.index("sbas"), -1))
    table["flags"] = flags
    return table, keep, (*sentinel_findings(counts), *findings)


def _distance_m(
    values: dict[str, NDArray[np.float64]],
    lat: NDArray[np.float64],
    lon: NDArray[np.float64],
    height: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(n,) distances of the geodetic positions of the file from those of X Y Z; 0 where it has
    none."""
    x, y, z = pymap3d.geodetic2ecef(
        values["lat_deg"].clip(-90, 90), values["lon_deg"], values["height_m"], deg=True
    )
    apart = np.sqrt((x - values["x"]) ** 2 + (y - values["y"]) ** 2 + (z - values["z"]) ** 2)
    result: NDArray[np.float64] = np.where(np.isnan(apart), 0.0, apart)
    return result


def _other_position(apart_m: NDArray[np.float64], rows: int) -> Finding:
    return Finding(
        "E25",
        "warning",
        "latitude, longitude and height are not those of X Y Z but, as earlier versions of Ginan "
        "write them, of the a-priori position; positions were taken from X Y Z",
        evidence=f"{len(apart_m):,} of {rows:,} records, median distance "
        f"{np.median(apart_m):.3f} m",
        cure="nothing to do; the a-priori position may serve as --truth where it was surveyed",
    )


def _meaning_findings() -> tuple[Finding, ...]:
    return (
        Finding(
            "E25",
            "info",
            "the file states no time scale: taken as GPS time, which Ginan keeps inside",
            where="field 1",
            cure="compare an epoch with the observations",
        ),
        Finding(
            "E23",
            "info",
            "the file does not say for which operation its levels are: K_H is 6.00 in precision "
            "approach and 6.18 else, by Ginan's configuration, of one frequency or two",
            where="HPL",
            cure="look up prec_approach and freq in the sbas_inputs of the run",
        ),
    )


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 for Ginan's header, or for a whole record."""
    text = decode_head(head).replace("\r", "")
    if _HEADER.search(text):
        return Match(95, "header of Ginan's .SPP")
    if _RECORD.search(text):
        return Match(95, "record of Ginan's .SPP")
    return Match(0, "no header or record of Ginan's .SPP")


FORMAT = Format(
    name="ginan_spp",
    extensions=(".spp",),
    description="Ginan single point positions with SBAS protection levels",
    sniff=sniff,
    read=read,
)
