"""What an epoch's level is worth: usable or not, and which K factor made it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.recording import COLUMNS, MODES, EpochSource, ProtectionLevelMeta, left_out_levels

Floats = NDArray[np.float64]

MODE_K_H = {"sbas_pa": 6.0, "sbas_npa": 6.18}
"""Horizontal K factors of the two modes; DO-229D, J.1; Filip, Bazant, Mocek 2010, 2.1."""


def whole_table(source: EpochSource, columns: Sequence[str]) -> pd.DataFrame:
    """All epochs of a source with just these columns, those that it lacks filled as missing."""
    batches = list(source.batches(columns))
    table = batches[0] if len(batches) == 1 else pd.concat(batches)
    # Batches of a file may know different labels; joined they would be plain text.
    lost = [name for name in columns if COLUMNS[name].dtype == "category"]
    lost = [name for name in lost if not isinstance(table[name].dtype, pd.CategoricalDtype)]
    return table.astype(dict.fromkeys(lost, "category"))


def usable_hpl_m(table: pd.DataFrame) -> Floats:
    """(n,) HPL [m], NaN where it is none of SBAS or declared invalid.

    Parameters
    ----------
    table : epochs with the columns `hpl_m`, `flags` and `mode`.
    """
    return np.where(left_out_levels(table), np.nan, table["hpl_m"].to_numpy())


def mode_codes(table: pd.DataFrame) -> NDArray[np.int8]:
    """(n,) indices into `MODES`, -1 where the mode is missing."""
    codes: NDArray[np.int8] = table["mode"].cat.codes.to_numpy()
    return codes


def k_of_modes(level: ProtectionLevelMeta, usual: int) -> Floats:
    """(m + 1,) horizontal K factor behind the HPL of each of `MODES`; the last is no mode stated.

    Parameters
    ----------
    level : what the recording states; its K belongs to the usual mode, and the two modes of
        DO-229 have their own everywhere else.
    usual : index of the mode that most epochs have, -1 where most state none.

    Notes
    -----
    NaN where K is not known: levels that RAIM or the receiver's own method made have none of
    this kind.
    """
    k = np.full(len(MODES) + 1, np.nan)
    if level.kind not in ("do229", "unknown"):
        return k
    for mode, value in MODE_K_H.items():
        k[MODES.index(mode)] = value
    if level.k_h is not None:
        k[usual] = level.k_h
    return k


def k_of_epochs(table: pd.DataFrame, level: ProtectionLevelMeta) -> Floats:
    """(n,) horizontal K factor behind each epoch's HPL [1]; NaN where it is not known.

    Parameters
    ----------
    table : epochs with the column `mode`.
    level : what the recording states, see `k_of_modes`.
    """
    codes = mode_codes(table)
    usual = int(np.bincount(codes + 1).argmax()) - 1 if codes.size else -1
    k: Floats = k_of_modes(level, usual)[codes]
    return k
