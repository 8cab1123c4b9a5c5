"""RTKLIB solution files (`.pos`), plain and with the protection levels of rtklib_ws.

Layout by header: latitude and longitude in degrees or d m s, or ECEF; dates or week and
seconds; GPST, UTC or JST; heights ellipsoidal or geodetic (above the geoid). rtklib_ws writes
`hpl (m) vpl (m)` in place of `age(s) ratio`, and in its ECEF rows behind them though its header
says otherwise: there the number of fields decides. Source: solution.c of RTKLIB and rtklib_ws.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.column_map import (
    ellipsoidal,
    geoid_unused,
    pl_outside_sbas,
)
from sbas.logs.format import Format, Match, Progress
from sbas.logs.rtklib_layout import COLUMN_HEADER, Layout, fit_rows, header_text, parse_header
from sbas.logs.sentinels import sentinel_findings
from sbas.logs.text_input import (
    TextBlocks,
    bad_line_finding,
    collapse_blanks,
    decode_head,
    parse_lines,
    plain_blanks,
    side_by_side,
)
from sbas.logs.time_stamps import (
    Stamps,
    concatenate,
    parse_date_and_clock,
    stamps_to_gps,
    week_stamps,
)
from sbas.recording import (
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    major_semi_axis_m,
    mode_categories,
    with_columns,
)

FloatArray = NDArray[np.float64]

_MODE_OF_Q = {1: "rtk", 2: "rtk", 3: "sbas", 4: "dgnss", 5: "standalone", 0: "none"}
_DEAD_RECKONING_Q = 7
_K_H = {"6.00": 6.00, "6.18": 6.18}
_K_V = {"5.33": 5.33}
_HPL_ROUNDING_M = 0.005
_VPL_ROUNDING_M = 0.05
_SIGMA_ROUNDING_M = 0.00005


@dataclass(frozen=True)
class _Part:
    stamps: Stamps
    values: dict[str, FloatArray]
    bad_lines: int
    example: str


@dataclass(frozen=True)
class _LineReader:
    layout: Layout
    wanted: tuple[str, ...]
    where: str

    def block(self, block: bytes) -> _Part:
        """Numbers of one block of lines; a line with any unreadable field is left out."""
        block = self._without_headers(block)
        block = collapse_blanks(plain_blanks(block, self.layout.separator))
        time_names = self.layout.fields[:2]
        fields = parse_lines(
            block,
            self.layout.fields,
            texts=() if self.layout.by_week else time_names,
            wanted=(*time_names, *self.wanted),
            delimiter=" ",
        )
        if self.layout.by_week:
            stamps = week_stamps(fields.numbers["week"], fields.numbers["tow"])
        else:
            stamps = parse_date_and_clock(fields.texts["date"], fields.texts["clock"])
        good = stamps.readable
        if self.layout.scale == "GPST":
            good = good & ~stamps.leap
        for wrong in fields.unreadable.values():
            good = good & ~wrong
        values = {name: fields.numbers[name] for name in self.wanted}
        bad, example = fields.bad_lines, fields.first_bad
        if not good.all():
            bad += int(np.count_nonzero(~good))
            example = example or "a field is no number, or the time is none"
            stamps = stamps[good]
            values = {name: array[good] for name, array in values.items()}
        return _Part(stamps, values, bad, example)

    def _without_headers(self, block: bytes) -> bytes:
        if b"%" not in block:
            return block
        lines = block.splitlines(keepends=True)
        for line in lines:
            found = line.startswith(b"%") and COLUMN_HEADER.match(line.decode("utf-8"))
            if found and header_text(found) != self.layout.header:
                raise InputError(
                    "the file holds solutions of two layouts",
                    where=self.where,
                    evidence=f"{self.layout.header!r} and {header_text(found)!r}",
                    cure="split it at the second header and read the parts one by one",
                )
        return b"".join(line for line in lines if not line.startswith(b"%"))


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    geoid: float | None = None,
) -> Recording:
    """Recording of an RTKLIB solution file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.
    geoid : undulation [m] where the heights are geodetic (above the geoid).

    Raises
    ------
    InputError : no column header, baselines instead of positions, two layouts in one file, no
        row of data.
    """
    where = str(path)
    blocks = TextBlocks(path, progress)
    stream = iter(blocks)
    head = b""
    first_row = None
    for block in stream:
        head += block
        first_row = next((s for s in _rows(head) if s), None)
        if first_row is not None:
            break
    layout = parse_header(head.decode("utf-8", "replace"), where=where)
    if first_row is None:
        raise InputError(
            "the file has a header and no data",
            code="E15",
            where=where,
            evidence=f"{path.stat().st_size:,} bytes",
            cure="the solution found no fix: check its observations and options",
        )
    separator = None if layout.separator == " " else layout.separator
    text = first_row.replace(separator, " ") if separator else first_row
    layout = fit_rows(layout, text.split())
    reader = _LineReader(layout, layout.names, where)
    parts = list(side_by_side(reader.block, chain((head,), stream)))
    return _joined(parts, reader, blocks, columns, geoid)


def _rows(head: bytes) -> Iterable[str]:
    return (
        line.decode("utf-8", "replace").strip()
        for line in head.splitlines()
        if not line.startswith(b"%") and line.strip()
    )


def _joined(
    parts: Sequence[_Part],
    reader: _LineReader,
    blocks: TextBlocks,
    columns: Sequence[str] | None,
    geoid: float | None,
) -> Recording:
    layout = reader.layout
    stamps = concatenate([part.stamps for part in parts])
    # RTKLIB ends every line: a last line without its end was cut, and its last number with it.
    cut = bool(blocks.unfinished.strip())
    bad = sum(part.bad_lines for part in parts) + cut + blocks.nul_lines
    example = next((part.example for part in parts if part.example), "")
    if cut and not example:
        example = (
            f"last line without line end: {blocks.unfinished[-60:].decode('utf-8', 'replace')}"
        )
    if not len(stamps.ns):
        raise InputError(
            "no line of the .pos file can be read",
            where=reader.where,
            evidence=example,
            cure="the lines do not fit the header line: write the solution again",
        )
    values = {name: np.concatenate([p.values[name] for p in parts]) for name in reader.wanted}
    times, leap_seconds, conversions = stamps_to_gps(stamps, layout.scale)
    table, findings = _epoch_columns(values, len(times), layout, geoid)
    pl = _protection_level_meta(table)
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(times, name="time"))
    meta = RecordingMeta(
        time_scale=layout.scale,
        leap_seconds=leap_seconds,
        frame=layout.datum,
        geoid="" if geoid is None or layout.height != "geodetic" else f"{geoid:g} m as given",
        pl=pl,
        findings=(
            *blocks.findings(),
            *bad_line_finding(bad, len(times), example),
            *conversions,
            *findings,
        ),
    )
    return Recording(frame if columns is None else with_columns(frame, columns), meta)


def _epoch_columns(
    values: dict[str, FloatArray], rows: int, layout: Layout, geoid: float | None
) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Documented columns of the fields of a file."""
    findings: list[Finding] = []
    table: dict[str, Any] = {}
    if "x-ecef" in values:
        lat, lon, height = pymap3d.ecef2geodetic(
            *(values[f"{axis}-ecef"] for axis in "xyz"), deg=True
        )
        table |= {"lat_deg": np.asarray(lat), "lon_deg": np.asarray(lon)}
        table["height_m"] = np.asarray(height)
        table |= _sigmas_from_ecef(values, table["lat_deg"], table["lon_deg"])
    else:
        table["lat_deg"], table["lon_deg"] = _angle(values, "lat"), _angle(values, "lon")
        table["height_m"] = values["height"]
        for axis in ("e", "n", "u"):
            if f"sd{axis}" in values:
                table[f"sigma_{axis}_m"] = values[f"sd{axis}"]
        if "sdne" in values:
            table["cov_en_m2"] = np.copysign(values["sdne"] ** 2, values["sdne"])
    if layout.height == "geodetic":
        table["height_m"], more = ellipsoidal(table["height_m"], geoid)
        findings += more
    elif geoid is not None:
        findings.append(geoid_unused())
    if not layout.height:
        findings.append(
            Finding(
                "E25",
                "warning",
                "no header line says what heights refer to; taken as ellipsoidal",
                cure="write the solution again with its header (RTKLIB option out-outhead=on)",
            )
        )
    table |= _velocities(values, table["lat_deg"], table["lon_deg"])
    if "age" in values:
        table["correction_age_s"] = values["age"]
    flags = np.zeros(rows, np.uint32)
    if "ns" in values:
        table["n_sv"] = (
            np.where(np.isnan(values["ns"]), -1, values["ns"]).clip(-1, 999).astype("i2")
        )
    if "Q" in values:
        quality = np.where(np.isnan(values["Q"]), -1, values["Q"]).clip(-1, 99).astype(np.int64)
        codes = np.full(rows, MODES.index("other"))
        for number, mode in _MODE_OF_Q.items():
            codes[quality == number] = MODES.index(mode)
        codes[quality < 0] = -1
        table["mode"] = mode_categories(codes)
        flags[quality == _DEAD_RECKONING_Q] |= np.uint32(Flag.DEAD_RECKONING)
    counts: dict[str, dict[str, int]] = {}
    for source, name in (("hpl", "hpl_m"), ("vpl", "vpl_m")):
        if source in values:
            absent = values[source] == 0
            counts[name] = {"0 (not computed)": int(np.count_nonzero(absent))}
            table[name] = np.where(absent, np.nan, values[source])
            flags[absent] |= np.uint32(Flag.PL_SENTINEL)
    for name, array in table.items():
        if getattr(array, "dtype", None) == np.float64 and (broken := ~np.isfinite(array)).any():
            infinite = int(np.count_nonzero(np.isinf(array)))
            counts.setdefault(name, {})["infinite"] = infinite
            if infinite:
                table[name] = np.where(broken, np.nan, array)
    words = {n: {"NaN": int(np.count_nonzero(np.isnan(v)))} for n, v in values.items()}
    findings += sentinel_findings({**counts, **words})
    if "mode" in table:
        flags |= pl_outside_sbas(table)
    table["flags"] = flags
    return table, tuple(findings)


