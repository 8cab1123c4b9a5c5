"""Which lines of RINEX 3 and 4 observations belong to whole epochs, and what the others are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.rinex.observation_header import parse_codes, parse_scale
from sbas.rinex.observation_lines import Bools, EpochLines, Ints, Lines, parse_epochs
from sbas.rinex.observations import ObservationHeader
from sbas.timescales import to_gps

_MARK = ord(">")
_MOST_PARTIAL = 0.01


@dataclass(frozen=True, eq=False)
class WholeEpochs:
    """Whole epochs in the order of time, each time once.

    Parameters
    ----------
    time : (n,) GPS time.
    line, row : (k,) lines of satellites, and the epoch of each.
    span : (n, 2) first byte of each epoch's record, and the end of its last line.
    findings : what was left out.
    """

    time: NDArray[np.datetime64]
    line: Ints
    row: Ints
    span: Ints
    findings: tuple[Finding, ...]


def whole_epochs(
    lines: Lines, header: ObservationHeader, *, ends_whole: bool, where: str
) -> WholeEpochs:
    """Epochs of observations (flag 0 or 1) with as many lines as they announce.

    Parameters
    ----------
    lines : all lines behind the header.
    ends_whole : the last line has its line end; otherwise it may be cut within a number.

    Raises
    ------
    InputError : no whole epoch; an event that changes the codes; another header in between.
    """
    mark, epochs = _marks(lines)
    if not mark.size:
        _refuse_empty(0, where)
    of_line = np.cumsum(np.bincount(mark, minlength=lines.start.size)[: lines.start.size]) - 1
    last = np.append(mark[1:], lines.start.size) - 1
    head = lines.gather(0, 3)
    is_text = ~((head == 0x20) | (head == 0)).all(axis=1)
    is_text[mark] = False
    before = int(np.count_nonzero(is_text & (of_line < 0)))
    is_text &= of_line >= 0
    present = np.bincount(of_line[is_text], minlength=mark.size)
    event = epochs.counted & (epochs.flag >= 2) & (epochs.flag <= 6)
    event &= epochs.timed | epochs.blank
    observing = epochs.counted & epochs.timed & (epochs.flag <= 1)
    whole = observing & (present == epochs.count)
    if not ends_whole and whole.size and whole[-1]:
        letter = chr(int(lines.data[lines.start[-1]]))
        full = 3 + 16 * len(header.codes.get(letter, ())) if epochs.count[-1] else 35
        whole[-1] = lines.end[-1] - lines.start[-1] >= full
    for place in np.flatnonzero(event & (epochs.flag == 4)).tolist():
        _check_event(lines, int(mark[place]), int(last[place]), header, where)
    kept = np.flatnonzero(whole)
    time = to_gps(epochs.minute_ns[kept].astype("M8[ns]"), header.time_scale)  # type: ignore[arg-type]
    time = time + epochs.second_ns[kept].astype("m8[ns]")
    span = np.stack([lines.start[mark], lines.end[last]], axis=1)
    order, findings = _in_order(time, span[kept], lines, where)
    kept, time = kept[order], time[order]
    row_of = np.full(mark.size, -1)
    row_of[kept] = np.arange(kept.size)
    line = np.flatnonzero(is_text)
    row = row_of[of_line[line]]
    findings += _left_out(whole, event, before, where)
    if not kept.size:
        _refuse_empty(mark.size, where)
    return WholeEpochs(time, line[row >= 0], row[row >= 0], span[kept], tuple(findings))


def _marks(lines: Lines) -> tuple[Ints, EpochLines]:
    """Lines that begin epochs. Lines of an event, such as comments, may begin with `>` too: one
    that is no record, within as many lines as the event announces, is the event's."""
    filled = lines.end > lines.start
    mark = np.flatnonzero(filled & (lines.data[lines.start] == _MARK))
    epochs = parse_epochs(lines.some(mark))
    record = epochs.counted & (epochs.timed | (epochs.blank & (epochs.flag >= 2)))
    if record.all():
        return mark, epochs
    before = np.maximum.accumulate(np.where(record, np.arange(mark.size), -1))
    is_event = (before >= 0) & (epochs.flag[before] >= 2)
    within = ~record & is_event & (mark - mark[before] <= epochs.count[before])
    kept = ~within
    return mark[kept], parse_epochs(lines.some(mark[kept]))


