"""What only a truth shows: exchanged or negated coordinates, units, heights, constant offsets.

E03, E08, E09 and E12 by a bounded sample of epochs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.input_check.coordinates import UNITS_DEG, UNITS_M, CoordinateRanges, to_degrees
from sbas.input_check.judgement import Judged, judged
from sbas.input_check.sampled_epochs import SampledEpochs
from sbas.recording_survey import Survey
from sbas.timescales import NS_PER_S
from sbas.track import TrackLine, track_findings
from sbas.truth import FixedPoint, Trajectory, TruePosition, east_north_up_m

STATIC_LIMIT_KM = 1.0
MOVING_LIMIT_KM = 100.0
LEAST_EPOCHS = 60
SLOW_ERRORS_S = 6000.0
"""Span whose tenths, of 10 min, outlast the decorrelation time of SBAS errors (some 6 min)."""
SHORT_SPREADS = 10.0
"""What a constant must exceed in a shorter span, in spreads of the errors."""
GEOID_M = (10.0, 110.0)
"""Size of a mean up error that a geoid undulation explains."""
GEOID_SIGMA_M = 5.0
ANTENNA_M = (0.1, 5.0)
KNOW_GEOID = frozenset(("csv", "nmea", "rtklib_pos"))
"""Formats with heights above the geoid, whose readers take `--geoid`."""
UNIT_FITS_M = 100.0
_BLOCKS = 10

Floats = NDArray[np.float64]
PointTruth = FixedPoint | Trajectory
"""A truth that gives a position at each time; a track gives none."""


@dataclass(frozen=True)
class Comparison:
    """A sample of epochs beside the truth at their times.

    `time_ns`, `lat_deg`, `lon_deg`, `height_m`, `hpl_m` are (m,) sampled epochs; `true` the truth
    at their times (NaN where it does not reach); `far_place` a point of the truth for epochs at
    other times.
    """

    time_ns: NDArray[np.int64]
    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats
    hpl_m: Floats
    true: TruePosition
    truth: PointTruth

    @classmethod
    def of(cls, sample: SampledEpochs, truth: PointTruth) -> Comparison:
        """The comparison of a sample with a truth."""
        return cls(sample.time_ns, *sample.values(), truth.at(sample.time_ns.view("M8[ns]")), truth)

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(m,) True where the truth reaches."""
        return np.isfinite(self.true.lat_deg)

    def errors_m(self) -> tuple[Floats, Floats, Floats]:
        """East, north and up of the covered epochs [m]."""
        at = self.covered
        true = TruePosition(*(np.asarray(v)[at] for v in self.true))
        return east_north_up_m(self.lat_deg[at], self.lon_deg[at], self.height_m[at], true)

    def distance_km(self, lat_deg: Floats, lon_deg: Floats) -> float:
        """Median straight distance to the truth of (m,) positions; NaN if none is on Earth.

        Where the truth does not reach any of the epochs in time, its own nearest point counts.
        """
        possible = (np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180)
        if not possible.any() or possible.mean() < 0.5:
            return float("nan")
        here = possible & self.covered
        if here.any():
            apart = _ecef(lat_deg[here], lon_deg[here])
            apart -= _ecef(self.true.lat_deg[here], self.true.lon_deg[here])
            return float(np.median(np.linalg.norm(apart, axis=0))) / 1000
        assert not isinstance(self.truth, FixedPoint)
        table = self.truth.table
        every = max(len(table) // 2000, 1)
        track = _ecef(*(table[n].to_numpy(float)[::every] for n in ("lat_deg", "lon_deg")))
        middle = _ecef(*(np.median(v[possible], keepdims=True) for v in (lat_deg, lon_deg)))
        return float(np.nanmin(np.linalg.norm(track - middle, axis=0))) / 1000


def _ecef(lat_deg: Floats, lon_deg: Floats) -> Floats:
    return np.stack(pymap3d.geodetic2ecef(lat_deg, lon_deg, np.zeros_like(lat_deg)))


def looks_like_radians(pair: Comparison) -> bool | None:
    """Whether the sample is near the truth only as radians; None where neither is near."""
    if pair.distance_km(pair.lat_deg, pair.lon_deg) < MOVING_LIMIT_KM:
        return False
    as_degrees = pair.distance_km(np.degrees(pair.lat_deg), np.degrees(pair.lon_deg))
    return True if as_degrees < MOVING_LIMIT_KM else None


def fitting_units(pair: Comparison, ranges: CoordinateRanges) -> list[str]:
    """Units of the angles in which the sample is near the truth."""
    found = []
    for unit in ("ddmm", *UNITS_DEG):
        columns = {"lat_deg": pair.lat_deg, "lon_deg": pair.lon_deg}
        columns |= {name: to_degrees(columns[name], unit) for name in ranges.beyond(unit)}
        if pair.distance_km(columns["lat_deg"], columns["lon_deg"]) < MOVING_LIMIT_KM:
            found.append(unit)
    return found


def far_away(facts: Survey, pair: Comparison) -> Iterator[Judged]:
    """E12: positions far from the truth, with the distance of the likely mistakes."""
    lat, lon = pair.lat_deg, pair.lon_deg
    tries = {"as given": pair.distance_km(lat, lon)}
    # Signs count after the exchange, as `repair` makes them.
    tries |= {
        name: pair.distance_km(*(sign * v for sign, v in zip(signs, places, strict=True)))
        for swap, places in (("", (lat, lon)), (_SWAPPED, (lon, lat)))
        for name, signs in ((swap + minus, s) for minus, s in _SIGNS.items())
        if name
    }
    still = facts.static and isinstance(pair.truth, FixedPoint)
    limit_km = STATIC_LIMIT_KM if still else MOVING_LIMIT_KM
    if not tries["as given"] > limit_km:
        return
    listed = ", ".join(
        f"{name.strip()} {km:.4g} km" for name, km in tries.items() if np.isfinite(km)
    )
    near = [n for n in tries if tries[n] < limit_km and tries[n] < 0.1 * tries["as given"]]
    cure = "correct --truth LAT,LON,HEIGHT (degrees, latitude first)"
    repair: dict[str, object] = {}
    message = "the recording's median position is far from the truth"
    if len(near) == 1:
        words = []
        if near[0].startswith(_SWAPPED):
            words, repair = ["--swap-latlon"], {"swap_latlon": True}
        if which := _WHICH.get(near[0].removeprefix(_SWAPPED)):
            words, repair = [*words, f"--sign {which}"], {**repair, "sign": which}
        cure = " ".join(words) + ", or correct --truth"
        message += f": {near[0].strip()}?"
    yield judged("E12", "error", message, evidence=f"distance {listed}", cure=cure, repair=repair)


_SWAPPED = "latitude and longitude swapped"
_SIGNS = {"": (1, 1), " -latitude": (-1, 1), " -longitude": (1, -1),
          " -latitude -longitude": (-1, -1)}  # fmt: skip
_WHICH = {" -latitude": "lat", " -longitude": "lon", " -latitude -longitude": "both"}


def against_track(sample: SampledEpochs, line: TrackLine) -> Iterator[Judged]:
    """E01, E09 and E12 of a track centre line; where epochs are sampled, the findings say so."""
    if not sample.time_ns.size:
        return
    lat, lon, *_ = sample.values()
    for found in track_findings(line.track, lat, lon, reach_m=line.reach_m):
        note = "" if sample.stride == 1 else f"; of every {sample.stride}th position"
        yield Judged(replace(found, evidence=found.evidence + note))


def heights_in_another_unit(pair: Comparison) -> Iterator[Judged]:
    """E08: heights that fit the truth when their unit is another."""
    height = pair.height_m[pair.covered]
    true = np.asarray(pair.true.height_m)[pair.covered]
    if not np.isfinite(height).any() or abs(off := float(np.nanmedian(height - true))) <= 150:
        return
    offsets = {u: float(np.nanmedian(height * size - true)) for u, size in UNITS_M.items()}
    near = [u for u, m in offsets.items() if abs(m) <= min(UNIT_FITS_M, abs(off) / 10)]
    if not near:
        return
    yield judged(
        "E08", "error", "heights fit the truth in another unit than metres",
        evidence=f"median up error {off:.6g} m as given, "
        + ", ".join(f"{offsets[u]:.4g} m as {u}" for u in near),
        cure=f"--unit height_m={near[0]}",
        repair={"unit": {"height_m": near[0]}} if len(near) == 1 else {},
    )  # fmt: skip


def constant_offsets(pair: Comparison, formats: Collection[str] = ()) -> Iterator[Judged]:
    """E09: mean errors that a geoid, an antenna height or another frame explains.

    A receiver's own errors change slowly: a mean counts only where it exceeds six standard
    errors, by the medians of ten blocks of time, three sigma of the truth, and the spread of the
    errors; in a record too short to know slow errors, ten times their spread. None is ever
    repaired: it would fit the recording to the truth.
    """
    at = pair.covered
    if pair.truth.lower_bound or at.sum() < LEAST_EPOCHS:
        return
    time = pair.time_ns[at]
    short = int(time[-1] - time[0]) < SLOW_ERRORS_S * NS_PER_S
    east, north, up = pair.errors_m()
    sigma_h, sigma_v = (float(np.max(np.asarray(s)[at])) for s in pair.true[3:])
    mean_e, mean_n, mean_u = (_mean(v, short) for v in (east, north, up))
    across = float(np.hypot(mean_e.value, mean_n.value))
    tall = abs(mean_u.value)
    if GEOID_M[0] <= tall <= GEOID_M[1] and mean_u.spread < GEOID_SIGMA_M:
        yield judged(
            "E09", "warning", "heights differ from the truth by what a geoid undulation may be",
            evidence=f"mean up error {mean_u.value:.2f} m, spread {mean_u.spread:.2f} m",
            cure=_geoid_cure(formats),
        )  # fmt: skip
    elif ANTENNA_M[0] <= tall < GEOID_M[0] and mean_u.certain(sigma_v) and across < tall / 2:
        yield judged(
            "E09", "warning", "heights are off the truth by a constant: the antenna's height?",
            evidence=f"mean up error {mean_u.value:.2f} m, spread {mean_u.spread:.2f} m, "
            f"horizontal {across:.2f} m",
            cure="--antenna-height METRES of the antenna above the truth's mark",
        )  # fmt: skip
    largest = max(mean_e, mean_n, key=lambda mean: abs(mean.value))
    if across > 3 * sigma_h and largest.certain(sigma_h):
        azimuth = float(np.degrees(np.arctan2(mean_e.value, mean_n.value))) % 360
        yield judged(
            "E09", "warning", "positions are off the truth by a constant: another frame or mark?",
            evidence=f"mean {across:.2f} m towards {azimuth:.0f} degrees, spread "
            f"{max(mean_e.spread, mean_n.spread):.2f} m, sigma of the truth {sigma_h:.2f} m; "
            "ITRF and ETRS89 part by 2.5 cm a year since 1989",
            cure="give the truth in the recording's frame and of the antenna; --frame",
        )  # fmt: skip


def _geoid_cure(formats: Collection[str]) -> str:
    """What to state, with an option that works: not every reader knows the geoid."""
    cure = (
        "--height-offset UNDULATION (such as --height-offset 44.5: the published geoid undulation "
        "of the place, not this mean) where the recording's heights are above the geoid"
    )
    if formats and KNOW_GEOID.issuperset(formats):
        cure += ", or --geoid UNDULATION where its altitudes were read without one"
    return cure + "; --truth-geoid UNDULATION where the truth's are"


@dataclass(frozen=True)
class _Mean:
    value: float
    spread: float
    standard_error: float
    short: bool

    def certain(self, sigma_truth_m: float) -> bool:
        """Whether the mean is more than noise, slow errors and the truth's own uncertainty."""
        spread = self.spread * (SHORT_SPREADS if self.short else 1.0)
        least = max(6 * self.standard_error, 3 * sigma_truth_m, spread)
        return abs(self.value) > least


def _mean(values: Floats, short: bool) -> _Mean:
    """Median and robust spread of errors, and the standard error by means of blocks of time."""
    known = values[np.isfinite(values)]
    if known.size < LEAST_EPOCHS:
        return _Mean(0.0, np.inf, np.inf, short)
    centre = float(np.median(known))
    spread = 1.4826 * float(np.median(np.abs(known - centre)))
    blocks = [float(np.median(part)) for part in np.array_split(known, _BLOCKS)]
    return _Mean(centre, spread, float(np.std(blocks, ddof=1)) / np.sqrt(_BLOCKS), short)
