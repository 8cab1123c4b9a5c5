"""K against the decorrelation time: what a target needs under each process, and what is claimed."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from sbas.estimate import Estimate
from sbas.integrity.correlation.decorrelation_results import ASSUMED_TAU_S, MISFITS, Decorrelation
from sbas.integrity.correlation.two_processes import seconds_text
from sbas.integrity.exposure.exposure_models import PUBLISHED_K
from sbas.integrity.exposure.k_against_tau import KAgainstTau
from sbas.plots.style import (
    BLUE,
    GREEN,
    HALF_WIDTH,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
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

SHEET = Sheet(HALF_WIDTH, 4.5, bottom=1.75)
_LETTERS_A_LINE = 52
# Less raises K by under 0.04 at 360 s and 0.07 at 1500 s (1 Hz): not to be told from the plot.
_WHITE_LEFT_OUT = 0.005


def k_curve(
    curves: KAgainstTau, *, decorrelation: Decorrelation | None = None, ax: Axes | None = None
) -> Axes:
    """K that a target risk needs, against decorrelation time, beside 6.18 and the measured time.

    Parameters
    ----------
    curves : result of `sbas.integrity.exposure.k_against_tau.k_against_tau`.
    decorrelation : result of `sbas.decorrelation`, drawn as a line with its interval as a band;
        a band without an upper end runs to the edge, and what cannot be given is said.
    ax : axes to draw on; a new figure without them.

    References
    ----------
    6.18 and 360 s: Filip, Bazant, Mocek 2010, section 2.1.2.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("decorrelation time τ of the error [s]")
        ax.set_ylabel(f"K for a risk of {curves.risk:g} in {_duration(curves.exposure_s)} [1]")
        remarks = _remarks(curves, decorrelation)
        _frame(ax, curves, decorrelation, lines=len(remarks))
        for name, label, colour, dashes in _lines(curves):
            known = np.isfinite(curves.k[name])
            if np.any(known):
                ax.plot(
                    curves.tau_s[known], curves.k[name][known], color=colour, linestyle=dashes,
                    label=label,
                )  # fmt: skip
        ax.axhline(
            PUBLISHED_K, color=INK, linewidth=1.2, linestyle=(0, (1, 1.2)),
            label=f"claimed: K = {PUBLISHED_K:g}",
        )  # fmt: skip
        ax.axvline(
            ASSUMED_TAU_S, color=VERMILION, linewidth=0.9, linestyle=(0, (4, 2)),
            label=f"claimed: τ = {ASSUMED_TAU_S:g} s",
        )  # fmt: skip
        if decorrelation is not None:
            _draw_measured(ax, decorrelation)
        if remarks:
            note(
                ax, 0.015, 0.02, "\n".join(remarks), transform=ax.transAxes, color=MUTED,
                ha="left", va="bottom",
            )  # fmt: skip
        ax.legend(loc="upper center", bbox_to_anchor=(0.45, -0.16))
        return ax


def _lines(curves: KAgainstTau) -> list[tuple[str, str, str, str | tuple[int, tuple[float, ...]]]]:
    """Model, words, colour and dashes; roughest error first, as the curves lie."""
    rate = f"{1 / curves.interval_s:.3g} Hz"
    lines: list[tuple[str, str, str, str | tuple[int, tuple[float, ...]]]] = [
        ("ar1", f"modelled: Gauss-Markov error, sampled at {rate}", BLUE, "-"),
        ("rice", "modelled: smooth error (Rice)", GREEN, (0, (6, 1.5))),
        ("naive", "claimed: T/τ independent samples, as the standard", ORANGE, (0, (3, 1, 1, 1))),
    ]
    if "nugget" in curves.k:
        share = f"modelled: the same with {100 * curves.nugget:.2g} % white noise"
        lines.insert(1, ("nugget", share, PURPLE, (0, (4, 1, 1, 1, 1, 1))))
    return lines


def _frame(
    ax: Axes, curves: KAgainstTau, decorrelation: Decorrelation | None, *, lines: int
) -> None:
    """Limits that hold the curves, both published figures, the measured time, lines of text."""
    measured: list[float] = []
    if decorrelation is not None:
        tau = decorrelation.tau_s
        ends = (decorrelation.tau_low_s, tau.value if isinstance(tau, Estimate) else None)
        measured = [end for end in ends if end is not None]
    low = min([float(curves.tau_s[0]), ASSUMED_TAU_S / 1.3, *(m / 1.3 for m in measured)])
    high = max([float(curves.tau_s[-1]), ASSUMED_TAU_S * 1.3, *(m * 1.3 for m in measured)])
    log_axis(ax, "x", low, high)
    every = np.concatenate(list(curves.k.values()))
    known = every[np.isfinite(every)]
    bottom = min(float(np.min(known, initial=PUBLISHED_K)), PUBLISHED_K - 0.3) - 0.1
    top = max(float(np.max(known, initial=PUBLISHED_K)), PUBLISHED_K + 0.3) + 0.1
    ax.set_ylim(bottom - 0.06 * lines * (top - bottom), top)
    if known.size == 0:
        sentence(ax, f"no K between 1 and 12 has a risk of {curves.risk:g}\nunder any process")


def _draw_measured(ax: Axes, decorrelation: Decorrelation) -> None:
    tau, low, high = decorrelation.tau_s, decorrelation.tau_low_s, decorrelation.tau_high_s
    if isinstance(tau, Estimate):
        ax.axvline(
            tau.value, color=INK, linewidth=1.4,
            label=f"{tau.evidence}: τ of this recording, {seconds_text(tau.value)}",
        )  # fmt: skip
    if low is not None:
        right = ax.get_xlim()[1]
        ax.axvspan(
            low, right if high is None else min(high, right), color=SKY, alpha=0.25, linewidth=0,
            zorder=0.5, label=f"τ of this recording lies\n{decorrelation.interval_text}",
        )  # fmt: skip


def _remarks(curves: KAgainstTau, decorrelation: Decorrelation | None) -> list[str]:
    """Lines on why no measured time is drawn, or why the curves are not to be read there."""
    if decorrelation is None:
        return []
    tau, two = decorrelation.tau_s, decorrelation.two_processes
    if decorrelation.tau_low_s is None and not isinstance(tau, Estimate):
        return textwrap.wrap(f"no measured τ: {tau.reason}", _LETTERS_A_LINE)
    remarks = []
    if decorrelation.misfit not in (None, "gm1"):
        remarks.append(MISFITS[decorrelation.misfit])
    if two is not None:
        remarks.append(f"for high levels its short part counts: τ {seconds_text(two.tau_short_s)}")
    white = decorrelation.white_share
    if decorrelation.misfit == "gm1" and white > curves.nugget + _WHITE_LEFT_OUT:
        held = "none" if curves.nugget == 0 else f"{100 * curves.nugget:.2g} %"
        remarks.append(
            f"{100 * white:.2g} % of the variance of this recording is white, in the curves {held}"
        )
    return [line for remark in remarks for line in textwrap.wrap(remark, _LETTERS_A_LINE)]


def _duration(seconds: float) -> str:
    return f"{seconds / 3600:g} h" if seconds % 3600 == 0 else f"{seconds:g} s"
