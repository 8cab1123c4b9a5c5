"""Sentences for the tests: framed with a checksum by a plain loop, and a whole log by epoch."""

from __future__ import annotations

from functools import reduce
from operator import xor
from typing import Any

import numpy as np


def sentence(body: str) -> bytes:
    """`$body*hh` with its line end."""
    return f"${body}*{reduce(xor, body.encode()):02X}\r\n".encode()


def clock(tod_s: float, decimals: int = 2) -> str:
    """`hhmmss.ss` of seconds of day."""
    units = round(tod_s * 10**decimals)
    whole, part = divmod(units, 10**decimals)
    text = f"{whole // 3600:02d}{whole // 60 % 60:02d}{whole % 60:02d}"
    return f"{text}.{part:0{decimals}d}" if decimals else text


def angle(value: float, width: int, letters: str, decimals: int = 5) -> str:
    """`ddmm.mmmmm,N` of degrees."""
    units = round(abs(value) * 60 * 10**decimals)
    degrees, minutes = divmod(units, 60 * 10**decimals)
    text = f"{minutes / 10**decimals:0{3 + decimals}.{decimals}f}"
    return f"{degrees:0{width}d}{text},{letters[value < 0]}"


def position(lat: float, lon: float, decimals: int = 5) -> str:
    return f"{angle(lat, 2, 'NS', decimals)},{angle(lon, 3, 'EW', decimals)}"


def gga(time: str, where: str = "5002.0700,N,01546.2720,E", **change: Any) -> bytes:
    """GGA as the check line of the methods page, with changes by name."""
    field = {"quality": 2, "n": "08", "hdop": "1.1", "alt": "245.3", "unit": "M", "sep": "44.5",
             "age": "3.0", "station": "0120", "talker": "GP", **change}  # fmt: skip
    return sentence(
        f"{field['talker']}GGA,{time},{where},{field['quality']},{field['n']},{field['hdop']},"
        f"{field['alt']},{field['unit']},{field['sep']},M,{field['age']},{field['station']}"
    )


def rmc(time: str, date: str = "230525", where: str = "5002.0700,N,01546.2720,E",
        status: str = "A", mode: str = ",D", talker: str = "GP") -> bytes:  # fmt: skip
    return sentence(f"{talker}RMC,{time},{status},{where},10.0,90.0,{date},,{mode}")


def log(epochs: int, *, seed: int = 1, start_s: float = 86_000.0, step_s: float = 1.0,
        day: str = "2025-05-23") -> list[bytes]:  # fmt: skip
    """A drive past midnight with sentences of several talkers; one entry an epoch."""
    rng = np.random.default_rng(seed)
    entries = []
    for i in range(epochs):
        days, tod_s = divmod(start_s + i * step_s, 86_400)
        date = np.datetime64(day) + np.timedelta64(int(days), "D")
        year, month, day_of_month = str(date).split("-")
        time = clock(tod_s, 2)
        lat, lon = 50.0345 + 1e-5 * i, -15.7712 + 1e-5 * float(rng.normal())
        where = position(lat, lon)
        quality = int(rng.choice([0, 1, 2, 4, 5, 6], p=[0.02, 0.1, 0.7, 0.08, 0.08, 0.02]))
        n = int(rng.integers(4, 13))
        ids = [str(k) for k in rng.permutation(np.arange(1, 33))[:n]]
        if i % 3 == 0:
            ids[-1] = str(33 + i % 32)
        a, b = sorted(rng.uniform(0.5, 3, 2))[::-1]
        theta = rng.uniform(0, 180)
        sin2, cos2 = np.sin(np.radians(theta)) ** 2, np.cos(np.radians(theta)) ** 2
        sn, se = np.sqrt(a * a * cos2 + b * b * sin2), np.sqrt(a * a * sin2 + b * b * cos2)
        dop = [f"{x:.2f}" for x in rng.uniform(0.8, 3, 3)]
        letter = "NADPRF"[min(quality, 5)]
        lines = [
            sentence(f"GNRMC,{time},{'A' if quality else 'V'},{where},{rng.uniform(0, 90):.3f},"
                     f"{rng.uniform(0, 360):.2f},{day_of_month}{month}{year[2:]},,,{letter}"),
            sentence(f"GNGGA,{time},{where},{quality},{n:02d},{dop[1]},{rng.normal(245, 2):.2f},M,"
                     f"44.5,M,{rng.uniform(1, 9):.1f},0120"),
            sentence(f"GPGSA,A,{2 + i % 2},{','.join(ids + [''] * (12 - n))},{','.join(dop)}"),
            sentence("GLGSA,A,3,65,66,,,,,,,,,,," + ",".join(dop)),
            sentence("GPGSV,2,1,06,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,"),
            sentence("GPGSV,2,2,06,33,30,150,44,07,11,100,00"),
            sentence("GLGSV,1,1,02,65,40,083,46,66,17,308,41"),
            sentence(f"GNGST,{time},1.2,{a:.4f},{b:.4f},{theta:.4f},{sn:.4f},{se:.4f},"
                     f"{rng.uniform(1, 5):.4f}"),
            sentence(f"GNGBS,{time},{rng.uniform(0, 9):.1f},{rng.uniform(0, 9):.1f},"
                     f"{rng.uniform(0, 9):.1f},{rng.integers(1, 33)},0.01,"
                     f"{rng.normal(0, 9):.1f},{rng.uniform(0, 9):.1f}"),
            sentence(f"GPZDA,{time},{day_of_month},{month},{year},00,00"),
        ]  # fmt: skip
        entries.append(b"".join(lines))
    return entries
