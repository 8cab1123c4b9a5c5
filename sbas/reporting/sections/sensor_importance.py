"""Which sensor's state matters to the output, under three laws."""

from __future__ import annotations

from sbas.fusion.causal_analysis import CausalAnalysis
from sbas.fusion.importance.importance_results import LAWS, TOPS
from sbas.plots import decision_tree_picture, state_importance_picture
from sbas.plots.decision_tree_picture import MOST_SENSORS
from sbas.reporting.content import Callout, Cell, Picture, Section, table
from sbas.reporting.drawn import drawn


def section(found: CausalAnalysis) -> Section:
    """Probabilities of both top events, bars of importance, and the truth table drawn."""
    importance = found.importance
    if importance is None:
        return Section(
            "importance", "Which sensor matters",
            paragraphs=("Not estimable: no epoch has a state of every sensor.",),
            pictures=_tree(found),
        )  # fmt: skip
    rows: list[tuple[Cell | str, ...]] = [
        (
            {"notN": "output not N", "isU": "output U"}[top],
            *(str(importance.top(law, top)) for law in LAWS),
        )
        for top in TOPS
    ]
    differ = (
        Callout("warning", "The laws differ", importance.warnings) if importance.warnings else None
    )
    agreement = importance.agreement or 0.0
    return Section(
        "importance",
        "Which sensor matters",
        callouts=(differ,) if differ is not None else (),
        paragraphs=(
            "Independent: the truth table with sensors that share nothing; joint: the table with "
            "the states as they came together; simulated: the output itself. Only the first is a "
            "derivative; the others are associations, since sensors share their causes. Table and "
            f"simulation agree in {100 * agreement:.1f} % of epochs.",
        ),
        tables=(
            table(
                "Probability of the top events",
                "Event|#Table, independent|#Table, joint|#Simulated",
                rows,
            ),
        ),
        pictures=(
            drawn(
                "state_importance", "Birnbaum importance for an unacceptable output",
                state_importance_picture.state_importance_sheet(importance),
                lambda axes: state_importance_picture.state_importance_bars(
                    importance, ax=axes[0]
                ),
                "Bars of Birnbaum importance by sensor and level under each law.",
                "How much more often the output is unacceptable where a sensor is at a level than "
                "where it is nominal.",
            ),
            *_tree(found),
        ),
    )  # fmt: skip


def _tree(found: CausalAnalysis) -> tuple[Picture, ...]:
    if len(found.table.names) > MOST_SENSORS:
        return ()
    return (
        drawn(
            "decision_tree", "Truth table as a decision tree",
            decision_tree_picture.decision_tree_sheet(found.table),
            lambda axes: decision_tree_picture.decision_tree(found.table, ax=axes[0]),
            "Decision tree of all combinations of sensor states with the outcome of each.",
            "N where no sensor is U and at least one is N, U where all are U, else DA: the "
            "corrected Figure 9 of Railways 2014, for as many sensors.",
            wide=True,
        ),
    )  # fmt: skip
