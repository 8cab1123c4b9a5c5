"""A laboratory recording from its settings, piece by piece.

Blocks of a fixed number of epochs are computed one after another and only then cut into pieces,
so the digits depend on the settings alone, and a longer record begins with the shorter one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray
from scipy.special import ndtri

from sbas.exceptions import InputError
from sbas.laboratory.constellation import SLOTS_24, SLOTS_27, satellite_enu_m, slot_harmonics
from sbas.laboratory.error_budget import (
    obliquity,
    sigma_air_m,
    sigma_flt_m,
    sigma_tropo_m,
    uive_variance_m2,
)
from sbas.laboratory.geometry import (
    Covariance,
    centred,
    external_reliability_m,
    position_covariance,
)
from sbas.laboratory.null_messages import null_frame_table
from sbas.laboratory.processes import Events, gauss_markov, poisson_events
from sbas.laboratory.settings import K_VERTICAL, LaboratorySettings, bundled_settings
from sbas.recording import (
    BATCH_ROWS,
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    Source,
    major_semi_axis_m,
    mode_categories,
)
from sbas.timescales import NS_PER_S, gps_to_utc, gpst_minus_utc_s
from sbas.version import __version__

MODEL_VERSION = "1"
"""Changes whenever the same settings give other digits."""

_BLOCK = 2048
_FAST_CORRECTION_PERIOD_S = 6
_STATED_RISK = {"npa": (5e-9, "independent sample"), "pa": (2e-9, "150 s")}
"""Fault-free horizontal allocation; Filip, Bazant, Mocek 2010, 2.1 and eq. 2."""

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class _Injected:
    """The four kinds of injected events of one record."""

    gap: Events
    hpl_outlier: Events
    satellite_loss: Events
    failure: Events


def simulate(
    settings: LaboratorySettings | None = None,
    *,
    hours: float | None = None,
    seed: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Recording:
    """A laboratory recording from the documented model (docs/methods/laboratory.md).

    Parameters
    ----------
    settings : what to simulate; by default the bundled 3.5-day recording.
    hours, seed : take the place of the settings' own.
    progress : called with (epochs done, epochs in all).

    Returns
    -------
    Recording with the side tables `injected` (time, kind, duration_s, size_m: what was put in)
    and, unless switched off, `sbas_frames`.

    Raises
    ------
    ModelError : hours or seed without meaning.
    """
    chosen = bundled_settings() if settings is None else settings
    if hours is not None:
        chosen = replace(chosen, hours=hours)
    if seed is not None:
        chosen = replace(chosen, seed=seed)
    (whole,) = simulate_pieces(chosen, piece_epochs=chosen.epochs, progress=progress)
    return whole


def simulate_pieces(
    settings: LaboratorySettings,
    *,
    piece_epochs: int = BATCH_ROWS,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Recording]:
    """The same recording in consecutive pieces, with memory for one piece only.

    Parameters
    ----------
    settings : what to simulate.
    piece_epochs : epochs of a piece before gaps are left out; does not change any digit.
    progress : called with (epochs done, epochs in all).

    Yields
    ------
    Recording : the next `piece_epochs` epochs, with their part of the side tables. A piece that
        lies wholly in a gap has no row.
    """
    if piece_epochs < 1:
        raise InputError("a piece has at least one epoch", evidence=f"piece_epochs={piece_epochs}")
    seeds = np.random.SeedSequence(settings.seed).spawn(5)
    injected = _injected_events(settings, seeds[:4])
    meta = _meta(settings)
    blocks = _blocks(settings, injected, np.random.default_rng(seeds[4]))
    held: list[Arrays] = []
    for first in range(0, settings.epochs, piece_epochs):
        last = min(first + piece_epochs, settings.epochs)
        while not held or held[-1]["epoch"][-1] < last - 1:
            held.append(next(blocks))
        whole = {
            key: held[0][key] if len(held) == 1 else np.concatenate([b[key] for b in held])
            for key in held[0]
        }
        count = last - first
        # Copies, so that a short remainder does not keep a whole piece alive.
        held = [{key: values[count:].copy() for key, values in whole.items()}]
        if not len(held[0]["epoch"]):
            held = []
        yield _piece({key: v[:count] for key, v in whole.items()}, settings, injected, meta)
        if progress is not None:
            progress(last, settings.epochs)


def _injected_events(
    settings: LaboratorySettings, seeds: list[np.random.SeedSequence]
) -> _Injected:
    s = settings
    kinds = (
        (s.gaps_per_day / 24, s.gap_duration_s, 0),
        (s.hpl_outliers_per_day / 24, s.hpl_outlier_duration_s, 1),
        (s.satellite_losses_per_day / 24, s.satellite_loss_duration_s, s.slots),
        (s.failure_rate_per_h, s.failure_duration_s, 2),
    )
    drawn = (
        poisson_events(
            np.random.default_rng(seed),
            rate_per_h=rate,
            duration_s=duration,
            interval_s=s.interval_s,
            epochs=s.epochs,
            width=width,
        )
        for (rate, duration, width), seed in zip(kinds, seeds, strict=True)
    )
    return _Injected(*drawn)


def _between(pair: tuple[float, float], uniform: NDArray[np.float64]) -> NDArray[np.float64]:
    low, high = pair
    return low + (high - low) * uniform


def _blocks(
    settings: LaboratorySettings, injected: _Injected, generator: np.random.Generator
) -> Iterator[Arrays]:
    """Arrays of consecutive epochs, always computed for whole blocks, the last one then cut."""
    s = settings
    slots = SLOTS_24 if s.slots == 24 else SLOTS_27
    harmonics = slot_harmonics(slots, lat_deg=s.lat_deg, lon_deg=s.lon_deg, height_m=s.height_m)
    start_ns = np.datetime64(s.start, "ns").astype(np.int64)
    step_ns = round(s.interval_s * NS_PER_S)
    state = generator.standard_normal(3)
    for first in range(0, s.epochs, _BLOCK):
        epoch = np.arange(first, first + _BLOCK)
        time = (start_ns + epoch * step_ns).view("M8[ns]")
        noise = generator.standard_normal((6, _BLOCK))
        slow = gauss_markov(noise[:3], state, interval_s=s.interval_s, tau_s=s.decorrelation_time_s)
        state = slow[:, -1]
        normalised = np.sqrt(1 - s.white_share) * slow + np.sqrt(s.white_share) * noise[3:]
        lost = np.zeros((s.slots, _BLOCK), bool)
        for event, part in injected.satellite_loss.within(first, first + _BLOCK):
            gone = injected.satellite_loss.uniform[event] < s.satellite_loss_share
            lost[gone, part] = True
        arrays, covariance = _stated(s, satellite_enu_m(harmonics, time), lost, time)
        enu = _position_error(covariance, s.error_scale * normalised)
        _raise_protection_levels(arrays, s, injected.hpl_outlier, first)
        _fail(enu, s, injected.failure, first)
        lat, lon, height = pymap3d.enu2geodetic(*enu, s.lat_deg, s.lon_deg, s.height_m)
        gone = np.zeros(_BLOCK + 1, bool)
        for _, part in injected.gap.within(first - 1, first + _BLOCK):
            gone[part] = True
        arrays["flags"][gone[:-1] & ~gone[1:]] |= np.uint32(Flag.AFTER_GAP)
        arrays |= {"lat_deg": lat, "lon_deg": lon, "height_m": height, "present": ~gone[1:]}
        arrays |= {"epoch": epoch, "time": time}
        keep = min(_BLOCK, s.epochs - first)
        yield {key: values[:keep] for key, values in arrays.items()}


def _stated(
    settings: LaboratorySettings,
    enu: NDArray[np.float64],
    lost: NDArray[np.bool_],
    time: NDArray[np.datetime64],
) -> tuple[Arrays, Covariance]:
    """What the receiver states of a block: geometry, sigmas, protection levels, RAIM levels."""
    s = settings
    distance = np.sqrt(np.einsum("kst,kst->st", enu, enu))
    sine = enu[2] / distance
    seen = sine >= np.sin(np.radians(s.elevation_mask_deg))
    rising = np.any(seen, axis=1)
    seen, lost = seen[rising], lost[rising]
    line_of_sight = enu[:, rising] / distance[rising]
    used = seen & ~lost
    elevation = np.degrees(np.arcsin(np.where(seen, sine[rising], 1.0)))
    uive = uive_variance_m2(
        time, lon_deg=s.lon_deg, givei_night=s.givei_night, givei_day=s.givei_day
    )
    variance = (
        sigma_flt_m(
            elevation,
            udrei_zenith=s.udrei_zenith,
            udrei_horizon=s.udrei_horizon,
            elevation_scale_deg=s.udre_elevation_scale_deg,
        )
        ** 2
        + obliquity(elevation) ** 2 * uive
        + sigma_tropo_m(elevation) ** 2
        + sigma_air_m(elevation) ** 2
    )
    equal = used.astype(np.float64)
    dop = position_covariance(centred(line_of_sight, equal), equal)
    weight = np.where(used, 1 / variance, 0.0)
    rows = centred(line_of_sight, weight)
    cov = position_covariance(rows, weight)
    noncentrality = -float(ndtri(s.raim_false_alarm / 2)) - float(ndtri(s.raim_missed_detection))
    herl, verl = external_reliability_m(rows, weight, cov, noncentrality=noncentrality)
    sigma_e, sigma_n, sigma_u = np.sqrt(cov.ee), np.sqrt(cov.nn), np.sqrt(cov.uu)
    solved = ~np.isnan(sigma_e)
    still = np.where(solved, 0.0, np.nan)
    age = (time.astype(np.int64) // NS_PER_S) % _FAST_CORRECTION_PERIOD_S + 1.0
    arrays: Arrays = {
        "hpl_m": s.k_h * major_semi_axis_m(sigma_e, sigma_n, cov.en),
        "vpl_m": K_VERTICAL * sigma_u,
        "hdop": np.sqrt(dop.ee + dop.nn),
        "vdop": np.sqrt(dop.uu),
        "pdop": np.sqrt(dop.ee + dop.nn + dop.uu),
        "n_sv": used.sum(axis=0).astype(np.int16),
        "solved": solved,
        "sigma_e_m": sigma_e,
        "sigma_n_m": sigma_n,
        "sigma_u_m": sigma_u,
        "cov_en_m2": np.where(solved, cov.en, np.nan),
        "speed_mps": still,
        "vel_e_mps": still,
        "vel_n_mps": still,
        "vel_u_mps": still,
        "herl_m": herl,
        "verl_m": verl,
        "correction_age_s": np.where(solved, age, np.nan),
        "flags": np.where(np.isnan(herl), Flag.RAIM_NOT_AVAILABLE, Flag.RAIM_PASSED).astype("u4"),
    }
    return arrays, cov


def _position_error(covariance: Covariance, normalised: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, n) east, north, up errors [m] with the stated covariance from (3, n) unit processes.

    Lower Cholesky factor of the 3x3 covariance, written out.
    """
    c = covariance
    l11 = np.sqrt(c.ee)
    l21, l31 = c.en / l11, c.eu / l11
    l22 = np.sqrt(c.nn - l21**2)
    l32 = (c.nu - l31 * l21) / l22
    l33 = np.sqrt(c.uu - l31**2 - l32**2)
    z1, z2, z3 = normalised
    return np.stack([l11 * z1, l21 * z1 + l22 * z2, l31 * z1 + l32 * z2 + l33 * z3])


