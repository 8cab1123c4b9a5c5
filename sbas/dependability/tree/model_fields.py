"""The dataclasses of a model as plain tables and back: one list of kinds, used both ways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from numbers import Integral, Real
from typing import Any

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
    Or,
    Pand,
    Stage,
    Undeveloped,
)
from sbas.dependability.tree.model_values import refuse
from sbas.integrity.allocation_tree import nearest

FORMAT = "sbas-dep"
VERSION = 1
UNITS = {"failure_rate_per_h": "1/h", "repair_rate_per_h": "1/h", "seconds": "s", "step_s": "s"}

EVENT_KINDS: dict[str, Any] = {
    "failed": Failed,
    "in_state": InState,
    "house": House,
    "undeveloped": Undeveloped,
}
GATE_KINDS: dict[str, Any] = {
    "or": Or,
    "and": And,
    "not": Not,
    "at_least": AtLeast,
    "con": Con,
    "dur": Dur,
    "causal_and": CausalAnd,
    "pand": Pand,
}
KIND_OF = {cls: kind for kind, cls in (*EVENT_KINDS.items(), *GATE_KINDS.items())}

_WHOLE = {"k", "count"}
"""Keys whose numbers are counts; every other number is a measure and becomes a float."""

_RATES = {
    "failure_rate_per_h": {"mtbf_h": lambda x: 1.0 / x, "fit": lambda x: x * 1e-9},
    "repair_rate_per_h": {"mttr_h": lambda x: 1.0 / x},
}
_BARE = {"failure_rate", "rate", "lambda", "alpha", "mtbf", "repair_rate", "mu", "mttr", "step",
         "mission", "seconds_", "first_fix", "delay", "duration", "T"}  # fmt: skip
"""Keys that people write for a quantity without its unit."""

Table = dict[str, Any]
Parameters = Mapping[str, float]


# --- to plain tables --------------------------------------------------------------------------


def to_table(model: HybridFaultTree) -> Table:
    """A model as plain tables, every field written out; the inverse of `from_table`."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "top": model.top,
        "cases": list(model.cases),
        "meta": {"name": model.name, "notes": list(model.notes)},
        "time": {"step_s": float(model.step_s), "mission_s": float(model.mission_s)},
        "units": dict(UNITS),
        "options": _plain(model.options),
        **{
            key: [_plain(thing) for thing in getattr(model, key)]
            for key in ("components", "sources", "events", "gates")
        },
    }


def _plain(thing: Any) -> Table:
    kind = {"kind": KIND_OF[type(thing)]} if type(thing) in KIND_OF else {}
    return kind | {f.name: _plain_value(f.name, getattr(thing, f.name)) for f in fields(thing)}


def _plain_value(key: str, value: Any) -> Any:
    if isinstance(value, Stage):
        return _plain(value)
    if isinstance(value, tuple):
        return [_plain_value(key, item) for item in value]
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if key in _WHOLE and isinstance(value, Integral) else float(value)


# --- from plain tables ------------------------------------------------------------------------

ROOT_KEYS = (
    "format", "version", "top", "cases", "meta", "time", "units", "options", "components",
    "sources", "events", "gates",
)  # fmt: skip


def from_table(table: Table, parameters: Parameters | None = None) -> HybridFaultTree:
    """The model that plain tables describe; values are left to `check_model`.

    Parameters
    ----------
    table : as `to_table` writes it; rates also as `mtbf_h`, `mttr_h` or `fit`.
    parameters : values by name, for numbers that are given by the name of a parameter.

    Raises
    ------
    ModelError : a key that is unknown or missing, a rate without unit, an unknown kind or
        version; `where` is the key path.
    """
    known_keys(table, ROOT_KEYS, "")
    for key in ("top", "meta", "time"):
        if key not in table:
            raise refuse("a key is missing", key, sorted(table), f"write {key}")
    if table.get("format") != FORMAT or table.get("version") != VERSION:
        raise refuse(
            "no format of this package", "format",
            f"{table.get('format')!r}, version {table.get('version')!r}",
            f'format = "{FORMAT}", version = {VERSION}',
        )  # fmt: skip
    if as_table(table.get("units", UNITS), "units") != UNITS:
        raise refuse("units other than those of the keys", "units", table["units"], str(UNITS))
    given = parameters or {}
    meta = as_table(table["meta"], "meta")
    known_keys(meta, ("name", "notes"), "meta")
    time = as_table(table["time"], "time")
    known_keys(time, ("step_s", "mission_s"), "time")
    for key, needed in (("meta", ("name",)), ("time", ("step_s", "mission_s"))):
        for name in needed:
            if name not in table[key]:
                raise refuse("a key is missing", f"{key}.{name}", table[key], f"write {name}")
    return HybridFaultTree(
        name=meta["name"],
        step_s=_value("step_s", time["step_s"], given),
        mission_s=_value("mission_s", time["mission_s"], given),
        components=_list(table, "components", {"": Component}, given),
        sources=_list(table, "sources", {"": MarkovSource}, given),
        events=_list(table, "events", EVENT_KINDS, given),
        gates=_list(table, "gates", GATE_KINDS, given),
        top=table["top"],
        cases=_value("cases", table.get("cases", []), {}),
        options=_thing(Options, as_table(table.get("options", {}), "options"), "options", given),
        notes=_value("notes", meta.get("notes", []), {}),
    )


