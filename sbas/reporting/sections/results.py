"""Errors, levels, rates, availability and regions: the figures with their intervals."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR

from sbas.estimate import Counted, Estimate, Fitted, Refusal
from sbas.integrity.availability import Availability
from sbas.integrity.rate_evidence import EVENT_KINDS
from sbas.integrity.results import Evaluation
from sbas.integrity.stanford import REGIONS
from sbas.numerals import count, hours, metres, number, percent, share, upward
from sbas.reporting.content import Cell, Section, Table, table

_REGION_HEADS = {
    "nominal": "nominal", "unavailable": "unavailable", "mi_unavailable": "MI, unavailable",
    "mi": "MI", "hmi": "HMI", "missing": "error or level missing",
}  # fmt: skip


def section(evaluation: Evaluation) -> Section:
    """All figures; each row or head leads to its method."""
    tables = [_quantities(evaluation)]
    if any(r.rates for r in evaluation.alert_limits):
        tables.append(_rates(evaluation))
    tables.append(_availability(evaluation))
    if any(r.regions for r in evaluation.alert_limits):
        tables.append(_regions(evaluation))
    return Section(
        "figures",
        "Figures",
        paragraphs=(
            "Bounds are one-sided and rounded to the safe side. Evidence is demonstrated (counted "
            "in this recording), modelled (a fitted model) or claimed (quoted from a document); "
            "the classes are never mixed. Underlined names lead to their method.",
        ),
        tables=tuple(tables),
    )


def _quantities(evaluation: Evaluation) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for name, label, trace in (
        ("hpe_m", "HPE", "errors"), ("vpe_m", "VPE", "errors"),
        ("hpl_m", "HPL", "levels"), ("vpl_m", "VPL", "levels"),
    ):  # fmt: skip
        seen = getattr(evaluation, name)
        if seen is None:
            rows.append((Cell(label, trace=trace), *["none"] * 5, "0"))
            continue
        figures = (seen.min, seen.median, seen.p95, seen.max, seen.mean)
        rows.append((Cell(label, trace=trace), *map(metres, figures), count(seen.epochs)))
    notes = []
    inexact = [s.resolution_m for s in (evaluation.hpe_m, evaluation.hpl_m) if s and s.resolution_m]
    if inexact:
        notes.append(f"Median and 95 % value are exact to {max(inexact):g} m.")
    if evaluation.truth_sigma_h_m is not None and not evaluation.errors_are_lower_bound:
        notes.append(
            f"The truth itself is uncertain by {metres(evaluation.truth_sigma_h_m)} m "
            "(1-sigma, horizontal): no error is known better."
        )
    if evaluation.errors_are_lower_bound:
        notes.append(f"HPE and VPE are {evaluation.lower_bound_words}.")
    if evaluation.ellipse is not None:
        e = evaluation.ellipse
        major, minor, azimuth = e.axes()
        notes.append(
            f"Mean error east {metres(e.mean_e_m)} m, north {metres(e.mean_n_m)} m; 1-sigma "
            f"ellipse {metres(major)} m by {metres(minor)} m, major axis at {azimuth:.1f}° from "
            "north."
        )
    return table(
        "Errors and protection levels",
        "Quantity|#Min [m]|#Median [m]|#95 % [m]|#Max [m]|#Mean [m]|#Epochs",
        rows,
        *notes,
    )


def _rates(evaluation: Evaluation) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    said: dict[tuple[str, str], list[str]] = {}
    for limit in evaluation.alert_limits:
        for kind, rate in limit.rates.items():
            classes = (rate.demonstrated, rate.modelled, rate.claimed)
            counted, modelled, claimed = map(_value, classes)
            rows.append(
                (
                    f"{limit.alert_limit_m:g}", Cell(_EVENT_NAMES[kind], trace="rates"),
                    count(rate.events), number(rate.hours, 6), counted,
                    _upper(rate.demonstrated), modelled, _upper(rate.modelled), claimed,
                )
            )  # fmt: skip
            where = f"{_EVENT_NAMES[kind]}, {limit.alert_limit_m:g} m"
            for name, figure in zip(_CLASSES, classes, strict=True):
                said.setdefault((name, _words(figure)), []).append(where)
    definitions = "; ".join(f"{_EVENT_NAMES[k]}: {text}" for k, text in EVENT_KINDS.items())
    settings = evaluation.settings
    return table(
        "Rates of events per hour, by evidence class",
        "#Alert limit [m]|Event|#Events|#Hours [h]|#Demonstrated: counted [1/h]|"
        f"#Demonstrated: upper bound at {percent(settings.confidence)} [1/h]|#Modelled [1/h]|"
        f"#Modelled: upper bound at {percent(settings.confidence)} [1/h]|#Claimed [1/h]",
        rows,
        definitions.replace(">=", "≥") + ".",
        *(
            f"{name.capitalize()} ({'; '.join(places)}): {words}."
            for (name, words), places in said.items()
            if words
        ),
        f"Events closer than {evaluation.merge_s:.4g} s count as one; the bound is exact for "
        "independent events. No event seen is no rate of zero: only the bound says something.",
    )


_CLASSES = ("demonstrated", "modelled", "claimed")
_EVENT_NAMES = {"hmi": "HMI", "mi": "MI", "exceeds_al": "HPE ≥ AL"}


_ABSENT = "not given"


def _value(figure: Estimate | Refusal) -> str:
    return number(figure.value) if isinstance(figure, Estimate) else _ABSENT


def _upper(figure: Estimate | Refusal) -> str:
    upper = figure.upper if isinstance(figure, Estimate) else None
    return _ABSENT if upper is None else upward(upper)


def _words(figure: Estimate | Refusal) -> str:
    """What must be said below the table; a count is explained by its own columns."""
    if isinstance(figure, Refusal):
        return f"{_ABSENT}: {figure.reason}"
    if isinstance(figure.basis, Counted):
        return ""
    if isinstance(figure.basis, Fitted):
        # Its parameters have a table of their own.
        decades = f"{figure.basis.extrapolation_factor:.1f} decades beyond the data"
        return "; ".join((decades, *figure.caveats))
    return "; ".join((str(figure.basis), *figure.caveats))


def _availability(evaluation: Evaluation) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    window = 0
    for limit in evaluation.alert_limits:
        up = limit.availability
        window = up.continuity_window_epochs
        rows.append(
            (
                f"{limit.alert_limit_m:g}",
                share(up.availability.value), _lower(up.availability),
                share(up.availability_excluding_gaps.value),
                _lower(up.availability_excluding_gaps), count(up.losses), *_mttf(up),
                *_mttr(up), upward(up.continuity_risk, 3),
                upward(up.continuity_risk_excluding_gaps, 3),
            )
        )  # fmt: skip
    confidence = f"{percent(evaluation.settings.confidence)}"
    return table(
        "Availability and continuity of the service (demonstrated: counted in this recording)",
        f"#Alert limit [m]|#Availability, gaps down|#lower bound at {confidence}|"
        f"#Availability, gaps left out|#lower bound at {confidence}|#Losses|"
        f"#MTTF|#MTTF, lower bound at {confidence}|#MTTR|#MTTR, upper bound at {confidence}|"
        "#Continuity risk, gaps are losses|#Continuity risk, gaps left out",
        rows,
        "Up: a fix with HPL < alert limit. Availability is rounded down.",
        *dict.fromkeys(
            f"{caveat[0].upper()}{caveat[1:]}."
            for limit in evaluation.alert_limits
            for estimate in (
                limit.availability.availability,
                limit.availability.availability_excluding_gaps,
            )
            for caveat in estimate.caveats
        ),
        f"Continuity risk: probability to lose the service within {window} epochs, being up now.",
    )


def _lower(figure: Estimate) -> str:
    return _ABSENT if figure.lower is None else share(figure.lower)


def _mttf(up: Availability) -> tuple[str, str]:
    bound = "none" if up.mttf.lower is None else hours(up.mttf.lower, rounding=ROUND_FLOOR)
    return (hours(up.mttf.value) if up.losses else "no loss seen", bound)


def _mttr(up: Availability) -> tuple[str, str]:
    if up.mttr is None:
        return "no recovery seen", "none"
    bound = "none" if up.mttr.upper is None else hours(up.mttr.upper, rounding=ROUND_CEILING)
    return hours(up.mttr.value), bound


def _regions(evaluation: Evaluation) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (f"{r.alert_limit_m:g}", *(count(r.regions[name]) for name in REGIONS))
        for r in evaluation.alert_limits
        if r.regions is not None
    ]
    return table(
        "Stanford regions [epochs]",
        "#Alert limit [m]|" + "|".join(f"#{_REGION_HEADS[name]}" for name in REGIONS),
        rows,
        f"Disjoint; a tie is unsafe. HPE ≥ HPL whatever the alert limit: "
        f"{count(evaluation.mi_epochs or 0)} epochs.",
    )
