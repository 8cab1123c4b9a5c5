"""Which formats there are, which one a file has, and reading it: `detect`, `read`, `scan`.

Content decides; the extension is a hint. Built-in formats are a literal tuple; others join
through the entry point group `sbas.formats`, whose entries are `Format` values.
"""

from __future__ import annotations

import difflib
import functools
import hashlib
import importlib.metadata
import inspect
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pandas as pd
import pyarrow as pa

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.arrow import parquet
from sbas.logs.delimited import delimited_text
from sbas.logs.format import Format, Match, Progress
from sbas.logs.not_read import unread_format
from sbas.logs.rtklib import rtklib_pos
from sbas.logs.septentrio import septentrio_sbf
from sbas.recording import EpochSource, Recording, RecordingMeta, Source, with_columns
from sbas.timescales import TimeScale

FORMATS: tuple[Format, ...] = (
    septentrio_sbf.FORMAT,
    rtklib_pos.FORMAT,
    parquet.FORMAT,
    delimited_text.FORMAT,
)
"""The built-in formats."""

ENTRY_POINT_GROUP = "sbas.formats"
HEAD_BYTES = MIDDLE_BYTES = 1 << 16
TAIL_BYTES = 1 << 12
LOWEST_SCORE = 20
CLOSE_SCORES = 10
EXTENSION_BONUS = 5
_COMMON_ARGUMENTS = {"path", "columns", "progress"}

T = TypeVar("T")


class Detection(NamedTuple):
    """The format of a file, why, and what is odd about it (an extension of another format)."""

    format: Format
    match: Match
    findings: tuple[Finding, ...] = ()


@functools.cache
def _plug_ins() -> tuple[tuple[Format, ...], tuple[Finding, ...]]:
    """Formats of other packages, looked up once; one that cannot be loaded is a finding."""
    formats: list[Format] = []
    findings: list[Finding] = []
    for entry in importlib.metadata.entry_points(group=ENTRY_POINT_GROUP):
        try:
            loaded = entry.load()
            if not isinstance(loaded, Format):
                raise TypeError(f"{entry.value} is no sbas.logs.format.Format")
            if any(f.name == loaded.name for f in (*FORMATS, *formats)):
                raise ValueError(f"there is a format {loaded.name!r} already")
            formats.append(loaded)
        except Exception as error:  # whatever a foreign package raises while it is imported
            findings.append(
                Finding(
                    "E16",
                    "warning",
                    f"the format {entry.name!r} of another package cannot be loaded",
                    where=entry.value,
                    evidence=f"{type(error).__name__}: {error}",
                    cure="update or remove that package",
                )
            )
    return tuple(formats), tuple(findings)


def formats() -> tuple[Format, ...]:
    """All formats: built in, and of other packages."""
    return FORMATS + _plug_ins()[0]


def format_named(name: str) -> Format:
    """The format of a name; InputError with the nearest name and the list otherwise."""
    known = {f.name: f for f in formats()}
    if name in known:
        return known[name]
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
    raise InputError(
        f"unknown format {name!r}",
        where="format",
        evidence=f"did you mean {near[0]!r}?" if near else "",
        cure=f"known are {', '.join(known)}",
    )


