"""How long errors stay correlated: autocorrelation, fitted processes, the 360 s mark."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.estimate import Estimate
from sbas.integrity.correlation.decorrelation_results import ASSUMED_TAU_S, Curve, Decorrelation
from sbas.integrity.correlation.two_processes import seconds_text
from sbas.plots.style import (
    BLUE,
    GREEN,
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT)
POINTS = 600
"""Lags drawn of a curve: more than a half page can show."""


def decorrelation_curve(decorrelation: Decorrelation, *, ax: Axes | None = None) -> Axes:
    """Autocorrelation of the errors with its sampling band, the fitted processes, and 360 s.

    Parameters
    ----------
    decorrelation : result of `sbas.decorrelation`.
    ax : axes to draw on; a new figure without them. The shaded stretch on the level 1/e is the
        interval of the decorrelation time.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("lag [s]")
        ax.set_ylabel("autocorrelation of the errors [1]")
        curve = decorrelation.curve
        if curve is None:
            sentence(ax, "no autocorrelation:\n" + _wrapped(str(decorrelation.tau_s)))
            return ax
        last = _last_lag(curve, decorrelation)
        shown = np.unique(np.linspace(0, last, POINTS).astype(int))
        lag = curve.lag_s[shown]
        ax.set_xlim(0.0, max(float(lag[-1]), 1.2 * ASSUMED_TAU_S))
        ax.set_ylim(-0.3, 1.05)
        ax.axhline(0.0, color=MUTED, linewidth=0.6)
        for component, name, colour in zip(
            curve.components, ("east", "north"), (SKY, PURPLE), strict=False
        ):
            ax.plot(lag, component[shown], color=colour, linewidth=0.7, label=name)
        ax.plot(lag, curve.r[shown], color=BLUE, label="mean of both")
        _draw_process(ax, decorrelation, curve, shown)
        ax.axvline(ASSUMED_TAU_S, color=VERMILION, linewidth=0.9, linestyle=(0, (4, 2)))
        _draw_interval(ax, decorrelation)
        note(
            ax, ASSUMED_TAU_S, 1.0, "360 s", color=VERMILION,
            ha="left" if ax.get_xlim()[1] > 1.5 * ASSUMED_TAU_S else "right",
        )  # fmt: skip
        ax.legend(loc="upper right", bbox_to_anchor=(1.0, 0.96))
        return ax


def _last_lag(curve: Curve, decorrelation: Decorrelation) -> int:
    """Entry up to which is drawn: five decorrelation times, or to twice the first zero."""
    if isinstance(decorrelation.tau_s, Estimate):
        until = 5 * decorrelation.tau_s.value
    else:
        zero = np.flatnonzero(curve.r < 0)
        until = 2 * float(curve.lag_s[zero[0]]) if zero.size else float(curve.lag_s[-1])
    return min(int(np.sum(curve.lag_s < max(until, 1.2 * ASSUMED_TAU_S))), curve.lag_s.size - 1)


def _draw_process(
    ax: Axes, decorrelation: Decorrelation, curve: Curve, shown: np.ndarray[tuple[int], np.dtype]
) -> None:
    """One Gauss-Markov process with its 95 % band of sampling error; two where it is a mixture."""
    lag = curve.lag_s[shown]
    tau = decorrelation.tau_s
    if isinstance(tau, Estimate):
        r = (1 - (decorrelation.nugget or 0.0)) * np.exp(-lag / tau.value)
        spread = 1.96 * curve.sigma[shown]
        ax.fill_between(
            lag, r - spread, r + spread, color=ORANGE, alpha=0.2, linewidth=0,
            label="95 % of its sampling error",
        )  # fmt: skip
        ax.plot(
            lag, r, color=ORANGE, linestyle=(0, (5, 1.5)),
            label=f"one process, τ {seconds_text(tau.value)}",
        )  # fmt: skip
    two = decorrelation.two_processes
    if two is not None:
        text = f"two, {seconds_text(two.tau_1_s)} and {seconds_text(two.tau_2_s)}"
        ax.plot(lag, two.correlation(lag), color=GREEN, linestyle=(0, (1, 1)), label=text)


def _draw_interval(ax: Axes, decorrelation: Decorrelation) -> None:
    low, high = decorrelation.tau_low_s, decorrelation.tau_high_s
    if low is None:
        return
    right = ax.get_xlim()[1]
    level = float(np.exp(-1))
    end = right if high is None else min(high, right)
    label = f"τ {decorrelation.interval_text}".replace(" without", ",\nwithout")
    ax.plot([min(low, right), end], [level, level], color=INK, linewidth=2.2, label=label)
    if high is None or high > right:
        ax.plot([right], [level], marker=">", color=INK, clip_on=False)


def _wrapped(text: str) -> str:
    """The text in lines of at most 44 characters or so."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > 44:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
