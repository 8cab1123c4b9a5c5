"""Models in files: TOML for people, JSON "sbas-dep" for exchange; both hold everything."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any

from sbas.bundled import bundled
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.model_fields import Parameters, Table, as_table, to_table
from sbas.dependability.tree.model_values import refuse
from sbas.dependability.tree.model_variants import ModelFile, build_models
from sbas.exceptions import InputError, ModelError
from sbas.integrity.allocation_tree import nearest

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
    file = _find(path)
    try:
        return build_models(
            _parse(file),
            environments=environments,
            parameters=parameters,
            override_rules=override_rules,
        )
    except ModelError as error:
        where = f"{file.name}: {error.where}" if error.where else file.name
        raise ModelError(
            error.what, where=where, evidence=error.evidence, cure=error.cure
        ) from error


def dump_model(model: HybridFaultTree, path: str | Path) -> None:
    """Write a model to a .toml or .json file, from which `load_model` gives an equal one.

    Parameters
    ----------
    model : sound by `check_model`; parameters and environments of a file that it came from are
        resolved.
    path : suffix .toml or .json.

    Raises
    ------
    InputError : another suffix.
    ModelError : the model is not sound.
    """
    file = Path(path)
    check_model(model)
    table = to_table(model)
    if file.suffix == ".json":
        text = json.dumps(table, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    elif file.suffix == ".toml":
        text = _toml(table)
    else:
        raise _suffix_error(file)
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ModelError(
            "a text that UTF-8 cannot hold", where=model.name, evidence=str(error)
        ) from error
    file.write_bytes(content)


# --- files ------------------------------------------------------------------------------------


def _suffix_error(file: Path) -> InputError:
    return InputError(
        "a model file ends in .toml or .json", where=str(file), cure=f"{file.stem}.toml"
    )


def _find(path: str | Path) -> Path:
    file = Path(path)
    if isinstance(path, str) and file.suffix == "" and file.name == path:
        names = sorted(p.stem for p in bundled("models").glob("*.toml"))
        if path not in names:
            raise InputError(
                f"no bundled model {path!r}", where="path",
                cure=nearest(path, names) + ", or the path of a .toml or .json file",
            )  # fmt: skip
        return bundled("models", f"{path}.toml")
    if file.suffix not in (".toml", ".json"):
        raise _suffix_error(file)
    return file


def _parse(file: Path) -> Table:
    try:
        if file.stat().st_size > LARGEST_FILE:
            raise InputError(
                "the file is too large for a model", where=str(file),
                evidence=f"{file.stat().st_size} bytes, at most {LARGEST_FILE}",
            )  # fmt: skip
        content = file.read_bytes()
    except OSError as error:
        raise InputError(
            "the model cannot be read", where=str(file), evidence=str(error)
        ) from error
    try:
        text = content.decode("utf-8-sig")
        if file.suffix == ".toml":
            table = tomllib.loads(text)
            extra = next((key for key in table if key.startswith("x-")), None)
            if extra is not None:
                raise refuse(
                    "TOML files hold no keys of other programs", extra, table[extra],
                    "write it into meta.notes, or use JSON",
                )  # fmt: skip
            return table
        return _with_notes(_parse_json(text))
    except ModelError:
        raise
    except (ValueError, RecursionError) as error:
        raise ModelError(
            f"no {file.suffix[1:].upper()} that can be read",
            evidence=str(error) if str(error) else type(error).__name__,
        ) from error


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

    return as_table(json.loads(text, object_pairs_hook=unique, parse_constant=constant), "file")


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


def _toml(table: Table) -> str:
    """TOML of a table whose values are plain, tables, or lists of tables; None is left out."""
    lines = [f"{k} = {_toml_value(v)}" for k, v in table.items() if not _is_nested(v)]
    for key, value in table.items():
        if _is_nested(value):
            for item in value if isinstance(value, list) else (value,):
                lines += ["", f"[[{key}]]" if isinstance(value, list) else f"[{key}]"]
                lines += [f"{k} = {_toml_value(v)}" for k, v in item.items() if v is not None]
    return "\n".join(lines) + "\n"


def _is_nested(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and isinstance(value[0], dict)
    )


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes are TOML escapes; only DEL must be escaped in TOML alone.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {_toml_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml_value(v) for v in value) + "]"
    return repr(value)
