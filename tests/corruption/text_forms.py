"""Lines of text without checksums: RTKLIB, gLAB, Ginan, PEGASUS, five dialects of CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from typing import Any

import numpy as np
import pymap3d

from sbas.recording import Recording
from sbas.timescales import gps_to_utc, week_and_tow_ns
from tests.corruption.forms import Form, Pieces
from tests.logs.programs import glab_samples, test_ginan_spp, test_pegasus_csv

_FRAME = "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=#)\n"
_LLH = "latitude(deg) longitude(deg)  height(m)"
_SIGMAS = "  Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m)"


def _rows(recording: Recording, *names: str) -> Iterator[tuple[Any, ...]]:
    return zip(*(recording.table[name].tolist() for name in names), strict=True)


def _stamps(recording: Recording, text: str) -> list[str]:
    times: list[datetime] = recording.time.astype("M8[us]").tolist()
    return [f"{t:{text}}.{t.microsecond // 1000:03d}" for t in times]


def _weeks(recording: Recording, decimals: int = 3) -> list[tuple[int, str]]:
    weeks, tow_ns = week_and_tow_ns(recording.time)
    return [
        (week, f"{tow / 1e9:.{decimals}f}")
        for week, tow in zip(weeks.tolist(), tow_ns.tolist(), strict=True)
    ]


def _pos(recording: Recording, stamps: Sequence[str], *, levels: bool) -> Pieces:
    last = " hpl (m) vpl (m)" if levels else " age(s)  ratio"
    head = f"{_FRAME}%  GPST                  {_LLH}{_SIGMAS}{last}\n"
    lines = []
    names = ("lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "n_sv")
    for stamp, (lat, lon, height, hpl, vpl, n) in zip(
        stamps, _rows(recording, *names), strict=True
    ):
        # Equal sigmas without correlation: HPL is 6.18 times, VPL 5.33 times the sigma.
        end = f"{hpl:7.2f} {vpl:6.1f}" if levels else "  3.00    0.0"
        lines.append(
            f"{stamp} {lat:14.9f} {lon:14.9f} {height:10.4f}   3 {n:3d} {hpl / 6.18:8.4f} "
            f"{hpl / 6.18:8.4f} {vpl / 5.33:8.4f}   0.0000   0.0000   0.0000 {end}\n"
        )
    return Pieces(head.encode(), tuple(line.encode() for line in lines))


def _pos_date(recording: Recording) -> Pieces:
    return _pos(recording, _stamps(recording, "%Y/%m/%d %H:%M:%S"), levels=True)


def _pos_week(recording: Recording) -> Pieces:
    return _pos(recording, [f"{w:4d} {s:>10s}" for w, s in _weeks(recording)], levels=True)


def _pos_plain(recording: Recording) -> Pieces:
    return _pos(recording, _stamps(recording, "%Y/%m/%d %H:%M:%S"), levels=False)


def _glab(recording: Recording) -> Pieces:
    zeros = "0.0000 0.0000 0.0000"
    weeks, tow_ns = week_and_tow_ns(recording.time)
    times: list[datetime] = recording.time.astype("M8[us]").tolist()
    names = ("lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "n_sv")
    ecef = np.stack(
        pymap3d.geodetic2ecef(*(recording.table[name].to_numpy() for name in names[:3])), axis=1
    ).tolist()
    lines = []
    for i, (lat, lon, height, hpl, vpl, hdop, n) in enumerate(_rows(recording, *names)):
        t = times[i]
        second = t.hour * 3600 + t.minute * 60 + t.second + t.microsecond / 1e6
        clock = f"{t:%Y %j} {second:8.2f} {t:%H:%M:%S}.{t.microsecond // 10_000:02d}"
        x, y, z = ecef[i]
        satellites = " ".join(f"+G{prn:02d}" for prn in range(1, n + 1))
        lines.append(
            f"OUTPUT    {clock} 5 0 {n:2d} 1 GPS    4.0 {x:14.4f} {y:14.4f} {z:14.4f} {zeros} 1.9 "
            f"2.8 2.5 {lat:14.9f} {lon:14.9f} {height:12.4f} {zeros} 3.6 1.5 1.6 {zeros} GPS -0.09 "
            f"2.66 2.3 2.0139 1.1 {hdop:.4f} 1.7834 {zeros}\n"
            f"SBASOUT   {clock} {weeks[i]} {tow_ns[i] / 1e9:9.2f} synt 5  PA 123  0.0000  0.0000  "
            f"0.0000  0.0000 {hpl:14.4f}  40.00  0.0000 {vpl:14.4f}  50.00  0.0000  -4.3225 {n:2d} "
            f"{n:2d} {satellites}\n"
        )
    return Pieces(glab_samples.HEADER.encode(), tuple(line.encode() for line in lines))


def _ginan(recording: Recording) -> Pieces:
    names = ("lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop")
    ecef = np.stack(
        pymap3d.geodetic2ecef(*(recording.table[name].to_numpy() for name in names[:3])), axis=1
    ).tolist()
    stamps = _stamps(recording, "%Y-%m-%dT%H:%M:%S")
    lines = []
    for i, (lat, lon, height, hpl, vpl, hdop) in enumerate(_rows(recording, *names)):
        x, y, z = ecef[i]
        lines.append(
            f"\n {stamps[i]} {2025.41:14.9f} {x:14.5f} {y:14.5f} {z:14.5f} {hdop:11.4f} 1.5000 "
            f"2.1000 - - - {lat:15.10f} {lon:15.10f} {height:11.5f} - - - - {hpl:11.5f} "
            f"{vpl:11.5f} - - -"
        )
    return Pieces(test_ginan_spp.HEADER.encode(), tuple(line.encode() for line in lines))


def _pegasus(recording: Recording) -> Pieces:
    names = ("n_sv", "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m")
    lines = [
        f"{tow};{week};12;{n};{lat:.9f};{lon:.9f};{height:.4f};0.0;0.0;0.0;{hpl:.4f};{vpl:.4f};"
        "50.03;15.77;289.4\n"
        for (week, tow), (n, lat, lon, height, hpl, vpl) in zip(
            _weeks(recording), _rows(recording, *names), strict=True
        )
    ]
    head = test_pegasus_csv.HEADER + "\n"
    return Pieces(head.encode(), tuple(line.encode() for line in lines))


def _csv(
    head: str, delimiter: str, stamps: Callable[[Recording], Sequence[str]], decimal: str = "."
) -> Callable[[Recording], Pieces]:
    names = ("lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "n_sv", "mode")

    def write(recording: Recording) -> Pieces:
        present = [name for name in names if name in recording.table]
        kinds = [".9f", ".9f", ".4f", ".4f", ".4f", ".2f", "d", "s"]
        forms = [kind for name, kind in zip(names, kinds, strict=True) if name in present]
        lines = []
        for stamp, values in zip(stamps(recording), _rows(recording, *present), strict=True):
            numbers = [f"{v:{f}}" for v, f in zip(values, forms, strict=True)]
            fields = delimiter.join(number.replace(".", decimal) for number in numbers)
            lines.append(f"{stamp}{delimiter}{fields}\n".encode())
        columns = head.split("|")
        kept = [c for c, name in zip(columns[1:], names, strict=True) if name in present]
        line = delimiter.join([*columns[0].split(" "), *kept]) + "\n"
        return Pieces(line.encode(), tuple(lines))

    return write


def _iso(recording: Recording) -> Sequence[str]:
    return _stamps(recording, "%Y-%m-%dT%H:%M:%S")


def _zulu(recording: Recording) -> Sequence[str]:
    times: list[datetime] = gps_to_utc(recording.time).astype("M8[us]").tolist()
    return [f"{t:%Y-%m-%d %H:%M:%S}.{t.microsecond // 1000:03d}Z" for t in times]


def _week_and_tow(recording: Recording) -> Sequence[str]:
    return [f"{week} {tow}" for week, tow in _weeks(recording)]


def _decimal_comma_stamps(recording: Recording) -> Sequence[str]:
    return [stamp[:-4] for stamp in _stamps(recording, "%Y-%m-%d %H:%M:%S")]


_NAMES = "lat|lon|height|hpl|vpl|hdop|n_sv|mode"
_UNITS = "lat[deg]|lon[deg]|height[m]|hpl[m]|vpl[m]|hdop|n_sv|mode"

TEXT_FORMS = (
    Form("pos", "rtklib_pos", ".pos", "text", _pos_date, numbers=True, dates=True),
    Form("pos week", "rtklib_pos", ".pos", "text", _pos_week, numbers=True),
    Form("pos plain", "rtklib_pos", ".pos", "text", _pos_plain, levels=False, dates=True),
    Form("glab", "glab_output", ".out", "text", _glab),
    Form("ginan", "ginan_spp", ".spp", "text", _ginan, numbers=True, dates=True),
    Form("pegasus", "pegasus_csv", ".csv", "text", _pegasus, numbers=True),
    Form("csv comma", "csv", ".csv", "text", _csv(f"time|{_NAMES}", ",", _iso), numbers=True,
         dates=True),
    Form("csv semicolon", "csv", ".csv", "text",
         _csv(f"time|{_NAMES}", ";", _decimal_comma_stamps, ","), numbers=True, dates=True),
    Form("csv tab", "csv", ".tsv", "text", _csv(f"time|{_UNITS}", "\t", _iso), numbers=True,
         dates=True),
    Form("csv blanks", "csv", ".txt", "text", _csv(f"week tow|{_NAMES}", " ", _week_and_tow),
         numbers=True),
    Form("csv utc", "csv", ".csv", "text", _csv(f"utc|{_NAMES}", ",", _zulu), numbers=True,
         dates=True),
)  # fmt: skip
