"""The house: one direction of imports, light to load, no name used twice."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import sbas

PACKAGE = Path(sbas.__file__).parent

LAYERS = (
    "version", "numerals", "exceptions", "findings", "timescales", "estimate", "recording",
    "satellite_table", "bundled", "streaming", "recording_survey", "frames", "track", "truth",
    "environment_labels", "input_check", "logs", "rinex", "augmentation", "positioning",
    "monitoring", "laboratory", "integrity", "dependability", "fusion", "plots", "reporting",
    "cli",
)  # fmt: skip
"""From the ground up: a module imports only from its own layer and those before it."""

ONLY_IN = {
    "matplotlib": {"plots", "reporting"},
    "jinja2": {"reporting"},
    "typer": {"cli"},
    "rich": {"cli"},
}
ORACLES = {
    "filterpy",
    "statsmodels",
    "pysbf2",
    "pyubx2",
    "mpmath",
    "hypothesis",
    "pytest",
    "pynmeagps",
    "pyrtcm",
}


def modules() -> list[Path]:
    return sorted(p for p in PACKAGE.rglob("*.py") if p.parts[-2:] != ("sbas", "__init__.py"))


def layer_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> list[tuple[int, str]]:
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno} imports relatively"
            found.append((node.lineno, node.module or ""))
    return found


def test_every_module_has_a_layer() -> None:
    assert {layer_of(p) for p in modules()} <= set(LAYERS)


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_no_import_runs_back(path: Path) -> None:
    own = LAYERS.index(layer_of(path))
    for line, name in imports(path):
        top, *rest = name.split(".")
        where = f"{path.name}:{line} imports {name}"
        if top == "sbas" and rest:
            assert LAYERS.index(rest[0]) <= own, where
        assert layer_of(path) in ONLY_IN.get(top, {layer_of(path)}), where
        assert top not in ORACLES, where


def test_packages_modules_and_public_functions_never_share_a_name() -> None:
    names = {p.stem for p in modules()} | {p.parent.name for p in modules()}
    assert not names & (set(sbas.__all__) - {"__version__"})


def test_importing_sbas_loads_no_drawing_and_no_compiler() -> None:
    code = (
        "import sys, sbas; "
        "print([m for m in ('matplotlib', 'jinja2', 'numba', 'typer', 'scipy.stats') "
        "if m in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


def test_every_public_name_is_there() -> None:
    for name in sbas.__all__:
        assert getattr(sbas, name) is not None
    with pytest.raises(AttributeError):
        sbas.no_such_question  # type: ignore[attr-defined]  # noqa: B018


def test_a_file_fits_in_a_readers_head() -> None:
    long = {p.name: n for p in modules() if (n := len(p.read_text().splitlines())) > 450}
    assert not long
