"""Which formats there are, which one a file has, and reading it: `detect`, `read`, `scan`.

Content decides; the extension is a hint. Built-in formats are a literal tuple; others join
through the entry point group `sbas.formats`, whose entries are `Format` values.
"""

from __future__ import annotations

import difflib
import functools
import importlib.metadata
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import pandas as pd

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.archive import join_sources, joined_recording
from sbas.logs.arrow import parquet
from sbas.logs.decompression import PlainFile, plain_file
from sbas.logs.delimited import delimited_text
from sbas.logs.detection import LOWEST_SCORE, Detection, samples, told_format
from sbas.logs.epoch_spool import SpooledEpochs, can_spool, spool
from sbas.logs.file_sets import FileSet, PathLike, checked_file, find_files, sha256_of
from sbas.logs.format import Format, Match, Progress
from sbas.logs.nmea import nmea
from sbas.logs.programs import ginan_spp, glab_output, novatel_oem, pegasus_csv
from sbas.logs.provenance import completed
from sbas.logs.rtklib import rtklib_pos
from sbas.logs.septentrio import septentrio_sbf
from sbas.logs.text_input import WHOLE_BYTES
from sbas.logs.ublox import ublox_ubx, ubx_hex_csv
from sbas.recording import EpochSource, Recording, RecordingMeta, with_columns
from sbas.timescales import TimeScale

FORMATS: tuple[Format, ...] = (
    septentrio_sbf.FORMAT,
    ublox_ubx.FORMAT,
    novatel_oem.FORMAT,
    nmea.FORMAT,
    rtklib_pos.FORMAT,
    glab_output.FORMAT,
    ginan_spp.FORMAT,
    pegasus_csv.FORMAT,
    ubx_hex_csv.FORMAT,
    parquet.FORMAT,
    delimited_text.FORMAT,
)
"""The built-in formats."""

ENTRY_POINT_GROUP = "sbas.formats"
FOLDER_SCORE = 50
"""Content that nobody named but that lies in a folder is a recording from this score on."""
_COMMON_ARGUMENTS = {"path", "columns", "progress"}
_NO_OPTIONS_OF_FORMATS = {"paths", "format", "columns", "progress", "max_output"}

T = TypeVar("T")
S = TypeVar("S", bound=EpochSource)


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
    paths: PathLike | Sequence[PathLike],
    format: str | None = None,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    decimal: str | None = None,
    max_line: int | None = None,
    date: str | None = None,
    assume_dgps: Literal["dgnss", "sbas"] | None = None,
    nmea_checksum: Literal["required", "optional"] | None = None,
    ubx_pl: Literal["norm", "max"] | None = None,
    ubx_max_payload: int | None = None,
    max_output: int | None = None,
) -> Recording:
    """Recording of one file or of several of one receiver, in any known format.

    Parameters
    ----------
    paths : a file, a pattern such as `day*.sbf`, a folder, or a sequence of these. Several files
        are joined in the order of their first epochs; the same content counts once. Compressed
        files (gzip, bzip2, xz, zip of one file, `.Z`) are read as what is in them.
    format : name of the format; by default told from the content.
    columns : documented columns to read; by default all that the file has. Those that it lacks
        are filled as missing.
    progress : called with bytes done and bytes in all.
    time_scale : scale of the times, where the file does not say it.
    mode_map : words of the column `mode` to names of `sbas.recording.MODES`.
    geoid : undulation [m] that makes heights above the geoid ellipsoidal.
    encoding : encoding of text, such as `latin-1`; by default told from its first bytes.
    decimal : decimal sign of delimited text, `.` or `,`; by default told from its first lines.
    max_line : longest line of text [bytes].
    date : UTC date YYYY-MM-DD of the first epoch of an NMEA file that has none.
    assume_dgps : what NMEA's differential fix is, `dgnss` or `sbas`.
    nmea_checksum : `required`, or `optional` for NMEA sentences that may lack it.
    ubx_pl : how two horizontal levels of UBX-NAV-PL become one, `norm` or `max`.
    ubx_max_payload : longest payload of a UBX frame [bytes].
    max_output : bytes that a compressed file may become; by default 8 GiB, and above 64 MiB at
        most 200 times the file.

    Returns
    -------
    Recording with the files, their sizes and their SHA-256 in `meta.sources`.

    Raises
    ------
    InputError : a file that is absent, empty, of unknown format or unusable; an option that the
        format does not have; a folder without a file of a known format.
    """
    job = _Job(format, columns, _options(locals()), max_output)
    files = find_files(paths)
    if not files.several:
        return _read(_opened(files.files[0], job), job, progress)
    found, findings = _each(files, job, _read, progress)
    return joined_recording(found).with_findings(*findings)


