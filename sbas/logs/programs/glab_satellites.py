"""gLAB's lines about single satellites as the side table `satellites`.

Terms of the error budget, corrections, ionospheric grid points and the reason for leaving a
satellite out, under the names that gLAB's message help gives them in words. Satellite positions
are at emission and turned into the earth-fixed frame of reception: in the reference runs their
distance to the receiver is the geometric range beside them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.programs.epoch_join import distinct
from sbas.logs.programs.glab_lines import Damage, Message, Rows, free_text
from sbas.satellite_table import satellite_table

_LOOK = {12: "elevation_deg", 13: "azimuth_deg"}
_SATELLITE = {6: "system", 7: "prn"}
_ECEF = ("x_ecef_m", "y_ecef_m", "z_ecef_m")
_IGP_TERMS = (
    "iodi", "band", "number", "time_of_day_s", "lat_deg", "lon_deg", "give_delay_m",
    "give_variance_m2", "degradation_m", "delay_m", "variance_m2", "weight",
)  # fmt: skip
_SBAS_VARIANCE = {
    **_SATELLITE, **_LOOK, 15: "x_geo_prn", 16: "sigma_m", 17: "sigma_flt_m",
    18: "x_sigma_udre_m", 19: "x_delta_udre", 20: "x_delta_udre_message",
    21: "x_fast_degradation_m", 22: "x_range_rate_degradation_m",
    23: "x_long_term_degradation_m", 24: "x_en_route_degradation_m", 25: "x_root_sum_square_flag",
    26: "sigma_uire_m", 27: "sigma_tropo_m", 28: "sigma_air_m", 29: "x_sigma_noise_m",
    30: "x_sigma_multipath_m", 31: "x_sigma_divergence_m",
}  # fmt: skip
_DFMC_VARIANCE = {
    **_SATELLITE, **_LOOK, 15: "x_geo_prn", 16: "sigma_m", 17: "sigma_flt_m", 18: "x_dfrei",
    19: "x_dfrei_bumped", 20: "x_sigma_dfre_m", 21: "x_delta_dfre",
    22: "x_correction_degradation_m", 23: "x_en_route_degradation_m", 24: "sigma_uire_m",
    25: "sigma_tropo_m", 26: "sigma_air_m", 27: "x_sigma_noise_m", 28: "x_sigma_multipath_m",
    29: "x_sigma_divergence_m",
}  # fmt: skip
_SBAS_CORRECTION = {
    **_SATELLITE, **_LOOK, 15: "x_geo_prn", 16: "x_prefit_m", 17: "x_code_m",
    18: "x_smoothed_code_m", 19: "x_geometric_range_m", 20: "x_relativity_m",
    21: "x_satellite_clock_m", 22: "x_group_delay_m", 23: "x_pierce_point_lat_deg",
    24: "x_pierce_point_lon_deg", 25: "x_ionosphere_delay_m", 26: "x_troposphere_delay_m",
    27: "x_fast_correction_m", 28: "x_range_rate_correction_m",
    29: "x_fast_degradation_factor_mps2", 30: "x_fast_timeout_s", 31: "x_range_rate_timeout_s",
    32: "x_fast_time_of_day_s", 33: "x_udre_time_of_day_s", 34: "x_degradation_time_of_day_s",
    35: _ECEF[0], 36: _ECEF[1], 37: _ECEF[2], 38: "x_long_term_dx_m", 39: "x_long_term_dy_m",
    40: "x_long_term_dz_m", 41: "x_long_term_clock_m", 42: "x_fast_iodp", 43: "x_iodf",
    44: "x_fast_slot", 45: "x_long_term_iodp", 46: "x_long_term_slot", 47: "x_iode",
    48: "x_iods", 49: "x_covariance_iodp", 50: "x_covariance_slot", 51: "x_ionosphere_model",
}  # fmt: skip
_IONOSPHERE = {
    **_SATELLITE, 8: "elevation_deg", 9: "azimuth_deg", 11: "x_geo_prn",
    12: "x_pierce_point_lat_deg", 13: "x_pierce_point_lon_deg", 14: "x_interpolation",
    **{
        15 + 12 * vertex + i: f"x_igp_{place}_{term}"
        for vertex, place in enumerate(("ne", "nw", "sw", "se"))
        for i, term in enumerate(_IGP_TERMS)
    },
    63: "x_obliquity", 64: "x_slant_delay_m", 65: "x_slant_sigma_m",
}  # fmt: skip

SATELLITE_MESSAGES: dict[str, Message] = {
    # The later a message stands here, the more its elevation, azimuth and reason count.
    "MODEL": Message(
        50,
        {**_SATELLITE, **_LOOK, 21: _ECEF[0], 22: _ECEF[1], 23: _ECEF[2], 49: "x_snr_dbhz"},
        ("system",),
        open_ended=True,
    ),
    "SATSEL": Message(
        9,
        {**_SATELLITE, 8: "x_selection_code", 9: "reason"},
        ("system", "reason"),
        open_ended=True,
    ),
    **{
        name: Message(
            11,
            {**_SATELLITE, 9: "x_geo_prn", 10: "x_unselected_code", 11: "reason"},
            ("system", "reason"),
            open_ended=True,
        )
        for name in ("SBASUNSEL", "SBASDFMCUNSEL")
    },
    "SBASIONO": Message(65, _IONOSPHERE, ("system",)),
    "SBASCORR": Message(51, _SBAS_CORRECTION, ("system",)),
    "SBASDFMCVAR": Message(36, _DFMC_VARIANCE, ("system",)),
    "SBASVAR": Message(31, _SBAS_VARIANCE, ("system",)),
}
"""Messages with one line a satellite, and the column of each field."""

_LETTERS = {
    "GPS": "G", "GAL": "E", "GLO": "R", "GEO": "S", "BDS": "C", "QZS": "J", "QZSS": "J",
    "IRN": "I", "IRNSS": "I",
}  # fmt: skip
_SYSTEMS = "GERSCJI"
_STRIDE = 128
_SBAS_OFFSET = 100
_STAND_INS = {"x_iode": 999.0, "x_snr_dbhz": 999.0}
"""gLAB's own words for "none": no broadcast message, no signal to noise ratio."""


