"""XML from strangers: no entities, no references to elsewhere, limits on size and depth."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from sbas.exceptions import InputError

MAX_BYTES = 64 * 2**20
MAX_DEPTH = 200
MAX_ELEMENTS = 2_000_000


class _Limited(TreeBuilder):
    """A tree builder that stops at a depth or a number of elements."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self._where = where
        self._depth = 0
        self._elements = 0

    def start(self, tag: Any, attrs: Any, /) -> Element:
        self._depth += 1
        self._elements += 1
        if self._depth > MAX_DEPTH:
            raise InputError(
                f"XML elements are nested more than {MAX_DEPTH} deep", where=self._where
            )
        if self._elements > MAX_ELEMENTS:
            raise InputError(f"the XML has more than {MAX_ELEMENTS} elements", where=self._where)
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> Element:
        self._depth -= 1
        return super().end(tag)


def content_of(source: Path | str | bytes) -> tuple[bytes, str]:
    """Bytes of a file (a path) or of a text at hand (bytes), and what to call it in errors.

    Raises
    ------
    InputError : no such file, or more than `MAX_BYTES`.
    """
    if isinstance(source, bytes):
        content, where = source, "bytes"
    else:
        where = str(source)
        try:
            with Path(source).open("rb") as file:
                content = file.read(MAX_BYTES + 1)
        except (OSError, ValueError) as error:
            raise InputError("the file cannot be read", where=where, evidence=str(error)) from None
    if len(content) > MAX_BYTES:
        raise InputError(f"the file is larger than {MAX_BYTES} bytes", where=where)
    return content, where


def parse_xml(source: Path | str | bytes) -> tuple[Element, str]:
    """The root element of an XML file from an untrusted source, and what to call the file.

    Parameters
    ----------
    source : path of a file, or its content as bytes.

    Raises
    ------
    InputError : not well formed; a declared entity; a reference to another file or address;
        nested too deeply; too large.
    """
    content, where = content_of(source)
    parser = DefusedXMLParser(
        target=_Limited(where), forbid_dtd=False, forbid_entities=True, forbid_external=True
    )
    try:
        parser.feed(content)
        root: Element = parser.close()
    except ParseError as error:
        raise InputError(
            "the file is not well-formed XML", where=where, evidence=str(error)
        ) from None
    except DefusedXmlException as error:
        raise InputError(
            "the XML declares entities or refers to other files: it is not read",
            where=where,
            evidence=str(error)[:200],
            cure="write the document without <!ENTITY> and external references",
        ) from None
    except (LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "the encoding of the XML is not known", where=where, evidence=str(error)
        ) from None
    return root, where
