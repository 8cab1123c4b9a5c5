"""Variance of the receiver's own part of a range error: noise, multipath, divergence.

Source: RTCA DO-229D, J.2.4 (airborne receiver classes); the multipath term is an airborne model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ReceiverNoise:
    """sigma^2 = noise^2 + divergence^2 + (a + b exp(-elevation / c))^2; m and degrees.

    The defaults are the airborne class 2 to 4, whose multipath part does not bound multipath at
    a train: a user's own model is given by these same numbers.
    """

    noise_gps_m: float = 0.36
    noise_sbas_m: float = 1.8
    divergence_m: float = 0.0
    multipath_a_m: float = 0.13
    multipath_b_m: float = 0.53
    multipath_c_deg: float = 10.0

    def __post_init__(self) -> None:
        values = list(vars(self).values())
        if not (all(0 <= value < math.inf for value in values) and self.multipath_c_deg > 0):
            raise InputError(
                "a receiver's noise model has numbers of 0 or more, and c above 0",
                evidence=f"{vars(self)}",
            )

    def sigma_m(self, elevation_deg: Floats, is_sbas: NDArray[np.bool_]) -> Floats:
        """1-sigma [m] by elevation; SBAS ranging has its own noise."""
        noise = np.where(is_sbas, self.noise_sbas_m, self.noise_gps_m)
        multipath = self.multipath_a_m + self.multipath_b_m * np.exp(
            -elevation_deg / self.multipath_c_deg
        )
        sigma: Floats = np.sqrt(noise**2 + self.divergence_m**2 + multipath**2)
        return sigma


CLASS_2 = ReceiverNoise()
CLASS_1 = ReceiverNoise(5.0, 5.0, 0.0, 0.0, 0.0, 1.0)
"""Airborne class 1: 5 m whatever the elevation."""
