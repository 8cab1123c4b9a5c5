"""Ranges for ARAIM: directions, errors and constellations of epochs x satellites."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.monitoring.direction_units import radians_in

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.integer[Any]]

CONSTELLATIONS = ("G", "R", "E", "C", "J", "I", "S")
"""Letters of RINEX 3."""
CLOCKS = tuple(letter for letter in CONSTELLATIONS if letter != "S")
"""Letters of constellations with a time of their own; SBAS satellites (S) keep GPS time."""
_RADIANS_DEG = 6.3


@dataclass(frozen=True, eq=False)
class AraimGeometry:
    """Ranges of n epochs x m satellites.

    Everything may be of a shape that broadcasts to (n, m), such as (m,) letters or a single
    nominal bias. A range without direction, without sigmas above 0, or with a NaN nominal bias
    takes no part.

    Parameters
    ----------
    elevation_deg, azimuth_deg : (n, m) directions [deg]; NaN where there is none.
    constellation : (m,) or (n, m) letters of RINEX 3 such as "G" and "E"; every letter has its
        own receiver clock, but for "S": SBAS satellites keep GPS time, and so have the clock and
        the priors of GPS. "" or None where a slot is empty.
    sigma_int_m : (n, m) 1-sigma that integrity counts with [m], the root of C_int.
    sigma_acc_m : (n, m) 1-sigma that accuracy and continuity count with [m], the root of C_acc.
    b_nom_m : (n, m) bound of the nominal bias [m].
    used : (n, m) booleans, False where a range is not in the fix; None: all.

    Raises
    ------
    InputError : shapes that do not fit, no numbers, an unknown letter, a negative bias, angles
        that are radians or elevations beyond 90 deg.
    """

    elevation_deg: ArrayLike
    azimuth_deg: ArrayLike
    constellation: ArrayLike
    sigma_int_m: ArrayLike
    sigma_acc_m: ArrayLike
    b_nom_m: ArrayLike
    used: ArrayLike | None = None

    def __post_init__(self) -> None:
        elevation = numbers_of("elevation_deg", self.elevation_deg)
        if elevation.ndim == 1:
            elevation = elevation[None]
        if elevation.ndim != 2:
            raise InputError(
                "directions must be epochs x satellites",
                where="elevation_deg",
                evidence=f"shape {elevation.shape}",
            )
        shape = elevation.shape
        object.__setattr__(self, "elevation_deg", elevation)
        for name in ("azimuth_deg", "sigma_int_m", "sigma_acc_m", "b_nom_m"):
            value = numbers_of(name, getattr(self, name))
            object.__setattr__(self, name, _fitted(name, value, shape))
        used = np.asarray(True if self.used is None else self.used)
        if used.dtype != np.bool_:
            raise InputError(
                "which ranges are used is said by booleans",
                where="used",
                evidence=f"values of type {used.dtype}",
                cure="True or False for each range; what is not known is not used",
            )
        object.__setattr__(self, "used", _fitted("used", used, shape))
        letters = np.asarray(self.constellation)
        object.__setattr__(self, "constellation", _fitted("constellation", letters, shape))
        self._refuse_nonsense()

    def _refuse_nonsense(self) -> None:
        here = np.asarray(self.used)
        elevation, azimuth = np.asarray(self.elevation_deg), np.asarray(self.azimuth_deg)
        known = here & np.isfinite(elevation) & np.isfinite(azimuth)
        steep = known & (np.abs(elevation) > 90)
        if steep.any():
            raise InputError(
                "elevation beyond 90 deg",
                where=f"epoch {int(np.argwhere(steep)[0][0])}",
                evidence=f"{elevation[steep][0]:g}",
            )
        evidence = radians_in(elevation[known], azimuth[known], np.nonzero(known)[0])
        angles = np.abs(np.concatenate([elevation[known], azimuth[known]]))
        if not evidence and np.count_nonzero(known) >= 4 and (angles <= _RADIANS_DEG).all():
            evidence = f"no angle above {angles.max():.3g}"
        if evidence:
            raise InputError(
                "directions look like radians",
                where="elevation_deg, azimuth_deg",
                evidence=evidence,
                cure="numpy.rad2deg(...)",
            )
        negative = here & (np.asarray(self.b_nom_m) < 0)
        if negative.any():
            raise InputError(
                "the bound of a nominal bias is negative",
                where="b_nom_m",
                evidence=f"{np.asarray(self.b_nom_m)[negative][0]:g} m",
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Epochs and satellite slots."""
        n, m = np.asarray(self.elevation_deg).shape
        return n, m

    def clocks(self) -> tuple[tuple[str, ...], Ints, Bools]:
        """Clocks by letter, (n, m) index of each slot's clock, and slots that have one.

        SBAS satellites have the clock of GPS, "G".

        Raises
        ------
        InputError : a letter that RINEX 3 does not know.
        """
        letters = np.asarray(self.constellation)
        # One row serves all epochs where every epoch has the same letters in the same slots.
        plain = letters[:1] if letters.strides[0] == 0 else letters
        index = np.full(plain.shape, -1, np.int8)
        empty = (plain == "") | (plain == None) | (plain != plain)  # noqa: E711
        found: list[str] = []
        for letter in CLOCKS:
            own = plain == letter
            if letter == "G":
                own = own | (plain == "S")
            if own.any():
                index[own] = len(found)
                found.append(letter)
        strange = (index < 0) & ~empty
        if strange.any():
            raise InputError(
                f"unknown constellation {str(plain[strange][0])!r}",
                where="constellation",
                cure=f"use the letters of RINEX 3: {', '.join(CONSTELLATIONS)}",
            )
        known = np.broadcast_to(index >= 0, letters.shape)
        return tuple(found), np.broadcast_to(np.maximum(index, 0), letters.shape), known


def numbers_of(name: str, value: ArrayLike) -> Floats:
    """The numbers of an argument.

    Raises
    ------
    InputError : something else, such as text or rows of different lengths.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name} must be numbers", where=name, evidence=str(error), cure="NaN where unknown"
        ) from None


def _fitted(name: str, value: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    try:
        return np.broadcast_to(value, shape)
    except ValueError:
        raise InputError(
            f"{name} does not fit the directions",
            where=name,
            evidence=f"shape {value.shape}, directions {shape}",
        ) from None
