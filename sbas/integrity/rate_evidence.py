"""What a rate of events rests on: demonstrated, modelled, claimed, never mixed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from sbas.estimate import Estimate, Quoted, Refusal
from sbas.integrity.counting import garwood_limits, poisson_bounds

EventKind = Literal["hmi", "mi", "exceeds_al"]

EVENT_KINDS: dict[EventKind, str] = {
    "hmi": "HPE >= AL and HPL < AL for at least the time to alert",
    "mi": "HPE >= HPL",
    "exceeds_al": "HPE >= AL, whatever the HPL",
}
"""Kinds of events with their definitions; ties are unsafe."""

FBM = "Filip, Bazant, Mocek 2010"

NPA_CLAIM = Estimate(
    1e-7, None, None, None, "per_h", Quoted(FBM, "2.1.2 and Fig. 2: NPA, 1e-7 in 1 hour"),
    caveats=("an allocation of the service, not evidence of this receiver",),
)  # fmt: skip
"""Integrity risk allocated to the SBAS non-precision approach service, faulted and fault-free."""

_NO_CLAIM = Refusal("no allocation covers errors regardless of the protection level")
_LOWER_BOUND = Refusal(
    "not demonstrated: errors against this truth are only a lower bound",
    "--truth LAT,LON,HEIGHT of the antenna",
)
_NO_EXPOSURE = Refusal(
    "not demonstrated: no time remains in which an event could have begun",
    "see the table of exposure: hours without error, without level, or within events",
)


@dataclass(frozen=True)
class RateEvidence:
    """The rate of one kind of event at one alert limit, in every evidence class.

    `events` are `runs` of bad epochs merged over the merge time; `event_hours` the time within
    them. `hours` is the time at risk: judged time less the events and the merge time after
    each, since no new event can begin there (docs/methods/tails.md: divided by the whole time,
    the bound of a strongly correlated record covers only 60 % instead of 95 %).
    """

    event: EventKind
    alert_limit_m: float
    events: int
    runs: int
    event_hours: float
    hours: float
    demonstrated: Estimate | Refusal
    modelled: Estimate | Refusal
    claimed: Estimate | Refusal

    def to_dict(self) -> dict[str, Any]:
        return {
            "event": self.event,
            "alert_limit_m": self.alert_limit_m,
            "events": self.events,
            "runs": self.runs,
            "event_hours": self.event_hours,
            "hours": self.hours,
            "demonstrated": self.demonstrated.to_dict(),
            "modelled": self.modelled.to_dict(),
            "claimed": self.claimed.to_dict(),
        }


def rate_evidence(
    event: EventKind,
    alert_limit_m: float,
    *,
    events: int,
    runs: int,
    event_hours: float,
    judged_hours: float,
    merge_hours: float,
    confidence: float,
    lower_bound: bool,
    modelled: Estimate | Refusal,
    caveats: tuple[str, ...] = (),
) -> RateEvidence:
    """The evidence for a rate from counted events.

    Parameters
    ----------
    event : kind of event.
    alert_limit_m : alert limit [m].
    events : declustered events.
    runs : runs of bad epochs before they were merged.
    event_hours : time within the events [h].
    judged_hours : time covered by epochs at which such an event could be seen [h].
    merge_hours : merge time of the events [h].
    confidence : of the one-sided upper bound.
    lower_bound : True where the truth shows but a part of the errors (own median, track line).
    modelled : the rate by a fitted tail, or why there is none.
    caveats : sentences that must travel with the demonstrated rate.
    """
    demonstrated: Estimate | Refusal
    hours = max(judged_hours - event_hours - events * merge_hours, 0.0)
    if lower_bound:
        demonstrated = _LOWER_BOUND
    elif hours <= 0:
        demonstrated = _NO_EXPOSURE
    else:
        demonstrated = poisson_bounds(events, hours, confidence)
        if runs > 2 * events:
            caveats = (*caveats, f"{runs} runs of bad epochs were merged into {events} events")
        demonstrated = replace(demonstrated, caveats=(*demonstrated.caveats, *caveats))
    modelled = _unless_contradicted(event, modelled, demonstrated, events, hours)
    claimed = _NO_CLAIM if event == "exceeds_al" else NPA_CLAIM
    return RateEvidence(
        event=event,
        alert_limit_m=alert_limit_m,
        events=events,
        runs=runs,
        event_hours=event_hours,
        hours=hours,
        demonstrated=demonstrated,
        modelled=modelled,
        claimed=claimed,
    )


_SURE = 0.999
"""Confidence at which a count contradicts a model."""


def _unless_contradicted(
    event: EventKind,
    modelled: Estimate | Refusal,
    demonstrated: Estimate | Refusal,
    events: int,
    hours: float,
) -> Estimate | Refusal:
    """The modelled rate, unless the count of the same record says that it is wrong."""
    if isinstance(modelled, Refusal) or isinstance(demonstrated, Refusal):
        return modelled
    lower, upper = (float(x) for x in garwood_limits(events, _SURE, sided="two"))
    bound = modelled.value if modelled.upper is None else modelled.upper
    # HMI is counted from the time to alert on: fewer than the model's are no contradiction.
    too_many = event != "hmi" and modelled.value * hours > 3 * upper
    if bound * hours < lower or too_many:
        return Refusal(
            f"the count contradicts the model: {events} events were seen where it expects "
            f"{modelled.value * hours:.3g}, at most {bound * hours:.3g}",
            "use the demonstrated bound; look for errors that do not grow as HPL does",
        )
    return modelled
