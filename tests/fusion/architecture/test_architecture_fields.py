"""Tables of an architecture: the way there and back, and what they may not hold."""

from __future__ import annotations

import contextlib
import datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import ModelError
from sbas.fusion.architecture.architecture_check import check_architecture
from sbas.fusion.architecture.architecture_fields import (
    KINDS,
    UNMODELLED_KINDS,
    from_table,
    to_table,
)
from sbas.fusion.architecture.model import (
    Architecture,
    FilterTuning,
    Odometer,
    SatelliteReceiver,
    Unmodelled,
)
from tests.fusion.architecture.architecture_strategies import architectures


def _table(**changes: Any) -> dict[str, Any]:
    sensors = [{"name": "odo", "kind": "odometer"}, {"name": "gps", "kind": "gnss"}]
    table = {"schema": 1, "name": "lab", "sensors": sensors, **changes}
    return {key: value for key, value in table.items() if value is not None}


def _odo(**changes: Any) -> dict[str, Any]:
    return _table(sensors=[{"name": "odo", "kind": "odometer", **changes}])


@given(architectures())
def test_an_architecture_comes_back_from_its_tables(architecture: Architecture) -> None:
    check_architecture(architecture)
    assert from_table(to_table(architecture)) == architecture


def test_absent_keys_take_their_default() -> None:
    assert from_table(_table()) == Architecture("lab", (Odometer("odo"), SatelliteReceiver("gps")))


def test_whole_numbers_are_numbers() -> None:
    made = from_table(_odo(noise_mps=1, slip={
        "rate_per_s": 0, "mean_duration_s": 3, "smallest": 0, "largest": 1}))  # fmt: skip
    odometer = made.sensors[0]
    assert isinstance(odometer, Odometer)
    assert odometer.noise_mps == 1.0
    assert type(odometer.noise_mps) is type(odometer.slip.largest) is float


def test_a_gate_is_a_number_or_absent() -> None:
    table = _table(filter={"gate": 6})
    assert from_table(table).filter == FilterTuning(gate=6.0)
    assert "gate" not in to_table(from_table(_table()))["filter"]


def test_every_kind_is_read_and_written_by_its_name() -> None:
    for kind in (*KINDS, *UNMODELLED_KINDS):
        made = from_table(_table(sensors=[{"name": "it", "kind": kind}]))
        assert to_table(made)["sensors"][0]["kind"] == kind
        assert isinstance(made.sensors[0], KINDS.get(kind, Unmodelled))


def test_an_unmodelled_sensor_cannot_take_the_kind_of_a_modelled_one() -> None:
    with pytest.raises(ModelError) as caught:
        to_table(Architecture("lab", (Unmodelled("odo", "odometer"),)))
    assert caught.value.where == "sensors.odo.kind"


