"""Stretches of time in which a combination of sensor states lasts, and how each one ends.

An episode is a maximal stretch of one combination in one run. What may happen to it first: the
output reaches the target state, the combination is left, or the record ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.fused_runs import States
from sbas.fusion.states import DA, NO_DATA, N, U

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Target = Literal["U", "DA"]

ENDED: Final = 0
"""The record ended first: what would have come is unknown."""
REACHED: Final = 1
"""The output reached the target state while the combination lasted."""
LEFT: Final = 2
"""The combination was left first, or the output fell silent."""
NOT_AT_RISK: Final = -1
"""The output was in the target state, or silent, on entry; or the entry was not seen."""

MAX_SENSORS: Final = 31
"""Base-4 keys of more sensors do not fit into 64 bits."""
OUTPUTS: Final = (N, DA, U, NO_DATA)
_LEVELS: Final = {"U": U, "DA": DA}


@dataclass(frozen=True, eq=False)
class Episodes:
    """All episodes of all runs, by run and then by time; e episodes.

    Parameters
    ----------
    sensors : number of sensors.
    runs, epochs : size of the record they come from.
    step_s : between epochs [s].
    target : "U": the output gets unacceptable; "DA": it gets degraded or worse.
    key : (e,) combination; see `combination_keys`.
    run : (e,) index of the run.
    entry_epoch : (e,) index of the first epoch.
    length : (e,) epochs.
    entry_state : (e,) state of the output at the first epoch.
    output_epochs : (4, e) epochs with the output N, DA, U and silent.
    unseen_entry : (e,) the record began within the episode; it counts in the epochs alone.
    outcome : (e,) REACHED, LEFT or ENDED of episodes at risk, else NOT_AT_RISK.
    steps : (e,) steps from the entry to the outcome; where the record ended, to the last epoch
        seen; 0 where not at risk.
    """

    sensors: int
    runs: int
    epochs: int
    step_s: float
    target: Target
    key: Ints
    run: Ints
    entry_epoch: Ints
    length: Ints
    entry_state: States
    output_epochs: Ints
    unseen_entry: Bools
    outcome: States
    steps: Ints

    @property
    def counted(self) -> Bools:
        """(e,) episodes whose entry was seen, with an output at it."""
        counted: Bools = ~self.unseen_entry & (self.entry_state != NO_DATA)
        return counted

    @property
    def there_at_entry(self) -> Bools:
        """(e,) counted episodes whose output was in the target state from the first epoch on."""
        return self.counted & (self.entry_state >= _LEVELS[self.target])

    @property
    def at_risk(self) -> Bools:
        """(e,) counted episodes whose output had not reached the target state on entry."""
        there: Bools = self.outcome != NOT_AT_RISK
        return there


# --- combinations as numbers ------------------------------------------------------------------


def combination_keys(sensor_state: States) -> NDArray[Any]:
    """A number for each combination of states, silent sensors included.

    Parameters
    ----------
    sensor_state : (n, ...) codes of `sbas.fusion.states`.

    Returns
    -------
    (...) keys, the smallest unsigned type that holds them: sum of (c_k + 1) 4^(n-k), the first
    sensor in the highest place.

    Raises
    ------
    InputError : no sensor, or more than 31.

    Notes
    -----
    A silent sensor needs a fourth digit: as one of N, DA and U it would be counted for a state
    that nobody saw. Digits are 0 no data, 1 N, 2 DA, 3 U.
    """
    n = len(sensor_state)
    if not 1 <= n <= MAX_SENSORS:
        raise InputError(
            f"combinations of {n} sensors", where="sensor_state", cure=f"1 to {MAX_SENSORS}"
        )
    keys = np.zeros(sensor_state.shape[1:], np.min_scalar_type(4**n - 1))
    for states in sensor_state:
        keys *= 4
        keys += (states + 1).astype(np.uint8)
    return keys


def states_of_key(key: int, sensors: int) -> tuple[int, ...]:
    """(n,) codes of the sensors' states in a combination, the first sensor first."""
    return tuple((key >> 2 * place & 3) - 1 for place in range(sensors - 1, -1, -1))


# --- episodes ---------------------------------------------------------------------------------


