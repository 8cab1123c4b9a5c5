"""Lines of whole epochs to arrays over epochs and satellites, one system at a time."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.rinex.epoch_records import WholeEpochs
from sbas.rinex.observation_fields import FIELD, NUMBER, number_otherwise, parse_fields
from sbas.rinex.observation_header import SYSTEMS
from sbas.rinex.observation_lines import Ints, Lines
from sbas.rinex.observations import ObservationHeader, Observations, SystemObservations

FIELDS_AT_ONCE = 8192
"""Some fifty arrays of so many words stay in a processor's cache."""
MOST_TIMES, FREE_BYTES = 100, 1 << 30
"""Arrays may be so many times the text above so many bytes: many empty epochs beside one of all
satellites would make much of little."""
_BYTES_PER_VALUE = 10
_MOST_UNREADABLE = 0.01


@dataclass
class _Counts:
    """What was met in the fields."""

    filled: int = 0
    unreadable: int = 0
    lost_lines: int = 0
    zeros: int = 0
    otherwise: int = 0
    samples: list[str] = field(default_factory=list)


def observation_arrays(
    lines: Lines,
    epochs: WholeEpochs,
    header: ObservationHeader,
    systems: Collection[str] | None,
    codes: Collection[str] | None,
    where: str,
) -> Observations:
    """Observations of whole epochs.

    Raises
    ------
    InputError : arrays out of proportion to the file (E21).
    """
    letter_of_line = lines.data[lines.start[epochs.line]]
    counts = _Counts()
    known = np.zeros(256, bool)
    known[[ord(letter) for letter in header.codes if letter in SYSTEMS]] = True
    counts.lost_lines = int(np.count_nonzero(~known[letter_of_line]))
    found: dict[str, SystemObservations] = {}
    room = max(FREE_BYTES, MOST_TIMES * lines.data.size)
    for letter, names in header.codes.items():
        if letter not in SYSTEMS or (systems is not None and letter not in systems):
            continue
        own = np.flatnonzero(letter_of_line == ord(letter))
        if not own.size:
            continue
        chosen = [(i, c) for i, c in enumerate(names) if codes is None or c in codes]
        part = lines.some(epochs.line[own])
        row, number, part = _satellites(part, epochs.row[own], counts)
        room -= len(chosen) * epochs.time.size * np.unique(number).size * _BYTES_PER_VALUE
        if room < 0:
            raise InputError(
                "what the file holds is out of proportion to its size",
                code="E21",
                where=where,
                evidence=f"{epochs.time.size:,} epochs, {len(chosen)} codes of system {letter}",
                cure="name the codes that are wanted (codes=)",
            )
        found[letter] = _system(letter, part, row, number, chosen, epochs.time, header, counts)
    return Observations(header, found, (*epochs.findings, *_findings(counts, header, where)))


def _satellites(lines: Lines, row: Ints, counts: _Counts) -> tuple[Ints, Ints, Lines]:
    """Epochs and numbers of lines of satellites, and the lines that have one.

    Of two lines of a satellite in an epoch one is another's: both are left out.
    """
    head = lines.gather(0, 3)
    digit = head[:, 1:] - np.uint8(0x30)
    tens = np.where(head[:, 1] == 0x20, 0, digit[:, 0]).astype(np.int64)
    number = 10 * tens + digit[:, 1]
    good = (tens < 10) & (digit[:, 1] < 10) & (number > 0)
    place = 100 * row + np.where(good, number, 0)
    good &= np.bincount(place, minlength=1)[place] == 1
    counts.lost_lines += int(np.count_nonzero(~good))
    return row[good], number[good], lines.some(good)


