"""Whole records at the wrong place: twice, exchanged, of another file, in the wrong archive."""

from __future__ import annotations

import numpy as np

from sbas.recording import Recording
from tests.corruption.damage import Damaged, Kind, file_of
from tests.corruption.good_logs import FORMS, GoodLog
from tests.input_check.damages import changed, joined, rows
from tests.input_check.journeys import moved, receiver

Rng = np.random.Generator


def _pieced(log: GoodLog) -> bool:
    return log.form.family != "table"


def _with_epochs(log: GoodLog, epochs: list[bytes]) -> bytes:
    return log.pieces.head + b"".join(epochs) + log.pieces.foot


def _repeated(log: GoodLog, rng: Rng) -> Damaged:
    """Some epochs written twice, one after the other."""
    epochs = list(log.pieces.epochs)
    for i in sorted(rng.choice(len(epochs), int(rng.choice([1, 5, 60])), replace=False))[::-1]:
        epochs.insert(i, epochs[i])
    return file_of(log, _with_epochs(log, epochs), "E05", least="error")


def _repeated_otherwise(log: GoodLog, rng: Rng) -> Damaged:
    """Some epochs twice, the second with another position and level."""
    n = len(log.recording)
    order = np.sort(np.r_[np.arange(n), rng.choice(n, int(rng.choice([1, 5, 60])), replace=False)])
    table = log.recording.table.iloc[order]
    again = np.r_[False, np.diff(order) == 0]
    both = log.recording.replace(table=table)
    both = changed(
        both,
        lat_deg=table["lat_deg"] + 3e-5 * again,
        hpl_m=table["hpl_m"] + 4.0 * again,
        vpl_m=table["vpl_m"] + 6.0 * again,
    )
    return file_of(log, log.rewritten(both), "E05", least="error", keeps=False)


def _stretch_twice(log: GoodLog, rng: Rng) -> Damaged:
    a = int(rng.integers(100, 500))
    b = a + int(rng.integers(2, 400))
    epochs = [*log.pieces.epochs[:b], *log.pieces.epochs[a:]]
    return file_of(log, _with_epochs(log, epochs), "E14", least="error")


def _halves_exchanged(log: GoodLog, rng: Rng) -> Damaged:
    at = int(rng.integers(100, len(log.pieces.epochs) - 100))
    epochs = [*log.pieces.epochs[at:], *log.pieces.epochs[:at]]
    return file_of(log, _with_epochs(log, epochs), "E14", least="error")


