"""SBAS messages from raw fields: the inverse of every layout, for tests.

Written from the layouts of RTCA DO-229D, A.4.4, and the CRC as a long division bit by bit; it
shares nothing with the decoder. All values are the raw integers of the fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from sbas.augmentation.messages import SbasMessages, checked_messages

Field = tuple[int, int, int]
"""First bit, number of bits, value; negative values in two's complement."""

PREAMBLES = (0x53, 0x9A, 0xC6)
START_S = 1_200_000_000
PRN = 131


def crc24q(bits: str) -> int:
    """Remainder of the bits times x^24 by the polynomial 0x1864CFB."""
    value = int(bits, 2) << 24
    for place in range(value.bit_length() - 1, 23, -1):
        if value >> place & 1:
            value ^= 0x1864CFB << (place - 24)
    return value


def frame(kind: int, fields: Iterable[Field] = (), *, preamble: int = PREAMBLES[0]) -> bytes:
    """32 bytes: preamble, type, fields, CRC and six zeros."""
    bits = ["0"] * 226
    for start, length, value in ((0, 8, preamble), (8, 6, kind), *fields):
        assert -(1 << (length - 1)) <= value < 1 << length, (start, length, value)
        bits[start : start + length] = format(value & ((1 << length) - 1), f"0{length}b")
    data = "".join(bits)
    assert len(data) == 226
    whole = data + format(crc24q(data), "024b") + "000000"
    return int(whole, 2).to_bytes(32, "big")


def series(start: int, length: int, stride: int, values: Sequence[int]) -> list[Field]:
    return [(start + stride * i, length, value) for i, value in enumerate(values)]


def alarm() -> bytes:
    """Type 0 without content."""
    return frame(0)


def mask(iodp: int, slots: Iterable[int]) -> bytes:
    return frame(1, [*((13 + slot, 1, 1) for slot in slots), (224, 2, iodp)])


def fast(kind: int, iodf: int, iodp: int, prc: Sequence[int], udrei: Sequence[int]) -> bytes:
    """Types 0 and 2 to 5; 13 values each."""
    return frame(
        kind,
        [(14, 2, iodf), (16, 2, iodp), *series(18, 12, 12, prc), *series(174, 4, 4, udrei)],
    )


def integrity(iodf: Sequence[int], udrei: Sequence[int]) -> bytes:
    return frame(6, [*series(14, 2, 2, iodf), *series(22, 4, 4, udrei)])


def fast_degradation(iodp: int, latency_s: int, ai: Sequence[int]) -> bytes:
    return frame(7, [(14, 4, latency_s), (18, 2, iodp), *series(22, 4, 4, ai)])


GEO_NAVIGATION = {
    "t0": (22, 13), "ura": (35, 4), "x": (39, 30), "y": (69, 30), "z": (99, 25),
    "xd": (124, 17), "yd": (141, 17), "zd": (158, 18), "xdd": (176, 10), "ydd": (186, 10),
    "zdd": (196, 10), "af0": (206, 12), "af1": (218, 8),
}  # fmt: skip
DEGRADATION = {
    "b_rrc": (14, 10), "c_ltc_lsb": (24, 10), "c_ltc_v1": (34, 10), "i_ltc_v1": (44, 9),
    "c_ltc_v0": (53, 10), "i_ltc_v0": (63, 9), "c_geo_lsb": (72, 10), "c_geo_v": (82, 10),
    "i_geo": (92, 9), "c_er": (101, 6), "c_iono_step": (107, 10), "i_iono": (117, 9),
    "c_iono_ramp": (126, 10), "rss_udre": (136, 1), "rss_iono": (137, 1),
    "c_covariance": (138, 7),
}  # fmt: skip
NETWORK_TIME = {
    "a1": (14, 24), "a0": (38, 32), "t0t": (70, 8), "wnt": (78, 8), "dtls": (86, 8),
    "wnlsf": (94, 8), "dn": (102, 8), "dtlsf": (110, 8), "utc": (118, 3), "tow": (121, 20),
    "wn": (141, 10), "glonass": (151, 1),
}  # fmt: skip
ALMANAC = {
    "data_id": (0, 2), "prn": (2, 8), "health": (10, 8), "x": (18, 15), "y": (33, 15),
    "z": (48, 9), "xd": (57, 3), "yd": (60, 3), "zd": (63, 4),
}  # fmt: skip


def _named(layout: dict[str, tuple[int, int]], values: dict[str, int], at: int = 0) -> list[Field]:
    return [(at + layout[name][0], layout[name][1], value) for name, value in values.items()]


def geo_navigation(**values: int) -> bytes:
    return frame(9, _named(GEO_NAVIGATION, values))


def degradation(**values: int) -> bytes:
    return frame(10, _named(DEGRADATION, values))


def network_time(**values: int) -> bytes:
    return frame(12, _named(NETWORK_TIME, values))


