"""What is demonstrated, said first and in words."""

from __future__ import annotations

from sbas.estimate import Estimate, Refusal
from sbas.integrity.planning import plan_hours
from sbas.integrity.rate_evidence import NPA_CLAIM, RateEvidence
from sbas.integrity.results import Evaluation
from sbas.integrity.sil import NOT_DEMONSTRATED, SIL_BANDS_PER_H, meets, sil_verdict
from sbas.numerals import count, hours, metres, number, percent, share, upward
from sbas.reporting.content import Callout, Cell, Section, Table, Tile, table

_SIL_3_PER_H = next(above for level, _, above in SIL_BANDS_PER_H if level == 3)


def section(evaluation: Evaluation) -> Section:
    """The verdict on the claimed integrity risk at every alert limit, and the main figures."""
    rates = [r.rates["hmi"] for r in evaluation.alert_limits if "hmi" in r.rates]
    callouts = [_verdict(evaluation, rates)]
    if evaluation.errors_are_lower_bound:
        callouts.append(
            Callout(
                "warning",
                "Errors are a lower bound",
                (
                    "No truth was given: every error is formed against the recording's own "
                    "median position, which hides any constant error. True errors may be larger. "
                    "No error rate is demonstrated; give the surveyed position of the antenna.",
                ),
            )
        )
    serious = sum(f.severity != "info" for f in evaluation.findings)
    if serious:
        callouts.append(
            Callout(
                "warning",
                f"{serious} finding{'s' * (serious > 1)} about the input",
                ("They qualify the figures below; section Findings lists each with its cure.",),
            )
        )
    tables = (_by_limit(evaluation, rates),) if rates else ()
    return Section("verdict", "Verdict", tuple(callouts), _tiles(evaluation), (), tables)


def _met(rate: RateEvidence) -> bool:
    shown, claim = rate.demonstrated, rate.claimed
    if isinstance(shown, Refusal) or isinstance(claim, Refusal):
        return False
    return meets(shown, claim.value).demonstrated


def _verdict(evaluation: Evaluation, rates: list[RateEvidence]) -> Callout:
    confidence = f"{percent(evaluation.settings.confidence)}"
    claimed = f"{number(NPA_CLAIM.value)} per hour"
    met = [rate.alert_limit_m for rate in rates if _met(rate)]
    unmet = [al for al in evaluation.settings.alert_limits_m if al not in met]
    status = "DEMONSTRATED" if not unmet else "DEMONSTRATED IN PART" if met else NOT_DEMONSTRATED
    lines = []
    if met:
        lines.append(
            f"An integrity risk below {claimed} is demonstrated at {confidence} confidence "
            f"for {_listed(met)}."
        )
    if unmet:
        lines.append(
            f"The claimed integrity risk of {claimed} ({NPA_CLAIM.basis}) is not demonstrated "
            f"by this recording for {_listed(unmet)}."
        )
    if not rates:
        lines.append("There is no truth for this recording, so no error was formed or counted.")
    alike: dict[tuple[float, int, int, float, float], list[float]] = {}
    for rate in rates:
        if isinstance(rate.demonstrated, Estimate) and rate.demonstrated.upper is not None:
            seen = (rate.events, rate.runs, rate.event_hours, rate.hours)
            alike.setdefault((rate.demonstrated.upper, *seen), []).append(rate.alert_limit_m)
    for (upper, events, runs, within, exposed), limits in alike.items():
        lasting = f", {hours(within)} within them ({count(runs)} runs)" if events else ""
        lines.append(
            f"What is demonstrated at {confidence} confidence: hazardously misleading information "
            f"(HMI) begins less often than {upward(upper)} times per hour for {_listed(limits)}: "
            f"{count(events)} event{'s' * (events != 1)}{lasting} in {hours(exposed)} of exposure."
        )
    reasons = {r.demonstrated.reason: r.demonstrated.cure
               for r in rates if isinstance(r.demonstrated, Refusal)}  # fmt: skip
    lines += [
        f"{reason[0].upper()}{reason[1:]} (cure: {cure})." for reason, cure in reasons.items()
    ]
    if unmet:
        lines.append(_hours_needed(evaluation))
    tone = "good" if not unmet else "warning" if met else "bad"
    return Callout(tone, f"{status}: an integrity risk of {claimed}", tuple(lines))  # type: ignore[arg-type]


def _hours_needed(evaluation: Evaluation) -> str:
    plan = plan_hours(_SIL_3_PER_H, confidence=evaluation.settings.confidence)
    return (
        "Counting alone cannot reach the rates of SIL 3 or SIL 4 with these hours: a rate below "
        f"{number(_SIL_3_PER_H)} per hour needs {upward(plan.hours)} h without an event, "
        f"about {number(plan.years)} years; judged here are "
        f"{hours(evaluation.exposure.judged_hours)}."
    )


def _listed(limits: list[float]) -> str:
    plural = "alert limits of" if len(limits) > 1 else "an alert limit of"
    return f"{plural} {', '.join(f'{limit:g}' for limit in limits)} m"


def _by_limit(evaluation: Evaluation, rates: list[RateEvidence]) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for rate in rates:
        shown = rate.demonstrated
        bound, sil = "not given", "none"
        if isinstance(shown, Estimate) and shown.upper is not None:
            level = sil_verdict(shown).level
            bound, sil = upward(shown.upper), f"SIL {level}" if level else "none"
        judgement = Cell("DEMONSTRATED", "good") if _met(rate) else Cell(NOT_DEMONSTRATED, "bad")
        rows.append(
            (
                Cell(f"{rate.alert_limit_m:g}"), count(rate.events), number(rate.hours, 6),
                bound, Cell(sil, trace="sil"), judgement,
            )
        )  # fmt: skip
    settings = evaluation.settings
    return table(
        "Integrity risk by alert limit (HMI events)",
        f"#Alert limit [m]|#Events|#Exposure [h]|#Upper bound at "
        f"{percent(settings.confidence)} [1/h]|SIL by that bound|"
        f"Claim of {number(NPA_CLAIM.value)} /h",
        rows,
        f"HMI: HPE ≥ alert limit while HPL < alert limit for at least "
        f"{settings.time_to_alert_s:g} s. Only a one-sided upper bound on counted events "
        "decides; a tie is not demonstrated.",
    )


def _tiles(evaluation: Evaluation) -> tuple[Tile, ...]:
    tiles = [Tile("judged exposure", hours(evaluation.exposure.judged_hours),
                  "epochs with error and level")]  # fmt: skip
    if level := evaluation.hpl_m:
        tiles.append(
            Tile("HPL median", f"{metres(level.median)} m", f"largest {metres(level.max)} m")
        )
    if error := evaluation.hpe_m:
        bound = " (lower bound)" if evaluation.errors_are_lower_bound else ""
        tiles.append(
            Tile(f"HPE 95 %{bound}", f"{metres(error.p95)} m", f"largest {metres(error.max)} m")
        )
    widest = max(evaluation.alert_limits, key=lambda r: r.alert_limit_m)
    tiles.append(
        Tile(
            f"availability, AL {widest.alert_limit_m:g} m",
            share(widest.availability.availability.value),
            "gaps count as down",
        )
    )
    return tuple(tiles)
