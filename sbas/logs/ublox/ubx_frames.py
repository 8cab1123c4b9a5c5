"""Raw SBAS frames in RXM-SFRBX and the older RXM-SFRB: 250 bits, CRC-24Q, and their times.

Neither message has a time; a frame gets that of the last epoch before it in the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.logs.checksums import crc24q_of_rows
from sbas.logs.ublox import ubx_messages as ubx
from sbas.logs.ublox.ubx_framing import Frames
from sbas.logs.ublox.ubx_messages import MESSAGES, SFRBX_SBAS
from sbas.logs.ublox.ubx_times import Anchors, gps_times

_GNSS_SBAS = 1
_WORDS = 8
_FIRST_PRN, _LAST_PRN = 120, 158
_L1 = 0


@dataclass(frozen=True)
class SbasFrames:
    """SBAS frames in file order.

    Parameters
    ----------
    position : (n,) place of the message in the file.
    prn : (n,) PRN, -1 where the number is no SBAS satellite's.
    on_l1 : (n,) whether the message names the signal L1 C/A.
    words : (n, 8) words of 32 bits, the first received bit the most significant one of word 0.
    other : messages of SBAS satellites with another number of words, which were left out.
    """

    position: NDArray[np.int64]
    prn: NDArray[np.int16]
    on_l1: NDArray[np.bool_]
    words: NDArray[np.uint32]
    other: int = 0

    @classmethod
    def none(cls) -> SbasFrames:
        return cls(
            np.empty(0, np.int64),
            np.empty(0, np.int16),
            np.empty(0, np.bool_),
            np.empty((0, _WORDS), np.uint32),
        )


def sbas_frames(frames: Frames) -> SbasFrames:
    """The SBAS frames among the messages of a stretch of the file."""
    new, old = _of_sfrbx(frames), _of_sfrb(frames)
    if not len(old.position):
        return new
    order = np.argsort(np.concatenate([new.position, old.position]), kind="stable")
    return SbasFrames(
        np.concatenate([new.position, old.position])[order],
        np.concatenate([new.prn, old.prn])[order],
        np.concatenate([new.on_l1, old.on_l1])[order],
        np.concatenate([new.words, old.words])[order],
        new.other,
    )


def _of_sfrbx(frames: Frames) -> SbasFrames:
    head = MESSAGES[ubx.RXM_SFRBX]
    start, _ = ubx.long_enough(frames, ubx.RXM_SFRBX, head.shortest)
    raw = ubx.read_fields(frames, start, head, ("gnss", "n_words"))
    of_sbas = raw["gnss"] == _GNSS_SBAS
    whole = of_sbas & (raw["n_words"] == _WORDS)
    start, _ = ubx.long_enough(frames, ubx.RXM_SFRBX, SFRBX_SBAS.shortest)
    start = np.intersect1d(raw["position"][whole], start, assume_unique=True)
    raw = ubx.read_fields(frames, start, SFRBX_SBAS, ("prn", "signal", "words"))
    other = int(np.count_nonzero(of_sbas)) - len(start)
    return SbasFrames(start, _prn(raw["prn"]), raw["signal"] == _L1, raw["words"], other)


def _of_sfrb(frames: Frames) -> SbasFrames:
    """RXM-SFRB: words 0 to 6 as they are; word 7 holds the last 32 of the 250 bits.

    Its upper 6 bits repeat the lower 6 of word 6. Found on 482 frames of a real file, of which
    all pass CRC-24Q then.
    """
    message = MESSAGES[ubx.RXM_SFRB]
    start, _ = ubx.long_enough(frames, ubx.RXM_SFRB, message.shortest)
    raw = ubx.read_fields(frames, start, message, ("prn", "words"))
    of_sbas = (raw["prn"] >= _FIRST_PRN) & (raw["prn"] <= _LAST_PRN)
    words = raw["words"][of_sbas]
    words[:, 7] <<= 6
    prn = _prn(raw["prn"][of_sbas])
    return SbasFrames(raw["position"][of_sbas], prn, np.ones(len(prn), np.bool_), words)


def _prn(number: NDArray[np.uint8]) -> NDArray[np.int16]:
    known = (number >= _FIRST_PRN) & (number <= _LAST_PRN)
    return np.where(known, number.astype(np.int16), np.int16(-1))


def frame_crc_passed(words: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """(n,) whether frames of (n, 8) words pass CRC-24Q over their 226 bits (DO-229, A.4.3.3)."""
    shifted = words >> 6
    shifted[:, 1:] |= words[:, :-1] << 26
    # A message followed by its own CRC leaves no remainder, and zeros in front change nothing.
    rows = shifted.astype(">u4").view(np.uint8).reshape(len(words), 32)
    passed: NDArray[np.bool_] = crc24q_of_rows(rows) == 0
    return passed


@dataclass(frozen=True)
class Timed:
    """Frames with the time [ms] of the last epoch before them, -1 before the first."""

    frames: SbasFrames
    time_ms: NDArray[np.int64]

    @classmethod
    def of(cls, frames: SbasFrames, anchors: Anchors) -> Timed:
        return cls(frames, anchors.before(frames.position))


def frame_table(pieces: Sequence[Timed], first_ms: int) -> pd.DataFrame | None:
    """Side table `sbas_frames`; None where there is no frame.

    Parameters
    ----------
    pieces : frames in file order.
    first_ms : time of the first epoch of the file, for the frames before it; -1 for none, and
        those frames have no time.
    """
    count = sum(len(piece.time_ms) for piece in pieces)
    if not count:
        return None
    time_ms = np.concatenate([piece.time_ms for piece in pieces])
    time_ms[time_ms < 0] = first_ms
    words = np.concatenate([piece.frames.words for piece in pieces])
    on_l1 = np.concatenate([piece.frames.on_l1 for piece in pieces])
    data = pa.py_buffer(words.astype(">u4").tobytes())
    array = pa.FixedSizeBinaryArray.from_buffers(pa.binary(32), count, [None, data])
    return pd.DataFrame(
        {
            "time": gps_times(time_ms),
            "prn": np.concatenate([piece.frames.prn for piece in pieces]),
            "crc_passed": frame_crc_passed(words),
            "signal": pd.Categorical.from_codes(
                np.where(on_l1, 0, -1).astype(np.int8), categories=["L1"]
            ),
            "frame": pd.arrays.ArrowExtensionArray(pa.chunked_array([array])),
        },
        copy=False,
    )
