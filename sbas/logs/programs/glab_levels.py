"""Which K factors made gLAB's protection levels: told by its header, held against its variances.

HPL = K_H d_major and VPL = K_V d_U, where d is the 1-sigma of the weighted least squares solution
for position and clock with the weights 1/sigma^2 of the satellites in use. Source: RTCA
DO-229D, J.1 and J.2.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.recording import ProtectionLevelMeta, major_semi_axis_m

USUAL_K_H = {"sbas_pa": 6.0, "sbas_npa": 6.18}
USUAL_K_V = 5.33
_AGREEMENT = 1e-3
"""Relative; elevation, azimuth and sigma have three and four decimals, which leaves 3e-5 in the
reference runs; 6.00 and 6.18 part by 0.03."""
_AGREEING_SHARE = 0.99
_UNKNOWNS = 4
_STATED = re.compile(r"^INFO MODELLING SBAS K([hv]) factor (PA|NPA):\s*([0-9.]+)", re.MULTILINE)


def stated_factors(info: str) -> dict[tuple[str, str], float]:
    """K factors that the INFO lines of a run state, by ("h" or "v", mode)."""
    modes = {"PA": "sbas_pa", "NPA": "sbas_npa"}
    return {(axis, modes[mode]): float(value) for axis, mode, value in _STATED.findall(info)}


def deviations_m(satellites: pd.DataFrame) -> pd.DataFrame:
    """1-sigma of the solution of each epoch, of its satellites in use.

    Parameters
    ----------
    satellites : satellite table with elevation, azimuth and `sigma_m`.

    Returns
    -------
    Columns `major_m` and `up_m`, indexed by time. Epochs with another system than GPS (its clock
    is a further unknown), with fewer than five satellites, or with a satellite without variance
    are left out.
    """
    used = satellites[satellites["used"]]
    is_gps = used["satellite"].astype("str").str.startswith("G").to_numpy()
    complete = used[["elevation_deg", "azimuth_deg", "sigma_m"]].notna().all(axis=1).to_numpy()
    sigma = used["sigma_m"].to_numpy()
    times, row = np.unique(used["time"].to_numpy(), return_inverse=True)
    good = np.bincount(row, ~(is_gps & complete & (sigma > 0)), len(times)) == 0
    good &= np.bincount(row, minlength=len(times)) > _UNKNOWNS
    inside = good[row]
    used, sigma, row = used[inside], sigma[inside], (np.cumsum(good) - 1)[row[inside]]
    elevation, azimuth = np.radians(used[["elevation_deg", "azimuth_deg"]].to_numpy().T)
    sight = np.stack([
        np.cos(elevation) * np.sin(azimuth),
        np.cos(elevation) * np.cos(azimuth),
        np.sin(elevation),
        np.ones(len(sigma)),
    ])  # fmt: skip
    count = int(np.count_nonzero(good))
    normal = np.empty((count, _UNKNOWNS, _UNKNOWNS))
    for i in range(_UNKNOWNS):
        for j in range(i, _UNKNOWNS):
            term = sight[i] * sight[j] / sigma**2
            normal[:, i, j] = normal[:, j, i] = np.bincount(row, term, count)
    solvable = np.linalg.cond(normal) < 1e12 if count else np.zeros(0, bool)
    covariance = np.linalg.inv(normal[solvable])
    east, north, up = (np.sqrt(covariance[:, i, i]) for i in range(3))
    return pd.DataFrame(
        {"major_m": major_semi_axis_m(east, north, covariance[:, 0, 1]), "up_m": up},
        index=pd.DatetimeIndex(times[good][solvable], name="time"),
    )


def protection_level_meta(
    epochs: pd.DataFrame, satellites: pd.DataFrame | None, stated: Mapping[tuple[str, str], float]
) -> tuple[ProtectionLevelMeta, tuple[Finding, ...]]:
    """Kind and K factors of the levels of single-frequency SBAS epochs.

    What the header states is checked against the variances where the file has them; without a
    header the variances tell it. Where both modes occur, K_H is that of the usual mode.

    Parameters
    ----------
    epochs : columns `hpl_m`, `vpl_m` and `mode`, SBAS epochs of single frequency only.
    satellites : satellite table, None where there is none.
    stated : `stated_factors` of the run.
    """
    found: dict[tuple[str, str], float | None] = {}
    findings: list[Finding] = []
    sigmas = None
    if satellites is not None and "sigma_m" in satellites:
        sigmas = deviations_m(satellites)
    modes = [mode for mode in USUAL_K_H if (epochs["mode"] == mode).any()]
    for mode in modes:
        table = epochs[(epochs["mode"] == mode).to_numpy()]
        for axis, level, sigma, usual in (
            ("h", "hpl_m", "major_m", USUAL_K_H[mode]),
            ("v", "vpl_m", "up_m", USUAL_K_V),
        ):
            said = stated.get((axis, mode))
            found[axis, mode] = said
            if sigmas is None:
                continue
            ratio = (table[level] / sigmas[sigma].reindex(table.index)).dropna().to_numpy()
            if not len(ratio):
                continue
            k = usual if said is None else said
            if np.mean(np.abs(ratio / k - 1) < _AGREEMENT) >= _AGREEING_SHARE:
                found[axis, mode] = k
            else:
                found[axis, mode] = None
                findings.append(_contradicted(level, mode, k, ratio))
    usual_mode = max(modes, key=lambda m: int((epochs["mode"] == m).sum()), default="")
    meta = ProtectionLevelMeta(
        kind="unknown" if findings else "do229",
        k_h=found.get(("h", usual_mode)),
        k_v=found.get(("v", usual_mode)),
    )
    return meta, tuple(findings)


def _contradicted(level: str, mode: str, k: float, ratio: NDArray[np.float64]) -> Finding:
    return Finding(
        "E23",
        "warning",
        f"{level} of mode {mode} is not K = {k:g} times the standard deviation that the file's own "
        "variances give",
        evidence=f"ratio {np.min(ratio):.4f} .. {np.median(ratio):.4f} .. {np.max(ratio):.4f} in "
        f"{len(ratio):,} epochs",
        cure="do not rely on these levels before it is known which formula made them",
    )