STRANGE: dict[str, tuple[Any, str, str]] = {
    # what is wrong: table, key path, words of the cure
    "no table": ([], "", "[table]"),
    "no schema": (_table(schema=None), "schema", "schema = 1"),
    "another schema": (_table(schema=2), "schema", "schema = 1"),
    "true for schema": (_table(schema=True), "schema", "schema = 1"),
    "no name": (_table(name=None), "name", "write name"),
    "no sensors": (_table(sensors=None), "sensors", "write sensors"),
    "an unknown key": (_table(operater="kalman"), "operater", "did you mean 'operator'? allowed"),
    "an unknown key of a sensor": (
        _odo(noise=0.1), "sensors.odo.noise", "did you mean 'noise_mps'? allowed are kind, name",
    ),
    "an unknown key of a part": (
        _odo(slip={"rate": 0.02}), "sensors.odo.slip.rate", "rate_per_s, mean_duration_s",
    ),
    "an unknown key of thresholds": (
        _table(thresholds={"alert_limit": 2.5}), "thresholds.alert_limit", "'alert_limit_m'",
    ),
    "a parameter of a sensor without model": (
        _table(sensors=[{"name": "g", "kind": "gyroscope", "noise_mps": 1.0}]),
        "sensors.g.noise_mps", "name, kind, source",
    ),
    "a key missing in a part": (
        _odo(slip={"rate_per_s": 0.02}), "sensors.odo.slip.mean_duration_s", "write mean_dur",
    ),
    "a sensor without kind": (
        _table(sensors=[{"name": "odo"}]), "sensors.odo.kind", "odometer, accelerometer, imu, gnss",
    ),
    "a sensor without name": (_table(sensors=[{"kind": "gnss"}]), "sensors[0].name", "write name"),
    "an unknown kind": (
        _table(sensors=[{"name": "odo", "kind": "odometr"}]), "sensors.odo.kind",
        "did you mean 'odometer'? allowed are odometer, accelerometer, imu, gnss, gyroscope",
    ),
    "a number for a kind": (
        _table(sensors=[{"name": "odo", "kind": 1}]), "sensors.odo.kind", "odometer",
    ),
    "a list for a kind": (
        _table(sensors=[{"name": "odo", "kind": ["gnss"]}]), "sensors.odo.kind", "odometer",
    ),
    "a sensor that is no table": (_table(sensors=["odo"]), "sensors[0]", "[sensors[0]]"),
    "one sensor for a list": (_table(sensors={"name": "odo"}), "sensors", "[ ]"),
    "a table for a list of numbers": (_table(fixed_weights={"odo": 1.0}), "fixed_weights", "[ ]"),
    "a number for a table": (_table(filter=3.0), "filter", "[filter]"),
    "a truth for a number": (_odo(noise_mps=True), "sensors.odo.noise_mps", "finite number"),
    "a text for a number": (_odo(noise_mps="0.1"), "sensors.odo.noise_mps", "finite number"),
    "a list for a number": (_odo(noise_mps=[0.1]), "sensors.odo.noise_mps", "finite number"),
    "a table for a number": (_odo(noise_mps={"value": 1}), "sensors.odo.noise_mps", "finite"),
    "NaN": (_odo(noise_mps=float("nan")), "sensors.odo.noise_mps", "finite number"),
    "infinity": (_table(duration_s=float("inf")), "duration_s", "finite number"),
    "a number without bounds": (_odo(noise_mps=1e13), "sensors.odo.noise_mps", "at most 1e+12"),
    "a time of nothing": (_table(step_s=1e-300), "step_s", "1e-09 or more"),
    "an integer of 80 bits": (_odo(noise_mps=2**80), "sensors[0].noise_mps", "smaller"),
    "a number for a text": (_table(source=2014), "source", "in quotes"),
    "a text without end": (_table(source="x" * 3000), "source", "2000 characters"),
    "a text that moves the cursor": (_table(reported=["a\x1b[2J"]), "reported[0]", "one line"),
    "a date": (_table(source=datetime.date(2014, 4, 8)), "source", "a text"),
    "an unknown word": (_table(weights="faultfree"), "weights", "fault_free"),
    "a word for true": (
        _odo(missing={"policy": "remove", "renormalise": "no"}),
        "sensors.odo.missing.renormalise", "true or false",
    ),
    "a key that is no text": (_table(filter={1: 2}), "filter", "a word"),
    "a key that moves the cursor": (_table(filter={"\x1b[2J": 2}), "filter", "a word"),
    "a key without end": (_table() | {"k" * 100: 2}, "", "a word"),
    "a choice that moves the cursor": (_table(weights="\x1b[2J"), "weights", "one line"),
    "none": (_odo(noise_mps=None), "sensors[0].noise_mps", "a number or a text"),
}  # fmt: skip


@pytest.mark.parametrize("name", STRANGE)
def test_a_strange_table_is_refused_with_its_place_and_what_to_write(name: str) -> None:
    table, where, cure = STRANGE[name]
    with pytest.raises(ModelError) as caught:
        from_table(table)
    assert caught.value.where == where
    assert cure in caught.value.cure, caught.value.cure


def test_tables_in_tables_end() -> None:
    deep: Any = 1.0
    for _ in range(100_000):
        deep = {"a": deep}
    with pytest.raises(ModelError, match="too deep"):
        from_table(_table(filter=deep))


_ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
    | st.sampled_from(("odometer", "gnss", "extrapolate", "kalman", "odo")),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(
        st.sampled_from(("name", "kind", "policy", "by", "until_s", "gate")) | st.text(max_size=4),
        inner,
        max_size=4,
    ),
    max_leaves=10,
)  # fmt: skip


@given(st.sampled_from([*to_table(from_table(_table())), "other"]), _ANYTHING)
def test_whatever_stands_at_a_key_is_taken_or_refused(key: str, value: Any) -> None:
    _taken_or_refused(_table() | {key: value})


@given(st.sampled_from(list(to_table(from_table(_table()))["sensors"][0])), _ANYTHING)
def test_whatever_stands_at_a_key_of_a_sensor_is_taken_or_refused(key: str, value: Any) -> None:
    _taken_or_refused(_table(sensors=[{"name": "odo", "kind": "odometer"} | {key: value}]))


def _taken_or_refused(table: dict[str, Any]) -> None:
    """No other error than ModelError may come out, and what is taken has a table of its own."""
    made = None
    with contextlib.suppress(ModelError):
        made = from_table(table)
    assert made is None or from_table(to_table(made)) == made
