"""Verbs on ranges: protect and raim."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sbas.cli import inputs, output
from sbas.cli.inputs import refuse_to_overwrite
from sbas.cli.monitored import (
    CORRECTED_WORDS,
    RangeFiles,
    check_mask,
    corrected_by_sbas,
    has_fixes,
    no_fix,
    place_of,
    refuse_alone,
    sigma_of,
    whole_recording,
)
from sbas.cli.option_groups import with_option_groups
from sbas.cli.writing import write_recording
from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.logs.arrow.parquet import FORMAT as PARQUET
from sbas.recording import Recording

if TYPE_CHECKING:
    from sbas.monitoring.araim_result import AraimResult
    from sbas.monitoring.level_comparison import LevelComparison

MASK_DEG = 5.0
"""Elevation mask of positions from ranges."""

Observations = Annotated[
    list[Path],
    typer.Option("--obs", help="RINEX observations, also compressed; may be repeated."),
]
NavigationFiles = Annotated[
    list[Path],
    typer.Option("--nav", help="RINEX navigation; may be repeated."),
]


def register(app: typer.Typer) -> None:
    app.command("protect")(protect_files)
    app.command("raim")(raim_files)


def protect_files(
    obs: Observations,
    nav: NavigationFiles,
    messages: Annotated[
        list[Path],
        typer.Option(help="SBAS messages: EMS, .sbs, RINEX-B, SBF or UBX; may be repeated."),
    ],
    geo: Annotated[int, typer.Option(help="PRN of the SBAS satellite, 120 to 158.")],
    out: Annotated[Path, typer.Option(help="Recording to write: .parquet.")],
    mode: Annotated[
        Literal["pa", "npa", "auto"],
        typer.Option(
            help="Precision approach, non-precision approach, or auto: PA where it has a fix."
        ),
    ] = "pa",
    profile: Annotated[
        Literal["mops", "glab"], typer.Option(help="As DO-229 has it, or as gLAB 6.0.0 does.")
    ] = "mops",
    position: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Known antenna position, earth-fixed, in metres."),
    ] = None,
    k_h: Annotated[float | None, typer.Option("--k-h", help="K of the HPL, else 6.0/6.18.")] = None,
    k_v: Annotated[float | None, typer.Option("--k-v", help="K of the VPL, else 5.33.")] = None,
    elevation: Annotated[float, typer.Option(help="Elevation mask in degrees.")] = MASK_DEG,
    smoothing: Annotated[
        bool, typer.Option("--smoothing", help="Smooth the code by the carrier over 100 s.")
    ] = False,
    receiver: Annotated[
        Literal["class1", "class2"], typer.Option(help="Model of the receiver's own errors.")
    ] = "class2",
    mt0: Annotated[
        Literal["alarm", "as_mt2", "ignore"],
        typer.Option(help="What message type 0 means; anything but alarm is for test signals."),
    ] = "alarm",
    causal: Annotated[
        bool, typer.Option("--causal", help="Use only ephemerides already transmitted.")
    ] = False,
    stamp: Annotated[
        Literal["end", "start"], typer.Option(help="What message times stamp.")
    ] = "end",
    geo_ranging: Annotated[
        bool, typer.Option("--geo-ranging", help="Use the SBAS satellite's own ranges too.")
    ] = False,
    hal: Annotated[
        float | None, typer.Option(help="With --mode auto: leave PA where the HPL reaches this.")
    ] = None,
    val: Annotated[
        float | None, typer.Option(help="With --mode auto: leave PA where the VPL reaches this.")
    ] = None,
    track_azimuth: Annotated[
        float | None, typer.Option(help="Azimuth of a track: the level along it is added.")
    ] = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """HPL and VPL from RINEX observations, navigation and SBAS messages.

    Example:  sbas protect --obs a.obs --nav a.nav --messages a.ems --geo 123 --out pa.parquet
    """
    from sbas.positioning import protect  # loaded only where it is used
    from sbas.positioning.protection_levels import K_V
    from sbas.positioning.receiver_noise import CLASS_1, CLASS_2

    refuse_to_overwrite(out, [*obs, *nav, *messages])
    check_mask(elevation)
    with output.progress("positioning", quiet) as callback:
        if callback is not None:
            callback(0, 1)
        recording = protect(
            obs,
            nav,
            messages,
            geo=geo,
            mode=mode,
            profile=profile,
            place_m=place_of(position),
            k_h=k_h,
            k_v=K_V if k_v is None else k_v,
            elevation_mask_deg=elevation,
            smoothing=smoothing,
            noise=CLASS_1 if receiver == "class1" else CLASS_2,
            alarms=mt0,
            causal=causal,
            geo_ranging=geo_ranging,
            hal_m=hal,
            val_m=val,
            track_azimuth_deg=track_azimuth,
            stamp=stamp,
        )
    write_recording(out, [recording])
    level = recording.table["hpl_m"]
    fixes = int(level.notna().sum())
    levels = {
        name: None if not fixes else float(getattr(level, name)())
        for name in ("min", "median", "max")
    }
    answer = {
        "epochs": len(recording),
        "fixes": fixes,
        "hpl_m": levels,
        "modes": recording.table["mode"].value_counts().to_dict(),
        "file": str(out),
        "findings": [finding.to_dict() for finding in recording.meta.findings],
    }
    if json:
        output.print_json(answer)
    else:
        print(f"{len(recording):,} epochs, {fixes:,} fixes")
        if fixes:
            print("HPL min/median/max " + "/".join(f"{v:.3f}" for v in levels.values() if v) + " m")
        output.print_findings(recording.meta.findings)
        print(f"\nrecording  {out}")
    if not fixes:
        raise typer.Exit(2)


@with_option_groups
def raim_files(
    reading: inputs.Reading,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A recording with ranges (sbas protect) or with a receiver's own RAIM (SBF with "
            "RAIMStatistics), in any format of docs/formats.md; or else --obs and --nav.",
            metavar="FILE...",
        ),
    ] = None,
    obs: Annotated[
        list[Path] | None,
        typer.Option("--obs", help="RINEX observations, also compressed; may be repeated."),
    ] = None,
    nav: Annotated[
        list[Path] | None, typer.Option("--nav", help="RINEX navigation; may be repeated.")
    ] = None,
    messages: Annotated[
        list[Path] | None,
        typer.Option(help="SBAS messages; without them ranges are not corrected."),
    ] = None,
    geo: Annotated[int | None, typer.Option(help="PRN of the SBAS satellite.")] = None,
    mode: Annotated[
        Literal["pa", "npa"] | None, typer.Option(help="With messages: which approach, else npa.")
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Known antenna position, earth-fixed, in metres."),
    ] = None,
    systems: Annotated[
        Literal["G", "E", "GE"] | None,
        typer.Option(help="Without messages: GPS (G, the default), Galileo (E), or both."),
    ] = None,
    false_alarm: Annotated[
        float | None, typer.Option(help="Of the overall test, per epoch, else 1e-3.")
    ] = None,
    missed_detection: Annotated[
        float | None, typer.Option(help="Of a fault of the stated size, else 1e-4.")
    ] = None,
    sigma: Annotated[
        str | None,
        typer.Option(
            metavar="A or A,B",
            help="1-sigma of ranges in metres instead of their own: A, or the root of "
            "A^2 + (B / sin elevation)^2.",
        ),
    ] = None,
    elevation: Annotated[
        float | None,
        typer.Option(help="Elevation mask in degrees; with --obs 5 where none is given."),
    ] = None,
    track_azimuth: Annotated[
        float | None, typer.Option(help="Azimuth of a track: levels along and across it.")
    ] = None,
    alert_limit: Annotated[
        float | None,
        typer.Option(help="Of the levels beside the HPL: available below so many metres."),
    ] = None,
    araim: Annotated[
        bool, typer.Option("--araim", help="Levels of ARAIM too, with the priors below.")
    ] = False,
    prior_satellite: Annotated[
        float | None, typer.Option(help="ARAIM: prior of a fault of one satellite, else 1e-5.")
    ] = None,
    prior_constellation: Annotated[
        float | None,
        typer.Option(help="ARAIM: prior of a fault of a whole constellation, else 1e-4."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the recording with its RAIM flags: .parquet.")
    ] = None,
    accept: inputs.Accept = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """What does RAIM say on the same epochs: available, detected, excluded, HERL?

    Example:  sbas raim --obs a.obs --nav a.nav --messages a.ems --geo 123

    Of a recording:  sbas raim roof.sbf --alert-limit 25
    """
    # Loaded only where it is used.
    from sbas.monitoring import raim, with_raim_flags
    from sbas.monitoring.recording_monitor import takes_ranges

    ranges = RangeFiles(obs, nav, messages, geo, mode, position, systems)
    check_mask(elevation)
    refuse_alone(araim, "--araim", prior_satellite=prior_satellite,
                  prior_constellation=prior_constellation)  # fmt: skip
    if out is not None:
        refuse_to_overwrite(out, [*(files or ()), *(obs or ()), *(nav or ()), *(messages or ())])
        if out.suffix.lower() not in PARQUET.extensions:
            raise InputError(
                f"--out {out.name} would lose who made the flags and levels",
                cure="name a .parquet file: only it keeps metadata",
            )
    settings: dict[str, Any] = {
        name: value
        for name, value in (
            ("false_alarm", false_alarm),
            ("missed_detection", missed_detection),
            ("sigma", None if sigma is None else sigma_of(sigma)),
            ("elevation_mask_deg", elevation if files else None),
        )
        if value is not None
    }
    if files:
        ranges.refuse()
        recording = whole_recording(files, reading, accept, settings, quiet)
        if settings and not takes_ranges(recording, settings.get("sigma")):
            raise InputError(
                "settings of levels from ranges change nothing: the recording has its own RAIM",
                where=", ".join(settings),
                cure="leave them out, or give a recording with ranges: sbas protect",
            )
    else:
        if accept or reading != inputs.Reading():
            raise InputError("--accept and options of reading are for a recording FILE")
        with output.progress("positioning", quiet) as callback:
            if callback is not None:
                callback(0, 1)
            recording = ranges.recording(MASK_DEG if elevation is None else elevation)
    result = raim(recording, track_azimuth_deg=track_azimuth, **settings)
    findings = list(dict.fromkeys([*recording.meta.findings, *result.findings]))
    none = result.source == "ranges" and not has_fixes(recording)
    if none and not any(f.code == "E15" for f in findings):
        findings.append(no_fix(recording))
    answer: dict[str, Any] = {
        **result.to_dict(),
        "ranges_corrected_by_sbas": corrected_by_sbas(recording),
        "findings": [finding.to_dict() for finding in findings],
        "file": None if out is None else str(out),
    }
    compared = _against_sbas(recording, settings, alert_limit)
    if compared is not None:
        answer["against_sbas"] = compared.to_dict()
    advanced = None
    if araim:
        advanced = _araim(recording, settings, track_azimuth, prior_satellite, prior_constellation)
        answer["araim"] = advanced.to_dict()
    if out is not None:
        write_recording(out, [with_raim_flags(recording, result)])
    if json:
        output.print_json(answer)
    else:
        print(replace(result, findings=()))
        print(CORRECTED_WORDS[corrected_by_sbas(recording)])
        if compared is not None:
            words = compared if isinstance(compared, Refusal) else compared.statement()
            print(f"\n{words}")
        if advanced is not None:
            print(f"\n{advanced}")
        output.print_findings(findings)
        if out is not None:
            print(f"\nrecording  {out}")
    if none:
        raise typer.Exit(2)


def _against_sbas(
    recording: Recording, settings: dict[str, Any], alert_limit: float | None
) -> LevelComparison | Refusal | None:
    """RAIM beside the HPL where there is one; an alert limit insists on it."""
    from sbas.monitoring import raim_against_sbas

    levels = recording.table.get("hpl_m")
    if alert_limit is None and (levels is None or levels.isna().all()):
        return None
    try:
        return raim_against_sbas(recording, alert_limit_m=alert_limit, **settings)
    except InputError as error:
        if alert_limit is not None:
            raise
        return Refusal(error.what, error.cure)


def _araim(
    recording: Recording,
    settings: dict[str, Any],
    heading_deg: float | None,
    satellite: float | None,
    constellation: float | None,
) -> AraimResult:
    from sbas.monitoring import AraimSettings, araim_of_recording

    priors = {"p_satellite": satellite, "p_constellation": constellation}
    given: dict[str, Any] = {name: p for name, p in priors.items() if p is not None}
    own = {name: settings[name] for name in ("sigma", "elevation_mask_deg") if name in settings}
    return araim_of_recording(
        recording, settings=AraimSettings(**given), heading_deg=heading_deg, **own
    )
