"""Values that were wrong before they were written: units, signs, times, levels, offsets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pymap3d

from sbas.findings import Severity
from sbas.recording import Recording
from sbas.timescales import gps_to_utc
from tests.corruption.damage import Damaged, Kind, Make, file_of
from tests.corruption.good_logs import GoodLog
from tests.input_check.damages import changed, timed
from tests.input_check.journeys import POINT, START, moved, standing

Rng = np.random.Generator
Change = Callable[[Recording, Rng], Recording]


def _numbers(log: GoodLog) -> bool:
    return log.form.numbers


def _coordinates(log: GoodLog) -> bool:
    """Of Ginan's two positions the one from the Earth's centre is read, always in metres."""
    return log.form.numbers and log.form.name != "ginan"


def _unchecked_levels(log: GoodLog) -> bool:
    """Numbers of another program: the package's own Parquet has no sentinels any more."""
    return log.form.levels and log.form.numbers and log.form.name != "parquet"


def _leveled(log: GoodLog) -> bool:
    return log.form.levels


def _finely_written(log: GoodLog) -> bool:
    """Positions to 2 mm or better, beside satellites or HDOP; coarser ones repeat by themselves."""
    return not log.moving and log.form.name not in ("ubx", "ubx hex", "ginan")


def _moving(log: GoodLog) -> bool:
    return log.moving


def _standing(log: GoodLog) -> bool:
    return not log.moving


def _levels_as_numbers(log: GoodLog) -> bool:
    return log.form.levels and log.form.numbers


def _written(change: Change, code: str, least: Severity = "error", *more: str) -> Make:
    """The change made before the file is written, with the codes that must follow."""

    def make(log: GoodLog, rng: Rng) -> Damaged:
        data = log.rewritten(change(log.recording, rng))
        return file_of(log, data, code, *more, least=least, keeps=False)

    return make


def _column(recording: Recording, name: str) -> Any:
    return recording.table[name].to_numpy().copy()


def _scaled(**factors: float) -> Change:
    return lambda r, rng: changed(r, **{c: _column(r, c) * f for c, f in factors.items()})


def _radians(r: Recording, rng: Rng) -> Recording:
    return changed(r, **{c: np.radians(_column(r, c)) for c in ("lat_deg", "lon_deg")})


def _ddmm(r: Recording, rng: Rng) -> Recording:
    values = {c: _column(r, c) for c in ("lat_deg", "lon_deg")}
    return changed(r, **{c: 100 * np.floor(v) + 60 * (v % 1) for c, v in values.items()})


def _swapped(r: Recording, rng: Rng) -> Recording:
    return changed(r, lat_deg=_column(r, "lon_deg"), lon_deg=_column(r, "lat_deg"))


def _shifted(*seconds: float) -> Change:
    return lambda r, rng: moved(r, float(rng.choice(seconds)))


def _leap_step(r: Recording, rng: Rng) -> Recording:
    """The receiver learns the leap seconds while the train is in motion."""
    time = r.time.copy()
    row = int(rng.integers(600, 850))
    time[:row] -= np.timedelta64(int(rng.choice([18, 17, 2, -1, -2])), "s")
    return timed(r, time)


def _leap_step_at_a_stop(r: Recording, rng: Rng) -> Recording:
    """The same while it stands still: no way is made over the step that tells it from a gap."""
    time = r.time.copy()
    time[: int(rng.integers(340, 440))] -= np.timedelta64(int(rng.choice([18, 17, 5])), "s")
    return timed(r, time)


def _clock_restart(r: Recording, rng: Rng) -> Recording:
    time = r.time.copy()
    time[int(rng.integers(300, 900)) :] -= np.timedelta64(int(rng.integers(100, 250)), "s")
    return timed(r, time)


def _first_epochs_in_1980(r: Recording, rng: Rng) -> Recording:
    first = np.datetime64("1980-01-06", "ns") + np.arange(5) * np.timedelta64(1, "s")
    return timed(r, np.r_[first, r.time[5:]])


def _midnight_missed(r: Recording, rng: Rng) -> Recording:
    late = np.datetime64("2025-06-01T23:50", "ns") + (r.time - START)
    clock = late - late.astype("M8[D]")
    return timed(r, late.astype("M8[D]")[0] + clock)


def _week_missed(r: Recording, rng: Rng) -> Recording:
    # 2025-06-01 is the Sunday on which a GPS week begins.
    time = np.datetime64("2025-05-31T23:50", "ns") + (r.time - START)
    time[time >= np.datetime64("2025-06-01", "ns")] -= np.timedelta64(7, "D")
    return timed(r, time)


def _two_rates(r: Recording, rng: Rng) -> Recording:
    n = len(r)
    at = int(rng.integers(400, 800))
    ms = np.where(np.arange(n) < at, np.arange(n) * 1000, at * 1000 + (np.arange(n) - at) * 200)
    return timed(r, START + ms.astype("m8[ms]"))


