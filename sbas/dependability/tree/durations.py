"""How many epochs a duration in seconds is, under each reading of "lasts T"."""

from __future__ import annotations

import math

from sbas.dependability.tree.model import DurationRule
from sbas.exceptions import InputError

_TOLERANCE = 1e-9
"""Of T/step: 0.3 s at steps of 0.1 s is 3 epochs, although the division gives less."""

MOST_EPOCHS = 1e12
"""Beyond them a duration cannot be told from its neighbours within the tolerance."""


def _ratio(seconds: float, step_s: float) -> float:
    if not (math.isfinite(step_s) and step_s > 0.0):
        raise InputError("an epoch must last longer than nothing", where=f"step_s = {step_s!r}")
    if not (math.isfinite(seconds) and seconds >= 0.0):
        raise InputError("a duration must be a finite number, 0 or more", where=f"{seconds!r} s")
    ratio = seconds / step_s
    if not ratio <= MOST_EPOCHS:
        raise InputError(
            "more epochs than can be counted", where=f"{seconds:g} s at step_s = {step_s:g}"
        )
    nearest = float(round(ratio))
    # Beyond 1e6 epochs the rounding of the division itself exceeds the fixed tolerance.
    return nearest if abs(ratio - nearest) <= max(_TOLERANCE, 1e-15 * ratio) else ratio


def duration_epochs(seconds: float, step_s: float, rule: DurationRule) -> int:
    """Length d of the run of true epochs after which DUR_T and causal AND_T are true.

    Parameters
    ----------
    seconds : T [s], 0 or more.
    step_s : epoch [s].
    rule : "age" (time since the first true epoch >= T, as a Petri net delay): ceil(T/step) + 1;
        "count" (T worth of true epochs): ceil(T/step), at least 1; "strict" (time since the
        first true epoch > T): floor(T/step) + 2.

    Raises
    ------
    InputError : T negative, not finite or above 1e12 epochs, step not positive, unknown rule.

    Notes
    -----
    T/step counts as whole within 1e-9. Follows from the definitions: at the r-th epoch of a run
    the time since its first epoch is (r - 1) steps.

    Examples
    --------
    >>> [duration_epochs(60.0, 1.0, rule) for rule in ("age", "count", "strict")]
    [61, 60, 62]
    """
    ratio = _ratio(seconds, step_s)
    if rule == "age":
        return math.ceil(ratio) + 1
    if rule == "count":
        return max(1, math.ceil(ratio))
    if rule == "strict":
        return math.floor(ratio) + 2
    raise InputError(
        f"no duration rule {rule!r}", where="dur_rule", cure='write "age", "count" or "strict"'
    )


def whole_epochs(seconds: float, step_s: float) -> int | None:
    """Number of epochs in a time, None where it is not whole.

    Parameters
    ----------
    seconds, step_s : time and epoch [s].

    Returns
    -------
    seconds/step_s where that is whole within 1e-9, else None.

    Raises
    ------
    InputError : time negative, not finite or above 1e12 epochs, step not positive.
    """
    ratio = _ratio(seconds, step_s)
    return int(ratio) if ratio == math.floor(ratio) else None
