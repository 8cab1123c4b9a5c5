"""Variance of a range after SBAS corrections: the fast and long-term part.

Source: RTCA DO-229D, A.4.5.1 and J.2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WITHOUT_DEGRADATION_M = 8.0
"""Added where no type 10 message holds (non-precision approach)."""
FALLBACK_SIGMA_M = 60.0
"""gLAB's sigma of a satellite without corrections (non-precision approach)."""


def sigma_flt_m(
    sigma_udre_m: Floats,
    delta_udre: Floats,
    eps_fc_m: Floats,
    eps_rrc_m: Floats,
    eps_ltc_m: Floats,
    eps_er_m: Floats,
    *,
    root_sum_square: Bools,
    degraded: Bools,
) -> Floats:
    """(n,) 1-sigma of fast and long-term correction residuals [m].

    Parameters
    ----------
    root_sum_square : RSS_UDRE of the type 10 message: terms are added as squares.
    degraded : False where no type 10 message holds: 8 m are added instead of its terms.
    """
    base = sigma_udre_m * delta_udre
    terms = (eps_fc_m, eps_rrc_m, eps_ltc_m, eps_er_m)
    linear = base + sum(terms)
    squares = np.sqrt(base**2 + sum(term**2 for term in terms))
    with_terms = np.where(root_sum_square, squares, linear)
    sigma: Floats = np.where(degraded, with_terms, base + WITHOUT_DEGRADATION_M)
    return sigma
