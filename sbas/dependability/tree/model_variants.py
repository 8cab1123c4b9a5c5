"""One file, several models: named parameters, their rules, and environments of the sources."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, fields, replace
from typing import Any

from sbas.dependability.receiver.published import PublishedRows
from sbas.dependability.tree.model import HybridFaultTree, MarkovSource
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.model_fields import (
    NUMBERS,
    ROOT_KEYS,
    Parameters,
    Table,
    as_table,
    from_table,
    known_keys,
)
from sbas.dependability.tree.model_values import a_name, a_number, a_text, refuse
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.integrity.allocation_tree import nearest

_WARNING = "E28"
_VARIANT_KEYS = ("parameters", "rules", "environments")
_SOURCE_KEYS = tuple(f.name for f in fields(MarkovSource) if f.name != "name")
_PRINTED = tuple(f.name for f in fields(PublishedRows) if f.name != "environment")


@dataclass(frozen=True)
class ModelFile:
    """What a file holds: its model, or one for each environment, and what to know about it."""

    models: dict[str, HybridFaultTree]
    findings: tuple[Finding, ...]


def build_models(
    table: Table,
    *,
    environments: Collection[str] | None = None,
    parameters: Parameters | None = None,
    override_rules: bool = False,
) -> ModelFile:
    """The models that a file's tables describe.

    Parameters
    ----------
    table : as `model_fields.to_table` writes it; may have beside it
        `parameters` (number by name, or a table of `value`, `printed` and `source`),
        `rules` (list of tables: the parameter `larger` must exceed `smaller`, else `message`), and
        `environments` (by environment and source: keys that take the place of the source's, or
        the rows of a paper in `published`, to which its transition rows are calibrated).
    environments : those to build; None is all.
    parameters : values in place of the file's. A chain is a property of the environment: it is
        calibrated with the file's own values whatever is given here.
    override_rules : let parameters break rules; a warning says so.

    Raises
    ------
    InputError : an unknown parameter or environment.
    ModelError : the tables describe no sound model; `where` is the key path.
    """
    known_keys(table, (*ROOT_KEYS, *_VARIANT_KEYS), "")
    base = {key: value for key, value in table.items() if key not in _VARIANT_KEYS}
    plain = _parameters(table)
    own = {name: parameter["value"] for name, parameter in plain.items()}
    unused = sorted(own.keys() - _names_used(base))
    if unused:
        raise refuse(
            "a parameter that no number names", f"parameters.{unused[0]}", unused,
            "give its name in place of a number, or take it out",
        )  # fmt: skip
    for name in parameters or {}:
        if name not in own:
            raise InputError(
                f"no parameter {name!r} in this file", where="parameters", cure=nearest(name, own)
            )
    given = {**own, **(parameters or {})}
    findings = [
        *_departures(plain, given),
        *_broken_rules(table, given, override_rules),
    ]
    plan = as_table(table.get("environments", {}), "environments")
    for name in environments or ():
        if name not in plan:
            raise InputError(
                f"no environment {name!r} in this file", where="environment",
                cure=nearest(name, plan) if plan else "the file has a single model: name none",
            )  # fmt: skip
    said = tuple(f"{finding.message}: {finding.evidence}" for finding in findings)
    models: dict[str, HybridFaultTree] = {}
    if not plan:
        model = from_table(base, given)
        models[a_name(model.name, "meta.name")] = model
    for name in plan if environments is None else environments:
        model, more = _in_environment(base, a_name(name, "environments"), plan[name], own, given)
        models[name] = model
        findings += more
    for name, model in models.items():
        findings += check_model(model)
        models[name] = replace(model, notes=(*model.notes, *said))
    return ModelFile(models, tuple(dict.fromkeys(findings)))


# --- parameters -------------------------------------------------------------------------------


def _parameters(table: Table) -> dict[str, Table]:
    """Tables of `value`, `printed` and `source` by name."""
    found: dict[str, Table] = {}
    for name, plain in as_table(table.get("parameters", {}), "parameters").items():
        where = f"parameters.{name}"
        parameter = plain if isinstance(plain, dict) else {"value": plain}
        known_keys(parameter, ("value", "printed", "source"), where)
        a_number(parameter.get("value"), f"{where}.value")
        a_number(parameter.get("printed", 0), f"{where}.printed")
        a_text(parameter.get("source", ""), f"{where}.source")
        found[name] = parameter
    return found


def _departures(plain: dict[str, Table], given: Parameters) -> Iterable[Finding]:
    """A warning for each value that is not the printed one, or not the file's."""
    for name, parameter in plain.items():
        value = a_number(given[name], f"parameters.{name}")
        where = f"parameters.{name}"
        if value != parameter.get("printed", value):
            yield Finding(
                _WARNING, "warning",
                f"{name} = {given[name]}, not {parameter['printed']} as printed",
                where=where, evidence=parameter.get("source", ""),
            )  # fmt: skip
        if value != parameter["value"]:
            yield Finding(
                _WARNING, "warning", f"{name} = {given[name]} on request", where=where,
                evidence=f"the file has {parameter['value']}",
            )  # fmt: skip


