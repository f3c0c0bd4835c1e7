"""What is said about an evaluated terrain, and how it gets into a database."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rille.model import Terrain


def facts_of(ground: "Terrain") -> dict[str, Any]:
    """Size, heights and contents, for ``--json``."""
    from rille.terrain.surface import height_range

    n_rows, n_cols = ground.heights.shape
    return {
        "terrain": ground.name,
        "rows": n_rows,
        "columns": n_cols,
        "posting_m": [ground.posting_x, ground.posting_y],
        "extent_m": [(n_cols - 1) * ground.posting_x, (n_rows - 1) * ground.posting_y],
        "heights_m": list(height_range(ground.heights)),
        "landforms": [landform.name for landform in ground.landforms],
        "populations": {population.name: len(population.x) for population in ground.populations},
        "obstacles": len(ground.obstacles),
        "soils": [soil.name for soil in ground.soils],
        "filled": 0 if ground.filled is None else int(ground.filled.sum()),
    }


def sentence_of(facts: dict[str, Any]) -> str:
    """The same for people."""
    width, height = facts["extent_m"]
    low, high = facts["heights_m"]
    px, py = facts["posting_m"]
    posting = f"{px:g} m" if px == py else f"{px:g} m x {py:g} m"
    several = "".join(f", {count} {name}" for name, count in facts["populations"].items())
    forms = len(facts["landforms"])
    solid = f", {facts['obstacles']} obstacles" if facts["obstacles"] else ""
    filled = f"; {facts['filled']} heights were missing and are interpolated" if facts["filled"] else ""
    return (
        f"terrain '{facts['terrain']}', {width:g} m x {height:g} m at {posting}, heights {low:.2f} to {high:.2f} m, "
        f"{forms} landform{'' if forms == 1 else 's'}{several}{solid}, soils {', '.join(facts['soils'])}{filled}"
    )


def write_database(ground: "Terrain", database: Path, force: bool, progress: Callable[[str, float], None]) -> None:
    """Write a terrain into a database, which is made if it is absent."""
    from rille import store

    with store.made_if_absent(database):
        progress(f"writing {database.name}", 0.0)
        store.write_terrain(database, ground, replace=force, progress=progress)
