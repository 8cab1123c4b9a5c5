"""Files that hold a model as text: found, read into plain tables, written; errors name the file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sbas.bundled import bundled
from sbas.dependability.tree.model_values import refuse
from sbas.exceptions import InputError, ModelError
from sbas.integrity.allocation_tree import nearest

Table = dict[str, Any]
Readers = Mapping[str, Callable[[str], Table]]
"""By suffix: how the text of a file becomes plain tables."""

_DEEPEST = 20
"""Tables and lists in each other: half of it holds any sound model."""


def found_file(path: str | Path, what: str, folder: str, readers: Readers) -> Path:
    """The file of a path, or the bundled one of a bare name.

    Parameters
    ----------
    path : of a file, or a name without suffix.
    what : that it holds, with its article, such as "a model".
    folder : of the bundled ones, which are TOML.
    readers : by the suffixes that there may be.

    Raises
    ------
    InputError : no bundled file of that name, or another suffix.
    """
    file = Path(path)
    if isinstance(path, str) and file.suffix == "" and file.name == path:
        names = sorted(p.stem for p in bundled(folder).glob("*.toml"))
        if path not in names:
            raise InputError(
                f"no bundled {what.split()[-1]} {path!r}", where="path",
                cure=f"{nearest(path, names)}, or the path of a {' or '.join(readers)} file",
            )  # fmt: skip
        return bundled(folder, f"{path}.toml")
    return with_suffix(file, what, readers)


def with_suffix(file: Path, what: str, readers: Readers) -> Path:
    """The file, or InputError where it has none of the suffixes; arguments as `found_file`."""
    if file.suffix not in readers:
        raise InputError(
            f"a file of {what} ends in {' or '.join(readers)}", where=str(file),
            cure=f"{file.stem or what.split()[-1]}.toml",
        )  # fmt: skip
    return file


def read_table(file: Path, what: str, readers: Readers, *, largest: int) -> Table:
    """The plain tables of a file.

    Parameters
    ----------
    file, what, readers : as `found_file`.
    largest : number of bytes that it may have.

    Raises
    ------
    InputError : a file that cannot be read, or is too large.
    ModelError : a text that is not what its suffix says, or tables too deep to be a model.
    """
    try:
        with file.open("rb") as stream:
            # One byte more than allowed: the size of a pipe or a device is not known before.
            content = stream.read(largest + 1)
    except (OSError, ValueError) as error:
        raise InputError(
            f"the file of {what} cannot be read", where=str(file), evidence=str(error),
            cure=f"name a {' or '.join(readers)} file that is there, or a bundled one",
        ) from error  # fmt: skip
    if len(content) > largest:
        raise InputError(
            f"the file is too large for {what}", where=str(file),
            evidence=f"more than {largest} bytes",
        )  # fmt: skip
    try:
        table = readers[file.suffix](content.decode("utf-8-sig"))
    except ModelError:
        raise
    except (ValueError, RecursionError) as error:
        raise ModelError(
            f"no {file.suffix[1:].upper()} that can be read",
            evidence=str(error)[:300] or type(error).__name__,
            cure="write UTF-8 text as in the files that come with the package",
        ) from error
    _refuse_deep(table, "", 0)
    return table


def _refuse_deep(value: Any, where: str, depth: int) -> None:
    """Refuse what would exhaust whoever walks through it, or prints it."""
    if depth > _DEEPEST:
        raise refuse(
            "tables in tables too deep", where[:80], f"more than {_DEEPEST} in each other",
            "write them as in the files that come with the package",
        )  # fmt: skip
    if isinstance(value, dict):
        for key, item in value.items():
            _refuse_deep(item, f"{where}.{key}" if where else str(key), depth + 1)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            _refuse_deep(item, f"{where}[{i}]", depth + 1)


def write_text(text: str, file: Path, what: str) -> None:
    """Write a text as UTF-8.

    Raises
    ------
    InputError : a place that cannot be written.
    ModelError : a text that UTF-8 cannot hold.
    """
    try:
        file.write_bytes(text.encode("utf-8"))
    except UnicodeEncodeError as error:
        raise ModelError(
            "a text that UTF-8 cannot hold", where=what, evidence=str(error)
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(
            f"the file of {what} cannot be written", where=str(file), evidence=str(error)
        ) from error


@contextmanager
def errors_name(file: Path) -> Iterator[None]:
    """Put the name of the file before the key path of each ModelError."""
    try:
        yield
    except ModelError as error:
        where = f"{file.name}: {error.where}" if error.where else file.name
        raise ModelError(
            error.what, where=where, evidence=error.evidence, cure=error.cure
        ) from error


# --- TOML -------------------------------------------------------------------------------------


def toml_text(table: Table) -> str:
    """TOML of plain tables: tables and lists of tables at the top, inline ones below.

    Parameters
    ----------
    table : keys are bare; values are texts, finite numbers, truth values, lists and tables. TOML
        has no null: what is None is left out.
    """
    lines = _lines({key: value for key, value in table.items() if not _has_head(value)})
    for key, value in table.items():
        if _has_head(value):
            head = f"[[{key}]]" if isinstance(value, list) else f"[{key}]"
            for item in value if isinstance(value, list) else (value,):
                lines += ["", head, *_lines(item)]
    return "\n".join(lines) + "\n"


def _has_head(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and isinstance(value[0], dict)
    )


def _lines(table: Table) -> list[str]:
    return [f"{key} = {_inline(value)}" for key, value in table.items() if value is not None]


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(_lines(value)) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    # Values are written as in JSON; only DEL must be escaped in TOML alone.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")
