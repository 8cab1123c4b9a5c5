"""Protection levels for another target risk: the same sigma, another K."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.integrity.exposure.exposure import require


def railway_hpl(hpl_m: ArrayLike, *, k_from: float, k_to: float) -> NDArray[np.float64]:
    """HPL of a receiver re-scaled to the K of a railway target.

    Parameters
    ----------
    hpl_m : scalar or array [m], HPL as logged, NaN where missing (stays NaN).
    k_from : K that the receiver used: 6.18 (non-precision approach) or 6.0 (precision approach).
    k_to : K of the railway target, such as `k_models(...).k`.

    Returns
    -------
    float64 array of the same shape [m]: hpl_m * k_to/k_from, since HPL = K d_major.

    Raises
    ------
    InputError : a K that is not a finite number above 0.

    Notes
    -----
    Only the integrity multiplier changes: sigma, and whatever bias bounds the receiver put into
    it, are taken as they are. 6.0 is meant for one dimension in 150 s: the HPL of the two modes
    do not bound the same risk until both are scaled to one target.

    References
    ----------
    RTCA DO-229 appendix J: HPL = K_H d_major; Filip, Bazant, Mocek 2010, eq. 1.
    """
    require("k_from", k_from, above=0)
    require("k_to", k_to, above=0)
    scaled: NDArray[np.float64] = np.asarray(hpl_m, dtype=np.float64) * (k_to / k_from)
    return scaled
