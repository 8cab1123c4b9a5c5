"""Message types of one SBAS satellite over time: what came, what was lost, what ran out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import bits_of, unsigned
from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.reception import MOST_LOST
from sbas.augmentation.tables import (
    IONO_DELAY_TIMEOUT_S,
    IONO_MASK_TIMEOUT_S,
    MASK_TIMEOUT_S,
    SERVICE_TIMEOUT_S,
    SLOW_TIMEOUT_S,
    UDREI_TIMEOUT_S,
    Mode,
)
from sbas.exceptions import InputError
from sbas.plots.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    sentence,
)
from sbas.plots.time_axis import time_axis
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Ints = NDArray[np.int64]

SHEET = Sheet(FULL_WIDTH, 3.9, left=1.72, right=0.62, bottom=0.45, top=0.36)
BINS = 2400
"""Of messages that fall into one bin of the picture's width one stroke is drawn."""

VOIDING, SHORT = "#f0a27a", "#d0d6db"
"""Colours of gaps that void the fast corrections, and of shorter ones."""
FAST_KINDS = (2, 3, 4, 5)
_KINDS = {
    0: ("alarm, or test", VERMILION),
    1: ("PRN mask", BLACK),
    **{kind: (f"fast, block {kind - 2}", BLUE) for kind in FAST_KINDS},
    6: ("integrity", BLUE),
    7: ("fast degradation", PURPLE),
    9: ("own orbit", GREEN),
    10: ("degradation", PURPLE),
    12: ("network time", MUTED),
    17: ("almanac", MUTED),
    18: ("iono mask", BLACK),
    24: ("fast and long-term", BLUE),
    25: ("long-term", GREEN),
    26: ("iono delays", ORANGE),
    27: ("service regions", PURPLE),
    28: ("covariance", GREEN),
    62: ("internal test", MUTED),
    63: ("null", MUTED),
}


def message_timeline(messages: SbasMessages, *, mode: Mode = "pa", ax: Axes | None = None) -> Axes:
    """Types of all messages of a satellite over time, gaps, damage, and content that ran out.

    Parameters
    ----------
    messages : of one SBAS satellite, such as `read_messages(path, prn=129)`.
    mode : whose time-outs count; they stand at the right edge [s].
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes: a row a type. Bands over all rows are seconds without any message; the wide ones
    void the fast corrections. A bar in a row begins when everything of that type has expired
    since its last message. Single satellites or grid points can have expired before.

    Raises
    ------
    InputError : messages of several satellites.

    References
    ----------
    RTCA DO-229D, table A-25 (time-outs).
    """
    if len(messages.prns) > 1:
        raise InputError(
            "a message time line is that of one SBAS satellite",
            evidence=f"PRN {', '.join(map(str, messages.prns))}",
            cure=f"messages.of_prn({messages.prns[0]})",
        )
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.grid(visible=False, axis="y")
        ax.set_ylabel("")
        heard = np.union1d(messages.time_s, messages.bad_time_s)
        if not heard.size:
            ax.set_xlabel("time")
            sentence(ax, "no message")
            return ax
        begin_s, end_s = int(heard[0]) - 1, int(heard[-1])
        unit_s = time_axis(ax, *(s * NS_PER_S + GPS_EPOCH_NS for s in (begin_s, end_s))) / NS_PER_S
        kinds: list[int] = np.unique(messages.kind).tolist()
        rows = {kind: row for row, kind in enumerate(reversed(kinds))}
        marks = []
        for kind, row in rows.items():
            _, colour = _look(kind)
            stamp = _thinned(messages.time_s[messages.kind == kind], begin_s, end_s)
            _strokes(ax, (stamp - begin_s) / unit_s, row, colour)
            spans = expired_spans(messages, kind, mode=mode)
            if spans.size:
                marks.append("expired")
            ax.broken_barh(
                [((a - begin_s) / unit_s, (b - a) / unit_s) for a, b in spans.tolist()],
                (row - 0.13, 0.26), color=VERMILION, linewidth=0.6, zorder=2,
            )  # fmt: skip
            _timeout(ax, kind, row, mode)
        names = [f"{_look(kind)[0]}  {kind}" for kind in rows]
        places = list(rows.values())
        damaged = _thinned(np.unique(messages.bad_time_s), begin_s, end_s)
        if damaged.size:
            ax.plot(
                (damaged - begin_s) / unit_s, np.full(damaged.size, len(rows)), color=VERMILION,
                marker="x", markersize=4, linestyle="none", zorder=4,
            )  # fmt: skip
            names.append("damaged")
            places.append(len(rows))
        ax.set_yticks(places, names)
        ax.set_ylim(-0.7, len(places) - 0.3)
        ax.text(
            1.008, 1.02, f"time-out\n{mode.upper()} [s]", transform=ax.transAxes, fontsize=6.5,
            color=MUTED, va="bottom", ha="left", linespacing=1.1,
        )  # fmt: skip
        _gaps(ax, heard, begin_s, unit_s)
        _legend(ax, messages, expired=bool(marks))
        return ax


