"""The events one by one, the worst kind first."""

from __future__ import annotations

from sbas.integrity.events import Events
from sbas.integrity.results import Evaluation
from sbas.numerals import count, number, stamp
from sbas.reporting.content import Section, Table, table

SHOWN = 50
"""Events that a table lists; the others are counted."""


def section(evaluation: Evaluation) -> Section:
    """Start and duration of HMI and HPE >= AL at every alert limit, and of MI once."""
    tables = []
    for limit in evaluation.alert_limits:
        for kind, name in (("hmi", "HMI"), ("exceeds_al", "HPE ≥ AL")):
            if kind in limit.events and len(limit.events[kind]):
                title = f"{name} at an alert limit of {limit.alert_limit_m:g} m"
                tables.append(_listed(title, limit.events[kind]))
    misleading = [limit.events["mi"] for limit in evaluation.alert_limits if "mi" in limit.events]
    if misleading and len(misleading[0]):
        tables.append(_listed("MI (HPE ≥ HPL), whatever the alert limit", misleading[0]))
    if evaluation.truth is None:
        words = "Without truth no error was formed, so no event can be listed."
    elif not tables:
        words = "No event of any kind was seen."
    else:
        words = (
            f"Runs of epochs at most {evaluation.settings.reset_s:g} s apart are one event here "
            "(reset time of the user system); rates merge more widely, see Parameters."
        )
    return Section("events", "Events", paragraphs=(words,), tables=tuple(tables))


def _listed(title: str, events: Events) -> Table:
    shown = zip(
        events.start_ns[:SHOWN].tolist(),
        events.duration_s[:SHOWN].tolist(),
        events.censored[:SHOWN].tolist(),
        strict=True,
    )
    rest = len(events) - SHOWN
    return table(
        f"{title}: {count(len(events))}",
        "#No.|Start [GPST]|#Duration [s]|End seen",
        [
            (str(i), stamp(start), number(duration, 6), "no: longer" if cut else "yes")
            for i, (start, duration, cut) in enumerate(shown, 1)
        ],
        *([f"{count(rest)} more are counted but not listed."] if rest > 0 else []),
    )
