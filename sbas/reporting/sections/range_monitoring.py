"""RAIM beside SBAS on the same epochs: what it says, and what its levels mean."""

from __future__ import annotations

import numpy as np

from sbas.estimate import Refusal
from sbas.monitoring.level_comparison import LevelComparison
from sbas.monitoring.verdicts import Verdict
from sbas.numerals import count, metres, share
from sbas.plots import raim_availability_picture, raim_levels_picture
from sbas.reporting.content import Callout, Cell, Section, Table, table
from sbas.reporting.drawn import drawn

_LEVELS = {
    "hpl_m": "SBAS HPL",
    "herl_m": "HERL: effect of the smallest detectable error, no bound",
    "hpl_slope_m": "RAIM HPL by the largest slope",
    "like_hpl_m": "RAIM HPL by solution separation, with the risk of the SBAS HPL",
}


def section(comparison: LevelComparison | Refusal) -> Section:
    """Verdicts, levels side by side, availability by satellites in use."""
    if isinstance(comparison, Refusal):
        return Section("raim", "RAIM", paragraphs=(f"Not judged: {comparison}.",))
    raim = comparison.raim
    epochs = len(comparison.levels)
    source = (
        "computed here from the ranges of each fix"
        if raim.source == "ranges"
        else "as the receiver reported it"
    )
    alarm: tuple[Callout, ...] = ()
    if raim.detected:
        alarm = (
            Callout(
                "warning",
                f"RAIM found a fault at {count(raim.detected)} of {count(epochs)} epochs",
                (
                    f"{count(raim.alarm_runs)} runs of successive epochs; "
                    f"{count(raim.excluded)} epochs passed after an exclusion. Such an epoch's "
                    "recorded position was made with the faulty range: in the receiver's states "
                    "it is missing, neither correct nor wrong.",
                ),
            ),
        )
    pictures = (
        drawn(
            "raim_levels", "HERL and HPL over time", raim_levels_picture.SHEET,
            lambda axes: raim_levels_picture.raim_levels(comparison, axes=axes),
            "HERL and HPL over time, HDOP below.",
            "HERL is the effect of the smallest range error that the test finds with its stated "
            "probability: it is not a bound, and its place above or below the HPL is no ranking. "
            "Gaps are epochs at which RAIM is not available.",
            wide=True,
        ),
        drawn(
            "raim_ratios", "Levels of RAIM over the HPL", raim_levels_picture.RATIO_SHEET,
            lambda axes: raim_levels_picture.raim_level_ratios(comparison, ax=axes[0]),
            "Distribution of the ratio of each RAIM level to the HPL.",
            "Only the level with the risk of the HPL itself may be compared with it; where its "
            "curve lies right of 1 RAIM alone would serve fewer epochs.",
            wide=True,
        ),
        drawn(
            "raim_availability", "RAIM by satellites in use", raim_availability_picture.SHEET,
            lambda axes: raim_availability_picture.raim_availability(comparison, ax=axes[0]),
            "Epochs by number of satellites and by what RAIM can do with them.",
            "One constellation: five satellites detect, six identify. With fewer RAIM says "
            "nothing, which is not the same as no fault.",
            wide=True,
        ),
    )  # fmt: skip
    return Section(
        "raim",
        "RAIM",
        callouts=alarm,
        paragraphs=(f"RAIM is {source}. {comparison.statement()}",),
        tables=(_verdicts(comparison), _levels(comparison), _both(comparison)),
        pictures=pictures,
    )


def _verdicts(comparison: LevelComparison) -> Table:
    raim = comparison.raim
    epochs = max(len(comparison.levels), 1)
    rows: list[tuple[Cell | str, ...]] = [
        (verdict.words, count(n), share(n / epochs))
        for verdict in Verdict
        if (n := raim.count(verdict))
    ]
    reasons = "; ".join(f"{words}: {count(n)}" for words, n in raim.reasons().items())
    return table(
        "Verdicts of RAIM",
        "Verdict|#Epochs|#Share",
        rows,
        "Only the two that passed are available. An epoch that cannot be tested is not available, "
        "never passed.",
        *([f"Reasons: {reasons}."] if reasons else []),
    )


def _levels(comparison: LevelComparison) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for name, words in _LEVELS.items():
        if name not in comparison.levels.columns:
            continue
        values = comparison.levels[name].to_numpy()
        values = values[np.isfinite(values)]
        sizes = (
            tuple(metres(float(np.quantile(values, q))) for q in (0.5, 0.95, 1.0))
            if values.size
            else ("none",) * 3
        )
        ratio = comparison.ratio(name)
        larger = "" if name == "hpl_m" else share(float((ratio > 1).mean())) if ratio.size else "-"
        rows.append((words, count(values.size), *sizes, larger))
    return table(
        "Levels on the same epochs",
        "Level|#Epochs|#Median [m]|#95 % [m]|#Largest [m]|#Larger than the HPL",
        rows,
        "Ratios are of epochs at which RAIM is available and both levels exist.",
    )


def _both(comparison: LevelComparison) -> Table:
    limit = comparison.alert_limit_m
    words = "a level" if limit is None else f"a level below {limit:g} m"
    cells = comparison.both
    return table(
        f"Availability of both: {words}",
        "|#RAIM no|#RAIM yes",
        [
            ("SBAS no", count(int(cells[0, 0])), count(int(cells[0, 1]))),
            ("SBAS yes", count(int(cells[1, 0])), count(int(cells[1, 1]))),
        ],
    )