def almanacs(t0: int, *satellites: dict[str, int]) -> bytes:
    fields = [(215, 11, t0)]
    for i, values in enumerate(satellites):
        fields += _named(ALMANAC, values, 14 + 67 * i)
    return frame(17, fields)


def iono_mask(bands: int, band: int, iodi: int, points: Iterable[int]) -> bytes:
    """`points` numbered from 1."""
    chosen = [(23 + point, 1, 1) for point in points]
    return frame(18, [(14, 4, bands), (18, 4, band), (22, 2, iodi), *chosen])


Half = list[Field]


def half_fixed(iodp: int, *records: tuple[int, int, Sequence[int], int]) -> Half:
    """Velocity code 0: up to two of (position from 1, IOD, (dx, dy, dz), af0)."""
    fields = [(103, 2, iodp)]
    for at, (position, iod, delta, af0) in zip((1, 52), records, strict=False):
        fields += [(at, 6, position), (at + 6, 8, iod), *series(at + 14, 9, 9, delta)]
        fields.append((at + 41, 10, af0))
    return fields


def half_moving(
    iodp: int, position: int, iod: int, delta: Sequence[int], af0: int,
    rate: Sequence[int], af1: int, t0: int,
) -> Half:  # fmt: skip
    """Velocity code 1."""
    return [
        (0, 1, 1), (1, 6, position), (7, 8, iod), *series(15, 11, 11, delta), (48, 11, af0),
        *series(59, 8, 8, rate), (83, 8, af1), (91, 13, t0), (104, 2, iodp),
    ]  # fmt: skip


def _at(half: Half, start: int) -> list[Field]:
    return [(start + first, length, value) for first, length, value in half]


def long_term(first: Half, second: Half) -> bytes:
    return frame(25, [*_at(first, 14), *_at(second, 120)])


def mixed(
    iodf: int, iodp: int, block: int, prc: Sequence[int], udrei: Sequence[int], half: Half
) -> bytes:
    """Type 24: six fast corrections and a half message."""
    return frame(
        24,
        [
            *series(14, 12, 12, prc), *series(86, 4, 4, udrei), (110, 2, iodp), (112, 2, block),
            (114, 2, iodf), *_at(half, 120),
        ],
    )  # fmt: skip


def iono_delays(
    band: int, block: int, iodi: int, delay: Sequence[int], givei: Sequence[int]
) -> bytes:
    return frame(
        26,
        [
            (14, 4, band), (18, 4, block), *series(22, 9, 13, delay), *series(31, 4, 13, givei),
            (217, 2, iodi),
        ],
    )  # fmt: skip


def service(
    iods: int, messages: int, number: int, priority: int, inside: int, outside: int,
    *regions: tuple[int, int, int, int, int],
) -> bytes:  # fmt: skip
    """`messages` and `number` as meant; regions of lat1, lon1, lat2, lon2, shape."""
    fields = [
        (14, 3, iods), (17, 3, messages - 1), (20, 3, number - 1), (23, 3, len(regions)),
        (26, 2, priority), (28, 4, inside), (32, 4, outside),
    ]  # fmt: skip
    for i, region in enumerate(regions):
        at = 36 + 35 * i
        sizes = ((0, 8), (8, 9), (17, 8), (25, 9), (34, 1))
        fields += [(at + o, n, v) for (o, n), v in zip(sizes, region, strict=True)]
    return frame(27, fields)


def covariances(iodp: int, *satellites: tuple[int, int, Sequence[int], Sequence[int]]) -> bytes:
    """Up to two of (position from 1, scale exponent, E11 E22 E33 E44, E12 E13 E14 E23 E24 E34)."""
    fields = [(14, 2, iodp)]
    for at, (position, exponent, diagonal, beside) in zip((16, 121), satellites, strict=False):
        fields += [(at, 6, position), (at + 6, 3, exponent)]
        fields += [*series(at + 9, 9, 9, diagonal), *series(at + 45, 10, 10, beside)]
    return frame(28, fields)


def null() -> bytes:
    return frame(63)


def heard(*stamped: tuple[int, bytes], prn: int = PRN, start_s: int = START_S) -> SbasMessages:
    """Messages of one satellite at seconds after `start_s`, checked as those of a file are."""
    time_s = np.array([start_s + second for second, _ in stamped], np.int64)
    data = np.frombuffer(b"".join(message for _, message in stamped), np.uint8)
    n = time_s.size
    return checked_messages(time_s, np.full(n, prn), data.reshape(n, 32), has_crc=np.ones(n, bool))


def hourly(messages: dict[int, bytes], seconds: int) -> SbasMessages:
    """A message a second from 0, null where none is given."""
    return heard(*((second, messages.get(second, null())) for second in range(seconds)))


def epochs_ns(*seconds: float) -> np.ndarray:
    """Nanoseconds since the GPS epoch of seconds after START_S."""
    return np.array([round((START_S + second) * 1e9) for second in seconds], np.int64)
