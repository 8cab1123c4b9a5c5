"""Ranges for ARAIM: directions, errors and constellations of epochs x satellites."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.integer[Any]]

CONSTELLATIONS = ("G", "R", "E", "C", "J", "I", "S")
"""Letters of RINEX 3."""
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
        own receiver clock. "" or None where a slot is empty.
    sigma_int_m : (n, m) 1-sigma that integrity counts with [m], the root of C_int.
    sigma_acc_m : (n, m) 1-sigma that accuracy and continuity count with [m], the root of C_acc.
    b_nom_m : (n, m) bound of the nominal bias [m].
    used : (n, m) False where a range is not in the fix; None: all.

    Raises
    ------
    InputError : shapes that do not fit, an unknown letter, a negative bias, angles that are
        radians or elevations beyond 90 deg.
    """

    elevation_deg: ArrayLike
    azimuth_deg: ArrayLike
    constellation: ArrayLike
    sigma_int_m: ArrayLike
    sigma_acc_m: ArrayLike
    b_nom_m: ArrayLike
    used: ArrayLike | None = None

    def __post_init__(self) -> None:
        elevation = np.asarray(self.elevation_deg, dtype=np.float64)
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
            value = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, _fitted(name, value, shape))
        used = np.asarray(True if self.used is None else self.used, dtype=np.bool_)
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
        angles = np.concatenate([elevation[known], azimuth[known]])
        if np.count_nonzero(known) >= 4 and (np.abs(angles) <= _RADIANS_DEG).all():
            raise InputError(
                "directions look like radians",
                where="elevation_deg, azimuth_deg",
                evidence=f"no angle above {np.abs(angles).max():.3g}",
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
        """Letters that occur, (n, m) index of each slot's letter, and slots that have one.

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
        for letter in CONSTELLATIONS:
            own = plain == letter
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


def _fitted(name: str, value: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    try:
        return np.broadcast_to(value, shape)
    except ValueError:
        raise InputError(
            f"{name} does not fit the directions",
            where=name,
            evidence=f"shape {value.shape}, directions {shape}",
        ) from None
