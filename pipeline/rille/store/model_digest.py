"""What a simulation of a database depends on, as a digest."""

import hashlib
from pathlib import Path

from rille.store.database import reading

NOT_MODEL = {
    *("provenance", "part", "part_instance", "mesh", "recording", "clock", "clock_block", "channel", "sample_block", "correction"),
    *("gate_finding", "finding", "run", "body_state", "joint_state", "wheel_state", "joint_reaction", "energy_state", "sensor_sample"),
    *("rut_tile", "checkpoint", "bench_point", "event", "command_log", "saved_state"),
}


def model_digest(path: Path) -> str:
    """SHA-256 of all rows that a simulation depends on; pictures, recordings, results and findings leave it as it is."""
    found = hashlib.sha256()
    with reading(path) as connection:
        tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' ORDER BY name")
        for table in [row["name"] for row in tables]:
            if table not in NOT_MODEL:
                found.update(table.encode())
                for row in connection.execute(f"SELECT * FROM {table} ORDER BY rowid"):
                    found.update(repr(tuple(row)).encode())
    return found.hexdigest()
