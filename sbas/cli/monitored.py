"""What `sbas raim` monitors: ranges to be positioned first, or a recording; and what it says."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from sbas.cli import inputs
from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.input_check import accept as accepted
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

CORRECTED_WORDS = {
    True: "ranges corrected by SBAS",
    False: "ranges not corrected by SBAS: broadcast orbits, clocks and ionosphere",
    None: "whether SBAS corrected the ranges is not stated",
}


@dataclass(frozen=True)
class RangeFiles:
    """Files and options of positioning, as the verb was given them."""

    obs: list[Path] | None
    nav: list[Path] | None
    messages: list[Path] | None
    geo: int | None
    mode: Literal["pa", "npa"] | None
    position: str | None
    systems: Literal["G", "E", "GE"] | None

    def refuse(self) -> None:
        """Raise InputError where one was given beside a recording."""
        given = [f"--{name}" for name, value in vars(self).items() if value not in (None, [])]
        if given:
            raise InputError(
                "a recording FILE has its fixes: options of positioning are for --obs and --nav",
                where=", ".join(given), cure="give either FILE, or --obs and --nav",
            )  # fmt: skip

    def recording(self, mask_deg: float) -> Recording:
        """Fixes and their ranges, corrected by SBAS where there are messages."""
        from sbas.positioning import protect, unaugmented

        if not self.obs or not self.nav:
            raise InputError(
                "there is nothing to monitor",
                evidence="" if not (self.obs or self.nav) else "only one of --obs and --nav",
                cure="a recording FILE, or RINEX: --obs FILE --nav FILE",
            )
        place = place_of(self.position)
        if not self.messages:
            refuse_alone(False, "--messages", geo=self.geo, mode=self.mode)
            return unaugmented(
                self.obs, self.nav, systems=self.systems or "G", place_m=place,
                elevation_mask_deg=mask_deg,
            )  # fmt: skip
        if self.systems not in (None, "G"):
            raise InputError(
                "SBAS messages correct GPS alone", where=f"--systems {self.systems}",
                cure="leave out --messages, or --systems",
            )  # fmt: skip
        if self.geo is None:
            raise InputError("--messages need the SBAS satellite", cure="--geo PRN")
        return protect(
            self.obs, self.nav, self.messages, geo=self.geo, mode=self.mode or "npa",
            place_m=place, elevation_mask_deg=mask_deg,
        )  # fmt: skip


def whole_recording(
    files: list[Path],
    reading: inputs.Reading,
    accept: list[str] | None,
    settings: dict[str, Any],
    quiet: bool,
) -> Recording:
    """A recording read whole, refused where its findings are errors that nobody accepted."""
    from sbas.monitoring.recording_monitor import takes_ranges

    opened = inputs.open_recording(
        files, inputs.TruthGiven(), reading, inputs.Repairing(), quiet=quiet, whole=True
    )
    recording = opened.source
    assert isinstance(recording, Recording)
    found = accepted(recording.meta.findings, accept or ())
    refuse_on_errors(found)
    if not takes_ranges(recording, settings.get("sigma")) and "herl_m" not in recording.columns:
        # A companion file that was lost is the usual reason, and stands among the findings.
        raise InputError(
            "the recording has neither ranges with their sigmas nor a receiver's own RAIM",
            where=", ".join(map(str, files)),
            evidence="; ".join(
                f"{f.message}: {f.where}" for f in found if f.message.startswith("side table")
            )
            or f"columns {', '.join(recording.columns)}",
            cure="SBF with RAIMStatistics, or ranges: sbas protect makes such a recording; "
            "--sigma for ranges without sigmas",
        )
    return recording.replace(meta=replace(recording.meta, findings=found))


def corrected_by_sbas(recording: Recording) -> bool | None:
    """Whether SBAS corrected the ranges; None where the recording does not say."""
    made = recording.meta.options
    return True if "protect" in made else False if "unaugmented" in made else None


def has_fixes(recording: Recording) -> bool:
    """True where an epoch has a fix with ranges."""
    side = recording.side_tables[SIDE_TABLE]
    return bool((side["used"] & side["time"].isin(recording.table.index)).any())


def no_fix(recording: Recording) -> Finding:
    side = recording.side_tables[SIDE_TABLE]
    why = side["reason"].value_counts() if "reason" in side.columns else pd.Series(dtype=int)
    mostly = f", mostly: {why.index[0]}" if len(why) and why.iloc[0] else ""
    return Finding(
        "E15", "error", f"no epoch has a fix{mostly}",
        evidence=f"{len(recording):,} epochs, {len(side):,} ranges",
        cure="check that navigation and observations are of the same place and time, and that "
        "the mask leaves four satellites or more",
    )  # fmt: skip


def refuse_alone(there: bool, needed: str, **options: object) -> None:
    """Raise InputError for options that do nothing without another one."""
    given = [f"--{name.replace('_', '-')}" for name, v in options.items() if v is not None]
    if given and not there:
        raise InputError(f"{', '.join(given)} do nothing without {needed}", cure=f"add {needed}")


def check_mask(elevation: float | None) -> None:
    if elevation is not None and not 0 <= elevation < 90:
        raise InputError("--elevation is a mask from 0 up to 90 degrees", evidence=f"{elevation:g}")


def sigma_of(text: str) -> float | tuple[float, float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise InputError("--sigma is A or A,B in metres", evidence=repr(text), cure="--sigma 1.5,2")
    return numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])


def place_of(text: str | None) -> tuple[float, float, float] | None:
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