def _raise_protection_levels(
    arrays: Arrays, settings: LaboratorySettings, outliers: Events, first: int
) -> None:
    """Raise HPL to the size of the outliers that touch the block; VPL in proportion."""
    size = _between(settings.hpl_outlier_m, outliers.uniform[:, 0])
    for event, part in outliers.within(first, first + _BLOCK):
        hpl = arrays["hpl_m"][part]
        # An outlier never lowers a protection level.
        factor = np.maximum(size[event] / hpl, 1.0)
        arrays["hpl_m"][part] = hpl * factor
        arrays["vpl_m"][part] *= factor


def _fail(
    enu: NDArray[np.float64], settings: LaboratorySettings, failures: Events, first: int
) -> None:
    """Add the failures that touch the block: the error points one way, beyond the size."""
    size = _between(settings.failure_error_m, failures.uniform[:, 0])
    hpe = np.hypot(enu[0], enu[1])
    largest = np.zeros(_BLOCK)
    for event, part in failures.within(first, first + _BLOCK):
        bearing = 2 * np.pi * failures.uniform[event, 1]
        for axis, share in enumerate((np.sin(bearing), np.cos(bearing))):
            pushed = (size[event] + hpe[part]) * share
            enu[axis, part] = np.where(size[event] > largest[part], pushed, enu[axis, part])
        largest[part] = np.maximum(largest[part], size[event])


