"""Settings of a laboratory recording, and their TOML files."""

from __future__ import annotations

import difflib
import math
import tomllib
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal

from sbas.bundled import bundled
from sbas.exceptions import InputError, ModelError
from sbas.laboratory.error_budget import GIVE_VARIANCE_M2, UDRE_VARIANCE_M2

SCHEMA_VERSION = 1
K_HORIZONTAL = {"npa": 6.18, "pa": 6.0}
K_VERTICAL = 5.33
"""K factors of DO-229D, J.1, as derived in Filip, Bazant, Mocek 2010, 2.1."""

Pair = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class LaboratorySettings:
    """What a simulated recording is made of; the defaults inject nothing.

    Times of events are Poisson; durations are log-uniform between the two values of a pair.

    Parameters
    ----------
    name : short name, kept as the recording's source.
    start : first epoch, GPS time. hours, interval_s : length and step of the record.
    lat_deg, lon_deg, height_m : where the antenna is (the truth), WGS 84, ellipsoidal.
    antenna : what that point is.
    slots : 24 or 27 satellites of the nominal GPS constellation.
    elevation_mask_deg : satellites below are not used; at least 4 (sigma_tropo's limit).
    mode : "npa" or "pa"; sets K_H to 6.18 or 6.0 and the column `mode`.
    geo_prn : PRN of the SBAS satellite.
    udrei_zenith, udrei_horizon, udre_elevation_scale_deg : see `error_budget.sigma_flt_m`.
    givei_night, givei_day : see `error_budget.uive_variance_m2`.
    decorrelation_time_s : 1/e time of the Gauss-Markov errors.
    error_scale : true over stated standard deviation of the position error.
    white_share : share of the error variance that is white.
    raim_false_alarm, raim_missed_detection : probabilities per epoch behind HERL and VERL.
    gaps_per_day, gap_duration_s : epochs that the receiver did not record.
    hpl_outliers_per_day, hpl_outlier_duration_s, hpl_outlier_m : HPL raised to a size uniform
        within the pair (VPL in proportion).
    satellite_losses_per_day, satellite_loss_duration_s, satellite_loss_share : times during
        which each satellite is lost with the stated probability.
    failure_rate_per_h, failure_duration_s, failure_error_m : dangerous undetected failures: HPE
        exceeds a size uniform within the pair while HPL stays as it is.
    sbas_frames : record one null message a second as side table.
    seed : of numpy's SeedSequence; the same settings give the same digits.

    Raises
    ------
    ModelError : a value that has no meaning; `where` is the key.
    """

    name: str = "laboratory"
    start: datetime = datetime(2009, 9, 19)
    hours: float = 1.0
    interval_s: float = 1.0
    lat_deg: float = 50.03
    lon_deg: float = 15.77
    height_m: float = 289.4
    antenna: str = "phase centre at the stated point"
    slots: int = 27
    elevation_mask_deg: float = 5.0
    mode: Literal["npa", "pa"] = "npa"
    geo_prn: int = 120
    udrei_zenith: int = 7
    udrei_horizon: int = 11
    udre_elevation_scale_deg: float = 12.0
    givei_night: int = 4
    givei_day: int = 8
    decorrelation_time_s: float = 360.0
    error_scale: float = 0.3
    white_share: float = 0.0
    raim_false_alarm: float = 3.33e-7
    raim_missed_detection: float = 1e-3
    gaps_per_day: float = 0.0
    gap_duration_s: Pair = (2.0, 60.0)
    hpl_outliers_per_day: float = 0.0
    hpl_outlier_duration_s: Pair = (2.0, 40.0)
    hpl_outlier_m: Pair = (60.0, 100.0)
    satellite_losses_per_day: float = 0.0
    satellite_loss_duration_s: Pair = (10.0, 300.0)
    satellite_loss_share: float = 0.3
    failure_rate_per_h: float = 0.0
    failure_duration_s: Pair = (20.0, 20.0)
    failure_error_m: Pair = (60.0, 60.0)
    sbas_frames: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        for field in fields(self):
            object.__setattr__(self, field.name, _typed(field.name, getattr(self, field.name)))
        limits: dict[str, tuple[float, float]] = {
            "hours": (0.0, 1e7), "interval_s": (0.001, 86400.0),
            "lat_deg": (-90.0, 90.0), "lon_deg": (-180.0, 180.0), "height_m": (-1e4, 1e5),
            "elevation_mask_deg": (4.0, 89.0), "geo_prn": (120, 158),
            "udrei_zenith": (0, len(UDRE_VARIANCE_M2) - 1),
            "udrei_horizon": (0, len(UDRE_VARIANCE_M2) - 1),
            "udre_elevation_scale_deg": (0.1, 1e3),
            "givei_night": (0, len(GIVE_VARIANCE_M2) - 1),
            "givei_day": (0, len(GIVE_VARIANCE_M2) - 1),
            "decorrelation_time_s": (1e-6, 1e9), "error_scale": (0.0, 1e3),
            "white_share": (0.0, 1.0), "satellite_loss_share": (0.0, 1.0),
            "raim_false_alarm": (1e-300, 0.5), "raim_missed_detection": (1e-300, 0.5),
            "gaps_per_day": (0.0, 1e5), "hpl_outliers_per_day": (0.0, 1e5),
            "satellite_losses_per_day": (0.0, 1e5), "failure_rate_per_h": (0.0, 3600.0),
            "seed": (0, math.inf),
        }  # fmt: skip
        for key, (low, high) in limits.items():
            value = getattr(self, key)
            if not low <= value <= high:
                raise ModelError(
                    f"{key} is out of range", where=key, evidence=f"{value}, not in {low}..{high}"
                )
        for key in _PAIRS:
            low, high = getattr(self, key)
            if not 0 < low <= high < math.inf:
                raise ModelError(
                    f"{key} is no range of positive values", where=key,
                    evidence=f"{[low, high]}", cure=f"{key} = [shortest, longest]",
                )  # fmt: skip
        for key, known in _CHOICES.items():
            if getattr(self, key) not in known:
                raise ModelError(
                    f"{key} is not known", where=key, evidence=repr(getattr(self, key)),
                    cure=f"one of {', '.join(map(str, known))}",
                )  # fmt: skip
        if not datetime(1980, 1, 6) <= self.start < datetime(2200, 1, 1):
            raise ModelError("start is outside GPS time", where="start", evidence=str(self.start))
        if self.epochs < 1:
            raise ModelError(
                "the record has no epoch", where="hours", evidence=f"{self.hours} h",
                cure=f"hours of at least {self.interval_s / 3600:.3g}",
            )  # fmt: skip

    @property
    def epochs(self) -> int:
        """Epochs of the record, gaps included."""
        return round(self.hours * 3600 / self.interval_s)

    @property
    def k_h(self) -> float:
        return K_HORIZONTAL[self.mode]

    def to_strings(self) -> dict[str, str]:
        """Every setting as plain text, for the metadata of a recording."""
        return {key: str(value) for key, value in asdict(self).items()}