def scan(
    paths: PathLike | Sequence[PathLike],
    format: str | None = None,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    decimal: str | None = None,
    max_line: int | None = None,
    date: str | None = None,
    assume_dgps: Literal["dgnss", "sbas"] | None = None,
    nmea_checksum: Literal["required", "optional"] | None = None,
    ubx_pl: Literal["norm", "max"] | None = None,
    ubx_max_payload: int | None = None,
    max_output: int | None = None,
) -> EpochSource:
    """Epochs of files for analyses that go batch by batch; arguments and errors as for `read`.

    A format that cannot stream is read whole; of several files that are long together, one at a
    time is held in memory.
    """
    job = _Job(format, columns, _options(locals()), max_output)
    files = find_files(paths)
    if not files.several:
        return _scan(_opened(files.files[0], job), job, progress)
    long = sum(path.stat().st_size for path in files.files if path.is_file()) > WHOLE_BYTES
    found, findings = _each(files, job, _scan_aside if long else _scan, progress)
    source = join_sources(found)
    meta = replace(source.meta, findings=(*source.meta.findings, *findings))
    return source.replace(meta=meta) if isinstance(source, Recording) else _Described(meta, source)


@dataclass(frozen=True)
class _Job:
    """What a caller of `read` or `scan` asked for, beside the files."""

    format: str | None
    columns: Sequence[str] | None
    options: Mapping[str, Any]
    max_output: int | None


