"""Figures, tables and statements of Railways 2014 on combinations of sensor states, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.logic.truth_table import Codes, TruthTable, table_from_letters
from sbas.fusion.states import LETTERS, combination_codes

Figure9 = Literal["corrected", "printed"]

_LETTERS: dict[str, tuple[str, str]] = {
    "printed": (
        "NND DNN DDD  NND NDD DDD  DDD DDD DDU",
        "Railways 2014, Figure 9, as printed (leaf O12 is labelled O10 a second time)",
    ),
    "corrected": (
        "NND NND DDD  NND NDD DDD  DDD DDD DDU",
        "Railways 2014, Figure 9, leaves O4 and O6 exchanged: as printed a worse sensor improves "
        "the output three times, and the text has (N, DA, N) lead to N",
    ),
}


def figure_9(version: Figure9 = "corrected") -> TruthTable:
    """The decision tree of Figure 9 as a truth table.

    Parameters
    ----------
    version : "printed", or "corrected": O4, that is (N, DA, N), is N and O6, (N, DA, U), is DA.

    Returns
    -------
    TruthTable. That C1, C2, C3 are odometer, accelerometer and GPS receiver is assumed; the
    corrected tree is the same in any order.

    Raises
    ------
    InputError : another version.

    References
    ----------
    Railways 2014, Figure 9; Table 2 and section 3.3.1 for the correction.
    """
    if version not in _LETTERS:
        raise InputError(
            f"Figure 9 has no version {version!r}", where="version", cure="corrected or printed"
        )
    letters, provenance = _LETTERS[version]
    return table_from_letters(("Odo", "Acc", "GPS"), letters, provenance=provenance)


@dataclass(frozen=True)
class CriticalRows:
    """Combinations that a table of the paper calls critical.

    Parameters
    ----------
    number : of the table.
    architecture : name of the preset.
    names : (n,) sensors, in the table's order.
    rows : a letter a sensor, "D" for DA, in the table's order.
    source : place in the paper.
    """

    number: int
    architecture: str
    names: tuple[str, ...]
    rows: tuple[str, ...]
    source: str

    def codes(self) -> Codes:
        """(rows,) combination codes."""
        return codes_of(self.rows)


def codes_of(rows: tuple[str, ...]) -> Codes:
    """Combination codes of rows of letters, such as ("UUN", "NDU")."""
    states = np.array([[LETTERS[letter] for letter in row] for row in rows], np.int8)
    return combination_codes(states.T)


CRITICAL_TABLES: Mapping[int, CriticalRows] = MappingProxyType(
    {
        2: CriticalRows(
            2, "arch1", ("Odo", "Acc", "GPS"),
            ("DDD", "UND", "UDN", "DUN", "DNU", "NDU", "NUD", "UUN"),
            "Railways 2014, section 3.3.1, Table 2",
        ),
        3: CriticalRows(
            3, "arch1ter", ("Odo", "Odo2", "Acc", "GPS"),
            ("UUND", "UUDD", "UUUN", "DDDD", "DDUN", "DDNU", "NNDU", "NNUD"),
            "Railways 2014, section 3.3.3, Table 3",
        ),
        4: CriticalRows(
            4, "arch2", ("Odo", "IMU", "GPS"),
            ("UUN", "UUD", "UUU", "DDD", "DDU", "DDN", "NND", "NNU"),
            "Railways 2014, section 3.3.4, Table 4",
        ),
    }
)  # fmt: skip
"""Tables 2, 3 and 4 by their number."""


@dataclass(frozen=True)
class CriticalTimeStatement:
    """A critical time that the paper states; which quantile it means it does not say.

    Parameters
    ----------
    architecture : name of the preset.
    rows : combinations it is said of, a letter a sensor.
    shortest_s, longest_s : the time, or the range it is in [s].
    source : place in the paper, with what else is said.
    """

    architecture: str
    rows: tuple[str, ...]
    shortest_s: float
    longest_s: float
    source: str


CRITICAL_TIMES: tuple[CriticalTimeStatement, ...] = (
    CriticalTimeStatement(
        "arch1", ("UUN",), 2.0, 2.0,
        "Railways 2014, section 3.3.1: from DA to U where the combination is still the same",
    ),
    CriticalTimeStatement(
        "arch1bis", ("NNU", "NDU", "NUU", "DNU", "DDU", "DUU", "UNU", "UDU", "UUU"), 1.0, 3.0,
        "Railways 2014, section 3.3.2: GPS receiver in U, by the size of the degradation",
    ),
    CriticalTimeStatement(
        "arch2", ("UUU",), 1.0, 1.0,
        "Railways 2014, section 3.3.4: not at once U, with a time step of 1 s",
    ),
)  # fmt: skip
"""Every critical time in the paper; times of the other rows it had not measured."""

NOMINAL_ROWS = ("NNN", "NND", "NDN")
"""Architecture 1: combinations that the text has lead to N (Railways 2014, section 3.3.1)."""

STATED_COUNTS: Mapping[str, int] = MappingProxyType(
    {"degraded": 20, "critical": 15, "always_unacceptable": 7}
)
"""Counts in the text: DA combinations and critical ones among them (section 3.3, of the example
that Figure 9 shows, which has 19), and those that lead to U whatever happens (section 3.3.1, of
the simulated architecture 1, not of the figure)."""

TREATMENT_ERRORS_M: Mapping[str, float] = MappingProxyType(
    {"remove": 272.7085, "hold": 18.8046, "substitute": 5.4145}
)
"""Position error of three treatments of a missing GPS receiver, architecture 1; neither the
metric nor the length of the outage is given (Railways 2014, section 3.1, Table 1)."""