def read(
    path: str | os.PathLike[str],
    format: str | None = None,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> Recording:
    """Recording of a file in any known format.

    Parameters
    ----------
    path : the file.
    format : name of the format; by default told from the content.
    columns : documented columns to read; by default all that the file has. Those that it lacks
        are filled as missing.
    progress : called with bytes done and bytes in all.
    time_scale : scale of the times, where the file does not say it.
    mode_map : words of the column `mode` to names of `sbas.recording.MODES`.
    geoid : undulation [m] that makes heights above the geoid ellipsoidal.

    Returns
    -------
    Recording with the file, its size and its SHA-256 in `meta.sources`.

    Raises
    ------
    InputError : a file that is absent, empty, of unknown format or unusable; an option that the
        format does not have.
    """
    options = {"time_scale": time_scale, "mode_map": mode_map, "geoid": geoid}
    found, file, digest = _prepared(path, format, options)
    recording = _called(found.format.read, file, columns, progress, options)
    if columns is not None:
        recording = recording.replace(table=with_columns(recording.table, columns))
    return recording.replace(meta=_completed(recording.meta, path, found, digest, options))


def scan(
    path: str | os.PathLike[str],
    format: str | None = None,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> EpochSource:
    """Epochs of a file for analyses that go batch by batch; arguments and errors as for `read`.

    A format that cannot stream is read whole.
    """
    options = {"time_scale": time_scale, "mode_map": mode_map, "geoid": geoid}
    found, file, digest = _prepared(path, format, options)
    call = found.format.scan or found.format.read
    source: EpochSource = _called(call, file, columns, progress, options)
    meta = _completed(source.meta, path, found, digest, options)
    return source.replace(meta=meta) if isinstance(source, Recording) else _Described(meta, source)


@dataclass(frozen=True, eq=False)
class _Described:
    """A streaming source with the metadata that the registry completed."""

    meta: RecordingMeta
    source: EpochSource

    @property
    def columns(self) -> tuple[str, ...]:
        return self.source.columns

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        return self.source.batches(columns)


def detect(path: str | os.PathLike[str]) -> Detection:
    """The format of a file by its content.

    Every format scores the content from 0 to 100; the extension adds up to 5 to its own format.

    Raises
    ------
    InputError : a file that is absent or empty; no score of 20; two within 10 points of another.
    """
    file = _checked_file(path)
    head, middle, tail = _samples(file)
    extension = file.suffix.lower()
    scored = []
    for candidate in formats():
        match = candidate.sniff(head, middle, tail, file)
        bonus = EXTENSION_BONUS if match.score and extension in candidate.extensions else 0
        scored.append((match.score + bonus, candidate, match))
    scored.sort(key=lambda entry: -entry[0])
    best_score, best, match = scored[0]
    unread, unread_match, unread_cure = unread_format(head)
    if unread_match.score >= max(best_score, LOWEST_SCORE):
        raise InputError(
            f"this is {unread}, which this version does not read",
            code="E16",
            where=str(path),
            evidence=unread_match.reason,
            cure=unread_cure,
        )
    if best_score < LOWEST_SCORE:
        raise InputError(
            "the format of the file is not recognised",
            code="E16",
            where=str(path),
            evidence=_first_sight(head)
            + "; likeliest: "
            + ", ".join(f"{c.name} {s} ({m.reason})" for s, c, m in scored),
            cure=f"name it: --format with one of {', '.join(f.name for f in formats())}",
        )
    if len(scored) > 1 and best_score - scored[1][0] < CLOSE_SCORES:
        second_score, second, second_match = scored[1]
        raise InputError(
            f"the file could be {best.name} or {second.name}",
            code="E16",
            where=str(path),
            evidence=f"{best.name} {best_score} ({match.reason}), "
            f"{second.name} {second_score} ({second_match.reason})",
            cure=f"name it: --format {best.name} or --format {second.name}",
        )
    findings = _plug_ins()[1]
    owners = [f.name for f in formats() if extension in f.extensions]
    if owners and best.name not in owners:
        findings += (
            Finding(
                "E17",
                "warning",
                f"the extension says {' or '.join(owners)}, the content is {best.name}",
                where=str(path),
                evidence=f"{extension}; {match.reason}",
                cure=f"rename it to {file.stem}{best.extensions[0]}",
            ),
        )
    return Detection(best, match, findings)


def _prepared(
    path: str | os.PathLike[str], name: str | None, options: Mapping[str, Any]
) -> tuple[Detection, Path, Callable[[], str]]:
    """Format and file after all checks, and a call that waits for the SHA-256."""
    file = _checked_file(path)
    if name is None:
        found = detect(path)
    else:
        found = Detection(format_named(name), Match(100, "named by the caller"))
    _check_options(found.format, options)
    pool = ThreadPoolExecutor(1)
    digest = pool.submit(_sha256, file)
    pool.shutdown(wait=False)
    return found, file, digest.result


def _checked_file(path: str | os.PathLike[str]) -> Path:
    file = Path(path)
    problem = cure = code = ""
    try:
        if not file.exists():
            problem, cure = "there is no such file", "check the name and the folder"
            if file.parent.is_dir() and (
                near := difflib.get_close_matches(file.name, os.listdir(file.parent), n=1)
            ):
                cure += f"; there is {near[0]!r}"
        elif file.is_dir():
            problem, cure = "this is a folder, not a file", "name a file in it"
        elif not file.is_file():
            problem = "this is no regular file but a pipe or a device"
            cure = "write what it delivers to a file, and give that"
        elif not file.stat().st_size:
            problem, cure, code = "the file is empty", "check that the recording was written", "E15"
        else:
            with open(file, "rb"):
                pass
    except (OSError, ValueError) as error:
        problem, cure = f"the file cannot be opened: {error}", "check its name and permissions"
    if problem:
        raise InputError(problem, where=str(path), cure=cure, code=code)
    return file


def _samples(file: Path) -> tuple[bytes, bytes, bytes]:
    """First 64 KiB, 64 KiB from the middle and last 4 KiB."""
    size = file.stat().st_size
    with open(file, "rb") as stream:
        head = stream.read(HEAD_BYTES)
        stream.seek(max((size - MIDDLE_BYTES) // 2, 0))
        middle = stream.read(MIDDLE_BYTES)
        stream.seek(max(size - TAIL_BYTES, 0))
        return head, middle, stream.read(TAIL_BYTES)


def _first_sight(head: bytes) -> str:
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in head)
    return f"first bytes {head[:16].hex(' ')}, {printable / len(head):.0%} printable"


def options_of(chosen: Format) -> tuple[str, ...]:
    """Names of the options that a format's reader has beside columns and progress."""
    names = inspect.signature(chosen.read).parameters
    return tuple(name for name in names if name not in _COMMON_ARGUMENTS)


def _check_options(chosen: Format, options: Mapping[str, Any]) -> None:
    for name, value in options.items():
        if value is None or name in options_of(chosen):
            continue
        knowing = [f.name for f in formats() if name in options_of(f)]
        raise InputError(
            f"the format {chosen.name} has no option {name}",
            where=name,
            evidence=f"formats with it: {', '.join(knowing)}",
            cure=f"leave out {name}",
        )


def _called(
    call: Callable[..., T],
    file: Path,
    columns: Sequence[str] | None,
    progress: Progress | None,
    options: Mapping[str, Any],
) -> T:
    given = {name: value for name, value in options.items() if value is not None}
    try:
        return call(file, columns=columns, progress=progress, **given)
    except OSError as error:
        raise InputError(
            "the file cannot be read", where=str(file), evidence=str(error), cure="try it again"
        ) from error


def _completed(
    meta: RecordingMeta,
    path: str | os.PathLike[str],
    found: Detection,
    digest: Callable[[], str],
    options: Mapping[str, Any],
) -> RecordingMeta:
    """Metadata with the file as last source, findings of detection, options and versions."""
    source = Source(
        path=_printable(os.fspath(path)),
        bytes=os.path.getsize(path),
        sha256=digest(),
        format=found.format.name,
        reader_version=_version("sbas"),
    )
    given = {
        name: str(dict(value) if isinstance(value, Mapping) else value)
        for name, value in options.items()
        if value is not None
    }
    return replace(
        meta,
        sources=(*meta.sources, source),
        findings=(*found.findings, *meta.findings),
        options={**given, **meta.options},
        versions={
            **meta.versions,
            "sbas": _version("sbas"),
            "numpy": np.__version__,
            "pandas": pd.__version__,
            "pyarrow": pa.__version__,
        },
    )


def _printable(path: str) -> str:
    """A path whose bytes are no text, or that holds control characters, with those escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in path)


@functools.cache
def _version(package: str) -> str:
    return importlib.metadata.version(package)


def _sha256(file: Path) -> str:
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
