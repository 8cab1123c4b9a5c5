"""Sound architectures of all kinds, drawn by hypothesis."""

from __future__ import annotations

from typing import Any, get_args

from hypothesis import strategies as st

from sbas.fusion.architecture.architecture_fields import UNMODELLED_KINDS
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    AxisRule,
    Bursts,
    FaultDetection,
    FilterTuning,
    InertialUnit,
    Missing,
    Odometer,
    Phase,
    Redundancy,
    SatelliteReceiver,
    Sensor,
    SpeedProfile,
    StateOf,
    Thresholds,
    Unmodelled,
)

_PRINTABLE = st.characters(exclude_categories=("C", "Z"))
NAMES = st.text(_PRINTABLE, min_size=1, max_size=8)
TEXTS = st.text(_PRINTABLE | st.just(" "), max_size=20)
SIZES = st.floats(1e-6, 1e3)
SHARES = st.floats(0.0, 1.0)


@st.composite
def bursts(draw: st.DrawFn, *, largest: float = 10.0) -> Bursts:
    low, high = sorted((draw(st.floats(0.0, largest)), draw(st.floats(0.0, largest))))
    rate = draw(st.floats(0.0, 10.0)) if high > 0 or largest == 0 else 0.0
    return Bursts(rate, draw(SIZES), low, high)


@st.composite
def missing(draw: st.DrawFn, before: list[str]) -> Missing:
    """A policy that takes from sensors before it alone: it runs in no circle."""
    policies = ["remove", "hold"] + (["extrapolate", "substitute"] if before else [])
    policy: Any = draw(st.sampled_from(policies))
    if policy in ("extrapolate", "substitute"):
        return Missing(policy, draw(st.sampled_from(before)))
    return Missing(policy, renormalise=policy == "hold" or draw(st.booleans()))


@st.composite
def _sensor(draw: st.DrawFn, name: str, before: list[str], step_s: float) -> Sensor:
    common: dict[str, Any] = {
        "name": name, "source": draw(TEXTS), "failure_rate_per_h": draw(SHARES),
        "missing": draw(missing(before)),
    }  # fmt: skip
    match draw(st.sampled_from((Odometer, Accelerometer, InertialUnit, SatelliteReceiver))):
        case cls if cls is Odometer:
            return Odometer(
                **common, scale_sd=draw(SIZES), noise_mps=draw(SIZES), slip=draw(bursts())
            )
        case cls if cls is SatelliteReceiver:
            return SatelliteReceiver(
                **common, interval_s=step_s * draw(st.integers(1, 5)), white_m=draw(SIZES),
                correlated_m=draw(SIZES), tau_s=draw(SIZES), multipath=draw(bursts()),
                outage=draw(bursts(largest=0.0)),
            )  # fmt: skip
        case cls:
            return cls(
                **common, bias_mps2=draw(SIZES), walk_mps2_per_rts=draw(SIZES),
                noise_mps2_per_rthz=draw(SIZES),
            )  # fmt: skip


@st.composite
def architectures(draw: st.DrawFn) -> Architecture:
    """Weighted means and filters, with redundancy, fixed weights and unmodelled sensors."""
    step_s = 1 / draw(st.integers(1, 10))
    names = draw(st.lists(NAMES, min_size=2, max_size=5, unique=True))
    kalman = draw(st.booleans())
    sensors: list[Sensor] = []
    if kalman:
        names = [*names, "third of a filter"][:3]
        sensors = [
            Odometer(names[0]),
            Accelerometer(names[1]),
            SatelliteReceiver(
                names[2], interval_s=step_s, missing=Missing("extrapolate", names[0])
            ),
        ]
    else:
        for i, name in enumerate(names):
            sensors.append(draw(_sensor(name, names[:i], step_s)))
    described = draw(st.booleans())
    if described:
        kind = draw(st.sampled_from(sorted(UNMODELLED_KINDS)))
        sensors.append(Unmodelled("no model of it", kind, draw(TEXTS)))
    twins = ("twin of two", "other twin")
    redundancy: tuple[Redundancy, ...] = ()
    if not kalman and draw(st.booleans()):
        sensors += [Odometer(name) for name in twins]
        cause: Any = draw(st.sampled_from(("independent", "per_run", "beta_factor")))
        share = 0.0 if cause == "independent" else draw(SHARES)
        redundancy = (Redundancy(twins, cause, share),)
    fixed = draw(st.booleans())
    parts = [draw(st.integers(0, 9)) + 1 for _ in sensors]
    limit = draw(st.floats(0.1, 100.0))
    nominal = limit * draw(st.floats(0.1, 0.9))
    ends = draw(st.lists(st.integers(1, 1000), min_size=1, max_size=4, unique=True))
    return Architecture(
        name=draw(NAMES),
        sensors=tuple(sensors),
        operator="kalman" if kalman else "weighted_mean",
        weights="fixed" if fixed else draw(st.sampled_from(("fault_free", "per_epoch"))),
        fixed_weights=tuple(part / sum(parts) for part in parts) if fixed else (),
        redundancy=redundancy,
        axis_rule=draw(st.sampled_from(get_args(AxisRule))),
        fault_detection=draw(st.sampled_from(get_args(FaultDetection))),
        missing_state_of=draw(st.sampled_from(get_args(StateOf))),
        filter=FilterTuning(
            *(draw(SIZES) for _ in range(5)), gate=draw(st.none() | st.floats(0.1, 30.0))
        ),
        thresholds=Thresholds(nominal, limit, nominal * draw(st.floats(0.0, 0.9)), draw(SIZES)),
        profile=SpeedProfile(
            tuple(Phase(float(end), draw(st.floats(0.0, 2.0))) for end in sorted(ends)),
            draw(st.floats(0.0, 80.0)),
        ),
        duration_s=step_s * draw(st.integers(1, 1000)),
        step_s=step_s,
        substep_s=step_s / draw(st.integers(1, 10)),
        source=draw(TEXTS),
        reported=tuple(draw(st.lists(TEXTS, max_size=3))),
    )
