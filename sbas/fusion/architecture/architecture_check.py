"""What makes an architecture sound, and what a sound one may not mean.

Sources: Railways 2014, section 3 (a receiver in every architecture, Eq. 4); the rules of time and
weights are those of docs/methods/multisensor.md.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import fields

from sbas.dependability.tree.model_values import refuse
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.fusion.architecture.architecture_fields import (
    KIND_OF,
    KINDS,
    SMALLEST,
    UNMODELLED_KINDS,
    check_fields,
)
from sbas.fusion.architecture.architecture_times import check_profile, check_times
from sbas.fusion.architecture.architecture_warnings import warnings_of
from sbas.fusion.architecture.model import (
    MOST_SENSORS,
    Accelerometer,
    Architecture,
    InertialUnit,
    Missing,
    Odometer,
    Redundancy,
    SatelliteReceiver,
    Sensor,
    Unmodelled,
)
from sbas.integrity.allocation_tree import nearest

WEIGHT_TOLERANCE = 1e-9
SMALLEST_WEIGHT = 1e-12

_NOISES = {
    Odometer: ("scale_sd", "noise_mps"),
    Accelerometer: ("bias_mps2", "walk_mps2_per_rts", "noise_mps2_per_rthz"),
    InertialUnit: ("bias_mps2", "walk_mps2_per_rts", "noise_mps2_per_rthz"),
    SatelliteReceiver: ("white_m", "correlated_m"),
}
_FAULTS = {Odometer: "slip", SatelliteReceiver: "multipath"}


def check_architecture(architecture: Architecture) -> tuple[Finding, ...]:
    """Raise ModelError unless the architecture can be meant; findings where it may not be.

    Parameters
    ----------
    architecture : with or without sensors that have no error model; `refuse_unmodelled` says
        whether it can be simulated.

    Returns
    -------
    Findings E28: no receiver, weights that do not add up after a removal, settings without
    effect, sensors without model.

    Raises
    ------
    ModelError : `where` is the key path, `cure` what to write.
    """
    if not isinstance(architecture, Architecture):
        raise InputError("no architecture", evidence=f"{architecture!r}"[:300])
    check_fields(architecture)
    _check_names(architecture)
    _check_missing(architecture)
    _check_redundancy(architecture)
    _check_operator(architecture)
    _check_weights(architecture)
    _check_thresholds(architecture)
    check_profile(architecture.profile, architecture.duration_s)
    check_times(architecture)
    return warnings_of(architecture)


def refuse_unmodelled(architecture: Architecture, *, supplied: Collection[str] = ()) -> None:
    """Raise ModelError with the name and kind of each sensor that nothing can be drawn for.

    Parameters
    ----------
    architecture : sound by `check_architecture`.
    supplied : names of sensors whose position errors come from elsewhere; the Kalman filter, which
        takes speeds, has no use for those of an unmodelled one.
    """
    usable = () if architecture.operator == "kalman" else supplied
    found = [s for s in architecture.sensors if isinstance(s, Unmodelled) and s.name not in usable]
    if found:
        raise refuse(
            f"{architecture.name} cannot be simulated: no error model for "
            + ", ".join(s.name for s in found),
            ", ".join(f"sensors.{s.name}.kind" for s in found),
            ", ".join(f"{s.name}: {UNMODELLED_KINDS[s.kind]}" for s in found),
            f"write kinds with a model ({', '.join(KINDS)}), or leave these sensors out; either "
            "way it is another architecture and needs another name",
        )


# --- sensors ----------------------------------------------------------------------------------


def _check_names(architecture: Architecture) -> None:
    if not architecture.sensors:
        raise refuse(
            "an architecture without sensors", "sensors", "none",
            f'write one or more of [[sensors]] with name and kind = "{KIND_OF[SatelliteReceiver]}"',
        )  # fmt: skip
    if len(architecture.sensors) > MOST_SENSORS:
        raise refuse(
            "more sensors than combinations can be counted for", "sensors",
            f"{len(architecture.sensors)} sensors", f"write at most {MOST_SENSORS}",
        )  # fmt: skip
    for i, sensor in enumerate(architecture.sensors):
        if sensor.name in architecture.names[:i]:
            raise refuse(
                "two sensors have the same name", f"sensors[{i}].name", sensor.name,
                f"write another name, such as {sensor.name}2",
            )  # fmt: skip
        where = f"sensors.{sensor.name}"
        for key in ("slip", "multipath", "outage"):
            burst = getattr(sensor, key, None)
            if burst is not None and burst.smallest > burst.largest:
                raise refuse(
                    "the smallest amplitude exceeds the largest", f"{where}.{key}.smallest",
                    f"{burst.smallest:g} > {burst.largest:g}", "exchange them",
                )  # fmt: skip
            if burst is not None and key != "outage" and burst.rate_per_s > 0 >= burst.largest:
                raise refuse(
                    "bursts without an amplitude disturb nothing", f"{where}.{key}.largest",
                    f"{burst.largest:g}", "write smallest and largest, or rate_per_s = 0.0",
                )  # fmt: skip
        if isinstance(sensor, SatelliteReceiver) and sensor.outage.largest > 0:
            raise refuse(
                "an outage has no amplitude", f"{where}.outage.largest",
                f"{sensor.outage.largest:g}", "leave out smallest and largest",
            )  # fmt: skip


def _check_missing(architecture: Architecture) -> None:
    by_name = {s.name: s for s in architecture.sensors}
    follows = {}
    for sensor in architecture.sensors:
        if isinstance(sensor, Unmodelled):
            continue
        missing, where = sensor.missing, f"sensors.{sensor.name}.missing"
        others = [
            s.name
            for s in architecture.sensors
            if s is not sensor and _can_replace(s, sensor, architecture.axes)
        ]
        _check_policy(missing, others, where)
        if not missing.by:
            continue
        if missing.by not in by_name:
            raise refuse(
                "a missing-data policy names an unknown sensor", f"{where}.by", missing.by,
                nearest(missing.by, others),
            )  # fmt: skip
        if missing.by not in (*others, sensor.name):
            axes = "x, y and z" if architecture.axes == 3 else "the track"
            raise refuse(
                f"{missing.by} gives no position along {axes} in place of {sensor.name}",
                f"{where}.by", missing.by,
                f"write one of {', '.join(others)}" if others else 'policy = "remove"',
            )  # fmt: skip
        follows[sensor.name] = missing.by
    for name in follows:
        path = [name]
        while (after := follows.get(path[-1], "")) and after not in path:
            path.append(after)
        if after:
            raise refuse(
                "missing-data policies run in a circle", f"sensors.{name}.missing.by",
                " -> ".join((*path, after)), f'policy = "remove" or "hold" for {path[-1]}',
            )  # fmt: skip


def _check_policy(missing: Missing, others: list[str], where: str) -> None:
    needs_by = missing.policy in ("extrapolate", "substitute")
    if needs_by and not missing.by:
        raise refuse(
            f'"{missing.policy}" needs the sensor that it takes the motion or the value from',
            f"{where}.by", "empty",
            f'by = "{others[0]}"' if others else 'no other gives a position: policy = "remove"',
        )  # fmt: skip
    if missing.by and not needs_by:
        raise refuse(
            f'"{missing.policy}" takes nothing from another sensor', f"{where}.by", missing.by,
            'policy = "extrapolate" or "substitute", or leave out by',
        )  # fmt: skip
    if not missing.renormalise and missing.policy != "remove":
        raise refuse(
            f'"{missing.policy}" leaves the weights as they are', f"{where}.renormalise", "false",
            'policy = "remove", or leave out renormalise',
        )  # fmt: skip


def _can_replace(other: Sensor, sensor: Sensor, axes: int) -> bool:
    """Whether `other` gives a position wherever `sensor` does."""
    if isinstance(other, Unmodelled):
        return False
    return axes == 1 or not in_space(sensor) or in_space(other)


def in_space(sensor: Sensor) -> bool:
    """Whether it measures across the track and in height too."""
    return isinstance(sensor, InertialUnit | SatelliteReceiver)


def _check_redundancy(architecture: Architecture) -> None:
    by_name = {s.name: s for s in architecture.sensors}
    taken: set[str] = set()
    for i, group in enumerate(architecture.redundancy):
        where = f"redundancy[{i}]"
        for name in group.sensors:
            if name not in by_name:
                raise refuse(
                    "a redundancy of an unknown sensor", f"{where}.sensors", name,
                    nearest(name, by_name),
                )  # fmt: skip
            if name in taken:
                raise refuse(
                    "a sensor stands twice in redundancies", f"{where}.sensors", name,
                    "name each sensor once",
                )  # fmt: skip
            taken.add(name)
        _check_group([by_name[name] for name in group.sensors], group, where)


def _check_group(members: list[Sensor], group: Redundancy, where: str) -> None:
    if len(members) < 2:
        raise refuse(
            "a redundancy of fewer than two sensors", f"{where}.sensors", str(group.sensors),
            "name two or more, or leave out the redundancy",
        )  # fmt: skip
    first = members[0]
    for other in members[1:]:
        differ = _differences(first, other)
        if differ:
            raise refuse(
                "a redundancy of unlike sensors", f"{where}.sensors",
                f"{first.name} and {other.name} differ in {', '.join(differ)}",
                "make them alike, or leave out the redundancy",
            )  # fmt: skip
    if group.common_cause == "independent" and group.share > 0:
        raise refuse(
            "independent sensors share no faults", f"{where}.share", f"{group.share:g}",
            'common_cause = "beta_factor", or share = 0.0',
        )  # fmt: skip
    if group.common_cause != "independent" and type(first) not in _FAULTS:
        raise refuse(
            "these sensors have no bursts that a common cause could switch",
            f"{where}.common_cause", f"{first.name}: {type(first).__name__}",
            'common_cause = "independent", share = 0.0',
        )  # fmt: skip


def _differences(one: Sensor, other: Sensor) -> list[str]:
    if type(one) is not type(other):
        return ["kind"]
    own = {"name", "missing", "source"}
    keys = [f.name for f in fields(one) if f.name not in own]
    return [key for key in keys if getattr(one, key) != getattr(other, key)]


# --- fusion -----------------------------------------------------------------------------------


def _check_operator(architecture: Architecture) -> None:
    sensors = architecture.sensors
    if architecture.operator == "per_axis" and not any(in_space(s) for s in sensors):
        raise refuse(
            "no sensor measures y and z", "operator", "per_axis",
            'operator = "weighted_mean", or add a sensor of kind imu or gnss',
        )  # fmt: skip
    # With an unmodelled sensor it is a description, which may well have another filter.
    if architecture.operator != "kalman" or any(isinstance(s, Unmodelled) for s in sensors):
        return
    wanted = (Odometer, Accelerometer, SatelliteReceiver)
    counts = {KIND_OF[cls]: sum(type(s) is cls for s in sensors) for cls in wanted}
    wrong = [f"{n or 'no'} {kind}" for kind, n in counts.items() if n != 1]
    wrong += [f"{s.name} ({KIND_OF[type(s)]})" for s in sensors if type(s) not in wanted]
    if wrong:
        raise refuse(
            "the Kalman filter takes one odometer, one accelerometer and one gnss, nothing else",
            "operator", f"found {', '.join(wrong)}",
            'write just one sensor of each of these kinds, or operator = "weighted_mean"',
        )  # fmt: skip


def _check_weights(architecture: Architecture) -> None:
    weights, names = architecture.fixed_weights, architecture.names
    if architecture.weights != "fixed":
        if weights:
            raise refuse(
                f'fixed weights have no effect with weights = "{architecture.weights}"',
                "fixed_weights", str(weights), 'weights = "fixed", or leave out fixed_weights',
            )  # fmt: skip
    elif len(weights) != len(names):
        equal = ", ".join(f"{1 / len(names):.12g}" for _ in names)
        raise refuse(
            "fixed weights are one for each sensor, in their order", "fixed_weights",
            f"{len(weights)} weights, {len(names)} sensors: {', '.join(names)}",
            f"fixed_weights = [{equal}] for equal ones",
        )  # fmt: skip
    else:
        _check_sum(architecture)
    if architecture.operator == "kalman":
        return
    if architecture.weights != "fixed" or architecture.fault_detection == "leave_one_out":
        for sensor in architecture.sensors:
            _check_noise(sensor, with_faults=architecture.weights == "with_faults")


def _check_sum(architecture: Architecture) -> None:
    weights, total = architecture.fixed_weights, math.fsum(architecture.fixed_weights)
    if total == 0:
        raise refuse("all weights are zero", "fixed_weights", str(weights),
                     "write weights that add up to 1")  # fmt: skip
    if any(0 < weight < SMALLEST_WEIGHT for weight in weights):
        raise refuse(
            "a weight so small is rounding", "fixed_weights", str(list(weights)),
            f"0, or {SMALLEST_WEIGHT:g} and more",
        )  # fmt: skip
    if abs(total - 1) > WEIGHT_TOLERANCE:
        sound = ", ".join(f"{w / total:.12g}" for w in weights)
        raise refuse(
            "the weights do not add up to 1", "fixed_weights", f"{list(weights)}: sum {total:.12g}",
            f"fixed_weights = [{sound}] in the same proportions; nothing is normalised silently",
        )  # fmt: skip
    pairs = zip(architecture.sensors, weights, strict=True)
    if architecture.axes == 3 and not any(w > 0 for s, w in pairs if in_space(s)):
        raise refuse(
            "all weights on y and z are zero", "fixed_weights", str(weights),
            "give weight to a sensor of kind imu or gnss",
        )  # fmt: skip


def _check_noise(sensor: Sensor, *, with_faults: bool) -> None:
    """Weights are inverse variances of errors (Eq. 4): a sensor without any has none."""
    if isinstance(sensor, Unmodelled):
        return
    keys = _NOISES[type(sensor)]
    noisy = any(getattr(sensor, key) >= SMALLEST for key in keys)
    if with_faults and type(sensor) in _FAULTS:
        fault = getattr(sensor, _FAULTS[type(sensor)])
        noisy |= fault.rate_per_s > 0 and fault.largest >= SMALLEST
    if not noisy:
        raise refuse(
            f"{sensor.name} has errors of zero variance: its weight would be infinite",
            f"sensors.{sensor.name}.{keys[0]}",
            ", ".join(f"{key} {getattr(sensor, key):g}" for key in keys),
            f'write {keys[-1]} above 0, or weights = "fixed" and fixed_weights',
        )  # fmt: skip


def _check_thresholds(architecture: Architecture) -> None:
    limits = architecture.thresholds
    if limits.nominal_m >= limits.alert_limit_m:
        raise refuse(
            "the nominal bound is not below the alert limit", "thresholds.nominal_m",
            f"{limits.nominal_m:g} m, alert limit {limits.alert_limit_m:g} m",
            "write nominal_m below alert_limit_m, such as 1.0 and 2.5",
        )  # fmt: skip
    if limits.hysteresis_m >= limits.nominal_m:
        raise refuse(
            "no error is small enough to be nominal again", "thresholds.hysteresis_m",
            f"{limits.hysteresis_m:g} m, nominal below {limits.nominal_m:g} m",
            "write a hysteresis below nominal_m",
        )  # fmt: skip
