"""The compiler, for the modules that simulate; importing it takes about a second."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The function in machine code, kept on disk between runs."""
    return cast(F, numba.njit(cache=True, nogil=True)(function))
