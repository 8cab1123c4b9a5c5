"""Settings: the bundled file, and what happens to files that say something else."""

from __future__ import annotations

import tomllib
from dataclasses import fields
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError, ModelError
from sbas.laboratory import LaboratorySettings, bundled_settings, load_settings
from tests.conftest import ROOT

KEYS = [field.name for field in fields(LaboratorySettings)]


def written(tmp_path, text):
    path = tmp_path / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_bundled_record_is_the_papers():
    # Filip, Bazant, Mocek 2010, section 3: 3e5 s at 1 Hz from 2009-09-19, NPA.
    settings = bundled_settings()
    assert settings.epochs == 300_000
    assert settings.interval_s == 1.0
    assert settings.start == datetime(2009, 9, 19)
    assert (settings.mode, settings.k_h) == ("npa", 6.18)
    assert settings.failure_rate_per_h == 0


def test_bundled_file_states_every_setting():
    plain = tomllib.loads((ROOT / "data" / "laboratory_2009.toml").read_text("utf-8"))
    assert set(plain) == {"schema", *KEYS}


def test_every_default_is_a_setting_without_injected_events():
    s = LaboratorySettings()
    rates = (s.gaps_per_day, s.hpl_outliers_per_day, s.satellite_losses_per_day)
    assert (*rates, s.failure_rate_per_h) == (0, 0, 0, 0)


def test_keys_of_a_file_become_settings(tmp_path):
    path = written(
        tmp_path,
        'schema = 1\nmode = "pa"\nhours = 2\nseed = 9\nhpl_outlier_m = [70, 80]\n'
        "start = 2020-01-02T03:04:05\nsbas_frames = false\n",
    )
    expected = LaboratorySettings(
        mode="pa", hours=2.0, seed=9, hpl_outlier_m=(70.0, 80.0),
        start=datetime(2020, 1, 2, 3, 4, 5), sbas_frames=False,
    )  # fmt: skip
    assert load_settings(path) == expected
    assert expected.k_h == 6.0


def test_unknown_key_names_the_nearest_and_all(tmp_path):
    path = written(tmp_path, "schema = 1\nfailure_rate_per_hour = 1.0\n")
    with pytest.raises(ModelError) as caught:
        load_settings(path)
    assert "'failure_rate_per_h'" in caught.value.what
    assert caught.value.where == "lab.toml: failure_rate_per_hour"
    assert all(key in caught.value.cure for key in KEYS)


@pytest.mark.parametrize(
    ("line", "where"),
    [
        ("hours = -1.0", "hours"),
        ("hours = nan", "hours"),
        ("hours = 1e-9", "hours"),
        ("interval_s = 0.0", "interval_s"),
        ("lat_deg = 91.0", "lat_deg"),
        ("slots = 31", "slots"),
        ('mode = "npv1"', "mode"),
        ("geo_prn = 5", "geo_prn"),
        ("white_share = 1.5", "white_share"),
        ("udrei_horizon = 14", "udrei_horizon"),
        ("gap_duration_s = [5.0, 2.0]", "gap_duration_s"),
        ("gap_duration_s = [0.0, 2.0]", "gap_duration_s"),
        ("gap_duration_s = 5.0", "gap_duration_s"),
        ('gap_duration_s = [5.0, "x"]', "gap_duration_s"),
        ("seed = -1", "seed"),
        ("seed = 1.5", "seed"),
        ("seed = true", "seed"),
        ('hours = "3"', "hours"),
        ("name = 3", "name"),
        ("start = 1979-01-01T00:00:00", "start"),
        ("start = 2009-09-19T00:00:00Z", "start"),
        ("start = 2009-09-19", "start"),
        ("sbas_frames = 1", "sbas_frames"),
    ],
)
def test_values_without_meaning_are_refused_with_their_key(tmp_path, line, where):
    with pytest.raises(ModelError) as caught:
        load_settings(written(tmp_path, f"schema = 1\n{line}\n"))
    assert caught.value.where == where


def test_numpy_numbers_serve_as_well():
    assert LaboratorySettings(seed=np.int64(3), hours=np.float64(2)) == LaboratorySettings(
        seed=3, hours=2.0
    )


@pytest.mark.parametrize("text", ["", "schema = 2", "schema = 'one'", "hours ="])
def test_other_files_are_refused(tmp_path, text):
    with pytest.raises(ModelError, match=r"schema|TOML"):
        load_settings(written(tmp_path, text))


def test_absent_and_binary_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_settings(tmp_path / "none.toml")
    (tmp_path / "noise.toml").write_bytes(bytes(range(256)))
    with pytest.raises(ModelError, match="TOML"):
        load_settings(tmp_path / "noise.toml")


@given(
    key=st.sampled_from(KEYS),
    value=st.one_of(
        st.integers(),
        st.floats(),
        st.booleans(),
        st.text(),
        st.datetimes(),
        st.none(),
        st.lists(st.one_of(st.floats(), st.text(), st.booleans()), max_size=3),
    ),
)
def test_any_value_is_a_setting_or_a_model_error(key, value):
    try:
        settings = LaboratorySettings(**{key: value})
    except ModelError as error:
        refused = error.where
    else:
        refused = ""
        assert settings.epochs >= 1
        assert set(settings.to_strings()) == set(KEYS)
    # hours and interval_s decide together whether there is an epoch.
    assert refused in ("", key, "hours")
