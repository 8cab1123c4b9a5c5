"""A figure with its interval, what it rests on, and therefore which evidence it is.

The evidence class is no label to be set: it follows from the basis. What was counted is
`demonstrated`, what a fitted model says is `modelled`, what a document says is `claimed`.
"""

from __future__ import annotations

import html
import math
from dataclasses import dataclass, field
from typing import Any, Literal, NoReturn

from sbas.numerals import downward, number, percent, upward

Evidence = Literal["demonstrated", "modelled", "claimed"]


@dataclass(frozen=True)
class Counted:
    """Counted in a recording: `events` of a kind over `hours` of exposure."""

    events: float
    hours: float
    of: str = "events"

    evidence = "demonstrated"

    def __post_init__(self) -> None:
        if not (0 <= self.events < math.inf and 0 <= self.hours < math.inf):
            raise ValueError(f"a count and its hours are 0 or more: {self.events}, {self.hours}")

    def __str__(self) -> str:
        return f"{self.events:g} {self.of} in {self.hours:.6g} h"


@dataclass(frozen=True)
class Fitted:
    """Says a fitted model; the extrapolation factor tells how far beyond the data, in decades."""

    model: str
    parameters: dict[str, float]
    extrapolation_factor: float

    evidence = "modelled"

    def __post_init__(self) -> None:
        if not math.isfinite(self.extrapolation_factor):
            raise ValueError(f"an extrapolation factor is finite: {self.extrapolation_factor}")

    def __str__(self) -> str:
        values = ", ".join(f"{k} {v:.4g}" for k, v in self.parameters.items())
        return f"{self.model} ({values}), {self.extrapolation_factor:.1f} decades beyond the data"


@dataclass(frozen=True)
class Quoted:
    """Taken from a document; without its paragraph no claim can be built."""

    document: str
    paragraph: str

    evidence = "claimed"

    def __post_init__(self) -> None:
        if not self.document.strip() or not self.paragraph.strip():
            raise ValueError("a claim names its document and the paragraph in it")

    def __str__(self) -> str:
        return f"{self.document}, {self.paragraph}"


Basis = Counted | Fitted | Quoted


@dataclass(frozen=True)
class Estimate:
    """A published figure.

    Parameters
    ----------
    value : best value, in `unit`.
    lower, upper : bounds at `confidence`, or None where none is given; then a caveat says why.
    confidence : probability that the stated interval (one- or two-sided) holds the truth.
    unit : "per_h", "m", "s" or "1" for a fraction.
    basis : Counted, Fitted or Quoted; decides `evidence`.
    sided : "upper" (the default: the safe side of a rate), "lower" or "two".
    caveats : sentences that must travel with the figure.

    Raises
    ------
    ValueError : a bound without confidence, bounds out of order, or a value that is not finite.
    """

    value: float
    lower: float | None
    upper: float | None
    confidence: float | None
    unit: str
    basis: Basis
    sided: Literal["upper", "lower", "two"] = "upper"
    caveats: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        if not math.isfinite(self.value):
            raise ValueError(f"an estimate has a finite value, not {self.value}")
        bounds = [bound for bound in (self.lower, self.upper) if bound is not None]
        if not all(map(math.isfinite, bounds)):
            raise ValueError(f"a bound is finite or None: {self.lower}, {self.upper}")
        if self.confidence is None and bounds:
            raise ValueError("bounds need a confidence")
        if self.confidence is not None and not 0 < self.confidence < 1:
            raise ValueError(f"a confidence lies in (0, 1): {self.confidence}")
        if self.sided == "two" and len(bounds) == 1:
            raise ValueError("a two-sided interval has both bounds")
        low = -math.inf if self.lower is None else self.lower
        high = math.inf if self.upper is None else self.upper
        if not low <= self.value <= high:
            raise ValueError(f"bounds out of order: {self.lower} <= {self.value} <= {self.upper}")

    @property
    def evidence(self) -> Evidence:
        return self.basis.evidence  # type: ignore[return-value]

    def _refuse(self, *_: object) -> NoReturn:
        raise TypeError("an Estimate is not a number: use .value, or .upper for a safety argument")

    __float__ = __int__ = __add__ = __radd__ = __mul__ = __rmul__ = _refuse
    __sub__ = __rsub__ = __truediv__ = __rtruediv__ = __lt__ = __gt__ = __le__ = __ge__ = _refuse

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; the unit is part of the key, missing bounds are None."""
        suffix = "" if self.unit == "1" else f"_{self.unit}"
        basis: dict[str, Any] = dict(vars(self.basis))
        return {
            f"value{suffix}": self.value,
            f"lower{suffix}": self.lower,
            f"upper{suffix}": self.upper,
            "confidence": self.confidence,
            "sided": self.sided,
            "evidence": self.evidence,
            "basis": basis,
            "caveats": list(self.caveats),
        }

    def __str__(self) -> str:
        unit = {"1": "", "per_h": "/h"}.get(self.unit, f" {self.unit}")
        # A value without its bound stands for it, and is then rounded to the safe side too.
        bare = {"upper": upward, "lower": downward, "two": number}[self.sided]
        text = f"{(bare if self.confidence is None else number)(self.value)}{unit}"
        if self.sided == "two" and self.lower is not None and self.upper is not None:
            text += f" [{downward(self.lower)}, {upward(self.upper)}]"
        elif self.sided == "upper" and self.upper is not None:
            text += f" (upper bound {upward(self.upper)}{unit})"
        elif self.sided == "lower" and self.lower is not None:
            text += f" (lower bound {downward(self.lower)}{unit})"
        if self.confidence is not None:
            text += f" at {percent(self.confidence)}"
        return f"{text}, {self.evidence}: {self.basis}"

    def _repr_html_(self) -> str:
        notes = "".join(f"<br><small>{html.escape(c)}</small>" for c in self.caveats)
        return f"<span class='estimate {self.evidence}'>{html.escape(str(self))}</span>{notes}"


@dataclass(frozen=True)
class Refusal:
    """A figure that cannot be given, said in words; never a number that looks like one."""

    reason: str
    cure: str = ""

    def to_dict(self) -> dict[str, str]:
        return {"refused": self.reason, "cure": self.cure}

    def __str__(self) -> str:
        return f"not given: {self.reason}" + (f" ({self.cure})" if self.cure else "")
