"""Expressions of the Open-PSA format: numbers, parameters and laws of basic events."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from sbas.exceptions import ModelError

_ARGUMENTS = {"exponential": 2, "GLM": 4, "Weibull": 4}
_UNITS = {"bool", "int", "float", "hours", "hours-1", "demands"}
_MAX_CHAIN = 100


@dataclass(frozen=True)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True)
class MissionTime:
    """The system mission time [h]."""


@dataclass(frozen=True)
class Law:
    """A law of a basic event with its arguments: exponential, GLM or Weibull."""

    kind: str
    arguments: tuple[Expression, ...]


Expression = Number | MissionTime | Law

Lookup = Callable[[str], tuple[str, Element, "Lookup"]]
"""Reference of a parameter -> its full name, its expression, and the lookup from there."""


def read_expression(
    element: Element, lookup: Lookup, where: str, *, chain: tuple[str, ...] = ()
) -> Expression:
    """An expression element, parameters put in.

    Parameters
    ----------
    element : the expression.
    lookup : finds parameters from where the expression stands.
    where : for errors.
    chain : parameters that are being read.

    Raises
    ------
    ModelError : an expression that is not supported, named; an unknown parameter or a cycle of
        parameters; a unit that would need converting.

    References
    ----------
    Open-PSA Model Exchange Format 2.0d, expressions.
    """
    tag = str(element.tag)
    check_unit(element, where)
    if tag in ("float", "int"):
        return Number(_number(element, where))
    if tag == "bool":
        return Number(1.0 if boolean(element, where) else 0.0)
    if tag == "system-mission-time":
        return MissionTime()
    if tag == "parameter":
        name, target, beyond = lookup(attribute(element, "name", where))
        if name in chain or len(chain) > _MAX_CHAIN:
            path = " -> ".join([*chain[-6:], name])
            raise ModelError(
                "parameters refer to each other in a cycle or without end",
                where=where,
                evidence=path,
            )
        return read_expression(target, beyond, where, chain=(*chain, name))
    if tag in _ARGUMENTS:
        if len(element) != _ARGUMENTS[tag]:
            raise ModelError(
                f"{tag!r} takes {_ARGUMENTS[tag]} arguments, not {len(element)}", where=where
            )
        arguments = tuple(read_expression(e, lookup, where, chain=chain) for e in element)
        if any(isinstance(argument, Law) for argument in arguments):
            raise ModelError(f"an argument of {tag!r} is itself a law", where=where)
        return Law(tag, arguments)
    raise ModelError(
        f"the expression {tag!r} is not supported",
        where=where,
        cure=f"supported are float, int, bool, parameter, system-mission-time, "
        f"{', '.join(_ARGUMENTS)}",
    )


def evaluated(expression: Expression, mission_h: float | None, where: str) -> float:
    """The value of an expression at the end of the mission.

    Parameters
    ----------
    expression : as read.
    mission_h : system mission time [h]; None where it was not given.
    where : for errors.

    Raises
    ------
    ModelError : the mission time is used and not given; an argument out of range.

    Notes
    -----
    exponential: 1 - exp(-lambda t); GLM: lambda/s (1 - exp(-s t)) + gamma exp(-s t), s = lambda
    + mu; Weibull: 1 - exp(-((t - t0)/scale)^shape), 0 before t0; all by expm1.

    References
    ----------
    Open-PSA Model Exchange Format 2.0d, built-ins.
    """
    if isinstance(expression, Number):
        return expression.value
    if isinstance(expression, MissionTime):
        if mission_h is None:
            raise ModelError(
                "the file asks for the system mission time, which no file holds",
                where=where,
                cure="say it: mission_s=3600",
            )
        return mission_h
    values = [evaluated(argument, mission_h, where) for argument in expression.arguments]
    if any(value < 0 for value in values):
        raise ModelError(
            f"{expression.kind!r} has a negative argument", where=where, evidence=str(values)
        )
    if expression.kind == "exponential":
        return -math.expm1(-values[0] * values[1])
    if expression.kind == "GLM":
        gamma, failure, repair, time = values
        rate = failure + repair
        if gamma > 1:
            raise ModelError("gamma of a GLM is a probability", where=where, evidence=str(gamma))
        if rate == 0:
            return gamma
        return failure / rate * -math.expm1(-rate * time) + gamma * math.exp(-rate * time)
    scale, shape, start, time = values
    if scale == 0 or shape == 0:
        raise ModelError("a Weibull law needs scale and shape above 0", where=where)
    try:
        exponent = (max(time - start, 0.0) / scale) ** shape
    except OverflowError:
        exponent = math.inf
    return -math.expm1(-exponent)


def check_unit(element: Element, where: str) -> None:
    """Raise ModelError for a unit that would need converting."""
    unit = element.get("unit")
    if unit is not None and unit not in _UNITS:
        raise ModelError(
            f"the unit {unit!r} is not converted here, and most programs ignore it",
            where=where,
            cure="write the figure in hours or per hour",
        )


def _number(element: Element, where: str) -> float:
    text = attribute(element, "value", where)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise ModelError(f"{text[:40]!r} is no finite number", where=where)
    return value


def boolean(element: Element, where: str) -> bool:
    """The truth value of an element's `value`."""
    text = attribute(element, "value", where).strip()
    if text not in ("true", "false", "1", "0"):
        raise ModelError(f"{text[:40]!r} is neither true nor false", where=where)
    return text in ("true", "1")


def attribute(element: Element, key: str, where: str) -> str:
    """An attribute that must be there and not be empty."""
    text = element.get(key)
    if not text or not text.strip():
        raise ModelError(f"<{element.tag}> has no {key!r}", where=where)
    return text.strip()
