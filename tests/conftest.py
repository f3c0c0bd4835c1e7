"""Fixtures shared by all tests."""

import os
import signal
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from rille import store
from rille.model import Effect, Rover, Scenario, Terrain

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session", autouse=True)
def no_own_landforms(tmp_path_factory: pytest.TempPathFactory):
    """Own landforms of whoever runs the tests stay out of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RILLE_LANDFORMS", str(tmp_path_factory.mktemp("landforms")))
        yield


@pytest.fixture(scope="session", autouse=True)
def ctrl_c():
    """What the tests start can be interrupted, also where whoever runs them ignores SIGINT (a shell that put them in the background)."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


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


@pytest.fixture
def make_model(tmp_path: Path) -> Callable[..., Path]:
    """Write rover, scenario, (optional) terrain and effects into a fresh database and return its path: the way that users take."""
    count = iter(range(1000))

    def make(rover: Rover, scenario: Scenario, terrain: Terrain | None = None, effects: Sequence[Effect] = ()) -> Path:
        path = tmp_path / f"model{next(count)}.db"
        store.create(path)
        store.write_rover(path, rover)
        if terrain is not None:
            store.write_terrain(path, terrain)
        store.write_scenario(path, scenario)
        store.write_effects(path, effects)
        return path

    return make
