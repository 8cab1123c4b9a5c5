"""Options that every verb on recordings shares: reading, repairs, truth, track, environments."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.logs.arrow import parquet
from tests.cli.test_verbs import TRUTH, Answer, stored
from tests.examples import POINT, quiet, recording
from tests.logs.nmea import nmea_samples
from tests.logs.ublox import ubx_samples


def test_a_folder_with_a_packed_and_a_repeated_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = b"".join(nmea_samples.log(120))
    (tmp_path / "a.nmea").write_bytes(data)
    (tmp_path / "b.nmea.gz").write_bytes(gzip.compress(data))
    (tmp_path / "copy.nmea").write_bytes(data)
    answer = Answer(capsys, "check", tmp_path / "a.nmea", tmp_path / "copy.nmea", "--json")
    assert answer.json["epochs"] == 120
    assert "E26" in [f["code"] for f in answer.json["findings"]]
    packed = Answer(capsys, "check", tmp_path / "b.nmea.gz", "--json").json
    assert (packed["epochs"], packed["format"]) == (120, "nmea")


def test_an_option_of_another_format_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.nmea").write_bytes(b"".join(nmea_samples.log(9)))
    answer = Answer(capsys, "check", tmp_path / "a.nmea", "--ubx-pl", "max")
    assert answer.code == 2
    assert "no option ubx_pl" in answer.err


def test_fix_writes_what_it_repaired(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = quiet(600)
    table = good.table.assign(lat_deg=good.table["lon_deg"], lon_deg=good.table["lat_deg"])
    shuffled = table.iloc[np.r_[300:600, 0:300]]
    path = stored(tmp_path / "bad.parquet", good.replace(table=shuffled))
    out = tmp_path / "repaired.parquet"
    answer = Answer(capsys, "check", path, *TRUTH, "--fix", out, "--json")
    assert answer.code == 0
    assert answer.json["file"] == str(out)
    repaired = parquet.read(out)
    pd.testing.assert_frame_equal(
        repaired.table[["lat_deg", "lon_deg"]], good.table[["lat_deg", "lon_deg"]]
    )
    assert json.loads(repaired.meta.options["repairs"])
    assert Answer(capsys, "check", path, "--fix", path).code == 2
    assert "metadata" in Answer(capsys, "check", path, "--fix", tmp_path / "x.sbf").err


def test_figures_by_environment(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    n = 2400
    east = np.where(np.arange(n) < 1200, 0.5, 0.5)
    east[1500:1520] = 40.0
    path = stored(tmp_path / "run.parquet", recording(east, np.zeros(n), np.full(n, 11.0)))
    places = tmp_path / "places.csv"
    places.write_text(
        "label,begin,end\nopen,2009-09-19T00:00:00,2009-09-19T00:20:00\n"
        "cutting,2009-09-19T00:20:00,2009-09-19T00:40:00\n"
    )
    common = (path, *TRUTH, "--environments", places)
    answer = Answer(capsys, "evaluate", *common, "--json").json
    epochs = {name: part["epochs"] for name, part in answer["environments"].items()}
    assert epochs == {"open": 1200, "cutting": 1200}
    hmi = {
        name: part["alert_limits"]["25"]["rates"]["hmi"]["events"]
        for name, part in answer["environments"].items()
    }
    assert hmi == {"open": 0, "cutting": 1}
    text = Answer(capsys, "evaluate", *common).out
    assert "cutting" in text
    assert "counts under each label" in text
    rate = Answer(
        capsys, "rate", *common, "--alert-limit", 25, "--environment", "open", "--json"
    ).json
    assert rate["demonstrated"]["upper_per_h"] > 0
    unknown = Answer(capsys, "rate", *common, "--alert-limit", 25, "--environment", "tunnel")
    assert unknown.code == 2
    assert "cutting" in unknown.err


def test_a_track_as_truth_shows_only_errors_across_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = stored(tmp_path / "run.parquet", quiet(600))
    line = [[POINT.lon_deg, POINT.lat_deg - 0.01], [POINT.lon_deg, POINT.lat_deg + 0.01]]
    track = tmp_path / "line.geojson"
    track.write_text(
        json.dumps(
            {
                "type": "Feature",
                "properties": {"track_id": "1", "kp_start_m": 0, "sigma_m": 0.1},
                "geometry": {"type": "LineString", "coordinates": line},
            }
        )
    )
    answer = Answer(capsys, "evaluate", path, "--track", track, "--truth", "track", "--json").json
    assert answer["errors_are_lower_bound"]
    # Half of an isotropic error of 0.5 m a coordinate lies across a line.
    assert answer["hpe_m"]["median"] == pytest.approx(0.6745 * 0.5, rel=0.1)
    demonstrated = answer["alert_limits"]["25"]["rates"]["hmi"]["demonstrated"]
    assert "not demonstrated" in demonstrated["refused"]
    assert Answer(capsys, "evaluate", path, "--truth", "track").code == 2
    assert Answer(capsys, "evaluate", path, "--track-id", "1").code == 2


def test_levels_of_another_risk_are_never_joined(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.ubx"
    own.write_bytes(
        b"".join(ubx_samples.pvt(1000 * i) + ubx_samples.pl(1000 * i) for i in range(60))
    )
    first = Answer(capsys, "check", own, "--json").json
    assert "E23" in [f["code"] for f in first["findings"]]
    other = stored(tmp_path / "roof.parquet", quiet(60))
    joined = Answer(capsys, "evaluate", own, other, "--accept", "E06")
    assert joined.code == 2
    assert "risk" in joined.err or "kind" in joined.err
