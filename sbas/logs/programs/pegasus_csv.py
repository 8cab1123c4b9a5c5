"""Tables in the manner of Eurocontrol's PEGASUS: `;`, one line an epoch, truth beside the fix.

The header names RX_TOM, RX_WEEK, NSV_LOCK, NSV_USED, NS_LAT, NS_LON, NS_ALT, NS_VE, NS_VN, NS_VU,
NS_HPL, NS_VPL, REF_LAT, REF_LON, REF_ALT, in any order and any subset. Source: headers and units
(seconds, degrees, metres, metres per second) in public scripts that read such tables.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.delimited.column_map import convert_columns, word_findings
from sbas.logs.format import Format, Match, Progress
from sbas.logs.text_input import (
    BAD_SHARE,
    Fields,
    TextBlocks,
    bad_line_finding,
    decode_head,
    parse_lines,
    parse_numbers,
    side_by_side,
)
from sbas.logs.time_stamps import stamps_to_gps, week_stamps
from sbas.recording import Recording, RecordingMeta, with_columns

HEADERS = {
    "RX_TOM": "tow", "RX_WEEK": "week", "NSV_LOCK": "n_sv_tracked", "NSV_USED": "n_sv",
    "NS_LAT": "lat_deg", "NS_LON": "lon_deg", "NS_ALT": "height_m",
    "NS_VE": "vel_e_mps", "NS_VN": "vel_n_mps", "NS_VU": "vel_u_mps",
    "NS_HPL": "hpl_m", "NS_VPL": "vpl_m",
    "REF_LAT": "x_ref_lat_deg", "REF_LON": "x_ref_lon_deg", "REF_ALT": "x_ref_height_m",
}  # fmt: skip
"""Column of each header."""

_TIME = ("week", "tow")
_REFERENCE = {"x_ref_lat_deg": "lat_deg", "x_ref_lon_deg": "lon_deg", "x_ref_height_m": "height_m"}
_DELIMITER = ";"
_COMMA_NUMBER = re.compile(rb"(?:^|;)[ \t]*[+-]?\d+,\d+[ \t]*(?:;|\r?$)", re.MULTILINE)


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of a PEGASUS-style table.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.

    Returns
    -------
    Recording with the reference as `x_ref_lat_deg`, `x_ref_lon_deg`, `x_ref_height_m`; see
    `reference_trajectory`. Columns without a known header are kept as `x_` and their name.

    Raises
    ------
    InputError : no header with RX_TOM and RX_WEEK, or no line of data.
    """
    where = str(path)
    blocks = TextBlocks(path, progress)
    stream = iter(blocks)
    first = next(stream, b"")
    header, _, rest = first.partition(b"\n")
    reader = _LineReader(
        tuple(_column_names(header.decode("utf-8"), where)),
        header.strip(),
        _decimal_sign(rest),
        where,
    )
    parts = list(side_by_side(reader.block, chain((rest,), stream)))
    return _joined(parts, reader, blocks, columns)


def reference_trajectory(recording: Recording) -> pd.DataFrame:
    """The reference of a PEGASUS-style table as a truth, for `sbas.truth.Trajectory`.

    Parameters
    ----------
    recording : as `read` returns it.

    Returns
    -------
    Columns `lat_deg`, `lon_deg`, `height_m`, index `time`; epochs without a reference left out,
    of repeated and earlier times the first kept.

    Raises
    ------
    InputError : the recording has no reference.
    """
    absent = [name for name in _REFERENCE if name not in recording.table]
    if absent:
        raise InputError(
            "the recording has no reference positions",
            evidence=f"no {', '.join(absent)}",
            cure="read a table with REF_LAT, REF_LON and REF_ALT, with all its columns",
        )
    table = recording.table[list(_REFERENCE)].rename(columns=_REFERENCE).dropna()
    table = table[((table["lat_deg"] != 0) | (table["lon_deg"] != 0)).to_numpy()]
    lat, lon = table["lat_deg"].abs(), table["lon_deg"].abs()
    if len(table) and lat.max() <= np.pi / 2 and lon.max() <= np.pi:
        raise InputError(
            "the reference looks like radians",
            code="E03",
            evidence=f"latitudes to {lat.max():g}, longitudes to {lon.max():g}",
            cure="write REF_LAT and REF_LON in degrees",
        )
    if (lat > 90).any() or (lon > 360).any():
        raise InputError(
            "the reference is not on Earth",
            code="E08",
            evidence=f"latitudes to {lat.max():g}, longitudes to {lon.max():g}",
            cure="write REF_LAT and REF_LON in degrees",
        )
    times = table.index.to_numpy().astype(np.int64)
    forward = np.ones(len(times), bool)
    forward[1:] = times[1:] > np.maximum.accumulate(times)[:-1]
    return table[forward]


