"""The receiver's states of a recording: what was seen, how it moves on, how long it lasts."""

from __future__ import annotations

import math

from sbas.dependability.receiver.state_chain import StateChain
from sbas.dependability.receiver.state_estimation import ReceiverStates
from sbas.dependability.receiver.state_tally import STATES
from sbas.dependability.receiver.thinned_states import StateStrip
from sbas.estimate import Refusal
from sbas.numerals import count, number, percent
from sbas.plots import sojourn_picture, states_over_time
from sbas.reporting.content import Callout, Cell, Picture, Section, Table, Tone, table
from sbas.reporting.drawn import drawn


def section(states: ReceiverStates, strip: StateStrip | None) -> Section:
    """Tables of epochs, transitions and tests; ribbon and run lengths as pictures."""
    total = sum(states.epochs.values())
    seen: list[tuple[Cell | str, ...]] = [
        (name.replace("_", " "), count(n), number(n / total) if total else "-")
        for name, n in states.epochs.items()
    ]
    files = ", ".join(str(s.get("path", "")) for s in states.sources) or "a recording"
    tone: Tone = "warning" if states.rejected else ""
    return Section(
        "receiver",
        "Receiver states",
        callouts=(
            Callout(tone, f"{states.conclusion[0].upper()}{states.conclusion[1:]}", (
                f"From {files}: a position with an error of {states.threshold_m:g} m or more is "
                f"wrong; {count(states.cuts)} cuts, across which nothing is counted.",
            )),
        ),
        tables=(
            table("Epochs", "State|#Epochs|#Share [1]", seen),
            *(_transitions(states, chain) for chain in states.chains),
            *(_tests(chain) for chain in states.chains),
        ),
        pictures=_pictures(states, strip),
    )  # fmt: skip


def _transitions(states: ReceiverStates, chain: StateChain) -> Table:
    lower, upper = chain.limits()
    unseen = chain.up_to()
    rows: list[tuple[Cell | str, ...]] = []
    for i, start in enumerate(STATES):
        row = chain.probabilities[i]
        cells = ["never left"] * len(STATES)
        if row is not None:
            for j, p in enumerate(row):
                most = unseen[i][j]
                cells[j] = (
                    f"0, up to {number(most, 3)}"
                    if most is not None
                    else f"{number(p)} [{number(lower[i, j], 3)}, {number(upper[i, j], 3)}]"
                )
        rows.append((start, *cells, count(chain.totals[i])))
    where = f", {chain.label}" if chain.label else ""
    return table(
        f"Probability of the next state, one epoch of {states.interval_s:g} s on{where}",
        "From|#" + "|#".join(STATES) + "|#Transitions",
        rows,
        f"In brackets exact binomial limits at {percent(chain.confidence)}; what was never seen "
        "has an upper limit only.",
    )


def _tests(chain: StateChain) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for answer in (chain.order, *chain.sojourn, *chain.tail):
        if isinstance(answer, Refusal):
            rows.append((answer.reason, "not made", "-", "-", answer.cure))
            continue
        df = "-" if answer.df is None else f"{answer.df}"
        statistic = number(answer.statistic) if math.isfinite(answer.statistic) else "infinite"
        rows.append((answer.name, statistic, df, number(answer.p, 3), answer.method))
    where = f", {chain.label}" if chain.label else ""
    return table(
        f"Tests of the Markov property{where}", "Test|#Statistic|#df|#p|How", rows,
        "A small p speaks against a first-order chain; all tests together are judged above.",
    )  # fmt: skip


def _pictures(states: ReceiverStates, strip: StateStrip | None) -> tuple[Picture, ...]:
    found = []
    if strip is not None:
        found.append(
            drawn(
                "ribbon", "States along time", states_over_time.SHEET,
                lambda axes: states_over_time.state_ribbon(strip, ax=axes[0]),
                "Receiver states over time: worst state of each bin above the shares of all.",
                "The upper band shows the worst state of each bin, so that no wrong epoch is "
                "lost; below are the shares. White stretches are gaps of the record.",
                wide=True,
            )
        )  # fmt: skip
    for state in ("wrong", "missing"):
        found += [
            drawn(
                f"sojourn-{state}-{i}", f"Runs of {state} epochs" + _of(chain),
                sojourn_picture.SHEET,
                lambda axes, s=state, c=chain: sojourn_picture.sojourn_survival(  # type: ignore[misc]
                    states, state=s, environment=c.label or None, ax=axes[0]
                ),
                f"Share of runs of {state} epochs by length, against the geometric law.",
                f"Dots above the broken line at k = {states.tail_runs} and beyond: runs last "
                "longer than a Markov chain says, and gates that count them come out too small.",
            )
            for i, chain in enumerate(states.chains)
        ]  # fmt: skip
    return tuple(found)


def _of(chain: StateChain) -> str:
    return f", {chain.label}" if chain.label else ""
