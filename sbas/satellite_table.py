"""The satellite table: one row an epoch and satellite, filled and read by many.

Solutions of other programs, SBF corrections, the software receiver and RAIM all use these
columns; it lies beside the epochs as the side table `satellites`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from sbas.exceptions import InputError
from sbas.recording import Column

SIDE_TABLE = "satellites"
"""Name of the satellite table among the side tables of a Recording."""

SATELLITE_COLUMNS: dict[str, Column] = {
    column.name: column
    for column in (
        Column("satellite", "category", None, "", "RINEX 3 name such as G05, R12, E01, S36"),
        *(
            Column(name, "f8", np.nan, unit, meaning)
            for name, unit, meaning in (
                ("elevation_deg", "deg", "elevation above the local horizon, -90..90"),
                ("azimuth_deg", "deg", "azimuth from north by east, 0..360"),
                ("x_ecef_m", "m", "satellite position at transmission, earth-fixed at reception"),
                ("y_ecef_m", "m", "as x_ecef_m, y"),
                ("z_ecef_m", "m", "as x_ecef_m, z"),
                ("sigma_flt_m", "m", "1-sigma of fast and long-term correction residuals"),
                ("sigma_uire_m", "m", "1-sigma of the ionospheric residual on the slant path"),
                ("sigma_air_m", "m", "1-sigma of the airborne receiver"),
                ("sigma_tropo_m", "m", "1-sigma of the tropospheric residual"),
                ("sigma_m", "m", "1-sigma of the whole range error: root of the summed squares"),
                ("residual_m", "m", "code residual after the fit: measured less predicted"),
                ("mdb_m", "m", "minimal detectable bias of the code measurement"),
            )
        ),
        Column("used", "bool", False, "", "the satellite was in the position solution"),
        Column("reason", "category", None, "", "why it was left out; empty where it was used"),
    )
}
"""Every documented column beside `time`; further ones carry the prefix `x_`."""


def satellite_table(time: np.ndarray[Any, Any], columns: Mapping[str, Any]) -> pd.DataFrame:
    """A satellite table of (n,) GPS times and (n,) columns; documented ones only, any subset.

    Raises
    ------
    InputError : a column that is not documented and has no prefix `x_`, or has another dtype.
    """
    table = pd.DataFrame({"time": np.asarray(time, "M8[ns]"), **columns}, copy=False)
    for name in columns:
        column = SATELLITE_COLUMNS.get(name)
        if column is None:
            if not name.startswith("x_"):
                raise InputError(
                    f"column {name!r} of the satellite table is not documented",
                    cure=f"rename it to 'x_{name}', or to one of {', '.join(SATELLITE_COLUMNS)}",
                )
            continue
        dtype = table[name].dtype
        is_category = isinstance(dtype, pd.CategoricalDtype)
        if not (is_category if column.dtype == "category" else dtype == np.dtype(column.dtype)):
            raise InputError(
                f"column {name!r} of the satellite table has the wrong type",
                evidence=f"{dtype}, expected {column.dtype}",
            )
    return table
