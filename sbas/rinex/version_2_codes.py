"""Observation types of RINEX 2 by the codes of RINEX 3.

Version 2 does not say which signal a receiver tracked, version 3 does: types are named after
what they usually were. L1 C/A goes with C1, the precise code of GPS was tracked without its key
(W), a second civil signal with pilot and data together (X).
Source: RINEX 2.11, section 4; RINEX 3.05, tables 4 to 10.
"""

from __future__ import annotations

from collections.abc import Sequence

_SIGNALS = {
    "G": {"C1": "1C", "P1": "1W", "C2": "2X", "P2": "2W", "C5": "5X", "1": "1C", "2": "2W",
          "5": "5X"},
    "R": {"C1": "1C", "P1": "1P", "C2": "2C", "P2": "2P", "C3": "3X", "1": "1C", "2": "2P",
          "3": "3X"},
    "E": {"C1": "1X", "C5": "5X", "C6": "6X", "C7": "7X", "C8": "8X", "1": "1X", "5": "5X",
          "6": "6X", "7": "7X", "8": "8X"},
    "S": {"C1": "1C", "C5": "5X", "1": "1C", "5": "5X"},
    "J": {"C1": "1C", "C2": "2X", "C5": "5X", "C6": "6X", "1": "1C", "2": "2X", "5": "5X",
          "6": "6X"},
    "C": {"C1": "2I", "C2": "2I", "C6": "6I", "C7": "7I", "1": "2I", "2": "2I", "6": "6I",
          "7": "7I"},
}  # fmt: skip


def codes_of_version_2(types: Sequence[str], system: str) -> dict[str, tuple[str, ...]]:
    """Codes of version 3 in the order of the types, by system; a type that has none keeps its
    name, and so does the second of two that would be named alike.

    Parameters
    ----------
    system : letter of the file, M or blank for any.
    """
    if not types:
        return {}
    letters = system if system in _SIGNALS else "".join(_SIGNALS)
    return {letter: _named(types, _SIGNALS[letter]) for letter in letters}


def _named(types: Sequence[str], signals: dict[str, str]) -> tuple[str, ...]:
    names: list[str] = []
    for old in types:
        kind = "C" if old[0] == "P" else old[0]
        signal = signals.get(old if kind == "C" else old[1:])
        new = kind + signal if signal and kind in "CLDS" else old
        names.append(old if new in names else new)
    return tuple(names)
