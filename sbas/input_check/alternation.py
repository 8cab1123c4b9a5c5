"""Two receivers, or two solutions, whose epochs were written in turn (E06).

Each epoch is held against the straight line, in time, between the two beside it: what moves
evenly lies on it, what alternates lies now on one side of it and now on the other. That a side
is kept over six epochs tells it from noise, whose signs forget each other within three.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from sbas.input_check.judgement import Judged, judged, place
from sbas.recording_survey import Rows, Tail

LEAST_EPOCHS = 60
"""Epochs of which alternation must last."""
SHARE = 0.9
"""Of them those that must alternate: epochs of either receiver may be missing or noisy."""
ALTERNATING_M = 3.0
ALTERNATING_RATIO = 1.5
"""One of these in position or HPL is enough; else two of the following."""
WEAK_M = 1.5
WEAK_RATIO = {"hpl_m": 1.15, "hdop": 1.08}
WEAK_SATELLITES = 0.75
WEAK_DIGITS = 1.5
STEP_SHARE = 0.6
"""Along the way a jump counts beyond this part of two steps: rounded times make half of it."""
_BEFORE = 7
_M_PER_DEG = 111_195.0

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


class Alternation:
    """Epochs that lie now on one side of the line between their neighbours, now on the other."""

    COLUMNS = ("lat_deg", "lon_deg", "hpl_m", "hdop", "n_sv")

    def __init__(self) -> None:
        self.windows = self.first_row = self.first_ns = 0
        self._tail = Tail(_BEFORE + 2, self.COLUMNS)
        self._recent = np.zeros(0, bool)
        self._recent_ns = np.zeros(0, np.int64)

    def update(self, rows: Rows) -> None:
        joined, old = self._tail.before(rows)
        if len(joined) < 3:
            return
        hits = _alternating(joined.first, joined.time_ns, joined.values)
        # Row r is judged with row r + 1: the last of the rows before this batch waited for it.
        begin, end = max(old - 1, 0), len(joined) - 1
        self._count(hits[begin:end], joined.time_ns[begin:end], joined.first + begin)

    def _count(self, hits: Bools, time_ns: NDArray[np.int64], first: int) -> None:
        first -= self._recent.size
        hits = np.concatenate([self._recent, hits])
        time_ns = np.concatenate([self._recent_ns, time_ns])
        if hits.size >= LEAST_EPOCHS:
            total = np.concatenate([[0], np.cumsum(hits)])
            many = total[LEAST_EPOCHS:] - total[:-LEAST_EPOCHS] >= SHARE * LEAST_EPOCHS
            if self.windows == 0 and many.any():
                at = int(np.argmax(many))
                at += int(np.argmax(hits[at:]))
                self.first_row, self.first_ns = first + at, int(time_ns[at])
            self.windows += int(many.sum())
        keep = min(hits.size, LEAST_EPOCHS - 1)
        self._recent, self._recent_ns = hits[hits.size - keep :], time_ns[hits.size - keep :]

    def judgements(self) -> Iterator[Judged]:
        """E06, where epochs alternate for a minute or more. Call it behind the last row."""
        if self.windows:
            yield judged(
                "E06", "error", "epochs of two receivers, or of two solutions, alternate",
                where=f"first from {place(self.first_row, self.first_ns)}",
                evidence=f"{self.windows + LEAST_EPOCHS - 1:,} epochs, of any {LEAST_EPOCHS} "
                f"{SHARE:.0%} on alternate sides of their neighbours: by {ALTERNATING_M:g} m, by "
                f"{ALTERNATING_RATIO:g} times in HPL, or by less in two of position, HPL, HDOP, "
                "satellites and digits",
                cure="write one receiver a file; where their times are equal, --duplicates first "
                "keeps one of the two",
            )  # fmt: skip


def _alternating(first: int, time_ns: NDArray[np.int64], values: Mapping[str, Floats]) -> Bools:
    """(n,) True for each epoch that alternates; the last, which has no epoch behind, is False."""
    n = time_ns.size
    wait = (time_ns[1:-1] - time_ns[:-2]).astype(float)
    span = (time_ns[2:] - time_ns[:-2]).astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where((span > 0) & (wait >= 0) & (wait <= span), wait / span, np.nan)
    # +1, -1, +1 ... by row: what alternates has one sign throughout.
    turn = 1.0 - 2.0 * ((first + np.arange(1, n - 1)) % 2)

    def off(v: Floats) -> Floats:
        return np.asarray(turn * (v[1:-1] - v[:-2] - share * (v[2:] - v[:-2])))

    lat, lon = values["lat_deg"], values["lon_deg"]
    scale = _M_PER_DEG * np.cos(np.radians(lat[1:-1]))
    east, north = scale * off(lon), _M_PER_DEG * off(lat)
    way_e, way_n = scale * (lon[2:] - lon[:-2]), _M_PER_DEG * (lat[2:] - lat[:-2])
    way = np.hypot(way_e, way_n)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(way > 0, np.abs(east * way_e + north * way_n) / way, 0.0)
        across = np.where(
            way > 0, np.abs(east * way_n - north * way_e) / way, np.hypot(east, north)
        )
        logs = {name: off(np.log(values[name])) for name in WEAK_RATIO}

    def beyond(limit_m: float) -> Bools:
        far = (across > limit_m) | (along > np.maximum(limit_m, STEP_SHARE * way))
        return np.asarray(far)

    n_sv = np.where(values["n_sv"] >= 0, values["n_sv"], np.nan).astype(float)
    digits = off(_digits(lat))
    satellites = off(n_sv)
    same_place = _kept(east, north)
    hpl = _kept(logs["hpl_m"])
    strong = same_place & beyond(ALTERNATING_M)
    strong |= hpl & (np.abs(logs["hpl_m"]) > np.log(ALTERNATING_RATIO))
    weak = (same_place & beyond(WEAK_M)).astype(int)
    for name, limit in WEAK_RATIO.items():
        weak += _kept(logs[name]) & (np.abs(logs[name]) > np.log(limit))
    weak += _kept(satellites) & (np.abs(satellites) > WEAK_SATELLITES)
    weak += _kept(digits) & (np.abs(digits) > WEAK_DIGITS)
    found = np.zeros(n, bool)
    found[1:-1] = strong | (weak >= 2)
    return found


def _kept(*parts: Floats) -> Bools:
    """(n,) True where values, turned, point as one and as six epochs ago."""
    found = np.zeros(parts[0].size, bool)
    near = sum(p[6:] * p[5:-1] for p in parts)
    far = sum(p[6:] * p[:-6] for p in parts)
    found[6:] = (near > 0) & (far > 0)
    return found


def _digits(lat_deg: Floats) -> Floats:
    """(n,) decimals of degrees beyond four, up to five; missing where there is no position."""
    count = np.zeros(lat_deg.size)
    for digits in range(4, 9):
        grid = lat_deg * 10.0**digits
        # A double near 5e9 is good to 1e-6 of a unit.
        count += np.abs(grid - np.rint(grid)) > 1e-3
    return np.where(np.isfinite(lat_deg), count, np.nan)
