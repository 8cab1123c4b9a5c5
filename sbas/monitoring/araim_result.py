"""What ARAIM says of epochs: levels, whether they were tested, and why there is none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.monitoring.araim_modes import TRACK, Axes
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.raim_result import spread_of
from sbas.monitoring.verdicts import MonitorReason

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]

UNMONITORED = 100
"""Reason code beside those of MonitorReason: what is unmonitored exhausts the budget."""
_UNMONITORED_WORDS = "faults that cannot be monitored exhaust the integrity budget"
_UNMONITORED_CURE = (
    "a second constellation, or a smaller prior of a constellation fault if that can be "
    "justified: --prior-constellation, AraimSettings(p_constellation=)"
)
_INFINITE = "the horizontal level is infinite"
_DETECTED = "a fault is detected: the level means nothing"
_NO_TEST = "no test ran: the level is that of the geometry alone"


@dataclass(frozen=True, eq=False, repr=False)
class AraimResult:
    """Levels of n epochs on q axes; infinite where there is none.

    Parameters
    ----------
    axes : names of the axes: east, north, up, and along, across where a heading was given.
    level_m : (n, q) protection level of each axis.
    sigma_acc_m : (n, q) 1-sigma accuracy of the fix; NaN where there is none.
    k_alarm : (n, q) factor K_fa of the test thresholds; NaN where nothing is monitored.
    emt_m : (n,) effective monitor threshold; NaN where no mode is as probable as P_EMT.
    alarm_ratio : (n,) largest solution separation over its threshold, on all `axes` but those
        of an unknown heading: from 1 a fault is detected, and the levels mean nothing. NaN where
        no test ran: without residuals, without a fix, or where nothing is monitored.
    p_not_monitored : (n,) probability of the faults that are not monitored; NaN without a fix.
    satellites : (n,) ranges in the fix.
    faults : (n,) most faults at a time that are looked at, N_fault,max.
    modes, modes_not_monitored : (n,) fault modes that are monitored, and that cannot be.
    reason : (n,) 0, a MonitorReason, or `UNMONITORED`: why there is no level.
    ranges_left_out : number of ranges that took no part, by reason.
    settings : what the figures rest on.
    findings : what was noticed about the ranges.
    masked : ranges below the elevation mask.

    Notes
    -----
    Every level contains the threshold of its own axis, so that every axis is tested. With a
    heading the false alarms of the axes along and across come on top of `pfa_h` and `pfa_v`.
    """

    axes: Axes
    level_m: Floats
    sigma_acc_m: Floats
    k_alarm: Floats
    emt_m: Floats
    alarm_ratio: Floats
    p_not_monitored: Floats
    satellites: Ints
    faults: Ints
    modes: Ints
    modes_not_monitored: Ints
    reason: Ints
    ranges_left_out: Mapping[str, int]
    settings: AraimSettings
    findings: tuple[Finding, ...] = ()
    masked: int = 0

    def on(self, axis: str) -> Floats:
        """(n,) level of an axis [m].

        Raises
        ------
        InputError : no such axis.
        """
        if axis not in self.axes:
            raise InputError(
                f"no level {axis!r}",
                where="axis",
                evidence=f"there are {', '.join(self.axes)}",
                cure="araim_levels(..., heading_deg=...)" if axis in TRACK else "",
            )
        return self.level_m[:, self.axes.index(axis)]

    @property
    def hpl_m(self) -> Floats:
        """(n,) horizontal level: root of the summed squares of the levels east and north."""
        return np.hypot(self.level_m[:, 0], self.level_m[:, 1])

    @property
    def vpl_m(self) -> Floats:
        """(n,) vertical level."""
        return self.level_m[:, 2]

    @property
    def sigma_v_acc_m(self) -> Floats:
        """(n,) 1-sigma vertical accuracy."""
        return self.sigma_acc_m[:, 2]

    @property
    def has_level(self) -> Bools:
        """(n,) the geometry has a horizontal level, whether or not a test ran."""
        return np.isfinite(self.hpl_m)

    @property
    def tested(self) -> Bools:
        """(n,) the solution separation test ran."""
        return ~np.isnan(self.alarm_ratio)

    @property
    def detected(self) -> Bools:
        """(n,) a solution separation reached its threshold; False where no test ran."""
        return self.alarm_ratio >= 1

    @property
    def available(self) -> Bools:
        """(n,) there is a horizontal level, and the separation test ran and passed."""
        return self.has_level & (self.alarm_ratio < 1)

    @property
    def reasons(self) -> list[str]:
        """Why an epoch is not available, in words; "" where it is."""
        words = np.array([reason_words(code) for code in self.reason.tolist()], dtype=object)
        rest = self.reason == 0
        words[rest & ~self.tested] = _NO_TEST
        words[rest & self.detected] = _DETECTED
        words[rest & ~self.has_level] = _INFINITE
        return [str(word) for word in words]

    def summary(self) -> pd.DataFrame:
        """A row for each epoch."""
        columns: dict[str, Any] = {"hpl_m": self.hpl_m, "vpl_m": self.vpl_m}
        columns |= {f"pl_{axis}_m": self.on(axis) for axis in self.axes[3:]}
        for name in ("available", "emt_m", "sigma_v_acc_m", "alarm_ratio", "p_not_monitored",
                     "satellites", "faults", "modes", "modes_not_monitored"):  # fmt: skip
            columns[name] = getattr(self, name)
        return pd.DataFrame(columns | {"reason": self.reasons})

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON.

        Levels are spread over the available epochs; where no epoch at all was tested, over those
        with a level, and `levels_over` says "geometry" instead of "available".
        """
        over = self.available if self.tested.any() else self.has_level
        levels = {"hpl_m": self.hpl_m, "vpl_m": self.vpl_m}
        levels |= {f"pl_{axis}_m": self.on(axis) for axis in self.axes[3:]}
        words, counts = np.unique([word for word in self.reasons if word], return_counts=True)
        settings = {
            name: dict(value) if isinstance(value, Mapping) else value
            for name, value in vars(self.settings).items()
        }
        return {
            "epochs": int(self.reason.size),
            "available": int(self.available.sum()),
            "with_level": int(self.has_level.sum()),
            "tested": int(self.tested.sum()),
            "detected": int(self.detected.sum()),
            "levels_over": "available" if self.tested.any() else "geometry",
            **{name: spread_of(values[over]) for name, values in levels.items()},
            "emt_m": spread_of(self.emt_m[over]),
            "reasons": {str(w): int(n) for w, n in zip(words, counts, strict=True)},
            "ranges_left_out": dict(self.ranges_left_out),
            "masked_ranges": self.masked,
            "settings": settings,
            "findings": [finding.to_dict() for finding in self.findings],
        }

    def __repr__(self) -> str:
        plain = self.to_dict()
        lines = [
            f"ARAIM of {plain['epochs']:,} epochs: {plain['available']:,} available, "
            f"{plain['detected']:,} with a fault detected",
            f"  with a level {plain['with_level']:,}, tested {plain['tested']:,}",
            f"  priors: satellite {self.settings.p_satellite}, constellation "
            f"{self.settings.p_constellation}; budgets {self.settings.phmi_v:g} up, "
            f"{self.settings.phmi_h:g} horizontally",
        ]
        untested = " (of the geometry: no test)" if plain["levels_over"] == "geometry" else ""
        for name, spread in plain.items():
            if name.endswith("_m") and spread["median"] is not None:
                text = f"median {spread['median']:.4g}, 95 % {spread['p95']:.4g}"
                lines.append(f"  {name:24s}{text}{untested}")
        for words, n in plain["reasons"].items():
            lines.append(f"  not available: {words}: {n:,}")
            if words == _UNMONITORED_WORDS:
                lines.append(f"    cure: {_UNMONITORED_CURE}")
        lines += [f"  ranges left out: {w}: {n:,}" for w, n in self.ranges_left_out.items()]
        if self.masked:
            lines.append(f"  ranges below the elevation mask: {self.masked:,}")
        lines += [str(finding) for finding in self.findings]
        return "\n".join(lines)


def reason_words(code: int) -> str:
    """Words of a reason code of `AraimResult`."""
    return _UNMONITORED_WORDS if code == UNMONITORED else MonitorReason(code).words
