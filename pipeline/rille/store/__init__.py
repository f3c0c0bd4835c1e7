"""The database: the only Python of rille that speaks SQL. See ``schema/README.md`` for the contract."""

from rille.store.database import create, migrate, schema_version
from rille.store.health import check, info, units
from rille.store.results import RunRow, list_runs, read_trace
from rille.store.rover import read_rover, write_rover
from rille.store.scenario import read_scenario, write_scenario
from rille.store.terrain import read_terrain, write_terrain

__all__ = [
    "RunRow",
    "check",
    "create",
    "info",
    "list_runs",
    "migrate",
    "read_rover",
    "read_scenario",
    "read_terrain",
    "read_trace",
    "schema_version",
    "units",
    "write_rover",
    "write_scenario",
    "write_terrain",
]
