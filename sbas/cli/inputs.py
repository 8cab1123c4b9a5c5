"""Options that every verb on recordings shares, and how they become a source and a truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from sbas.cli.output import progress
from sbas.exceptions import InputError
from sbas.input_check import repair
from sbas.logs.archive import join_sources, joined_recording
from sbas.logs.registry import read, scan
from sbas.logs.truth_files import read_truth_table
from sbas.recording import EpochSource
from sbas.truth import FixedPoint, Trajectory, Truth

_truth = partial(typer.Option, rich_help_panel="Truth")
_reading = partial(typer.Option, rich_help_panel="Reading")
_repair = partial(typer.Option, rich_help_panel="Repairs, each counted in the result")

Files = Annotated[
    list[Path],
    typer.Argument(help="Recordings: SBF, RTKLIB .pos, CSV, Parquet.", metavar="FILE..."),
]


@dataclass(frozen=True)
class TruthGiven:
    """Where the antenna really was."""

    truth: Annotated[
        str | None,
        _truth(
            "--truth",
            metavar="LAT,LON,H or FILE",
            help="True antenna position: degrees and ellipsoidal metres, or a trajectory file "
            "(time, lat_deg, lon_deg, height_m).",
        ),
    ] = None
    frame: Annotated[
        str,
        _truth(help="Reference frame of the truth; unstated, errors may be wrong by 1 m."),
    ] = ""
    antenna_height: Annotated[float, _truth(help="Antenna above the truth's mark, in metres.")] = (
        0.0
    )
    truth_max_step: Annotated[float, _truth(help="Longest step to interpolate, in seconds.")] = 1.0


@dataclass(frozen=True)
class Reading:
    """How the files are to be understood."""

    format: Annotated[str | None, _reading(help="Read as this format instead of looking.")] = None
    time_scale: Annotated[
        str | None, _reading(help="Time scale of a file that does not say it.")
    ] = None
    mode_map: Annotated[
        str | None, _reading(metavar="A=MODE,...", help="Meaning of a CSV file's modes.")
    ] = None
    geoid: Annotated[
        float | None,
        _reading(help="Geoid undulation for heights above the geoid in metres."),
    ] = None


@dataclass(frozen=True)
class Repairing:
    """What is to be put right, each repair counted in the result."""

    sort: Annotated[bool, _repair("--sort", help="Put epochs in the order of their times.")] = False
    duplicates: Annotated[
        str | None, _repair(metavar="first|last", help="Of equal times keep this one.")
    ] = None
    pl_zero: Annotated[
        str | None, _repair(metavar="missing", help="Protection levels <= 0 become missing.")
    ] = None


Accept = Annotated[
    list[str] | None,
    typer.Option("--accept", metavar="CODE", help="Accept this error of the input, by name."),
]


def open_source(
    files: Sequence[Path], reading: Reading, repairing: Repairing, *, quiet: bool = False
) -> EpochSource:
    """The files as one source, repaired as asked."""
    _one_of("--duplicates", repairing.duplicates, ("first", "last"))
    _one_of("--pl-zero", repairing.pl_zero, ("missing",))
    given: dict[str, Any] = {
        "time_scale": reading.time_scale,
        "mode_map": None if reading.mode_map is None else _pairs(reading.mode_map),
        "geoid": reading.geoid,
    }
    options = {name: value for name, value in given.items() if value is not None}
    is_repaired = repairing != Repairing()
    opened = read if is_repaired else scan
    sources = []
    for path in files:
        with progress(f"reading {path.name}", quiet) as callback:
            sources.append(opened(path, reading.format, progress=callback, **options))
    if not is_repaired:
        return join_sources(sources)
    return repair(joined_recording(sources), **vars(repairing))  # type: ignore[arg-type]


def refuse_to_overwrite(out: Path, files: Sequence[Path]) -> None:
    """Raise InputError when an output is one of the inputs."""
    for path in files:
        if out.exists() and path.exists() and out.samefile(path):
            raise InputError(
                "the report would overwrite an input", where=str(out), cure="name another file"
            )


def _one_of(option: str, value: str | None, allowed: tuple[str, ...]) -> None:
    if value is not None and value not in allowed:
        raise InputError(
            f"{option} cannot be {value!r}", cure=" or ".join(f"{option} {a}" for a in allowed)
        )


def _pairs(text: str) -> dict[str, str]:
    pairs = [pair.split("=") for pair in text.split(",")]
    if any(len(pair) != 2 for pair in pairs):
        raise InputError(
            "--mode-map is a list of A=MODE",
            evidence=repr(text),
            cure="--mode-map 3=sbas,5=standalone",
        )
    return {key.strip(): mode.strip() for key, mode in pairs}


def open_truth(given: TruthGiven, reading: Reading) -> Truth | None:
    """The truth from `LAT,LON,H` or from a trajectory file; None where nothing was given."""
    text = given.truth
    if text is None:
        return None
    numbers = _three_numbers(text)
    if numbers is not None:
        return FixedPoint(*numbers, antenna_height_m=given.antenna_height, frame=given.frame)
    path = Path(text)
    if not path.exists():
        raise InputError(
            f"--truth {text!r} is neither LAT,LON,HEIGHT nor a file",
            cure="--truth 50.03,15.77,289.4 (degrees and metres above the ellipsoid)",
        )
    table = read_truth_table(path, time_scale=reading.time_scale, geoid=reading.geoid)  # type: ignore[arg-type]
    return Trajectory(table, given.antenna_height, given.truth_max_step, frame=given.frame)


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
