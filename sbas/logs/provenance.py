"""Which file a recording was read from, how, and with which versions."""

from __future__ import annotations

import functools
import importlib.metadata
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from sbas.logs.decompression import PlainFile
from sbas.logs.detection import Detection
from sbas.logs.file_sets import sha256_of
from sbas.recording import RecordingMeta, Source


def source_of(path: str | os.PathLike[str], kind: str) -> Source:
    """A file with its size and SHA-256."""
    name = os.fspath(path)
    return Source(
        path=_printable(name),
        bytes=os.path.getsize(name),
        sha256=sha256_of(Path(name)),
        format=kind,
        reader_version=_version("sbas"),
    )


def versions() -> dict[str, str]:
    """Versions of what figures rest on."""
    return {
        "sbas": _version("sbas"),
        "numpy": np.__version__,
        "pandas": pd.__version__,
        "pyarrow": pa.__version__,
    }


def completed(
    meta: RecordingMeta,
    file: PlainFile,
    found: Detection,
    digest: str,
    options: Mapping[str, Any],
) -> RecordingMeta:
    """Metadata with the file as last source, findings of detection, options and versions.

    Parameters
    ----------
    meta : as the format's reader made it.
    digest : SHA-256 of the file as it was given.
    options : options that the caller gave.
    """
    source = Source(
        path=_printable(str(file.given)),
        bytes=os.path.getsize(file.given),
        sha256=digest,
        format=found.format.name,
        reader_version=_version("sbas"),
    )
    given = {
        name: str(dict(value) if isinstance(value, Mapping) else value)
        for name, value in options.items()
    }
    own = (
        replace(f, where=file.renamed(f.where), evidence=file.renamed(f.evidence))
        for f in meta.findings
    )
    return replace(
        meta,
        sources=(*meta.sources, source),
        findings=(*found.findings, *file.findings, *own),
        options={**given, **meta.options},
        versions={**meta.versions, **versions()},
    )


def _printable(path: str) -> str:
    """A path whose bytes are no text, or that holds control characters, with those escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in path)


@functools.cache
def _version(package: str) -> str:
    return importlib.metadata.version(package)
