"""Good recordings made bad, each in one known way, with the finding and the repair it calls for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from sbas.findings import Severity
from sbas.recording import MODES, Flag, ProtectionLevelMeta, Recording, mode_categories
from sbas.timescales import gps_to_utc
from sbas.truth import Truth
from tests.input_check.journeys import (
    POINT,
    START,
    journey,
    moved,
    receiver,
    standing,
)


@dataclass(frozen=True)
class Damage:
    """What was done to `good`, and what the check must say; `repair` as it must propose it."""

    name: str
    code: str
    severity: Severity
    good: Recording
    bad: Recording
    truth: Truth | None = None
    repair: dict[str, Any] | None = None
    restores: bool = True


def changed(recording: Recording, **columns: Any) -> Recording:
    return recording.replace(table=recording.table.assign(**columns))


def timed(recording: Recording, times: Any) -> Recording:
    index = pd.DatetimeIndex(np.asarray(times, "M8[ns]"), name="time")
    return recording.replace(table=recording.table.set_axis(index))


def rows(recording: Recording, order: Any) -> Recording:
    return recording.replace(table=recording.table.iloc[np.asarray(order)])


def joined(*recordings: Recording) -> Recording:
    table = pd.concat([r.table for r in recordings])
    table["mode"] = mode_categories(
        np.concatenate([r.table["mode"].cat.codes.to_numpy() for r in recordings])
    )
    return recordings[0].replace(table=table)


def _slipped(recording: Recording, row: int, k: float) -> Recording:
    """Times before `row` as they were before the receiver corrected its leap seconds by k."""
    time = recording.time.copy()
    time[:row] -= np.timedelta64(round(k * 1e9), "ns")
    return timed(recording, time)


def _in_turn(
    recording: Recording, north_m: float, level: float, *, n_sv: int = 0, sigma_m: float = 0.7
) -> Recording:
    """Every second epoch of a receiver that stands aside, with another level; both noisy."""
    n = len(recording)
    other = np.arange(n) % 2 == 1
    rng = np.random.default_rng(4)
    noise = rng.normal(0, sigma_m, (2, n)) / 111_195
    t = recording.table
    return changed(
        recording,
        lat_deg=t["lat_deg"] + noise[0] + other * north_m / 111_195,
        lon_deg=t["lon_deg"] + noise[1],
        hpl_m=t["hpl_m"] * np.where(other, level, 1.0) * rng.normal(1, 0.02, n),
        n_sv=(t["n_sv"] + other * n_sv).astype("i2"),
    )


def _over_a_leap_second() -> tuple[Recording, Recording]:
    """A record over the leap second of 2016-12-31, in GPS time and with its UTC stamps."""
    good = standing(600)
    start = np.datetime64("2017-01-01T00:00:17", "ns") - np.timedelta64(300, "s")
    good = timed(good, start + np.arange(600) * np.timedelta64(1, "s"))
    return good, timed(good, gps_to_utc(good.time))


def damages() -> tuple[Damage, ...]:
    """All of them."""
    roof = standing()
    train, track = journey()
    n = len(roof)
    late = timed(roof, np.datetime64("2025-06-01T23:50", "ns") + (roof.time - START))
    over, over_utc = _over_a_leap_second()
    frozen = roof.table["hpl_m"].to_numpy().copy()
    frozen[200:400] = frozen[200]
    zero = roof.table["hpl_m"].to_numpy().copy()
    zero[[3, 500]] = 0.0, -1.0
    other = receiver(np.full(n, 2.0), np.zeros(n), np.arange(n) * 1.0, 9)
    other = changed(
        other,
        hpl_m=2 * other.table["hpl_m"],
        lat_deg=other.table["lat_deg"].round(6),
        lon_deg=other.table["lon_deg"].round(6),
    )
    after = moved(other, n + 3600)
    apart = moved(receiver(np.full(n, 40.0), np.zeros(n), np.arange(n) * 1.0, 9), n + 3600)
    apart = changed(apart, hpl_m=apart.table["hpl_m"] * 1.8)
    fast = journey(n, step_s=0.5)[0]
    two_files = roof.replace(meta=replace(roof.meta, sources=2 * roof.meta.sources))
    lat, lon = (roof.table[c].to_numpy() for c in ("lat_deg", "lon_deg"))
    ddmm = {c: 100 * np.floor(v) + 60 * (v - np.floor(v)) for c, v in
            (("lat_deg", lat), ("lon_deg", lon))}  # fmt: skip
    still = {c: roof.table[c].to_numpy().copy() for c in ("lat_deg", "lon_deg")}
    for values in still.values():
        values[700:900] = values[700]
    evening = (late.time - late.time.astype("M8[D]")).astype("m8[ns]")
    week = timed(roof, START - np.timedelta64(600, "s") + (roof.time - START))
    week_wrapped = week.time.copy()
    week_wrapped[700:] -= np.timedelta64(7, "D")
    return (
        Damage("UTC taken for GPS time", "E02", "error", train, moved(train, -18), track,
               {"time": "UTC"}),
        Damage("old leap seconds", "E02", "error", train, moved(train, -2), track, {}),
        Damage("truth in UTC", "E02", "error", train, moved(train, 18), track, {}),
        Damage("a time zone", "E02", "error", train, moved(train, 7200), track, {}),
        Damage("half a second late", "E02", "error", train, moved(train, 0.5), track, {}),
        Damage("radians", "E03", "error", roof,
               changed(roof, lat_deg=np.radians(lat), lon_deg=np.radians(lon)), None,
               {"angles": "rad"}),
        Damage("radians, truth known", "E03", "error", roof,
               changed(roof, lat_deg=np.radians(lat), lon_deg=np.radians(lon)), POINT,
               {"angles": "rad"}),
        Damage("a gap", "E04", "warning", roof, rows(roof, np.r_[:500, 560:n]), None, {}),
        Damage("epochs twice", "E05", "error", roof, rows(roof, np.r_[:101, 50:n][np.argsort(
            np.r_[:101, 50:n], kind="stable")]), None, {"duplicates": "first"}),
        Damage("an epoch twice with another level", "E05", "error", roof,
               joined(rows(roof, np.r_[:101]), changed(rows(roof, [100]), hpl_m=99.0),
                      rows(roof, np.r_[101:n])), None, {}),
        Damage("two receivers in turn", "E06", "error", roof,
               rows(joined(roof, other), np.arange(2 * n).reshape(2, n).T.ravel()), None, {}),
        Damage("two receivers in turn, moving, noisy", "E06", "error", fast,
               _in_turn(fast, 5.0, 1.0), None, {}),
        Damage("two receivers in turn at one place", "E06", "error", fast,
               _in_turn(fast, 0.0, 1.2, n_sv=2), None, {}),
        Damage("another country an hour later", "E06", "error", roof,
               joined(roof, changed(moved(roof, n + 3600), lat_deg=lat - 20)), None, {}),
        Damage("another country a second later", "E06", "error", roof,
               joined(roof, changed(moved(roof, n), lat_deg=lat - 20)), None, {}),
        Damage("another level in the next file", "E06", "warning", two_files,
               changed(two_files, hpl_m=np.where(np.arange(n) < 600, 1, 1.8)
                       * roof.table["hpl_m"]), None, {}),
        Damage("files of two receivers", "E06", "error", roof, joined(roof, after), None, {}),
        Damage("the receiver elsewhere", "E06", "warning", roof, joined(roof, apart), None, {}),
        Damage("degrees and minutes", "E08", "error", roof, changed(roof, **ddmm), None,
               {"unit": {"lat_deg": "ddmm", "lon_deg": "ddmm"}}),
        Damage("1e-7 degrees", "E08", "error", roof,
               changed(roof, lat_deg=lat * 1e7, lon_deg=lon * 1e7), None,
               {"unit": {"lat_deg": "1e-7 deg", "lon_deg": "1e-7 deg"}}),
        Damage("seconds of arc, truth known", "E08", "error", roof,
               changed(roof, lat_deg=lat * 3600, lon_deg=lon * 3600), POINT,
               {"unit": {"lat_deg": "arcsec", "lon_deg": "arcsec"}}),
        Damage("height in mm", "E08", "error", roof,
               changed(roof, height_m=roof.table["height_m"] * 1000), None, {}),
        Damage("height in mm, truth known", "E08", "error", roof,
               changed(roof, height_m=roof.table["height_m"] * 1000), POINT,
               {"unit": {"height_m": "mm"}}),
        Damage("height in feet, truth known", "E08", "error", roof,
               changed(roof, height_m=roof.table["height_m"] / 0.3048), POINT,
               {"unit": {"height_m": "ft"}}),
        Damage("levels in mm", "E08", "error", roof,
               changed(roof, hpl_m=roof.table["hpl_m"] * 1000, vpl_m=roof.table["vpl_m"] * 1000),
               None, {}),
        Damage("levels in km", "E08", "error", roof,
               changed(roof, hpl_m=roof.table["hpl_m"] / 1000, vpl_m=roof.table["vpl_m"] / 1000),
               None, {"unit": {"hpl_m": "km", "vpl_m": "km"}}),
        Damage("only the horizontal level in km", "E08", "error", roof,
               changed(roof, hpl_m=roof.table["hpl_m"] / 1000), None, {"unit": {"hpl_m": "km"}}),
        Damage("only the vertical level in km", "E08", "error", roof,
               changed(roof, vpl_m=roof.table["vpl_m"] / 1000), None, {"unit": {"vpl_m": "km"}}),
        Damage("levels in cm, truth known", "E08", "warning", roof,
               changed(roof, hpl_m=roof.table["hpl_m"] * 100), POINT, {}),
        Damage("9999 for no level", "E07", "warning", roof,
               changed(roof, hpl_m=np.where(np.arange(n) % 50, roof.table["hpl_m"], 9999.0)), None,
               {"pl_sentinel": 9999.0}, restores=False),
        Damage("heights above the geoid", "E09", "warning", roof,
               changed(roof, height_m=roof.table["height_m"] - 44.5), POINT, {}),
        Damage("an antenna pole", "E09", "warning", (day_long := standing(20_000)),
               changed(day_long, height_m=day_long.table["height_m"] + 2.5), POINT, {}),
        Damage("another frame", "E09", "warning", day_long,
               changed(day_long, lat_deg=day_long.table["lat_deg"] + 2 / 111_000), POINT, {}),
        *(
            Damage(f"leap seconds corrected by {k}", "E11", "error", train,
                   _slipped(train, 700, k), None, {"leap_slip": "fix"})
            for k in (18, 3, -1, -2, -17)
        ),
        Damage("UTC over a leap second", "E11", "error", over, over_utc, None, {"time": "UTC"}),
        Damage("swapped", "E12", "error", roof, changed(roof, lat_deg=lon, lon_deg=lat), POINT,
               {"swap_latlon": True}),
        Damage("swapped beyond the pole", "E12", "error",
               (east := changed(roof, lon_deg=lon + 100)),
               changed(east, lat_deg=lon + 100, lon_deg=lat), None, {"swap_latlon": True}),
        Damage("south for north", "E12", "error", roof, changed(roof, lat_deg=-lat), POINT,
               {"sign": "lat"}),
        Damage("west for east, moving", "E12", "error", train,
               changed(train, lon_deg=-train.table["lon_deg"]), track, {"sign": "lon"}),
        Damage("south and west for north and east", "E12", "error", roof,
               changed(roof, lat_deg=-lat, lon_deg=-lon), POINT, {"sign": "both"}),
        Damage("swapped, and south for north", "E12", "error", roof,
               changed(roof, lat_deg=lon, lon_deg=-lat), POINT,
               {"swap_latlon": True, "sign": "lat"}),
        Damage("swapped, both signs, moving", "E12", "error", train,
               changed(train, lat_deg=-train.table["lon_deg"], lon_deg=-train.table["lat_deg"]),
               track, {"swap_latlon": True, "sign": "both"}),
        Damage("elsewhere", "E12", "error", roof, changed(roof, lat_deg=lat + 1), POINT, {}),
        Damage("levels of zero", "E13", "error", roof, changed(roof, hpl_m=zero), None,
               {"pl_zero": "missing"}, restores=False),
        Damage("a frozen level", "E13", "error", roof, changed(roof, hpl_m=frozen), None,
               {"pl_frozen": "missing"}, restores=False),
        Damage("a frozen position", "E13", "warning", roof, changed(roof, **still), None, {}),
        Damage("parts in another order", "E14", "error", roof, rows(roof, np.r_[500:n, :500]),
               None, {"sort": True}),
        Damage("the date not advanced at midnight", "E14", "error", late,
               timed(late, late.time.astype("M8[D]")[0] + evening), None, {"unwrap": "day"}),
        Damage("the week not advanced", "E14", "error", week, timed(week, week_wrapped), None,
               {"unwrap": "week"}),
        Damage("a restart of the clock", "E14", "error", roof, _slipped(roof, 600, -200), None, {}),
        Damage("a file twice", "E14", "error", roof, joined(roof, roof), None, {"sort": True}),
        Damage("one epoch", "E15", "error", roof, rows(roof, [0]), None, {}),
        Damage("1024 weeks before 2010", "E22", "error",
               (older := moved(roof, -15 * 365 * 86400.0)), moved(older, -7168 * 86400.0), None,
               {"week_rollover": 1024}),
        Damage("1024 or 2048 weeks ago", "E22", "error", roof, moved(roof, -2 * 7168 * 86400.0),
               None, {}),
        Damage("in the future", "E22", "error", roof, moved(roof, 400 * 86400.0), None, {}),
        Damage("a rollover that the truth shows", "E22", "error", train,
               moved(train, -7168 * 86400.0), track, {"week_rollover": 1024}),
        Damage("leap seconds of another date", "E22", "error",
               (stating := roof.replace(meta=replace(roof.meta, leap_seconds=18))),
               moved(stating, -7168 * 86400.0), None, {"week_rollover": 1024}),
        Damage("a start in 1980", "E22", "error", roof,
               timed(roof, np.r_[np.datetime64("1980-01-06", "ns")
                                 + np.arange(5) * np.timedelta64(1, "s"), roof.time[5:]]),
               None, {}),
        Damage("levels outside SBAS", "E23", "warning", roof,
               changed(roof, mode=mode_categories(np.full(n, MODES.index("standalone")))),
               None, {}),
        Damage("levels without mode", "E23", "warning", roof,
               roof.replace(table=roof.table.drop(columns="mode")), None, {}),
        Damage("levels of another risk", "E23", "warning", roof,
               roof.replace(meta=replace(roof.meta, pl=ProtectionLevelMeta("tmir", risk=0.05))),
               None, {}),
        Damage("two rates", "E27", "warning", roof,
               timed(roof, START + np.where(np.arange(n) < 800, np.arange(n) * 1000,
                                            800_000 + (np.arange(n) - 800) * 200)
                     .astype("m8[ms]")), None, {}),
        Damage("two rates, the slower one rarer", "E27", "warning", roof,
               timed(roof, START + np.where(np.arange(n) < 200, np.arange(n) * 1000,
                                            200_000 + (np.arange(n) - 200) * 200)
                     .astype("m8[ms]")), None, {}),
        Damage("levels that the reader flagged", "E23", "warning", roof,
               changed(roof, mode=mode_categories(np.full(n, MODES.index("standalone"))),
                       flags=np.full(n, Flag.PL_OUTSIDE_SBAS, np.uint32)), None, {}),
    )  # fmt: skip
