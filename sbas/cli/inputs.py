"""Options that every verb on recordings shares, and how they become a source and a truth."""

from __future__ import annotations

from collections.abc import Sequence
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

Files = Annotated[
    list[Path],
    typer.Argument(help="Recordings: SBF, RTKLIB .pos, CSV, Parquet.", metavar="FILE..."),
]
FormatName = Annotated[
    str | None, typer.Option("--format", help="Read as this format instead of looking.")
]
TruthText = Annotated[
    str | None,
    typer.Option(
        "--truth",
        metavar="LAT,LON,H or FILE",
        help="True antenna position: degrees and ellipsoidal metres, or a trajectory file "
        "(time, lat_deg, lon_deg, height_m).",
    ),
]
Frame = Annotated[
    str,
    typer.Option(
        "--frame", help="Reference frame of the truth; unstated, errors may be wrong by 1 m."
    ),
]
AntennaHeight = Annotated[
    float,
    typer.Option("--antenna-height", help="Antenna above the truth's mark, in metres."),
]
MaxStep = Annotated[
    float,
    typer.Option("--truth-max-step", help="Longest step to interpolate, in seconds."),
]
Sort = Annotated[bool, typer.Option("--sort", help="Put epochs in the order of their times.")]
Duplicates = Annotated[
    str | None,
    typer.Option("--duplicates", metavar="first|last", help="Of equal times keep this one."),
]
PlZero = Annotated[
    str | None,
    typer.Option("--pl-zero", metavar="missing", help="Protection levels <= 0 become missing."),
]
Accept = Annotated[
    list[str] | None,
    typer.Option("--accept", metavar="CODE", help="Accept this error of the input, by name."),
]
TimeScaleName = Annotated[
    str | None, typer.Option("--time-scale", help="Time scale of a file that does not say it.")
]
ModeMap = Annotated[
    str | None,
    typer.Option("--mode-map", metavar="A=MODE,...", help="Meaning of a CSV file's modes."),
]
Geoid = Annotated[
    float | None,
    typer.Option("--geoid", help="Geoid undulation for heights above the geoid in metres."),
]


def open_source(
    files: Sequence[Path],
    *,
    format_name: str | None = None,
    time_scale: str | None = None,
    mode_map: str | None = None,
    geoid: float | None = None,
    sort: bool = False,
    duplicates: str | None = None,
    pl_zero: str | None = None,
    quiet: bool = False,
) -> EpochSource:
    """The files as one source, repaired as asked."""
    _one_of("--duplicates", duplicates, ("first", "last"))
    _one_of("--pl-zero", pl_zero, ("missing",))
    given: dict[str, Any] = {
        "time_scale": time_scale,
        "mode_map": None if mode_map is None else _pairs(mode_map),
        "geoid": geoid,
    }
    options = {name: value for name, value in given.items() if value is not None}
    repairing = sort or duplicates or pl_zero
    opened = read if repairing else scan
    sources = []
    for path in files:
        with progress(f"reading {path.name}", quiet) as callback:
            sources.append(opened(path, format_name, progress=callback, **options))
    if not repairing:
        return join_sources(sources)
    return repair(
        joined_recording(sources),  # type: ignore[arg-type]
        sort=sort,
        duplicates=duplicates,  # type: ignore[arg-type]
        pl_zero=pl_zero,  # type: ignore[arg-type]
    )


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


def open_truth(
    text: str | None,
    *,
    frame: str = "",
    antenna_height_m: float = 0.0,
    max_step_s: float = 1.0,
    time_scale: str | None = None,
    geoid: float | None = None,
) -> Truth | None:
    """The truth from `LAT,LON,H` or from a trajectory file; None where nothing was given.

    `time_scale` and `geoid` serve a file that does not say its time scale, and heights above
    the geoid.
    """
    if text is None:
        return None
    numbers = _three_numbers(text)
    if numbers is not None:
        return FixedPoint(*numbers, antenna_height_m=antenna_height_m, frame=frame)
    path = Path(text)
    if not path.exists():
        raise InputError(
            f"--truth {text!r} is neither LAT,LON,HEIGHT nor a file",
            cure="--truth 50.03,15.77,289.4 (degrees and metres above the ellipsoid)",
        )
    table = read_truth_table(path, time_scale=time_scale, geoid=geoid)  # type: ignore[arg-type]
    return Trajectory(table, antenna_height_m, max_step_s, frame=frame)


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