def _system(
    letter: str,
    lines: Lines,
    row: Ints,
    number: Ints,
    chosen: Sequence[tuple[int, str]],
    time: NDArray[np.datetime64],
    header: ObservationHeader,
    counts: _Counts,
) -> SystemObservations:
    numbers, column = np.unique(number, return_inverse=True)
    n, m, k = time.size, numbers.size, len(chosen)
    place = row * m + column
    values = [np.full(n * m, np.nan) for _ in chosen]
    locks = [np.full(n * m, -1, np.int8) for _ in chosen]
    strengths = [np.full(n * m, -1, np.int8) for _ in chosen]
    odd: list[list[tuple[Ints, NDArray[np.void]]]] = [[] for _ in chosen]
    filled = np.zeros(k, np.int64)
    if chosen:
        fields = np.array([i for i, _ in chosen])
        low, high = 3 + FIELD * int(fields.min()), 3 + FIELD * (int(fields.max()) + 1)
        picked = fields - fields.min()
        together = bool((np.diff(picked) == 1).all())
        step = max(FIELDS_AT_ONCE // int(picked.max() + 1), 1)
        for begin in range(0, place.size, step):
            part = slice(begin, begin + step)
            text = lines.some(part).gather(low, high)
            if not together:
                text = text.reshape(len(text), -1, FIELD)[:, picked].reshape(len(text), -1)
            parsed = parse_fields(text)
            to = place[part]
            filled += np.count_nonzero(parsed.value == parsed.value, axis=0)
            for j in range(k):
                values[j][to] = parsed.value[:, j]
                locks[j][to] = parsed.loss_of_lock[:, j]
                strengths[j][to] = parsed.strength[:, j]
            if parsed.irregular.any():
                cells = text.reshape(len(text), -1, FIELD)
                for j in np.flatnonzero(parsed.irregular.any(axis=0)).tolist():
                    rows = np.flatnonzero(parsed.irregular[:, j])
                    odd[j].append((to[rows], cells[rows, j]))
    for j, (_, code) in enumerate(chosen):
        if odd[j]:
            where = np.concatenate([to for to, _ in odd[j]])
            cells = np.concatenate([cells for _, cells in odd[j]])
            _read_otherwise(values[j], locks[j], strengths[j], where, cells, filled[j], counts)
        zero = values[j] == 0
        counts.zeros += int(np.count_nonzero(zero))
        values[j][zero] = np.nan
        if (letter, code) in header.scale:
            values[j] /= header.scale[letter, code]
    counts.filled += int(filled.sum())
    names = [code for _, code in chosen]

    def shaped(arrays: Sequence[NDArray[np.generic]]) -> dict[str, NDArray[np.generic]]:
        return {name: a.reshape(n, m) for name, a in zip(names, arrays, strict=True)}

    return SystemObservations(
        time,
        tuple(f"{letter}{n:02d}" for n in numbers.tolist()),
        shaped(values),  # type: ignore[arg-type]
        shaped(locks),  # type: ignore[arg-type]
        shaped(strengths),  # type: ignore[arg-type]
    )


def _read_otherwise(
    values: NDArray[np.float64],
    locks: NDArray[np.int8],
    strengths: NDArray[np.int8],
    where: Ints,
    cells: NDArray[np.uint8],
    regular: int,
    counts: _Counts,
) -> None:
    """Fields of a code whose point stands elsewhere.

    Where most are so the program that wrote the file means it; a few among regular ones come
    from lost or doubled characters, and their numbers would be wrong.
    """
    if where.size <= regular:
        numbers = np.full(where.size, np.nan)
    else:
        numbers = np.array([number_otherwise(cell[:NUMBER].tobytes()) for cell in cells])
    marks = cells[:, NUMBER:].astype(np.int16) - 0x30
    good = np.isfinite(numbers) & (((marks >= 0) & (marks < 10)) | (marks == -0x10)).all(axis=1)
    marks = np.where((marks < 0) | ~good[:, None], -1, marks)
    values[where] = np.where(good, numbers, np.nan)
    locks[where], strengths[where] = marks[:, 0], marks[:, 1]
    counts.otherwise += int(good.sum())
    counts.filled += where.size
    counts.unreadable += int(np.count_nonzero(~good))
    if not good.all() and not counts.samples:
        counts.samples.append(repr(cells[~good][0].tobytes().decode("latin-1")))


def _findings(counts: _Counts, header: ObservationHeader, where: str) -> list[Finding]:
    findings = []
    if counts.unreadable:
        few = counts.unreadable <= _MOST_UNREADABLE * counts.filled
        findings.append(
            Finding(
                "E10",
                "warning" if few else "error",
                f"{counts.unreadable:,} fields are no numbers and were left out",
                where=where,
                evidence=f"first {', '.join(counts.samples)}",
                cure="get the file again",
            )
        )
    if counts.lost_lines:
        findings.append(
            Finding(
                "E10",
                "warning",
                f"{counts.lost_lines:,} lines name no satellite of the header's systems, or one "
                "twice in an epoch, and were left out",
                where=where,
                cure="get the file again",
            )
        )
    if counts.zeros:
        findings.append(
            Finding("E07", "info", f"{counts.zeros:,} values of 0.000 are missing ones", where)
        )
    if counts.otherwise:
        findings.append(
            Finding(
                "E26",
                "info",
                f"{counts.otherwise:,} values have their decimal point in another column",
                where=where,
            )
        )
    if header.scale:
        scaled = ", ".join(f"{s} {c} by {f}" for (s, c), f in list(header.scale.items())[:5])
        findings.append(
            Finding("E26", "info", "values were divided by scale factors", where, evidence=scaled)
        )
    if header.strength_unit not in ("", "DBHZ"):
        findings.append(
            Finding(
                "E08",
                "warning",
                f"signal strength is in {header.strength_unit!r}, not in dB-Hz",
                where=where,
                cure="do not select satellites by signal strength",
            )
        )
    return findings