def _column_names(header: str, where: str) -> list[str]:
    """Column of each field of the header."""
    words = [word.strip().strip('"') for word in header.lstrip("\ufeff").strip().split(_DELIMITER)]
    if len(words) > 1 and not words[-1]:
        words[-1] = "x_"
    names: list[str] = []
    for word in words:
        name = HEADERS.get(word.upper())
        if name is None:
            name = word if word.startswith("x_") else f"x_{word.lower() or 'field'}"
        if name in names:
            raise InputError(
                f"two columns of the table mean {name}",
                where=where,
                evidence=header.strip()[:300],
                cure="take one of them out",
            )
        names.append(name)
    if not set(_TIME) <= set(names):
        raise InputError(
            "the header has no RX_TOM or no RX_WEEK",
            where=where,
            evidence=header.strip()[:300],
            cure=f"name the columns {';'.join(HEADERS)}, or use --format delimited_text",
        )
    return names


def _decimal_sign(rest: bytes) -> str:
    """Comma where a number of the first lines has one."""
    return "," if _COMMA_NUMBER.search(rest[: 1 << 16]) else "."


class _LineReader(NamedTuple):
    """What every block of a file is read with."""

    names: tuple[str, ...]
    header: bytes
    decimal: str
    where: str

    @property
    def texts(self) -> tuple[str, ...]:
        """Columns that this format does not know, and that need not be numbers."""
        return tuple(n for n in self.names if n.startswith("x_") and n not in _REFERENCE)

    def block(self, block: bytes) -> Fields:
        if self.header in block:
            lines = block.splitlines(keepends=True)
            block = b"".join(line for line in lines if line.strip() != self.header)
        fields = parse_lines(
            block,
            self.names,
            texts=self.texts,
            wanted=self.names,
            delimiter=_DELIMITER,
            decimal=self.decimal,
        )
        if fields.other_decimal:
            raise InputError(
                "decimal comma and decimal point in one file",
                code="E20",
                where=self.where,
                evidence=f"{fields.other_decimal!r}, though the decimal sign of the file is "
                f"{self.decimal!r}",
                cure="write all numbers with a decimal point, or all with a comma",
            )
        return fields


def _joined(
    parts: Sequence[Fields],
    reader: _LineReader,
    blocks: TextBlocks,
    columns: Sequence[str] | None,
) -> Recording:
    measured = [name for name in reader.names if name not in reader.texts]
    numbers = {name: np.concatenate([part.numbers[name] for part in parts]) for name in measured}
    stamps = week_stamps(numbers["week"], numbers["tow"])
    good = stamps.readable
    bad = sum(p.bad_lines for p in parts) + blocks.nul_lines + int(np.count_nonzero(~good))
    example = next((p.first_bad for p in parts if p.first_bad), "")
    if not good.all() and not example:
        at = int(np.argmin(good))
        example = f"RX_WEEK {numbers['week'][at]:g}, RX_TOM {numbers['tow'][at]:g}"
    if blocks.unfinished.strip():
        # Whether its last number was cut cannot be told.
        bad += 1
        shown = blocks.unfinished[-60:].decode("utf-8", "replace")
        example = example or f"last line without line end: {shown}"
    rows = int(np.count_nonzero(good))
    if not rows:
        raise InputError(
            "no line of the table has a readable time" if bad else "the table has no line",
            code="E10" if bad else "E15",
            where=reader.where,
            evidence=example,
            cure="RX_TOM is taken as seconds of week, 0 to 604800, and RX_WEEK as GPS week"
            if bad
            else "check that the table was written",
        )
    times, _, _ = stamps_to_gps(stamps[good], "GPST")
    values = {name: numbers[name][good] for name in measured if name not in _TIME}
    if {"vel_e_mps", "vel_n_mps"} <= set(values):
        values["speed_mps"] = np.hypot(values["vel_e_mps"], values["vel_n_mps"])
    texts = {}
    for name in reader.texts:
        words = pa.chunked_array([part.texts[name] for part in parts]).combine_chunks()
        read, wrong, _ = parse_numbers(words, reader.decimal)
        if wrong.any():
            texts[name] = words.filter(pa.array(good))
        else:
            values[name] = read[good]
    table, findings = convert_columns(values, texts, rows=rows, factors={}, where=reader.where)
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(times, name="time"))
    unreadable = _summed(
        {n: int(np.count_nonzero(v)) for n, v in p.unreadable.items()} for p in parts
    )
    meta = RecordingMeta(
        findings=(
            *blocks.findings(),
            *bad_line_finding(bad, rows, example),
            *_unreadable_finding(unreadable, rows),
            *word_findings(_summed(p.words for p in parts)),
            *findings,
            *_meaning_findings(numbers["tow"][good], frame, reader.decimal),
        ),
    )
    return Recording(frame if columns is None else with_columns(frame, columns), meta)


