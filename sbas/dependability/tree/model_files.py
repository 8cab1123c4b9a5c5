"""Models in files: TOML for people, JSON "sbas-dep" for exchange; both hold everything."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any

from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.model_fields import Parameters, Table, as_table, to_table
from sbas.dependability.tree.model_values import refuse
from sbas.dependability.tree.model_variants import ModelFile, build_models
from sbas.dependability.tree.text_files import (
    Readers,
    errors_name,
    found_file,
    read_table,
    toml_text,
    with_suffix,
    write_text,
)
from sbas.exceptions import InputError

LARGEST_FILE = 64_000_000
"""Bytes; a model of that size is no model that somebody wrote."""


def load_model(
    path: str | Path,
    *,
    environment: str | None = None,
    parameters: Parameters | None = None,
    override_rules: bool = False,
) -> HybridFaultTree:
    """The model of a file, or of one environment of a file with several.

    Parameters
    ----------
    path : .toml or .json file, or the name of a bundled model, such as "galoroi".
    environment : which one, where the file has several.
    parameters : values in place of the file's, by parameter name.
    override_rules : take parameters that break a rule of the file.

    Raises
    ------
    InputError : no such file, or several environments and none named.
    ModelError : the file describes no sound model; `where` is file and key path.

    Examples
    --------
    >>> load_model("galoroi", environment="urban").top
    'TOP'
    """
    found = read_model_file(
        path, environments=None if environment is None else (environment,),
        parameters=parameters, override_rules=override_rules,
    ).models  # fmt: skip
    if len(found) != 1:
        raise InputError(
            "the file has a model for each of several environments", where=str(path),
            evidence=", ".join(found), cure=f'environment="{next(iter(found), "")}"',
        )  # fmt: skip
    return next(iter(found.values()))


def load_models(
    path: str | Path, *, parameters: Parameters | None = None, override_rules: bool = False
) -> dict[str, HybridFaultTree]:
    """All models of a file by environment; a file without environments has one, by its name.

    Parameters, errors : as `load_model`.

    Examples
    --------
    >>> list(load_models("galoroi"))
    ['urban', 'tunnel', 'woody', 'cutting']
    """
    return read_model_file(path, parameters=parameters, override_rules=override_rules).models


def read_model_file(
    path: str | Path,
    *,
    environments: Collection[str] | None = None,
    parameters: Parameters | None = None,
    override_rules: bool = False,
) -> ModelFile:
    """Models and findings of a file.

    Parameters
    ----------
    environments : those to build; None is all.
    path, parameters, override_rules : as `load_model`.

    Returns
    -------
    Models, with every departure from a printed value and every broken rule also in their notes;
    findings of the file and of `check_model`.

    Raises
    ------
    InputError, ModelError : as `load_model`.
    """
    file = found_file(path, "a model", "models", _READERS)
    with errors_name(file):
        return build_models(
            read_table(file, "a model", _READERS, largest=LARGEST_FILE),
            environments=environments,
            parameters=parameters,
            override_rules=override_rules,
        )


def dump_model(model: HybridFaultTree, path: str | Path) -> None:
    """Write a model to a .toml or .json file, from which `load_model` gives an equal one.

    Parameters
    ----------
    model : sound by `check_model`; parameters and environments of a file that it came from are
        resolved.
    path : suffix .toml or .json.

    Raises
    ------
    InputError : another suffix, or a place that cannot be written.
    ModelError : the model is not sound.
    """
    file = with_suffix(Path(path), "a model", _READERS)
    check_model(model)
    table = to_table(model)
    if file.suffix == ".json":
        text = json.dumps(table, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    else:
        text = toml_text(table)
    write_text(text, file, "a model")


# --- files ------------------------------------------------------------------------------------


def _parse_toml(text: str) -> Table:
    table = tomllib.loads(text)
    extra = next((key for key in table if key.startswith("x-")), None)
    if extra is not None:
        raise refuse(
            "TOML files hold no keys of other programs", extra, "",
            "write it into meta.notes, or use JSON",
        )  # fmt: skip
    return table


def _parse_json(text: str) -> Table:
    def unique(pairs: list[tuple[str, Any]]) -> Table:
        table = dict(pairs)
        if len(table) != len(pairs):
            names = [key for key, _ in pairs]
            twice = next(key for key in names if names.count(key) > 1)
            raise refuse("a key stands twice", twice, names, "write it once")
        return table

    def constant(word: str) -> Any:
        raise refuse("no number of JSON", "", word, "write a finite number")

    table = json.loads(text, object_pairs_hook=unique, parse_constant=constant)
    return _with_notes(as_table(table, "file"))


def _with_notes(table: Table) -> Table:
    """Keys of other programs (`x-...`) as notes, so that they travel with the model."""
    extra = {key: value for key, value in table.items() if key.startswith("x-")}
    if not extra:
        return table
    table = {key: value for key, value in table.items() if key not in extra}
    meta = dict(as_table(table.get("meta", {}), "meta"))
    notes = meta.get("notes", [])
    if not isinstance(notes, list):
        raise refuse("a list is expected here", "meta.notes", notes, "write a list of texts")
    meta["notes"] = notes + [
        f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in extra.items()
    ]
    return {**table, "meta": meta}


_READERS: Readers = {".toml": _parse_toml, ".json": _parse_json}