def _angle(values: dict[str, FloatArray], stem: str) -> FloatArray:
    """(n,) degrees; of d m s the sign is that of the degrees, of "-0" too."""
    whole = {"lat": "latitude", "lon": "longitude"}[stem]
    if whole in values:
        return values[whole]
    degrees, minutes, seconds = (values[f"{stem}_{part}"] for part in ("d", "m", "s"))
    return np.copysign(np.abs(degrees) + minutes / 60 + seconds / 3600, degrees)


def _east_north_up(lat_deg: FloatArray, lon_deg: FloatArray) -> FloatArray:
    """(n, 3, 3) unit vectors east, north, up (rows) in ECEF."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    s, c, sl, cl = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(lat)
    rows = [[-sl, cl, zero], [-s * cl, -s * sl, c], [c * cl, c * sl, s]]
    return np.moveaxis(np.array(rows), 2, 0)


def _sigmas_from_ecef(
    values: dict[str, FloatArray], lat_deg: FloatArray, lon_deg: FloatArray
) -> dict[str, FloatArray]:
    """Sigmas east, north, up and their covariance from those of x, y, z (signed roots)."""
    names = ("sdx", "sdy", "sdz", "sdxy", "sdyz", "sdzx")
    if any(name not in values for name in names):
        return {}
    xx, yy, zz, xy, yz, zx = (np.copysign(values[n] ** 2, values[n]) for n in names)
    ecef = np.moveaxis(np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]), 2, 0)
    turn = _east_north_up(lat_deg, lon_deg)
    local = turn @ ecef @ np.swapaxes(turn, 1, 2)
    # Four decimals can leave a variance below zero where the true one is almost none: unknown.
    variances = [np.where(local[:, i, i] > 0, local[:, i, i], np.nan) for i in range(3)]
    return {
        **{f"sigma_{axis}_m": np.sqrt(v) for axis, v in zip("enu", variances, strict=True)},
        "cov_en_m2": np.ascontiguousarray(local[:, 0, 1]),
    }


def _velocities(
    values: dict[str, FloatArray], lat_deg: FloatArray, lon_deg: FloatArray
) -> dict[str, FloatArray]:
    if all(f"v{axis}" in values for axis in "enu"):
        east, north, up = (values[f"v{axis}"] for axis in "enu")
    elif all(f"v{axis}" in values for axis in "xyz"):
        ecef = np.stack([values[f"v{axis}"] for axis in "xyz"], axis=1)
        east, north, up = np.einsum("nij,nj->in", _east_north_up(lat_deg, lon_deg), ecef)
    else:
        return {}
    return {
        "vel_e_mps": east,
        "vel_n_mps": north,
        "vel_u_mps": up,
        "speed_mps": np.hypot(east, north),
    }


def _protection_level_meta(table: dict[str, Any]) -> ProtectionLevelMeta:
    """Kind and K factors, told from the ratio of the levels to the sigmas beside them.

    A level of DO-229 is K d_major (horizontal) and K sigma_u (vertical), K_H 6.00 (NPA: 6.18),
    K_V 5.33; the ratio holds on every epoch within the rounding of the file, or it is not told.
    Source: RTCA DO-229D, J.1.
    """
    if "hpl_m" not in table or "sigma_e_m" not in table or "mode" not in table:
        return ProtectionLevelMeta()
    nothing = np.full(len(table["hpl_m"]), np.nan)
    d_major = major_semi_axis_m(
        table["sigma_e_m"], table["sigma_n_m"], table.get("cov_en_m2", nothing)
    )
    k_h = _factor(table["hpl_m"], d_major, _K_H.values(), _HPL_ROUNDING_M, 4 * _SIGMA_ROUNDING_M)
    k_v = _factor(
        table.get("vpl_m", nothing),
        table["sigma_u_m"],
        _K_V.values(),
        _VPL_ROUNDING_M,
        _SIGMA_ROUNDING_M,
    )
    with_level = ~np.isnan(table["hpl_m"])
    all_sbas = bool(np.all(table["mode"].codes[with_level] == MODES.index("sbas")))
    known = all_sbas and k_h is not None
    return ProtectionLevelMeta(kind="do229" if known else "unknown", k_h=k_h, k_v=k_v)


def _factor(
    level: FloatArray,
    sigma: FloatArray,
    candidates: Iterable[float],
    level_rounding: float,
    sigma_rounding: float,
) -> float | None:
    """The one candidate K with |level - K sigma| within rounding on every epoch, or None."""
    known = np.isfinite(level) & np.isfinite(sigma)
    if not known.any():
        return None
    fitting = [
        k
        for k in candidates
        if np.all(
            np.abs(level[known] - k * sigma[known]) <= 1.01 * (level_rounding + k * sigma_rounding)
        )
    ]
    return fitting[0] if len(fitting) == 1 else None


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 for the `%` line that names RTKLIB's columns."""
    found = COLUMN_HEADER.search(decode_head(head).replace("\r", ""))
    if found is None:
        return Match(0, "no header of RTKLIB")
    return Match(95, f"RTKLIB header with {found[3].split()[0]}")


FORMAT = Format(
    name="rtklib_pos",
    extensions=(".pos",),
    description="RTKLIB solution, with or without the protection levels of rtklib_ws",
    sniff=sniff,
    read=read,
)