def _summed(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    """Counts by column, times apart: a line without time is counted as such."""
    total: dict[str, int] = {}
    for count in counts:
        for name, number in count.items():
            if name not in _TIME:
                total[name] = total.get(name, 0) + number
    return total


def _unreadable_finding(counts: Mapping[str, int], rows: int) -> tuple[Finding, ...]:
    shown = ", ".join(f"{name} {number:,}" for name, number in counts.items() if number)
    if not shown:
        return ()
    return (
        Finding(
            "E10",
            "error" if max(counts.values()) > BAD_SHARE * rows else "warning",
            "fields that are no numbers were made missing",
            evidence=shown,
            cure="correct the fields",
        ),
    )


def _meaning_findings(
    tow_s: NDArray[np.float64], frame: pd.DataFrame, decimal: str
) -> tuple[Finding, ...]:
    findings = [
        Finding(
            "E25",
            "warning",
            "no description of this table is public: RX_TOM is taken as seconds of the GPS week, "
            "angles as degrees, heights as ellipsoidal",
            where="RX_TOM, NS_LAT, NS_ALT",
            evidence=f"RX_TOM {tow_s.min():.10g} .. {tow_s.max():.10g}",
            cure="compare a few epochs with another source of the same receiver",
        )
    ]
    if "hpl_m" not in frame:
        findings.append(
            Finding(
                "E25",
                "warning",
                "no column NS_HPL: every epoch counts as without protection level",
                evidence=f"{len(frame):,} epochs",
                cure="write the table with NS_HPL and NS_VPL",
            )
        )
    if set(_REFERENCE) <= set(frame.columns):
        known = int(frame[list(_REFERENCE)].notna().all(axis=1).sum())
        findings.append(
            Finding(
                "E25",
                "info",
                "the table holds reference positions, which are no truth unless asked for",
                where="REF_LAT, REF_LON, REF_ALT",
                evidence=f"{known:,} of {len(frame):,} epochs",
                cure="truth = sbas.truth.Trajectory("
                "sbas.logs.programs.pegasus_csv.reference_trajectory(recording))",
            )
        )
    if decimal == ",":
        findings.append(
            Finding(
                "E20",
                "warning",
                "commas in numbers were read as decimal commas",
                evidence=f"fields are separated by {_DELIMITER!r}",
                cure="write numbers with a decimal point",
            )
        )
    return tuple(findings)


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """90 for a header with RX_TOM and RX_WEEK between semicolons."""
    first = decode_head(head).lstrip("\ufeff").partition("\n")[0]
    words = {word.strip().strip('"').upper() for word in first.split(_DELIMITER)}
    if {"RX_TOM", "RX_WEEK"} <= words:
        return Match(90, f"header with RX_TOM and RX_WEEK, {len(words & set(HEADERS))} known names")
    return Match(0, "no header with RX_TOM and RX_WEEK")


FORMAT = Format(
    name="pegasus_csv",
    extensions=(".b10", ".csv"),
    description="PEGASUS-style table: positions, protection levels and reference, `;` between",
    sniff=sniff,
    read=read,
)