@dataclass(frozen=True)
class Chosen:
    """What the solutions say of satellites: (n,) times, satellite codes, and whether in use."""

    time_ns: NDArray[np.int64]
    code: NDArray[np.int64]
    used: NDArray[np.bool_]


def satellite_codes(system: Any, prn: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) codes of satellites from gLAB's words for systems and numbers; -1 for no satellite."""
    words = system.dictionary_encode()
    letters = [_LETTERS.get(word, "") for word in words.dictionary.to_pylist()]
    of_word = np.array([_SYSTEMS.index(letter) if letter else -1 for letter in letters], np.int64)
    return _codes(of_word[words.indices.to_numpy(zero_copy_only=False)], prn)


def listed_codes(items: Any) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Codes of (n,) texts such as `+G23` or `-S120`, -1 for others, and which have a plus."""
    words = items.dictionary_encode()
    system, prn, used = [], [], []
    # One step a different word, of which there are as many as satellites.
    for word in words.dictionary.to_pylist():
        sign, letter, number = word[:1], word[1:2], word[2:]
        whole = sign in "+-" and letter and letter in _SYSTEMS and number.isdecimal()
        system.append(_SYSTEMS.index(letter) if whole else -1)
        prn.append(float(number) if whole else 0.0)
        used.append(sign == "+")
    at = words.indices.to_numpy(zero_copy_only=False)
    codes = _codes(np.array(system, np.int64), np.array(prn, np.float64))
    return codes[at], np.array(used, bool)[at]


def _codes(system: NDArray[np.int64], prn: NDArray[np.float64]) -> NDArray[np.int64]:
    is_sbas = (system == _SYSTEMS.index("S")) & (prn >= _SBAS_OFFSET)
    number = np.where(is_sbas, prn - _SBAS_OFFSET, prn)
    good = (system >= 0) & (number >= 1) & (number < 100) & (number == np.floor(number))
    return np.where(good, system * _STRIDE + np.where(good, number, 0).astype(np.int64), -1)


def satellite_name(code: int) -> str:
    """RINEX 3 name of a satellite code."""
    return f"{_SYSTEMS[code // _STRIDE]}{code % _STRIDE:02d}"


def known_satellites(rows: Rows, name: str, damage: Damage) -> Rows:
    """The lines whose satellite is one; others are counted."""
    good = satellite_codes(rows.texts["system"], rows.numbers["prn"]) >= 0
    damage.add(int(np.count_nonzero(~good)), f"{name} line of no satellite")
    return rows[good]


def satellites_of(
    rows: Mapping[str, Rows], chosen: Chosen | None, solved_ns: NDArray[np.int64]
) -> tuple[pd.DataFrame | None, tuple[Finding, ...]]:
    """The satellite table, one row a time and satellite, by time.

    Parameters
    ----------
    rows : lines by message of `SATELLITE_MESSAGES`.
    chosen : satellites that the solutions list; None where the file lists none.
    solved_ns : times of all solutions.

    Returns
    -------
    Table, None where the file says nothing about satellites; findings: lines that gLAB computed
    again within an epoch, of which the last stands, and satellites of epochs without a solution.
    """
    kept = {name: part for name, part in rows.items() if len(part)}
    codes = {
        name: satellite_codes(part.texts["system"], part.numbers["prn"])
        for name, part in kept.items()
    }
    times = [part.time_ns for part in kept.values()]
    if chosen is not None:
        times.append(chosen.time_ns)
    if not sum(map(len, times)):
        return None, ()
    epochs, of_row = np.unique(np.concatenate(times), return_inverse=True)
    pieces = np.split(of_row, np.cumsum([len(t) for t in times])[:-1])
    width = len(_SYSTEMS) * _STRIDE
    keys = {n: at * width + codes[n] for n, at in zip(kept, pieces, strict=False)}
    listed = pieces[-1] * width + chosen.code if chosen is not None else np.zeros(0, np.int64)
    every = distinct(np.concatenate([*keys.values(), listed]))
    time_ns = epochs[every // width]
    columns: dict[str, Any] = {}
    reasons = np.full(len(every), -1, np.int64)
    used = np.zeros(len(every), bool)
    repeated = 0
    words, word_of = _encoded_reasons(kept)
    for name, part in kept.items():
        last = _last_lines(keys[name], part)
        repeated += len(part) - len(last)
        at = np.searchsorted(every, keys[name][last])
        for column, values in part.numbers.items():
            if column != "prn":
                filled = columns.setdefault(column, np.full(len(every), np.nan))
                filled[at] = values[last]
        if name in word_of:
            said = word_of[name][last]
            reasons[at[said >= 0]] = said[said >= 0]
        if chosen is None and name in ("SBASVAR", "SBASDFMCVAR"):
            used[at] = ~part.starred[last]
    if chosen is not None:
        # Of two runs of one time, the one that used the satellite: it was in a solution.
        np.logical_or.at(used, np.searchsorted(every, listed), chosen.used)
    reasons[used] = -1
    finished, stand_ins = _finished(columns)
    solved = np.isin(time_ns, solved_ns)
    table = satellite_table(
        time_ns.view("M8[ns]"),
        {
            "satellite": _categories(every % width),
            **finished,
            "used": used,
            "reason": pd.Categorical.from_codes(reasons, words),
            "x_epoch_solved": solved,
        },
    )
    unsolved = int(np.count_nonzero(~solved))
    return table, _findings(repeated, unsolved, len(table), stand_ins)


def _last_lines(key: NDArray[np.int64], part: Rows) -> NDArray[np.int64]:
    """Of each key, the last line without a star, or the last of all where all have one."""
    order = np.lexsort((part.line, ~part.starred, key))
    ordered = key[order]
    last: NDArray[np.int64] = order[np.append(ordered[1:] != ordered[:-1], True)]
    return last


def _encoded_reasons(rows: Mapping[str, Rows]) -> tuple[list[str], dict[str, NDArray[np.int64]]]:
    """Different reasons, and by message the (n,) index of each line's; -1 where it was selected."""
    having = {name: part for name, part in rows.items() if "reason" in part.texts and len(part)}
    if not having:
        return [], {}
    texts = pa.chunked_array([free_text(part.texts["reason"]) for part in having.values()])
    encoded = texts.combine_chunks().dictionary_encode()
    if isinstance(encoded, pa.ChunkedArray):
        encoded = encoded.combine_chunks()
    index = encoded.indices.to_numpy(zero_copy_only=False).astype(np.int64)
    pieces = np.split(index, np.cumsum([len(part) for part in having.values()])[:-1])
    word_of = {}
    for (name, part), piece in zip(having.items(), pieces, strict=True):
        selected = part.numbers.get("x_selection_code")
        word_of[name] = piece if selected is None else np.where(selected == 0, -1, piece)
    words = encoded.dictionary.to_pylist()
    present = distinct(np.concatenate(list(word_of.values())))
    present = present[present >= 0]
    place = np.full(len(words) + 1, -1)
    place[present] = np.arange(len(present))
    return [words[i] for i in present], {name: place[p] for name, p in word_of.items()}


