"""Stretches of several receivers in one recording, one behind the other (E06).

Files of two receivers joined show at their seam, a gap or a step back in time: what no receiver
changes by itself (digits, columns, rate, a place that nothing reaches in time) or several
properties at once. Epochs written in turn are in `alternation`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.input_check.judgement import Judged, counted, judged, place
from sbas.recording import MODES
from sbas.recording_survey import Rows, Survey, Tail
from sbas.timescales import NS_PER_S

LEVEL_RATIO = 1.5
"""Medians of HPL on both sides of a seam that differ more are one sign of two receivers."""
SEAM_NS = 60 * NS_PER_S
"""A longer gap may join two files."""
LEAST_EPOCHS = 60
"""Epochs on either side that a comparison needs."""
WINDOW = 600
STATIC_M = 10.0
FASTEST_MPS = 150.0
"""Nothing on rails or roads is faster."""
ELSEWHERE_M = 10_000.0
"""A change of place beyond what `FASTEST_MPS` explains that no other sign is needed beside."""
SATELLITES = 3
PURE = 0.99
"""Share of a side's epochs in one mode, from which it counts as that side's."""
_NO_POSITION = -2
_M_PER_DEG = 111_195.0

Floats = NDArray[np.float64]


def _ratio(a: Floats, b: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.maximum(a, b) / np.minimum(a, b))


@dataclass(frozen=True)
class _Side:
    """What is usual on one side of a seam."""

    hpl_m: float
    mode: int
    n_sv: float
    position: tuple[float, float]
    spread_m: float
    digits: int
    columns: frozenset[str]
    step_ns: int


class Seams:
    """Compares up to `WINDOW` epochs on both sides of each gap and each step back.

    Parameters
    ----------
    interval_ns : the median step.
    files : number of files; where there are several, one may end without a gap, and a level
        that changes at once is looked at as well.
    """

    COLUMNS = ("lat_deg", "lon_deg", "height_m", "hpl_m", "hdop", "n_sv", "mode")

    def __init__(self, interval_ns: int, files: int = 1) -> None:
        self.files = files
        self.least_ns = max(SEAM_NS, 2 * interval_ns)
        self.found: list[tuple[int, int, bool, str]] = []
        self._tail = Tail(2 * WINDOW, self.COLUMNS)
        self._seams: list[int] = []
        self._judged = 0
        self._last_ns: int | None = None

    def update(self, rows: Rows) -> None:
        joined, old = self._tail.before(rows)
        step = np.diff(joined.time_ns[max(old - 1, 0) :])
        odd = (step > self.least_ns) | (step < 0)
        odd |= self._leaps(joined.part(max(old - 1, 0), len(joined)))
        at = np.flatnonzero(odd) + max(old, 1)
        self._seams += (at + joined.first).tolist()
        self._judge(joined, joined.first + len(joined) - WINDOW)

    def _leaps(self, rows: Rows) -> NDArray[np.bool_]:
        """(n - 1,) True where the place, or in several files the level, changes at once."""
        lat, lon = rows.values["lat_deg"], rows.values["lon_deg"]
        north = np.diff(lat)
        east = ((np.diff(lon) + 180) % 360 - 180) * np.cos(np.radians(lat[1:]))
        leaps = _M_PER_DEG * np.hypot(north, east) > ELSEWHERE_M
        if self.files > 1:
            hpl = rows.values["hpl_m"]
            leaps |= _ratio(hpl[1:], hpl[:-1]) > LEVEL_RATIO
        return np.asarray(leaps)

    def _judge(self, joined: Rows, last: int) -> None:
        """Compare at the seams up to row `last`, behind which all rows of their window came."""
        while self._judged < len(self._seams) and self._seams[self._judged] <= last:
            i = self._judged
            row = self._seams[i]
            low = max(self._seams[i - 1] if i else 0, row - WINDOW, joined.first)
            high = min(self._seams[i + 1] if i + 1 < len(self._seams) else row + WINDOW,
                       row + WINDOW, joined.first + len(joined))  # fmt: skip
            self._judged += 1
            if min(row - low, high - row) >= LEAST_EPOCHS:
                low, row, high = (n - joined.first for n in (low, row, high))
                self._compare(joined.part(low, row), joined.part(row, high))

    def _compare(self, before: Rows, after: Rows) -> None:
        a, b = _side(before), _side(after)
        strong, weak = [], []
        levels = float(_ratio(np.array(a.hpl_m), np.array(b.hpl_m)))
        if a.digits != b.digits and min(a.digits, b.digits) > _NO_POSITION:
            strong.append(f"digits of the latitude {_digits(a.digits)} and {_digits(b.digits)}")
        if other := a.columns ^ b.columns:
            strong.append(f"{', '.join(sorted(other))} on one side only")
        if a.step_ns and b.step_ns and not 0.8 < a.step_ns / b.step_ns < 1.25:
            strong.append(f"steps {a.step_ns / NS_PER_S:g} s and {b.step_ns / NS_PER_S:g} s")
        apart = _distance_m(_last_position(before), _first_position(after))
        waited_s = (int(after.time_ns[0]) - int(before.time_ns[-1])) / NS_PER_S
        if 0 < waited_s * FASTEST_MPS < apart:
            strong.append(f"{apart:.4g} m in {waited_s:g} s")
        far = _beyond_reach_m(before, after)
        if far > ELSEWHERE_M:
            strong.append(f"{far:.4g} m farther apart than {FASTEST_MPS:g} m/s explain")
        if a.mode != b.mode and min(a.mode, b.mode) >= 0:
            weak.append(f"modes {MODES[a.mode]} and {MODES[b.mode]}")
        standing = max(a.spread_m, b.spread_m) < STATIC_M
        if standing and abs(a.n_sv - b.n_sv) >= SATELLITES:
            weak.append(f"satellites {a.n_sv:g} and {b.n_sv:g}")
        moved = _distance_m(a.position, b.position)
        if standing and moved > STATIC_M:
            weak.append(f"medians {moved:.4g} m apart")
        differ = levels > LEVEL_RATIO
        sure = (differ and (bool(strong) or len(weak) >= 2)) or len(strong) >= 2
        sure |= far > ELSEWHERE_M
        unbroken = 0 <= waited_s * NS_PER_S <= self.least_ns and _apart(before, after)
        if sure or (differ and (weak or unbroken)):
            hpl = [f"HPL medians {a.hpl_m:.4g} and {b.hpl_m:.4g} m"] if differ else []
            text = ", ".join([*hpl, *strong, *weak])
            self.found.append((after.first, int(after.time_ns[0]), sure, text))

    def judgements(self, facts: Survey) -> Iterator[Judged]:
        """E06, once for all seams. Call it behind the last row."""
        if self._tail.rows is not None:
            self._judge(self._tail.rows, facts.epochs)
        if not self.found:
            return
        sure = any(found[2] for found in self.found)
        row, ns, _, text = next(f for f in self.found if f[2] == sure)
        yield judged(
            "E06", "error" if sure else "warning",
            "the recording changes as if the receiver did, "
            f"{counted(len(self.found), 'time')}"
            + ("" if sure else ": two receivers, or another place"),
            where=f"first at {place(row, ns)}",
            evidence=text,
            cure="evaluate the parts apart, or --accept E06 where it is one receiver",
        )  # fmt: skip


def _side(rows: Rows) -> _Side:
    values = rows.values
    lat, lon = values["lat_deg"], values["lon_deg"]
    known = np.isfinite(lat) & np.isfinite(lon)
    mode = values["mode"][values["mode"] >= 0]
    usual = int(np.bincount(mode).argmax()) if mode.size else -1
    pure = mode.size and np.mean(mode == usual) >= PURE
    place_deg = (_median(lat), _median(lon))
    from_median = np.hypot(lat - place_deg[0], (lon - place_deg[1]) * np.cos(np.radians(lat)))
    step = np.diff(rows.time_ns)
    present = {name for name in ("height_m", "hdop") if np.isfinite(values[name]).any()}
    present |= {"n_sv"} if (values["n_sv"] >= 0).any() else set()
    n_sv = values["n_sv"][values["n_sv"] >= 0].astype(float)
    return _Side(
        hpl_m=_median(values["hpl_m"]),
        mode=usual if pure else -1,
        n_sv=_median(n_sv),
        position=place_deg,
        spread_m=_M_PER_DEG * _quantile(from_median, 0.95),
        digits=_written_digits(lat[known]),
        columns=frozenset(present),
        step_ns=int(np.median(step[step > 0])) if (step > 0).any() else 0,
    )


def _quantile(values: Floats, q: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, q)) if known.size else float("nan")


def _median(values: Floats) -> float:
    return _quantile(values, 0.5)


def _written_digits(lat_deg: Floats) -> int:
    """Decimals of degrees, or 100 + those of minutes; -1 where the numbers were computed."""
    if lat_deg.size == 0:
        return _NO_POSITION
    for scale, offset in ((1.0, 0), (60.0, 100)):
        for digits in range(3, 10):
            grid = lat_deg * scale * 10.0**digits
            # A double near 5e10 is good to 1e-5 of a unit.
            if np.all(np.abs(grid - np.rint(grid)) < 1e-3):
                return digits + offset
    return -1


def _digits(code: int) -> str:
    if code < 0:
        return "as computed"
    return f"{code - 100} of minutes" if code >= 100 else f"{code}"


def _first_position(rows: Rows) -> tuple[float, float]:
    lat, lon = rows.values["lat_deg"], rows.values["lon_deg"]
    at = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon))
    return (float(lat[at[0]]), float(lon[at[0]])) if at.size else (np.nan, np.nan)


def _last_position(rows: Rows) -> tuple[float, float]:
    turned = {name: values[::-1] for name, values in rows.values.items()}
    return _first_position(Rows(rows.first, rows.time_ns[::-1], turned))


def _beyond_reach_m(before: Rows, after: Rows) -> float:
    """Distance between the medians of the epochs next to a seam, less what is done in that time."""
    a, b = before.part(len(before) - LEAST_EPOCHS, len(before)), after.part(0, LEAST_EPOCHS)
    places = [(_median(r.values["lat_deg"]), _median(r.values["lon_deg"])) for r in (a, b)]
    waited_s = abs(float(np.median(b.time_ns) - np.median(a.time_ns))) / NS_PER_S
    return _distance_m(*places) - waited_s * FASTEST_MPS


def _apart(before: Rows, after: Rows) -> bool:
    """Whether the levels of most epochs next to a seam do not meet those of the other side."""
    a, b = (r.values["hpl_m"] for r in (before.part(len(before) - LEAST_EPOCHS, len(before)),
                                        after.part(0, LEAST_EPOCHS)))  # fmt: skip
    return max(_quantile(a, 0.05), _quantile(b, 0.05)) > min(_quantile(a, 0.95), _quantile(b, 0.95))


def _distance_m(a: tuple[float, float], b: tuple[float, float]) -> float:
    if not np.isfinite([*a, *b]).all() or max(abs(a[0]), abs(b[0])) > 90:
        return float("nan")
    east, north, _ = pymap3d.geodetic2enu(*a, 0.0, *b, 0.0)
    return float(np.hypot(east, north))