_ORDER = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "n_sv",
    "mode", "geo_prn", "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2",
    "speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps", "herl_m", "verl_m", "correction_age_s",
    "flags",
)  # fmt: skip


def _piece(
    arrays: Arrays, settings: LaboratorySettings, injected: _Injected, meta: RecordingMeta
) -> Recording:
    """The recording of consecutive epochs, those in gaps left out, with its side tables."""
    present, epoch = arrays["present"], arrays["epoch"]
    kept = {key: v if present.all() else v[present] for key, v in arrays.items()}
    code = np.where(kept["solved"], MODES.index(f"sbas_{settings.mode}"), MODES.index("none"))
    geo = np.where(kept["solved"], settings.geo_prn, -1).astype(np.int16)
    columns = {**kept, "mode": mode_categories(code), "geo_prn": geo}
    table = pd.DataFrame(
        {name: columns[name] for name in _ORDER},
        index=pd.DatetimeIndex(kept["time"], name="time"),
    )
    side = {"injected": _injected_table(settings, injected, int(epoch[0]), int(epoch[-1]) + 1)}
    if settings.sbas_frames:
        side["sbas_frames"] = _frames(arrays, settings)
    return Recording(table, meta, side)


def _frames(arrays: Arrays, settings: LaboratorySettings) -> pd.DataFrame:
    """One null message for each whole second that the receiver recorded."""
    ns = arrays["time"].astype(np.int64)
    step_ns = round(settings.interval_s * NS_PER_S)
    first_s = -(-int(ns[0]) // NS_PER_S)
    second_ns = np.arange(first_s * NS_PER_S, int(ns[-1]) + step_ns, NS_PER_S)
    recorded = arrays["present"][(second_ns - ns[0]) // step_ns]
    return null_frame_table(second_ns[recorded].view("M8[ns]"), prn=settings.geo_prn)


def _injected_table(
    settings: LaboratorySettings, injected: _Injected, first: int, last: int
) -> pd.DataFrame:
    """What was injected from epoch `first` up to `last`, by the epoch of its beginning."""
    start_ns = np.datetime64(settings.start, "ns").astype(np.int64)
    step_ns = round(settings.interval_s * NS_PER_S)
    sizes = {
        "gap": None,
        "hpl_outlier": settings.hpl_outlier_m,
        "satellite_loss": None,
        "failure": settings.failure_error_m,
    }
    parts = []
    for kind, pair in sizes.items():
        events: Events = getattr(injected, kind)
        here = (events.start >= first) & (events.start < last)
        count = int(here.sum())
        size = np.full(count, np.nan) if pair is None else _between(pair, events.uniform[here, 0])
        parts.append(
            pd.DataFrame(
                {
                    "time": (start_ns + events.start[here] * step_ns).view("M8[ns]"),
                    "kind": pd.array(np.full(count, kind), dtype="str"),
                    "duration_s": (events.stop[here] - events.start[here]) * settings.interval_s,
                    "size_m": size,
                }
            )
        )
    table = pd.concat(parts, ignore_index=True)
    return table.sort_values("time", kind="stable", ignore_index=True)


def _meta(settings: LaboratorySettings) -> RecordingMeta:
    options = settings.to_strings()
    plain = json.dumps(options, sort_keys=True).encode()
    risk, per = _STATED_RISK[settings.mode]
    start = np.array([settings.start], "M8[ns]")
    return RecordingMeta(
        sources=(
            Source(
                path=settings.name,
                bytes=len(plain),
                sha256=hashlib.sha256(plain).hexdigest(),
                format="laboratory",
                reader_version=MODEL_VERSION,
            ),
        ),
        leap_seconds=int(gpst_minus_utc_s(gps_to_utc(start))[0]),
        frame="WGS 84/ITRF",
        antenna=settings.antenna,
        receiver="simulated",
        pl=ProtectionLevelMeta("do229", settings.k_h, K_VERTICAL, risk, per),
        options=options,
        versions={
            "sbas": __version__,
            "laboratory_model": MODEL_VERSION,
            "numpy": np.__version__,
        },
    )
