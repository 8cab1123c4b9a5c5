"""Architectures in files: those that come with the package, those of users, and hostile ones."""

from __future__ import annotations

import contextlib
import math
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given, settings

from sbas.exceptions import InputError, ModelError
from sbas.fusion.architecture.architecture_check import check_architecture, refuse_unmodelled
from sbas.fusion.architecture.architecture_files import (
    LARGEST_FILE,
    architecture_text,
    dump_architecture,
    from_table,
    load_architecture,
    presets,
    to_table,
)
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    FilterTuning,
    InertialUnit,
    Missing,
    Odometer,
    Redundancy,
    SatelliteReceiver,
    SpeedProfile,
    Thresholds,
    Unmodelled,
)
from tests.fusion.architecture.architecture_strategies import architectures

MODELLED = ("arch1", "arch1bis", "arch1ter", "arch2")
DESCRIBED = {
    # Railways 2014, 2.3.1 to 2.3.7: sensors, those without a model
    "apolo": (5, ("gyroscope", "doppler_radar")),
    "demoort": (4, ("rfid_transponder", "doppler_radar", "digital_map")),
    "rune": (4, ("virtual_balise_map",)),
    "grail": (2, ("odometry_subsystem",)),
    "grail2": (2, ("odometry_subsystem",)),
    "3insat": (3, ("inertial_navigation", "tachometer")),
    "integrail": (4, ("fibre_optic_gyroscope",)),
    "galoroi": (2, ("eddy_current_sensor",)),
}


# --- what comes with the package --------------------------------------------------------------


def test_the_presets_are_those_of_the_paper() -> None:
    assert set(presets()) == {*MODELLED, *DESCRIBED}


@pytest.mark.parametrize("name", presets())
def test_every_preset_loads_prints_and_comes_back(name: str, tmp_path: Path) -> None:
    made = load_architecture(name)
    assert made.name == name
    assert from_table(to_table(made)) == made
    text = architecture_text(made)
    for words in (name, made.source, *made.reported, *made.names):
        assert words in text
    assert "Railways 2014" in made.source
    assert made.reported
    assert all(sensor.source for sensor in made.sensors)
    assert all("Railways 2014" in line or "ITST 2013" in line for line in made.reported)
    dump_architecture(made, tmp_path / "copy.toml")
    assert load_architecture(tmp_path / "copy.toml") == made


@pytest.mark.parametrize("name", MODELLED)
def test_the_architectures_of_the_paper_can_be_simulated_without_findings(name: str) -> None:
    made = load_architecture(name)
    refuse_unmodelled(made)
    assert check_architecture(made) == ()


@pytest.mark.parametrize("name", DESCRIBED)
def test_a_project_refuses_to_be_simulated_and_names_what_has_no_model(name: str) -> None:
    made = load_architecture(name)
    count, kinds = DESCRIBED[name]
    unmodelled = [s for s in made.sensors if isinstance(s, Unmodelled)]
    assert len(made.sensors) == count
    assert tuple(s.kind for s in unmodelled) == kinds
    assert any(isinstance(s, SatelliteReceiver) for s in made.sensors)
    with pytest.raises(ModelError) as caught:
        refuse_unmodelled(made)
    for sensor in unmodelled:
        assert sensor.name in caught.value.what
    text = architecture_text(made)
    assert "not to be simulated" in text
    assert "weights:" not in text
    (finding,) = check_architecture(made)
    assert finding.severity == "info"


def test_arch1_writes_out_the_defaults_of_the_laboratory() -> None:
    """Section 3.3 of the paper gives the thresholds; the rest are the dataclasses' defaults."""
    made = load_architecture("arch1")
    gps = SatelliteReceiver("gps", missing=Missing("extrapolate", "odo"))
    bare = tuple(replace(sensor, source="") for sensor in made.sensors)
    assert bare == (Odometer("odo"), Accelerometer("acc"), gps)
    assert made == Architecture(
        "arch1", made.sensors, source=made.source, reported=made.reported,
        filter=FilterTuning(), thresholds=Thresholds(1.0, 2.5), profile=SpeedProfile(),
    )  # fmt: skip


