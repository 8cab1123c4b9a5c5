"""The explicit Markov chain of a model as .tra and .lab text, and back in."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exchange.identifiers import identifiers
from sbas.dependability.exchange.losses import Loss, LossReport, loss_of
from sbas.dependability.exchange.safe_xml import content_of
from sbas.dependability.tree.model import HybridFaultTree
from sbas.dependability.tree.model_check import check_model, in_order, supports
from sbas.exceptions import InputError, ModelError

_ROW_SUM = 1e-9
_INITIAL = "init"
_LABEL = re.compile(r"[^\s\"#]+")
_MAX_STATE = 2**31


@dataclass(frozen=True, eq=False)
class ExplicitChain:
    """A discrete-time Markov chain with labelled states.

    Parameters
    ----------
    states : number of states, numbered from 0.
    origins, targets : (moves,) states, sorted by origin, then target.
    probabilities : (moves,) [1], above 0; those of an origin add up to 1.
    labels : states, ascending, of each label; "init" holds the one initial state.
    """

    states: int
    origins: NDArray[np.int64]
    targets: NDArray[np.int64]
    probabilities: NDArray[np.float64]
    labels: Mapping[str, NDArray[np.int64]]


@dataclass(frozen=True)
class ExportedChain:
    """A chain that was built from a model.

    Parameters
    ----------
    chain : the chain.
    extra_steps : 1 where state 0 is a state before epoch 0, from which the law of epoch 0 is
        drawn: "within N epochs" is then "within N + 1 steps".
    report : what the chain does not hold.
    """

    chain: ExplicitChain
    extra_steps: int
    report: LossReport


def explicit_chain(
    model: HybridFaultTree, *, labels: Iterable[str] | None = None, max_states: int = 2_000_000
) -> ExportedChain:
    """The chain of components, sources and gate memories of a model, epoch by epoch.

    Parameters
    ----------
    model : hybrid fault tree whose sources keep their rows for the whole mission.
    labels : events and gates to label; None is the top, as "top", and the cases.
    max_states : largest number of states.

    Returns
    -------
    ExportedChain: "at least once in N epochs" is P=? [F<=N "top"] where nothing is true at
    epoch 0.

    Raises
    ------
    ModelError : an invalid model, an unknown name, or sources with stages.
    InputError : more than `max_states` states.

    References
    ----------
    Product of the chain with gate memories: `sbas.dependability.exact.product_chain`; the format
    is Storm's.
    """
    from sbas.dependability.exact.gate_memory import gate_memory
    from sbas.dependability.exact.product_chain import product_chain
    from sbas.dependability.exact.transitions import component_chain

    check_model(model)
    asked = [model.top, *model.cases] if labels is None else list(labels)
    below = supports(model)
    for name in asked:
        if name not in below:
            raise ModelError(f"{name!r} is no event or gate of the model", where="labels")
    support = frozenset[str]().union(*(below[name] for name in asked))
    parts = component_chain(model, support, max_states=max_states)
    if len(parts.values) > 1:
        raise ModelError(
            "the rows of a source change during the mission: one chain cannot hold that",
            where=f"model {model.name!r}",
            cure="export a model of one stage",
        )
    used = _used(model, asked)
    gates = [gate for gate in in_order(model) if gate.name in used]
    product = product_chain(parts, gate_memory(gates, model), max_states=max_states).chain
    as_label = identifiers(dict.fromkeys(asked))
    if labels is None:
        as_label[model.top] = "top"
    origins = np.repeat(np.arange(product.size), np.diff(product.indptr))
    targets, values = np.asarray(product.targets), np.asarray(product.values[0])
    starts = np.flatnonzero(product.start > 0)
    extra = 0 if len(starts) == 1 else 1
    if extra:
        origins = np.concatenate([np.zeros(len(starts), dtype=np.int64), origins + 1])
        targets = np.concatenate([starts + 1, targets + 1])
        values = np.concatenate([product.start[starts], values])
    order = np.lexsort((targets, origins))
    states = {
        label: np.flatnonzero(product.truth[name]) + extra for name, label in as_label.items()
    }
    initial = np.zeros(1, dtype=np.int64) if extra else starts
    chain = ExplicitChain(
        product.size + extra,
        origins[order].astype(np.int64),
        targets[order].astype(np.int64),
        values[order],
        {_INITIAL: initial.astype(np.int64), **states},
    )
    losses = [loss_of(model.name, "epoch and mission", "tra/lab")]
    losses += [
        loss_of(name, "cases", "tra/lab", besides=f"label {as_label[name]!r}")
        for name in model.cases
        if name in as_label
    ]
    if extra:
        losses.append(
            Loss(model.name, "law at epoch 0", "kept", "a state before epoch 0: one step more")
        )
    return ExportedChain(chain, extra, LossReport("tra/lab", tuple(losses)))


def _used(model: HybridFaultTree, asked: Iterable[str]) -> set[str]:
    """Names asked for and all below them."""
    below = {gate.name: gate.inputs for gate in model.gates}
    seen: set[str] = set()
    stack = list(asked)
    while stack:
        at = stack.pop()
        if at not in seen:
            seen.add(at)
            stack.extend(below.get(at, ()))
    return seen


def tra_text(chain: ExplicitChain) -> str:
    """The transitions: "dtmc", then "from to probability" sorted, a row for every state.

    Parameters
    ----------
    chain : a state without a move gets a self-loop.

    References
    ----------
    Storm, explicit format; %.17g.
    """
    lines = ["dtmc"]
    origins, targets = chain.origins.tolist(), chain.targets.tolist()
    values = chain.probabilities.tolist()
    expected = 0
    for origin, target, value in zip(origins, targets, values, strict=True):
        lines += [f"{state} {state} 1" for state in range(expected, origin)]
        expected = origin + 1
        lines.append(f"{origin} {target} {value:.17g}")
    lines += [f"{state} {state} 1" for state in range(expected, chain.states)]
    return "\n".join(lines) + "\n"


def lab_text(chain: ExplicitChain) -> str:
    """The labels: their declaration, then "state label..." ascending.

    Parameters
    ----------
    chain : with "init" among its labels.

    Raises
    ------
    ModelError : a label with a blank, quotation mark or number sign.

    References
    ----------
    Storm, explicit format.
    """
    for label in chain.labels:
        if not _LABEL.fullmatch(label):
            raise ModelError(f"{label!r} cannot be a label", where="labels")
    of_state: dict[int, list[str]] = {}
    for label, states in chain.labels.items():
        for state in states.tolist():
            of_state.setdefault(state, []).append(label)
    lines = ["#DECLARATION", " ".join(chain.labels), "#END"]
    lines += [f"{state} {' '.join(of_state[state])}" for state in sorted(of_state)]
    return "\n".join(lines) + "\n"


def read_explicit_chain(tra: Path | str | bytes, lab: Path | str | bytes) -> ExplicitChain:
    """A chain from its .tra and .lab files.

    Parameters
    ----------
    tra, lab : paths of files, or their content as bytes.

    Raises
    ------
    InputError : another header (PRISM's has numbers), rows out of order or not adding up to 1,
        a state without a row, a label that is not declared; with the line.

    References
    ----------
    Storm, explicit format.
    """
    origins, targets, values, states = _read_tra(tra)
    labels = _read_lab(lab, states)
    sums = np.bincount(origins, weights=values, minlength=states)
    wrong = np.flatnonzero(np.abs(sums - 1) > _ROW_SUM)
    if len(wrong):
        raise InputError(
            f"the probabilities out of {len(wrong)} states do not add up to 1",
            evidence=f"state {wrong[0]}: {sums[wrong[0]]!r}",
            cure="give every state a row; one that is never left needs a self-loop",
        )
    return ExplicitChain(states, origins, targets, values, labels)


def _lines(source: Path | str | bytes) -> tuple[list[str], str]:
    content, where = content_of(source)
    return content.decode("utf-8", errors="replace").splitlines(), where


def _read_tra(
    source: Path | str | bytes,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], int]:
    lines, where = _lines(source)
    if not lines or lines[0].strip() != "dtmc":
        raise InputError(
            "the first line is not 'dtmc'",
            where=where,
            evidence=lines[0][:60] if lines else "the file is empty",
            cure="Storm's explicit format is read; PRISM's begins with numbers",
        )
    moves: list[tuple[int, int]] = []
    values: list[float] = []
    last = (-1, -1)
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        if not words:
            continue
        try:
            move, value = (_state(words[0]), _state(words[1])), float(words[2])
            correct = len(words) == 3 and 0 < value <= 1
        except (ValueError, IndexError):
            correct = False
        if not correct:
            raise InputError(
                "not 'from to probability' with a probability above 0",
                where=f"{where}:{number}",
                evidence=line[:60],
            )
        if move <= last:
            raise InputError("moves are not in ascending order", where=f"{where}:{number}")
        last = move
        moves.append(move)
        values.append(value)
    if not moves:
        raise InputError("the chain has no move", where=where)
    pairs = np.array(moves, dtype=np.int64)
    states = int(pairs.max()) + 1
    # A file of few lines that names a far state would ask for memory without end.
    if states > len(moves):
        raise InputError("there are states without a row", where=where, evidence=f"{states} states")
    return pairs[:, 0], pairs[:, 1], np.array(values), states


def _read_lab(source: Path | str | bytes, states: int) -> dict[str, NDArray[np.int64]]:
    lines, where = _lines(source)
    text = [line.strip() for line in lines]
    if not text or text[0] != "#DECLARATION" or "#END" not in text:
        raise InputError("the labels are not declared", where=where, cure="#DECLARATION ... #END")
    end = text.index("#END")
    declared = [word for line in text[1:end] for word in line.split()]
    found: dict[str, list[int]] = {label: [] for label in declared}
    last = -1
    for number, line in enumerate(text[end + 1 :], start=end + 2):
        words = line.split()
        if not words:
            continue
        try:
            state = _state(words[0])
        except ValueError:
            state = -1
        if not last < state < states:
            raise InputError(
                "not a state of the chain, in ascending order",
                where=f"{where}:{number}",
                evidence=line[:60],
            )
        last = state
        for label in words[1:]:
            if label not in found:
                raise InputError(f"the label {label!r} is not declared", where=f"{where}:{number}")
            found[label].append(state)
    return {label: np.array(held, dtype=np.int64) for label, held in found.items()}


def _state(word: str) -> int:
    if not word.isascii() or not word.isdigit() or len(word) > 10 or int(word) >= _MAX_STATE:
        raise ValueError(word)
    return int(word)
