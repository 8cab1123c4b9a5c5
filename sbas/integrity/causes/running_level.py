"""The level that is usual at each epoch, and where the reported one stands far above it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

_WIDER = 6
_ROUNDS = 4


def running_level(
    time_ns: Ints, hpl_m: Floats, *, window_s: float = 600.0, ratio: float = 3.0
) -> tuple[Floats, Bools]:
    """Running median of HPL without its spikes, and the epochs that are spikes.

    Parameters
    ----------
    time_ns : (n,) increasing times [ns].
    hpl_m : (n,) levels [m]; NaN where missing.
    window_s : length of the centred window [s].
    ratio : a level above this many times the median is a spike.

    Returns
    -------
    reference [m] and spike, each (n,): a spike is hpl > ratio * reference, and the reference is
        the median of the levels in the window that are no spikes; where it has none, between
        the nearest references. NaN and False when no level is known.

    Notes
    -----
    A spike may fill more than half a window, and would then pass for the usual level: the
    search begins with the smaller one of the window's median and that of a window six times as
    long, and is repeated without the spikes found until nothing changes (four times at most).

    References
    ----------
    Filip, Bazant, Mocek 2010, section 3 (spikes of "a few or tenths of seconds"); definition:
    integrity statistics, 7.
    """
    if not np.isfinite(hpl_m).any():
        return np.full(hpl_m.size, np.nan), np.zeros(hpl_m.size, bool)
    narrow = _median(time_ns, hpl_m, window_s)
    # The wide window needs no more epochs than the narrow one to be sure of its median.
    thin = slice(None, None, _WIDER)
    wide = _filled(time_ns, _median(time_ns[thin], hpl_m[thin], _WIDER * window_s), thin)
    spike = hpl_m > ratio * np.fmin(narrow, wide)
    for _ in range(_ROUNDS):
        reference = narrow if not spike.any() else _median(
            time_ns, np.where(spike, np.nan, hpl_m), window_s
        )  # fmt: skip
        reference = _filled(time_ns, reference, slice(None))
        found = hpl_m > ratio * reference
        if np.array_equal(found, spike):
            break
        spike = found
    return reference, found


def _median(time_ns: Ints, values: Floats, window_s: float) -> Floats:
    series = pd.Series(values, index=pd.DatetimeIndex(time_ns.view("M8[ns]")))
    window = pd.Timedelta(round(window_s * NS_PER_S), unit="ns")
    median: Floats = series.rolling(window, center=True).median().to_numpy()
    return median


def _filled(time_ns: Ints, values: Floats, rows: slice) -> Floats:
    """Values at some rows, brought to all of them: linear between, constant beyond."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(time_ns.size, np.nan)
    origin = time_ns[0]
    return np.asarray(
        np.interp(
            (time_ns - origin).astype(float),
            (time_ns[rows][known] - origin).astype(float),
            values[known],
        )
    )