def _neighbours_exchanged(log: GoodLog, rng: Rng) -> Damaged:
    epochs = list(log.pieces.epochs)
    for i in rng.choice(len(epochs) // 2 - 1, int(rng.choice([1, 20])), replace=False) * 2:
        epochs[i], epochs[i + 1] = epochs[i + 1], epochs[i]
    return file_of(log, _with_epochs(log, epochs), "E14", least="error")


def _backwards(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, _with_epochs(log, list(log.pieces.epochs[::-1])), "E14", least="error")


def _file_twice(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, log.pieces.data * 2, "E14", "E05", "E10", "E16", "E24", least="error")


def _epochs_missing(log: GoodLog, rng: Rng) -> Damaged:
    """Whole epochs lost, a few here and there or a minute at a time."""
    n = len(log.recording)
    if rng.integers(2):
        left = np.delete(np.arange(n), rng.choice(np.arange(1, n - 1), 12, replace=False))
    else:
        at = int(rng.integers(100, n - 200))
        left = np.r_[:at, at + int(rng.integers(2, 100)) : n]
    return file_of(log, log.rewritten(rows(log.recording, left)), "E04")


def other_receiver(log: GoodLog) -> Recording:
    """A second receiver with other satellites and levels, some metres away."""
    table = log.recording.table
    n = len(table)
    other = receiver(np.full(n, 2.0), np.zeros(n), np.arange(n) * 1.0, 9)
    lat, lon = table["lat_deg"] + 6e-5, table["lon_deg"] + 6e-5
    return changed(
        log.recording,
        lat_deg=lat,
        lon_deg=lon,
        hpl_m=2.2 * other.table["hpl_m"].to_numpy(),
        vpl_m=2.2 * other.table["vpl_m"].to_numpy(),
        n_sv=other.table["n_sv"].to_numpy() - np.int16(4),
    )


def _two_receivers_in_turn(log: GoodLog, rng: Rng) -> Damaged:
    n = len(log.recording)
    both = rows(
        joined(log.recording, other_receiver(log)), np.arange(2 * n).reshape(2, n).T.ravel()
    )
    return file_of(log, log.rewritten(both), "E06", least="error", keeps=False)


def _two_receivers_half_a_step_apart(log: GoodLog, rng: Rng) -> Damaged:
    n = len(log.recording)
    both = joined(log.recording, moved(other_receiver(log), 0.5))
    both = rows(both, np.arange(2 * n).reshape(2, n).T.ravel())
    return file_of(log, log.rewritten(both), "E06", least="error", keeps=False)


def _second_receiver_appended(log: GoodLog, rng: Rng) -> Damaged:
    """Another receiver's file, of a later hour and another rate, behind the first."""
    other = other_receiver(log)
    other = rows(moved(other, 7200), np.arange(0, len(other), 2))
    data = log.pieces.data + log.rewritten(other)
    return file_of(log, data, "E06", "E10", "E16", "E24", least="error", keeps=False)


def _file_of_second_receiver(log: GoodLog, rng: Rng) -> Damaged:
    other = other_receiver(log)
    other = rows(moved(other, 7200), np.arange(0, len(other), 2))
    names = [f"part{k}{log.form.extension}" for k in (1, 2)]
    files = ((names[0], log.pieces.data), (names[1], log.rewritten(other)))
    return Damaged(files, frozenset({"E06"}), "error", keeps=False)


def _file_given_twice(log: GoodLog, rng: Rng) -> Damaged:
    files = tuple((f"copy{k}{log.form.extension}", log.pieces.data) for k in (1, 2))
    return Damaged(files, frozenset({"E26"}))


def _files_overlap(log: GoodLog, rng: Rng) -> Damaged:
    n = len(log.recording)
    a, b = (int(rng.integers(low, low + 200)) for low in (300, 700))
    parts = [rows(log.recording, np.arange(b)), rows(log.recording, np.arange(a, n))]
    files = tuple(
        (f"part{k}{log.form.extension}", log.rewritten(part)) for k, part in enumerate(parts)
    )
    return Damaged(files, frozenset({"E14"}), "error")


_MISLEADING = {form.format: form.extension for form in FORMS}


def _wrong_extension(log: GoodLog, rng: Rng) -> Damaged:
    others = [e for f, e in _MISLEADING.items() if e not in (log.form.extension, ".csv", ".txt")]
    if log.form.format not in ("csv", "pegasus_csv", "ubx_hex_csv"):
        others.append(".csv")
    extension = str(rng.choice([e for e in others if _MISLEADING[log.form.format] != e]))
    return file_of(log, log.pieces.data, "E17", name=f"roof{extension}")


ORDER_DAMAGES = (
    Kind("epochs twice", _repeated, _pieced, 2),
    Kind("epochs twice, differing", _repeated_otherwise, times=1),
    Kind("a stretch twice", _stretch_twice, _pieced, 2),
    Kind("halves exchanged", _halves_exchanged, _pieced),
    Kind("neighbours exchanged", _neighbours_exchanged, _pieced),
    Kind("backwards", _backwards, _pieced),
    Kind("the file twice in itself", _file_twice),
    Kind("epochs missing", _epochs_missing, times=2),
    Kind("two receivers in turn", _two_receivers_in_turn),
    Kind("two receivers half a step apart", _two_receivers_half_a_step_apart),
    Kind("a second receiver appended", _second_receiver_appended, lambda log: log.form.levels),
    Kind("the file of a second receiver", _file_of_second_receiver, lambda log: log.form.levels),
    Kind("a file given twice", _file_given_twice),
    Kind("files that overlap", _files_overlap),
    Kind("wrong extension", _wrong_extension),
)
