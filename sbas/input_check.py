"""Can this recording be trusted? Structure, time order, gaps, positions and levels.

`check` turns the facts of a survey into findings; `repair` makes, on request only, what a cure
names, and counts it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.recording import COLUMNS, EpochSource, Recording, mode_categories
from sbas.recording_survey import Survey, survey
from sbas.timescales import NS_PER_S
from sbas.truth import FixedPoint, Truth

ACCEPTABLE = ("E06", "E10", "E12", "E24")
"""Errors that a user may accept by name; the others would make figures meaningless."""


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
    counted_ns = facts.epochs * facts.interval_ns
    if abs(facts.covered_ns - counted_ns) > 0.01 * counted_ns:
        yield Finding(
            "E27", "warning", "epochs come at more than one rate",
            evidence=f"{facts.epochs:,} epochs cover {facts.covered_ns / NS_PER_S:.6g} s, at the "
            f"median step they would cover {counted_ns / NS_PER_S:.6g} s",
            cure="hours are counted by the time covered; evaluate each rate on its own",
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
    limit_km = 1 if facts.static else 100
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
            table, filled = _without_repeated(table, drop)
            text = f"{int(drop.sum())} epochs with a repeated time left out (--duplicates)"
            evidence = f"kept the {duplicates}; {filled} values of the others that agree used"
            made.append(Finding("E26", "info", text, evidence=evidence))
    if pl_zero == "missing":
        for name in ("hpl_m", "vpl_m"):
            if name in table and (table[name] <= 0).any():
                wrong = table[name] <= 0
                table = table.assign(**{name: table[name].mask(wrong)})
                text = f"{int(wrong.sum())} {name} <= 0 made missing (--pl-zero)"
                made.append(Finding("E26", "info", text))
    return recording.replace(table=table).with_findings(*made)


def _without_repeated(table: pd.DataFrame, drop: NDArray[np.bool_]) -> tuple[pd.DataFrame, int]:
    """The rows that stay, completed from dropped ones of the same time that nowhere differ.

    An epoch whose blocks came twice, or in two files, is then whole again.
    """
    kept, dropped = table[~drop], table[drop]
    target = kept.index.get_indexer(dropped.index)
    numbers = [n for n in table.columns if n in COLUMNS and COLUMNS[n].dtype in ("f8", "i2")]
    values = {n: _known_numbers(kept, n) for n in numbers}
    others = {n: _known_numbers(dropped, n) for n in numbers}
    differing = np.zeros(len(dropped), bool)
    for n in numbers:
        mine = values[n][target]
        differing |= (mine != others[n]) & ~np.isnan(mine) & ~np.isnan(others[n])
    filled, changes = 0, {}
    for n in numbers:
        usable = ~differing & ~np.isnan(others[n]) & np.isnan(values[n][target])
        if usable.any():
            column = kept[n].to_numpy().copy()
            column[target[usable]] = dropped[n].to_numpy()[usable]
            changes[n] = column
            filled += int(usable.sum())
    if "mode" in table:
        codes = kept["mode"].cat.codes.to_numpy().copy()
        other = dropped["mode"].cat.codes.to_numpy()
        usable = ~differing & (codes[target] < 0) & (other >= 0)
        codes[target[usable]] = other[usable]
        changes["mode"] = mode_categories(codes)
        filled += int(usable.sum())
    return kept.assign(**changes), filled


def _known_numbers(table: pd.DataFrame, name: str) -> NDArray[np.float64]:
    values: NDArray[np.float64] = table[name].to_numpy().astype(float)
    return np.where(values == COLUMNS[name].missing, np.nan, values)
