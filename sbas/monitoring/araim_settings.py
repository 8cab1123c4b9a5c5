"""What ARAIM is told: priors of faults, budgets of integrity and of continuity.

Source: EU-US Working Group C, ARAIM Technical Subgroup, "ARAIM Airborne Algorithm Algorithm
Description Document", version 3.0, 15 November 2017; defaults are those of its Appendix D
(LPV-200), an aircraft's approach of 150 s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]

AxisBudget = Literal["along", "split"]
PerConstellation = float | Mapping[str, float]
"""One value for all, or one for each constellation letter of RINEX 3."""


@dataclass(frozen=True)
class AraimSettings:
    """Priors and budgets of ARAIM; probabilities per approach of 150 s by default.

    Parameters
    ----------
    p_satellite : prior of a fault of one satellite, in [0, 1); SBAS satellites have that of GPS.
    p_constellation : prior of a fault of a whole constellation, in [0, 1). A single constellation
        gets a finite level only where this is far below the integrity budgets.
    phmi_v, phmi_h : integrity risk allowed up and horizontally, in [0, 1). With `phmi_v=0` there
        is no vertical level.
    pfa_v, pfa_h : probability of a false alarm allowed up and horizontally, in (0, 1).
    p_thres : risk of more faults at a time than are looked at that may be left.
    p_emt : modes at least this probable count for the effective monitor threshold.
    most_faults : never look at more faults at a time than this; what that leaves unmonitored is
        charged to the integrity budgets. None: as many as `p_thres` asks for.
    axis_budget : budgets of the levels along and across a track. "along": each alone has all of
        `phmi_h` and `pfa_h`, so that one of the two may be claimed; "split": half each, so that
        both hold together.
    """

    p_satellite: PerConstellation = 1e-5
    p_constellation: PerConstellation = 1e-4
    phmi_v: float = 9.8e-8
    phmi_h: float = 2e-9
    pfa_v: float = 3.9e-6
    pfa_h: float = 9e-8
    p_thres: float = 8e-8
    p_emt: float = 1e-5
    most_faults: int | None = None
    axis_budget: AxisBudget = "along"

    def __post_init__(self) -> None:
        for name in ("p_satellite", "p_constellation"):
            value = getattr(self, name)
            for number in value.values() if isinstance(value, Mapping) else (value,):
                _require_probability(name, number, or_zero=True)
            if isinstance(value, Mapping) and "S" in value:
                raise InputError(
                    "SBAS satellites keep GPS time: they have the priors of GPS",
                    where=name,
                    evidence=f"a value for S: {value['S']!r}",
                    cure="leave S out; G counts for both",
                )
        for name in ("phmi_v", "phmi_h"):
            _require_probability(name, getattr(self, name), or_zero=True)
        _require_probability("phmi_v + phmi_h", self.phmi_v + self.phmi_h)
        for name in ("pfa_v", "pfa_h", "p_thres", "p_emt"):
            _require_probability(name, getattr(self, name))
        if self.most_faults is not None and (
            isinstance(self.most_faults, bool)
            or not isinstance(self.most_faults, int)
            or self.most_faults < 1
        ):
            raise _wrong("most_faults", self.most_faults, "a whole number from 1, or None")
        if self.axis_budget not in ("along", "split"):
            raise InputError(
                "unknown axis budget",
                where="axis_budget",
                evidence=repr(self.axis_budget),
                cure="use 'along' or 'split'",
            )

    def risk_shares(self, axes: tuple[str, ...]) -> Floats:
        """(q,) integrity risk of each axis, before what is unmonitored is taken off."""
        track = self.phmi_h / self._tracks
        shares = {"east": self.phmi_h / 2, "north": self.phmi_h / 2, "up": self.phmi_v}
        return np.array([shares.get(axis, track) for axis in axes])

    def alarm_tails(self, axes: tuple[str, ...]) -> Floats:
        """(q,) one tail of the false-alarm probability of each axis, over all modes."""
        track = self.pfa_h / (2 * self._tracks)
        tails = {"east": self.pfa_h / 4, "north": self.pfa_h / 4, "up": self.pfa_v / 2}
        return np.array([tails.get(axis, track) for axis in axes])

    @property
    def _tracks(self) -> int:
        return 2 if self.axis_budget == "split" else 1


def by_constellation(name: str, value: PerConstellation, letters: tuple[str, ...]) -> Floats:
    """(c,) values of the constellations.

    Raises
    ------
    InputError : a constellation for which the mapping has none.
    """
    if not isinstance(value, Mapping):
        return np.full(len(letters), float(value))
    missing = [letter for letter in letters if letter not in value]
    if missing:
        raise InputError(
            f"no {name} for constellation {', '.join(missing)}",
            where=name,
            evidence=f"given for {', '.join(map(str, value)) or 'none'}",
            cure=f"{name}={{..., {missing[0]!r}: ...}}, or mask its satellites",
        )
    return np.array([float(value[letter]) for letter in letters])


def _require_probability(name: str, value: object, *, or_zero: bool = False) -> None:
    number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    if not (0 < number < 1 or (or_zero and number == 0)):
        raise _wrong(name, value, "a number in [0, 1)" if or_zero else "a number in (0, 1)")


def _wrong(name: str, value: object, range_text: str) -> InputError:
    return InputError(
        f"{name} must be {range_text}", where=name, evidence=f"{value!r}",
        cure=f"give {name} {range_text}",
    )  # fmt: skip
