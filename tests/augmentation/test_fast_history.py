"""Histories and what is looked up in them, against a plain receiver on streams of any kind."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from sbas.augmentation.fast_corrections import FastAt, Profile
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc
from tests.augmentation.fast_reference import Answer, Mask, Message, Receiver, random_stream
from tests.augmentation.streams import heard

SECONDS = 400
SEEDS = range(24)


def replayed(
    stream: dict[int, Message], slot: int, mode: Mode, profile: Profile, epochs: Sequence[int]
) -> list[Answer]:
    """Answers of the plain receiver, asked at every second as a receiver is."""
    receiver = Receiver(slot, mode, profile)
    answers = {}
    for second in range(max(epochs) + 1):
        if second - 1 in stream:
            receiver.receive(second - 1, stream[second - 1])
        answers[second] = receiver.at(second)
    return [answers[second] for second in epochs]


def looked_up(
    timeline: CorrectionTimeline, slot: int, mode: Mode, profile: Profile, epochs: Sequence[int]
) -> FastAt:
    instants = timeline.reception.instants(enc.epochs_ns(*epochs))
    return timeline.fast_corrections(slot, instants, mode=mode, profile=profile)


def assert_same(found: FastAt, wanted: list[Answer]) -> None:
    assert found.reason.tolist() == [answer.reason for answer in wanted]
    assert found.usable.tolist() == [answer.usable for answer in wanted]
    assert found.barred.tolist() == [answer.barred for answer in wanted]
    rows = np.flatnonzero(found.usable)
    for name in ("prc_m", "rrc_m", "eps_fc_m", "eps_rrc_m", "udrei"):
        want = [getattr(wanted[row], name) for row in rows]
        np.testing.assert_allclose(getattr(found, name)[rows], want, rtol=1e-9, atol=1e-9)


@cache
def random_timeline(seed: int) -> tuple[dict[int, Message], CorrectionTimeline]:
    stream = random_stream(seed, SECONDS)
    return stream, correction_timeline(heard(stream))


@pytest.mark.parametrize("profile", ["mops", "glab"])
@pytest.mark.parametrize("mode", ["pa", "npa"])
@pytest.mark.parametrize("seed", SEEDS)
def test_random_streams_give_what_a_plain_receiver_has(
    seed: int, mode: Mode, profile: Profile
) -> None:
    stream, timeline = random_timeline(seed)
    masks = [message.slots for message in stream.values() if isinstance(message, Mask)]
    slots = {masks[0][0], masks[0][-1], masks[-1][0], masks[-1][-1], masks[-1][len(masks[-1]) // 2]}
    epochs = range(SECONDS + 30)
    for slot in sorted(slots):
        found = looked_up(timeline, slot, mode, profile, epochs)
        assert_same(found, replayed(stream, slot, mode, profile, epochs))


def test_random_streams_meet_every_rule() -> None:
    """The comparison would be empty where no stream comes to a rule."""
    met: set[int] = set()
    rates = 0
    for seed in SEEDS:
        stream, timeline = random_timeline(seed)
        masks = [message.slots for message in stream.values() if isinstance(message, Mask)]
        for mode in ("pa", "npa"):
            found = looked_up(timeline, masks[0][0], mode, "mops", range(SECONDS + 30))
            met |= set(found.reason.tolist())
            rates += int(np.count_nonzero(found.eps_rrc_m[found.usable] > 0))
    assert met >= {0, 7, 9, 12, 13, 14, 15, 16, 17, 19, 20, 21, 23, 60}
    assert rates > 100
