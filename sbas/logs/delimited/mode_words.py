"""Words and numbers of a column `mode`, and what they mean."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.recording import MODES, mode_categories


def encoded(words: Any) -> tuple[NDArray[np.int32], list[str]]:
    """(n,) codes of (n,) pyarrow strings, and the distinct ones; a missing one is ""."""
    held = words.fill_null("").dictionary_encode()
    codes: NDArray[np.int32] = held.indices.to_numpy(zero_copy_only=False)
    return codes, held.dictionary.to_pylist()


def modes(words: Any, mode_map: Mapping[str, str] | None, *, where: str) -> pd.Categorical:
    """Column `mode` of (n,) pyarrow strings: names of `MODES`, or words that `mode_map` knows.

    Raises
    ------
    InputError : words that are neither, or a map to names that are no modes.
    """
    table = {name: name for name in MODES}
    if mode_map is not None:
        table |= {plain_word(str(word)): name for word, name in mode_map.items()}
        if strange := sorted(set(table.values()) - set(MODES)):
            raise InputError(
                f"mode_map names unknown modes: {', '.join(map(repr, strange))}",
                cure=f"known modes are {', '.join(MODES)}",
            )
    codes, uniques = encoded(words)
    plain = [plain_word(word) for word in uniques]
    unknown = [word for word in plain if word and word not in table]
    if unknown:
        shown = ", ".join(unknown[:12])[:300]
        raise InputError(
            "the mode column has values whose meaning is not known",
            where=where,
            evidence=shown,
            cure=_mode_cure(unknown, mode_map or {}),
        )
    lookup = np.array([MODES.index(table[word]) if word else -1 for word in plain] + [-1], np.int8)
    return mode_categories(lookup[codes])


_LIKELY_MODES = {
    "sbas_pa": ("pa", "sbaspa", "lpv"),
    "sbas_npa": ("npa", "sbasnpa"),
    "sbas": ("sbas", "waas", "egnos", "msas", "gagan", "bdsbas", "kass"),
    "dgnss": ("dgps", "dgnss", "diff", "differential"),
    "rtk": ("rtk", "rtkfix", "rtkfixed", "rtkfloat", "fixed", "float", "fixedrtk", "floatrtk"),
    "standalone": ("single", "spp", "standalone", "autonomous"),
    "none": ("none", "no", "nofix", "invalid", "nosolution"),
}
"""Words of programs that can mean one mode only; numbers mean what their program says."""


def _mode_cure(unknown: Sequence[str], given: Mapping[str, str]) -> str:
    """`--mode-map` with what was given and the words met; MODE where only the user can tell."""
    likely = {word: mode for mode, known in _LIKELY_MODES.items() for word in known}
    pairs = [f"{word}={mode}" for word, mode in given.items()]
    for word in sorted(unknown)[:12]:
        squashed = re.sub(r"[^0-9a-z]", "", word.lower())
        pairs.append(f"{word[:40]}={likely.get(squashed, 'MODE')}")
    open_ = any(pair.endswith("=MODE") for pair in pairs)
    return f"--mode-map {shlex.quote(','.join(pairs))}" + (
        f" with one of {', '.join(MODES)} for each MODE"
        if open_
        else f"; modes are {', '.join(MODES)}"
    )


def plain_word(word: str) -> str:
    """A word without blanks around it; a whole number without decimals."""
    return re.sub(r"^(\d+)\.0*$", r"\1", word.strip())
