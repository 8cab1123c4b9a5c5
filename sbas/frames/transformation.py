"""Coordinates from one reference frame to another, by operations that EPSG names.

No grid is fetched, no operation of unknown accuracy is used, and none is chosen in silence where
several contradict each other.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pymap3d
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.frames.named_frames import Frame, FrameChange, Step

Floats = NDArray[np.float64]

SAME_EPOCH_YEARS = 0.02
"""Epochs closer than a week are one: Europe moves by half a millimetre in it."""

PLATE_M_PER_YEAR = 0.025
"""How fast ITRF and ETRS89 part in Europe since 1989 (EUREF Technical Note 1)."""

_AGREED_M = 1e-3  # operations that claim to be exact and agree so far are one
_NOT_A_CHANGE = ("axis order change", "Conversion from", "Null geographic offset")


class Changed(NamedTuple):
    """Coordinates in another frame: (n,) deg, deg, m; what was done, and how well it is known."""

    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats
    frame: Frame
    sigma_m: float
    description: str


def decimal_year(time: ArrayLike) -> Floats:
    """(n,) times as decimal years, by the length of each calendar year."""
    at = np.asarray(time, "M8[ns]")
    year = at.astype("M8[Y]")
    begin, end = year.astype("M8[ns]"), (year + np.timedelta64(1, "Y")).astype("M8[ns]")
    share = (at - begin).astype(float) / (end - begin).astype(float)
    return np.asarray(year.astype(int) + 1970 + share, dtype=float)


def unprojected(frame: Frame, easting_m: ArrayLike, northing_m: ArrayLike) -> tuple[Floats, Floats]:
    """Latitude and longitude [deg] of (n,) projected coordinates [m], in the frame's own datum."""
    from pyproj import CRS, Transformer

    if frame.projection is None:
        raise InputError(
            f"{frame.name} is not projected", cure="--frame EPSG:25833, the code of the projection"
        )
    projected = CRS.from_epsg(frame.projection)
    with _no_network():
        inverse = Transformer.from_crs(
            projected, projected.geodetic_crs, always_xy=True, allow_ballpark=False, only_best=True
        )
    lon, lat = inverse.transform(np.asarray(easting_m, float), np.asarray(northing_m, float))
    lat, lon = np.asarray(lat), np.asarray(lon)
    if not (np.isfinite(lat).all() and np.isfinite(lon).all()):
        raise InputError(
            f"easting and northing do not lie within EPSG:{frame.projection}",
            cure="check the order of the columns, and the code",
        )
    return lat, lon


def change_frame(
    change: FrameChange,
    lat_deg: ArrayLike,
    lon_deg: ArrayLike,
    height_m: ArrayLike,
    *,
    epoch: ArrayLike | None = None,
) -> Changed:
    """Coordinates in the frame that a change leads to.

    Heights of a frame without heights of its own (S-JTSK and the like) are taken as heights
    above the ellipsoid of the frame that follows, unchanged.

    Parameters
    ----------
    change : of `frame_change`.
    lat_deg, lon_deg, height_m : (n,) in the change's source frame [deg, deg, m].
    epoch : decimal years of the coordinates, one or (n,), where known; a stated epoch of the
        source frame goes before it.

    Returns
    -------
    Changed; `sigma_m` is the root sum of squares of the accuracies that EPSG states.

    Raises
    ------
    InputError : no operation between two frames at this place, one that is not told apart, or
        an epoch that is missing or contradicts another.
    """
    lat, lon, height = (np.array(v, float, ndmin=1) for v in (lat_deg, lon_deg, height_m))
    now = change.source.epoch if change.source.epoch is not None else epoch
    at, variance, done = change.source, 0.0, []
    for step in change.steps:
        target = step.target
        _check_epochs(at, now, target)
        found = _operation(at, step, lat, lon, height)
        moving = _depends_on_time(found.transformer, lat, lon, height)
        when = target.epoch if target.epoch is not None else now
        if moving and when is None:
            raise InputError(
                f"between {at.name} and {target.name} coordinates depend on the epoch",
                cure=f"say when: '{at.name}>{target.name}@2025.5'",
            )
        years = np.broadcast_to(np.asarray(2000.0 if when is None else when, float), lat.shape)
        lon, lat, height, _ = (
            np.asarray(v) for v in found.transformer.transform(lon, lat, height, years)
        )
        if not np.isfinite(np.stack([lat, lon, height])).all():
            raise InputError(f"a position has no place in {target.name}", cure="check the frame")
        variance += found.accuracy_m**2
        now = when if moving or target.epoch is not None else now
        text = f"{at.name} to {target.name}"
        text += f" at {np.mean(years):.7g}" if moving else ""
        done.append(f"{text} by {found.name}, accuracy {found.accuracy_m:g} m{found.remark}")
        at = target
    last = None if now is None or not at.dynamic else float(np.mean(np.asarray(now, float)))
    return Changed(
        lat, lon, height, replace(at, epoch=last), float(np.sqrt(variance)), "; ".join(done)
    )


