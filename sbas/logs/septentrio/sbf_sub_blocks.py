"""Blocks that hold a row a satellite: found by the lengths that each block itself states.

PVTSatCartesian 4008 (PolaRx5TR Reference Guide 5.5.0, p. 406-407), PVTResiduals 4009 version 2
(p. 408-411) and GEOCorrections 5935 (p. 413-414). All blocks of a chunk lie in one array of
bytes, in which the sub-blocks are places; no loop goes over blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_epochs import Index, block_times
from sbas.logs.septentrio.sbf_framing import Group

Bytes = NDArray[np.uint8]
Raw = dict[str, NDArray[Any]]

CODE, PHASE, DOPPLER = 4, 8, 16
"""Bits of MeasInfo: which residuals follow."""
DOUBLE_DIFFERENCE = 2
"""MeasInfo & 3 of a residual against another satellite's."""

_FIRST = {sbf.SATELLITE_POSITIONS: 16, sbf.RESIDUALS: 20, sbf.GEO_CORRECTIONS: 16}
_LEAST = {sbf.SATELLITE_POSITIONS: 28, sbf.RESIDUALS: 6, sbf.GEO_CORRECTIONS: 48}
"""Bytes of a sub-block up to the last field that every receiver writes."""
_LEAST_RESIDUAL = 8
_VARIANCES = 48
_VARIANCES_END = 64
_PADDING = 4
"""A block ends with fewer bytes of padding than this, since its length is a multiple of it."""
_FOLLOWING = np.array([bin(info & (CODE | PHASE | DOPPLER)).count("1") for info in range(256)])


@dataclass(frozen=True)
class SubBlocks:
    """Blocks of one number and their sub-blocks, both in file order.

    Parameters
    ----------
    blocks : `position` and `time_ms` of (b,) blocks.
    count : (b,) sub-blocks of each.
    rows : fields of all (m,) sub-blocks, raw.
    """

    blocks: Raw
    count: Index
    rows: Raw

    def part(self, low: int, high: int) -> SubBlocks:
        """The blocks [low, high)."""
        ends = np.concatenate(([0], np.cumsum(self.count)))
        first, last = int(ends[low]), int(ends[high])
        return SubBlocks(
            {name: values[low:high] for name, values in self.blocks.items()},
            self.count[low:high],
            {name: values[first:last] for name, values in self.rows.items()},
        )


def concatenate_sub_blocks(parts: Sequence[SubBlocks]) -> SubBlocks:
    """Parts of one number as one, in the order given."""
    if len(parts) == 1:
        return parts[0]
    return SubBlocks(
        {name: np.concatenate([p.blocks[name] for p in parts]) for name in parts[0].blocks},
        np.concatenate([p.count for p in parts]),
        {name: np.concatenate([p.rows[name] for p in parts]) for name in parts[0].rows},
    )


def read_sub_blocks(number: int, groups: Sequence[Group]) -> tuple[SubBlocks, int, int]:
    """Sub-blocks of all blocks of one number in a chunk.

    Parameters
    ----------
    number : SATELLITE_POSITIONS, RESIDUALS or GEO_CORRECTIONS.
    groups : blocks of this number, one or more groups.

    Returns
    -------
    SubBlocks; how many blocks carry no usable time; how many were left out because their
    sub-blocks do not add up to their length.
    """
    flat = np.concatenate([group.rows.reshape(-1) for group in groups])
    length = np.repeat([g.rows.shape[1] for g in groups], [len(g.rows) for g in groups])
    start = np.cumsum(length) - length
    position = np.concatenate([group.position for group in groups])
    if len(groups) > 1:
        order = np.argsort(position, kind="stable")
        position, start, length = position[order], start[order], length[order]
    time_ms = block_times(_fields(flat, start + 8, "<u4"), _fields(flat, start + 12, "<u2"))
    long_enough = length >= _FIRST[number]
    keep = (time_ms >= 0) & long_enough
    untimed = int(np.count_nonzero(time_ms < 0))
    unfit = int(np.count_nonzero((time_ms >= 0) & ~long_enough))
    if not keep.all():
        position, start, length, time_ms = (a[keep] for a in (position, start, length, time_ms))
    if number == sbf.RESIDUALS:
        at, count, fits = _walk(flat, start, length)
    else:
        at, count, fits = _evenly_spaced(flat, start, length, number)
    unfit += int(np.count_nonzero(~fits))
    owner_size = np.repeat(flat[start + 15][fits], count[fits])
    if number == sbf.RESIDUALS:
        residual_size = np.repeat(flat[start + 16][fits], count[fits])
        rows = _residual_rows(flat, at, owner_size, residual_size)
    elif number == sbf.SATELLITE_POSITIONS:
        rows = {"svid": flat[at], "xyz": _fields(flat, at + 4, "(3,)<f8")}
    else:
        rows = _correction_rows(flat, at, owner_size)
    blocks = {"position": position[fits], "time_ms": time_ms[fits]}
    return SubBlocks(blocks, count[fits], rows), untimed, unfit


