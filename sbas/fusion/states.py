"""States of a position: N nominal, DA degraded but acceptable, U unacceptable, or no data.

Source: Railways 2014, section 3.1, steps 1 and 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import MOST_SENSORS, Thresholds

N: Final = 0
DA: Final = 1
U: Final = 2
NO_DATA: Final = -1
WORDS: Final = {N: "N", DA: "DA", U: "U", NO_DATA: "no data"}
LETTERS: Final = {"N": N, "D": DA, "U": U, "-": NO_DATA}
"""States in the name of a combination, a letter a sensor."""
_LETTER_OF: Final = {state: letter for letter, state in LETTERS.items()}

DEFAULT_THRESHOLDS: Final = Thresholds()
"""1 m and 2.5 m: train control on a line of high density."""

States = NDArray[np.int8]


# --- from an error to a state -----------------------------------------------------------------


def check_thresholds(thresholds: Thresholds) -> None:
    """Raise InputError unless 0 < nominal < alert limit, and hysteresis and dwell make sense."""
    t = thresholds
    evidence = f"nominal_m = {t.nominal_m!r}, alert_limit_m = {t.alert_limit_m!r}"
    if not 0 < t.nominal_m < t.alert_limit_m < math.inf:
        raise InputError(
            "the bound of the nominal state must lie above 0 m and below a finite alert limit",
            where="thresholds",
            evidence=evidence,
            cure="such as nominal_m = 1.0, alert_limit_m = 2.5",
        )
    if not 0 <= t.hysteresis_m < t.nominal_m:
        raise InputError(
            "the hysteresis must be at least 0 m and less than the bound of the nominal state",
            where="thresholds",
            evidence=f"{evidence}, hysteresis_m = {t.hysteresis_m!r}",
            cure="with a larger one no error would ever be nominal again; 0 switches it off",
        )
    if not 0 <= t.min_dwell_s < math.inf:
        raise InputError(
            "the shortest dwell must be a finite time of at least 0 s",
            where="thresholds",
            evidence=f"min_dwell_s = {t.min_dwell_s!r}",
            cure="0 switches it off",
        )


def states_of(
    error_m: ArrayLike, thresholds: Thresholds = DEFAULT_THRESHOLDS, *, step_s: float | None = None
) -> States:
    """State of each error by its size: N below the nominal bound, U from the alert limit on.

    Parameters
    ----------
    error_m : (t, ...) errors of either sign, time first [m]; NaN where there are no data.
    thresholds : bounds, hysteresis and dwell.
    step_s : time between epochs [s]; needed with a dwell.

    Returns
    -------
    (t, ...) int8 codes. An error on a bound has the worse state, an infinite one is U. A state
    worsens at once. It gets better where the error lies more than the hysteresis below the bound,
    and has done so for the dwell: at every epoch of it, none without data. Epochs without data
    forget nothing: after them the state is no better than before unless it has earned it.

    Raises
    ------
    InputError : thresholds out of order, or a dwell without a positive `step_s`.

    References
    ----------
    Railways 2014, section 3.1, step 1; ties, hysteresis and dwell are choices of this package.
    """
    check_thresholds(thresholds)
    error = np.asarray(error_m, dtype=np.float64)
    size = np.abs(error)
    states = _plain(size, thresholds.nominal_m, thresholds.alert_limit_m)
    if thresholds.hysteresis_m > 0 or thresholds.min_dwell_s > 0:
        relaxed = _plain(
            size,
            thresholds.nominal_m - thresholds.hysteresis_m,
            thresholds.alert_limit_m - thresholds.hysteresis_m,
        )
        _hold(states, relaxed, _epochs_to_improve(thresholds.min_dwell_s, step_s))
    return states


def _plain(size: NDArray[np.float64], nominal_m: float, alert_limit_m: float) -> States:
    states = np.asarray(size >= nominal_m).astype(np.int8)
    states += size >= alert_limit_m
    states[np.isnan(size)] = NO_DATA
    return states


def _epochs_to_improve(dwell_s: float, step_s: float | None) -> int:
    if dwell_s == 0:
        return 1
    if step_s is None or not 0 < step_s < math.inf:
        raise InputError(
            "a dwell needs the time between epochs",
            where="step_s",
            evidence=f"min_dwell_s = {dwell_s:g}, step_s = {step_s!r}",
            cure="states_of(..., step_s=1.0)",
        )
    # A better state first seen at epoch k has lasted (j - k) steps at epoch j.
    return math.ceil(dwell_s / step_s - 1e-9) + 1


def _hold(states: States, relaxed: States, needed: int) -> None:
    """Apply s(t) = max(plain, min(s(t-1), worst relaxed state of the last `needed` epochs))."""
    if states.size == 0 or states.ndim == 0:
        return
    # Views (t, runs), so that one run is no special case.
    flat, eased = (a.reshape(len(a), -1) for a in (states, relaxed))
    before = np.full(flat.shape[1], N, np.int8)
    lasted = {level: np.zeros(flat.shape[1], np.int64) for level in (DA, N)}
    for plain, eased_now in zip(flat, eased, strict=True):
        known = eased_now != NO_DATA
        best = np.full(flat.shape[1], U, np.int8)
        for level, epochs in lasted.items():
            epochs += 1
            epochs[~known | (eased_now > level)] = 0
            best[epochs >= needed] = level
        # Without data plain is -1 and best is U: the state before is kept.
        np.maximum(plain, np.minimum(before, best), out=before)
        plain[:] = np.where(known, before, NO_DATA)


# --- combinations -----------------------------------------------------------------------------


def combination_codes(sensor_state: ArrayLike) -> NDArray[np.int64]:
    """Code of each combination of states, the first sensor's digit to base 3 the highest.

    Parameters
    ----------
    sensor_state : (n, ...) codes of n sensors.

    Returns
    -------
    (...) int64, sum of c_k 3^(n-k); -1 where any sensor has no data.

    Raises
    ------
    InputError : no sensor or more than 39, or a code that is no state.
    """
    state = np.asarray(sensor_state)
    if state.ndim == 0 or not 1 <= len(state) <= MOST_SENSORS:
        raise InputError(
            f"combinations need 1 to {MOST_SENSORS} sensors along the first axis",
            where="sensor_state",
            evidence=f"shape {state.shape}",
        )
    if state.size and not (np.all(state >= NO_DATA) and np.all(state <= U)):
        raise InputError(
            "a code is no state",
            where="sensor_state",
            evidence=f"codes from {state.min()} to {state.max()}",
            cure="0 is N, 1 is DA, 2 is U, -1 is no data",
        )
    codes = np.zeros(state.shape[1:], np.int64)
    for digits in state:
        codes *= 3
        codes += digits
    codes[np.any(state == NO_DATA, axis=0)] = -1
    return codes


def combination_states(codes: ArrayLike, sensors: int) -> States:
    """States of each sensor in combinations: the inverse of `combination_codes`.

    Parameters
    ----------
    codes : (...) codes from -1 to 3^sensors - 1.
    sensors : their number.

    Returns
    -------
    (sensors, ...) int8; all -1 where the code is -1.

    Raises
    ------
    InputError : a number of sensors or a code out of range.
    """
    if not 1 <= sensors <= MOST_SENSORS:
        raise InputError(
            f"combinations need 1 to {MOST_SENSORS} sensors",
            where="sensors",
            evidence=f"{sensors}",
        )
    rest = np.array(codes, dtype=np.int64)
    if rest.size and not (np.all(rest >= -1) and np.all(rest < 3**sensors)):
        raise InputError(
            f"a code is no combination of {sensors} sensors",
            where="codes",
            evidence=f"codes from {rest.min()} to {rest.max()}",
            cure=f"0 to {3**sensors - 1}, or -1 for no data",
        )
    missing = np.asarray(rest < 0)
    states = np.empty((sensors, *rest.shape), np.int8)
    for k in range(sensors - 1, -1, -1):
        rest, digit = np.divmod(rest, 3)
        states[k] = np.where(missing, NO_DATA, digit)
    return states


def combination_name(states: Sequence[int]) -> str:
    """A combination in letters, a letter a sensor, such as "NDU"; see `LETTERS`."""
    return "".join(_LETTER_OF[state] for state in states)


def combination_words(code: int, sensors: int) -> str:
    """A combination as the papers print it, such as "(N, DA, U)"; "no data" for -1."""
    if code == NO_DATA:
        return WORDS[NO_DATA]
    return f"({', '.join(WORDS[int(s)] for s in combination_states(code, sensors))})"


# --- detection, availability and safety -------------------------------------------------------


@dataclass(frozen=True)
class StateShares:
    """Epochs of an output by its true state and by what the system declared.

    Parameters
    ----------
    nominal, degraded, unacceptable : epochs in N, DA and U.
    nominal_usable, degraded_usable, unacceptable_usable : those of them declared usable.
    no_data : epochs without an output, whatever was declared.
    """

    nominal: int
    degraded: int
    unacceptable: int
    nominal_usable: int
    degraded_usable: int
    unacceptable_usable: int
    no_data: int

    @property
    def epochs(self) -> int:
        """All epochs, those without data among them."""
        return self.nominal + self.degraded + self.unacceptable + self.no_data

    @property
    def available(self) -> float:
        """P(N or DA), detected or not; an epoch without data is not available [1]."""
        return (self.nominal + self.degraded) / self.epochs

    @property
    def safe(self) -> float:
        """P(N and declared usable) [1]."""
        return self.nominal_usable / self.epochs

    @property
    def hazard(self) -> float:
        """P(U and declared usable) [1]."""
        return self.unacceptable_usable / self.epochs

    @property
    def false_alarm(self) -> float:
        """P(N or DA, and declared unusable) [1]."""
        good = self.nominal + self.degraded
        return (good - self.nominal_usable - self.degraded_usable) / self.epochs

    def to_dict(self) -> dict[str, Any]:
        """Counts and shares under their names."""
        shown = ("epochs", "available", "safe", "hazard", "false_alarm")
        return vars(self) | {name: getattr(self, name) for name in shown}


def detected(output_state: ArrayLike, declared_usable: ArrayLike) -> NDArray[np.bool_]:
    """Whether the declaration matches the truth: N and DA usable, U unusable.

    Parameters
    ----------
    output_state : (...) codes.
    declared_usable : (...) the system says that its position may be used.

    Returns
    -------
    (...) bool; false without data, where there is no position to be right about.

    Raises
    ------
    InputError : shapes that differ.
    """
    state, usable = _declared(output_state, declared_usable)
    known = state != NO_DATA
    return np.asarray(known & (usable == (state != U)), dtype=np.bool_)


def shares(output_state: ArrayLike, declared_usable: ArrayLike) -> StateShares:
    """Availability, safety, hazard and false alarms of an output.

    Parameters
    ----------
    output_state : (...) codes.
    declared_usable : (...) the system says that its position may be used.

    Raises
    ------
    InputError : no epoch, or shapes that differ.

    References
    ----------
    Railways 2014, section 3.1, step 4: available is N or DA, whether detected or not; safe is N
    and detected. How N is detected it leaves open: here, declared usable.
    """
    state, usable = _declared(output_state, declared_usable)
    if state.size == 0:
        raise InputError("there is no epoch to take a share of", where="output_state")
    nominal, degraded, unacceptable = (state == level for level in (N, DA, U))
    return StateShares(
        nominal=int(np.count_nonzero(nominal)),
        degraded=int(np.count_nonzero(degraded)),
        unacceptable=int(np.count_nonzero(unacceptable)),
        nominal_usable=int(np.count_nonzero(nominal & usable)),
        degraded_usable=int(np.count_nonzero(degraded & usable)),
        unacceptable_usable=int(np.count_nonzero(unacceptable & usable)),
        no_data=int(np.count_nonzero(state == NO_DATA)),
    )


def _declared(
    output_state: ArrayLike, declared_usable: ArrayLike
) -> tuple[States, NDArray[np.bool_]]:
    state, usable = np.asarray(output_state), np.asarray(declared_usable)
    if state.shape != usable.shape or usable.dtype != np.bool_:
        raise InputError(
            "states and declarations do not belong together",
            where="declared_usable",
            evidence=f"shapes {state.shape} and {usable.shape}, of type {usable.dtype}",
            cure="give a bool for each state",
        )
    return state, usable
