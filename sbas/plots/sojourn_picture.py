"""How long a receiver state lasts, against the geometric law that a Markov chain implies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.dependability.receiver.markov_tests import MarkovTest
from sbas.dependability.receiver.sojourns import sojourn_hazards
from sbas.dependability.receiver.state_estimation import ReceiverStates
from sbas.dependability.receiver.state_tally import STATES
from sbas.exceptions import InputError
from sbas.plots.style import (
    BLUE,
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT, top=0.42)
_LOG_FROM = 60
"""Runs of more epochs than this have a log axis."""


def sojourn_survival(
    states: ReceiverStates,
    *,
    state: str = "wrong",
    environment: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Share of runs of a state that last so long or longer, against the geometric law.

    Parameters
    ----------
    states : result of `sbas.dependability.receiver_states`.
    state : "correct", "wrong" or "missing".
    environment : label of the chain; None for all together.
    ax : axes to draw on; a new figure without them.

    Raises
    ------
    InputError : another state, or an unknown label.

    References
    ----------
    Runs that were cut count as long as they were seen (E. L. Kaplan, P. Meier, JASA 53 (1958)
    457); a chain gives P(L >= r) = a^(r-1), a its probability to stay.
    """
    if state not in STATES:
        raise InputError(f"no state {state!r}", cure="one of " + ", ".join(STATES))
    index = STATES.index(state)
    chain = states.chain_of(environment)
    runs, stay = chain.runs[index], chain.stay(index)
    where = "" if environment is None else f" ({environment})"
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel(f"length r of a run of {state} epochs{where} [epochs of "
                      f"{states.interval_s:g} s]")  # fmt: skip
        ax.set_ylabel("share of runs of length r or more [1]")
        if not runs.completed or stay is None:
            sentence(ax, f"no run of {state} epochs was seen\nfrom its begin to its end")
            return ax
        hazards = sojourn_hazards(chain, index, runs.completed[-1][0])
        # P(L >= r): not left at any age before r.
        survives = np.append(1.0, np.cumprod(1.0 - hazards[:-1]))
        longest, k = hazards.size, states.tail_runs
        right = 1.3 * max(longest, k)
        ages = np.unique(np.geomspace(1, max(right, 2), 400))
        chain_law = np.exp((ages - 1) * np.log(stay)) if stay > 0 else (ages == 1) * 1.0
        low = float(survives[-1]) / 5
        log_axis(ax, "y", low, 1.6)
        if right > _LOG_FROM:
            log_axis(ax, "x", 0.9, right)
        else:
            ax.set_xlim(0.5, right)
        ax.axvline(k, color=VERMILION, linewidth=0.9, linestyle=(0, (4, 2)))
        note(ax, k, low, f"k = {k}", color=VERMILION, va="bottom", rotation=90)
        kept = np.flatnonzero(np.append(True, np.diff(survives) != 0))
        whole, cut = (sum(n for _, n in part) for part in (runs.completed, runs.censored))
        ax.plot(
            kept + 1, survives[kept], color=BLUE, marker="o", markersize=3, linewidth=0.8,
            label=f"{whole:,} runs seen whole, {cut:,} cut",
        )  # fmt: skip
        shown = chain_law > low
        ax.plot(
            ages[shown], chain_law[shown], color=INK, linestyle=(0, (6, 1.5)),
            label=f"Markov chain: {stay:.4g}ʳ⁻¹",
        )  # fmt: skip
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
        test = chain.tail[index]
        words = f"r ≥ {k}: not tested"
        if isinstance(test, MarkovTest):
            words = (
                f"r ≥ {k}: {test.observed:g} runs seen,\n"
                f"{test.expected:.4g} expected, p {test.p:.2g}"
            )
        note(ax, 0.985, 0.965, words, transform=ax.transAxes, ha="right", va="top")
        return ax
