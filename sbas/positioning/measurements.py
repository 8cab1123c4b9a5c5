"""Ranges of a receiver as rows: an epoch, a satellite, and what was measured."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.reasons import Reason
from sbas.positioning.arcs import SKIPPED_EPOCHS, find_arcs, smoothed_range
from sbas.positioning.orbits import LIGHT_MPS
from sbas.rinex.observations import SystemObservations
from sbas.timescales import GPS_EPOCH_NS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

L1_HZ = 1575.42e6
LEAST_CN0_DBHZ = 33.0
LEAST_SMOOTHING_S = 360.0
"""With smoothing a satellite serves once its filter has run for so long, as in gLAB."""
FIRST_SBAS_SLOT = 120


@dataclass(frozen=True, eq=False)
class Measurements:
    """(k,) ranges, sorted by epoch and satellite.

    `epoch` and `satellite` are indices into `time_ns` (since the GPS epoch) and `names`; `slot`
    the number of each name in the PRN mask; `code_m` is smoothed where that was asked for;
    `reason` why a range must not be used, 0 if it may.
    """

    time_ns: Ints
    names: tuple[str, ...]
    slot: Ints
    epoch: Ints
    satellite: Ints
    code_m: Floats
    raw_code_m: Floats
    reason: Ints

    def __len__(self) -> int:
        return self.epoch.size

    def some(self, rows: NDArray[np.bool_] | Ints) -> Measurements:
        """Some of the ranges; epochs and names stay."""
        names = ("epoch", "satellite", "code_m", "raw_code_m", "reason")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


def measurements(
    observations: SystemObservations, *, smoothing: bool, least_cn0_dbhz: float = LEAST_CN0_DBHZ
) -> Measurements:
    """L1 C/A ranges of GPS satellites, or of SBAS satellites.

    Parameters
    ----------
    observations : with C1C, and L1C and S1C where they were recorded.
    smoothing : smooth the code by the carrier over 100 s; a satellite then serves after 360 s.
    """
    time_ns = observations.time.astype(np.int64) - GPS_EPOCH_NS
    n, m = time_ns.size, len(observations.satellites)
    nothing = np.full((n, m), np.nan)
    code = observations.values.get("C1C", nothing)
    carrier = observations.values.get("L1C", nothing) * (LIGHT_MPS / L1_HZ)
    cn0 = observations.values.get("S1C", nothing)
    time_s = (time_ns - time_ns[0]) / 1e9 if n else np.empty(0)
    interval_s = float(np.median(np.diff(time_s))) if n > 1 else 1.0
    present = np.isfinite(code) & (code > 0)
    strong = present & ~(cn0 < least_cn0_dbhz)
    reason = np.where(present, Reason.WEAK_SIGNAL, Reason.NO_PSEUDORANGE).astype(np.int64)
    reason[strong] = Reason.USED
    range_m = code
    if smoothing:
        range_m = code.copy()
    for column in range(m):
        rows = np.flatnonzero(strong[:, column])
        codes, carriers = code[rows, column], carrier[rows, column]
        arcs = find_arcs(time_s[rows], codes, carriers, interval_s=interval_s)
        if smoothing:
            smoothed = smoothed_range(arcs, codes, carriers, interval_s=interval_s)
            range_m[rows, column] = smoothed.range_m
            young = smoothed.epochs * interval_s < LEAST_SMOOTHING_S
        else:
            young = arcs.place <= SKIPPED_EPOCHS
        reason[rows[young], column] = Reason.SHORT_ARC
        reason[rows[arcs.jumped], column] = Reason.CYCLE_SLIP
    epoch, satellite = np.nonzero(present)
    number = np.array([int(name[1:]) for name in observations.satellites], np.int64)
    is_sbas = np.array([name[0] == "S" for name in observations.satellites], bool)
    return Measurements(
        time_ns,
        observations.satellites,
        number + np.where(is_sbas, 100, 0),
        epoch,
        satellite,
        range_m[epoch, satellite],
        code[epoch, satellite],
        reason[epoch, satellite],
    )


def joined(first: Measurements, second: Measurements) -> Measurements:
    """The ranges of two systems of one receiver, at the epochs of either."""
    time_ns = np.union1d(first.time_ns, second.time_ns)
    parts = [
        (np.searchsorted(time_ns, part.time_ns)[part.epoch], part.satellite + shift, part)
        for part, shift in ((first, 0), (second, len(first.names)))
    ]
    epoch = np.concatenate([part[0] for part in parts])
    satellite = np.concatenate([part[1] for part in parts])
    order = np.lexsort((satellite, epoch))
    values = {
        f.name: np.concatenate([getattr(first, f.name), getattr(second, f.name)])[order]
        for f in fields(Measurements)
        if f.name in ("code_m", "raw_code_m", "reason")
    }
    return Measurements(
        time_ns,
        (*first.names, *second.names),
        np.concatenate([first.slot, second.slot]),
        epoch[order],
        satellite[order],
        **values,
    )
