"""Encodings of text: which one the first bytes show, and text of any of them as UTF-8."""

from __future__ import annotations

import codecs

import numpy as np

from sbas.exceptions import InputError

_BOMS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"),
         (codecs.BOM_UTF16_BE, "utf-16-be"))  # fmt: skip
REPLACEMENT = "\ufffd".encode()
"""What stands for bytes that are no character of their encoding."""


def check_encoding(name: str) -> None:
    """Raise InputError unless the name is that of a text encoding that can go piece by piece."""
    try:
        # Refuses codecs of bytes, such as base64, and those that cannot go piece by piece.
        b"1".decode(name, "replace")
        codecs.getincrementaldecoder(name)("replace").decode(b"1")
    except (LookupError, UnicodeError, ValueError) as error:
        raise InputError(
            f"unknown encoding {name!r}",
            where="encoding",
            evidence=str(error),
            cure="name one that Python knows, such as utf-8, latin-1, cp1250 or utf-16",
        ) from None


def decoded(decoder: codecs.IncrementalDecoder, raw: bytes) -> bytes:
    """The next bytes of a text in UTF-8; those that are no character become REPLACEMENT."""
    # Surrogates (UTF-7 can smuggle them in) have no UTF-8.
    return decoder.decode(raw).encode("utf-8", errors="replace")


def text_encoding(head: bytes) -> tuple[str, int]:
    """Encoding that the first bytes show, and the length of the byte order mark.

    UTF-16 without a mark is told by its NULs: Latin letters and digits have one in every pair.
    """
    for bom, name in _BOMS:
        if head.startswith(bom):
            return name, len(bom)
    sample = np.frombuffer(head[: len(head) // 2 * 2], np.uint8)
    if len(sample) >= 8:
        even, odd = np.mean(sample[0::2] == 0), np.mean(sample[1::2] == 0)
        if odd > 0.9 and even < 0.1:
            return "utf-16-le", 0
        if even > 0.9 and odd < 0.1:
            return "utf-16-be", 0
    return "utf-8", 0
