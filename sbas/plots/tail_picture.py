"""The tail that a modelled rate rests on, and whether it depends on where it was cut."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.estimate import Refusal
from sbas.integrity.tails.tail_family import tail_family
from sbas.integrity.tails.tail_fit import TailFit
from sbas.integrity.tails.tail_model import tail_probability
from sbas.plots.style import (
    BLUE,
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    MUTED,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT)
_WORDS_A_LINE = 46


def tail_plot(
    fit: TailFit | Refusal,
    *,
    level_k: float | None = None,
    confidence: float = 0.95,
    ax: Axes | None = None,
) -> Axes:
    """Share of epochs beyond each error over sigma, with the fitted tail and its interval.

    Parameters
    ----------
    fit : result of `sbas.integrity.tails.tail_model.fit_tail`. A refused fit is drawn as a broken
        line with the reason: no rate may be read off it.
    level_k : level over sigma to mark, such as 6.18.
    confidence : of the two-sided band.
    ax : axes to draw on; a new figure without them.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("error / sigma [1]")
        ax.set_ylabel("share of epochs at or beyond [1]")
        if isinstance(fit, Refusal):
            sentence(ax, f"no tail: {_wrapped(fit.reason)}")
            return ax
        seen = np.sqrt(2 * fit.tail_y)
        start = float(np.sqrt(2 * fit.threshold))
        end = 1.06 * max(float(seen[0]), level_k or 0.0)
        k = np.linspace(start, end, 80)
        value, lower, upper = tail_probability(fit, k, confidence=confidence)
        refused = fit.refusal is not None
        colour = VERMILION if refused else BLUE
        ax.fill_between(k, lower, upper, color=VERMILION if refused else SKY, alpha=0.25,
                        linewidth=0)  # fmt: skip
        name = "refused" if refused else "modelled"
        ax.plot(k, value, "--" if refused else "-", color=colour,
                label=f"{name}: tail beyond 95 %, {100 * confidence:g} % band")  # fmt: skip
        # Drawn from the median on: the unit sigma that the errors claim to have.
        body = np.linspace(float(seen[-1]), end, 80)
        claimed = np.exp(-tail_family(fit.axis_ratio).depth_at(body**2 / 2))
        ax.plot(body, claimed, color=MUTED, linewidth=0.9, linestyle=(0, (1, 1.2)),
                label="claimed: Gaussian with this sigma")  # fmt: skip
        ax.plot(seen, fit.tail_share, "o", color=INK, markersize=2.2, label="counted")
        if level_k is not None:
            ax.axvline(level_k, color=INK, linewidth=0.8, linestyle=(0, (4, 2)))
        ax.set_xlim(0.95 * float(seen[-1]), end)
        log_axis(ax, "y", max(float(lower[-1]), 1e-18) / 3, 1.0)
        ax.legend(loc="lower left", fontsize=6.5)
        if fit.refusal is not None:
            note(ax, 0.985, 0.965, _wrapped(fit.refusal.reason), transform=ax.transAxes,
                 ha="right", va="top", fontsize=6.5, color=VERMILION)  # fmt: skip
        return ax


def threshold_stability(fit: TailFit | Refusal, *, ax: Axes | None = None) -> Axes:
    """Fitted scale over the quantile at which the tail is cut; level where the model holds.

    Parameters
    ----------
    fit : result of `sbas.integrity.tails.tail_fit.fit_tail`. Bars are two standard deviations
        that Gaussian records of this length and correlation show.
    ax : axes to draw on; a new figure without them.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("quantile at which the tail is cut [%]")
        ax.set_ylabel("scale of sigma² [1]")
        if isinstance(fit, Refusal):
            sentence(ax, f"no tail: {_wrapped(fit.reason)}")
            return ax
        quantile, _, scale, spread = fit.stability[1:].T
        known = np.isfinite(scale)
        at = np.arange(quantile.size)
        bars = scale[known] * np.array([-np.expm1(-2 * spread[known]), np.expm1(2 * spread[known])])
        ax.errorbar(at[known], scale[known], yerr=bars, fmt="o", color=BLUE, capsize=3,
                    label="modelled: scale with two standard deviations")  # fmt: skip
        ax.axhline(1.0, color=MUTED, linewidth=0.9, linestyle=(0, (1, 1.2)),
                   label="claimed: the sigma that was given")  # fmt: skip
        ax.set_xticks(at, [f"{100 * q:g}" for q in quantile])
        ax.set_xlim(-0.5, at[-1] + 0.5)
        ax.set_ylim(0, 1.25 * float(np.max(scale[known] + bars[1], initial=1.0)))
        ax.legend(loc="lower left", fontsize=6.5)
        return ax


def _wrapped(text: str) -> str:
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + len(word) >= _WORDS_A_LINE:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "\n".join([*lines, line])
