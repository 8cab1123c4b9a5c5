"""The notebooks run from top to bottom."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from tests.conftest import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("execute", ROOT / "notebooks/execute.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.execute(notebook, tmp_path / notebook.name)
    assert "Traceback" not in (tmp_path / notebook.name).read_text(encoding="utf-8")


def test_every_picture_of_the_notebook_was_seen_once() -> None:
    for path in NOTEBOOKS:
        text = path.read_text(encoding="utf-8")
        assert text.count('"image/png"') == text.count("sbas.plots.") > 0, path.name
