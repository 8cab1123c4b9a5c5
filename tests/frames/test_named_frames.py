"""Frames and chains of frames by their text."""

from __future__ import annotations

import pytest

from sbas.exceptions import InputError
from sbas.frames import find_frame, frame_change


@pytest.mark.parametrize(
    ("text", "name", "code", "epoch", "dynamic"),
    [
        ("ETRF2000", "ETRF2000", 7931, None, False),
        ("etrf 2000 2025.5", "ETRF2000", 7931, 2025.5, False),
        ("ITRF2014@2010.0", "ITRF2014", 7912, 2010.0, True),
        ("ITRF 2014", "ITRF2014", 7912, None, True),
        ("WGS84", "WGS 84", 4979, None, False),
        ("wgs 84 (g2139)", "WGS 84 (G2139)", 9754, None, True),
        ("WGS 84, simulated", "WGS 84", 4979, None, False),
        ("EPSG:4258 2020", "ETRS89", 4937, 2020.0, False),
        ("S-JTSK", "S-JTSK", 4156, None, False),
        ("EPSG:5514", "S-JTSK", 4156, None, False),
    ],
)
def test_a_frame_by_its_text(
    text: str, name: str, code: int, epoch: float | None, dynamic: bool
) -> None:
    # Names and codes: EPSG data set, https://epsg.org.
    frame = find_frame(text)
    assert (frame.name, frame.code, frame.epoch, frame.dynamic) == (name, code, epoch, dynamic)


def test_what_a_frame_says_of_itself() -> None:
    assert find_frame("EPSG:5514").projection == 5514
    assert find_frame("S-JTSK").ellipsoid == "Bessel 1841"
    assert find_frame("ETRS89").ensemble
    assert not find_frame("ETRF2000").ensemble
    assert str(find_frame("itrf2014 2010")) == "ITRF2014 2010"
    assert find_frame(str(find_frame("ITRF2014 2025.473"))).epoch == 2025.473


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ETRF200", "ETRF2000"),
        ("", "none"),
        ("somewhere", "near"),
        ("ETRF2000 9999", "decimal year"),
        ("EPSG:999999", "no coordinates of code"),
        ("EPSG:2065", "easting and northing"),  # southing and westing
        ("EPSG:2263", "easting and northing"),  # US survey feet
        ("EPSG:7930", "Geocentric"),
        ("EPSG:8360", "Compound"),
        ("+proj=longlat", "unknown"),
    ],
)
def test_an_unknown_frame_is_refused_with_near_names(text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        find_frame(text)
    assert says in str(caught.value)
    assert caught.value.cure


def test_a_chain_is_read_in_its_order() -> None:
    chain = frame_change("EPSG:5514 > ETRS89[S-JTSK to ETRS89 (1)] > ITRF2014@2025.5")
    assert chain.source.name == "S-JTSK"
    assert [(s.target.name, s.target.epoch, s.operation) for s in chain.steps] == [
        ("ETRS89", None, "S-JTSK to ETRS89 (1)"),
        ("ITRF2014", 2025.5, ""),
    ]


@pytest.mark.parametrize(
    "text",
    [
        "ETRF2000", "ETRF2000>", ">ITRF2014", "", "ETRF2000>>ITRF2014", "ITRF2014>ITRF2014@2020",
        "ETRF2000[x]>ITRF2014", "ETRF2000>ITRF2014[x", "ETRF2000>ITRF2014[]", "ETRF2000>EPSG:25833",
        "ETRF2000>nowhere",
    ],
)  # fmt: skip
def test_a_chain_that_leads_nowhere_is_refused(text: str) -> None:
    with pytest.raises(InputError) as caught:
        frame_change(text)
    assert caught.value.cure
