"""Why: HPL spikes and misleading epochs with their likeliest causes."""

from __future__ import annotations

from sbas.estimate import Refusal
from sbas.integrity.causes.causes import Causes, ExplainedEvent
from sbas.numerals import count, number, stamp
from sbas.reporting.content import Cell, Section, Table, table

SHOWN = 50
_NAMES = {"hpl_spike": "HPL spikes", "mi": "MI", "near_mi": "near-MI"}


def section(causes: Causes | Refusal) -> Section:
    """Events by kind and cause, and each of them with what speaks for its cause."""
    if isinstance(causes, Refusal):
        return Section("causes", "Likely causes", paragraphs=(f"Not explained: {causes}.",))
    judged = "" if causes.truth is not None else " Without truth only spikes are found."
    words = (
        f"A spike is an HPL above {causes.spike_ratio:g} times its running median over "
        f"{causes.window_s:g} s; near-MI an HPE from {causes.near_ratio:g} of HPL on. A cause is "
        f"the likeliest by what the columns show, not a proof.{judged}"
    )
    if not causes.events:
        return Section("causes", "Likely causes", paragraphs=(words, "No such event was seen."))
    return Section(
        "causes", "Likely causes", paragraphs=(words,), tables=(_counts(causes), _events(causes))
    )


def _counts(causes: Causes) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (_NAMES[kind], cause, count(events))
        for kind, by_cause in causes.counts().items()
        for cause, events in by_cause.items()
    ]
    return table("Events by likeliest cause", "Event|Cause|#Events", rows)


def _events(causes: Causes) -> Table:
    # The worst first: misleading ones, then those farthest from the usual.
    ordered = sorted(causes.events, key=lambda e: (not e.misleading, -e.ratio))
    rest = len(ordered) - SHOWN
    return table(
        f"Each event, the worst first: {count(len(ordered))}",
        "Start [GPST]|Event|#Duration [s]|#HPL [m]|#Ratio|Cause|Evidence",
        [_row(event) for event in ordered[:SHOWN]],
        "Ratio: HPL over its usual value for a spike, else HPE over HPL. A cause with a question "
        "mark holds less than 80 % of the event.",
        *([f"{count(rest)} more are counted but not listed."] if rest > 0 else []),
    )


def _row(event: ExplainedEvent) -> tuple[Cell | str, ...]:
    return (
        stamp(event.start_ns), _NAMES[event.kind], number(event.duration_s, 6),
        number(event.hpl_m), number(event.ratio),
        event.cause + ("" if event.settled else "?"), event.evidence,
    )  # fmt: skip
