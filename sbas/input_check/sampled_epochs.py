"""A bounded sample of a recording's epochs: what comparisons with a truth work on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbas.recording_survey import Ints, Rows

MOST_SAMPLES = 20_000

Floats = NDArray[np.float64]


class SampledEpochs:
    """Every 2^k-th epoch with a position, k as large as keeps them at most `MOST_SAMPLES`.

    Which ones are kept follows from their count alone, so no cut of the record changes it.
    """

    COLUMNS = ("lat_deg", "lon_deg", "height_m", "hpl_m")

    def __init__(self) -> None:
        self.stride = 1
        self._seen = 0
        self._kept: list[NDArray[np.float64]] = []
        self._time: list[Ints] = []
        self._row: list[Ints] = []
        self._size = 0

    def update(self, rows: Rows) -> None:
        lat, lon = rows.values["lat_deg"], rows.values["lon_deg"]
        at = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon))
        first = -self._seen % self.stride
        self._seen += at.size
        at = at[first :: self.stride]
        self._time.append(rows.time_ns[at])
        self._row.append(rows.first + at)
        self._kept.append(np.stack([rows.values[name][at] for name in self.COLUMNS]))
        self._size += at.size
        while self._size > MOST_SAMPLES:
            time, row = (np.concatenate(part)[::2] for part in (self._time, self._row))
            kept = np.concatenate(self._kept, axis=1)[:, ::2]
            self._time, self._row, self._kept, self._size = [time], [row], [kept], time.size
            self.stride *= 2

    @property
    def time_ns(self) -> Ints:
        """(m,) times of the sampled epochs [ns]."""
        return np.concatenate(self._time) if self._time else np.empty(0, np.int64)

    @property
    def row(self) -> Ints:
        """(m,) rows of the sampled epochs."""
        return np.concatenate(self._row) if self._row else np.empty(0, np.int64)

    def values(self) -> tuple[Floats, Floats, Floats, Floats]:
        """(m,) latitudes, longitudes, heights and horizontal levels of the sampled epochs."""
        if not self._kept:
            return (np.empty(0),) * 4
        lat, lon, height, hpl = np.concatenate(self._kept, axis=1)
        return lat, lon, height, hpl