def timeout_s(kind: int, *, mode: Mode) -> int | None:
    """Age at which the content of a message type expires [s]; of types 2 to 6 the UDREI, of 24
    the long-term half; None for types without a time-out."""
    if kind in (*FAST_KINDS, 6):
        return UDREI_TIMEOUT_S[mode]
    if kind in (7, 9, 10, 24, 25, 28):
        return SLOW_TIMEOUT_S[mode]
    return {
        1: MASK_TIMEOUT_S, 18: IONO_MASK_TIMEOUT_S, 26: IONO_DELAY_TIMEOUT_S, 27: SERVICE_TIMEOUT_S,
    }.get(kind)  # fmt: skip


def expired_spans(messages: SbasMessages, kind: int, *, mode: Mode) -> Ints:
    """(k, 2) GPS seconds during which all content of a type had expired, up to the last message.

    Parameters
    ----------
    messages : of one satellite.
    kind : message type. Type 6 has no spans of its own: it renews types 2 to 5, as type 24 renews
        the one of them whose block it carries.
    mode : whose time-outs count.
    """
    limit = timeout_s(kind, mode=mode)
    own = messages.time_s[messages.kind == kind]
    if limit is None or kind == 6 or not own.size:
        return np.zeros((0, 2), np.int64)
    renewed = own
    if kind in FAST_KINDS:
        renewing = messages.kind == 6
        both = messages.kind == 24
        renewing[both] = unsigned(bits_of(messages.frame[both]), 112, 2) == kind - 2
        later = messages.time_s[renewing]
        # Before the first fast corrections there is nothing that could be renewed.
        renewed = np.union1d(own, later[later > own[0]])
    elif kind in (24, 25):
        later = messages.time_s[np.isin(messages.kind, (24, 25))]
        renewed = np.unique(later[later >= own[0]])
    ends = np.append(renewed[1:], messages.time_s[-1])
    void = ends - renewed > limit
    return np.column_stack([renewed[void] + limit, ends[void]])


def _look(kind: int) -> tuple[str, str]:
    return _KINDS.get(kind, ("not assigned", MUTED))


def _thinned(stamp: Ints, begin_s: int, end_s: int) -> Ints:
    """Stamps of which no two lie in one bin."""
    place = (stamp - begin_s) * BINS // max(end_s - begin_s, BINS)
    return stamp[np.flatnonzero(np.diff(place, prepend=-1))]


def _strokes(ax: Axes, x: NDArray[np.float64], row: int, colour: str) -> None:
    high = np.tile([row - 0.36, row + 0.36, np.nan], x.size)
    ax.plot(np.repeat(x, 3), high, color=colour, linewidth=0.8, zorder=3)


def _timeout(ax: Axes, kind: int, row: int, mode: Mode) -> None:
    limit = timeout_s(kind, mode=mode)
    if limit is not None:
        ax.text(
            1.008, row, f"{limit:,}", transform=ax.get_yaxis_transform(), fontsize=6.5,
            color=MUTED, va="center",
        )  # fmt: skip


def _gaps(ax: Axes, heard: Ints, begin_s: int, unit_s: float) -> None:
    """Seconds without a message; those that void the fast corrections in a darker colour."""
    step = np.diff(heard)
    for row in np.flatnonzero(step > 1).tolist():
        voids = step[row] > MOST_LOST
        first, last = (heard[row] - begin_s) / unit_s, (heard[row + 1] - 1 - begin_s) / unit_s
        ax.axvspan(
            first, last, color=VOIDING if voids else SHORT, linewidth=0.6, zorder=1,
        )  # fmt: skip


def _legend(ax: Axes, messages: SbasMessages, *, expired: bool) -> None:
    heard = np.union1d(messages.time_s, messages.bad_time_s)
    lost = np.diff(heard) - 1
    long = int(np.count_nonzero(lost >= MOST_LOST))
    words = [(INK, 0.8, f"PRN {messages.prns[0]}, {len(messages):,} messages")] if len(
        messages
    ) else []  # fmt: skip
    if long:
        words.append((VOIDING, 5.0, f"{MOST_LOST} or more lost, fast corrections void: {long:,}"))
    short = int(np.count_nonzero((lost > 0) & (lost < MOST_LOST)))
    if short:
        words.append((SHORT, 5.0, f"1 to {MOST_LOST - 1} lost: {short:,}"))
    if expired:
        words.append((VERMILION, 2.5, "all of this type expired"))
    for colour, width, label in words:
        ax.plot([], [], color=colour, linewidth=width, label=label)
    if messages.bad_time_s.size:
        ax.plot(
            [], [], color=VERMILION, marker="x", linestyle="none", markersize=4,
            label=f"damaged: {messages.bad_time_s.size:,}",
        )  # fmt: skip
    ax.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=4, borderaxespad=0, handlelength=1.2,
        columnspacing=1.4,
    )  # fmt: skip