def _names_used(value: Any, key: str = "") -> set[str]:
    if isinstance(value, dict):
        return set().union(*(_names_used(item, name) for name, item in value.items()))
    if isinstance(value, list):
        return set().union(*(_names_used(item, key) for item in value))
    return {value} if isinstance(value, str) and key in NUMBERS else set()


def _broken_rules(table: Table, given: Parameters, override: bool) -> list[Finding]:
    """A warning for each broken rule that is overridden; ModelError for the first that is not."""
    broken = []
    rules = table.get("rules", [])
    if not isinstance(rules, list):
        raise refuse("a list of tables is expected here", "rules", rules, "[[rules]]")
    for i, plain in enumerate(rules):
        where = f"rules[{i}]"
        rule = as_table(plain, where)
        known_keys(rule, ("larger", "smaller", "message"), where)
        for key in ("larger", "smaller", "message"):
            a_text(rule.get(key), f"{where}.{key}")
        for key in ("larger", "smaller"):
            if rule[key] not in given:
                raise refuse(
                    "no parameter of that name", f"{where}.{key}", rule[key],
                    nearest(rule[key], given),
                )  # fmt: skip
        larger, smaller = given[rule["larger"]], given[rule["smaller"]]
        if larger > smaller:
            continue
        seen = f"{rule['larger']} = {larger}, {rule['smaller']} = {smaller}"
        if not override:
            raise refuse(
                rule["message"], f"parameters.{rule['larger']}", seen,
                f"write {rule['larger']} > {rule['smaller']}, or pass override_rules=True",
            )  # fmt: skip
        broken.append(Finding(_WARNING, "warning", rule["message"], where=where, evidence=seen))
    return broken


# --- environments -----------------------------------------------------------------------------


def _in_environment(
    base: Table, name: str, plain: Any, own: Parameters, given: Parameters
) -> tuple[HybridFaultTree, list[Finding]]:
    """The model with the sources of one environment, calibrated where rows are published."""
    where = f"environments.{name}"
    sources = base.get("sources", [])
    if not isinstance(sources, list) or not all(isinstance(s, dict) for s in sources):
        raise refuse("a list of tables is expected here", "sources", sources, "[[sources]]")
    tables = {str(source.get("name")): dict(source) for source in sources}
    published: dict[str, PublishedRows] = {}
    for source, changes in as_table(plain, where).items():
        at = f"{where}.{source}"
        if source not in tables:
            raise refuse("no source of that name", at, source, nearest(source, tables))
        changes = dict(as_table(changes, at))
        known_keys(changes, (*_SOURCE_KEYS, "published"), at)
        if "published" in changes:
            if "rows" in changes:
                raise refuse(
                    "rows, and published figures to find them", f"{at}.rows", sorted(changes),
                    "write one of them",
                )  # fmt: skip
            published[source] = _published(name, changes.pop("published"), f"{at}.published")
            states = tables[source].get("states")
            size = len(states) if isinstance(states, list) else 0
            # Only a place to stand until the calibration has found the rows.
            changes["rows"] = [[1.0 / size] * size for _ in range(size)]
        tables[source] |= changes
    table = {**base, "sources": list(tables.values())}
    model = from_table(table, given)
    model = replace(model, name=f"{model.name}, {name}")
    findings: list[Finding] = []
    for source, rows in published.items():
        # At import, calibration would make every reader of files load the exact rows.
        from sbas.dependability.receiver.calibration import calibrated_source

        template = from_table(table, own)
        check_model(template)
        calibrated = calibrated_source(rows, template)
        findings += calibrated.findings
        chain = calibrated.source
        model = replace(
            model,
            sources=tuple(
                replace(s, rows=chain.rows, source=chain.source) if s.name == source else s
                for s in model.sources
            ),
            notes=(*model.notes, calibrated.note),
        )
    return model, findings


def _published(environment: str, plain: Any, where: str) -> PublishedRows:
    table = as_table(plain, where)
    known_keys(table, _PRINTED, where)
    for key in _PRINTED:
        if key not in table:
            raise refuse("a key is missing", f"{where}.{key}", sorted(table), f"write {key}")
        if key != "source":
            a_number(table[key], f"{where}.{key}", high=1.0)
    if not a_text(table["source"], f"{where}.source").strip():
        raise refuse("figures without a source", f"{where}.source", "", "document and table")
    return PublishedRows(environment=environment, **table)
