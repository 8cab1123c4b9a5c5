"""How likely events are to be true, epoch by epoch of the mission."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.solution import Solution
from sbas.exceptions import InputError
from sbas.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    HALF_HEIGHT,
    HALF_WIDTH,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT)
MOST_CURVES = 7
_LOOKS = tuple(
    zip(
        (BLACK, VERMILION, BLUE, GREEN, ORANGE, PURPLE, SKY),
        ("-", (0, (6, 1.5)), (0, (3, 1)), (0, (1, 1)), (0, (6, 1, 1, 1)), "-", (0, (4, 2))),
        strict=True,
    )
)
_BINS = 600
_UNITS_S = (("s", 1.0, 600.0), ("min", 60.0, 7200.1), ("h", 3600.0, 864e3), ("d", 86400.0, np.inf))
_DECADES = 1e9
"""Curves further below the largest leave the picture; the legend says so."""


def probability_curve(
    solution: Solution,
    names: Sequence[str] | None = None,
    *,
    passages: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Probability of events and gates to be true at each epoch of the mission.

    Parameters
    ----------
    solution : of `sbas.dependability.solve(..., curve=True)`.
    names : rows to draw, 7 at most; None is the top and the cases.
    passages : draw the probability to have been true by then instead.
    ax : axes to draw on; a new figure without them.

    Raises
    ------
    InputError : a name that was not solved, or more than 7.
    """
    model = solution.model
    chosen = (
        list(dict.fromkeys((model.top, *model.cases)))[:MOST_CURVES] if names is None else names
    )
    if unknown := [name for name in chosen if name not in solution.rows]:
        raise InputError("no row of that name in the solution", evidence=", ".join(unknown))
    if len(chosen) > MOST_CURVES:
        raise InputError(f"{len(chosen)} curves in one picture", cure=f"{MOST_CURVES} at most")
    curves = solution.passage_curves if passages else solution.curves
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        unit, seconds = next((u, s) for u, s, limit in _UNITS_S if model.mission_s < limit)
        ax.set_xlabel(f"time in the mission [{unit}]")
        ax.set_ylabel("probability to have been true [1]" if passages else "probability [1]")
        drawn = [name for name in chosen if name in curves]
        if not drawn:
            cure = "first_passage=True and curve=True" if passages else "curve=True"
            sentence(ax, f"solved without curves:\nsolve(..., {cure})")
            return ax
        largest = max(float(curves[name].max()) for name in drawn)
        if largest == 0.0:
            sentence(ax, "all of these have probability 0 throughout")
            return ax
        floor = largest / _DECADES
        seen = np.concatenate([curves[name][curves[name] >= floor] for name in drawn])
        log_axis(ax, "y", float(seen.min()) / 2, min(largest * 3, 2.0))
        ax.set_xlim(0, model.mission_s / seconds)
        for name, (colour, dashes) in zip(drawn, _LOOKS, strict=False):
            curve = curves[name]
            at = _thinned(curve)
            label = name if curve.max() > 0 else f"{name}: 0 throughout"
            if 0 < curve.max() < floor:
                label = f"{name}: below {curve.max():.1e}"
            shown = np.where(curve[at] > 0, curve[at], np.nan)
            ax.plot(at * model.step_s / seconds, shown, color=colour, linestyle=dashes,
                    label=label)  # fmt: skip
        ax.legend(loc="best")
        return ax


def _thinned(curve: NDArray[np.float64]) -> NDArray[np.int64]:
    """Epochs to draw: of each of 600 bins the smallest and the largest, so that no peak is lost."""
    if curve.size <= 2 * _BINS:
        return np.arange(curve.size)
    edges = np.linspace(0, curve.size, _BINS + 1).astype(int)
    bins = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    low = [a + int(np.argmin(curve[a:b])) for a, b in bins]
    high = [a + int(np.argmax(curve[a:b])) for a, b in bins]
    return np.unique([0, *low, *high, curve.size - 1])
