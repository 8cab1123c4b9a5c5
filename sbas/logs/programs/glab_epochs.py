"""Columns of the epoch table from gLAB's OUTPUT and SBASOUT lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.delimited.column_map import pl_outside_sbas
from sbas.logs.programs.glab_lines import Rows
from sbas.logs.sentinels import remove_sentinels, sentinel_findings
from sbas.recording import MODES, Flag, mode_categories

FIX, LEVELS = "OUTPUT", "SBASOUT"
SBAS_L1, SBAS_DFMC = 5, 6
_MODE_OF_PROCESSING = {0: "standalone", 1: "other", 5: "sbas", 6: "sbas", 7: "dgnss"}
MODE_OF_WORD = {"PA": "sbas_pa", "NPA": "sbas_npa"}
_ZERO_IS_NONE = ("hpl_m", "vpl_m", "hdop", "vdop", "pdop")
_GEO = (120, 158)


def by_row(values: NDArray[np.float64], row: NDArray[np.int64], missing: float) -> Any:
    """(n,) values of rows; the missing value where the row is -1."""
    return np.append(values, missing)[row]


def epoch_columns(
    rows: Mapping[str, Rows], of_fix: NDArray[np.int64], of_levels: NDArray[np.int64]
) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Documented columns, and what was made missing or is lacking.

    Parameters
    ----------
    rows : lines by message.
    of_fix, of_levels : (n,) rows of each epoch in OUTPUT and SBASOUT, -1 where it has none.
    """
    count = len(of_fix)
    flags = np.zeros(count, np.uint32)
    raw: dict[str, NDArray[np.float64]] = {}
    codes = np.full(count, -1)
    counts = _nan_words(rows)
    if FIX in rows:
        n = rows[FIX].numbers
        raw |= {name: by_row(n[name], of_fix, np.nan) for name in (
            "lat_deg", "lon_deg", "height_m", "pdop", "hdop", "vdop", "n_sv")}  # fmt: skip
        processing = by_row(n["processing"], of_fix, np.nan)
        codes[of_fix >= 0] = MODES.index("other")
        for number, mode in _MODE_OF_PROCESSING.items():
            codes[processing == number] = MODES.index(mode)
        nowhere = by_row((n["x"] == 0) & (n["y"] == 0) & (n["z"] == 0), of_fix, 0.0) != 0
        flags[nowhere] |= np.uint32(Flag.POSITION_SENTINEL)
        if nowhere.any():
            counts["position"] = {"(0, 0, 0) in ECEF": int(np.count_nonzero(nowhere))}
        for name in ("lat_deg", "lon_deg", "height_m"):
            raw[name] = np.where(nowhere, np.nan, raw[name])
    out_of_range = 0
    if LEVELS in rows:
        n = rows[LEVELS].numbers
        raw |= {name: by_row(n[name], of_levels, np.nan) for name in (
            "hpl_m", "vpl_m", "x_hal_m", "x_val_m", "n_sv_tracked")}  # fmt: skip
        in_levels = by_row(n["n_sv"], of_levels, np.nan)
        raw["n_sv"] = np.where(of_levels >= 0, in_levels, raw.get("n_sv", in_levels))
        geo = by_row(n["geo_prn"], of_levels, np.nan)
        strange = ~np.isnan(geo) & (geo != 0) & ~((geo >= _GEO[0]) & (geo <= _GEO[1]))
        out_of_range = int(np.count_nonzero(strange))
        flags[strange] |= np.uint32(Flag.OUT_OF_RANGE)
        raw["geo_prn"] = np.where(strange, np.nan, geo)
        codes = np.where(of_levels >= 0, _mode_codes(rows[LEVELS], of_levels), codes)
    for name, found in _zeros_removed(raw, flags).items():
        counts[name] = {**counts.get(name, {}), **found}
    removed, flags = remove_sentinels(raw, flags)
    for name, found in removed.items():
        counts[name] = {**counts.get(name, {}), **found}
    if FIX in rows and LEVELS in rows:
        flags[(of_fix < 0) | (of_levels < 0)] |= np.uint32(Flag.EPOCH_INCOMPLETE)
    table: dict[str, Any] = {}
    for name, values in raw.items():
        if name in ("n_sv", "n_sv_tracked", "geo_prn"):
            table[name] = np.where(np.isnan(values), -1, values).clip(-1, 999).astype(np.int16)
        else:
            table[name] = values
    table["mode"] = mode_categories(codes)
    table["flags"] = flags | pl_outside_sbas(table)
    return table, (*sentinel_findings(counts), *_epoch_findings(
        rows, int(np.count_nonzero(of_fix < 0)), int(np.count_nonzero(of_levels < 0)),
        out_of_range))  # fmt: skip


def _mode_codes(levels: Rows, of_levels: NDArray[np.int64]) -> NDArray[np.int64]:
    words = levels.texts["mode"].dictionary_encode()
    of_word = [MODES.index(MODE_OF_WORD[word]) for word in words.dictionary.to_pylist()]
    codes = np.array(of_word, np.int64)[words.indices.to_numpy(zero_copy_only=False)]
    sbas = np.isin(levels.numbers["processing"], (SBAS_L1, SBAS_DFMC))
    codes = np.where(sbas, codes, MODES.index("other"))
    picked: NDArray[np.int64] = np.append(codes, -1)[of_levels]
    return picked


def _nan_words(rows: Mapping[str, Rows]) -> dict[str, dict[str, int]]:
    """How often a number of a solution is a word such as nan, by column."""
    counts: dict[str, dict[str, int]] = {}
    for message in (FIX, LEVELS):
        for name, values in rows[message].numbers.items() if message in rows else ():
            if number := int(np.count_nonzero(np.isnan(values))):
                counts[f"{message} {name}"] = {"NaN": number}
    return counts


def _zeros_removed(
    raw: dict[str, NDArray[np.float64]], flags: NDArray[np.uint32]
) -> dict[str, dict[str, int]]:
    """Levels and dilutions of 0, which stand for "not computed", made NaN; counts by column."""
    counts: dict[str, dict[str, int]] = {}
    for name in _ZERO_IS_NONE:
        if name in raw and (zero := raw[name] == 0).any():
            counts[name] = {"0 (not computed)": int(np.count_nonzero(zero))}
            raw[name] = np.where(zero, np.nan, raw[name])
            if name in ("hpl_m", "vpl_m"):
                flags[zero] |= np.uint32(Flag.PL_SENTINEL)
    return counts


def _epoch_findings(
    rows: Mapping[str, Rows], without_fix: int, without_levels: int, out_of_range: int
) -> tuple[Finding, ...]:
    findings = []
    if LEVELS in rows and FIX not in rows:
        findings.append(
            Finding(
                "E25",
                "warning",
                "the file has no OUTPUT lines: its epochs have protection levels and no position",
                evidence=f"{without_fix:,} epochs",
                cure="run gLAB with -print:output",
            )
        )
    elif LEVELS in rows and (without_fix or without_levels):
        findings.append(
            Finding(
                "E10",
                "warning",
                "epochs with one of OUTPUT and SBASOUT only",
                evidence=f"{without_fix:,} without OUTPUT, {without_levels:,} without SBASOUT",
                cure="they are flagged; look whether lines were lost",
            )
        )
    if out_of_range:
        findings.append(
            Finding(
                "E10",
                "warning",
                "numbers of SBAS satellites outside 120..158 were made missing",
                evidence=f"{out_of_range:,} epochs",
                cure="look at field 11 of SBASOUT",
            )
        )
    return tuple(findings)
