"""Every layout decoded as the standard has it: samples off the air, and round trips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.bit_fields import bits_of, unsigned_series
from sbas.augmentation.decoding import decode
from sbas.augmentation.message_types import Decoded
from sbas.augmentation.messages import SbasMessages
from tests.augmentation import encoding as enc


def frame_of(hexadecimal: str) -> bytes:
    return bytes.fromhex(hexadecimal.ljust(64, "0"))


def decoded(*frames: bytes) -> Decoded:
    return decode(enc.heard(*enumerate(frames)))


def raw(start: int, stop: int) -> st.SearchStrategy[int]:
    return st.integers(start, stop - 1)


def signed(bits: int) -> st.SearchStrategy[int]:
    return st.integers(-(1 << (bits - 1)), (1 << (bits - 1)) - 1)


# Off the air: RTKLIB's gw10_20110121.sbs (MSAS), MAAST's WAAS set, MSAS of 2025; 226 bits.
MT2 = "5308DFFC010005FFC00DFFC009FFDFFC001FFDFFDFFFBABBBBBB9BBB80"
MT18 = "5348DF0000000000FC0000FFC0007FF0003FFC001FFC0007FF8003FF80"
MT26 = "9A680053E21F17F897C000000000000000000000000000000000006000"
MT6 = "C618027B95795579B9FB17BB9F97B9D5F97BBFBBBBBBBBBBBBBBBBBB978ADA00"
MT10 = "9A28360984C80130644DF48800DA24B0000000000000000000000000202419C0"
MT28 = "C673590502A1504007FF80605FF60780000000000000000000000000143275C0"


def data_bits(hexadecimal: str) -> str:
    return format(int.from_bytes(frame_of(hexadecimal), "big"), "0256b")[:226]


@pytest.mark.parametrize(
    ("hexadecimal", "crc"),
    [(MT2, 0x0EA738), (MT18, 0x5CB54C), (MT26, 0x5DC1E2), (MT6, 0x5E2B68)],
)
def test_the_crc_of_messages_off_the_air(hexadecimal: str, crc: int) -> None:
    """The encoder's CRC, against that of a broadcast frame (type 6) and other programs' values."""
    assert enc.crc24q(data_bits(hexadecimal)) == crc


def with_crc(hexadecimal: str) -> bytes:
    bits = data_bits(hexadecimal)
    whole = bits + format(enc.crc24q(bits), "024b") + "000000"
    return int(whole, 2).to_bytes(32, "big")


def test_fast_corrections_off_the_air() -> None:
    fast = decoded(with_crc(MT2)).fast
    unsigned = np.array([2047, 4, 1, 2047, 3, 2047, 2, 2047, 2047, 0, 2047, 2047, 2047])
    np.testing.assert_array_equal(fast.prc_m, unsigned * 0.125)
    assert fast.udrei.tolist() == [14, 14, 10, 14, 14, 14, 14, 14, 14, 6, 14, 14, 14]
    assert set(fast.iodf.tolist()) == {0}
    assert set(fast.iodp.tolist()) == {3}
    assert fast.position.tolist() == list(range(13))


def test_an_ionospheric_mask_off_the_air() -> None:
    masks = decoded(with_crc(MT18)).iono_masks
    points = np.flatnonzero(masks.point[0]) + 1
    assert (masks.bands[0], masks.band[0], masks.iodi[0], points.size) == (3, 7, 3, 73)
    assert points[:10].tolist() == [41, 42, 43, 44, 45, 46, 65, 66, 67, 68]
    assert points[-1] == 201


def test_ionospheric_delays_off_the_air() -> None:
    delays = decoded(with_crc(MT26)).iono_delays
    assert (delays.band[0], delays.block[0], delays.iodi[0]) == (0, 0, 3)
    assert delays.delay[0, :4].tolist() == [41, 33, 47, 37]
    assert delays.givei[0, :4].tolist() == [15, 15, 15, 15]


def test_degradation_parameters_off_the_air() -> None:
    found = decoded(frame_of(MT10)).degradation
    want = {
        "b_rrc_m": 0.108, "c_ltc_lsb_m": 0.076, "c_ltc_v1_mps": 0.0038, "i_ltc_v1_s": 256,
        "c_ltc_v0_m": 0.304, "i_ltc_v0_s": 100, "c_geo_lsb_m": 0.1555, "c_geo_v_mps": 0.042,
        "i_geo_s": 256, "c_er_m": 3.0, "c_iono_step_m": 0.836, "i_iono_s": 300,
        "c_iono_ramp_mps": 0.0, "rss_udre": 0, "rss_iono": 0, "c_covariance": 0.0,
    }  # fmt: skip
    for name, value in want.items():
        assert getattr(found, name)[0] == pytest.approx(value, abs=1e-12), name


def test_a_covariance_off_the_air() -> None:
    found = decoded(frame_of(MT28)).covariances
    assert (found.iodp[0], found.position[0] + 1, found.scale[0]) == (3, 22, 0.125)
    np.testing.assert_array_equal(
        found.factor[0],
        [
            [2.5, 0.375, -0.125, 0.375],
            [0, 2.625, 1.375, -0.625],
            [0, 0, 2.625, 1.875],
            [0, 0, 0, 1.0],
        ],
    )
    assert found.time_s.size == 1, "the second half names no satellite"


@given(st.sets(raw(1, 211), max_size=51), raw(0, 4))
def test_masks_come_back(slots: set[int], iodp: int) -> None:
    found = decoded(enc.mask(iodp, slots)).masks
    assert found.iodp[0] == iodp
    assert found.prn_of[0].tolist() == [*sorted(slots), *[0] * (51 - len(slots))]


@given(
    raw(0, 6).filter(lambda kind: kind != 1),
    raw(0, 4), raw(0, 4), st.lists(signed(12), min_size=13, max_size=13),
    st.lists(raw(0, 16), min_size=13, max_size=13),
)  # fmt: skip
def test_fast_corrections_come_back(
    kind: int, iodf: int, iodp: int, prc: list[int], udrei: list[int]
) -> None:
    found = decoded(enc.fast(kind, iodf, iodp, prc, udrei)).fast
    first = 13 * max(kind - 2, 0)
    count = 12 if kind == 5 else 13
    assert found.position.tolist() == [first + i for i in range(count)]
    np.testing.assert_array_equal(found.prc_m, 0.125 * np.array(prc[:count]))
    assert found.udrei.tolist() == udrei[:count]
    assert set(found.iodf.tolist()) == {iodf}
    assert set(found.iodp.tolist()) == {iodp}
    assert set(found.block.tolist()) == {max(kind - 2, 0)}


@given(
    raw(0, 4), raw(0, 4), raw(0, 4), st.lists(signed(12), min_size=6, max_size=6),
    st.lists(raw(0, 16), min_size=6, max_size=6), raw(1, 52), raw(0, 256),
    st.lists(signed(9), min_size=3, max_size=3), signed(10),
)  # fmt: skip
def test_both_halves_of_mixed_messages_come_back(
    iodf: int, iodp: int, block: int, prc: list[int], udrei: list[int],
    position: int, iod: int, delta: list[int], af0: int,
) -> None:  # fmt: skip
    half = enc.half_fixed(iodp, (position, iod, delta, af0))
    found = decoded(enc.mixed(iodf, iodp, block, prc, udrei, half))
    assert found.fast.position.tolist() == [13 * block + i for i in range(6)]
    np.testing.assert_array_equal(found.fast.prc_m, 0.125 * np.array(prc))
    assert found.fast.udrei.tolist() == udrei
    assert set(found.fast.iodf.tolist()) == {iodf}
    assert set(found.fast.block.tolist()) == {block}
    slow = found.long_term
    assert (slow.position[0] + 1, slow.iod[0], slow.iodp[0]) == (position, iod, iodp)
    np.testing.assert_array_equal(slow.delta_m[0], 0.125 * np.array(delta))
    assert slow.clock_s[0] == af0 / 2**31
    assert slow.velocity_code[0] == 0


@given(st.lists(raw(0, 4), min_size=4, max_size=4), st.lists(raw(0, 16), min_size=51, max_size=51))
def test_integrity_comes_back(iodf: list[int], udrei: list[int]) -> None:
    found = decoded(enc.integrity(iodf, udrei)).integrity
    assert found.iodf[0].tolist() == iodf
    assert found.udrei[0].tolist() == udrei


@given(raw(0, 4), raw(0, 16), st.lists(raw(0, 16), min_size=51, max_size=51))
def test_fast_degradation_comes_back(iodp: int, latency: int, ai: list[int]) -> None:
    found = decoded(enc.fast_degradation(iodp, latency, ai)).fast_degradation
    assert (found.iodp[0], found.latency_s[0]) == (iodp, latency)
    assert found.ai[0].tolist() == ai


GEO_UNITS = {
    "x": 0.08, "y": 0.08, "z": 0.4, "xd": 0.000625, "yd": 0.000625, "zd": 0.004,
    "xdd": 0.0000125, "ydd": 0.0000125, "zdd": 0.0000625, "af0": 2**-31, "af1": 2**-40,
}  # fmt: skip


@given(
    raw(0, 5400), raw(0, 16),
    st.fixed_dictionaries({name: signed(enc.GEO_NAVIGATION[name][1]) for name in GEO_UNITS}),
)  # fmt: skip
def test_geo_navigation_comes_back(t0: int, ura: int, values: dict[str, int]) -> None:
    found = decoded(enc.geo_navigation(t0=t0, ura=ura, **values)).geo_navigation
    assert (found.t0_s[0], found.ura[0]) == (16 * t0, ura)
    have = [*found.position_m[0], *found.velocity_mps[0], *found.acceleration_mps2[0],
            found.clock_s[0], found.drift[0]]  # fmt: skip
    want = [values[name] * unit for name, unit in GEO_UNITS.items()]
    np.testing.assert_allclose(have, want, rtol=1e-12, atol=0)


DEGRADATION_UNITS = {
    "b_rrc": ("b_rrc_m", 0.002), "c_ltc_lsb": ("c_ltc_lsb_m", 0.002),
    "c_ltc_v1": ("c_ltc_v1_mps", 0.00005), "i_ltc_v1": ("i_ltc_v1_s", 1),
    "c_ltc_v0": ("c_ltc_v0_m", 0.002), "i_ltc_v0": ("i_ltc_v0_s", 1),
    "c_geo_lsb": ("c_geo_lsb_m", 0.0005), "c_geo_v": ("c_geo_v_mps", 0.00005),
    "i_geo": ("i_geo_s", 1), "c_er": ("c_er_m", 0.5), "c_iono_step": ("c_iono_step_m", 0.001),
    "i_iono": ("i_iono_s", 1), "c_iono_ramp": ("c_iono_ramp_mps", 0.000005),
    "rss_udre": ("rss_udre", 1), "rss_iono": ("rss_iono", 1), "c_covariance": ("c_covariance", 0.1),
}  # fmt: skip


@given(
    st.fixed_dictionaries({name: raw(0, 1 << bits) for name, (_, bits) in enc.DEGRADATION.items()})
)
def test_degradation_comes_back(values: dict[str, int]) -> None:
    found = decoded(enc.degradation(**values)).degradation
    for name, (attribute, unit) in DEGRADATION_UNITS.items():
        assert getattr(found, attribute)[0] == pytest.approx(values[name] * unit, rel=1e-12), name


def test_almanacs_come_back_without_the_empty_ones() -> None:
    first = {"data_id": 1, "prn": 123, "health": 5, "x": -16000, "y": 200, "z": -256, "xd": -4,
             "yd": 3, "zd": -8}  # fmt: skip
    found = decoded(enc.almanacs(1349, first, {"prn": 0, "x": 7}, {"prn": 136, "y": -1})).almanacs
    assert found.prn.tolist() == [123, 136]
    assert found.health.tolist() == [5, 0]
    assert set(found.t0_s.tolist()) == {1349 * 64}
    np.testing.assert_array_equal(found.position_m[0], [-16000 * 2600, 200 * 2600, -256 * 26000])
    np.testing.assert_array_equal(found.velocity_mps[0], [-40, 30, -480])
    np.testing.assert_array_equal(found.position_m[1], [0, -2600, 0])


@given(raw(0, 16), raw(0, 11), raw(0, 4), st.sets(raw(1, 202)))
def test_ionospheric_masks_come_back(bands: int, band: int, iodi: int, points: set[int]) -> None:
    found = decoded(enc.iono_mask(bands, band, iodi, points)).iono_masks
    assert (found.bands[0], found.band[0], found.iodi[0]) == (bands, band, iodi)
    assert (np.flatnonzero(found.point[0]) + 1).tolist() == sorted(points)


moving = st.tuples(
    raw(0, 4), raw(1, 52), raw(0, 256), st.lists(signed(11), min_size=3, max_size=3), signed(11),
    st.lists(signed(8), min_size=3, max_size=3), signed(8), raw(0, 5400),
)  # fmt: skip


@given(moving, moving)
def test_long_term_corrections_with_rates_come_back(first: tuple, second: tuple) -> None:  # type: ignore[type-arg]
    found = decoded(enc.long_term(enc.half_moving(*first), enc.half_moving(*second))).long_term
    for i, (iodp, position, iod, delta, af0, rate, af1, t0) in enumerate((first, second)):
        assert (found.iodp[i], found.position[i] + 1, found.iod[i]) == (iodp, position, iod)
        np.testing.assert_array_equal(found.delta_m[i], 0.125 * np.array(delta))
        np.testing.assert_array_equal(found.delta_rate_mps[i], np.array(rate) / 2**11)
        assert found.clock_s[i] == af0 / 2**31
        assert found.clock_rate[i] == af1 / 2**39
        assert found.t0_s[i] == 16 * t0
        assert found.velocity_code[i] == 1


fixed = st.tuples(raw(0, 52), raw(0, 256), st.lists(signed(9), min_size=3, max_size=3), signed(10))


@given(raw(0, 4), st.lists(fixed, min_size=4, max_size=4))
def test_long_term_corrections_without_rates_come_back(iodp: int, records: list[tuple]) -> None:  # type: ignore[type-arg]
    halves = enc.half_fixed(iodp, *records[:2]), enc.half_fixed(iodp, *records[2:])
    found = decoded(enc.long_term(*halves)).long_term
    wanted = [record for record in records if record[0]]
    assert found.position.tolist() == [record[0] - 1 for record in wanted]
    assert found.iod.tolist() == [record[1] for record in wanted]
    np.testing.assert_array_equal(
        found.delta_m, np.reshape([record[2] for record in wanted], (-1, 3)) * 0.125
    )
    assert found.clock_s.tolist() == [record[3] / 2**31 for record in wanted]
    assert not found.delta_rate_mps.any()
    assert not found.clock_rate.any()
    assert not found.t0_s.any()


@given(
    raw(0, 16), raw(0, 16), raw(0, 4), st.lists(raw(0, 512), min_size=15, max_size=15),
    st.lists(raw(0, 16), min_size=15, max_size=15),
)  # fmt: skip
def test_ionospheric_delays_come_back(
    band: int, block: int, iodi: int, delay: list[int], givei: list[int]
) -> None:
    found = decoded(enc.iono_delays(band, block, iodi, delay, givei)).iono_delays
    assert (found.band[0], found.block[0], found.iodi[0]) == (band, block, iodi)
    assert found.delay[0].tolist() == delay
    assert found.givei[0].tolist() == givei


region = st.tuples(signed(8), signed(9), signed(8), signed(9), raw(0, 2))


@given(raw(0, 8), raw(1, 9), raw(1, 9), raw(0, 4), raw(0, 16), raw(0, 16),
       st.lists(region, max_size=5))  # fmt: skip
def test_service_regions_come_back(
    iods: int, messages: int, number: int, priority: int, inside: int, outside: int,
    regions: list[tuple[int, int, int, int, int]],
) -> None:  # fmt: skip
    found = decoded(
        enc.service(iods, messages, number, priority, inside, outside, *regions)
    ).service_regions
    head = (found.iods[0], found.messages[0], found.number[0], found.regions[0],
            found.priority[0], found.inside[0], found.outside[0])  # fmt: skip
    assert head == (iods, messages, number, len(regions), priority, inside, outside)
    for i, values in enumerate(regions):
        assert found.corners_deg[0, i].tolist() == list(values[:4])
        assert found.rectangle[0, i] == (values[4] == 1)


covariance = st.tuples(
    raw(0, 52), raw(0, 8), st.lists(raw(0, 512), min_size=4, max_size=4),
    st.lists(signed(10), min_size=6, max_size=6),
)  # fmt: skip


@given(raw(0, 4), covariance, covariance)
def test_covariances_come_back(iodp: int, first: tuple, second: tuple) -> None:  # type: ignore[type-arg]
    found = decoded(enc.covariances(iodp, first, second)).covariances
    wanted = [values for values in (first, second) if values[0]]
    assert found.position.tolist() == [values[0] - 1 for values in wanted]
    for i, (_, exponent, diagonal, beside) in enumerate(wanted):
        e12, e13, e14, e23, e24, e34 = beside
        rows = [[diagonal[0], e12, e13, e14], [0, diagonal[1], e23, e24],
                [0, 0, diagonal[2], e34], [0, 0, 0, diagonal[3]]]  # fmt: skip
        assert found.scale[i] == 2.0 ** (exponent - 5)
        np.testing.assert_array_equal(found.factor[i], np.array(rows) * 2.0 ** (exponent - 5))


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        (enc.mask(0, range(1, 53)), 1),
        (enc.geo_navigation(t0=5400), 9),
        (enc.almanacs(1350, {"prn": 123}), 17),
        (enc.mixed(0, 0, 0, [1] * 6, [1] * 6, enc.half_fixed(0, (52, 1, [0, 0, 0], 0))), 24),
        (enc.long_term(enc.half_fixed(0, (1, 1, [0, 0, 0], 0), (52, 1, [0, 0, 0], 0)), []), 25),
        (enc.long_term([], enc.half_moving(0, 3, 1, [0, 0, 0], 0, [0, 0, 0], 0, 5400)), 25),
        (enc.covariances(0, (1, 0, [1] * 4, [0] * 6), (63, 0, [1] * 4, [0] * 6)), 28),
    ],
)
def test_a_message_with_content_that_is_not_allowed_is_void_as_a_whole(
    message: bytes, kind: int
) -> None:
    found = decoded(message)
    assert found.void == {kind: 1}
    tables = (found.masks, found.geo_navigation, found.almanacs, found.fast, found.long_term,
              found.covariances)  # fmt: skip
    assert all(table.time_s.size == 0 for table in tables)


@pytest.mark.parametrize(
    "message",
    [
        enc.mask(0, range(1, 52)),
        enc.geo_navigation(t0=5399),
        enc.almanacs(1349, {"prn": 123}),
        enc.long_term(
            enc.half_fixed(0, (51, 1, [0, 0, 0], 0)),
            enc.half_moving(0, 51, 1, [0, 0, 0], 0, [0, 0, 0], 0, 5399),
        ),
    ],
)
def test_the_last_value_that_is_allowed(message: bytes) -> None:
    assert decoded(message).void == {}


@given(st.binary(min_size=32, max_size=320), st.integers(0, 63))
def test_no_bits_raise(data: bytes, kind: int) -> None:
    """Random frames of any type decode; types beside this one stay empty."""
    n = len(data) // 32
    frames = np.frombuffer(data[: 32 * n], np.uint8).reshape(n, 32)
    messages = SbasMessages(
        np.arange(n), np.full(n, 131), np.full(n, kind), frames, np.ones(n, bool),
        np.empty(0, np.int64), np.empty(0, np.int64), {},
    )  # fmt: skip
    found = decode(messages)
    rows = {
        "masks": 1, "integrity": 6, "fast_degradation": 7, "geo_navigation": 9, "degradation": 10,
        "iono_masks": 18, "iono_delays": 26, "service_regions": 27,
    }  # fmt: skip
    for name, its_kind in rows.items():
        size = getattr(found, name).time_s.size
        assert size + found.void.get(kind, 0) == n if kind == its_kind else size == 0, name


@given(
    st.binary(min_size=32, max_size=32), st.integers(1, 16), st.integers(1, 5), st.integers(1, 4)
)
def test_fields_are_cut_from_the_bits_in_their_order(
    data: bytes, length: int, count: int, gap: int
) -> None:
    """Against Python's own integers."""
    whole = int.from_bytes(data, "big")
    bits = bits_of(np.frombuffer(data, np.uint8)[None])
    stride = length + gap
    want = [whole >> (256 - 8 - stride * i - length) & ((1 << length) - 1) for i in range(count)]
    assert unsigned_series(bits, 8, length, count, stride)[0].tolist() == want
