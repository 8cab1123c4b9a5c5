"""Architectures in TOML files, those that come with the package, and what people read of one."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from sbas.bundled import bundled
from sbas.dependability.tree.text_files import (
    Readers,
    errors_name,
    found_file,
    read_table,
    toml_text,
    with_suffix,
    write_text,
)
from sbas.fusion.architecture.architecture_check import check_architecture
from sbas.fusion.architecture.architecture_fields import (
    KIND_OF,
    UNMODELLED_KINDS,
    from_table,
    to_table,
)
from sbas.fusion.architecture.model import (
    Architecture,
    Bursts,
    Missing,
    Redundancy,
    Sensor,
    Unmodelled,
)

LARGEST_FILE = 256_000
"""Bytes; a larger file is no architecture that somebody wrote."""

_WHAT = "an architecture"
_READERS: Readers = {".toml": tomllib.loads}


def presets() -> tuple[str, ...]:
    """Names of the architectures that come with the package.

    Examples
    --------
    >>> presets()[2:6]
    ('arch1', 'arch1bis', 'arch1ter', 'arch2')
    """
    return tuple(sorted(p.stem for p in bundled("architectures").glob("*.toml")))


def load_architecture(path: str | Path) -> Architecture:
    """The architecture of a TOML file, or one that comes with the package.

    Parameters
    ----------
    path : .toml file, or a name among `presets()`; keys that are absent take their default.

    Returns
    -------
    Architecture, sound by `check_architecture`, which also gives what its author may not have
    meant.

    Raises
    ------
    InputError : no such file or preset, or a file that is too large.
    ModelError : no TOML, or no sound architecture; `where` is file and key path.

    Examples
    --------
    >>> load_architecture("arch1").names
    ('odo', 'acc', 'gps')
    """
    file = found_file(path, _WHAT, "architectures", _READERS)
    with errors_name(file):
        architecture = from_table(read_table(file, _WHAT, _READERS, largest=LARGEST_FILE))
        check_architecture(architecture)
    return architecture


def dump_architecture(architecture: Architecture, path: str | Path) -> None:
    """Write an architecture to a .toml file, from which `load_architecture` gives an equal one.

    Parameters
    ----------
    architecture : sound by `check_architecture`.
    path : suffix .toml.

    Raises
    ------
    InputError : another suffix, or a place that cannot be written.
    ModelError : the architecture is not sound.
    """
    file = with_suffix(Path(path), _WHAT, _READERS)
    check_architecture(architecture)
    write_text(toml_text(to_table(architecture)), file, _WHAT)


# --- text -------------------------------------------------------------------------------------

_MODELLED = {"imu": "inertial unit", "gnss": "satellite receiver"}
_AMPLITUDES = {
    "slip": ", {:g} to {:g} of the speed",
    "multipath": ", {:g} to {:g} m of either sign",
}
_OPERATORS = {
    "weighted_mean": "weighted mean of positions",
    "kalman": "Kalman filter on position and speed, readjusted by the fixes",
    "per_axis": "weighted mean on each of x, y, z",
}
_WEIGHTS = {
    "fault_free": "inverse variances of fault-free errors",
    "with_faults": "inverse variances of errors with faults",
    "per_epoch": "inverse variances of fault-free errors at each epoch",
    "fixed": "fixed",
}
_AXIS_RULES = {"worst_axis": "largest error of an axis", "norm": "norm of the errors"}


def architecture_text(architecture: Architecture) -> str:
    """Name, sources, sensors with their parameters, fusion, limits, motion, and what is reported.

    Parameters
    ----------
    architecture : sound by `check_architecture`.

    Returns
    -------
    Lines of text; of an architecture with unmodelled sensors only what documents say, since its
    fusion and parameters are but defaults.
    """
    described = any(isinstance(s, Unmodelled) for s in architecture.sensors)
    lines = [architecture.name]
    if architecture.source:
        lines.append(f"  source: {architecture.source}")
    lines.append("sensors, in the order of the combinations")
    for sensor in architecture.sensors:
        lines += _sensor_lines(sensor, described)
    if described:
        lines.append("not to be simulated: sensors without an error model")
        if architecture.operator == "kalman":
            lines.append("fusion: a Kalman filter; its tuning is not known")
    else:
        lines += _fusion_lines(architecture)
    if architecture.reported:
        lines += ["reported", *(f"  - {statement}" for statement in architecture.reported)]
    return "\n".join(lines) + "\n"


def _sensor_lines(sensor: Sensor, described: bool) -> Iterator[str]:
    if isinstance(sensor, Unmodelled):
        kind, words, rest = sensor.kind, UNMODELLED_KINDS[sensor.kind], ", no error model"
    else:
        kind, rest = KIND_OF[type(sensor)], ""
        words = _MODELLED.get(kind, kind)
    yield f"  {sensor.name}: {words}" + ("" if words == kind else f" ({kind})") + rest
    if sensor.source:
        yield f"    source: {sensor.source}"
    if isinstance(sensor, Unmodelled) or described:
        return
    plain = [f.name for f in fields(sensor) if f.name not in ("name", "source", "missing")]
    sizes = [(key, getattr(sensor, key)) for key in plain]
    yield "    " + ", ".join(f"{k} {v:g}" for k, v in sizes if not isinstance(v, Bursts))
    for key, value in sizes:
        if isinstance(value, Bursts):
            yield f"    {key}: {_burst(value, _AMPLITUDES.get(key, ''))}"
    yield f"    without data: {_policy(sensor.missing)}"


def _burst(burst: Bursts, amplitude: str) -> str:
    if burst.rate_per_s == 0:
        return "never"
    times = f"{burst.rate_per_s:g} a second, {burst.mean_duration_s:g} s on average"
    return times + amplitude.format(burst.smallest, burst.largest)


def _policy(missing: Missing) -> str:
    match missing.policy:
        case "extrapolate":
            return f"its last value, extrapolated by the motion of {missing.by}"
        case "substitute":
            return f"the value of {missing.by} in its place"
        case "hold":
            return "its last value is held"
        case "remove":
            rest = "add up to 1 again" if missing.renormalise else "stay as they are"
            return f"removed, the other weights {rest}"


def _fusion_lines(architecture: Architecture) -> Iterator[str]:
    yield f"fusion: {_OPERATORS[architecture.operator]}"
    if architecture.operator == "kalman":
        tuning = architecture.filter
        gate = "none" if tuning.gate is None else f"{tuning.gate:g}"
        plain = ", ".join(
            f"{f.name} {getattr(tuning, f.name):g}" for f in fields(tuning) if f.name != "gate"
        )
        yield f"  {plain}; gate {gate}"
    else:
        given = ", ".join(f"{weight:g}" for weight in architecture.fixed_weights)
        yield f"  weights: {_WEIGHTS[architecture.weights]}" + (f" ({given})" if given else "")
        yield f"  fault detection: {architecture.fault_detection.replace('_', ' ')}"
    if architecture.axes > 1:
        yield f"  state from the {_AXIS_RULES[architecture.axis_rule]}"
    state = {"used": "of the value that is used", "own": "no data"}
    yield f"  state of a sensor without data: {state[architecture.missing_state_of]}"
    for group in architecture.redundancy:
        yield f"  redundancy: {_group(group)}"
    limits = architecture.thresholds
    yield (
        f"states: N below {limits.nominal_m:g} m, U from {limits.alert_limit_m:g} m; "
        f"hysteresis {limits.hysteresis_m:g} m, least dwell {limits.min_dwell_s:g} s"
    )
    phases = ", ".join(
        f"{phase.acceleration_mps2:g} m/s2 to {phase.until_s:g} s"
        for phase in architecture.profile.phases
    )
    yield f"motion: from {architecture.profile.start_speed_mps:g} m/s, {phases}"
    yield (
        f"run: {architecture.duration_s:g} s, fusion each {architecture.step_s:g} s, propagation "
        f"each {architecture.substep_s:g} s"
    )


def _group(group: Redundancy) -> str:
    names = " and ".join(group.sensors)
    match group.common_cause:
        case "independent":
            return f"{names}, faults independent"
        case "per_run":
            return f"{names}, faults switched by one process in {group.share:g} of the runs"
        case "beta_factor":
            return f"{names}, faults common to all at {group.share:g} of their rate"
