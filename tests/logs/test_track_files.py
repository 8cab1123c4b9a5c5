"""GeoJSON tracks: what is read, what is asked for, and that nothing odd passes."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.logs import track_files
from sbas.logs.track_files import load_track

FLAT = [[15.0, 50.0], [15.01, 50.0], [15.02, 50.001]]
HIGH = [[15.0, 50.0, 250.0], [15.01, 50.0, 251.0]]


def put(folder: Path, root: Any) -> Path:
    path = folder / "track.geojson"
    path.write_text(root if isinstance(root, str) else json.dumps(root), encoding="utf-8")
    return path


def line(places: Any = FLAT, **properties: Any) -> dict[str, Any]:
    geometry = {"type": "LineString", "coordinates": places}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def test_a_feature_with_its_properties(tmp_path: Path) -> None:
    root = line(track_id="7a", kp_start_m=1200, sigma_m=0.25, frame="ETRF2000", colour="red")
    track = load_track(put(tmp_path, root))
    assert (track.track_id, track.kp_start_m, track.sigma_m, track.frame) == (
        "7a", (1200.0,), 0.25, "ETRF2000",
    )  # fmt: skip
    assert track.parts[0][:, 0].tolist() == [50.0, 50.0, 50.001]
    assert track.parts[0][:, 1].tolist() == [15.0, 15.01, 15.02]
    assert not track.has_heights
    given = load_track(put(tmp_path, root), sigma_m=0.5, frame="ITRF2014")
    assert (given.sigma_m, given.frame) == (0.5, "ITRF2014")


def test_all_shapes_of_one_line(tmp_path: Path) -> None:
    bare = load_track(put(tmp_path, {"type": "LineString", "coordinates": FLAT}))
    assert math.isnan(bare.sigma_m)
    assert (bare.frame, bare.track_id) == ("", "")
    point = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [15, 50]},
             "properties": None}  # fmt: skip
    collection = {"type": "FeatureCollection", "features": [point, line(track_id=3), point]}
    assert load_track(put(tmp_path, collection)).track_id == "3"
    many = {"type": "MultiLineString", "coordinates": [FLAT[:2], FLAT[1:]]}
    with pytest.raises(InputError, match="needs its start"):
        load_track(put(tmp_path, many))
    feature = {"type": "Feature", "geometry": many, "properties": {"kp_start_m": [0, 5000.5]}}
    track = load_track(put(tmp_path, feature))
    assert len(track.parts) == 2
    assert track.kp_start_m == (0.0, 5000.5)
    assert load_track(put(tmp_path, "\ufeff" + json.dumps(line()))).length_m > 1000


def test_one_of_several_lines_is_named(tmp_path: Path) -> None:
    several = {"type": "FeatureCollection", "features": [line(track_id="1"), line(track_id="2")]}
    with pytest.raises(InputError, match="2 line") as caught:
        load_track(put(tmp_path, several))
    assert "1, 2" in caught.value.evidence
    assert load_track(put(tmp_path, several), track_id="2").track_id == "2"
    with pytest.raises(InputError, match="no line with track_id '5'"):
        load_track(put(tmp_path, several), track_id="5")


def test_heights_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nobody said") as caught:
        load_track(put(tmp_path, line(HIGH)))
    assert "--track-height geoid with --truth-geoid UNDULATION" in caught.value.cure
    path = put(tmp_path, line(HIGH))
    assert load_track(path, height="ellipsoidal").parts[0][:, 2].tolist() == [250.0, 251.0]
    assert load_track(path, height="geoid", geoid=44.5).parts[0][0, 2] == 294.5
    assert np.isnan(load_track(path, height="ignore").parts[0][:, 2]).all()
    with pytest.raises(InputError, match="no undulation") as caught:
        load_track(path, height="geoid")
    assert caught.value.cure.startswith("--truth-geoid UNDULATION")
    assert load_track(put(tmp_path, line(HIGH, height="ellipsoidal"))).has_heights
    with pytest.raises(InputError, match="nobody said"):
        load_track(put(tmp_path, line(HIGH, height=["ellipsoidal"])))


def test_the_old_member_crs(tmp_path: Path) -> None:
    def crs(name: str) -> dict[str, Any]:
        return line() | {"crs": {"type": "name", "properties": {"name": name}}}

    assert load_track(put(tmp_path, crs("urn:ogc:def:crs:OGC:1.3:CRS84"))).frame == ""
    assert load_track(put(tmp_path, crs("EPSG:4326"))).frame == ""
    assert load_track(put(tmp_path, crs("urn:ogc:def:crs:EPSG::4258"))).frame == "ETRS89"
    for name in ("urn:ogc:def:crs:EPSG::5514", "EPSG:14326", "", "CRS84x"):
        with pytest.raises(InputError, match="not in degrees"):
            load_track(put(tmp_path, crs(name)))
    with pytest.raises(InputError, match="not in degrees"):
        load_track(put(tmp_path, line() | {"crs": 4326}))


@pytest.mark.parametrize(
    ("root", "message"),
    [
        ("", "no GeoJSON"),
        ("[1, 2", "no GeoJSON"),
        ("[1, 2]", "no GeoJSON object"),
        ("[" * 100_000, "no GeoJSON"),
        ('{"type": "LineString", "coordinates": [[15, NaN], [15, 50]]}', "no GeoJSON"),
        ('{"type": "LineString", "type": "LineString", "coordinates": []}', "no GeoJSON"),
        ('{"type": "LineString", "coordinates": [[15, 1e999], [15, 50]]}', "not finite"),
        ('{"type": "LineString", "coordinates": [[15, 1' + "0" * 400 + "], [15, 50]]}",
         "not finite"),
        ('{"type": "LineString", "coordinates": [[15, 1' + "0" * 5000 + "], [15, 50]]}",
         "no GeoJSON"),
        ({"type": "LineString"}, "places of a track"),
        ({"type": "LineString", "coordinates": []}, "places of a track"),
        ({"type": "LineString", "coordinates": [15, 50]}, "places of a track"),
        ({"type": "MultiLineString", "coordinates": []}, "no coordinates"),
        ({"type": "MultiLineString", "coordinates": FLAT}, "places of a track"),
        ({"type": "MultiLineString", "coordinates": {"a": 1}}, "no coordinates"),
        ({"type": "Point", "coordinates": [15, 50]}, "no line"),
        ({"type": ["LineString"], "coordinates": FLAT}, "no line"),
        ({"type": "FeatureCollection", "features": 5}, "no line"),
        ({"type": "FeatureCollection", "features": [None, 3]}, "no line"),
        ({"type": "Feature", "geometry": None}, "no line"),
        (line([[15, 50]]), "two or more"),
        (line([[15, 50], [15, 50]]), "fewer than two"),
        (line([[15, 50], [15.01, 50, 200]]), "places of a track"),
        (line([[15, 50, 1, 2], [15.01, 50, 1, 2]]), "places of a track"),
        (line([["15", 50], [15.01, 50]]), "no number"),
        (line([[True, 50], [15.01, 50]]), "no number"),
        (line([[15, None], [15.01, 50]]), "no number"),
        (line([[50.0, 115.0], [50.0, 115.01]]), "swapped"),
        (line([[-740_000, -1_040_000], [-740_000, -1_040_100]]), "no degrees"),
        (line([[190, 95], [190, 95.1]]), "not on Earth"),
        (line([[15, 50], [16, 50]]), "too far apart"),
        (line(sigma_m="0.5"), "number of metres"),
        (line(sigma_m=True), "number of metres"),
        (line(sigma_m=-1), "metres"),
        (line(kp_start_m="12"), "number of metres"),
        (line(kp_start_m=[0, 1]), "needs its start"),
    ],
)  # fmt: skip
def test_hostile_and_broken_files_are_refused(tmp_path: Path, root: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_track(put(tmp_path, root))


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no such track file"):
        load_track(tmp_path / "none.geojson")
    path = put(tmp_path, line())
    monkeypatch.setattr(track_files, "MOST_BYTES", 50)
    with pytest.raises(InputError, match="too large"):
        load_track(path)
    monkeypatch.undo()
    path.write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError, match="no GeoJSON"):
        load_track(path)
