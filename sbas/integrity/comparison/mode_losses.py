"""Events in which a receiver left the PA mode, and the condition that the columns show."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sbas.integrity.comparison.comparison_results import DropOuts
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.epoch_levels import mode_codes
from sbas.integrity.events import Stretch, find_events, find_runs
from sbas.recording import MODES
from sbas.recording_survey import GAP_STEPS
from sbas.timescales import NS_PER_S

_PA = MODES.index("sbas_pa")


def pa_drop_outs(
    table: pd.DataFrame, *, interval_ns: int, merge_s: float, confidence: float
) -> DropOuts | None:
    """The events in which a receiver left the PA mode.

    Parameters
    ----------
    table : epochs with `mode`, `n_sv`, `geo_prn`.
    interval_ns : sampling interval [ns].
    merge_s : events closer than this are one [s].
    confidence : of the rate's two-sided interval.

    Returns
    -------
    None for a recording that never was in PA, or too rarely to call it its mode (under half
    its epochs). Time before the first PA epoch is no drop-out. The rate is per hour in PA.

    References
    ----------
    Filip, Bazant, Mocek 2010, 2.3.1: the ten conditions of PA. The columns can show two of
    them: 9 (one GEO) and 10 (four satellites or more).
    """
    codes = mode_codes(table)
    in_pa = codes == _PA
    if in_pa.sum() * 2 < max(in_pa.size, 1):
        return None
    first = int(np.argmax(in_pa))
    table, codes, in_pa = table.iloc[first:], codes[first:], in_pa[first:]
    stretch = Stretch(table.index.to_numpy().astype(np.int64), int(GAP_STEPS * interval_ns))
    runs = find_runs(np.flatnonzero(~in_pa), stretch)
    events = find_events(runs, interval_ns=interval_ns, merge_s=merge_s)
    rows = np.searchsorted(stretch.time_ns, events.start_ns)
    n_sv, geo = table["n_sv"].to_numpy(), table["geo_prn"].to_numpy()
    modes, conditions = [], []
    for row in rows.tolist():
        modes.append("unknown" if codes[row] < 0 else MODES[codes[row]])
        before = max(row - 1, 0)
        if 0 <= n_sv[row] < 4:
            conditions.append("10: fewer than four satellites")
        elif geo[row] == 0 or (geo[row] > 0 and geo[before] > 0 and geo[row] != geo[before]):
            conditions.append("9: corrections not from one GEO")
        else:
            conditions.append("not logged")
    hours = float(in_pa.sum()) * interval_ns / (3600 * NS_PER_S)
    rate = poisson_bounds(len(events), hours, confidence, sided="two", of="drop-outs from PA")
    return DropOuts(events, tuple(modes), tuple(conditions), rate)
