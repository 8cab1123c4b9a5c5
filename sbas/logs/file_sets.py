"""Which files are meant by paths, patterns and folders; the same content counts once."""

from __future__ import annotations

import difflib
import glob
import hashlib
import json
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.arrow.parquet_writer import LAYOUT_KEY

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class FileSet:
    """Files in a fixed order.

    Parameters
    ----------
    files : the files, each content once.
    of_folder : those that nobody named but that lie in a folder which was named.
    several : whether a list, a pattern or a folder was given, not one path.
    findings : contents that were there more than once.
    """

    files: tuple[Path, ...]
    of_folder: frozenset[Path] = frozenset()
    several: bool = False
    findings: tuple[Finding, ...] = ()


def find_files(paths: PathLike | Sequence[PathLike]) -> FileSet:
    """The files of paths, patterns (`day*.sbf`, `**`) and folders.

    A folder stands for all files in it and in the folders below, hidden ones apart. Side tables
    of Parquet recordings belong to those and are no files of their own.

    Parameters
    ----------
    paths : one of these, or a sequence of them; a name that exists is no pattern.

    Raises
    ------
    InputError : no path, a pattern that nothing matches, a folder without files.
    """
    given = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    if not given:
        raise InputError("no file is named", where="paths", cure="name one file or more")
    files: list[Path] = []
    of_folder: set[Path] = set()
    plain = True
    for path in map(Path, given):
        if path.is_dir():
            found = _in_folder(path)
            of_folder.update(found)
            plain = False
        elif not path.exists() and glob.has_magic(str(path)):
            found = _matching(str(path), of_folder)
            plain = False
        else:
            found = [path]
        files += found
    if plain and len(given) == 1:
        return FileSet(tuple(files))
    kept, findings = _distinct(files)
    return FileSet(kept, frozenset(of_folder), True, findings)


def checked_file(path: Path) -> Path:
    """The path; InputError unless it is a file that can be opened and is not empty."""
    problem = cure = code = ""
    try:
        if not path.exists():
            problem, cure = "there is no such file", "check the name and the folder"
            if path.parent.is_dir() and (
                near := difflib.get_close_matches(path.name, os.listdir(path.parent), n=1)
            ):
                cure += f"; there is {near[0]!r}"
        elif path.is_dir():
            problem, cure = "this is a folder, not a file", "name a file in it"
        elif not path.is_file():
            problem = "this is no regular file but a pipe or a device"
            cure = "write what it delivers to a file, and give that"
        elif not path.stat().st_size:
            problem, cure, code = "the file is empty", "check that the recording was written", "E15"
        else:
            with open(path, "rb"):
                pass
    except (OSError, ValueError) as error:
        problem, cure = f"the file cannot be opened: {error}", "check its name and permissions"
    if problem:
        raise InputError(problem, where=str(path), cure=cure, code=code)
    return path


def _in_folder(folder: Path) -> list[Path]:
    found: list[Path] = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += (Path(place, name) for name in sorted(names) if not name.startswith("."))
    found = list(_without_side_tables(path for path in found if path.is_file()))
    if not found:
        raise InputError(
            "the folder holds no file", where=str(folder), cure="name a folder with recordings"
        )
    return found


def _matching(pattern: str, of_folder: set[Path]) -> list[Path]:
    matches = sorted(map(Path, glob.glob(pattern, recursive=True)))
    found = list(_without_side_tables(path for path in matches if path.is_file()))
    if not found:
        # The pattern may be one of folders.
        found = [file for path in matches if path.is_dir() for file in _in_folder(path)]
        of_folder.update(found)
    if not found:
        raise InputError(
            "no file matches the pattern", where=pattern, cure="check the pattern and the folder"
        )
    return found


def _without_side_tables(paths: Iterable[Path]) -> Iterator[Path]:
    owned: dict[Path, frozenset[str]] = {}
    for path in paths:
        stem, _, name = path.stem.rpartition(".")
        if path.suffix == ".parquet" and stem and name:
            owner = path.with_name(f"{stem}.parquet")
            if owner not in owned:
                owned[owner] = _side_tables(owner)
            if path.name in owned[owner]:
                continue
        yield path


def _side_tables(path: Path) -> frozenset[str]:
    """Names of the side table files that a Parquet recording says it has."""
    try:
        metadata = pq.read_metadata(path).metadata or {}
        tables = json.loads(metadata[LAYOUT_KEY])["side_tables"]
        return frozenset(str(table["file"]) for table in tables.values())
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError, AttributeError):
        return frozenset()  # no such recording: reading it says more


def _distinct(files: Sequence[Path]) -> tuple[tuple[Path, ...], tuple[Finding, ...]]:
    """The files without those whose content another one has, and a finding that counts them."""
    by_size = defaultdict(list)
    for file in files:
        if file.is_file():
            by_size[file.stat().st_size].append(file)
    first: dict[str, Path] = {}
    again: dict[int, Path] = {}
    for position, file in enumerate(files):
        if file.is_file() and len(by_size[file.stat().st_size]) > 1:
            original = first.setdefault(sha256_of(file), file)
            if original is not file:
                again[position] = original
    if not again:
        return tuple(files), ()
    shown = [f"{files[position]} is {original}" for position, original in again.items()]
    finding = Finding(
        "E26",
        "warning",
        f"{len(again):,} of {len(files):,} files hold the same bytes as another and were left out",
        evidence="; ".join(shown[:3]),
        cure="take the copies out",
    )
    return tuple(f for position, f in enumerate(files) if position not in again), (finding,)


def sha256_of(file: Path) -> str:
    """SHA-256 of a file's bytes, as hexadecimal digits."""
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