def _fields(flat: Bytes, at: Index, dtype: str) -> NDArray[Any]:
    """(n, ...) values of one type that begin at (n,) places."""
    kind = np.dtype(dtype)
    if not len(at):
        return np.empty((0, *kind.shape), kind.base)
    rows = sliding_window_view(flat, kind.itemsize)[at]
    return rows.view(kind.base).reshape(-1, *kind.shape)


def _evenly_spaced(
    flat: Bytes, start: Index, length: Index, number: int
) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Places of sub-blocks of one length, their count a block, and whether each block fits."""
    count, size = flat[start + 14].astype(np.int64), flat[start + 15].astype(np.int64)
    rest = length - _FIRST[number] - count * size
    fits = (rest >= 0) & (rest < _PADDING) & ((size >= _LEAST[number]) | (count == 0))
    kept = np.where(fits, count, 0)
    step = np.arange(int(kept.sum())) - np.repeat(np.cumsum(kept) - kept, kept)
    at = np.repeat(start + _FIRST[number], kept) + step * np.repeat(size, kept)
    return at, count, fits


def _walk(flat: Bytes, start: Index, length: Index) -> tuple[Index, Index, NDArray[np.bool_]]:
    """As `_evenly_spaced` for PVTResiduals, whose sub-blocks carry further ones behind them.

    The loop goes over the place within a block, for all blocks at once: where the next signal
    lies is known only from the one before.
    """
    count, size = flat[start + 14].astype(np.int64), flat[start + 15].astype(np.int64)
    size_2 = flat[start + 16].astype(np.int64)
    end = start + length
    cursor = start + _FIRST[sbf.RESIDUALS]
    fits = (size >= _LEAST[sbf.RESIDUALS]) | (count == 0)
    most = int(count.max(initial=0))
    places = np.zeros((len(start), most), np.int64)
    for signal in range(most):
        open_ = fits & (count > signal) & (cursor + size <= end)
        fits &= open_ | (count <= signal)
        at = np.where(open_, cursor, 0)
        following = _FOLLOWING[flat[at + 5]]
        fits &= ~open_ | (following == 0) | (size_2 >= _LEAST_RESIDUAL)
        places[:, signal] = at
        cursor = np.where(open_, cursor + size + following * size_2, cursor)
    fits &= (cursor <= end) & (end - cursor < _PADDING)
    inside = (np.arange(most) < count[:, None]) & fits[:, None]
    return places[inside], count, fits


def _residual_rows(flat: Bytes, at: Index, size: Bytes, size_2: Bytes) -> Raw:
    """Fields of (m,) signals and of their code residuals, do-not-use where none follows."""
    info = flat[at + 5]
    with_code = (info & CODE) != 0
    code = _fields(flat, (at + size)[with_code], "<f4, <u2, <u2")
    residual = np.full(len(at), sbf.FLOAT_MISSING, np.float32)
    w, mdb = np.full(len(at), 65535, np.uint16), np.full(len(at), 65535, np.uint16)
    for values, name in ((residual, "f0"), (w, "f1"), (mdb, "f2")):
        values[with_code] = code[name]
    return {"svid": flat[at], "signal": flat[at + 2], "info": info,
            "residual": residual, "w": w, "mdb": mdb}  # fmt: skip


def _correction_rows(flat: Bytes, at: Index, size: Bytes) -> Raw:
    """Fields of (m,) satellites; the sub-block of 2008 ends before the variances."""
    present = size >= _VARIANCES_END
    variances = np.zeros((len(at), 4), np.float32)
    variances[present] = _fields(flat, at[present] + _VARIANCES, "(4,)<f4")
    return {"svid": flat[at], "with_variances": present, "variances": variances}
