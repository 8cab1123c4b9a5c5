"""One run along time: the states of its sensors above what the fusion made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.fused_runs import FusedRuns
from sbas.fusion.states import DA, NO_DATA, WORDS, N, U
from sbas.plots.style import FULL_WIDTH, INK, MUTED, ORANGE, VERMILION, Sheet, drawing, sentence

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 2.2, left=0.95, bottom=0.64)
_LOOKS = {
    N: ("#c9e4f5", "", INK),
    DA: (ORANGE, "///", INK),
    U: (VERMILION, "", "white"),
    NO_DATA: ("white", "...", MUTED),
}
"""Ground, hatching and colour of the letter; hatching tells in print what colours do not."""
_EDGES = {DA: "#a36f00", U: VERMILION}
_LETTERS = {N: "N", DA: "DA", U: "U"}
_HEIGHT = 0.78
_LETTER_SHARE = 0.022
"""Stretches that take up this share of the width have room for their letter."""


def combination_ribbon(fused: FusedRuns, run: int = 0, *, ax: Axes | None = None) -> Axes:
    """States of the sensors and of the output over the time of one run.

    Parameters
    ----------
    fused : runs, simulated or replayed.
    run : index of the run.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes: a ribbon a sensor, the output below. An epoch is drawn over the step that ends at
    it.

    Raises
    ------
    InputError : no such run.
    """
    if fused.runs and not -fused.runs <= run < fused.runs:
        raise InputError(f"no run {run}", where="run", evidence=f"{fused.runs} runs")
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("time [s]")
        ax.grid(visible=False)
        if not fused.runs or not fused.epochs:
            sentence(ax, "no epoch")
            return ax
        rows = [*fused.sensor_state[:, :, run], fused.output_state[:, run]]
        places = [float(len(rows) - i) for i in range(len(rows))]
        # The output stands apart from what it is made of.
        places[-1] -= 0.3
        for states, place in zip(rows, places, strict=True):
            _ribbon(ax, states, place, fused.step_s)
        ax.set_yticks(places, [*fused.names, "output"])
        ax.tick_params(axis="y", length=0)
        ax.spines["left"].set_visible(False)
        ax.set_xlim(0, fused.epochs * fused.step_s)
        ax.set_ylim(places[-1] - 0.5, places[0] + 0.5)
        seen = np.unique(np.concatenate(rows))
        for state in (s for s in _LOOKS if s in seen):
            ground, hatch, _ = _LOOKS[state]
            ax.fill_between(
                [], [], [], facecolor=ground, hatch=hatch, edgecolor=_EDGES.get(state, MUTED),
                linewidth=0.4,
                label=WORDS[state],
            )  # fmt: skip
        ax.legend(
            loc="upper right", bbox_to_anchor=(1.0, -0.22), ncols=4, borderaxespad=0,
            handlelength=1.4, columnspacing=1.4,
        )  # fmt: skip
        return ax


def _ribbon(ax: Axes, states: NDArray[np.int8], place: float, step_s: float) -> None:
    first = np.flatnonzero(np.diff(states, prepend=np.int8(-2)))
    begin, width = first * step_s, np.diff(first, append=states.size) * step_s
    kind = states[first]
    bottom = place - _HEIGHT / 2
    for state, (ground, hatch, _) in _LOOKS.items():
        of_it = kind == state
        spans = list(zip(begin[of_it].tolist(), width[of_it].tolist(), strict=True))
        # A stretch narrower than a pixel must not vanish where it is a bad one.
        stroke = {U: 0.6, DA: 0.3}.get(state, 0.0)
        ax.broken_barh(
            spans, (bottom, _HEIGHT), facecolor=ground, hatch=hatch, linewidth=stroke,
            edgecolor=_EDGES.get(state, MUTED),
        )  # fmt: skip
    room = _LETTER_SHARE * states.size * step_s
    for at, wide, state in zip(begin, width, kind.tolist(), strict=True):
        if state != NO_DATA and wide >= room * len(_LETTERS[state]):
            ax.text(
                at + wide / 2, place, _LETTERS[state], color=_LOOKS[state][2], fontsize=7,
                ha="center", va="center",
                bbox=_ground(_LOOKS[state][0]) if _LOOKS[state][1] else None,
            )  # fmt: skip


def _ground(colour: str) -> dict[str, object]:
    """Clears the hatching behind a letter."""
    return {"boxstyle": "square,pad=0.12", "facecolor": colour, "edgecolor": "none"}