def _over_a_leap_second(r: Recording, rng: Rng) -> Recording:
    start = np.datetime64("2017-01-01T00:00:17", "ns") - np.timedelta64(600, "s")
    time = start + np.arange(len(r)) * np.timedelta64(1, "s")
    return timed(r, gps_to_utc(time))


def _sentinels(*values: float) -> Change:
    def change(r: Recording, rng: Rng) -> Recording:
        hpl = _column(r, "hpl_m")
        hpl[rng.choice(len(hpl), int(rng.choice([1, 7, 200])), replace=False)] = rng.choice(values)
        return changed(r, hpl_m=hpl)

    return change


def _alarm(r: Recording, rng: Rng) -> Recording:
    some = rng.choice(len(r), 30, replace=False)
    hpl, vpl = _column(r, "hpl_m"), _column(r, "vpl_m")
    hpl[some], vpl[some] = 8000.0, 100.0
    return changed(r, hpl_m=hpl, vpl_m=vpl)


def _null_island(r: Recording, rng: Rng) -> Recording:
    some = rng.choice(len(r), int(rng.choice([3, 60])), replace=False)
    lat, lon = _column(r, "lat_deg"), _column(r, "lon_deg")
    lat[some] = lon[some] = 0.0
    return changed(r, lat_deg=lat, lon_deg=lon)


def _levels_of_zero(r: Recording, rng: Rng) -> Recording:
    hpl = _column(r, "hpl_m")
    hpl[rng.choice(len(hpl), int(rng.choice([1, 20, 600])), replace=False)] = 0.0
    return changed(r, hpl_m=hpl)


def _levels_below_zero(r: Recording, rng: Rng) -> Recording:
    hpl = _column(r, "hpl_m")
    hpl[rng.choice(len(hpl), int(rng.choice([1, 20])), replace=False)] *= -1
    return changed(r, hpl_m=hpl)


def _frozen_level(r: Recording, rng: Rng) -> Recording:
    # Over a change of satellites, which the journeys have at epoch 700, and of HDOP.
    hpl, begin = _column(r, "hpl_m"), int(rng.integers(500, 620))
    hpl[begin : begin + int(rng.integers(300, 500))] = hpl[begin]
    return changed(r, hpl_m=hpl)


def _frozen_position(r: Recording, rng: Rng) -> Recording:
    begin = int(rng.integers(550, 690))
    values = {c: _column(r, c) for c in ("lat_deg", "lon_deg")}
    for value in values.values():
        value[begin : begin + 300] = value[begin]
    return changed(r, **values)


def _no_mode(r: Recording, rng: Rng) -> Recording:
    return r.replace(table=r.table.drop(columns="mode"))


def _outside_sbas(log: GoodLog, rng: Rng) -> Damaged:
    """Levels beside fixes of another kind, written as words or as RTKLIB's quality."""
    data = log.pieces.data
    if log.form.format == "rtklib_pos":
        data = data.replace(b"   3  ", b"   5  ").replace(b"   3 1", b"   5 1")
    else:
        data = data.replace(b"sbas_npa", b"standalone")
    return file_of(log, data, "E23", keeps=False)


def _above_the_geoid(r: Recording, rng: Rng) -> Recording:
    return changed(r, height_m=_column(r, "height_m") - 44.5)


def _other_datum(r: Recording, rng: Rng) -> Recording:
    """As in the European datum of 1950: some 80 m east and 110 m north."""
    lat, lon, _ = pymap3d.enu2geodetic(80.0, 110.0, 0.0, POINT.lat_deg, POINT.lon_deg, 0.0)
    return changed(
        r,
        lat_deg=_column(r, "lat_deg") + (lat - POINT.lat_deg),
        lon_deg=_column(r, "lon_deg") + (lon - POINT.lon_deg),
    )


_LONG = 20_000
"""Epochs with which an offset of a few metres stands out of slow errors."""


def _long(change: Change, code: str) -> Make:
    def make(log: GoodLog, rng: Rng) -> Damaged:
        day = log.with_recording(standing(_LONG))
        data = log.rewritten(change(day.recording, rng))
        return file_of(day, data, code, keeps=False, good=day)

    return make


def _antenna_pole(r: Recording, rng: Rng) -> Recording:
    return changed(r, height_m=_column(r, "height_m") + float(rng.choice([2.5, 4.0])))


def _another_frame(r: Recording, rng: Rng) -> Recording:
    return changed(r, lat_deg=_column(r, "lat_deg") + 2.5 / 111_000)


def _for_long(log: GoodLog) -> bool:
    return not log.moving and log.form.name in ("sbf", "pos", "csv comma", "parquet", "pegasus")


def _no_truth(log: GoodLog, rng: Rng) -> Damaged:
    return file_of(log, log.pieces.data, "E01")


_MM, _E7 = 1000.0, 1e7

