"""Compact RINEX (Hatanaka) to plain RINEX, by the program crx2rnx that the package hatanaka has.

The program is called here, since the package's own function drops what was restored before an
error, and takes a line that is cut within a number for a whole one.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import tempfile
from pathlib import Path

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.decompression import output_limit
from sbas.logs.temporary_file import TemporaryFile

_BLOCK = 1 << 20
_DONE, _WARNED = 0, 2


def is_compact(path: Path) -> bool:
    """Whether the first line says so."""
    with open(path, "rb") as file:
        return b"CRINEX VERS" in file.read(81)


def restored(path: Path, *, where: str) -> tuple[bytes, tuple[Finding, ...]]:
    """Plain RINEX of a Compact RINEX file; of one that is cut or damaged, what stands before.

    Parameters
    ----------
    path : the file, not compressed otherwise.
    where : its name in messages.

    Raises
    ------
    InputError : nothing can be restored, or more than `output_limit` allows (E21).
    """
    size = path.stat().st_size
    whole = _up_to_last_line_end(path, size)
    limit = output_limit(size)
    pieces, written = [], 0
    with tempfile.TemporaryFile() as errors:
        with open(whole.path if whole else path, "rb") as source:
            process = subprocess.Popen(
                [_program(), "-"], stdin=source, stdout=subprocess.PIPE, stderr=errors
            )
        try:
            assert process.stdout is not None
            while piece := process.stdout.read(_BLOCK):
                pieces.append(piece)
                written += len(piece)
                if written > limit:
                    raise InputError(
                        "what is packed in the Compact RINEX file is out of proportion to it",
                        code="E21",
                        where=where,
                        evidence=f"more than {limit:,} bytes from {size:,}",
                        cure="restore it yourself with crx2rnx where you trust the file",
                    )
            outcome = process.wait()
        finally:
            process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()
        errors.seek(0)
        said = " ".join(errors.read(2000).decode("ascii", "backslashreplace").split())
    return b"".join(pieces), _findings(outcome, said, whole is not None, where)


def _findings(outcome: int, said: str, cut: bool, where: str) -> tuple[Finding, ...]:
    if outcome == _DONE and not cut:
        return ()
    message = (
        "crx2rnx restored the Compact RINEX file with warnings: epochs may be missing"
        if outcome == _WARNED and not cut
        else "the Compact RINEX file is cut or damaged: epochs from there on are lost"
    )
    return (
        Finding(
            "E10",
            "warning",
            message,
            where=where,
            evidence=said[:300] or "its last line does not end",
            cure="get the file again",
        ),
    )


def _up_to_last_line_end(path: Path, size: int) -> TemporaryFile | None:
    """A copy without the line that is cut at the end of the file, if there is one."""
    with open(path, "rb") as file:
        file.seek(max(size - 1, 0))
        if file.read(1) == b"\n":
            return None
        file.seek(0)
        data = file.read()
    copy = TemporaryFile()
    copy.path.write_bytes(data[: data.rfind(b"\n") + 1])
    return copy


def _program() -> str:
    found = importlib.util.find_spec("hatanaka")  # not imported: the program is all that is needed
    name = "crx2rnx.exe" if os.name == "nt" else "crx2rnx"
    for folder in found.submodule_search_locations or () if found else ():
        program = Path(folder) / "bin" / name
        if program.is_file():
            return str(program)
    raise InputError(
        "Compact RINEX needs the package hatanaka",
        cure="pip install hatanaka, or restore the file with crx2rnx",
    )