def _check_epochs(at: Frame, now: ArrayLike | None, target: Frame) -> None:
    if at.is_wgs84_ensemble or target.is_wgs84_ensemble:
        raise InputError(
            "'WGS 84' alone is known to 2 m: several realisations share the name",
            evidence=f"{at.name} to {target.name}",
            cure="name the realisation: 'WGS 84 (G2139)', ITRF2014, or the frame of the survey",
        )
    if not at.dynamic or now is None or target.epoch is None:
        return
    apart = float(np.max(np.abs(np.asarray(now, float) - target.epoch)))
    if apart > SAME_EPOCH_YEARS:
        raise InputError(
            f"coordinates in {at.name} are not of the epoch {target.epoch:.7g}",
            evidence=f"{apart:.3g} years apart: a point in Europe moves by "
            f"{apart * PLATE_M_PER_YEAR:.2g} m",
            cure=f"'{at.name} 2010.0>ETRF2014>ITRF2014@2025.5' where 2010.0 is the epoch of the "
            "coordinates: at rest on the European plate",
        )


class _Operation(NamedTuple):
    transformer: Any
    name: str
    accuracy_m: float
    remark: str


def _operation(at: Frame, step: Step, lat: Floats, lon: Floats, height: Floats) -> _Operation:
    """The most accurate operation that is valid at the place, if the others do not gainsay it."""
    from pyproj.aoi import AreaOfInterest
    from pyproj.transformer import TransformerGroup

    edge = 1e-3  # degrees: an area must not be a point
    box = AreaOfInterest(
        max(float(lon.min()) - edge, -180.0), max(float(lat.min()) - edge, -90.0),
        min(float(lon.max()) + edge, 180.0), min(float(lat.max()) + edge, 90.0),
    )  # fmt: skip
    with _no_network(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a missing grid; told in the remark
        group = TransformerGroup(
            f"EPSG:{at.code}", f"EPSG:{step.target.code}", always_xy=True, allow_ballpark=False,
            area_of_interest=box,  # type: ignore[arg-type]
        )  # fmt: skip
    usable = [t for t in group.transformers if t.accuracy is not None and t.accuracy >= 0]
    named = [t for t in usable if step.operation.casefold() in t.description.casefold()]
    lacking = [(o, list(o.grids)) for o in group.unavailable_operations if list(o.grids)]
    if not named:
        cure = "check the names and the place"
        if usable:
            cure = "put words of one of these in brackets"
        elif "ETRS89" not in (at.name, step.target.name):
            cure = f"go through another frame: '{at.name}>ETRS89>{step.target.name}@2025.5'"
        raise InputError(
            f"no transformation from {at.name} to {step.target.name}"
            + (f" is named {step.operation!r}" if usable else " at this place"),
            where=f"{lat.mean():.4f}, {lon.mean():.4f}",
            evidence="; ".join(_listed(usable))
            or "; ".join(f"{o.name} needs the grid {g[0].short_name}" for o, g in lacking[:3]),
            cure=cure,
        )
    best = min(named, key=lambda t: t.accuracy)  # the first of equals is PROJ's own choice
    middle = tuple(float(np.mean(v)) for v in (lon, lat, height))
    home = _ecef(best, middle)
    spread = [float(np.linalg.norm(_ecef(t, middle) - home)) for t in named]
    for other, apart in zip(named, spread, strict=True):
        if apart > max(_AGREED_M, best.accuracy + other.accuracy):
            raise InputError(
                f"transformations from {at.name} to {step.target.name} contradict each other",
                evidence="; ".join(map("{} ({:.3f} m)".format, _listed(named), spread)),
                cure="put words of the one to use in brackets behind the frame",
            )
    remark = ""
    if max(spread) > _AGREED_M:
        remark = f" ({len(named)} operations part by up to {max(spread):.2g} m)"
    for operation, grids in lacking[:1]:
        if 0 <= operation.accuracy < best.accuracy:
            remark += f" ({operation.accuracy:g} m with the grid {grids[0].short_name}, absent)"
    return _Operation(best, f"'{_short(best)}'", float(best.accuracy), remark)


def _ecef(transformer: Any, place: tuple[float, ...]) -> Floats:
    lon, lat, height, _ = transformer.transform(*place, 2020.0)
    return np.array(pymap3d.geodetic2ecef(lat, lon, height))


def _depends_on_time(transformer: Any, lat: Floats, lon: Floats, height: Floats) -> bool:
    place = tuple(float(np.mean(v)) for v in (lon, lat, height))
    early, late = (np.array(transformer.transform(*place, year)[:3]) for year in (2000.0, 2030.0))
    return bool(np.any(early != late))


def _short(transformer: Any) -> str:
    parts = transformer.description.split(" + ")
    return " + ".join(p for p in parts if not p.startswith(_NOT_A_CHANGE)) or parts[0]


def _listed(transformers: list[Any]) -> list[str]:
    return [f"{_short(t)}, accuracy {t.accuracy:g} m" for t in transformers[:6]]


@contextmanager
def _no_network() -> Iterator[None]:
    """PROJ fetches no grid within; a figure must not depend on what a server had that day."""
    from pyproj import network

    before = network.is_network_enabled()  # type: ignore[attr-defined]
    network.set_network_enabled(active=False)  # type: ignore[attr-defined]
    try:
        yield
    finally:
        network.set_network_enabled(active=before)  # type: ignore[attr-defined]
