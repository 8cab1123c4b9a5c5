"""Stanford regions against the convention of Walter's hplstat.m (methods: section 9, exact)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.integrity.stanford import REGIONS, stanford_regions

ANY = st.floats(allow_nan=True, allow_infinity=True)


@pytest.mark.parametrize(
    ("error", "level", "region"),
    [
        (1, 5, 0), (1, 40, 1), (5, 5, 3), (40, 40, 2), (50, 45, 2), (45, 50, 1), (40, 39.9, 4),
        (39, 38, 3), (41, 39.99, 4), (np.nan, 5, 5), (1, np.nan, 5), (1, np.inf, 5),
    ],
)  # fmt: skip
def test_published_cases_at_40_m(error: float, level: float, region: int) -> None:
    assert stanford_regions([error], [level], 40.0).tolist() == [region]


@given(st.lists(st.tuples(ANY, ANY), min_size=1), st.floats(0.1, 1e3))
def test_every_epoch_has_one_region_and_no_unsafe_one_is_called_nominal(
    pairs: list[tuple[float, float]], limit: float
) -> None:
    error, level = np.array(pairs).T
    codes = stanford_regions(error, level, limit)
    assert np.bincount(codes, minlength=len(REGIONS)).sum() == len(pairs)
    for e, pl, code in zip(error, level, codes, strict=True):
        if code == 0:
            assert e < pl < limit
        if np.isfinite(e) and np.isfinite(pl) and e >= limit > pl:
            assert REGIONS[code] == "hmi"
