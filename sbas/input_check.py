"""Can this recording be trusted? Structure, time order, gaps, positions and levels.

`survey` looks at a source once (batch by batch) and states facts; `check` turns facts into
findings; `repair` makes, on request only, what a cure names, and counts it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.recording import EpochSource, Recording
from sbas.streaming import Distribution
from sbas.timescales import NS_PER_S
from sbas.truth import FixedPoint, Truth

GAP_STEPS = 1.5
"""A step longer than this many median steps is a gap."""
STATIC_EXTENT_M = 20.0
"""Medians of 60 epochs that stay within this range, east and north, make a recording static."""
STATIC_BLOCK_EPOCHS = 60
ACCEPTABLE = ("E08", "E10", "E12", "E24")
"""Errors that a user may accept by name; the others would make figures meaningless."""

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Gaps:
    """(g,) gaps: the row that follows each, the last epoch before it and the first one after."""

    row: Ints
    before_ns: Ints
    after_ns: Ints

    def __len__(self) -> int:
        return self.row.size

    def missing_ns(self, interval_ns: int) -> Ints:
        """(g,) time that no epoch covers [ns]."""
        return self.after_ns - self.before_ns - interval_ns


@dataclass(frozen=True, eq=False)
class Survey:
    """Facts of a recording, found in one look.

    Times in ns of GPS time; `interval_ns` is the median step. `median_position` is (lat_deg,
    lon_deg, height_m), each the median of its own; `extent_m` the larger range, east or north,
    of the medians of 60 epochs.
    """

    epochs: int
    begin_ns: int
    end_ns: int
    interval_ns: int
    gaps: Gaps
    repeated: int
    repeated_differing: int
    first_repeated_row: int
    backward: int
    first_backward_row: int
    positions: int
    median_position: tuple[float, float, float]
    extent_m: float
    lat_range_deg: tuple[float, float]
    lon_range_deg: tuple[float, float]
    out_of_range: int
    levels: int
    median_hpl_m: float
    levels_not_positive: int

    @property
    def static(self) -> bool:
        return self.positions > 0 and self.extent_m < STATIC_EXTENT_M

    @property
    def hours(self) -> float:
        """Recorded hours: epochs times the interval, gaps not included."""
        return self.epochs * self.interval_ns / (3600 * NS_PER_S)


@dataclass(frozen=True)
class CheckResult:
    """What the input check found."""

    survey: Survey
    findings: tuple[Finding, ...]
    format: str

    @property
    def epochs(self) -> int:
        return self.survey.epochs

    @property
    def usable(self) -> bool:
        return all(f.severity != "error" for f in self.findings)

    def to_dict(self) -> dict[str, Any]:
        return {
            "epochs": self.epochs,
            "format": self.format,
            "interval_s": self.survey.interval_ns / NS_PER_S if self.epochs > 1 else None,
            "hours": self.survey.hours,
            "gaps": len(self.survey.gaps),
            "static": self.survey.static,
            "usable": self.usable,
            "findings": [f.to_dict() for f in self.findings],
        }


def sampling_interval_ns(source: EpochSource) -> int:
    """Median of the steps forward between successive epochs [ns]; 0 when there is none."""
    steps: Counter[int] = Counter()
    previous = np.empty(0, np.int64)
    for batch in source.batches(()):
        time = np.concatenate([previous, batch.index.to_numpy().astype(np.int64)])
        forward = np.diff(time)
        values, counts = np.unique(forward[forward > 0], return_counts=True)
        steps.update(dict(zip(values.tolist(), counts.tolist(), strict=True)))
        previous = time[-1:]
    if not steps:
        return 0
    values = np.array(sorted(steps))
    ends = np.cumsum([steps[v] for v in values.tolist()])
    return int(values[np.searchsorted(ends, (ends[-1] + 1) // 2)])


def survey(source: EpochSource) -> Survey:
    """Look at every epoch of a source once, after one look at its times."""
    interval_ns = sampling_interval_ns(source)
    max_step_ns = int(GAP_STEPS * interval_ns)
    rows = repeated = differing = backward = positions = out_of_range = not_positive = 0
    first_repeated = first_backward = -1
    begin_ns = end_ns = 0
    gap_rows: list[Ints] = []
    gap_before: list[Ints] = []
    gap_after: list[Ints] = []
    level = Distribution()
    offsets = [Distribution(), Distribution(), Distribution()]
    reference: tuple[float, float, float] | None = None
    block_low, block_high = np.full(2, np.inf), np.full(2, -np.inf)
    ranges = np.array([[np.inf, -np.inf], [np.inf, -np.inf]])
    tail: pd.DataFrame | None = None
    for batch in source.batches(_SURVEYED):
        if len(batch) == 0:
            continue
        joined = batch if tail is None else pd.concat([tail, batch])
        time = joined.index.to_numpy().astype(np.int64)
        offset = rows - (0 if tail is None else 1)
        step = np.diff(time)
        same, back, gap = step == 0, step < 0, step > max_step_ns
        if same.any():
            if first_repeated < 0:
                first_repeated = offset + int(np.argmax(same)) + 1
            repeated += int(same.sum())
            values = joined.to_numpy()
            a, b = values[:-1][same], values[1:][same]
            differing += int(np.sum(np.any((a != b) & ~(np.isnan(a) & np.isnan(b)), axis=1)))
        if back.any():
            if first_backward < 0:
                first_backward = offset + int(np.argmax(back)) + 1
            backward += int(back.sum())
        if gap.any():
            at = np.flatnonzero(gap)
            gap_rows.append(at + 1 + offset)
            gap_before.append(time[at])
            gap_after.append(time[at + 1])
        begin_ns = int(time[0]) if rows == 0 else begin_ns
        end_ns = int(time[-1])
        rows += len(batch)
        tail = batch.iloc[-1:]

        hpl = batch["hpl_m"].to_numpy()
        level.update(hpl)
        not_positive += int(np.sum(hpl <= 0)) + int(np.sum(batch["vpl_m"].to_numpy() <= 0))
        position = batch[list(_POSITION)].to_numpy()
        known = np.isfinite(position[:, :2]).all(axis=1)
        lat, lon = position[:, 0], position[:, 1]
        wrong = known & ((np.abs(lat) > 90) | (np.abs(lon) > 180))
        out_of_range += int(wrong.sum())
        known &= ~wrong
        if not known.any():
            continue
        positions += int(known.sum())
        for i, axis in enumerate((lat[known], lon[known])):
            ranges[i] = min(ranges[i, 0], axis.min()), max(ranges[i, 1], axis.max())
        if reference is None:
            lat0, lon0, height0 = position[known][0]
            reference = (lat0, lon0, height0 if np.isfinite(height0) else 0.0)
        height = np.where(np.isfinite(position[:, 2]), position[:, 2], reference[2])
        east, north, up = pymap3d.geodetic2enu(lat[known], lon[known], height[known], *reference)
        up = np.where(np.isfinite(position[known, 2]), up, np.nan)
        for seen, values in zip(offsets, (east, north, up), strict=True):
            seen.update(values)
        medians = _block_medians(np.column_stack([east, north]))
        block_low = np.minimum(block_low, medians.min(axis=0))
        block_high = np.maximum(block_high, medians.max(axis=0))

    median = (np.nan, np.nan, np.nan)
    if reference is not None:
        east, north, up = (d.quantile(0.5) for d in offsets)
        lat, lon, height = pymap3d.enu2geodetic(east, north, np.nan_to_num(up), *reference)
        median = (float(lat), float(lon), float(height) if np.isfinite(up) else np.nan)
    return Survey(
        epochs=rows,
        begin_ns=begin_ns,
        end_ns=end_ns,
        interval_ns=interval_ns,
        gaps=Gaps(*(_joined(parts) for parts in (gap_rows, gap_before, gap_after))),
        repeated=repeated,
        repeated_differing=differing,
        first_repeated_row=first_repeated,
        backward=backward,
        first_backward_row=first_backward,
        positions=positions,
        median_position=median,
        extent_m=float(np.max(block_high - block_low)) if positions else np.nan,
        lat_range_deg=(float(ranges[0, 0]), float(ranges[0, 1])),
        lon_range_deg=(float(ranges[1, 0]), float(ranges[1, 1])),
        out_of_range=out_of_range,
        levels=level.count,
        median_hpl_m=level.quantile(0.5),
        levels_not_positive=not_positive,
    )


_POSITION = ("lat_deg", "lon_deg", "height_m")
_SURVEYED = (*_POSITION, "hpl_m", "vpl_m")


def _joined(parts: Sequence[Ints]) -> Ints:
    return np.concatenate(parts) if parts else np.empty(0, np.int64)


def _block_medians(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(b, 2) medians of successive blocks of epochs; a short batch is one block."""
    blocks = max(len(values) // STATIC_BLOCK_EPOCHS, 1)
    size = min(STATIC_BLOCK_EPOCHS, len(values))
    medians = [np.median(values[: blocks * size].reshape(blocks, size, 2), axis=1)]
    medians.append(np.median(values[-size:], axis=0)[None])
    return np.concatenate(medians)


def check(source: EpochSource, *, truth: Truth | None = None) -> CheckResult:
    """The findings of a recording: its reader's, and those of its structure and values.

    Parameters
    ----------
    source : a Recording or another EpochSource.
    truth : where the antenna was, if known; then positions far from it are found.

    Returns
    -------
    CheckResult; with an "error" among its findings, analyses refuse.
    """
    facts = survey(source)
    findings = [*source.meta.findings, *_structure(facts), *_values(facts)]
    if isinstance(truth, FixedPoint) and facts.positions:
        findings += _against_point(facts, truth)
    formats = sorted({s.format for s in source.meta.sources})
    return CheckResult(facts, tuple(findings), ", ".join(formats))


def _structure(facts: Survey) -> Iterable[Finding]:
    if facts.epochs < 2:
        yield Finding(
            "E15", "error", f"the recording has {facts.epochs or 'no'} epoch",
            evidence="two epochs are the least that any analysis can use",
            cure="record longer, or read another file; sbas.read still gives what is there",
        )  # fmt: skip
        return
    if facts.backward:
        yield Finding(
            "E14", "error", f"time goes backward {facts.backward} times",
            where=f"first at row {facts.first_backward_row}",
            evidence=f"recording runs {_stamp(facts.begin_ns)} to {_stamp(facts.end_ns)} GPST",
            cure="--sort, when one receiver's files were joined in the wrong order",
        )  # fmt: skip
    if facts.repeated:
        yield Finding(
            "E05", "error", f"{facts.repeated} epochs repeat the time of the epoch before",
            where=f"first at row {facts.first_repeated_row}",
            evidence=f"{facts.repeated_differing} of them with other values",
            cure="--duplicates first, or --duplicates last",
        )  # fmt: skip
    if facts.interval_ns == 0:
        yield Finding(
            "E14", "error", "no epoch is later than the one before it",
            cure="--sort, or read another file",
        )  # fmt: skip
    if len(facts.gaps):
        missing = facts.gaps.missing_ns(facts.interval_ns) / NS_PER_S
        share = missing.sum() / ((facts.end_ns - facts.begin_ns) / NS_PER_S)
        yield Finding(
            "E04", "warning",
            f"{_counted(len(facts.gaps), 'gap')}: lost {missing.sum():.6g} s, "
            f"{100 * share:.3g} % of the span",
            evidence=f"longest {missing.max():.6g} s; step {facts.interval_ns / NS_PER_S:.6g} s",
            cure="nothing to do: availability is given with gaps as down and without them",
        )  # fmt: skip


def _values(facts: Survey) -> Iterable[Finding]:
    if facts.out_of_range:
        yield Finding(
            "E08", "error", f"{facts.out_of_range} positions are outside +-90, +-180 degrees",
            cure="state the unit in the column's header, such as lat[rad]",
        )  # fmt: skip
    lat, lon = facts.lat_range_deg, facts.lon_range_deg
    if facts.positions and max(map(abs, lat)) <= np.pi / 2 and max(map(abs, lon)) <= np.pi:
        yield Finding(
            "E03", "error", "latitude and longitude look like radians",
            evidence=f"latitude {lat[0]:.6f}..{lat[1]:.6f}, longitude {lon[0]:.6f}..{lon[1]:.6f}",
            cure="state the unit in the column's header, such as lat[rad], lon[rad]",
        )  # fmt: skip
    if facts.levels_not_positive:
        yield Finding(
            "E13", "error", f"{facts.levels_not_positive} protection levels are zero or negative",
            evidence="they would pass for a perfect bound",
            cure="--pl-zero missing",
        )  # fmt: skip


def _against_point(facts: Survey, truth: FixedPoint) -> Iterable[Finding]:
    lat, lon, _ = facts.median_position
    tries = {
        "as given": (lat, lon),
        "latitude and longitude swapped": (lon, lat),
        "-latitude": (-lat, lon),
        "-longitude": (lat, -lon),
    }
    distance = {
        name: _chord_km(place, (truth.lat_deg, truth.lon_deg))
        for name, place in tries.items()
        if abs(place[0]) <= 90
    }
    limit_km = 1 if facts.static else 1000
    if distance["as given"] > limit_km:
        listed = ", ".join(f"{name} {km:.4g} km" for name, km in distance.items())
        yield Finding(
            "E12", "error", "the recording's median position is far from the truth",
            evidence=f"distance {listed}",
            cure="correct --truth LAT,LON,HEIGHT (degrees, latitude first)",
        )  # fmt: skip


def _chord_km(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Straight distance between two points of the ellipsoid [km]."""
    ends = (np.array(pymap3d.geodetic2ecef(*place, 0.0)) for place in (a, b))
    return float(np.linalg.norm(np.subtract(*ends))) / 1000


def _counted(n: int, what: str) -> str:
    return f"{n:,} {what}" if n == 1 else f"{n:,} {what}s"


def _stamp(ns: int) -> str:
    return str(np.datetime64(ns, "ns").astype("M8[ms]"))


def accept(findings: Iterable[Finding], codes: Iterable[str]) -> tuple[Finding, ...]:
    """Findings with the errors of the named codes turned into warnings that say so.

    Raises
    ------
    InputError : a code that cannot be accepted.
    """
    codes = tuple(codes)
    for code in codes:
        if code not in ACCEPTABLE:
            raise InputError(
                f"finding {code} cannot be accepted",
                cure=f"these can: {', '.join(ACCEPTABLE)}; cure the others",
            )
    return tuple(
        replace(f, severity="warning", message=f"{f.message} (accepted by the user)")
        if f.severity == "error" and f.code in codes
        else f
        for f in findings
    )


def repair(
    recording: Recording,
    *,
    sort: bool = False,
    duplicates: Literal["first", "last"] | None = None,
    pl_zero: Literal["missing"] | None = None,
) -> Recording:
    """The recording with the named repairs made; each is counted in a finding E26.

    Parameters
    ----------
    sort : put epochs in the order of their times (stable).
    duplicates : of successive epochs with the same time keep the first or the last.
    pl_zero : "missing": protection levels <= 0 become missing.
    """
    table, made = recording.table, []
    if sort and not table.index.is_monotonic_increasing:
        time = table.index.to_numpy()
        moved = int(np.sum(np.argsort(time, kind="stable") != np.arange(time.size)))
        table = table.sort_index(kind="stable")
        made.append(Finding("E26", "info", f"{moved} epochs put in the order of time (--sort)"))
    if duplicates is not None:
        drop = table.index.duplicated(keep=duplicates)
        if drop.any():
            table = table[~drop]
            text = f"{int(drop.sum())} epochs with a repeated time left out (--duplicates)"
            made.append(Finding("E26", "info", text, evidence=f"kept the {duplicates}"))
    if pl_zero == "missing":
        for name in ("hpl_m", "vpl_m"):
            if name in table and (table[name] <= 0).any():
                wrong = table[name] <= 0
                table = table.assign(**{name: table[name].mask(wrong)})
                text = f"{int(wrong.sum())} {name} <= 0 made missing (--pl-zero)"
                made.append(Finding("E26", "info", text))
    return recording.replace(table=table).with_findings(*made)
