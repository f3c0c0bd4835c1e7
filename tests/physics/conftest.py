"""Models for the physics tests, written through the store and read by the solver: the path that users take."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rille import store
from rille.model import Rover, Scenario, Terrain


@pytest.fixture
def make_model(tmp_path: Path) -> Callable[..., Path]:
    """Write rover, scenario and (optional) terrain into a fresh database and return its path."""
    count = iter(range(1000))

    def make(rover: Rover, scenario: Scenario, terrain: Terrain | None = None) -> Path:
        path = tmp_path / f"model{next(count)}.db"
        store.create(path)
        store.write_rover(path, rover)
        if terrain is not None:
            store.write_terrain(path, terrain)
        store.write_scenario(path, scenario)
        return path

    return make
