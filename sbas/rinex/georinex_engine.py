"""Observations read by the library georinex: a second opinion on versions 2 and 3."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.rinex.observation_header import parse_types
from sbas.rinex.observations import ObservationHeader, Observations, SystemObservations
from sbas.timescales import NS_PER_S, to_gps

_EPOCH_2 = re.compile(
    r"^ ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)([ \d]{3}\.\d{7})  [016]", re.MULTILINE
)
_NEAR_NS = 2000
"""Stamps of fractions of a second come out up to a microsecond early."""


def read_by_georinex(
    data: bytes,
    header: ObservationHeader,
    *,
    systems: Collection[str] | None,
    codes: Collection[str] | None,
    where: str,
    stamps: NDArray[np.datetime64] | None = None,
) -> Observations:
    """Observations of a plain RINEX text, one system after the other.

    Loss of lock comes from the fields of L1 and L2 only, as the library does it.

    Parameters
    ----------
    data : the whole text.
    header : its header, by our own reader.
    stamps : (n,) GPS times of the epochs, to undo the library's rounding; read here if absent.

    Raises
    ------
    InputError : georinex cannot read it.
    """
    import georinex  # heavy, and rarely needed
    import xarray

    text = data.decode("latin-1")
    if stamps is None:
        stamps = to_gps(_stamps_2(text), header.time_scale)  # type: ignore[arg-type]
    found: dict[str, SystemObservations] = {}
    version_2 = header.version < 3
    types = _types_2(header, text) if version_2 else {s: {c: c for c in header.codes[s]}
                                                     for s in header.codes}  # fmt: skip
    present = set(re.findall(r"^([A-Z])[ \d]\d", text[text.find("END OF HEADER") :], re.MULTILINE))
    for letter, names in types.items():
        wanted = [old for old, new in names.items() if codes is None or new in codes]
        absent = (systems is not None and letter not in systems) or not wanted
        if absent or not (version_2 or letter in present):
            continue
        try:
            # The library relies on defaults that xarray is about to change.
            options: Any = xarray.set_options
            with warnings.catch_warnings(), options(use_new_combine_kwarg_defaults=False):
                warnings.simplefilter("ignore")
                table = georinex.rinexobs(
                    io.StringIO(text), use={letter}, meas=wanted, useindicators=True, fast=False
                )
        except Exception as error:  # whatever the library raises
            raise InputError(
                "georinex cannot read the observations",
                code="E10",
                where=where,
                evidence=f"{type(error).__name__}: {error}"[:200],
                cure='engine="native"',
            ) from error
        part = _arrays(table, letter, {old: names[old] for old in wanted}, header, stamps)
        if part is not None:
            found[letter] = part
    finding = Finding("E26", "info", "observations were read by georinex", where=where)
    return Observations(header, found, (finding,))


def _types_2(header: ObservationHeader, text: str) -> dict[str, dict[str, str]]:
    """Names of version 2 and those of version 3, by system."""
    top = text[: text.find("END OF HEADER")].replace("\r", "").split("\n")
    types = parse_types(top, where="")
    return {s: dict(zip(types, names, strict=True)) for s, names in header.codes.items()}


def _stamps_2(text: str) -> NDArray[np.datetime64]:
    times = []
    for match in _EPOCH_2.finditer(text):
        year, month, day, hour, minute = (int(part) for part in match.groups()[:5])
        seconds, fraction = match[6].split(".")
        year += 1900 if year >= 80 else 2000
        whole = f"{year}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}"
        try:
            start = np.datetime64(whole, "ns")
        except ValueError:
            continue
        nanoseconds = int(seconds) * NS_PER_S + int(fraction) * 100
        times.append(start + np.timedelta64(nanoseconds, "ns"))
    return np.array(times, "M8[ns]")


def _arrays(
    table: Any,
    letter: str,
    names: dict[str, str],
    header: ObservationHeader,
    stamps: NDArray[np.datetime64],
) -> SystemObservations | None:
    satellites = [str(sv) for sv in table.sv.values]
    columns = np.array([i for i, name in enumerate(satellites) if name[0] == letter], np.int64)
    columns = columns[np.argsort([satellites[i] for i in columns])]
    if not columns.size or not table.time.size:
        return None
    time = _as_stamped(
        to_gps(table.time.values.astype("M8[ns]"), header.time_scale),  # type: ignore[arg-type]
        stamps,
    )
    nothing = np.full((time.size, columns.size), np.nan)
    values, locks, strengths = {}, {}, {}
    for old, new in names.items():

        def field(name: str) -> NDArray[np.float64]:
            if name not in table.data_vars:
                return nothing
            array: NDArray[np.float64] = table[name].values[:, columns].astype(float)
            return array

        value = field(old)
        values[new] = np.where(value == 0, np.nan, value) / header.scale.get((letter, new), 1)
        locks[new] = np.nan_to_num(field(f"{old}lli"), nan=-1).astype(np.int8)
        strengths[new] = np.nan_to_num(field(f"{old}ssi"), nan=-1).astype(np.int8)
    return SystemObservations(time, tuple(satellites[i] for i in columns), values, locks, strengths)


def _as_stamped(
    time: NDArray[np.datetime64], stamps: NDArray[np.datetime64]
) -> NDArray[np.datetime64]:
    """Times as the file has them, of times that the library has rounded."""
    if not stamps.size:
        return time
    ordered = np.sort(stamps)
    ns, known = time.astype(np.int64), ordered.astype(np.int64)
    after = np.clip(np.searchsorted(known, ns), 1, known.size - 1) if known.size > 1 else 0
    before = np.maximum(np.asarray(after) - 1, 0)
    near = np.where(np.abs(known[after] - ns) < np.abs(known[before] - ns), after, before)
    return np.where(np.abs(known[near] - ns) <= _NEAR_NS, ordered[near], time)
