"""The receiver's states along time, thinned to bins: what a ribbon of states is drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.receiver.state_tally import CODES, StateTally
from sbas.exceptions import InputError
from sbas.input_check import check
from sbas.recording import EpochSource
from sbas.timescales import NS_PER_S
from sbas.truth import Truth

Ints = NDArray[np.int64]

MOST_BINS = 1200
"""As many as a picture of full width has pixels to tell apart."""

WORST_FIRST = ("wrong", "missing", "hardware", "first_fix_wait", "unknown", "correct")
"""A wrong position that looks right is worse than none; what is not known is not correct."""


@dataclass(frozen=True)
class StateStrip:
    """Epochs of each state in equal bins of time.

    Parameters
    ----------
    begin_ns, end_ns : first epoch, and one interval after the last [ns since 1970, GPST].
    interval_s : sampling interval [s].
    threshold_m : an error of this size or more is wrong [m].
    counts : (bins, 6) epochs of each of `CODES`; a row of zeros is a gap of the record.
    """

    begin_ns: int
    end_ns: int
    interval_s: float
    threshold_m: float
    counts: Ints

    @property
    def worst(self) -> Ints:
        """(bins,) index in `WORST_FIRST` of the worst state of the bin; -1 in a gap."""
        seen = self.counts[:, [CODES.index(name) for name in WORST_FIRST]] > 0
        found: Ints = np.where(seen.any(axis=1), np.argmax(seen, axis=1), -1)
        return found

    def share(self, state: str) -> NDArray[np.float64]:
        """(bins,) share of the bin's epochs in a state [1]; NaN in a gap."""
        total = self.counts.sum(axis=1)
        with np.errstate(invalid="ignore"):
            found: NDArray[np.float64] = self.counts[:, CODES.index(state)] / total
        return found

    def epochs(self, state: str) -> int:
        """Epochs in a state."""
        return int(self.counts[:, CODES.index(state)].sum())


def state_strip(
    source: EpochSource, *, truth: Truth | None, threshold_m: float, bins: int = MOST_BINS
) -> StateStrip:
    """States of every epoch, counted in bins of time; one pass, whatever the length.

    Parameters
    ----------
    source : a Recording, or a source of `sbas.scan` that streams.
    truth : where the antenna was.
    threshold_m : x [m]; a position with an error of x or more is wrong.
    bins : at most, 1 or more; a bin is a whole number of sampling intervals.

    Returns
    -------
    StateStrip; the states are those of `receiver_states`.

    Raises
    ------
    InputError : no truth (E01), an argument out of range, or a record without epochs.
    """
    if truth is None or truth.lower_bound:
        raise InputError(
            "no truth: the receiver's states are not given", code="E01",
            cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
        )  # fmt: skip
    if not 0 < threshold_m < np.inf or bins < 1:
        raise InputError(
            "the threshold is metres above 0, and there is at least one bin",
            evidence=f"{threshold_m!r} m, {bins!r} bins",
        )
    survey = check(source, truth=truth).survey
    if not survey.epochs:
        raise InputError("no epoch is in the record", cure="check the file")
    interval = survey.interval_ns
    begin = survey.begin_ns
    slots = (survey.end_ns - begin) // interval + 1
    per_bin = -(-slots // bins)
    width = per_bin * interval
    used = int(-(-slots // per_bin))
    counts = np.zeros((used, len(CODES)), np.int64)
    states = _EpochStates(truth, threshold_m, interval, destination=False)
    for batch in source.batches(StateTally.COLUMNS):
        states.update(batch)
        # Half an interval of jitter does not move an epoch into the bin before its own.
        time = batch.index.to_numpy().astype(np.int64) - begin + interval // 2
        where = np.clip(time // width, 0, used - 1)
        key = where * len(CODES) + states.of_batch[: len(batch)]
        counts += np.bincount(key, minlength=counts.size).reshape(counts.shape)
    return StateStrip(begin, begin + used * width, interval / NS_PER_S, float(threshold_m), counts)


class _EpochStates(StateTally):
    """The same states, kept for the last batch only; nothing is counted."""

    of_batch: Ints = np.empty(0, np.int64)

    def _count(self, code: Ints, label: Ints, link: NDArray[np.bool_]) -> None:
        self.of_batch = code[2:]

    def _runs(self, code: Ints, label: Ints, link: NDArray[np.bool_]) -> None:
        pass
