"""Sensor states, simulated or recorded, as sources of a fault tree: first-order Markov chains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.dependability.exact.transitions import stationary_law
from sbas.dependability.tree.model import MarkovSource, Stage
from sbas.exceptions import InputError
from sbas.fusion.critical.episodes import combination_keys, states_of_key
from sbas.fusion.recorded.recorded_errors import RecordedErrors
from sbas.fusion.states import DA, NO_DATA, WORDS, N, U, combination_name

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
RowEstimate = Literal["counts", "posterior"]
Start = Literal["first", "stationary"]

CHAIN_CAVEAT: Final = (
    "a first-order chain: how long a state lasts is taken as geometric within a stage, and runs "
    "of U that last longer than that are lost"
)
"""What every source of this module supposes; it travels with it."""

MOST_DRIFT: Final = 0.1
"""Largest share of the epochs by which a stationary law may differ from what was seen."""


def sensor_source(
    name: str,
    state: ArrayLike,
    *,
    step_s: float,
    follows: Bools | None = None,
    start: Start = "first",
    stages: int = 10,
    estimate: RowEstimate = "counts",
    provenance: str = "",
) -> MarkovSource:
    """The states of one sensor as a source.

    Parameters
    ----------
    name : of the sensor and of the source.
    state : (t,) or (t, r) codes of `sbas.fusion.states`, time first.
    step_s : between epochs [s].
    follows : same shape, True where the epoch is one step after the one before; None is all but
        the first of each run.
    start : "first": with the law of the runs' first epoch, which is epoch 0 of the tree, as for
        simulated runs, whose dead reckoning drifts; "stationary": with the law that the rows
        leave as it is, as for a recording.
    stages : with "first", number of equal stretches of the runs that have rows of their own; as
        many as there are steps give the runs' shares at every epoch.
    estimate : rows of counts, n_ij/n_i., or the mean of their Dirichlet law with one observation
        shared out evenly as prior, by which nothing that was not seen is impossible.
    provenance : where the states come from.

    Returns
    -------
    MarkovSource with the states N, DA and U, and "no data" where that was seen.

    Raises
    ------
    InputError : a code that is no state; with "counts" a state that was never seen to go on; with
        "stationary" several closed classes of states, or states that drift.

    References
    ----------
    W. Perks, Journal of the Institute of Actuaries 73 (1947) 285 (the prior).
    """
    series = np.asarray(state)
    if series.ndim not in (1, 2) or not np.isin(series, (NO_DATA, N, DA, U)).all():
        raise InputError(
            "states of a sensor are codes N, DA, U or no data, time first",
            where=name,
            evidence=f"shape {series.shape}",
        )
    codes = [N, DA, U, *([NO_DATA] if np.any(series == NO_DATA) else [])]
    place = np.zeros(4, np.intp)
    place[np.array(codes) + 1] = np.arange(len(codes))
    words = tuple(WORDS[code] for code in codes)
    made = _Chain(name, words, place[series + 1], follows, estimate)
    return made.source(start, stages, step_s, provenance)


def combination_source(
    sensor_state: NDArray[np.int8],
    *,
    step_s: float,
    name: str = "sensors",
    follows: Bools | None = None,
    start: Start = "first",
    stages: int = 10,
    estimate: RowEstimate = "posterior",
    provenance: str = "",
) -> MarkovSource:
    """The joint states of all sensors as one source: what they share stays shared.

    Parameters
    ----------
    sensor_state : (n, t) or (n, t, r) codes of `sbas.fusion.states`.
    step_s, name, start, stages, estimate, provenance : as `sensor_source`.
    follows : (t,) or (t, r), as `sensor_source`.

    Returns
    -------
    MarkovSource whose states are the combinations that occurred, a letter a sensor: N, D for DA,
    U, and "-" for no data.

    Raises
    ------
    InputError : as `sensor_source`.
    """
    keys, numbers = np.unique(combination_keys(sensor_state), return_inverse=True)
    sensors = len(sensor_state)
    words = tuple(combination_name(states_of_key(int(key), sensors)) for key in keys)
    made = _Chain(name, words, numbers.reshape(sensor_state.shape[1:]), follows, estimate)
    return made.source(start, stages, step_s, provenance)


def recorded_source(
    name: str, errors: RecordedErrors, *, estimate: RowEstimate = "counts"
) -> MarkovSource:
    """The states of a recorded sensor as a stationary source, its step the recording's interval.

    Parameters
    ----------
    name, estimate : as `sensor_source`.
    errors : of `along_track_errors`; gaps and epochs that tell nothing are not crossed.

    Raises
    ------
    InputError : as `sensor_source`.
    """
    # An epoch that tells nothing has no state; it is linked to none, and leaves no trace.
    told = ~errors.unknown
    files = ", ".join(str(source.get("path", "")) for source in errors.sources) or "a recording"
    return sensor_source(
        name, errors.state[told], step_s=errors.interval_s, follows=errors.follows[told],
        start="stationary", estimate=estimate,
        provenance=f"{files}, {errors.judged_by} error, step {errors.interval_s:g} s",
    )  # fmt: skip


class _Chain:
    """Counts of transitions, epoch after epoch."""

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        numbers: NDArray[np.intp],
        follows: Bools | None,
        estimate: RowEstimate,
    ) -> None:
        linked = np.ones(numbers.shape, bool) if follows is None else np.asarray(follows, bool)
        if linked.shape != numbers.shape:
            raise InputError(
                "states and links that do not belong together", where=name,
                evidence=f"shapes {numbers.shape} and {linked.shape}",
            )  # fmt: skip
        if len(numbers) < 2:
            raise InputError("one epoch has no transition", where=name, cure="a longer series")
        if estimate not in ("counts", "posterior"):
            raise InputError(f"unknown estimate {estimate!r}", cure="counts or posterior")
        self.name, self.words, self.estimate = name, tuple(words), estimate
        self.numbers, self.linked = numbers, linked
        self.prior = 1.0 / len(words) if estimate == "posterior" else 0.0
        self.counts = self._counts(0, len(numbers) - 1)
        totals = self.counts.sum(axis=1) + self.prior
        if not totals.all():
            silent = words[int(np.flatnonzero(totals == 0)[0])]
            raise InputError(
                f"{silent!r} was never seen to go on: its row has no counts", where=name,
                cure="estimate='posterior', or a longer series",
            )  # fmt: skip
        weights = self.counts + self.prior
        self.rows: Floats = weights / weights.sum(axis=1, keepdims=True)

    def _counts(self, first: int, stop: int) -> NDArray[np.int64]:
        """(s, s) transitions that begin at the epochs `first` up to, not with, `stop`."""
        size = len(self.words)
        pairs = self.numbers[first:stop] * size + self.numbers[first + 1 : stop + 1]
        counts = np.bincount(pairs[self.linked[first + 1 : stop + 1]], minlength=size * size)
        return counts.reshape(size, size)

    def source(self, start: Start, stages: int, step_s: float, provenance: str) -> MarkovSource:
        profile: tuple[Stage, ...] = ()
        if start == "first":
            first = np.bincount(np.atleast_1d(self.numbers[0]).ravel(), minlength=len(self.words))
            initial = (first + self.prior) / (first + self.prior).sum()
            profile = self._profile(stages, step_s)
        elif start == "stationary":
            initial = self._stationary()
        else:
            raise InputError(f"unknown start {start!r}", cure="first or stationary")
        seen = np.bincount(self.numbers.ravel(), minlength=len(self.words))
        unseen = [w for w, n in zip(self.words, seen, strict=True) if not n]
        told = [
            provenance,
            f"{int(self.counts.sum()):,} transitions counted",
            f"rows by {self.estimate}, start by {start}",
            f"never seen: {', '.join(unseen)}" if unseen else "",
            CHAIN_CAVEAT,
        ]
        return MarkovSource(
            name=self.name,
            states=self.words,
            rows=_plain(self.rows),
            initial=tuple(initial.tolist()),
            stages=profile,
            source="; ".join(filter(None, told)),
        )

    def _profile(self, stages: int, step_s: float) -> tuple[Stage, ...]:
        """Rows of each stretch; where a state was not left within one, its row of all runs."""
        steps = len(self.numbers) - 1
        if isinstance(stages, bool) or not isinstance(stages, int) or stages < 1:
            raise InputError("stages are counted from 1 on", evidence=repr(stages))
        found = []
        for part in np.array_split(np.arange(steps), min(stages, steps)):
            counts = self._counts(int(part[0]), int(part[-1]) + 1)
            # The prior is one observation in all: each stage leans on the rows of all runs by it.
            weights = counts + self.rows * (1.0 if self.prior else 0.0)
            weights = np.where(weights.sum(axis=1, keepdims=True) > 0, weights, self.rows)
            label = f"step {int(part[0]) + 1} to {int(part[-1]) + 1}"
            rows = _plain(weights / weights.sum(axis=1, keepdims=True))
            found.append(Stage(label, part.size * step_s, rows))
        return tuple(found) if len(found) > 1 else ()

    def _stationary(self) -> Floats:
        law = stationary_law(_plain(self.rows))
        seen = np.bincount(self.numbers.ravel(), minlength=law.size) / self.numbers.size
        drift = float(np.abs(law - seen).sum() / 2)
        if drift > MOST_DRIFT:
            raise InputError(
                "the states drift, or the series is too short: it has no stationary law",
                where=self.name,
                evidence="; ".join(
                    f"{word} {share:.3g} of the epochs, {p:.3g} by the law"
                    for word, share, p in zip(self.words, seen, law, strict=True)
                ),
                cure="start='first' for runs that begin with the motion, or a longer series",
            )
        return law


def _plain(rows: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in rows.tolist())
