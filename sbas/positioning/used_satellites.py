"""The satellites that a recording says were used, ready for the geometry of its fixes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.positioning.normal_equations import design, enu_of
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SYSTEMS = ("G", "S")
"""DO-229 L1 corrections are for these, with one clock for both."""


@dataclass(frozen=True, eq=False)
class UsedSatellites:
    """(k,) rows of used satellites.

    `time` (n,) distinct epochs with a used satellite, `epoch` (k,) indices into it; `g` (4, k)
    designs; `unsound` (n,) True where the rows of an epoch do not make up its fix: a satellite
    twice, without direction or sigma, or of a system that DO-229 does not cover. Why is counted
    in `reasons`.
    """

    time: NDArray[np.datetime64]
    epoch: Ints
    table: pd.DataFrame
    g: Floats
    sigma_m: Floats
    unsound: Bools
    reasons: dict[str, int]


def used_satellites(recording: Recording, *needed: str) -> UsedSatellites:
    """Rows of the side table `satellites` with `used`, sorted by time.

    Parameters
    ----------
    needed : further columns that the rows must have.

    Raises
    ------
    InputError : no such table, or one without a column that is needed.
    """
    names = ("satellite", "elevation_deg", "azimuth_deg", "sigma_m", "used", *needed)
    side = recording.side_tables.get(SIDE_TABLE)
    lacking = names if side is None else [name for name in names if name not in side.columns]
    if side is None or lacking:
        raise InputError(
            "the recording does not say which satellites were used, and how",
            evidence=f"side table {SIDE_TABLE!r}: no {', '.join(lacking)}",
            cure="sbas protect makes such a recording; so do SBF logs with GEOCorrections, and "
            "outputs of gLAB with SBASVAR",
        )
    table = side[side["used"].to_numpy()]
    stamps = table["time"].to_numpy()
    if (np.diff(stamps.astype(np.int64)) < 0).any():
        table = table.iloc[np.argsort(stamps, kind="stable")]
        stamps = table["time"].to_numpy()
    time, epoch = np.unique(stamps, return_inverse=True)
    code = table["satellite"].cat.codes.to_numpy().astype(np.int64)
    system = np.array([str(name)[:1] for name in table["satellite"].cat.categories] + [""])
    sigma = table["sigma_m"].to_numpy()
    g = design(enu_of(table["elevation_deg"].to_numpy(), table["azimuth_deg"].to_numpy()))
    key = epoch * (code.max(initial=0) + 2) + code
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    twice = np.zeros(epoch.size, bool)
    twice[first[count > 1]] = True
    bad = {
        "a satellite twice": twice,
        "a satellite of a system that DO-229 does not cover": ~np.isin(system[code], SYSTEMS),
        "a satellite without direction": ~np.isfinite(g).all(axis=0),
        "a satellite without sigma": ~(np.isfinite(sigma) & (sigma > 0)),
    }
    unsound = np.zeros(time.size, bool)
    reasons = {}
    for why, rows in bad.items():
        epochs = np.unique(epoch[rows])
        unsound[epochs] = True
        if epochs.size:
            reasons[why] = int(epochs.size)
    return UsedSatellites(time, epoch, table, g, sigma, unsound, reasons)
