"""Rows that papers print about the GNSS + eddy current sensor unit, with where they stand."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PublishedRows:
    """What a paper prints for one environment; each the mean probability over the mission [1].

    Parameters
    ----------
    environment : its name.
    top : service failure.
    be1 : fusion hardware failed.
    ie1 : ECS and GNSS missing together for T1.
    ie2 : GNSS missing for T2.
    ie5 : k consecutive wrong positions.
    ie6 : ECS failed, then l consecutive wrong positions.
    single_gnss_availability : share of correct positions of the receiver alone.
    unit_availability : of the whole unit.
    source : document, table and how misprints were read.
    """

    environment: str
    top: float
    be1: float
    ie1: float
    ie2: float
    ie5: float
    ie6: float
    single_gnss_availability: float
    unit_availability: float
    source: str


_TABLES = "Nguyen, Beugin, Marais, ITST 2013 (hal-00930588), Tables II and III"
_BE1 = 3.42e-6
"""One value for all environments. Another rendering of the text shows 2.49e-6, but only with
3.42e-6 do the urban rows add up to the printed top."""

PUBLISHED: dict[str, PublishedRows] = {
    rows.environment: rows
    for rows in (
        PublishedRows("urban", 1.65e-4, _BE1, 8.34e-11, 4.1e-6, 1.57e-4, 1.63e-8,
                      0.9388, 0.9998, _TABLES),
        PublishedRows("tunnel", 1.53e-2, _BE1, 6.63e-7, 1.53e-2, 0.0, 0.0, 0.1557, 0.9847,
                      f"{_TABLES}; unit availability of the text (98.47 = 100 - 1.53), "
                      "Table III prints 98.45"),
        PublishedRows("woody", 7.59e-2, _BE1, 7.4e-10, 4.1e-6, 7.59e-2, 2.73e-7,
                      0.6023, 0.9241, _TABLES),
        PublishedRows("cutting", 7.17e-4, _BE1, 3e-9, 4.1e-6, 7.1e-4, 2.95e-8,
                      0.8776, 0.9993, _TABLES),
    )
}  # fmt: skip
"""Tables II and III of the paper by environment."""
