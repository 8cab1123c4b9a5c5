"""How the software receiver works: every choice in one value that a recording keeps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from sbas.augmentation.fast_corrections import Profile
from sbas.augmentation.reception import AlarmRule
from sbas.augmentation.tables import Mode
from sbas.exceptions import InputError
from sbas.positioning.protection_levels import K_H_NPA, K_H_PA, K_V
from sbas.positioning.range_budget import LOW_ELEVATION_DEG
from sbas.positioning.receiver_noise import CLASS_2, ReceiverNoise

SolutionMode = Literal["pa", "npa", "auto"]


@dataclass(frozen=True)
class ReceiverSettings:
    """How the software receiver works.

    Parameters
    ----------
    mode : precision approach, non-precision approach, or "auto": precision approach where it has
        a fix, else the other.
    profile : "mops" as RTCA DO-229 has it, "glab" as gLAB 6.0.0 does where it differs.
    place_m : (3,) known antenna position, earth-fixed [m]: geometry and model are taken there.
    k_h, k_v : factors; by default 6.0 (PA) or 6.18 (NPA), and 5.33.
    elevation_mask_deg : satellites below are not used.
    smoothing : smooth the code by the carrier; a satellite then serves after 360 s.
    noise : model of the receiver's own errors.
    alarms : what message type 0 means; anything but "alarm" is for test signals.
    causal : use only ephemerides that had been transmitted by then.
    track_azimuth_deg : direction of a track, for the level along it.
    geo_ranging : use the SBAS satellite's own range as well.
    hal_m, val_m : alert limits; with mode "auto" a precision approach whose level reaches one
        gives way to the other mode.
    """

    mode: SolutionMode = "pa"
    profile: Profile = "mops"
    place_m: tuple[float, float, float] | None = None
    k_h: float | None = None
    k_v: float = K_V
    elevation_mask_deg: float = LOW_ELEVATION_DEG
    smoothing: bool = False
    noise: ReceiverNoise = CLASS_2
    alarms: AlarmRule = "alarm"
    causal: bool = False
    track_azimuth_deg: float | None = None
    geo_ranging: bool = False
    hal_m: float | None = None
    val_m: float | None = None

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("mode", self.mode, ("pa", "npa", "auto")),
            ("profile", self.profile, ("mops", "glab")),
            ("alarms", self.alarms, ("alarm", "as_mt2", "ignore")),
        ):
            if value not in allowed:
                raise InputError(f"{name} cannot be {value!r}", cure=f"one of {', '.join(allowed)}")
        factors = [k for k in (self.k_h, self.k_v) if k is not None]
        if not all(0 < k < math.inf for k in factors):
            raise InputError("K factors must be numbers above 0", evidence=f"{factors}")
        limits = [limit for limit in (self.hal_m, self.val_m) if limit is not None]
        if limits and (self.mode != "auto" or not min(limits) > 0):
            raise InputError(
                "alert limits above 0 m choose between the modes of mode auto",
                evidence=f"mode {self.mode}, limits {limits}",
                cure="leave them out here; every analysis has alert limits of its own",
            )
        if self.place_m is not None and not 6.3e6 < math.dist(self.place_m, (0, 0, 0)) < 6.5e6:
            raise InputError(
                "the antenna's place is not on Earth", evidence=f"{self.place_m} m",
                cure="earth-fixed coordinates X, Y, Z in metres",
            )  # fmt: skip
        if self.track_azimuth_deg is not None and not math.isfinite(self.track_azimuth_deg):
            raise InputError("the track's azimuth must be a number [deg]")
        if not 0 <= self.elevation_mask_deg < 90:
            raise InputError(
                "the elevation mask must be 0 to 90 degrees",
                evidence=f"{self.elevation_mask_deg}",
            )

    def k_h_of(self, mode: Mode) -> float:
        """The horizontal factor in a mode."""
        return self.k_h if self.k_h is not None else K_H_PA if mode == "pa" else K_H_NPA