def _check_event(
    lines: Lines, first: int, last: int, header: ObservationHeader, where: str
) -> None:
    """Header lines of an event may repeat the codes, but not change them."""
    text = lines.data[lines.start[first] : lines.end[last]].tobytes()
    if b"SYS / # / OBS TYPES" not in text and b"SYS / SCALE FACTOR" not in text:
        return
    here = f"{where}, line {first + 1} after the header"
    inside = text.decode("latin-1").replace("\r", "").split("\n")
    codes = parse_codes(inside, where=here)
    scale = parse_scale(inside, {**header.codes, **codes}, where=here)
    same = all(header.codes.get(letter) == names for letter, names in codes.items())
    if not same or ("SYS / SCALE FACTOR" in "".join(inside) and scale != dict(header.scale)):
        raise InputError(
            "the observation codes change inside the file",
            code="E06",
            where=here,
            evidence=inside[1].strip() if len(inside) > 1 else "",
            cure="split the file at that event and give both parts",
        )


def _in_order(
    time: NDArray[np.datetime64], span: Ints, lines: Lines, where: str
) -> tuple[Ints, list[Finding]]:
    """Places of the epochs in the order of time, the first one of each time."""
    findings = []
    order = np.argsort(time, kind="stable")
    backward = int(np.count_nonzero(time[1:] < time[:-1]))
    if backward:
        findings.append(
            Finding(
                "E14",
                "warning",
                f"time goes backward {backward:,} times; epochs have been sorted",
                where=where,
                evidence=f"first after {time[:-1][time[1:] < time[:-1]][0]}",
                cure="give the files of a receiver one by one, in any order",
            )
        )
    repeated = np.zeros(order.size, bool)
    repeated[1:] = time[order[1:]] == time[order[:-1]]
    if repeated.any():
        firsts = order[np.maximum.accumulate(np.where(repeated, 0, np.arange(order.size)))]
        differing = [
            lines.data[slice(*span[a])].tobytes() != lines.data[slice(*span[b])].tobytes()
            for a, b in zip(firsts[repeated], order[repeated], strict=True)
        ]
        findings.append(repeated_finding(int(repeated.sum()), sum(differing), where))
    return order[~repeated], findings


def repeated_finding(count: int, differing: int, where: str) -> Finding:
    """E05 of epochs left out because their time came before."""
    return Finding(
        "E05",
        "error" if differing else "warning",
        f"{count:,} epochs repeat a time and are left out, {differing:,} of them with other "
        "observations than the first ones",
        where=where,
        cure="remove those that are not the receiver's" if differing else "",
    )


def _left_out(whole: Bools, event: Bools, before: int, where: str) -> list[Finding]:
    findings = []
    events = int(event.sum())
    if events:
        findings.append(Finding("E26", "info", f"{events:,} event records passed over", where))
    if before:
        findings.append(
            Finding(
                "E24",
                "warning",
                f"{before:,} lines before the first epoch belong to none",
                where=where,
                cure="get the file again",
            )
        )
    partial = int(np.count_nonzero(~whole & ~event))
    if partial:
        only_last = partial == 1 and not whole[-1]
        few = only_last or partial <= _MOST_PARTIAL * whole.size
        findings.append(
            Finding(
                "E10",
                "warning" if few else "error",
                f"{partial:,} of {whole.size - events:,} epochs are cut or unreadable and left out",
                where=where,
                cure="get the file again",
            )
        )
    return findings


def _refuse_empty(records: int, where: str) -> NoReturn:
    raise InputError(
        "the observation file holds no whole epoch",
        code="E15",
        where=where,
        evidence=f"{records:,} epoch records",
        cure="the receiver recorded nothing, or the file is cut: get it again",
    )