_TYPES = {field.name: field.type for field in fields(LaboratorySettings)}
_PAIRS = tuple(key for key, kind in _TYPES.items() if kind == "Pair")
_CHOICES: dict[str, tuple[Any, ...]] = {"mode": tuple(K_HORIZONTAL), "slots": (24, 27)}


def _typed(key: str, value: Any) -> Any:
    """The value as its field's type; ModelError where it is of another kind."""
    kind = _TYPES[key]
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    match kind:
        case "float" if is_number:
            return float(value)
        case "int" if is_number and isinstance(value, Integral):
            return int(value)
        case "Pair" if isinstance(value, (list, tuple)) and len(value) == 2:
            if all(isinstance(part, Real) and not isinstance(part, bool) for part in value):
                return (float(value[0]), float(value[1]))
        case "datetime" if isinstance(value, datetime) and value.tzinfo is None:
            return value
        case "bool" if isinstance(value, bool):
            return value
        case "float" | "int" | "Pair" | "datetime" | "bool":
            pass
        case _ if isinstance(value, str):
            return value
    raise ModelError(f"{key} has the wrong type", where=key, evidence=f"{value!r}, expected {kind}")


def load_settings(path: str | Path) -> LaboratorySettings:
    """Settings from a TOML file with `schema = 1`; keys that are absent take their default.

    Parameters
    ----------
    path : TOML file; its keys are the fields of `LaboratorySettings`.

    Raises
    ------
    InputError : no such file. ModelError : not TOML, another schema, an unknown key (with the
        nearest known one and the whole list) or a value without meaning.
    """
    path = Path(path)
    try:
        plain = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            "the settings cannot be read", where=path.name, evidence=str(error.strerror),
            cure="name a TOML file such as data/laboratory_2009.toml",
        ) from error  # fmt: skip
    except ValueError as error:
        raise ModelError("not a TOML file", where=path.name, evidence=str(error)) from error
    schema = plain.pop("schema", None)
    if schema != SCHEMA_VERSION:
        raise ModelError(
            "unknown schema of laboratory settings", where=f"{path.name}: schema",
            evidence=repr(schema), cure=f"schema = {SCHEMA_VERSION}",
        )  # fmt: skip
    for key in plain:
        if key not in _TYPES:
            near = difflib.get_close_matches(key, _TYPES, n=1)
            raise ModelError(
                f"unknown key {key!r}" + (f"; nearest is {near[0]!r}" if near else ""),
                where=f"{path.name}: {key}",
                cure=f"known keys are {', '.join(_TYPES)}",
            )
    return LaboratorySettings(**plain)


def bundled_settings() -> LaboratorySettings:
    """Settings of the 3.5-day recording that `make demo` shows."""
    return load_settings(bundled("laboratory_2009.toml"))
