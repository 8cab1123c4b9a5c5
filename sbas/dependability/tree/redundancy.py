"""Common causes and redundant channels: models made of a model."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Undeveloped,
)
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.model_values import a_choice, a_number, a_whole_number, refuse
from sbas.integrity.allocation_tree import nearest


def common_cause(model: HybridFaultTree, members: tuple[str, ...], beta: float) -> HybridFaultTree:
    """The model in which a share of its members' failures strikes all of them at once.

    Parameters
    ----------
    model : any sound model.
    members : names of two components or more with one failure rate and one repair rate.
    beta : share of the failure rate that is common [1], 0 to 1.

    Returns
    -------
    Each member keeps (1 - beta) of its failure rate, a new component "ccf_<members>" has beta of
    it, both with the repair rate; each event "member failed" becomes an OR of both under its old
    name, and each guard that names a member names the new component too.

    Raises
    ------
    ModelError : unknown members, fewer than two, of several laws or failed at epoch 0 by chance,
        beta outside 0 to 1.

    Notes
    -----
    Beta-factor model: lambda = (1 - beta) lambda + beta lambda for each channel.
    """
    check_model(model)
    a_number(beta, "beta", high=1.0)
    known = {c.name: c for c in model.components}
    for name in members:
        if name not in known:
            raise refuse("no component of that name", "members", name, nearest(name, known))
    laws = {
        (known[m].failure_rate_per_h, known[m].repair_rate_per_h, known[m].initially_failed)
        for m in members
    }
    if len(set(members)) != len(members) or len(members) < 2:
        raise refuse("a common cause of fewer than two", "members", members, "name two or more")
    if len(laws) != 1 or next(iter(laws))[2] != 0.0:
        raise refuse(
            "members of a common cause share one law and start working", "members", sorted(laws),
            "give them the same failure and repair rate, and initially_failed = 0",
        )  # fmt: skip
    rate, repair, _ = next(iter(laws))
    name = "ccf_" + "_".join(members)
    struck = {e.name for e in model.events if isinstance(e, Failed) and e.component in members}
    return _checked(replace(
        model,
        components=(
            *(replace(c, failure_rate_per_h=(1.0 - beta) * rate) if c.name in members else c
              for c in model.components),
            Component(name, beta * rate, repair, source=f"beta = {beta:g} of {', '.join(members)}"),
        ),
        sources=tuple(
            replace(s, guard=(*s.guard, name)) if set(members) & set(s.guard) else s
            for s in model.sources
        ),
        events=(
            *(replace(e, name=f"{e.name}_alone") if e.name in struck else e for e in model.events),
            *((Failed(f"{name}_failed", name),) if struck else ()),
        ),
        gates=(
            *(Or(e.name, (f"{e.name}_alone", f"{name}_failed"))
              for e in model.events if e.name in struck),
            *model.gates,
        ),
        notes=(*model.notes, f"common cause of {', '.join(members)}: beta = {beta:g}"),
    ))  # fmt: skip


def duplicated(
    model: HybridFaultTree,
    mode: Literal["2oo2", "1oo2"],
    *,
    share_sources: bool,
    unsafe: str | None,
) -> HybridFaultTree:
    """Two channels: "2oo2" a compared pair, "1oo2" a switched pair; see `k_out_of_n`."""
    a_choice(mode, ("2oo2", "1oo2"), "mode")
    return k_out_of_n(
        model, 2 if mode == "2oo2" else 1, 2, share_sources=share_sources, unsafe=unsafe
    )


def k_out_of_n(
    model: HybridFaultTree, k: int, n: int, *, share_sources: bool, unsafe: str | None
) -> HybridFaultTree:
    """A voter over n copies of a model that needs k channels which agree.

    Parameters
    ----------
    model : one channel.
    k, n : channels that must agree, channels.
    share_sources : True: all receivers are in the same signal state, each while its own hardware
        works (full dependence); False: each has a chain of its own (independence). The truth
        lies between: report both.
    unsafe : the case in which a channel is wrong and does not know, such as "Case C"; None where
        every failure of a channel is recognised.

    Returns
    -------
    Copies with names suffixed _1 to _n, and
    - `unsafe`: k channels or more are unsafe;
    - "Unavailable": n - k + 1 channels or more are in another case, or fewer than k are free
      of failure and the output is not unsafe (disagreement);
    - the top, under its old name: either of them.
    Undeveloped and house events are common to all channels: identical software fails alike.

    Raises
    ------
    ModelError : k outside 1 to n, `unsafe` no case of the model, or shared sources with
        `con_gap` "hold".

    Notes
    -----
    With 2 of 2, a compared pair, unsafe is AND and any failure of one channel or a disagreement is
    the safe state; with 1 of 2, a switched pair, unsafe is OR and unavailable is AND. A receiver
    whose hardware is repaired then joins the shared signal state in place of `restart`.
    """
    check_model(model)
    if not 1 <= a_whole_number(k, "k") <= a_whole_number(n, "n"):
        raise refuse("no vote", "k", f"{k} of {n}", "write 1 <= k <= n")
    if unsafe is not None and unsafe not in model.cases:
        raise refuse("no case of that name", "unsafe", unsafe, nearest(unsafe, model.cases))
    if share_sources and model.options.con_gap == "hold":
        raise refuse(
            "a run over the states of several sources cannot be held", "options.con_gap", "hold",
            'con_gap = "reset", or share_sources=False',
        )  # fmt: skip
    every = range(1, n + 1)
    common: list[Event] = [e for e in model.events if isinstance(e, House | Undeveloped)]
    sources: list[MarkovSource] = []
    if share_sources:
        sources += [replace(s, guard=(), first_fix_s=0.0) for s in model.sources]
        common += [e for e in _signals(model) if e.states]
    gates: list[Gate] = []
    for i in every:
        more, copies = _channel(model, i, share_sources)
        common += more
        gates += copies
        sources += _receivers(model, i, share_sources)
    return _checked(replace(
        model,
        name=f"{model.name}, {k} of {n}",
        components=tuple(
            replace(c, name=f"{c.name}_{i}") for i in every for c in model.components
        ),
        sources=tuple(sources),
        events=tuple(common),
        gates=(*gates, *_vote(model, k, n, unsafe)),
        cases=("Unavailable",) if unsafe is None else ("Unavailable", unsafe),
        notes=(
            *model.notes,
            f"{k} of {n} channels must agree; their receivers are "
            + ("in one signal state (full dependence)" if share_sources else "independent"),
        ),
    ))  # fmt: skip


def _checked(model: HybridFaultTree) -> HybridFaultTree:
    check_model(model)
    return model


# --- channels ---------------------------------------------------------------------------------


def _receivers(model: HybridFaultTree, i: int, shared: bool) -> list[MarkovSource]:
    """Sources of a channel; where signals are shared, only whether its hardware receives them."""
    found = []
    for source in model.sources:
        own = replace(
            source, name=f"{source.name}_{i}", guard=tuple(f"{g}_{i}" for g in source.guard)
        )
        if not shared:
            found.append(own)
        elif source.guard:
            found.append(replace(
                own, states=("receiving",), rows=((1.0,),), initial=(1.0,), restart="first",
                stages=(), source=f"hardware of {source.name}",
            ))  # fmt: skip
    return found


def _signals(model: HybridFaultTree) -> list[InState]:
    """Events of the shared signal states."""
    return [
        replace(e, name=f"{e.name}_signal", states=_split(model, e)[0])
        for e in model.events
        if isinstance(e, InState)
    ]


def _split(model: HybridFaultTree, event: InState) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """States of an event in which signals are received, and those of failed hardware."""
    source = next(s for s in model.sources if s.name == event.source)
    return (
        tuple(s for s in event.states if s in source.states),
        tuple(s for s in event.states if s not in source.states),
    )


def _channel(model: HybridFaultTree, i: int, shared: bool) -> tuple[list[Event], list[Gate]]:
    events: list[Event] = []
    gates: list[Gate] = []
    names = {x.name: f"{x.name}_{i}" for x in (*model.events, *model.gates)}
    names |= {e.name: e.name for e in model.events if isinstance(e, House | Undeveloped)}
    guarded = {s.name for s in model.sources if s.guard}
    if shared:
        events += [
            InState(f"{name}_{i}_receiving", f"{name}_{i}", ("receiving",))
            for name in sorted({e.source for e in _signals(model) if e.states} & guarded)
        ]
    for event in model.events:
        match event:
            case Failed():
                events.append(Failed(names[event.name], f"{event.component}_{i}"))
            case InState() if not shared:
                events.append(replace(event, name=names[event.name], source=f"{event.source}_{i}"))
            case InState():
                signal, hardware = _split(model, event)
                more, parts = _shared_event(event, names[event.name], i, signal, hardware, guarded)
                events += more
                gates += parts
    for gate in model.gates:
        fed = tuple(names[name] for name in gate.inputs)
        key = {"inputs": fed} if "inputs" in gate.__dataclass_fields__ else {"input": fed[0]}
        gates.append(replace(gate, name=names[gate.name], **key))
    return events, gates


def _shared_event(
    event: InState,
    name: str,
    i: int,
    signal: tuple[str, ...],
    hardware: tuple[str, ...],
    guarded: set[str],
) -> tuple[list[Event], list[Gate]]:
    """A channel's event over the shared signal state and the state of its own hardware."""
    if event.source not in guarded:
        if not signal:
            return [House(name, False)], []
        return [], [Or(name, (f"{event.name}_signal",))]
    received = (f"{event.name}_signal", f"{event.source}_{i}_receiving")
    if not hardware:
        return [], [And(name, received)]
    if not signal:
        return [InState(name, f"{event.source}_{i}", hardware)], []
    out = InState(f"{name}_hardware", f"{event.source}_{i}", hardware)
    return [out], [And(f"{name}_received", received), Or(name, (f"{name}_received", out.name))]