def extract_episodes(
    sensor_state: States,
    output_state: States,
    *,
    step_s: float,
    target: Target = "U",
    starts_fresh: bool = True,
) -> Episodes:
    """Cut all runs into episodes, and say how each one ends.

    Parameters
    ----------
    sensor_state : (n, t, r) codes of `sbas.fusion.states` of n sensors at t epochs in r runs.
    output_state : (t, r) codes of the fused position.
    step_s : between epochs [s].
    target : state of the output whose reaching counts: "U", or "DA" for DA and worse.
    starts_fresh : the runs begin with the motion, as simulated ones do. False where a record
        begins within something: the entry of its first episode was not seen, so that its age is
        unknown (left truncation) and it counts in the epochs alone.

    Returns
    -------
    Episodes.

    Raises
    ------
    InputError : shapes that do not match, unknown codes, a step of 0 or less, unknown target.

    Notes
    -----
    A sensor that falls silent or comes back begins another combination. An output that falls
    silent while the combination lasts ends the episode; the silent stretch is one of its own.
    Where the record ends, the last epoch seen is the last at which something is known: an
    episode of L epochs is observed for L - 1 steps, and leaves the risk set after them.

    References
    ----------
    Railways 2014, section 3.1, step 5; censoring and left truncation: J. P. Klein,
    M. L. Moeschberger, Survival Analysis, 2nd ed. 2003, sections 3.2 and 3.4.
    """
    _check(sensor_state, output_state, step_s, target)
    n, t, r = sensor_state.shape
    # Run after run in memory: an episode is then a slice.
    output = np.ascontiguousarray(output_state.T)
    keys = np.ascontiguousarray(combination_keys(sensor_state).T)
    begins = np.ones((r, t), bool)
    begins[:, 1:] = keys[:, 1:] != keys[:, :-1]
    silent = output == NO_DATA
    begins[:, 1:] |= silent[:, 1:] != silent[:, :-1]
    first = np.flatnonzero(begins)
    length = np.diff(first, append=r * t)
    run, entry_epoch = np.divmod(first, t)
    flat = output.ravel()
    entry_state = flat[first]
    unseen_entry = (
        np.zeros(first.size, bool) if starts_fresh else np.asarray(entry_epoch == 0, bool)
    )

    reached_at = np.flatnonzero(flat >= _LEVELS[target])
    later = np.searchsorted(reached_at, first, side="right")
    next_reached = np.append(reached_at, r * t)[later]
    reached = next_reached < first + length
    ended = entry_epoch + length == t
    outcome = np.where(reached, REACHED, np.where(ended, ENDED, LEFT)).astype(np.int8)
    steps = np.where(reached, next_reached - first, np.where(ended, length - 1, length))
    idle = unseen_entry | (entry_state == NO_DATA) | (entry_state >= _LEVELS[target])
    outcome[idle], steps[idle] = NOT_AT_RISK, 0
    return Episodes(
        sensors=n, runs=r, epochs=t, step_s=step_s, target=target,
        key=keys.ravel()[first].astype(np.int64), run=run, entry_epoch=entry_epoch, length=length,
        entry_state=entry_state,
        output_epochs=np.stack([_sums(flat == state, first) for state in OUTPUTS]),
        unseen_entry=unseen_entry, outcome=outcome, steps=steps,
    )  # fmt: skip


def _sums(mask: Bools, first: Ints) -> Ints:
    """Sum of a mask over each of the slices that begin at `first`."""
    return np.add.reduceat(mask, first, dtype=np.int64) if first.size else first


def _check(sensor_state: States, output_state: States, step_s: float, target: str) -> None:
    if sensor_state.ndim != 3 or sensor_state.shape[1:] != output_state.shape:
        raise InputError(
            "states of sensors and output that do not belong together",
            where="sensor_state (n, t, r), output_state (t, r)",
            evidence=f"shapes {sensor_state.shape} and {output_state.shape}",
        )
    if not output_state.size:
        raise InputError("no epoch", where="output_state", evidence=f"{output_state.shape}")
    for name, states in (("sensor_state", sensor_state), ("output_state", output_state)):
        if states.dtype != np.int8 or states.min() < NO_DATA or states.max() > U:
            raise InputError(
                "codes that are no states",
                where=name,
                evidence=f"{states.dtype} from {states.min()} to {states.max()}",
                cure="int8: 0 for N, 1 for DA, 2 for U, -1 for no data",
            )
    if not (np.isfinite(step_s) and step_s > 0):
        raise InputError("a step is above 0 s", where="step_s", evidence=f"{step_s}")
    if target not in _LEVELS:
        raise InputError(f"no target {target!r}", where="target", cure="one of U, DA")
