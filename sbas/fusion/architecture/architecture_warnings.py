"""What a sound architecture says that its author may not have meant."""

from __future__ import annotations

from collections.abc import Iterator

from sbas.findings import Finding
from sbas.fusion.architecture.model import (
    Architecture,
    SatelliteReceiver,
    Unmodelled,
)


def warnings_of(architecture: Architecture) -> tuple[Finding, ...]:
    """Findings of an architecture without errors."""
    return (
        *_receivers(architecture),
        *_removals(architecture),
        *_without_effect(architecture),
        *_unmodelled(architecture),
    )


def _warning(message: str, where: str, evidence: str, cure: str) -> Finding:
    return Finding("E28", "warning", message, where=where, evidence=evidence, cure=cure)


def _receivers(architecture: Architecture) -> Iterator[Finding]:
    if not any(isinstance(s, SatelliteReceiver) for s in architecture.sensors):
        yield _warning(
            "no satellite receiver: nothing bounds the errors of dead reckoning",
            "sensors",
            ", ".join(architecture.names),
            'add [[sensors]] with kind = "gnss"; Railways 2014 demands one in every architecture',
        )


def _removals(architecture: Architecture) -> Iterator[Finding]:
    for sensor in architecture.sensors:
        if not isinstance(sensor, Unmodelled) and not sensor.missing.renormalise:
            yield _warning(
                f"without {sensor.name} the weights add up to less than 1: the position is drawn "
                "to the origin, the more the farther the train is",
                f"sensors.{sensor.name}.missing.renormalise",
                "false",
                "renormalise = true, unless Table 1 of Railways 2014 is to be repeated",
            )


def _without_effect(architecture: Architecture) -> Iterator[Finding]:
    detection = architecture.fault_detection
    if architecture.operator == "kalman":
        if architecture.weights == "fixed":
            yield _warning(
                "the Kalman filter takes no weights", "weights", "fixed",
                "leave them out, or operator = \"weighted_mean\"",
            )  # fmt: skip
        if detection != "none":
            yield _warning(
                "the Kalman filter has a fault detection of its own", "fault_detection", detection,
                'fault_detection = "none" and filter.gate = 6.63',
            )  # fmt: skip
    elif detection == "leave_one_out" and len(architecture.sensors) < 3:
        yield _warning(
            "leave-one-out stops at two sensors: it never removes any", "fault_detection",
            f"{len(architecture.sensors)} sensors", 'fault_detection = "none"',
        )  # fmt: skip


def _unmodelled(architecture: Architecture) -> Iterator[Finding]:
    found = [s for s in architecture.sensors if isinstance(s, Unmodelled)]
    if found:
        yield Finding(
            "E28", "info", "sensors without an error model: a description, not to be simulated",
            where=", ".join(f"sensors.{s.name}" for s in found),
            evidence=", ".join(f"{s.name} ({s.kind})" for s in found),
            cure="to simulate, write an architecture of kinds with a model, under another name",
        )  # fmt: skip