def test_the_other_architectures_of_the_paper() -> None:
    bis, ter, two = (load_architecture(name) for name in MODELLED[1:])
    assert (bis.operator, bis.names, bis.filter.gate) == ("kalman", ("odo", "acc", "gps"), None)
    assert ter.names == ("odo", "odo2", "acc", "gps")
    assert 3 ** len(ter.names) == 81  # Railways 2014, 3.3.3
    assert ter.redundancy == (Redundancy(("odo", "odo2"), "per_run", 0.5),)
    assert (two.operator, two.axes, two.names) == ("per_axis", 3, ("odo", "imu", "gps"))
    assert isinstance(two.sensors[1], InertialUnit)


def test_the_bound_beside_the_claims_of_demoort() -> None:
    """110352 samples at 2 Hz without an event bound a rate by -ln 0.05 / T, exactly."""
    hours = 110352 / 2 / 3600
    bound = -math.log(0.05) / hours
    text = architecture_text(load_architecture("demoort"))
    assert round(hours, 2) == 15.33
    assert math.ceil(bound * 1e3) / 1e3 == 0.196
    assert "95.78 % (claimed), THR 5.22e-7/h (claimed" in text
    assert "76.97 % (claimed), THR 5.25e-2/h (claimed" in text
    assert "15.33 h" in text
    assert "0.196/h" in text


def test_a_preset_that_does_not_exist_names_the_nearest() -> None:
    with pytest.raises(InputError, match="arch1ter") as caught:
        load_architecture("arch1tre")
    assert "did you mean 'arch1ter'? allowed are 3insat, apolo" in caught.value.cure


# --- files of users ---------------------------------------------------------------------------


