"""Position errors: what a recording says less where the antenna was."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sbas.recording import Recording, with_columns
from sbas.truth import Truth, east_north_up_m


def position_errors(recording: Recording | pd.DataFrame, truth: Truth) -> pd.DataFrame:
    """Signed errors of every epoch and their horizontal and vertical size.

    Parameters
    ----------
    recording : a Recording or its table, (n,) epochs indexed by GPS time.
    truth : FixedPoint or Trajectory.

    Returns
    -------
    (n,) rows on the same index, NaN where position or truth is missing: `east_m`, `north_m`,
    `up_m` (position less truth, in the truth's tangent plane), `hpe_m` = hypot(east, north),
    `vpe_m` = |up|, and the truth's own 1-sigma `truth_sigma_h_m`, `truth_sigma_v_m`.
    Source: RTCA DO-229D, 1.7.2 (definitions of horizontal and vertical error).
    """
    table = recording.table if isinstance(recording, Recording) else recording
    position = with_columns(table, ("lat_deg", "lon_deg", "height_m"))
    true = truth.at(position.index.to_numpy())
    lat, lon, height = (position[name].to_numpy() for name in position)
    east, north, up = east_north_up_m(lat, lon, height, true)
    return pd.DataFrame(
        {
            "east_m": east,
            "north_m": north,
            "up_m": up,
            "hpe_m": np.hypot(east, north),
            "vpe_m": np.abs(up),
            "truth_sigma_h_m": true.sigma_h_m,
            "truth_sigma_v_m": true.sigma_v_m,
        },
        index=position.index,
    )
