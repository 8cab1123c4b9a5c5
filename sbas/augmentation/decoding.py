"""All messages of a satellite decoded at once, a type at a time.

Source: RTCA DO-229D, A.4.4 (bit layouts), held against gLAB 6.0.0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import (
    Bits,
    bits_of,
    signed,
    signed_series,
    unsigned,
    unsigned_series,
)
from sbas.augmentation.message_types import (
    Almanacs,
    ClockEphemerisCovariances,
    Decoded,
    Degradation,
    FastCorrections,
    FastDegradation,
    GeoNavigation,
    Integrity,
    IonoDelays,
    IonoMasks,
    LongTermCorrections,
    Masks,
    ServiceRegions,
)
from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.tables import SLOTS

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MASK_BITS = 210
LAST_TIME_OF_DAY_S = 86384
LAST_ALMANAC_TIME_S = 86336
VOID_KIND = -1


def decode(messages: SbasMessages) -> Decoded:
    """Every message of one satellite in physical units.

    Parameters
    ----------
    messages : of one PRN, in the order of time.
    """
    bits = bits_of(messages.frame)
    void = _void(messages.kind, bits)
    kinds = np.where(void, VOID_KIND, messages.kind)

    def of(kind: int) -> tuple[Ints, Bits]:
        rows = np.flatnonzero(kinds == kind)
        return messages.time_s[rows], bits[rows]

    return Decoded(
        _masks(*of(1)),
        _fast(messages.time_s, kinds, bits),
        _integrity(*of(6)),
        _fast_degradation(*of(7)),
        _geo_navigation(*of(9)),
        _degradation(*of(10)),
        _almanacs(*of(17)),
        _iono_masks(*of(18)),
        _long_term(messages.time_s, kinds, bits),
        _iono_delays(*of(26)),
        _service_regions(*of(27)),
        _covariances(*of(28)),
        dict(Counter(messages.kind[void].tolist())),
    )


def _void(kind: Ints, bits: Bits) -> Bools:
    """(n,) True for messages whose content the standard does not allow."""
    void = np.zeros(kind.size, bool)

    def where(of_kind: int, wrong: Callable[[Bits], Bools]) -> None:
        rows = np.flatnonzero(kind == of_kind)
        void[rows] = wrong(bits[rows])

    where(1, lambda b: np.asarray(b[:, 14 : 14 + MASK_BITS].sum(axis=1) > SLOTS))
    where(9, lambda b: unsigned(b, 22, 13) * 16 > LAST_TIME_OF_DAY_S)
    where(17, lambda b: unsigned(b, 215, 11) * 64 > LAST_ALMANAC_TIME_S)
    where(24, lambda b: _void_half(b[:, 120:226]))
    where(25, lambda b: _void_half(b[:, 14:120]) | _void_half(b[:, 120:226]))
    where(28, lambda b: (unsigned(b, 16, 6) > SLOTS) | (unsigned(b, 121, 6) > SLOTS))
    return void


def _void_half(half: Bits) -> Bools:
    """(n,) True where a half message of types 24 and 25 names a place or a time beyond the last."""
    with_rates = half[:, 0] == 1
    beyond = unsigned(half, 1, 6) > SLOTS
    late = unsigned(half, 91, 13) * 16 > LAST_TIME_OF_DAY_S
    return beyond | np.where(with_rates, late, unsigned(half, 52, 6) > SLOTS)


def _masks(time_s: Ints, bits: Bits) -> Masks:
    chosen = bits[:, 14 : 14 + MASK_BITS].astype(bool)
    prn_of = np.zeros((time_s.size, SLOTS), np.int64)
    rows, slots = np.nonzero(chosen)
    position = np.cumsum(chosen, axis=1)[rows, slots] - 1
    prn_of[rows, position] = slots + 1
    return Masks(time_s, unsigned(bits, 224, 2), prn_of)


def _fast(times: Ints, kind: Ints, bits: Bits) -> FastCorrections:
    """Entries of types 0, 2-5 (13 satellites) and 24 (6), in the order of time."""
    parts = []
    for mixed, first_prc, first_udrei, count in ((False, 18, 174, 13), (True, 14, 86, 6)):
        rows = np.flatnonzero(np.isin(kind, (24,) if mixed else (0, 2, 3, 4, 5)))
        chosen = bits[rows]
        if mixed:
            iodf, iodp = unsigned(chosen, 114, 2), unsigned(chosen, 110, 2)
            block = unsigned(chosen, 112, 2)
        else:
            iodf, iodp = unsigned(chosen, 14, 2), unsigned(chosen, 16, 2)
            block = np.maximum(kind[rows] - 2, 0)
        position = 13 * block[:, None] + np.arange(count)
        values = np.stack(
            np.broadcast_arrays(
                rows[:, None],
                times[rows][:, None],
                iodp[:, None],
                iodf[:, None],
                position,
                signed_series(chosen, first_prc, 12, count, 12),
                unsigned_series(chosen, first_udrei, 4, count, 4),
                block[:, None],
            )
        ).reshape(8, -1)
        # The thirteenth field of type 5 would be mask position 52.
        parts.append(values[:, values[4] < SLOTS])
    joined = np.concatenate(parts, axis=1)
    joined = joined[:, np.argsort(joined[0], kind="stable")]
    _, time_s, iodp, iodf, position, prc, udrei, block = joined
    return FastCorrections(time_s, iodp, iodf, position, 0.125 * prc, udrei, block)


def _integrity(time_s: Ints, bits: Bits) -> Integrity:
    return Integrity(
        time_s, unsigned_series(bits, 14, 2, 4, 2), unsigned_series(bits, 22, 4, SLOTS, 4)
    )


def _fast_degradation(time_s: Ints, bits: Bits) -> FastDegradation:
    return FastDegradation(
        time_s,
        unsigned(bits, 18, 2),
        unsigned(bits, 14, 4),
        unsigned_series(bits, 22, 4, SLOTS, 4),
    )


def _geo_navigation(time_s: Ints, bits: Bits) -> GeoNavigation:
    def three(fields: tuple[tuple[int, int, float], ...]) -> Floats:
        return np.column_stack([signed(bits, at, length) * unit for at, length, unit in fields])

    return GeoNavigation(
        time_s,
        unsigned(bits, 22, 13) * 16,
        unsigned(bits, 35, 4),
        three(((39, 30, 0.08), (69, 30, 0.08), (99, 25, 0.4))),
        three(((124, 17, 0.000625), (141, 17, 0.000625), (158, 18, 0.004))),
        three(((176, 10, 0.0000125), (186, 10, 0.0000125), (196, 10, 0.0000625))),
        np.ldexp(signed(bits, 206, 12).astype(float), -31),
        np.ldexp(signed(bits, 218, 8).astype(float), -40),
    )


def _degradation(time_s: Ints, bits: Bits) -> Degradation:
    def number(start: int, length: int, unit: float) -> Floats:
        return unsigned(bits, start, length).astype(float) * unit

    return Degradation(
        time_s,
        number(14, 10, 0.002),
        number(24, 10, 0.002),
        number(34, 10, 0.00005),
        number(44, 9, 1.0),
        number(53, 10, 0.002),
        number(63, 9, 1.0),
        number(72, 10, 0.0005),
        number(82, 10, 0.00005),
        number(92, 9, 1.0),
        number(101, 6, 0.5),
        number(107, 10, 0.001),
        number(117, 9, 1.0),
        number(126, 10, 0.000005),
        unsigned(bits, 136, 1) == 1,
        unsigned(bits, 137, 1) == 1,
        number(138, 7, 0.1),
    )


def _almanacs(time_s: Ints, bits: Bits) -> Almanacs:
    parts = []
    for at in (14, 81, 148):
        place = [signed(bits, at + o, n) * u for o, n, u in ((18, 15, 2600.0), (33, 15, 2600.0),
                                                             (48, 9, 26000.0))]  # fmt: skip
        speed = [signed(bits, at + o, n) * u for o, n, u in ((57, 3, 10.0), (60, 3, 10.0),
                                                             (63, 4, 60.0))]  # fmt: skip
        head = (time_s, unsigned(bits, at + 2, 8), unsigned(bits, at + 10, 8),
                unsigned(bits, 215, 11) * 64)  # fmt: skip
        parts.append(np.column_stack([*head, *place, *speed]))
    rows = np.concatenate(parts)
    rows = rows[rows[:, 1] > 0]
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    whole = rows[:, :4].astype(np.int64)
    return Almanacs(whole[:, 0], whole[:, 1], whole[:, 2], whole[:, 3], rows[:, 4:7], rows[:, 7:10])


def _iono_masks(time_s: Ints, bits: Bits) -> IonoMasks:
    return IonoMasks(
        time_s,
        unsigned(bits, 14, 4),
        unsigned(bits, 18, 4),
        unsigned(bits, 22, 2),
        bits[:, 24:225].astype(bool),
    )


def _long_term(times: Ints, kind: Ints, bits: Bits) -> LongTermCorrections:
    """Records of the half messages of types 24 (the second half) and 25 (both)."""
    parts = []
    for of_kind, starts in ((24, (120,)), (25, (14, 120))):
        rows = np.flatnonzero(kind == of_kind)
        for start in starts:
            half = bits[rows, start : start + 106]
            with_rates = half[:, 0] == 1
            parts.append(_half_with_rates(rows[with_rates], half[with_rates], start))
            for at in (1, 52):
                parts.append(_half_record(rows[~with_rates], half[~with_rates], at, start))
    joined = np.concatenate(parts)
    joined = joined[joined[:, 3] > 0]
    joined = joined[np.lexsort((joined[:, 1], joined[:, 0]))]
    whole = joined[:, [0, 2, 3, 4, 5, 13]].astype(np.int64)
    row, iodp, position, iod, code, t0_s = whole.T
    return LongTermCorrections(
        times[row],
        iodp,
        position - 1,
        iod,
        code,
        joined[:, 6:9],
        joined[:, 9:12],
        joined[:, 12],
        joined[:, 14],
        t0_s,
    )


def _half_record(rows: Ints, half: Bits, at: int, start: int) -> Floats:
    zero = np.zeros(rows.size)
    return np.column_stack(
        [
            rows,
            np.full(rows.size, start + at),
            unsigned(half, 103, 2),
            unsigned(half, at, 6),
            unsigned(half, at + 6, 8),
            zero,
            *(signed(half, at + 14 + 9 * k, 9) * 0.125 for k in range(3)),
            zero, zero, zero,
            signed(half, at + 41, 10) * 2.0**-31,
            zero, zero,
        ]
    )  # fmt: skip


def _half_with_rates(rows: Ints, half: Bits, start: int) -> Floats:
    return np.column_stack(
        [
            rows,
            np.full(rows.size, start),
            unsigned(half, 104, 2),
            unsigned(half, 1, 6),
            unsigned(half, 7, 8),
            np.ones(rows.size),
            *(signed(half, 15 + 11 * k, 11) * 0.125 for k in range(3)),
            *(signed(half, 59 + 8 * k, 8) * 2.0**-11 for k in range(3)),
            signed(half, 48, 11) * 2.0**-31,
            unsigned(half, 91, 13) * 16,
            signed(half, 83, 8) * 2.0**-39,
        ]
    )


def _iono_delays(time_s: Ints, bits: Bits) -> IonoDelays:
    return IonoDelays(
        time_s,
        unsigned(bits, 14, 4),
        unsigned(bits, 18, 4),
        unsigned(bits, 217, 2),
        unsigned_series(bits, 22, 9, 15, 13),
        unsigned_series(bits, 31, 4, 15, 13),
    )


def _service_regions(time_s: Ints, bits: Bits) -> ServiceRegions:
    at = (36, 44, 53, 61)
    corners = [signed_series(bits, o, n, 5, 35) for o, n in zip(at, (8, 9, 8, 9), strict=True)]
    return ServiceRegions(
        time_s,
        unsigned(bits, 14, 3),
        unsigned(bits, 17, 3) + 1,
        unsigned(bits, 20, 3) + 1,
        unsigned(bits, 23, 3),
        unsigned(bits, 26, 2),
        unsigned(bits, 28, 4),
        unsigned(bits, 32, 4),
        np.stack(corners, axis=-1),
        unsigned_series(bits, 70, 1, 5, 35) == 1,
    )


def _covariances(time_s: Ints, bits: Bits) -> ClockEphemerisCovariances:
    parts = []
    for start in (16, 121):
        position = unsigned(bits, start, 6)
        scale = 2.0 ** (unsigned(bits, start + 6, 3) - 5.0)
        diagonal = unsigned_series(bits, start + 9, 9, 4, 9)
        beside = signed_series(bits, start + 45, 10, 6, 10)
        parts.append(
            np.column_stack([time_s, unsigned(bits, 14, 2), position, scale, diagonal, beside])
        )
    rows = np.concatenate(parts)
    rows = rows[rows[:, 2] > 0]
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    factor = np.zeros((len(rows), 4, 4))
    factor[:, np.arange(4), np.arange(4)] = rows[:, 4:8]
    factor[:, [0, 0, 0, 1, 1, 2], [1, 2, 3, 2, 3, 3]] = rows[:, 8:14]
    whole = rows[:, :3].astype(np.int64)
    return ClockEphemerisCovariances(
        whole[:, 0],
        whole[:, 1],
        whole[:, 2] - 1,
        factor * rows[:, 3, None, None],
        rows[:, 3],
    )
