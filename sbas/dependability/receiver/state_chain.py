"""The chain of receiver states of one record or environment, as counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from sbas.dependability.receiver.markov_tests import (
    MarkovTest,
    order_test,
    sojourn_test,
    tail_test,
)
from sbas.dependability.receiver.state_tally import STATES
from sbas.estimate import Refusal
from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Lengths = tuple[tuple[int, int], ...]
Answer = MarkovTest | Refusal


@dataclass(frozen=True)
class StateRuns:
    """Runs of one state whose begin was seen: (length, count) of those that were seen to end, and
    of those that were cut."""

    completed: Lengths
    censored: Lengths

    def to_dict(self) -> dict[str, Any]:
        return {"completed": self.completed, "censored": self.censored}


@dataclass(frozen=True)
class StateChain:
    """Transitions, runs and tests of one environment, or of all together.

    Parameters
    ----------
    label : of the environment; "" for all together.
    epochs : (3,) epochs in each of `STATES`.
    counts : (3, 3) n_ij over adjacent epochs.
    triples : (3, 3, 3) n_ijk over three adjacent epochs.
    runs : of each state.
    order, sojourn, tail : tests of the Markov property, see
        `sbas.dependability.receiver.markov_tests`.
    confidence : of the intervals.
    """

    label: str
    epochs: tuple[int, ...]
    counts: tuple[tuple[int, ...], ...]
    triples: tuple[tuple[tuple[int, ...], ...], ...]
    runs: tuple[StateRuns, ...]
    order: Answer
    sojourn: tuple[Answer, ...]
    tail: tuple[Answer, ...]
    confidence: float

    @property
    def totals(self) -> tuple[int, ...]:
        """(3,) n_i., transitions out of each state, staying included."""
        return tuple(sum(row) for row in self.counts)

    @property
    def probabilities(self) -> tuple[tuple[float, ...] | None, ...]:
        """(3, 3) p_ij = n_ij / n_i.; None for the row of a state without a successor."""
        return tuple(
            tuple(n / total for n in row) if total else None
            for row, total in zip(self.counts, self.totals, strict=True)
        )

    @property
    def dirichlet(self) -> tuple[tuple[float, ...], ...]:
        """(3, 3) parameters 1/2 + n_ij of each row's law, from which uncertainty is drawn."""
        return tuple(tuple(0.5 + n for n in row) for row in self.counts)

    @property
    def tests(self) -> tuple[MarkovTest, ...]:
        """Those that could be made."""
        return tuple(
            t for t in (self.order, *self.sojourn, *self.tail) if isinstance(t, MarkovTest)
        )

    def limits(self) -> tuple[Floats, Floats]:
        """(3, 3) Clopper-Pearson limits of p_ij, two-sided; 0 and 1 for a row without counts."""
        n = np.array(self.counts)
        return binomial_limits(n, n.sum(axis=1, keepdims=True), self.confidence)

    def up_to(self) -> tuple[tuple[float | None, ...], ...]:
        """(3, 3) one-sided upper limit of an entry that was never seen, else None.

        1 - (1 - confidence)^(1/n_i.), at 95 % the "rule of three" 3/n_i..
        """
        alpha = 1.0 - self.confidence
        return tuple(
            tuple(float(-np.expm1(np.log(alpha) / total)) if total and not n else None for n in row)
            for row, total in zip(self.counts, self.totals, strict=True)
        )

    def stationary(self) -> tuple[float, ...] | Refusal:
        """(3,) stationary law of p_ij, by the Markov chain tree theorem (sums of products)."""
        counts = np.array(self.counts, dtype=float)
        empty = counts.sum(axis=1) == 0.0
        for i in np.flatnonzero(empty & (counts.sum(axis=0) > 0.0)):
            return Refusal(f"{STATES[i]} was entered and never left", "record longer")
        if empty.all():
            return Refusal("no transition was seen", "record longer")
        # Never entered: wherever its empty row leads, its share is 0.
        counts[empty] = 1.0
        p = counts / counts.sum(axis=1, keepdims=True)
        return stationary_law(p)

    def stay(self, state: int) -> float | None:
        """a of a state: n_ii / n_i.; None where it has no successor."""
        total = self.totals[state]
        return self.counts[state][state] / total if total else None

    def to_dict(self) -> dict[str, Any]:
        """Plain values; `from_dict` is the inverse."""
        lower, upper = self.limits()
        law = self.stationary()
        return {
            "label": self.label,
            "states": list(STATES),
            "epochs": list(self.epochs),
            "counts": [list(row) for row in self.counts],
            "probabilities": [None if row is None else list(row) for row in self.probabilities],
            "lower": lower.tolist(),
            "upper": upper.tolist(),
            "up_to": [list(row) for row in self.up_to()],
            "confidence": self.confidence,
            "dirichlet": [list(row) for row in self.dirichlet],
            "stationary": law.to_dict() if isinstance(law, Refusal) else list(law),
            "triples": [[list(row) for row in table] for table in self.triples],
            "runs": {s: r.to_dict() for s, r in zip(STATES, self.runs, strict=True)},
            "order_test": self.order.to_dict(),
            "sojourn_test": {s: t.to_dict() for s, t in zip(STATES, self.sojourn, strict=True)},
            "tail_test": {s: t.to_dict() for s, t in zip(STATES, self.tail, strict=True)},
        }

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> StateChain:
        """Inverse of `to_dict`; raises InputError for anything else."""
        try:
            return cls(
                label=str(plain["label"]),
                epochs=_counts(plain["epochs"], 3),
                counts=tuple(_counts(row, 3) for row in _three(plain["counts"])),
                triples=tuple(
                    tuple(_counts(row, 3) for row in _three(table))
                    for table in _three(plain["triples"])
                ),
                runs=tuple(
                    StateRuns(*(_lengths(plain["runs"][s][k]) for k in ("completed", "censored")))
                    for s in STATES
                ),
                order=_answer(plain["order_test"]),
                sojourn=tuple(_answer(plain["sojourn_test"][s]) for s in STATES),
                tail=tuple(_answer(plain["tail_test"][s]) for s in STATES),
                confidence=float(plain["confidence"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                "these are no receiver states as sbas writes them", evidence=repr(error)[:200],
                cure="write them again with sbas states FILE --json",
            ) from error  # fmt: skip


def state_chain(
    label: str,
    epochs: Sequence[int],
    pairs: NDArray[np.int64],
    triples: NDArray[np.int64],
    runs: tuple[StateRuns, ...],
    rooms: Sequence[Lengths],
    *,
    confidence: float,
    tail_runs: int,
) -> StateChain:
    """A chain with its tests, from counts.

    Parameters
    ----------
    label, epochs, runs, confidence : see StateChain.
    pairs, triples : (3, 3) and (3, 3, 3) counts.
    rooms : of each state, (room, count) of its runs whose begin was seen; see `sojourn_test`.
    tail_runs : k of the tail test.
    """
    out = pairs.sum(axis=1)
    stay = [float(pairs[i, i] / out[i]) if out[i] else None for i in range(3)]
    return StateChain(
        label=label,
        epochs=tuple(int(n) for n in epochs),
        counts=tuple(tuple(row) for row in pairs.tolist()),
        triples=tuple(tuple(tuple(row) for row in table) for table in triples.tolist()),
        runs=runs,
        order=order_test(triples),
        sojourn=tuple(
            sojourn_test(s, stay[i], runs[i].completed, rooms[i]) for i, s in enumerate(STATES)
        ),
        tail=tuple(
            tail_test(
                s, tail_runs, stay[i], int(out[i]), runs[i].completed, runs[i].censored, rooms[i]
            )
            for i, s in enumerate(STATES)
        ),
        confidence=confidence,
    )


def stationary_law(rows: Floats) -> tuple[float, ...] | Refusal:
    """(3,) stationary law of a (3, 3) chain, or that it has no single one.

    Each share is proportional to the sum over the trees that lead to its state of the product of
    their probabilities; only products and sums of positive terms.
    Source: Markov chain tree theorem (Freidlin and Wentzell 1984, lemma 6.3.1).
    """
    p = rows
    weights = np.array([
        p[1, 0] * p[2, 0] + p[1, 0] * p[2, 1] + p[1, 2] * p[2, 0],
        p[0, 1] * p[2, 1] + p[0, 1] * p[2, 0] + p[0, 2] * p[2, 1],
        p[0, 2] * p[1, 2] + p[0, 2] * p[1, 0] + p[0, 1] * p[1, 2],
    ])  # fmt: skip
    if weights.sum() == 0.0:
        return Refusal("the chain has more than one closed set of states", "record longer")
    return tuple((weights / weights.sum()).tolist())


def binomial_limits(
    count: NDArray[np.int64], total: NDArray[np.int64], confidence: float
) -> tuple[Floats, Floats]:
    """Clopper-Pearson limits of a probability, two-sided.

    Parameters
    ----------
    count, total : arrays that broadcast, 0 <= count <= total; a total of 0 gives 0 and 1.
    confidence : in (0, 1).

    References
    ----------
    C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404, through the beta distribution.
    """
    half = (1.0 - confidence) / 2
    k, n = (a.astype(float) for a in np.broadcast_arrays(count, total))
    lower = np.where(k > 0, special.betaincinv(np.maximum(k, 1), n - k + 1, half), 0.0)
    upper = np.where(k < n, special.betainccinv(k + 1, np.maximum(n - k, 1), half), 1.0)
    return lower, upper


def _three(values: Any) -> Sequence[Any]:
    if len(values) != 3:
        raise ValueError(f"{len(values)} entries where 3 are due")
    three: Sequence[Any] = values
    return three


def _counts(values: Any, size: int) -> tuple[int, ...]:
    if len(values) != size or not all(type(v) is int and v >= 0 for v in values):
        raise ValueError(f"no {size} counts: {values!r:.80}")
    return tuple(values)


def _lengths(values: Any) -> Lengths:
    return tuple((a, b) for a, b in (_counts(pair, 2) for pair in values))


def _answer(plain: Mapping[str, Any]) -> Answer:
    if "refused" in plain:
        return Refusal(plain["refused"], plain["cure"])
    return MarkovTest(**plain)
