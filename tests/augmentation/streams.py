"""Streams of messages as a plain receiver takes them, encoded as a file has them."""

from __future__ import annotations

import numpy as np

from sbas.augmentation.messages import SbasMessages, checked_messages
from tests.augmentation import encoding as enc
from tests.augmentation.fast_reference import (
    Alarm,
    Damaged,
    Factors,
    Fast,
    Integrity,
    Mask,
    Message,
    Parameters,
)


def encoded(message: Message) -> bytes:
    if isinstance(message, Mask):
        return enc.mask(message.iodp, message.slots)
    if isinstance(message, Fast):
        if len(message.prc) == 13:
            kind = 2 + message.first // 13
            return enc.fast(kind, message.iodf, message.iodp, message.prc, message.udrei)
        block = message.first // 13
        return enc.mixed(message.iodf, message.iodp, block, message.prc, message.udrei, [])
    if isinstance(message, Integrity):
        return enc.integrity(message.iodf, message.udrei)
    if isinstance(message, Factors):
        return enc.fast_degradation(message.iodp, message.latency_s, message.ai)
    if isinstance(message, Parameters):
        return enc.degradation(b_rrc=message.b_rrc)
    return enc.alarm() if isinstance(message, Alarm) else enc.null()


def heard(stream: dict[int, Message]) -> SbasMessages:
    """Messages as a file has them: damaged ones with a bit turned over."""
    frames = [bytearray(encoded(message)) for message in stream.values()]
    for frame, message in zip(frames, stream.values(), strict=True):
        if isinstance(message, Damaged):
            frame[12] ^= 4
    n = len(frames)
    return checked_messages(
        np.array([enc.START_S + second for second in stream]),
        np.full(n, enc.PRN),
        np.frombuffer(b"".join(bytes(frame) for frame in frames), np.uint8).reshape(n, 32),
        has_crc=np.ones(n, bool),
    )
