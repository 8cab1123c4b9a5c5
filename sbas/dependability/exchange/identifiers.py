"""Names that other formats accept, made from names that they do not."""

from __future__ import annotations

import re
from collections.abc import Iterable

from sbas.exceptions import ModelError


def identifiers(names: Iterable[str]) -> dict[str, str]:
    """An identifier for each name: letters, digits and single underscores, no two alike.

    Parameters
    ----------
    names : all different; one that is an identifier already keeps it, hyphens between letters
        included.

    Raises
    ------
    ModelError : a name that cannot be printed, or with space at its ends.
    """
    wanted = list(names)
    for name in wanted:
        if not name or not name.isprintable() or name != name.strip():
            raise ModelError(
                f"{name!r} is no printable name without space at its ends", where="names"
            )
    found = {name: name for name in wanted if is_identifier(name)}
    taken = TakenNames(found)
    for name in wanted:
        if name in found:
            continue
        base = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
        base = base if base[:1].isalpha() else f"n_{base}".rstrip("_")
        found[name] = taken.new(base, "_")
    return found


class TakenNames:
    """Names in use; a new one gets the next number that is free.

    Parameters
    ----------
    names : in use from the start.
    """

    def __init__(self, names: Iterable[str] = ()) -> None:
        self._taken = set(names)
        self._last: dict[str, int] = {}

    def new(self, wish: str, joint: str) -> str:
        """The wish, or with a number behind a joint if it is in use."""
        name = wish
        while name in self._taken:
            # Counting goes on where it stopped: many equal wishes stay cheap.
            self._last[wish] = self._last.get(wish, 1) + 1
            name = f"{wish}{joint}{self._last[wish]}"
        self._taken.add(name)
        return name


def is_identifier(name: str) -> bool:
    """Whether Open-PSA takes a name as it is: no dots, hyphens only between other letters."""
    return re.fullmatch(r"[A-Za-z_]\w*(-\w+)*", name, flags=re.ASCII) is not None
