"""What leads to the top, in which order: minimal cut sequences with their part in "at least once".

States of the chain are told apart by the onsets that led to them, the top is not left, and the
probability that enters it is grouped by those onsets. Parts of an OR that share nothing are
followed alone and meet epoch by epoch.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from sbas.dependability.analysis.asked_measure import measured, part_below
from sbas.dependability.analysis.onset_tags import CUT, OnsetTags, Sequence_, contains
from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.plan import Part, Tree, split, tree_of
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.state_space import (
    MAX_STATES,
    Columns,
    Ints,
    reachable,
    repeat_rows,
)
from sbas.dependability.exact.transitions import Chain, Floats, component_chain
from sbas.dependability.static.cut_sets import cut_sets_of, is_coherent
from sbas.dependability.static.decision_diagram import TreeFunctions
from sbas.dependability.static.static_tree import not_static, static_tree_of
from sbas.dependability.tree.model import House, HybridFaultTree, Not, Pand
from sbas.exceptions import InputError, ModelError

_MOST_TAGS = 1 << 30
_MOST_FLOWS = 200_000_000
_MOST_CUT_SETS = 10_000


@dataclass(frozen=True)
class CutSequence:
    """Onsets in order that lead to the top.

    Parameters
    ----------
    steps : basic events that became true one after the other; those of one step in one epoch.
        "..." first: earlier onsets were not kept.
    probability : that the top is first entered after these onsets [1].
    """

    steps: Sequence_
    probability: float

    def __str__(self) -> str:
        return " -> ".join(" & ".join(step) for step in self.steps) or "(no event)"


@dataclass(frozen=True)
class CutSequences:
    """Minimal cut sequences of an event or gate, the most probable first.

    Parameters
    ----------
    of : the event or gate.
    at_least_once : probability to be true at some epoch 1..N [1], from its own solution.
    minimal : sequences that contain no shorter one; each bears the probability of all entries
        that contain it and no other minimal sequence.
    several : probability of entries that contain more than one minimal sequence [1].
    unresolved : probability of entries whose kept onsets contain none: too long a history [1].
    entries : every history that entered, before shorter ones took it in.
    cut_sets : minimal cut sets where the tree is static and coherent, else None.
    states : of the largest chain.
    """

    of: str
    at_least_once: float
    minimal: tuple[CutSequence, ...]
    several: float
    unresolved: float
    entries: tuple[CutSequence, ...]
    cut_sets: tuple[frozenset[str], ...] | None
    states: int

    @property
    def remainder(self) -> float:
        """at_least_once less all that is listed; rounding [1]."""
        listed = sum(s.probability for s in self.minimal) + self.several + self.unresolved
        return self.at_least_once - listed

    def summary(self) -> pd.DataFrame:
        """A row for each minimal sequence, then what is not one; the sum is `at_least_once`."""
        rows = [(str(s), s.probability) for s in self.minimal]
        rows += [
            ("(several at once)", self.several),
            ("(unresolved)", self.unresolved),
            ("(remainder)", self.remainder),
        ]
        frame = pd.DataFrame(rows, columns=["sequence", "probability"]).set_index("sequence")
        frame["share"] = frame["probability"] / self.at_least_once if self.at_least_once else 0.0
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""

        def plain(sequences: Iterable[CutSequence]) -> list[dict[str, Any]]:
            return [
                {"steps": [list(step) for step in s.steps], "probability": s.probability}
                for s in sequences
            ]

        return {
            "of": self.of,
            "at_least_once": self.at_least_once,
            "minimal": plain(self.minimal),
            "several": self.several,
            "unresolved": self.unresolved,
            "remainder": self.remainder,
            "entries": plain(self.entries),
            "cut_sets": None if self.cut_sets is None else [sorted(s) for s in self.cut_sets],
            "states": self.states,
        }


def cut_sequences(
    model: HybridFaultTree,
    *,
    of: str | None = None,
    longest: int = 4,
    max_states: int = MAX_STATES,
) -> CutSequences:
    """Minimal cut sequences, with their contributions to "at least once in the mission".

    Parameters
    ----------
    model : any.
    of : event or gate; None is the top.
    longest : steps that a history keeps. Of a longer one, repeated onsets go first, then the
        oldest; its sequence begins with "...".
    max_states : of the chain with histories.

    Returns
    -------
    CutSequences.

    Raises
    ------
    ModelError : a model too large for that, with the size.

    Notes
    -----
    A history holds the onsets of basic events since all were false together and no latched PAND
    was true: the last one of each, and every one of events whose order a PAND may have taken in
    before. A sequence
    contains a shorter one if the steps of that are, in order, within steps of its own. How long
    events lasted is no part of a sequence: where six wrong positions alone are enough, two of
    them with a failed sensor count for the shorter sequence; `entries` keeps them apart, and
    `of` may name the gate. Parts that share nothing and enter at one epoch count for the first.

    References
    ----------
    Tang, Dugan 2004 (cut sequences of dynamic fault trees); page dependability, section 8.
    """
    part = part_below(model, of)
    tree = tree_of(part)
    entered: dict[Sequence_, float] = {}
    largest = 0
    try:
        parts = [
            _Entries.of(part, tree, name, longest, max_states) for name in _ors(part.top, tree)
        ]
    except InputError as error:
        raise ModelError(
            "the model is too large to follow its cut sequences",
            where=f"{part.top}: {error.where}",
            evidence=f"{error.what}; {error.evidence}",
            cure="of=... for one gate; fewer events below it, shorter delays, a longer step_s; "
            "minimal_cut_sets() for a static tree",
        ) from error
    by_now = [np.cumsum(p.flows.sum(axis=1)) for p in parts]
    before = [np.concatenate([[0.0], passed[:-1]]) for passed in by_now]
    for i, p in enumerate(parts):
        largest = max(largest, p.states)
        alone = np.ones(part.epochs + 1)
        for j in range(len(parts)):
            alone *= 1.0 - (by_now[j] if j < i else before[j] if j > i else 0.0)
        for sequence, chance in zip(p.sequences, alone @ p.flows, strict=True):
            if chance > 0.0:
                entered[sequence] = entered.get(sequence, 0.0) + float(chance)
    minimal, several, unresolved = _folded(entered)
    return CutSequences(
        part.top,
        measured(part, [part.top], "at_least_once", max_states=max_states)[part.top],
        _ranked(minimal),
        several,
        unresolved,
        _ranked(entered),
        _cut_sets(part),
        largest,
    )


def _ranked(chances: Mapping[Sequence_, float]) -> tuple[CutSequence, ...]:
    found = [CutSequence(steps, chance) for steps, chance in chances.items()]
    return tuple(sorted(found, key=lambda s: (-s.probability, s.steps)))


def _folded(entered: Mapping[Sequence_, float]) -> tuple[dict[Sequence_, float], float, float]:
    """Minimal sequences with all that contains them; what contains several, or none."""
    minimal: dict[Sequence_, float] = {}
    for sequence in sorted(entered, key=lambda s: (len(s), sum(map(len, s)), s)):
        whole = not (sequence and sequence[0] == CUT)
        if whole and not any(contains(sequence, known) for known in minimal):
            minimal[sequence] = 0.0
    several = unresolved = 0.0
    for sequence, chance in entered.items():
        within = [known for known in minimal if contains(sequence, known)]
        if len(within) == 1:
            minimal[within[0]] += chance
        elif within:
            several += chance
        else:
            unresolved += chance
    return minimal, several, unresolved


def _ors(name: str, tree: Tree) -> list[str]:
    """Independent parts of which any one is enough."""

    def flat(part: Part) -> list[str]:
        if part.parts and part.k == 1:
            return [n for inner in part.parts for n in flat(inner)]
        return [part.name]

    return flat(split(name, tree))


def _cut_sets(part: HybridFaultTree) -> tuple[frozenset[str], ...] | None:
    if not_static(part):
        return None
    tree = static_tree_of(part)
    functions = TreeFunctions(tree)
    if not is_coherent(functions, tree):
        return None
    cuts = cut_sets_of(functions, tree)
    if sum(cuts.counts().values()) > _MOST_CUT_SETS:
        return None
    return tuple(sorted(cuts.sets(), key=lambda s: (len(s), sorted(s))))


# --- one part ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Entries:
    """First entries into a gate by history: (N + 1, T) probabilities, T sequences."""

    sequences: list[Sequence_]
    flows: Floats
    states: int

    @classmethod
    def of(
        cls, part: HybridFaultTree, tree: Tree, name: str, longest: int, max_states: int
    ) -> _Entries:
        memory = gate_memory(tree.below(name), part)
        chain = product_chain(
            component_chain(part, tree.supports[name], max_states=max_states),
            memory,
            max_states=max_states,
            absorbing=name,
        ).chain
        read = _read(tree, name)
        events = [e.name for e in part.events if e.name in read and not isinstance(e, House)]
        tags = OnsetTags(events, longest, repeating=_repeating(part, tree, name))
        latched = [g.name for g in tree.below(name) if isinstance(g, Pand) and _latches(part, g)]
        tagged, labels = _tagged(chain, tags, name, latched, max_states)
        return cls(*_entering(tagged, labels, tags, name), states=tagged.size)


def _repeating(part: HybridFaultTree, tree: Tree, name: str) -> set[str]:
    """Events whose earlier onsets may matter to a PAND after they began again.

    That needs a PAND that is latched, or an input that reads several events or is true without
    its event: else all that it compares are runs that last.
    """
    found: set[str] = set()
    for gate in tree.below(name):
        if not isinstance(gate, Pand):
            continue
        read = [_read(tree, lower) for lower in gate.inputs]
        inverts = any(isinstance(g, Not) for g in tree.below(gate.name))
        if _latches(part, gate) or inverts or any(len(events) > 1 for events in read):
            found |= set().union(*read)
    return found


def _latches(part: HybridFaultTree, gate: Pand) -> bool:
    return part.options.pand_latched if gate.latched is None else gate.latched


def _read(tree: Tree, name: str) -> set[str]:
    """Events below an event or gate, it included."""
    return {name}.union(*(gate.inputs for gate in tree.below(name))) - set(tree.gates)


def _tagged(
    chain: Chain, tags: OnsetTags, top: str, latched: list[str], max_states: int
) -> tuple[Chain, Ints]:
    """The chain with histories in its states, and the history of each; a latch keeps them."""
    truth = tags.masks(chain.truth, chain.size)
    first = np.flatnonzero(chain.start > 0.0)
    alive = truth | np.logical_or.reduce([chain.truth[name] for name in latched] or [truth > 0])
    begun = tags.step(np.zeros(len(first), dtype=np.int64), truth[first], alive[first])
    into = chain.truth[top]

    def expand(layer: Columns, first_: bool) -> tuple[Ints, Columns, list[Any]]:
        state, tag = layer
        begin = chain.indptr[state]
        counts = chain.indptr[state + 1] - begin
        if not first_:
            counts = np.where(into[state], 0, counts)
        row, edge = repeat_rows(counts, begin)
        to = chain.targets[edge]
        moved = tags.step(tag[row], truth[to] & ~truth[state[row]], alive[to])
        return row, [to, moved], [edge]

    space = reachable(
        [first, begun],
        [chain.size, _MOST_TAGS],
        expand,
        depth=chain.ends[-1],
        max_states=max_states,
        growth="histories of onsets",
    )
    state, labels = space.columns
    edge = space.payload[0].astype(np.int64)
    start = np.zeros(len(state))
    start[: len(first)] = chain.start[first]
    values = tuple(stage[edge] for stage in chain.values)
    tagged = replace(
        chain,
        start=start,
        indptr=space.indptr,
        targets=space.targets,
        values=values,
        truth={top: into[state]},
    )
    return tagged, labels


def _entering(
    chain: Chain, labels: Ints, tags: OnsetTags, top: str
) -> tuple[list[Sequence_], Floats]:
    """Sequences, and (N + 1, T) probability to enter the top at each epoch by each of them."""
    from scipy.sparse import csr_array

    into = np.flatnonzero(chain.truth[top])
    used, column = np.unique(labels[into], return_inverse=True)
    epochs = chain.ends[-1]
    if (epochs + 1) * len(used) > _MOST_FLOWS:
        raise InputError(
            "too many histories over too many epochs", where=top,
            evidence=f"{len(used)} histories that enter, {epochs} epochs",
        )  # fmt: skip
    shape = (chain.size, len(used))
    group = csr_array((np.ones(len(into)), (into, column)), shape=shape)
    flows = np.zeros((epochs + 1, len(used)))
    law, begin = chain.start, 0
    rows = np.repeat(np.arange(chain.size), np.diff(chain.indptr))
    stays = ~chain.truth[top][chain.targets]
    for end, values in zip(chain.ends, chain.values, strict=True):
        square = (chain.size, chain.size)
        moves = csr_array((values, chain.targets, chain.indptr), shape=square)
        enter = (moves @ group).T.tocsr()
        onward = csr_array((values[stays], (chain.targets[stays], rows[stays])), shape=square)
        for n in range(begin, end):
            flows[n + 1] = enter @ law
            law = onward @ law
        begin = end
    return [tags.sequence(int(tag)) for tag in used], flows
