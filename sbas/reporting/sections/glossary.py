"""Aviation's terms in the words of EN 50126."""

from __future__ import annotations

from sbas.integrity.results import Evaluation
from sbas.reporting.content import Section, table

TERMS = (
    ("HPE, VPE", "horizontal, vertical position error", "error of the position function"),
    ("HPL, VPL", "protection level: bounds the error with a stated risk", "error limit reported"),
    ("AL", "alert limit: the error that the user can bear", "hazard threshold of the function"),
    ("HPL ≥ AL", "service unavailable, the user is warned", "detected, right-side failure"),
    ("MI", "misleading information: HPE ≥ HPL", "undetected failure of the bound"),
    ("HMI", "hazardously misleading: HPE ≥ AL and HPL < AL", "dangerous, wrong-side failure"),
    ("integrity risk", "probability of HMI in an exposure",
     "probability of a dangerous undetected failure"),
    ("time to alert", "longest permitted delay of the warning", "failure detection time"),
    ("availability", "share of time with HPL < AL", "availability of the function"),
    ("continuity risk", "probability to lose the service while in use",
     "failure rate of the available function (1/MTTF)"),
    ("d_major, sigma_H", "1-sigma major semi-axis of the error ellipse",
     "spread of the position function"),
)  # fmt: skip


def section(evaluation: Evaluation) -> Section:
    """Short glossary for readers from signalling."""
    return Section(
        "glossary",
        "Glossary",
        tables=(table("Terms", "Term|In aviation|In EN 50126", list(TERMS)),),
    )
