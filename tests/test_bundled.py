"""Bundled files are found in a checkout and in an installed wheel."""

from __future__ import annotations

from pathlib import Path

import pytest

import sbas.bundled
from sbas.bundled import bundled
from sbas.exceptions import InputError


def test_checkout_has_them_beside_the_package() -> None:
    assert bundled("allocations", "pa_do229.toml").is_file()


def test_wheel_has_them_inside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "sbas"
    for root in (package / "data", tmp_path / "data"):
        root.mkdir(parents=True)
        (root / "file.toml").write_text("")
    monkeypatch.setattr(sbas.bundled, "_PACKAGE", package)
    assert bundled("file.toml") == package / "data" / "file.toml"
    with pytest.raises(InputError, match="no bundled file"):
        bundled("other", "file.toml")
