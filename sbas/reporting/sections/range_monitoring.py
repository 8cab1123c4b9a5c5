"""RAIM beside SBAS on the same epochs: what it says, and what its levels mean."""

from __future__ import annotations

import math

from sbas.estimate import Refusal
from sbas.monitoring.level_comparison import LevelComparison
from sbas.monitoring.raim_result import SOURCE_WORDS, level_quantile, spread_of
from sbas.monitoring.verdicts import Verdict
from sbas.numerals import count, metres, share
from sbas.plots import raim_availability_picture, raim_levels_picture
from sbas.reporting.content import Callout, Cell, Section, Table, Tone, table
from sbas.reporting.drawn import drawn

_TONES: dict[str, Tone] = {"error": "bad", "warning": "warning", "info": ""}
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
            "Gaps are epochs at which RAIM is not available; at bars at the head HERL is infinite, "
            "for a fault of one satellite would not show.",
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
        paragraphs=(f"RAIM is {_made(comparison)}. {comparison.statement()}",),
        tables=(
            _verdicts(comparison),
            _levels(comparison),
            _both(comparison),
            *([_findings(comparison)] if raim.findings else []),
        ),
        pictures=pictures,
    )


def _made(comparison: LevelComparison) -> str:
    """Who made the verdicts and levels, and with which settings where they are known."""
    raim = comparison.raim
    words = SOURCE_WORDS[raim.source]
    if raim.design is None:
        return words
    design = raim.design
    words += (
        f" (false alarm {design.false_alarm:g} per epoch and {design.outlier_alarm:g} per range, "
        f"missed detection {design.missed_detection:g}"
    )
    if raim.sigma is not None:
        words += f", sigma {raim.sigma} m"
    if raim.elevation_mask_deg is not None:
        words += f", elevation mask {raim.elevation_mask_deg:g} deg"
    return words + ")"


def _findings(comparison: LevelComparison) -> Table:
    """What was found in the ranges, as the report's own findings have it."""
    return table(
        "Findings of RAIM",
        "Code|Severity|Finding|Evidence|Cure",
        [
            (
                f.code, Cell(f.severity, _TONES[f.severity]), f.message,
                "; ".join(part for part in (f.where, f.evidence) if part), f.cure,
            )
            for f in comparison.raim.findings
        ],
    )  # fmt: skip


def _verdicts(comparison: LevelComparison) -> Table:
    raim = comparison.raim
    epochs = len(comparison.levels)
    rows: list[tuple[Cell | str, ...]] = [
        (verdict.words, count(n), share(n / max(epochs, 1)))
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
        f"Vertically RAIM is available at {count(raim.available_vertical)} of {count(epochs)} "
        "epochs: there a fault of one satellite must show in the height as well.",
    )


def _levels(comparison: LevelComparison) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for name, words in _LEVELS.items():
        if name not in comparison.levels.columns:
            continue
        values = comparison.levels[name].to_numpy()
        spread = spread_of(values)
        sizes = [_size(level_quantile(values, q)) for q in (0.5, 0.95, 1.0)]
        ratio = comparison.ratio(name)
        larger = "" if name == "hpl_m" else share(float((ratio > 1).mean())) if ratio.size else "-"
        rows.append((words, count(spread["epochs"]), count(spread["infinite"]), *sizes, larger))
    return table(
        "Levels on the same epochs",
        "Level|#Epochs|#Infinite|#Median [m]|#95 % [m]|#Largest [m]|#Larger than the HPL",
        rows,
        "Infinite levels count in median, 95 % and largest; of RAIM they are those of epochs at "
        "which a fault would not show, so that it is not available. Ratios are of epochs at which "
        "RAIM is available and both levels are finite and above 0.",
    )


def _size(level_m: float) -> str:
    if math.isnan(level_m):
        return "none"
    return "infinite" if math.isinf(level_m) else metres(level_m)


def _both(comparison: LevelComparison) -> Table:
    limit = comparison.alert_limit_m
    words = "an HPL" if limit is None else f"an HPL below {limit:g} m"
    cells = comparison.both
    return table(
        f"SBAS with {words}, and RAIM",
        "|#RAIM no|#RAIM yes",
        [
            ("SBAS no", count(int(cells[0, 0])), count(int(cells[0, 1]))),
            ("SBAS yes", count(int(cells[1, 0])), count(int(cells[1, 1]))),
        ],
        f"RAIM counts where {comparison.raim_words}.",
    )