@settings(max_examples=15)
@given(made=architectures())
def test_any_architecture_comes_back_from_its_file(
    made: Architecture, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path_factory.mktemp("written") / "own.toml"
    dump_architecture(made, file)
    assert load_architecture(file) == made
    assert architecture_text(made).isascii() or made.name in architecture_text(made)


def test_an_unsound_architecture_is_not_written(tmp_path: Path) -> None:
    made = load_architecture("arch1")
    with pytest.raises(ModelError):
        dump_architecture(replace(made, step_s=0.3), tmp_path / "own.toml")
    with pytest.raises(InputError, match=r"ends in \.toml"):
        dump_architecture(made, tmp_path / "own.json")
    with pytest.raises(InputError, match="cannot be written"):
        dump_architecture(made, tmp_path / "nowhere" / "own.toml")
    assert not list(tmp_path.iterdir())


def test_the_text_says_what_the_fusion_does(tmp_path: Path) -> None:
    gps = SatelliteReceiver("gps", missing=Missing("remove", renormalise=False))
    made = Architecture(
        "own", (Odometer("odo", missing=Missing("substitute", "acc")),
                Accelerometer("acc", missing=Missing("hold")), gps),
        weights="fixed", fixed_weights=(0.5, 0.25, 0.25), fault_detection="leave_one_out",
    )  # fmt: skip
    text = architecture_text(made)
    for words in (
        "weights: fixed (0.5, 0.25, 0.25)", "fault detection: leave one out",
        "the value of acc in its place", "its last value is held",
        "removed, the other weights stay as they are", "0.01 to 0.06 of the speed",
        "1.5 to 8 m of either sign", "N below 1 m, U from 2.5 m",
        "run: 100 s, fusion each 1 s, propagation each 0.1 s",
    ):  # fmt: skip
        assert words in text
    assert "gate 6.63" in architecture_text(
        replace(load_architecture("arch1bis"), filter=FilterTuning(gate=6.63))
    )
    assert "odo and odo2" in architecture_text(load_architecture("arch1ter"))
    assert "largest error of an axis" in architecture_text(load_architecture("arch2"))


def test_the_error_of_a_file_names_file_and_key_path(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(
        'schema = 1\nname = "own"\n[[sensors]]\nname = "gps"\nkind = "gnss"\nwhite = 0.5\n'
    )
    with pytest.raises(ModelError) as caught:
        load_architecture(file)
    assert caught.value.where == "own.toml: sensors.gps.white"
    assert "did you mean 'white_m'?" in caught.value.cure
    file.write_text('schema = 1\nname = "own"\nstep_s = 0.3\n[[sensors]]\nname="o"\nkind="gnss"\n')
    with pytest.raises(ModelError) as caught:
        load_architecture(file)
    assert caught.value.where == "own.toml: step_s"


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_bytes(b'\xef\xbb\xbfschema = 1\nname = "own"\n[[sensors]]\nname="o"\nkind="gnss"\n')
    assert load_architecture(file).names == ("o",)


HEAD = b'schema = 1\nname = "own"\n'
HOSTILE: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "schema"),
    "no UTF-8": (HEAD + b'source = "\xff"\n', "TOML"),
    "zeros": (bytes(100), "TOML"),
    "no TOML": (b"schema = = 1", "TOML"),
    "a key twice": (HEAD + b'name = "b"\n', "TOML"),
    "lists in lists": (b"a = " + b"[" * 50_000, "TOML"),
    "tables in tables": (HEAD + b"a = " + b"{a = " * 20_000, "TOML"),
    "a path of keys": (HEAD + b".".join([b"a"] * 2_000) + b" = 1\n", "deep"),
    "five thousand digits": (HEAD + b"step_s = 1" + b"0" * 5000, "TOML"),
    "five thousand hex digits": (HEAD + b"source = 0x1" + b"0" * 5000, "64 bits"),
    "not a number": (HEAD + b'step_s = nan\n[[sensors]]\nname="o"\nkind="gnss"\n', "out of range"),
    "infinite": (HEAD + b'step_s = inf\n[[sensors]]\nname="o"\nkind="gnss"\n', "out of range"),
    "true": (HEAD + b'step_s = true\n[[sensors]]\nname="o"\nkind="gnss"\n', "out of range"),
    "a moment": (HEAD + b"step_s = 2014-04-08T00:00:00Z\n", "of no use"),
    "no sensors": (HEAD + b"sensors = []\n", "without sensors"),
    "a bell in a name": (b'schema = 1\nname = "a\\u0007"\nsensors = []\n', "a text"),
    "a text without end": (HEAD + b'source = "' + b"x" * 5000 + b'"\n', "a text"),
    "a key without end": (HEAD + b"x" * 200_000 + b" = 1\n", "no word"),
    "six thousand sensors": (HEAD + b'[[sensors]]\nname="o"\nkind="gnss"\n' * 6000, "more sensors"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_in_words(name: str, tmp_path: Path) -> None:
    content, words = HOSTILE[name]
    file = tmp_path / "own.toml"
    file.write_bytes(content)
    with pytest.raises(ModelError, match=words) as caught:
        load_architecture(file)
    assert caught.value.where.startswith("own.toml")
    assert len(str(caught.value)) < 2000
    assert "\x07" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * (LARGEST_FILE + 1))
    for path, words in (
        (tmp_path / "nothing.toml", "cannot be read"),
        (tmp_path / "folder.toml", "cannot be read"),
        ("nul\0.toml", "cannot be read"),
        (large, "too large"),
        (tmp_path / "own.json", r"ends in \.toml"),
        ("", r"no bundled|ends in"),
    ):
        with pytest.raises(InputError, match=words):
            load_architecture(path)
    large.write_bytes(b"#" * LARGEST_FILE)
    with pytest.raises(ModelError, match="schema"):
        load_architecture(large)


def test_a_preset_cut_anywhere_is_refused_or_sound(tmp_path: Path) -> None:
    source = Path(__file__).parents[3] / "data" / "architectures" / "arch1bis.toml"
    content = source.read_bytes()
    file = tmp_path / "cut.toml"
    sound = []
    for length in range(0, len(content), 7):
        file.write_bytes(content[:length])
        with contextlib.suppress(ModelError):
            sound.append(load_architecture(file))
    # The filter needs all three sensors: only the last policy may be cut off unseen.
    assert sound
    assert {made.names for made in sound} == {("odo", "acc", "gps")}


def test_the_text_shows_every_parameter_of_a_simulated_sensor() -> None:
    text = architecture_text(load_architecture("arch1"))
    for cls in (Odometer, Accelerometer, SatelliteReceiver):
        for field in fields(cls):
            assert field.name in text or field.name in ("name", "missing", "source")
