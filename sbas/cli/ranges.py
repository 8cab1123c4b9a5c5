"""Verbs on ranges: protect and raim."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from sbas.cli import output
from sbas.cli.inputs import refuse_to_overwrite
from sbas.cli.writing import write_recording
from sbas.exceptions import InputError

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
    elevation: Annotated[float, typer.Option(help="Elevation mask in degrees.")] = 5.0,
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
            place_m=_place(position),
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


def raim_files(
    obs: Observations,
    nav: NavigationFiles,
    messages: Annotated[
        list[Path] | None,
        typer.Option(help="SBAS messages; without them ranges are not corrected."),
    ] = None,
    geo: Annotated[int | None, typer.Option(help="PRN of the SBAS satellite.")] = None,
    mode: Annotated[
        Literal["pa", "npa"], typer.Option(help="With messages: which approach.")
    ] = "npa",
    position: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Known antenna position, earth-fixed, in metres."),
    ] = None,
    false_alarm: Annotated[float, typer.Option(help="Of the overall test, per epoch.")] = 1e-3,
    missed_detection: Annotated[float, typer.Option(help="Of a fault of the stated size.")] = 1e-4,
    elevation: Annotated[float, typer.Option(help="Elevation mask in degrees.")] = 5.0,
    track_azimuth: Annotated[
        float | None, typer.Option(help="Azimuth of a track: levels along and across it.")
    ] = None,
    araim: Annotated[
        bool, typer.Option("--araim", help="Levels of ARAIM too, with the priors below.")
    ] = False,
    prior_satellite: Annotated[
        float, typer.Option(help="ARAIM: prior of a fault of one satellite.")
    ] = 1e-5,
    prior_constellation: Annotated[
        float, typer.Option(help="ARAIM: prior of a fault of a whole constellation.")
    ] = 1e-4,
    out: Annotated[
        Path | None, typer.Option(help="Write the recording with its RAIM flags: .parquet.")
    ] = None,
    json: output.Json = False,
    quiet: output.Quiet = False,
) -> None:
    """What does RAIM say on the same epochs: available, detected, excluded, HERL?

    Example:  sbas raim --obs a.obs --nav a.nav --messages a.ems --geo 123
    """
    from sbas.monitoring import (  # loaded only where it is used
        AraimSettings,
        araim_of_recording,
        raim,
        with_raim_flags,
    )
    from sbas.positioning import protect, unaugmented

    inputs = [*obs, *nav, *(messages or ())]
    if out is not None:
        refuse_to_overwrite(out, inputs)
    with output.progress("positioning", quiet) as callback:
        if callback is not None:
            callback(0, 1)
        place = _place(position)
        if messages:
            if geo is None:
                raise InputError("--messages need the SBAS satellite", cure="--geo PRN")
            recording = protect(
                obs, nav, messages, geo=geo, mode=mode, place_m=place, elevation_mask_deg=elevation
            )
        else:
            recording = unaugmented(obs, nav, place_m=place, elevation_mask_deg=elevation)
        result = raim(
            recording,
            false_alarm=false_alarm,
            missed_detection=missed_detection,
            track_azimuth_deg=track_azimuth,
        )
        advanced = None
        if araim:
            settings = AraimSettings(
                p_satellite=prior_satellite, p_constellation=prior_constellation
            )
            advanced = araim_of_recording(recording, settings=settings, heading_deg=track_azimuth)
    if out is not None:
        write_recording(out, [with_raim_flags(recording, result)])
    if json:
        answer = {**result.to_dict(), "file": None if out is None else str(out)}
        if advanced is not None:
            answer["araim"] = advanced.to_dict()
        output.print_json(answer)
    else:
        print(result)
        if advanced is not None:
            print(advanced)


def _place(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not 6.3e6 < math.hypot(x, y, z) < 6.5e6:
        raise InputError(
            "--position is no place on Earth",
            evidence=repr(text),
            cure="--position X,Y,Z, earth-fixed, in metres",
        )
    return x, y, z
