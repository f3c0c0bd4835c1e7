"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """Root of the repository."""
    return REPOSITORY


@pytest.fixture(scope="session")
def rille_data() -> Path:
    """Folder with real CAD, DEM and bench data (``RILLE_DATA``, default ``../shared``); skips the test if absent."""
    path = Path(os.environ.get("RILLE_DATA", REPOSITORY.parent / "shared")).resolve()
    if not path.is_dir():
        pytest.skip(f"real data absent: set RILLE_DATA to the folder that holds data/ and reference/ (looked at {path})")
    return path
