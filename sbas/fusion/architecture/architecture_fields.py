"""The dataclasses of an architecture as plain tables and back, and what each field may hold.

One list of kinds and the types of the dataclasses serve for reading, writing and checking.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from numbers import Real
from types import NoneType, UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from sbas.dependability.tree.model_values import a_choice, a_name, a_number, a_truth, items, refuse
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    InertialUnit,
    Odometer,
    SatelliteReceiver,
    Sensor,
    Unmodelled,
)
from sbas.integrity.allocation_tree import nearest

SCHEMA = 1

KINDS: dict[str, type[Sensor]] = {
    "odometer": Odometer,
    "accelerometer": Accelerometer,
    "imu": InertialUnit,
    "gnss": SatelliteReceiver,
}
"""Kinds of sensors with an error model."""

UNMODELLED_KINDS: dict[str, str] = {
    "gyroscope": "gyroscope",
    "fibre_optic_gyroscope": "fibre-optic gyroscope",
    "doppler_radar": "Doppler radar",
    "rfid_transponder": "RFID transponders and their antenna",
    "digital_map": "digital track map",
    "virtual_balise_map": "map of virtual balises",
    "eddy_current_sensor": "eddy current sensor",
    "tachometer": "tachometer",
    "inertial_navigation": "inertial navigation system",
    "odometry_subsystem": "odometry of a train control system, its sensors not named",
}
"""Kinds that documents name and that have no error model here, in words."""

KIND_OF: dict[type, str] = {cls: kind for kind, cls in KINDS.items()}

LARGEST = 1e12
SMALLEST = 1e-9
"""Bounds of all sizes, and of those that must be more than 0: their squares stay finite."""

MOST_NAME = 80
MOST_TEXT = 2000
"""Characters of a name, and of any other text."""

_POSITIVE = {
    "mean_duration_s", "interval_s", "tau_s", "acceleration_mps2_per_rthz", "speed_mps",
    "position_m", "gate", "nominal_m", "alert_limit_m", "until_s", "duration_s", "step_s",
    "substep_s",
}  # fmt: skip
_SIGNED = {"acceleration_mps2"}
_PROBABILITIES = {"share"}
_NAMES = {"name", "kind"}
_DEEPEST = 6
"""Tables in lists in tables: a sound architecture has four levels."""

Table = dict[str, Any]
_short = reprlib.Repr()
_short.maxlevel, _short.maxstring, _short.maxother = 3, 80, 80


# --- to plain tables --------------------------------------------------------------------------


def to_table(architecture: Architecture) -> Table:
    """An architecture as plain tables, every field written out; the inverse of `from_table`.

    Raises
    ------
    ModelError : a field holds what no table can, see `check_fields`.
    """
    check_fields(architecture)
    return {"schema": SCHEMA, **_plain(architecture)}


def _plain(thing: Any) -> Any:
    if is_dataclass(thing):
        kind = {"kind": KIND_OF[type(thing)]} if type(thing) in KIND_OF else {}
        # TOML has no null: what is None is left out.
        held = ((f.name, getattr(thing, f.name)) for f in fields(thing))
        return kind | {key: _plain(value) for key, value in held if value is not None}
    if isinstance(thing, tuple):
        return [_plain(item) for item in thing]
    return float(thing) if isinstance(thing, Real) and not isinstance(thing, bool) else thing


# --- from plain tables ------------------------------------------------------------------------


def from_table(table: Table) -> Architecture:
    """The architecture that plain tables describe, each value of its type and in its range.

    Parameters
    ----------
    table : as `to_table` writes it; keys that are absent take their default.

    Raises
    ------
    ModelError : another schema, a key that is unknown (with the nearest one and all that are
        known) or missing, an unknown kind, a value of the wrong type or out of its range; `where`
        is the key path. What the values mean together is left to `check_architecture`.
    """
    _refuse_strange(table, "", 0)
    rest = dict(_as_table(table, ""))
    schema = rest.pop("schema", None)
    if schema != SCHEMA or isinstance(schema, bool):
        raise refuse("an unknown schema", "schema", _short.repr(schema), f"schema = {SCHEMA}")
    architecture: Architecture = _built(Architecture, rest, "", extra=("schema",))
    check_fields(architecture)
    return architecture


def _refuse_strange(value: Any, where: str, depth: int) -> None:
    """Refuse what neither TOML nor a model holds, before anything is built or printed."""
    if depth > _DEEPEST:
        raise refuse("tables in tables too deep", where[:80], "", "write them as to_table does")
    if isinstance(value, dict):
        for key, item in value.items():
            if not isinstance(key, str) or not key.isprintable() or len(key) > MOST_NAME:
                raise refuse("a key that is no word", where, _short.repr(key), "write a word")
            _refuse_strange(item, f"{where}.{key}" if where else key, depth + 1)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            _refuse_strange(item, f"{where}[{i}]", depth + 1)
    elif isinstance(value, int) and abs(value) >= 2**63:
        raise refuse("an integer of more than 64 bits", where, "", "write a smaller number")
    elif isinstance(value, str):
        # Before anything else: words of errors are shown on terminals.
        _check_text(value, "", where)
    elif not isinstance(value, bool | int | float):
        raise refuse(
            "a value of no use here", where, _short.repr(value), "write a number or a text"
        )


def _as_table(value: Any, where: str) -> Table:
    if not isinstance(value, dict):
        raise refuse("a table is expected here", where, _short.repr(value), f"[{where or 'table'}]")
    return value


def _built(cls: Any, value: Any, where: str, *, extra: tuple[str, ...] = ()) -> Any:
    """A dataclass from its table; `extra` keys are known but read elsewhere."""
    table, hints = _as_table(value, where), _hints(cls)
    at = f"{where}." if where else ""
    for key in table:
        if key not in hints:
            raise refuse(
                "an unknown key", f"{at}{key}", f"{key} = {_short.repr(table[key])}",
                nearest(key, (*extra, *hints)),
            )  # fmt: skip
    for field in fields(cls):
        required = field.default is MISSING and field.default_factory is MISSING
        if required and field.name not in table:
            raise refuse("a key is missing", f"{at}{field.name}", f"given are {_listed(table)}",
                         f"write {field.name}")  # fmt: skip
    return cls(**{key: _value(hints[key], item, f"{at}{key}") for key, item in table.items()})


def _value(hint: Any, value: Any, where: str) -> Any:
    arguments = get_args(hint)
    if get_origin(hint) is tuple:
        if not isinstance(value, list):
            raise refuse("a list is expected here", where, _short.repr(value), "write it in [ ]")
        return tuple(
            _value(arguments[0], item, _item_path(where, i, item)) for i, item in enumerate(value)
        )
    if hint == Sensor:
        return _sensor(value, where)
    if is_dataclass(hint):
        return _built(hint, value, where)
    numeric = hint is float or float in arguments
    return float(value) if numeric and type(value) is int else value


def _sensor(value: Any, where: str) -> Sensor:
    table = _as_table(value, where)
    known = (*KINDS, *UNMODELLED_KINDS)
    if "kind" not in table:
        raise refuse("a key is missing", f"{where}.kind", f"given are {_listed(table)}",
                     f"write kind: one of {_listed(known)}")  # fmt: skip
    kind = table["kind"]
    if kind not in known:
        raise refuse("an unknown kind of sensor", f"{where}.kind", _short.repr(kind),
                     nearest(str(kind), known))  # fmt: skip
    if kind in UNMODELLED_KINDS:
        return _built(Unmodelled, table, where)  # type: ignore[no-any-return]
    rest = {key: item for key, item in table.items() if key != "kind"}
    return _built(KINDS[kind], rest, where, extra=("kind",))  # type: ignore[no-any-return]


def _item_path(where: str, i: int, item: Any) -> str:
    """Key path of an item of a list: by its name where it has one."""
    name = item.get("name") if isinstance(item, dict) else getattr(item, "name", None)
    return f"{where}.{name}" if isinstance(name, str) and name else f"{where}[{i}]"


def _listed(words: Iterable[str]) -> str:
    return ", ".join(words) or "none"


@cache
def _hints(cls: Any) -> dict[str, Any]:
    return get_type_hints(cls)


# --- types and ranges -------------------------------------------------------------------------


def check_fields(thing: Any, where: str = "") -> None:
    """Raise ModelError unless every field has its type and is in the range of its key.

    Parameters
    ----------
    thing : an `Architecture` or a part of it.
    where : key path of that part.
    """
    cls: Any = type(thing)
    for key, hint in _hints(cls).items():
        _check_value(getattr(thing, key), hint, key, f"{where}.{key}" if where else key)
    if isinstance(thing, Unmodelled) and thing.kind not in UNMODELLED_KINDS:
        raise refuse("an unknown kind without model", f"{where}.kind", thing.kind,
                     nearest(thing.kind, UNMODELLED_KINDS))  # fmt: skip


def _check_value(value: Any, hint: Any, key: str, where: str) -> None:
    arguments = get_args(hint)
    if get_origin(hint) is UnionType and NoneType in arguments:
        if value is not None:
            _check_value(value, arguments[0], key, where)
    elif get_origin(hint) is tuple:
        for i, item in enumerate(items(value, where)):
            _check_value(item, arguments[0], key, _item_path(where, i, item))
    elif get_origin(hint) is Literal:
        a_choice(value, arguments, where)
    elif hint is float:
        _check_number(value, key, where)
    elif hint is bool:
        a_truth(value, where)
    elif hint is str:
        _check_text(value, key, where)
    elif not isinstance(value, hint):
        wanted = " or ".join(t.__name__ for t in arguments or (hint,))
        raise refuse("a value of the wrong type", where, _short.repr(value), f"write {wanted}")
    else:
        check_fields(value, where)


def _check_number(value: Any, key: str, where: str) -> None:
    if key in _SIGNED:
        fits = isinstance(value, Real) and not isinstance(value, bool)
        # NaN fails this comparison too.
        if not (fits and -LARGEST <= value <= LARGEST):
            raise refuse("a value out of range", where, value, "write a finite number")
        return
    high = 1.0 if key in _PROBABILITIES else LARGEST
    number = a_number(value, where, positive=key in _POSITIVE, high=high)
    if key in _POSITIVE and number < SMALLEST:
        raise refuse("a value out of range", where, value, f"write {SMALLEST:g} or more")


def _check_text(value: Any, key: str, where: str) -> None:
    most = MOST_NAME if key in _NAMES else MOST_TEXT
    if not isinstance(value, str) or not value.isprintable() or len(value) > most:
        raise refuse("a text is expected here", where, _short.repr(value),
                     f"write it in quotes, on one line, up to {most} characters")  # fmt: skip
    if key in _NAMES:
        a_name(value, where)
