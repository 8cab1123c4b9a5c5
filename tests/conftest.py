"""Where the reference data lie, and what every test shares."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("everyday", deadline=None, max_examples=25, derandomize=True)
settings.register_profile("thorough", deadline=None, max_examples=250)
settings.load_profile(os.environ.get("SBAS_TEST_PROFILE", "everyday"))

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def reference_data() -> Path:
    """The folder of reference data; tests that need it are skipped where it is absent."""
    folder = Path(os.environ.get("SBAS_REFERENCE_DATA", ROOT.parent / "shared"))
    if not (folder / "data" / "PROVENANCE.md").is_file():
        pytest.skip(f"no reference data in {folder}: set SBAS_REFERENCE_DATA")
    return folder
