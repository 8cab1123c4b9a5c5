"""The abscissa of a picture over time: since when, and in which unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.timescales import NS_PER_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_UNITS_S = (("s", 1.0, 600.0), ("min", 60.0, 7200.0), ("h", 3600.0, 864e3), ("d", 86400.0, np.inf))


def time_axis(ax: Axes, begin_ns: int, end_ns: int) -> float:
    """Label and limit the abscissa of a span of time in a unit that suits its length.

    Parameters
    ----------
    ax : axes whose abscissa it is.
    begin_ns, end_ns : the span, in nanoseconds of GPS time since 1970 [ns].

    Returns
    -------
    Nanoseconds a unit: abscissa = (time - begin_ns) / this.
    """
    span_s = max((end_ns - begin_ns) / NS_PER_S, 1.0)
    unit, seconds = next((name, size) for name, size, limit in _UNITS_S if span_s < limit)
    begin = str(np.datetime64(begin_ns, "ns").astype("M8[s]")).replace("T", " ")
    ax.set_xlabel(f"time since {begin} GPST [{unit}]")
    ax.set_xlim(0, span_s / seconds)
    return seconds * NS_PER_S
