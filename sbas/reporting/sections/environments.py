"""The figures by environment, beside those of the whole record."""

from __future__ import annotations

from sbas.environment_labels.segments import UNLABELLED
from sbas.estimate import Estimate, Refusal
from sbas.integrity.correlation.decorrelation_results import MISFITS
from sbas.integrity.results import Evaluation, Summary
from sbas.integrity.sil import NOT_DEMONSTRATED, sil_verdict
from sbas.numerals import count, metres, number, percent, share, upward
from sbas.plots import environments_picture
from sbas.reporting.content import Cell, Section, Table, table
from sbas.reporting.drawn import drawn

WHOLE = "whole record"


def section(evaluation: Evaluation) -> Section:
    """Sizes, availability, HMI and decorrelation a row a label; for records with labels."""
    rows = {WHOLE: evaluation, **evaluation.environments}
    errors = evaluation.truth is not None
    tables = [_sizes(rows), *([_rates(rows)] if errors else []), _decorrelation(rows)]
    source = evaluation.meta.options.get("environment", "the recording's own column")
    stands = (
        f"“{UNLABELLED}” stands for the epochs without label. "
        if UNLABELLED in evaluation.environments
        else ""
    )
    return Section(
        "environments",
        "By environment",
        paragraphs=(
            f"Labels: {source}. {stands}Epochs and hours of the labels sum to those of the "
            "record; a gap belongs to the label before it, and time under another label is "
            "neither gap nor loss.",
            "Events are those of the whole record. One that crosses a border counts under every "
            "label in which one of its epochs lies: over all labels there may be more events "
            "than in the record, never fewer.",
        ),
        tables=tuple(tables),
        pictures=(
            drawn(
                "environments", "Environments side by side", environments_picture.SHEET,
                lambda axes: (
                    environments_picture.environment_sizes(evaluation, ax=axes[0]),
                    environments_picture.environment_rates(evaluation, ax=axes[1]),
                ),
                "Errors, protection levels and rates of HMI by environment.",
                "Above, errors that reach the levels of their own environment are what a figure "
                "of the whole record hides; below, a short stay proves little: the upper bound "
                "rises as the hours fall.",
                wide=True,
            ),
        ),
    )  # fmt: skip


def _sizes(rows: dict[str, Evaluation]) -> Table:
    limits = rows[WHOLE].settings.alert_limits_m
    heads = "".join(f"|#Availability, AL {al:g} m" for al in limits)
    return table(
        "Sizes and availability by environment",
        "Environment|#Epochs|#Hours [h]|#HPE median [m]|#HPE 95 % [m]|#HPE max [m]|"
        f"#HPL median [m]|#HPL 95 % [m]{heads}",
        [
            (
                name, count(e.epochs), number(e.hours, 6), *_three(e.hpe_m), *_three(e.hpl_m)[:2],
                *(share(e.at(al).availability.availability.value) for al in limits),
            )
            for name, e in rows.items()
        ],
        "Availability counts gaps as down and is rounded down.",
        *(
            (f"HPE is {rows[WHOLE].lower_bound_words}.",)
            if rows[WHOLE].errors_are_lower_bound
            else ()
        ),
    )  # fmt: skip


def _three(size: Summary | None) -> tuple[str, str, str]:
    if size is None:
        return ("none",) * 3
    return metres(size.median), metres(size.p95), metres(size.max)


def _rates(rows: dict[str, Evaluation]) -> Table:
    confidence = percent(rows[WHOLE].settings.confidence)
    lines: list[tuple[Cell | str, ...]] = []
    reasons: dict[str, list[str]] = {}
    for name, e in rows.items():
        for limit in e.alert_limits:
            rate = limit.rates["hmi"]
            shown = rate.demonstrated
            bound: Cell | str = Cell(NOT_DEMONSTRATED, "bad")
            sil = "none"
            if isinstance(shown, Refusal):
                place = f"{name}, {limit.alert_limit_m:g} m"
                reasons.setdefault(f"{shown.reason} (cure: {shown.cure})", []).append(place)
            elif shown.upper is not None:
                bound = upward(shown.upper)
                level = sil_verdict(shown).level
                sil = f"SIL {level}" if level else "none"
            modelled = rate.modelled
            lines.append(
                (
                    name, f"{limit.alert_limit_m:g}", count(rate.events), number(rate.hours, 6),
                    bound, Cell(sil, trace="sil"),
                    upward(modelled.upper)
                    if isinstance(modelled, Estimate) and modelled.upper is not None
                    else "not given",
                )
            )  # fmt: skip
    return table(
        "HMI events by environment",
        "Environment|#Alert limit [m]|#Events|#Exposure [h]|"
        f"#Demonstrated: upper bound at {confidence} [1/h]|SIL by that bound|"
        f"#Modelled: upper bound at {confidence} [1/h]",
        lines,
        *(
            f"{reason[0].upper()}{reason[1:]}: {'; '.join(places)}."
            for reason, places in reasons.items()
        ),
        f"Runs of bad epochs closer than {rows[WHOLE].merge_s:.4g} s are one event, by the "
        "decorrelation time of the whole record unless it was set. Bounds of several labels hold "
        "each for itself, not all at once.",
    )


def _decorrelation(rows: dict[str, Evaluation]) -> Table:
    confidence = percent(rows[WHOLE].process.decorrelation.confidence)
    lines: list[tuple[Cell | str, ...]] = []
    for name, e in rows.items():
        found = e.process.decorrelation
        tau = found.tau_s
        value = "not given" if isinstance(tau, Refusal) else f"{tau.value:.4g}"
        ends = (found.tau_low_s, found.tau_high_s)
        low, high = ("not given" if end is None else f"{end:.4g}" for end in ends)
        words = tau.reason if isinstance(tau, Refusal) else MISFITS[found.misfit or "gm1"]
        lines.append((Cell(name, trace="decorrelation"), value, low, high, words))
    return table(
        "Decorrelation time by environment",
        f"Environment|#tau [s]|#Lower limit at {confidence} [s]|#Upper limit at {confidence} [s]|"
        "What the errors are like",
        lines,
        "Availability has a lower bound, and a rate a model, only where tau is known.",
    )
