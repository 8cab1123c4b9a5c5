"""Numbers as text: sensible digits, and a bound never rounded towards the unsafe side."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal

import numpy as np

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float, digits: int = 4, *, rounding: str = ROUND_HALF_EVEN) -> str:
    """A number with significant digits, as a power of ten where it is small or large.

    Parameters
    ----------
    value : any finite number.
    digits : significant digits.
    rounding : of the decimal module; bounds take `upward` and `downward`.
    """
    rounded = Context(prec=digits, rounding=rounding).plus(Decimal(repr(float(value))))
    if rounded == 0:
        return "0"
    exponent = rounded.adjusted()
    if -4 < exponent < 7:
        return f"{_trimmed(rounded):,f}"
    mantissa = _trimmed(rounded.scaleb(-exponent))
    return f"{mantissa:f}×10{str(exponent).translate(_SUPERSCRIPT)}"


def _trimmed(value: Decimal) -> Decimal:
    """Without trailing zeros behind the point."""
    return value.quantize(Decimal(1)) if value == value.to_integral() else value.normalize()


def upward(value: float, digits: int = 4) -> str:
    """An upper bound: never printed smaller than it is."""
    return number(value, digits, rounding=ROUND_CEILING)


def downward(value: float, digits: int = 4) -> str:
    """A lower bound: never printed larger than it is."""
    return number(value, digits, rounding=ROUND_FLOOR)


def share(value: float) -> str:
    """A fraction near 1 as per cent, rounded down: 100 % means that nothing is missing."""
    exact = Decimal(repr(float(value)))
    if exact in (0, 1):
        return f"{100 * exact:.0f} %"
    missing = 100 * (1 - exact)
    decimals = max(1 - missing.adjusted(), 1)
    step = Decimal(1).scaleb(-decimals)
    return f"{(100 * exact).quantize(step, rounding=ROUND_FLOOR)} %"


def hours(value: float, *, rounding: str = ROUND_HALF_EVEN) -> str:
    """A duration given in hours, in the unit that suits it."""
    for unit, factor in (("h", 1.0), ("min", 60.0)):
        if value * factor >= 1:
            return f"{number(value * factor, rounding=rounding)} {unit}"
    return f"{number(value * 3600, rounding=rounding)} s"


def percent(confidence: float) -> str:
    """A confidence as per cent, every digit of it: 99.99999 % is not 100 %."""
    exact = 100 * Decimal(repr(float(confidence)))
    return f"{_trimmed(exact):f} %"


def key(value: float) -> str:
    """A number as a short key that no other number has: 50 for 50.0, else all digits."""
    short = f"{value:g}"
    return short if float(short) == value else repr(float(value))


def metres(value: float) -> str:
    """A length to the millimetre."""
    return f"{value:,.3f}"


def count(value: int | float) -> str:
    """A count with separated thousands."""
    return f"{value:,.0f}" if float(value).is_integer() else number(value, 6)


def stamp(ns: int) -> str:
    """GPS time of an epoch, to the millisecond where that is not zero."""
    text = str(np.datetime64(ns, "ns").astype("M8[ms]")).replace("T", " ")
    return text.removesuffix(".000")