VALUE_DAMAGES = (
    Kind("radians", _written(_radians, "E03"), _coordinates),
    Kind("degrees and minutes", _written(_ddmm, "E08"), _coordinates),
    Kind("1e-7 degrees", _written(_scaled(lat_deg=_E7, lon_deg=_E7), "E08"), _coordinates),
    Kind("height in mm", _written(_scaled(height_m=_MM), "E08"), _numbers),
    Kind("height in feet", _written(_scaled(height_m=1 / 0.3048), "E08"), _numbers),
    Kind("levels in mm", _written(_scaled(hpl_m=_MM, vpl_m=_MM), "E08", "warning"),
         _levels_as_numbers),
    Kind("levels in km", _written(_scaled(hpl_m=1e-3, vpl_m=1e-3), "E08", "warning", "E13"),
         _levels_as_numbers),
    Kind("latitude and longitude exchanged", _written(_swapped, "E12")),
    Kind("south for north", _written(_scaled(lat_deg=-1.0), "E12")),
    Kind("west for east", _written(_scaled(lon_deg=-1.0), "E12")),
    Kind("UTC labelled as GPS time", _written(_shifted(-18), "E02"), _moving),
    Kind("old leap seconds", _written(_shifted(-1, -2, -3, 1, 2), "E02"), _moving),
    Kind("a time zone", _written(_shifted(3600, 7200, -3600, -7200), "E02"), _moving),
    Kind("a wrong day", _written(_shifted(86_400, -86_400), "E02"), _moving),
    Kind("a wrong week", _written(_shifted(604_800, -604_800), "E02"), _moving),
    Kind("week rollover, seen by the truth", _written(_shifted(-7168 * 86_400.0), "E22"), _moving),
    Kind("before 1999", _written(_shifted(-2 * 7168 * 86_400.0), "E22")),
    Kind("in the future", _written(_shifted(400 * 86_400.0, 2000 * 86_400.0), "E22")),
    Kind("first epochs in 1980", _written(_first_epochs_in_1980, "E22", "error", "E14"),
         lambda log: log.form.name not in ("nmea",)),
    Kind("leap seconds corrected inside", _written(_leap_step, "E11"), _moving),
    Kind("leap seconds corrected at a stop", _written(_leap_step_at_a_stop, "E02", "error", "E11"),
         _moving),
    Kind("UTC stamps over a leap second", _written(_over_a_leap_second, "E11", "error", "E05"),
         lambda log: not log.moving and log.form.dates and log.form.name != "csv utc"),
    Kind("clock restarted", _written(_clock_restart, "E14")),
    Kind("date not advanced at midnight", _written(_midnight_missed, "E14"),
         lambda log: log.form.dates),
    Kind("week not advanced", _written(_week_missed, "E14"),
         lambda log: log.form.name in ("sbf", "pos week", "pegasus", "csv blanks", "glab")),
    Kind("two rates", _written(_two_rates, "E27", "warning"), _standing),
    Kind("655.35 for no level", _written(_sentinels(655.35), "E07", "warning"),
         _unchecked_levels),
    Kind("65535 for no level", _written(_sentinels(65535.0), "E07", "warning"),
         _levels_as_numbers),
    Kind("4294967295 for no level", _written(_sentinels(4294967295.0, 4294967.295), "E07",
                                             "warning"), _levels_as_numbers),
    Kind("-2e10 for no level", _written(_sentinels(-2e10), "E07", "warning"), _levels_as_numbers),
    Kind("infinite levels", _written(_sentinels(np.inf), "E07", "warning", "E10"),
         _levels_as_numbers),
    Kind("8000 and 100 for an alarm", _written(_alarm, "E07", "warning"), _unchecked_levels),
    Kind("positions of (0, 0)", _written(_null_island, "E07", "warning"), _unchecked_levels),
    Kind("levels of zero", _written(_levels_of_zero, "E13", "warning", "E07"), _leveled, 2),
    Kind("levels below zero", _written(_levels_below_zero, "E13", "warning", "E07"),
         _levels_as_numbers),
    Kind("a frozen level", _written(_frozen_level, "E13"), _leveled, 2),
    Kind("a frozen position", _written(_frozen_position, "E13", "warning"), _finely_written),
    Kind("levels without mode", _written(_no_mode, "E23", "warning"),
         lambda log: log.form.format == "csv" or log.form.name == "parquet foreign"),
    Kind("levels outside SBAS", _outside_sbas,
         lambda log: log.form.format == "csv" or log.form.name in ("pos", "pos week")),
    Kind("heights above the geoid", _written(_above_the_geoid, "E09", "warning")),
    Kind("another datum", _written(_other_datum, "E09", "warning")),
    Kind("an antenna pole", _long(_antenna_pole, "E09"), _for_long, 2),
    Kind("another frame", _long(_another_frame, "E09"), _for_long),
    Kind("no truth", _no_truth, _leveled, analysed=True),
)  # fmt: skip
