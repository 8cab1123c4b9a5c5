"""Files that live as long as somebody holds them: decompressed input, epochs set aside."""

from __future__ import annotations

import os
import tempfile
import weakref
from pathlib import Path


class TemporaryFile:
    """An empty file, deleted when nothing refers to this object any more, or Python ends.

    Parameters
    ----------
    suffix : end of its name, such as an extension.
    """

    def __init__(self, suffix: str = "") -> None:
        handle, name = tempfile.mkstemp(prefix="sbas-", suffix=suffix)
        os.close(handle)
        self.path = Path(name)
        weakref.finalize(self, _remove, self.path, os.getpid())


def _remove(path: Path, owner: int) -> None:
    # A forked process has the object too, but not the file.
    if os.getpid() == owner:
        path.unlink(missing_ok=True)