def _vote(model: HybridFaultTree, k: int, n: int, unsafe: str | None) -> list[Gate]:
    """Gates that combine the channels' cases and tops."""
    fixed = {e.name for e in model.events if isinstance(e, House | Undeveloped)}

    def each(name: str) -> tuple[str, ...]:
        return tuple(name if name in fixed else f"{name}_{i}" for i in range(1, n + 1))

    too_few = AtLeast("Too few free of failure", n - k + 1, each(model.top))
    if unsafe is None:
        return [too_few, Or("Unavailable", (too_few.name,)), Or(model.top, ("Unavailable",))]
    others = [case for case in model.cases if case != unsafe]
    gates: list[Gate] = [
        too_few,
        AtLeast(unsafe, k, each(unsafe)),
        Not("Not unsafe", unsafe),
        And("Disagreement", (too_few.name, "Not unsafe")),
    ]
    parts: tuple[str, ...] = ()
    if others:
        gates += [Or(f"Recognised_{i + 1}", tuple(each(case)[i] for case in others))
                  for i in range(n)]  # fmt: skip
        gates.append(AtLeast("Too few", n - k + 1, tuple(f"Recognised_{i + 1}" for i in range(n))))
        parts = ("Too few",)
    # The top is either case; without the NOT of the disagreement it stays a coherent tree.
    return [
        *gates,
        Or("Unavailable", ("Disagreement", *parts)),
        Or(model.top, (too_few.name, *parts, unsafe)),
    ]
