"""What is wrong with data: one type for readers, the input check and every analysis.

Findings are kept in results, never only printed. The codes and their thresholds are
documented in docs/formats.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Literal

from sbas.exceptions import InputError

Severity = Literal["error", "warning", "info"]

CODES: dict[str, str] = {
    "E01": "no truth for position errors",
    "E02": "times in another scale than stated",
    "E03": "latitude and longitude look like radians",
    "E04": "gaps in the recording",
    "E05": "epochs with the same time",
    "E06": "several receivers or definitions in one recording",
    "E07": "sentinel values mapped to missing",
    "E08": "values in another unit than stated",
    "E09": "truth uncertain, or a constant offset from it",
    "E10": "epochs or records incomplete",
    "E11": "a leap second, or its correction, inside the recording",
    "E12": "positions far from the truth",
    "E13": "protection level zero, negative or frozen",
    "E14": "time goes backward",
    "E15": "too few epochs",
    "E16": "format not recognised",
    "E17": "extension names another format than the content",
    "E18": "line too long for text",
    "E19": "text encoding repaired",
    "E20": "decimal comma",
    "E21": "decoded size out of proportion",
    "E22": "dates before GNSS, in the future, or a week rollover off",
    "E23": "protection levels that DO-229 does not define",
    "E24": "bytes that belong to no valid block",
    "E25": "metadata missing, unreadable or contradicted",
    "E26": "values converted, or repaired on request, and counted",
    "E27": "more than one sampling rate",
    "E28": "a model that may not say what its author means",
}
"""Every finding code with its short title."""


@dataclass(frozen=True)
class Finding:
    """One thing that a reader of the figures must know about the data.

    `severity`: an "error" makes analyses refuse until it is cured; a "warning" travels with
    every result; "info" reports a counted conversion that the format itself defines.
    """

    code: str
    severity: Severity
    message: str
    where: str = ""
    evidence: str = ""
    cure: str = ""

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise ValueError(f"unknown finding code {self.code!r}; known are {', '.join(CODES)}")

    @property
    def title(self) -> str:
        return CODES[self.code]

    def to_dict(self) -> dict[str, str]:
        return asdict(self)

    def __str__(self) -> str:
        parts = [f"{self.code} {self.severity}: {self.message}"]
        parts += [f"  {k}: {v}" for k in ("where", "evidence", "cure") if (v := getattr(self, k))]
        return "\n".join(parts)


def refuse_on_errors(findings: Iterable[Finding]) -> None:
    """Raise InputError with the first error among the findings, naming how many there are."""
    errors = [f for f in findings if f.severity == "error"]
    if not errors:
        return
    first = errors[0]
    others = ", ".join(f.code for f in errors[1:])
    raise InputError(
        first.message,
        code=first.code,
        where=first.where,
        evidence=first.evidence + (f"; also found: {others}" if others else ""),
        cure=first.cure,
    )
