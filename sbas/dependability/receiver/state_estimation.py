"""The receiver's states in a recording: correct, wrong, missing, and how it moves among them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from sbas.dependability.receiver.markov_tests import MarkovTest, pooling_test
from sbas.dependability.receiver.state_chain import Answer, StateChain, StateRuns, state_chain
from sbas.dependability.receiver.state_tally import CODES, STATES, StateTally
from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.frames import decimal_year
from sbas.input_check import accept, check
from sbas.logs.format import Progress
from sbas.numerals import number, percent
from sbas.recording import EpochSource
from sbas.timescales import NS_PER_S
from sbas.truth import Truth, frame_findings

Boundary = Literal["drop", "destination"]


@dataclass(frozen=True)
class ReceiverStates:
    """States of a receiver's output, epoch by epoch, as a chain.

    Parameters
    ----------
    threshold_m : x; an error of x or more is wrong.
    interval_s : sampling interval, the step of the chain [s].
    confidence : of the intervals; 1 - confidence is the level of the tests.
    boundary : what became of transitions between two environments.
    tail_runs : k of the tail tests.
    epochs : by state: correct, wrong, missing, hardware, first_fix_wait, unknown.
    cuts : steps that are not one interval, across which nothing is counted.
    across_labels : transitions between two environments.
    chain : of all environments together.
    environments : a chain a label; empty without labels.
    pooling : test that the environments have one chain.
    findings : of the input check and of this analysis.
    sources : files.
    """

    threshold_m: float
    interval_s: float
    confidence: float
    boundary: Boundary
    tail_runs: int
    epochs: Mapping[str, int]
    cuts: int
    across_labels: int
    chain: StateChain
    environments: tuple[StateChain, ...]
    pooling: Answer
    findings: tuple[Finding, ...]
    sources: tuple[Mapping[str, Any], ...]

    @property
    def chains(self) -> tuple[StateChain, ...]:
        """The chains to use: one an environment where pooling is rejected, else the pooled one."""
        return self.environments if self.pooling_rejected else (self.chain,)

    @property
    def pooling_rejected(self) -> bool:
        return isinstance(self.pooling, MarkovTest) and self.pooling.p < 1.0 - self.confidence

    @property
    def rejected(self) -> tuple[str, ...]:
        """Tests of the Markov property that reject it, as "environment: test".

        A test of m rejects where m p is below 1 - confidence (Bonferroni), so that among all of
        them a true chain is rejected in 1 - confidence of the records at most.
        """
        made = [(c.label, t) for c in self.chains for t in c.tests]
        level = (1.0 - self.confidence) / max(len(made), 1)
        return tuple(f"{label or 'all'}: {t.name}" for label, t in made if t.p < level)

    @property
    def conclusion(self) -> str:
        """What the tests say, in words."""
        made = sum(len(c.tests) for c in self.chains)
        if not made:
            return "too few transitions to test the Markov property"
        if self.rejected:
            return "no first-order Markov chain: use the semi-Markov source"
        return f"a first-order Markov chain is not rejected ({made} tests)"

    def chain_of(self, environment: str | None) -> StateChain:
        """The chain of an environment; None for all together.

        Raises
        ------
        InputError : no such label.
        """
        if environment is None:
            return self.chain
        for chain in self.environments:
            if chain.label == environment:
                return chain
        raise InputError(
            f"no environment {environment!r} in these states",
            cure="one of " + (", ".join(c.label for c in self.environments) or "none: no labels"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values; `from_dict` is the inverse."""
        total = sum(self.epochs.values())
        return {
            "threshold_m": self.threshold_m,
            "interval_s": self.interval_s,
            "confidence": self.confidence,
            "boundary": self.boundary,
            "tail_runs": self.tail_runs,
            "states": {
                name: {"epochs": n, "share": n / total if total else None}
                for name, n in self.epochs.items()
            },
            "cuts": self.cuts,
            "across_labels": self.across_labels,
            "transition": self.chain.to_dict(),
            "environments": {c.label: c.to_dict() for c in self.environments},
            "markov_test": {
                "rejected": bool(self.rejected),
                "rejected_tests": list(self.rejected),
                "conclusion": self.conclusion,
                "order": self.chain.order.to_dict(),
                "sojourn": self.chain.to_dict()["sojourn_test"],
                "tail": self.chain.to_dict()["tail_test"],
                "pooling": self.pooling.to_dict(),
                "pooling_rejected": self.pooling_rejected,
            },
            "findings": [f.to_dict() for f in self.findings],
            "sources": [dict(s) for s in self.sources],
        }

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> ReceiverStates:
        """Inverse of `to_dict`; raises InputError for anything else."""
        try:
            pooling = plain["markov_test"]["pooling"]
            if plain["boundary"] not in ("drop", "destination"):
                raise ValueError(f"boundary {plain['boundary']!r}")
            return cls(
                threshold_m=float(plain["threshold_m"]),
                interval_s=float(plain["interval_s"]),
                confidence=float(plain["confidence"]),
                boundary=plain["boundary"],
                tail_runs=int(plain["tail_runs"]),
                epochs={name: int(plain["states"][name]["epochs"]) for name in _ORDER},
                cuts=int(plain["cuts"]),
                across_labels=int(plain["across_labels"]),
                chain=StateChain.from_dict(plain["transition"]),
                environments=tuple(map(StateChain.from_dict, plain["environments"].values())),
                pooling=Refusal(pooling["refused"], pooling["cure"])
                if "refused" in pooling
                else MarkovTest(**pooling),
                findings=tuple(Finding(**f) for f in plain["findings"]),
                sources=tuple(plain["sources"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(
                "these are no receiver states as sbas writes them", evidence=repr(error)[:200],
                cure="write them again with sbas states FILE --json",
            ) from error  # fmt: skip

    def summary(self) -> pd.DataFrame:
        """One row a transition: count, probability, limits; by environment."""
        rows = []
        for chain in (self.chain, *self.environments):
            lower, upper = chain.limits()
            for i, start in enumerate(STATES):
                row = chain.probabilities[i]
                rows += [
                    {
                        "environment": chain.label or "all", "from": start, "to": end,
                        "count": chain.counts[i][j], "of": chain.totals[i],
                        "probability": math.nan if row is None else row[j],
                        "lower": lower[i, j], "upper": upper[i, j],
                        "up_to": chain.up_to()[i][j],
                    }
                    for j, end in enumerate(STATES)
                ]  # fmt: skip
        return pd.DataFrame(rows).set_index(["environment", "from", "to"])

    def __str__(self) -> str:
        shares = ", ".join(f"{name} {n:,}" for name, n in self.epochs.items() if n)
        lines = [f"epochs of {self.interval_s:g} s, wrong from {self.threshold_m:g} m on: {shares}"]
        for chain in self.chains:
            lines.append(f"{chain.label or 'all'}: probability of the next state")
            lines += [f"  {s:8s} {_row_text(chain, i)}" for i, s in enumerate(STATES)]
            law = chain.stationary()
            text = str(law) if isinstance(law, Refusal) else ", ".join(map(number, law))
            lines.append(f"  stationary {text}")
            lines += [f"  {test}" for test in (chain.order, *chain.sojourn, *chain.tail)]
        lines += [str(self.pooling)] if self.environments else []
        lines += [self.conclusion, *(f"{f.code} {f.severity}: {f.message}" for f in self.findings)]
        return "\n".join(lines)


_ORDER = ("correct", "wrong", "missing", "hardware", "first_fix_wait", "unknown")


def _row_text(chain: StateChain, i: int) -> str:
    row = chain.probabilities[i]
    if row is None:
        return "never left: no probabilities"
    lower, upper = chain.limits()
    parts = []
    for j, p in enumerate(row):
        most = chain.up_to()[i][j]
        if most is not None:
            parts.append(f"{STATES[j]} 0 (up to {number(most)})")
        else:
            parts.append(f"{STATES[j]} {number(p)} [{number(lower[i, j])}, {number(upper[i, j])}]")
    return ", ".join(parts) + f" at {percent(chain.confidence)}"


def receiver_states(
    source: EpochSource,
    *,
    truth: Truth | None,
    threshold_m: float,
    boundary: Boundary = "drop",
    confidence: float = 0.95,
    tail_runs: int = 6,
    accept_findings: Iterable[str] = (),
    progress: Progress | None = None,
) -> ReceiverStates:
    """The receiver's states of every epoch, and the chain by which it moves among them.

    Parameters
    ----------
    source : a Recording, or a source of `sbas.scan` that streams.
    truth : where the antenna was.
    threshold_m : x [m]; a position with an error of x or more is wrong.
    boundary : transitions between two environment labels are left out ("drop") or counted for the
        second one ("destination"); runs are cut there in either case.
    confidence : of intervals, in [0.5, 1); tests reject below 1 - confidence.
    tail_runs : k; the tail tests ask for runs of k epochs or more.
    accept_findings : codes of errors in the input to accept as warnings.
    progress : called with (epochs done, epochs in all).

    Returns
    -------
    ReceiverStates. Missing: no fix. Not in the chain: hardware faults, the wait for the first fix
    after one, and unknown epochs (the truth does not reach them, or the logger lost the position);
    a gap of the record cuts the chain and is never filled.

    Raises
    ------
    InputError : no truth (E01: against its own median a recording's errors are a lower bound), an
        argument out of range, or an error found by the input check.

    References
    ----------
    Nguyen, Beugin, Marais, ITST 2013, III (four states of the receiver's output); ties (error = x)
    go to the unsafe side, where the paper writes PE > x.
    """
    _check_arguments(threshold_m, boundary, confidence, tail_runs)
    if truth is None or truth.lower_bound:
        raise InputError(
            "no truth: the receiver's states are not given",
            code="E01",
            evidence="against the recording's own median, or a track line, errors are a lower "
            "bound: wrong positions would count as correct",
            cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
        )
    checked = check(source, truth=truth)
    survey = checked.survey
    year = float(decimal_year(np.datetime64(survey.begin_ns, "ns"))) if survey.epochs else None
    found = (*checked.findings, *frame_findings(source.meta, truth, year=year))
    findings = list(accept(found, accept_findings))
    refuse_on_errors(findings)
    tally = StateTally(
        truth, threshold_m, survey.interval_ns, destination=boundary == "destination"
    )
    done = 0
    for batch in source.batches(StateTally.COLUMNS):
        tally.update(batch)
        done += len(batch)
        if progress is not None:
            progress(done, survey.epochs)
    tally.finish()
    total = tally.epochs.sum(axis=0)
    if not total[1:4].sum():
        raise InputError(
            "no epoch has a known state", code="E01",
            evidence=", ".join(f"{n} {name}" for name, n in zip(CODES, total, strict=True) if n),
            cure="check the times and the steps of the truth",
        )  # fmt: skip
    findings += _remarks(tally, "hardware_fault" in source.columns)

    def chain(label: str, rows: list[int]) -> StateChain:
        def of(lengths: Any, state: int) -> tuple[tuple[int, int], ...]:
            found: tuple[tuple[int, int], ...] = lengths.of([3 * r + state for r in rows])
            return found

        return state_chain(
            label,
            tally.epochs[rows].sum(axis=0)[1:4].tolist(),
            tally.pairs[rows].sum(axis=0).reshape(3, 3),
            tally.triples[rows].sum(axis=0).reshape(3, 3, 3),
            tuple(StateRuns(of(tally.completed, i), of(tally.censored, i)) for i in range(3)),
            [of(tally.rooms, i) for i in range(3)],
            confidence=confidence,
            tail_runs=tail_runs,
        )

    # Row 0 is of epochs without a label: among labelled ones they are an environment of their own.
    names = ["(unlabelled)", *tally.labels]
    used = [r for r in range(len(names)) if tally.labels and tally.epochs[r].any()]
    used.sort(key=names.__getitem__)
    environments = tuple(chain(names[r], [r]) for r in used)
    pooling: Answer = Refusal("pooling: fewer than two environments", "a column 'environment'")
    if len(used) > 1:
        pooling = pooling_test(np.array([c.counts for c in environments]))
    by_name = dict(zip(CODES, total.tolist(), strict=True))
    return ReceiverStates(
        threshold_m=float(threshold_m),
        interval_s=survey.interval_ns / NS_PER_S,
        confidence=float(confidence),
        boundary=boundary,
        tail_runs=tail_runs,
        epochs={name: by_name[name] for name in _ORDER},
        cuts=tally.cuts,
        across_labels=tally.across_labels,
        chain=chain("", list(range(len(names)))),
        environments=environments,
        pooling=pooling,
        findings=tuple(findings),
        sources=tuple(dict(vars(s)) for s in source.meta.sources),
    )


def _check_arguments(threshold_m: Any, boundary: Any, confidence: Any, tail_runs: Any) -> None:
    def refused(what: str, value: Any, cure: str) -> InputError:
        return InputError(f"{what} is out of range", evidence=repr(value)[:80], cure=cure)

    if not (_is_real(threshold_m) and 0 < threshold_m < math.inf):
        raise refused("the threshold", threshold_m, "--threshold-m with metres above 0")
    if boundary not in ("drop", "destination"):
        raise refused("the boundary rule", boundary, "drop or destination")
    if not (_is_real(confidence) and 0.5 <= confidence < 1):
        raise refused("the confidence", confidence, "a probability in [0.5, 1), such as 0.95")
    if not (isinstance(tail_runs, int) and not isinstance(tail_runs, bool) and tail_runs >= 2):
        raise refused("tail_runs", tail_runs, "a number of epochs of 2 or more")


def _is_real(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _remarks(tally: StateTally, with_flags: bool) -> Iterable[Finding]:
    """What the states themselves show to be doubtful in the input."""
    if tally.truth_sigma_h_m > 0.1 * tally.threshold_m:
        yield Finding(
            "E09", "warning",
            f"the truth is uncertain by up to {tally.truth_sigma_h_m:.3g} m (1-sigma), more than "
            f"a tenth of the threshold {tally.threshold_m:g} m",
            cure="give a better truth",
        )  # fmt: skip
    if tally.without_truth:
        yield Finding(
            "E01", "warning",
            f"the truth does not reach {tally.without_truth:,} epochs with a position: unknown",
            cure="give a truth for the whole record, or --truth-max-step",
        )  # fmt: skip
    if tally.incomplete:
        yield Finding(
            "E10", "warning",
            f"{tally.incomplete:,} epochs lost their position in the log: unknown, not missing",
        )  # fmt: skip
    if tally.declared_none:
        yield Finding(
            "E07", "info",
            f"{tally.declared_none:,} epochs have a position and the mode none: no fix, missing",
        )  # fmt: skip
    if tally.raim_failed:
        yield Finding(
            "E07", "info",
            f"{tally.raim_failed:,} epochs have a position whose RAIM found a fault: detected, "
            "hence missing",
        )  # fmt: skip
    if tally.unjudged_starts:
        yield Finding(
            "E04", "warning",
            f"{tally.unjudged_starts:,} epochs without a fix open the record or follow a gap: "
            "counted as missing signals",
            evidence="a receiver that was just switched on looks the same",
            cure="cut them off, or flag hardware_fault before them",
        )  # fmt: skip
    if tally.short_steps:
        yield Finding(
            "E27", "warning",
            f"{tally.short_steps:,} steps are shorter than half the interval: the chain is cut "
            "there",
            cure="analyse each sampling rate on its own",
        )  # fmt: skip
    if not with_flags:
        yield Finding(
            "E25", "info", "no column hardware_fault: hardware faults count as missing signals",
            cure="add a column 'hardware_fault'",
        )  # fmt: skip
    if tally.labels and tally.epochs[0].any():
        yield Finding(
            "E25", "warning",
            f"{int(tally.epochs[0].sum()):,} epochs have no environment label: they are the "
            "environment (unlabelled)",
        )  # fmt: skip
