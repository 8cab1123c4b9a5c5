"""Options that every verb on recordings shares, and how they become a source and a truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from sbas.cli.output import progress
from sbas.environment_labels import label_epochs, load_segments
from sbas.exceptions import InputError
from sbas.input_check import Repairs, repair
from sbas.logs.registry import read, scan
from sbas.logs.track_files import load_track
from sbas.logs.truth_files import read_truth_table
from sbas.recording import EpochSource
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory, Truth, transformed

_truth = partial(typer.Option, rich_help_panel="Truth")
_track = partial(typer.Option, rich_help_panel="Track and environments")
_reading = partial(typer.Option, rich_help_panel="Reading")
_repair = partial(typer.Option, rich_help_panel="Repairs, each counted in the result")

Files = Annotated[
    list[Path],
    typer.Argument(
        help="Recordings of one receiver, in any format of docs/formats.md, compressed or not: "
        "files, patterns in quotes, folders.",
        metavar="FILE...",
    ),
]
Accept = Annotated[
    list[str] | None,
    typer.Option("--accept", metavar="CODE", help="Accept this error of the input, by name."),
]


@dataclass(frozen=True)
class TruthGiven:
    """Where the antenna really was, and along which track."""

    truth: Annotated[
        str | None,
        _truth(
            metavar="LAT,LON,H or FILE",
            help="True antenna position: degrees and ellipsoidal metres, or a trajectory file "
            "(time, lat_deg, lon_deg, height_m), or 'track' for the centre line itself.",
        ),
    ] = None
    frame: Annotated[
        str,
        _truth(
            metavar="NAME [EPOCH]",
            help="Reference frame of the truth, such as 'ETRF2000 2025.5' or EPSG:5514; "
            "unstated, errors may be wrong by 1 m.",
        ),
    ] = ""
    truth_transform: Annotated[
        str | None,
        _truth(
            metavar="A>B@EPOCH",
            help="Take the truth to another frame by name, such as 'ETRF2000>ITRF2014@2025.5'.",
        ),
    ] = None
    truth_time_scale: Annotated[
        str | None,
        _truth(help="Time scale of a truth file that does not say it; else --time-scale."),
    ] = None
    truth_geoid: Annotated[
        float | None,
        _truth(
            help="Geoid undulation for a truth or track with heights above the geoid; else --geoid."
        ),
    ] = None
    antenna_height: Annotated[float, _truth(help="Antenna above the truth's mark, in metres.")] = (
        0.0
    )
    truth_max_step: Annotated[float, _truth(help="Longest step to interpolate, in seconds.")] = 1.0
    track: Annotated[Path | None, _track(help="Track centre line: GeoJSON, longitude first.")] = (
        None
    )
    track_id: Annotated[str | None, _track(help="Which line of a file with several.")] = None
    track_height: Annotated[
        str | None,
        _track(metavar="ellipsoidal|geoid|ignore", help="What a third coordinate is."),
    ] = None
    track_sigma: Annotated[
        float | None, _track(help="1-sigma of the line, across it, in metres.")
    ] = None
    environments: Annotated[
        Path | None,
        _track(
            metavar="CSV",
            help="Environment labels: label,begin,end (times) or label,from_m,to_m (along the "
            "track); every figure is then given for each label as well.",
        ),
    ] = None


@dataclass(frozen=True)
class Reading:
    """How the files are to be understood."""

    format: Annotated[str | None, _reading(help="Read as this format instead of looking.")] = None
    time_scale: Annotated[
        str | None, _reading(help="Time scale of a file that does not say it.")
    ] = None
    date: Annotated[
        str | None,
        _reading(metavar="YYYY-MM-DD", help="UTC date of the first epoch, for NMEA without one."),
    ] = None
    mode_map: Annotated[
        str | None, _reading(metavar="A=MODE,...", help="Meaning of a CSV file's modes.")
    ] = None
    geoid: Annotated[
        float | None,
        _reading(help="Geoid undulation for heights above the geoid, in metres."),
    ] = None
    decimal: Annotated[str | None, _reading(metavar=",|.", help="Decimal sign of a text file.")] = (
        None
    )
    encoding: Annotated[str | None, _reading(help="Encoding of a text file, such as latin-1.")] = (
        None
    )
    max_line: Annotated[int | None, _reading(help="Longest line of a text file, in bytes.")] = None
    max_output: Annotated[
        int | None, _reading(help="Most bytes that a compressed file may hold.")
    ] = None
    assume_dgps: Annotated[
        str | None,
        _reading(metavar="dgnss|sbas", help="What a differential fix of NMEA is."),
    ] = None
    nmea_checksum: Annotated[
        str | None,
        _reading(metavar="required|optional", help="Whether NMEA lines may lack a checksum."),
    ] = None
    ubx_pl: Annotated[
        str | None,
        _reading(metavar="norm|max", help="HPL from the two horizontal levels of NAV-PL."),
    ] = None
    ubx_max_payload: Annotated[
        int | None, _reading(help="Longest payload of a UBX message, in bytes.")
    ] = None


@dataclass(frozen=True)
class Repairing:
    """What is to be put right, each repair counted in the result; see sbas.input_check.Repairs."""

    unit: Annotated[
        list[str] | None,
        _repair(metavar="COLUMN=UNIT", help="True unit of a column, such as hpl_m=mm."),
    ] = None
    angles: Annotated[
        str | None, _repair(metavar="rad", help="Latitude and longitude are radians.")
    ] = None
    swap_latlon: Annotated[
        bool, _repair("--swap-latlon", help="Exchange latitude and longitude.")
    ] = False
    sign: Annotated[
        str | None, _repair(metavar="lat|lon|both", help="Change the sign of this one.")
    ] = None
    height_offset: Annotated[
        float | None,
        _repair(help="Add to every height: a geoid undulation, an antenna height, in metres."),
    ] = None
    time: Annotated[
        str | None, _repair(metavar="UTC", help="The stamps are of this scale, not GPS time.")
    ] = None
    week_rollover: Annotated[
        int | None, _repair(help="Add these weeks, such as 1024 after a rollover.")
    ] = None
    unwrap: Annotated[
        str | None, _repair(metavar="day|week", help="Advance the date where time falls back.")
    ] = None
    leap_slip: Annotated[
        str | None, _repair(metavar="fix|fix-after", help="Take out a step of a leap second (E11).")
    ] = None
    shift_s: Annotated[float | None, _repair(help="Add to every time, in seconds.")] = None
    sort: Annotated[bool, _repair("--sort", help="Put epochs in the order of their times.")] = False
    duplicates: Annotated[
        str | None, _repair(metavar="first|last", help="Of equal times keep this one.")
    ] = None
    pl_zero: Annotated[
        str | None, _repair(metavar="missing", help="Protection levels <= 0 become missing.")
    ] = None
    pl_frozen: Annotated[
        str | None, _repair(metavar="missing", help="Levels that stand still become missing.")
    ] = None
    pl_sentinel: Annotated[
        float | None, _repair(help="Protection levels of this value stand for none.")
    ] = None
    pl_kind: Annotated[
        str | None, _repair(metavar="do229|raim|...", help="What the protection levels are.")
    ] = None

    def repairs(self) -> Repairs:
        """The same as the value that `repair` takes."""
        named: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        named["unit"] = _pairs(self.unit or (), "--unit", "--unit hpl_m=mm")
        named["height_offset_m"] = named.pop("height_offset")
        return Repairs(**named)


@dataclass(frozen=True, eq=False)
class Opened:
    """What a verb works on."""

    source: EpochSource
    truth: Truth | None
    track: Track | None


def open_recording(
    files: Sequence[Path],
    truth: TruthGiven,
    reading: Reading,
    repairing: Repairing,
    *,
    quiet: bool = False,
    whole: bool = False,
) -> Opened:
    """Files, truth and track as a verb takes them, repaired and labelled as asked.

    The source streams where it can, unless it is repaired or wanted `whole`: a Recording.
    """
    track = open_track(truth, reading)
    known = open_truth(truth, reading, track)
    source = _open_source(files, reading, repairing, quiet=quiet, whole=whole)
    if truth.environments is not None:
        segments = load_segments(truth.environments)
        source = label_epochs(source, segments, track=track, truth=known)
    return Opened(source, known, track)


def _open_source(
    files: Sequence[Path], reading: Reading, repairing: Repairing, *, quiet: bool, whole: bool
) -> EpochSource:
    """The files as one source, repaired as asked."""
    options = {
        field.name: value
        for field in fields(reading)
        if field.name != "format" and (value := getattr(reading, field.name)) is not None
    }
    if reading.mode_map is not None:
        options["mode_map"] = _pairs(
            reading.mode_map.split(","), "--mode-map", "--mode-map 3=sbas,5=standalone"
        )
    repairs = repairing.repairs()
    paths: Any = files[0] if len(files) == 1 else files
    label = files[0].name if len(files) == 1 else f"{len(files)} files"
    with progress(f"reading {label}", quiet) as callback:
        if repairs == Repairs() and not whole:
            return scan(paths, reading.format, progress=callback, **options)
        return repair(read(paths, reading.format, progress=callback, **options), repairs)


def refuse_to_overwrite(out: Path, files: Iterable[Path | str | None]) -> None:
    """Raise InputError when an output is one of the inputs."""
    for path in (Path(file) for file in files if file is not None):
        if out.exists() and path.exists() and out.samefile(path):
            raise InputError(
                "the output would overwrite an input", where=str(out), cure="name another file"
            )


def _pairs(words: Iterable[str], option: str, example: str) -> dict[str, str]:
    pairs = [word.split("=") for word in words]
    if any(len(pair) != 2 for pair in pairs):
        raise InputError(f"{option} is a list of A=B", evidence=repr(list(words)), cure=example)
    return {key.strip(): value.strip() for key, value in pairs}


def open_track(given: TruthGiven, reading: Reading) -> Track | None:
    """The track centre line; None where none was given."""
    if given.track is None:
        for name in ("track_id", "track_height", "track_sigma"):
            if getattr(given, name) is not None:
                option = "--" + name.replace("_", "-")
                raise InputError(f"{option} needs --track", cure="--track FILE.geojson")
        return None
    track = load_track(
        given.track,
        track_id=given.track_id,
        height=given.track_height,  # type: ignore[arg-type]
        geoid=reading.geoid if given.truth_geoid is None else given.truth_geoid,
        sigma_m=given.track_sigma,
        frame=given.frame or None if given.truth in (None, "track") else None,
    )
    if given.truth_transform and given.truth in (None, "track"):
        return transformed(track, given.truth_transform)
    return track


def open_truth(given: TruthGiven, reading: Reading, track: Track | None) -> Truth | None:
    """The truth from `LAT,LON,H`, a trajectory file or the track; None where nothing was given."""
    text = given.truth
    if text is None:
        return None
    if text == "track":
        if track is None:
            raise InputError("--truth track needs the track", cure="--track FILE.geojson")
        return TrackLine(track)
    numbers = _three_numbers(text)
    found: FixedPoint | Trajectory
    if numbers is not None:
        found = FixedPoint(*numbers, antenna_height_m=given.antenna_height, frame=given.frame)
    else:
        path = Path(text)
        if not path.exists():
            raise InputError(
                f"--truth {text!r} is neither LAT,LON,HEIGHT nor a file",
                cure="--truth 50.03,15.77,289.4 (degrees and metres above the ellipsoid)",
            )
        table = read_truth_table(
            path,
            time_scale=given.truth_time_scale or reading.time_scale,  # type: ignore[arg-type]
            geoid=reading.geoid if given.truth_geoid is None else given.truth_geoid,
            frame=given.frame,
        )
        found = Trajectory(table, given.antenna_height, given.truth_max_step, frame=given.frame)
    return transformed(found, given.truth_transform) if given.truth_transform else found


def _three_numbers(text: str) -> tuple[float, float, float] | None:
    try:
        lat, lon, height = (float(word) for word in text.split(","))
    except ValueError:
        return None
    return lat, lon, height


def alert_limits(text: str) -> tuple[float, ...]:
    """Alert limits from `50,25,20` in metres."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise InputError(
            "--alert-limit is a list of metres", evidence=repr(text), cure="--alert-limit 50,25,20"
        ) from None
