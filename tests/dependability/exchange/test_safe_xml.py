from __future__ import annotations

from pathlib import Path

import pytest

from sbas.dependability.exchange import safe_xml
from sbas.dependability.exchange.safe_xml import content_of, parse_xml
from sbas.exceptions import InputError

LAUGHS = b"""<!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><opsa-mef>&c;</opsa-mef>"""


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (LAUGHS, "declares entities"),
        (b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><x>&e;</x>', "declares entities"),
        (b'<!DOCTYPE x [<!ENTITY % e SYSTEM "http://h/x">%e;]><x/>', "declares entities"),
        (b"<a>" * 100_000, "more than 200 deep"),
        (b"<a>" * 201 + b"</a>" * 201, "more than 200 deep"),
        (b"<a><b></a>", "not well-formed"),
        (b"", "not well-formed"),
        (b"\x00\xff\xfe", "not well-formed"),
        (b"PK\x03\x04", "not well-formed"),
        (b'<?xml version="1.0" encoding="no-such"?><a/>', "not known|not well-formed"),
        (b"<a>&undefined;</a>", "not well-formed"),
    ],
)
def test_hostile_and_broken_xml_is_refused(content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_xml(content)


def test_limits_of_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(safe_xml, "MAX_BYTES", 100)
    with pytest.raises(InputError, match="larger than 100 bytes"):
        parse_xml(b"<a>" + b" " * 200 + b"</a>")
    monkeypatch.setattr(safe_xml, "MAX_ELEMENTS", 5)
    with pytest.raises(InputError, match="more than 5 elements"):
        parse_xml(b"<a>" + b"<b/>" * 8 + b"</a>")


def test_a_plain_document_type_and_a_file_are_read(tmp_path: Path) -> None:
    file = tmp_path / "x.xml"
    file.write_bytes(b"<!DOCTYPE opsa-mef><opsa-mef><b/></opsa-mef>")
    root, where = parse_xml(file)
    assert (root.tag, len(root), where) == ("opsa-mef", 1, str(file))


def test_a_folder_and_an_impossible_path_cannot_be_read(tmp_path: Path) -> None:
    for path in (tmp_path, "a\0b"):
        with pytest.raises(InputError, match="cannot be read"):
            content_of(path)
