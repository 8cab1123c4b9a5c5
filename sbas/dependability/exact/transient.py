"""A chain over the mission: expectations at every epoch, and first passages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.transitions import Chain, Floats
from sbas.exceptions import SbasError

_DENSE = 80
"""States up to which powers of the whole matrix are cheaper than one step at a time."""
_BLOCK = 128
_MASS_TOLERANCE = 1e-9


def matrix_of(chain: Chain, stage: int = 0) -> Any:
    """The moves of a stage as a sparse matrix (S, S), rows from, columns to."""
    from scipy.sparse import csr_array

    # 32-bit indices where they do: products then read two thirds of the bytes.
    kind = np.int32 if len(chain.targets) < 2**31 else np.int64
    parts = (chain.values[stage], chain.targets.astype(kind), chain.indptr.astype(kind))
    return csr_array(parts, shape=(chain.size, chain.size))


def expectations(
    start: Floats, matrices: Sequence[Any], ends: Sequence[int], columns: Sequence[Floats]
) -> Floats:
    """Expectations of functions of the state at the epochs 0..N.

    Parameters
    ----------
    start : (S,) law at epoch 0; it may lack mass.
    matrices : for each stage, (S, S) sparse moves, none negative.
    ends : for each stage, the epoch at which it ends; the last is N.
    columns : for each stage, (S, K) functions, used at the epochs that its moves leave (and at
        epoch N those of the last stage).

    Returns
    -------
    (N + 1, K).

    Notes
    -----
    Only sums and products of numbers that are not negative: errors stay relative, at any
    magnitude.
    """
    parts, law, begin = [], start, 0
    for matrix, end, column in zip(matrices, ends, columns, strict=True):
        values, law = _stage(law, matrix, end - begin, column)
        parts.append(values)
        begin = end
    return np.concatenate([*parts, (law @ columns[-1])[None, :]])


def _stage(law: Floats, matrix: Any, steps: int, columns: Floats) -> tuple[Floats, Floats]:
    values = np.empty((steps, columns.shape[1]))
    if len(law) <= _DENSE:
        return _dense_stage(law, matrix.toarray(), values, columns)
    back = matrix.T.tocsr()
    laws = np.empty((min(_BLOCK, max(steps, 1)), len(law)))
    for begin in range(0, steps, len(laws)):
        count = min(len(laws), steps - begin)
        for i in range(count):
            laws[i] = law
            law = back @ law
        values[begin : begin + count] = laws[:count] @ columns
    return values, law


def _dense_stage(
    law: Floats, matrix: Floats, values: Floats, columns: Floats
) -> tuple[Floats, Floats]:
    """Blocks of 2, 4, 8, ... epochs, each from the one before by one power of the matrix."""
    steps = len(values)
    block, power = law[None, :], matrix
    while len(block) < _BLOCK * 8 and len(block) < steps:
        block = np.concatenate([block, block @ power])
        power = power @ power
    for begin in range(0, steps, len(block)):
        count = min(len(block), steps - begin)
        values[begin : begin + count] = block[:count] @ columns
        if count < len(block):
            return values, block[count]
        block = block @ power
    return values, block[0] if steps else law


def first_passage(chain: Chain, into: NDArray[np.bool_]) -> Floats:
    """Probability to have been in some states at one of the epochs 1..n.

    Parameters
    ----------
    chain : any.
    into : (S,) the states.

    Returns
    -------
    (N + 1,) cumulative, 0 at epoch 0.

    Notes
    -----
    The mass that enters is summed; 1 - the mass left would cancel. A start within the states
    does not count, a stay does.
    """
    stay = np.flatnonzero(~into | (chain.start > 0.0))
    target = np.where(into, 0.0, 1.0)
    matrices, columns = [], []
    for stage in range(len(chain.values)):
        matrix = matrix_of(chain, stage)
        columns.append((matrix @ into.astype(float))[stay][:, None])
        kept = matrix.multiply(target[None, :]).tocsr()[stay][:, stay]
        kept.eliminate_zeros()
        matrices.append(kept)
    entering = expectations(chain.start[stay], matrices, chain.ends, columns)[:-1, 0]
    return np.concatenate([[0.0], np.cumsum(entering)])


def check_mass(total: float) -> None:
    """Raise where probability was lost or made.

    Raises
    ------
    SbasError : the law at the end of the mission does not sum to 1 within 1e-9.
    """
    if not abs(total - 1.0) < _MASS_TOLERANCE:
        raise SbasError(
            "probabilities at the end of the mission do not sum to 1",
            evidence=f"sum {total!r}",
            cure="report this model; a shorter mission or a longer step_s may pass",
        )