def _list(table: Table, key: str, kinds: dict[str, Any], given: Parameters) -> tuple[Any, ...]:
    things = table.get(key, [])
    if not isinstance(things, list):
        raise refuse("a list of tables is expected here", key, things, f"[[{key}]]")
    found = []
    for i, plain in enumerate(things):
        plain = dict(as_table(plain, f"{key}[{i}]"))
        where = f"{key}.{plain['name']}" if isinstance(plain.get("name"), str) else f"{key}[{i}]"
        cls = kinds.get("")
        if cls is None:
            kind = plain.pop("kind", None)
            if not isinstance(kind, str) or kind not in kinds:
                raise refuse(
                    f"an unknown kind in {key}", f"{where}.kind", kind, nearest(str(kind), kinds)
                )
            cls = kinds[kind]
        if cls is Component:
            plain = _rates(plain, where, given)
        found.append(_thing(cls, plain, where, given))
    return tuple(found)


def _thing(cls: Any, plain: Table, where: str, given: Parameters) -> Any:
    known_keys(plain, _keys(cls), where)
    missing = [f.name for f in fields(cls) if _required(f) and f.name not in plain]
    if missing:
        raise refuse("a key is missing", f"{where}.{missing[0]}", plain, f"write {missing[0]}")
    values = {key: _value(key, value, given) for key, value in plain.items() if key != "stages"}
    if "stages" in plain:
        values["stages"] = _list({f"{where}.stages": plain["stages"]}, f"{where}.stages",
                                 {"": Stage}, given)  # fmt: skip
    return cls(**values)


def _required(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _keys(cls: Any) -> tuple[str, ...]:
    """Keys of a table, those of other units beside each rate."""
    names = (field.name for field in fields(cls))
    return tuple(key for name in names for key in (name, *(_RATES.get(name, ()))))


def _rates(plain: Table, where: str, given: Parameters) -> Table:
    """The table with rates per hour in place of MTBF, MTTR and FIT."""
    plain = dict(plain)
    for rate, others in _RATES.items():
        written = [key for key in (rate, *others) if key in plain]
        if len(written) > 1:
            raise refuse("one rate, twice", f"{where}.{written[1]}", written, "write one of them")
        if not written and rate == "failure_rate_per_h":
            known_keys(plain, _keys(Component), where)
            raise refuse(
                "a component without failure rate", where, plain,
                "write failure_rate_per_h, mtbf_h or fit",
            )  # fmt: skip
        if written and written[0] in others:
            value = _value(written[0], plain.pop(written[0]), given)
            if not isinstance(value, float) or not 0.0 < value < float("inf"):
                raise refuse(
                    "a value out of range", f"{where}.{written[0]}", value, "write more than 0"
                )
            plain[rate] = others[written[0]](value)
    return plain


def _value(key: str, value: Any, given: Parameters) -> Any:
    if isinstance(value, list):
        return tuple(_value(key, item, given) for item in value)
    if isinstance(value, str) and key in NUMBERS and value in given:
        return _value(key, given[value], {})
    if isinstance(value, int) and not isinstance(value, bool) and key not in _WHOLE:
        try:
            return float(value)
        except OverflowError:
            return value
    return value


NUMBERS = {
    "k", "count", "seconds", "first_fix_s", "step_s", "mission_s", "failure_rate_per_h", "mtbf_h",
    "fit", "repair_rate_per_h", "mttr_h", "initially_failed", "probability",
}  # fmt: skip
"""Keys whose number may be given by the name of a parameter."""


# --- structure --------------------------------------------------------------------------------


def as_table(value: Any, where: str) -> Table:
    """The value, which must be a table."""
    if not isinstance(value, dict):
        raise refuse("a table is expected here", where, value, f"[{where}]")
    return value


def known_keys(table: Table, known: tuple[str, ...], where: str) -> None:
    """Raise ModelError for a key that is not known, with the nearest one and the full list."""
    for key in table:
        if key not in known:
            raise refuse(
                "a number without unit" if key in _BARE else "an unknown key",
                f"{where}.{key}" if where else str(key),
                f"{key} = {table[key]!r}",
                nearest(str(key), known),
            )
