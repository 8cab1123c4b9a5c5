"""Repairs that a user, or `--fix`, asks for: named, counted, noted in the metadata, made once.

A repair that says how the data are to be understood (a time scale, a unit, a sign) is noted in
`meta.options["repairs"]`. Asked for again it changes nothing; asked for with another value it is
an error, since its values count from the data as they were recorded.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, get_args

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import repaired_epochs, repaired_times
from sbas.input_check.coordinates import UNITS_DEG, UNITS_M
from sbas.recording import COLUMNS, PlKind, Recording
from sbas.timescales import TimeScale

KIND_WORDS = (", not those of DO-229", "not of SBAS (DO-229)")
"""What readers say (E23) of levels by their kind."""
NOTE = "repairs"
"""Key of `RecordingMeta.options` under which the repairs made are noted, as JSON."""


@dataclass(frozen=True)
class Repairs:
    """What is to be put right, in the order in which it is done.

    Parameters
    ----------
    unit : true unit by column, where it is not the one in the column's name: `mm`, `cm`, `ft`,
        `km` of a length; `ddmm`, `1e-7 deg`, `1e-6 deg`, `mas`, `arcsec`, `rad` of an angle.
    angles : "rad": latitude and longitude are radians.
    swap_latlon : latitude and longitude stand in each other's columns.
    sign : "lat", "lon" or "both": that one has the wrong sign throughout, after `swap_latlon`.
    height_offset_m : added to every height: a geoid undulation, an antenna height [m].
    time : scale that the stamps are in, though they were taken for GPS time.
    week_rollover : weeks added to every time, such as 1024.
    unwrap : "day" or "week": the date was not advanced where time falls back by one.
    leap_slip : "fix": before a step of whole seconds that the position does not make (E11),
        times are moved so that it becomes one interval; the stamps behind the step stand.
        "fix-after": those before it stand.
    shift_s : added to every time [s].
    sort : put epochs in the order of their times (stable).
    duplicates : of successive epochs with the same time keep the first or the last.
    pl_zero : "missing": protection levels <= 0 become missing.
    pl_sentinel : protection levels of this value stand for "none" and become missing [m].
    pl_frozen : "missing": protection levels that stand still while the geometry changes (E13).
    pl_kind : kind of the protection levels, by the receiver's documentation.

    Raises
    ------
    InputError : a value that its repair does not know.
    """

    unit: Mapping[str, str] = field(default_factory=dict)
    angles: Literal["rad"] | None = None
    swap_latlon: bool = False
    sign: Literal["lat", "lon", "both"] | None = None
    height_offset_m: float | None = None
    time: TimeScale | None = None
    week_rollover: int | None = None
    unwrap: Literal["day", "week"] | None = None
    leap_slip: Literal["fix", "fix-after"] | None = None
    shift_s: float | None = None
    sort: bool = False
    duplicates: Literal["first", "last"] | None = None
    pl_zero: Literal["missing"] | None = None
    pl_sentinel: float | None = None
    pl_frozen: Literal["missing"] | None = None
    pl_kind: PlKind | None = None

    def __post_init__(self) -> None:
        for name, allowed in _ALLOWED.items():
            value = getattr(self, name)
            if value is not None and value not in allowed:
                option = option_of(name)
                raise InputError(
                    f"{option} cannot be {value!r}",
                    cure=" or ".join(f"{option} {a}" for a in allowed),
                )
        for column, unit in self.unit.items():
            known = _units_of(column)
            if unit not in known:
                raise InputError(
                    f"--unit {column}={unit} is not known",
                    cure=f"--unit {column}=UNIT with one of {', '.join(known)}"
                    if known else "name a column in degrees or metres",
                )  # fmt: skip
        for name in ("height_offset_m", "shift_s", "pl_sentinel"):
            value = getattr(self, name)
            if value is not None and not abs(value) < 1e9:
                raise InputError(f"{option_of(name)} cannot be {value}")

    def named(self) -> dict[str, Any]:
        """The repairs asked for, by name; plain values."""
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        found["unit"] = dict(self.unit)
        return {name: value for name, value in found.items() if value not in (None, False, {})}

    @property
    def options(self) -> str:
        """The same as options of a command line."""
        words = []
        for name, value in self.named().items():
            if name == "unit":
                words += [f'--unit "{column}={unit}"' for column, unit in value.items()]
            else:
                shown = f"{value:.15g}" if isinstance(value, float) else value
                words.append(option_of(name) + ("" if value is True else f" {shown}"))
        return " ".join(words)


_ALLOWED: dict[str, tuple[Any, ...]] = {
    "angles": ("rad",),
    "sign": ("lat", "lon", "both"),
    "time": get_args(TimeScale),
    "unwrap": ("day", "week"),
    "leap_slip": ("fix", "fix-after"),
    "duplicates": ("first", "last"),
    "pl_zero": ("missing",),
    "pl_frozen": ("missing",),
    "pl_kind": get_args(PlKind),
}


def option_of(name: str) -> str:
    """The option of a command line that asks for a repair."""
    return "--" + name.removesuffix("_m").replace("_", "-")


def _units_of(column: str) -> tuple[str, ...]:
    match COLUMNS[column].unit if column in COLUMNS else "":
        case "deg":
            return ("ddmm", *UNITS_DEG, "rad")
        case "m":
            return tuple(UNITS_M)
        case _:
            return ()


def repair(recording: Recording, repairs: Repairs | None = None, **named: Any) -> Recording:
    """The recording with the named repairs made; each is counted in a finding E26.

    Parameters
    ----------
    recording : left as it is.
    repairs : what to put right.
    named : fields of `Repairs`, in place of or beside `repairs`: `repair(r, sort=True)`.

    Returns
    -------
    Recording with the same side tables, their times repaired alike; `meta.options["repairs"]`
    notes what was made.

    Raises
    ------
    InputError : a repair that does not exist, or that contradicts one made before.
    """
    known = [f.name for f in fields(Repairs)]
    if unknown := set(named) - set(known):
        raise InputError(
            f"there is no repair {sorted(unknown)[0]!r}", cure=f"known are {', '.join(known)}"
        )
    asked = replace(repairs or Repairs(), **named).named()
    made: dict[str, Any] = json.loads(recording.meta.options.get(NOTE, "{}"))
    for name, step in _STEPS.items():
        if name not in asked:
            continue
        value = asked[name]
        if name in _ONCE:
            value = _not_made_yet(name, value, made)
            if not value:
                continue
        changed, remarks = step(recording, value)
        if not remarks:
            continue
        recording = changed.with_findings(*remarks)
        made[name] = {**made.get(name, {}), **value} if name == "unit" else value
    if not made:
        return recording
    options = {**recording.meta.options, NOTE: json.dumps(made, sort_keys=True)}
    return recording.replace(meta=replace(recording.meta, options=options))


def _not_made_yet(name: str, value: Any, made: Mapping[str, Any]) -> Any:
    """What of a repair is still to do; an error where another value was used before."""
    if name not in made:
        return value
    before = made[name]
    if name == "unit":
        again = {c: u for c, u in value.items() if before.get(c, u) != u}
        rest = {c: u for c, u in value.items() if c not in before}
    else:
        again, rest = ({} if before == value else {name: value}), None
    if again:
        raise InputError(
            f"{option_of(name)} was used on this recording before",
            evidence=f"then {before}, now {value}",
            cure="repair the recording as it was recorded, with all repairs at once",
        )
    return rest


def _set_kind(recording: Recording, kind: PlKind) -> tuple[Recording, list[Finding]]:
    before = recording.meta.pl.kind
    if before == kind:
        return recording, []
    pl = replace(recording.meta.pl, kind=kind)
    # What the reader said of the levels by their kind would contradict what is now said of them.
    kept = tuple(
        f
        for f in recording.meta.findings
        if f.code != "E23" or not any(words in f.message for words in KIND_WORDS)
    )
    meta = replace(recording.meta, pl=pl, findings=kept)
    text = f"protection levels taken as {kind!r}, before as {before!r} (--pl-kind)"
    return recording.replace(meta=meta), [Finding("E26", "info", text)]


_Step = Callable[[Recording, Any], tuple[Recording, list[Finding]]]

_STEPS: dict[str, _Step] = {
    "unit": repaired_epochs.in_units,
    "angles": repaired_epochs.from_radians,
    "swap_latlon": repaired_epochs.swapped,
    "sign": repaired_epochs.with_sign,
    "height_offset_m": repaired_epochs.raised,
    "time": repaired_times.from_scale,
    "week_rollover": repaired_times.weeks_later,
    "unwrap": repaired_times.unwrapped,
    "leap_slip": repaired_times.without_leap_steps,
    "shift_s": repaired_times.shifted,
    "sort": repaired_times.sorted_epochs,
    "duplicates": repaired_epochs.without_repeated,
    "pl_zero": repaired_epochs.without_zero_levels,
    "pl_sentinel": repaired_epochs.without_stand_ins,
    "pl_frozen": repaired_epochs.without_frozen_levels,
    "pl_kind": _set_kind,
}

_ONCE = frozenset(
    ("unit", "angles", "swap_latlon", "sign", "height_offset_m", "time", "week_rollover", "shift_s")
)
"""Repairs that would be made twice if asked for twice; the others find nothing left to do."""