def _finished(
    columns: Mapping[str, NDArray[np.float64]],
) -> tuple[dict[str, NDArray[np.float64]], dict[str, int]]:
    """Columns with azimuths of 0..360 and without stand-ins, and how many of those there were."""
    finished = dict(columns)
    counts = {}
    if "azimuth_deg" in finished:
        finished["azimuth_deg"] = finished["azimuth_deg"] % 360.0
    for name, stand_in in _STAND_INS.items():
        if name in finished:
            missing = finished[name] == stand_in
            counts[name] = int(np.count_nonzero(missing))
            finished[name] = np.where(missing, np.nan, finished[name])
    return finished, counts


def _categories(code: NDArray[np.int64]) -> pd.Categorical:
    present, index = np.unique(code, return_inverse=True)
    return pd.Categorical.from_codes(index, [satellite_name(c) for c in present.tolist()])


def _findings(
    repeated: int, unsolved: int, rows: int, stand_ins: Mapping[str, int]
) -> tuple[Finding, ...]:
    findings = []
    if shown := ", ".join(f"{name}: {n:,} x 999" for name, n in stand_ins.items() if n):
        findings.append(
            Finding(
                "E07",
                "info",
                "numbers that stand for 'none' were made missing",
                where="side table satellites",
                evidence=shown,
            )
        )
    if repeated:
        findings.append(
            Finding(
                "E26",
                "info",
                "gLAB wrote lines of one satellite and epoch again, as it iterates from an unknown "
                "position or gives several reasons; the last stands",
                where="side table satellites",
                evidence=f"{repeated:,} earlier lines left out",
            )
        )
    if unsolved:
        findings.append(
            Finding(
                "E25",
                "info",
                "satellites of epochs without a solution: their elevation and error budget rest on "
                "a provisional position (x_epoch_solved is False)",
                where="side table satellites",
                evidence=f"{unsolved:,} of {rows:,} rows",
            )
        )
    return tuple(findings)
