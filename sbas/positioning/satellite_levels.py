"""Protection levels from the satellites that any recording names, with their variances.

A third way beside a receiver's own levels and those of `protect`: SBF logs give the variances in
GEOCorrections, outputs of gLAB in SBASVAR. Source: RTCA DO-229D, J.1.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.positioning.normal_equations import fix_geometry, full_matrices
from sbas.positioning.protection_levels import horizontal_level_m, vertical_level_m
from sbas.positioning.used_satellites import used_satellites
from sbas.recording import ProtectionLevelMeta, Recording

Floats = NDArray[np.float64]


def levels_from_satellites(recording: Recording, *, k_h: float, k_v: float) -> Recording:
    """The same recording with HPL and VPL formed anew from its satellites.

    Parameters
    ----------
    recording : with the side table `satellites`: `elevation_deg`, `azimuth_deg`, `sigma_m` (1-sigma
        of the range error, all terms) and `used`.
    k_h, k_v : factors, such as 6.0 (precision approach) or 6.18, and 5.33.

    Returns
    -------
    Recording with new `hpl_m`, `vpl_m`, `sigma_e_m`, `sigma_n_m`, `sigma_u_m`, `cov_en_m2` and
    `n_sv`. Levels are missing where fewer than four satellites were used, where the geometry is
    degenerate, and where the satellites do not make up the fix: one without direction or sigma,
    one named twice, or one that is neither GPS nor SBAS. All are counted in its findings.

    Raises
    ------
    InputError : no side table `satellites`, or one without these columns.

    References
    ----------
    RTCA DO-229D, J.1.
    """
    used = used_satellites(recording)
    n = used.time.size
    geometry = fix_geometry(used.g, used.sigma_m, used.epoch, n)
    covariance = full_matrices(geometry.covariance_m2)
    covariance[used.unsound] = np.nan
    at = np.searchsorted(used.time, recording.time)
    inside = np.flatnonzero(at < n)
    at[inside[used.time[at[inside]] != recording.time[inside]]] = n

    def of_table(values: Floats) -> Floats:
        return np.append(values, np.nan)[at]

    hpl = of_table(horizontal_level_m(covariance, k_h))
    columns = {
        "hpl_m": hpl,
        "vpl_m": of_table(vertical_level_m(covariance, k_v)),
        "sigma_e_m": of_table(np.sqrt(covariance[:, 0, 0])),
        "sigma_n_m": of_table(np.sqrt(covariance[:, 1, 1])),
        "sigma_u_m": of_table(np.sqrt(covariance[:, 2, 2])),
        "cov_en_m2": of_table(covariance[:, 0, 1]),
        "n_sv": np.append(np.bincount(used.epoch, minlength=n), 0)[at].astype(np.int16),
    }
    findings = list(recording.meta.findings)
    missing = int(np.isnan(hpl).sum())
    if missing:
        why = {
            "no satellite": int((at == n).sum()),
            **used.reasons,
            "fewer than four satellites, or a degenerate geometry": int(
                (~geometry.solved & ~used.unsound).sum()
            ),
        }
        findings.append(
            Finding(
                "E10",
                "warning",
                f"{missing:,} of {len(recording):,} epochs have no level from their satellites",
                evidence="; ".join(f"{text}: {n:,} epochs" for text, n in why.items() if n),
            )
        )
    meta = replace(
        recording.meta,
        pl=ProtectionLevelMeta("do229", k_h=k_h, k_v=k_v),
        findings=tuple(findings),
        options={**recording.meta.options, "levels_from_satellites": f"k_h {k_h}, k_v {k_v}"},
    )
    return recording.replace(table=recording.table.assign(**columns), meta=meta)
