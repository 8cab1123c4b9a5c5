"""The method tables name functions and tests that exist; every public function stands in one."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path

import pytest

import sbas
from tests.conftest import ROOT

PAGES = sorted((ROOT / "docs").rglob("*.md"))
FUNCTION = re.compile(r"`(sbas(?:\.\w+)+)`")
TEST = re.compile(r"`(tests/[\w/]+\.py)(?:::(\w+))?`")


def resolve(name: str) -> object:
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[cut:]:
            found = getattr(found, attribute)
        return found
    raise AssertionError(name)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_what_a_page_names_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for name in FUNCTION.findall(text):
        assert resolve(name) is not None, name
    for path, test in TEST.findall(text):
        assert (ROOT / path).is_file(), path
        if test:
            assert f"def {test}(" in (ROOT / path).read_text(encoding="utf-8"), f"{path}::{test}"


def test_every_public_function_stands_in_a_method_table() -> None:
    tables = "".join(p.read_text(encoding="utf-8") for p in (ROOT / "docs/methods").glob("*.md"))
    for name in sbas.__all__:
        thing = getattr(sbas, name)
        if inspect.isfunction(thing):
            public = f"{thing.__module__}.{thing.__name__}"
            assert f"`{public}`" in tables or f"`sbas.{name}`" in tables, name


def test_links_between_pages_lead_somewhere() -> None:
    for page in (*PAGES, ROOT / "README.md"):
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[\w-]*)?\)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_finding_code_is_documented() -> None:
    text = (ROOT / "docs/formats.md").read_text(encoding="utf-8")
    for code in sbas.findings.CODES:
        assert f"| {code} " in text, code


def test_every_column_is_documented_as_it_is() -> None:
    text = (ROOT / "docs/formats.md").read_text(encoding="utf-8")
    for column in sbas.recording.COLUMNS.values():
        assert f"| `{column.name}` | {column.dtype}, " in text
        assert f"| {column.unit} | {column.meaning} |" in text