def _options(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Of the arguments of `read` or `scan`, the options of formats that were given."""
    return {
        name: value
        for name, value in arguments.items()
        if name not in _NO_OPTIONS_OF_FORMATS and value is not None
    }


@dataclass(frozen=True, eq=False)
class _Opened:
    """A file after all checks: its plain form, its format, and a call that waits for its hash."""

    file: PlainFile
    found: Detection
    digest: Callable[[], str]


def _opened(path: Path, job: _Job, *, of_folder: bool = False) -> _Opened:
    """A file with its format; of a folder, one whose content does not look like it is E16."""
    plain = plain_file(checked_file(path), max_output=job.max_output)
    if job.format is None:
        found = _detected(plain)
        least = FOLDER_SCORE
    else:
        chosen = format_named(job.format)
        found = Detection(chosen, Match(100, "named by the caller"))
        if of_folder:
            found = Detection(chosen, chosen.sniff(*samples(plain.path), plain.path))
        least = LOWEST_SCORE
    if of_folder and found.match.score < least:
        raise InputError(
            "the content is of no known format for certain",
            code="E16",
            where=str(path),
            evidence=f"{found.format.name}: {found.match.reason}",
            cure="name the file itself, where it is a recording",
        )
    _check_options(found.format, job.options)
    pool = ThreadPoolExecutor(1)
    digest = pool.submit(sha256_of, path)
    pool.shutdown(wait=False)
    return _Opened(plain, found, digest.result)


def _read(opened: _Opened, job: _Job, progress: Progress | None) -> Recording:
    recording = _called(opened.found.format.read, opened, job, progress)
    if job.columns is not None:
        recording = recording.replace(table=with_columns(recording.table, job.columns))
    return recording.replace(meta=_completed(recording.meta, opened, job))


def _scan(opened: _Opened, job: _Job, progress: Progress | None) -> EpochSource:
    call = opened.found.format.scan or opened.found.format.read
    source: EpochSource = _called(call, opened, job, progress)
    meta = _completed(source.meta, opened, job)
    if isinstance(source, Recording):
        return source.replace(meta=meta)
    return _Described(meta, source, opened.file)


def _scan_aside(opened: _Opened, job: _Job, progress: Progress | None) -> EpochSource:
    """As `_scan`, with epochs that a format holds in memory set aside."""
    source = _scan(opened, job, progress)
    if isinstance(source, Recording) and can_spool(source.table):
        return SpooledEpochs(source.meta, spool([source.table]))
    return source


def _each(
    files: FileSet,
    job: _Job,
    call: Callable[[_Opened, _Job, Progress | None], S],
    progress: Progress | None,
) -> tuple[list[S], tuple[Finding, ...]]:
    """Every file read or scanned, and findings on the set of them."""
    total = sum(path.stat().st_size for path in files.files if path.is_file())
    done = 0
    found: list[S] = []
    left_out: list[tuple[Path, InputError]] = []
    for path in files.files:
        of_folder = path in files.of_folder
        try:
            opened = _opened(path, job, of_folder=of_folder)
        except InputError as problem:
            if not of_folder or problem.code not in ("E15", "E16"):
                raise
            left_out.append((path, problem))
            continue
        size = path.stat().st_size
        found.append(call(opened, job, _part_of(progress, done, size, total)))
        done += size
    if not found:
        first, reason = left_out[0]
        raise InputError(
            "no file of a known format lies in the folder",
            code="E16",
            where=str(first.parent),
            evidence=f"{len(left_out):,} files, the first: {first.name}, {reason.what}",
            cure="name the files, with --format where their format is not recognised",
        )
    if not left_out:
        return found, files.findings
    shown = "; ".join(f"{path.name}: {reason.what}" for path, reason in left_out[:3])
    finding = Finding(
        "E16",
        "warning",
        f"{len(left_out):,} of {len(files.files):,} files were left out: they are empty or of no "
        "known format",
        evidence=shown,
        cure="name the files that are recordings instead of their folder",
    )
    return found, (*files.findings, finding)


def _part_of(progress: Progress | None, done: int, size: int, total: int) -> Progress | None:
    """Progress of one file as that of all."""
    if progress is None:
        return None
    return lambda at, of: progress(done + size * at // max(of, 1), total)


@dataclass(frozen=True, eq=False)
class _Described:
    """A streaming source with the metadata that the registry completed.

    `file` is held because what is temporary must last as long as the source.
    """

    meta: RecordingMeta
    source: EpochSource
    file: PlainFile | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        return self.source.columns

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        # A generator, so that it holds the file even where nobody else does.
        yield from self.source.batches(columns)


def detect(path: PathLike, *, max_output: int | None = None) -> Detection:
    """The format of a file by its content, decompressed where it is compressed.

    Every format scores the content from 0 to 100; the extension adds up to 5 to its own format.

    Parameters
    ----------
    path : the file.
    max_output : bytes that a compressed file may become, as for `read`.

    Raises
    ------
    InputError : a file that is absent or empty; no score of 20; two within 10 points of another.
    """
    return _detected(plain_file(checked_file(Path(path)), max_output=max_output))


def _detected(file: PlainFile) -> Detection:
    found = told_format(file, formats())
    return found._replace(findings=(*_plug_ins()[1], *found.findings))


def options_of(chosen: Format) -> tuple[str, ...]:
    """Names of the options that a format's reader has beside columns and progress."""
    names = inspect.signature(chosen.read).parameters
    return tuple(name for name in names if name not in _COMMON_ARGUMENTS)


def _check_options(chosen: Format, options: Mapping[str, Any]) -> None:
    for name in options:
        if name in options_of(chosen):
            continue
        knowing = [f.name for f in formats() if name in options_of(f)]
        raise InputError(
            f"the format {chosen.name} has no option {name}",
            where=name,
            evidence=f"formats with it: {', '.join(knowing)}",
            cure=f"leave out {name}",
        )


def _called(call: Callable[..., T], opened: _Opened, job: _Job, progress: Progress | None) -> T:
    file = opened.file
    try:
        return call(file.path, columns=job.columns, progress=progress, **job.options)
    except InputError as error:
        error.where, error.evidence = file.renamed(error.where), file.renamed(error.evidence)
        raise
    except OSError as error:
        raise InputError(
            "the file cannot be read", where=str(file.given), evidence=str(error), cure="try again"
        ) from error


def _completed(meta: RecordingMeta, opened: _Opened, job: _Job) -> RecordingMeta:
    given = dict(job.options)
    if job.max_output is not None and opened.file.packing:
        given["max_output"] = job.max_output
    return completed(meta, opened.file, opened.found, opened.digest(), given)
