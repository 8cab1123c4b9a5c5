"""The numbers of an architecture by their path, such as `gps.multipath.largest`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from sbas.exceptions import ModelError
from sbas.fusion.architecture.model import Architecture
from sbas.integrity.allocation_tree import nearest

_Step = str | int


def parameter_paths(architecture: Architecture) -> tuple[str, ...]:
    """Paths of all numbers of an architecture, those of its sensors first.

    A sensor's path begins with its name, `odometer.slip.rate_per_s`, others with a field of the
    architecture, `filter.position_m`; a member of a tuple goes by its place, counted from 0,
    `profile.phases.0.until_s`.

    Raises
    ------
    ModelError : two numbers with one path, of a sensor that has the name of another or of a field.
    """
    return tuple(_places(architecture))


def with_parameter(architecture: Architecture, path: str, value: float) -> Architecture:
    """The architecture with one number replaced.

    Parameters
    ----------
    path : one of `parameter_paths`.
    value : in the unit that the field's name states.

    Returns
    -------
    A new architecture; whether it can be simulated is judged there.

    Raises
    ------
    ModelError : no number of that path; the nearest is named.
    """
    places = _places(architecture)
    if path not in places:
        raise ModelError(
            "the architecture has no number of that path",
            where=path, evidence=f"architecture {architecture.name}", cure=nearest(path, places),
        )  # fmt: skip
    return _replaced(architecture, places[path], value)  # type: ignore[no-any-return]


def _places(architecture: Architecture) -> dict[str, tuple[_Step, ...]]:
    found: dict[str, tuple[_Step, ...]] = {}
    for steps in _numbers(architecture, ()):
        named: list[_Step] = list(steps)
        if steps[0] == "sensors":
            named[:2] = [architecture.sensors[int(steps[1])].name]
        path = ".".join(map(str, named))
        if path in found:
            raise ModelError(
                "two numbers of the architecture have one path",
                where=path, cure="names of sensors that differ from each other and from its fields",
            )  # fmt: skip
        found[path] = steps
    return found


def _numbers(thing: Any, steps: tuple[_Step, ...]) -> Iterator[tuple[_Step, ...]]:
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            value, at = getattr(thing, field.name), (*steps, field.name)
            if value is None and "float" in str(field.type):
                yield at
            else:
                yield from _numbers(value, at)
    elif isinstance(thing, tuple):
        for place, member in enumerate(thing):
            yield from _numbers(member, (*steps, place))
    elif isinstance(thing, int | float) and not isinstance(thing, bool):
        yield steps


def _replaced(thing: Any, steps: tuple[_Step, ...], value: float) -> Any:
    if not steps:
        return value
    first, rest = steps[0], steps[1:]
    if isinstance(first, int):
        return (*thing[:first], _replaced(thing[first], rest, value), *thing[first + 1 :])
    return dataclasses.replace(thing, **{first: _replaced(getattr(thing, first), rest, value)})
