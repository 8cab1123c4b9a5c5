"""Observations of several files of one receiver as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.rinex.epoch_records import repeated_finding
from sbas.rinex.observations import Observations, SystemObservations


def joined(parts: Sequence[Observations]) -> Observations:
    """Files by time; of an epoch that several hold, the one of the file named first stays."""
    times = [_time(part) for part in parts]
    time, first = np.unique(np.concatenate(times), return_index=True)
    file_of = np.repeat(np.arange(len(parts)), [t.size for t in times])[first]
    offset = np.cumsum([0, *(t.size for t in times)])
    taken = [first[file_of == i] - offset[i] for i in range(len(parts))]
    rows = [np.flatnonzero(file_of == i) for i in range(len(parts))]
    systems: dict[str, SystemObservations] = {}
    for letter in dict.fromkeys(letter for part in parts for letter in part.systems):
        own = [part.systems.get(letter) for part in parts]
        satellites = sorted({s for p in own if p is not None for s in p.satellites})
        at = {name: i for i, name in enumerate(satellites)}
        columns = [[at[s] for s in p.satellites] if p else [] for p in own]

        def together(
            kind: str, missing: float, dtype: str, own: Any = own, columns: Any = columns,
            width: int = len(satellites),
        ) -> dict[str, NDArray[Any]]:  # fmt: skip
            tables: list[Mapping[str, NDArray[Any]]] = [getattr(p, kind) if p else {} for p in own]
            out = {}
            for code in dict.fromkeys(code for table in tables for code in table):
                array = np.full((time.size, width), missing, dtype)
                for table, to, place, source in zip(tables, rows, columns, taken, strict=True):
                    if code in table:
                        array[np.ix_(to, place)] = table[code][source]
                out[code] = array
            return out

        systems[letter] = SystemObservations(
            time,
            tuple(satellites),
            together("values", np.nan, "f8"),
            together("loss_of_lock", -1, "i1"),
            together("strength", -1, "i1"),
        )
    findings = [finding for part in parts for finding in part.findings]
    repeated = sum(t.size for t in times) - time.size
    if repeated:
        differing = _differing(parts, times, Observations(parts[0].header, systems), time)
        findings.append(repeated_finding(repeated, differing, "several observation files"))
    markers = dict.fromkeys(part.header.marker for part in parts)
    if len(markers) > 1:
        findings.append(
            Finding(
                "E06",
                "error",
                "the observation files are of several markers",
                evidence=", ".join(map(repr, markers)),
                cure="process them apart",
            )
        )
    return Observations(parts[0].header, systems, tuple(findings))


def _time(part: Observations) -> NDArray[np.datetime64]:
    for system in part.systems.values():
        return system.time
    return np.empty(0, "M8[ns]")


def _differing(
    parts: Sequence[Observations],
    times: Sequence[NDArray[np.datetime64]],
    whole: Observations,
    time: NDArray[np.datetime64],
) -> int:
    """Epochs of files whose values are not those that stay."""
    count = 0
    for part, own_time in zip(parts, times, strict=True):
        row = np.searchsorted(time, own_time)
        differs = np.zeros(own_time.size, bool)
        for letter, system in part.systems.items():
            kept = whole.systems[letter]
            columns = np.array([kept.satellites.index(s) for s in system.satellites])
            for code, values in system.values.items():
                stays = kept.values[code][np.ix_(row, columns)]
                differs |= ~((values == stays) | (np.isnan(values) & np.isnan(stays))).all(axis=1)
        count += int(differs.sum())
    return count
