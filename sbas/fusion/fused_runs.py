"""Simulated or replayed runs: what each sensor was worth, and what the fusion made of it.

Arrays run over time first, then over runs: recursions in time work on vectors of runs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
States = NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class SensorRuns:
    """One sensor over a batch of runs.

    Parameters
    ----------
    error_m : (a, t, r) signed position error at the epochs on each axis that the architecture
        fuses [m]; NaN where the sensor gives no data, and on axes that it does not measure.
    measures : (a,) axes that it measures.
    speed_error_mps : (t * substeps, r) error of its speed at every sub-step [m/s], of odometers.
    acceleration_error_mps2 : (t * substeps, r) likewise [m/s2], of accelerometers (axis x).
    """

    error_m: Floats
    measures: tuple[bool, ...]
    speed_error_mps: Floats | None = None
    acceleration_error_mps2: Floats | None = None


@dataclass(frozen=True, eq=False)
class FusedRuns:
    """States of sensors and output over all runs.

    Parameters
    ----------
    names : (n,) sensors.
    step_s : between epochs [s].
    sensor_state : (n, t, r) codes of `sbas.fusion.states`, -1 for no data.
    output_state : (t, r) codes of the fused position.
    output_error_m : (t, r) signed error of the fused position [m], of the worst axis, or its norm;
        NaN without data.
    declared_usable : (t, r) the system says that its position may be used.
    weights : (a, n) of the sensors in the mean on each axis, or (a, t, n) by epoch [1]; empty
        with a Kalman filter.
    """

    names: tuple[str, ...]
    step_s: float
    sensor_state: States
    output_state: States
    output_error_m: Floats
    declared_usable: Bools
    weights: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def runs(self) -> int:
        return int(self.output_state.shape[1])

    @property
    def epochs(self) -> int:
        return int(self.output_state.shape[0])
