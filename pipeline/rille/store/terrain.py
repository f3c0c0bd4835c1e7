"""Terrain and soil values <-> rows."""

import json
import sqlite3
from pathlib import Path

import numpy as np

from rille.model import InputRefused, LandformInstance, MaterialPair, Obstacle, Soil, SoilPatch, Terrain, nearest_names
from rille.store.database import insert, reading, writing
from rille.store.rover import read_material, read_shape, read_sources, shape_columns, write_material, write_sources

TILE = 1024  # rows and columns of a tile at most

SOIL_COLUMNS = tuple(name for name in Soil.__dataclass_fields__ if name != "name")  # the table holds what the value holds


def write_terrain(path: Path, terrain: Terrain, *, replace: bool = False) -> None:
    """Put a terrain with its soils into the database, in place of one of the same name.

    Soils are shared by all terrains of a database: a soil of the same name must have the same values.

    Raises
    ------
    InputRefused : if a scenario uses the present terrain of that name and ``replace`` is false (true deletes those scenarios
        and their runs), if a soil is missing or differs, or if a value breaks a rule of the schema.
    """
    with writing(path) as connection:
        present = connection.execute("SELECT id FROM terrain WHERE name = ?", (terrain.name,)).fetchone()
        if present is not None:
            users = connection.execute("SELECT name FROM scenario WHERE terrain_id = ?", (present["id"],)).fetchall()
            if users and not replace:
                raise InputRefused(
                    f"terrain '{terrain.name}' in '{path}' is used by scenario '{users[0]['name']}'; "
                    "choose another name, or --force to delete that scenario and its runs"
                )
            connection.execute("DELETE FROM scenario WHERE terrain_id = ?", (present["id"],))
            connection.execute("DELETE FROM terrain WHERE id = ?", (present["id"],))
        connection.execute("DELETE FROM provenance WHERE subject = ?", (f"terrain {terrain.name}",))
        soils = {soil.name: _write_soil(connection, soil) for soil in terrain.soils}
        for material in terrain.materials:
            write_material(connection, material)
        for pair in terrain.pairs:
            _write_pair(connection, pair, soils)
        key = _write_grid(connection, terrain, soils)
        for patch in terrain.patches:
            subject = f"soil patch '{patch.name}'"
            row = {
                "terrain_id": key,
                "soil_id": _soil_key(soils, patch.soil, subject),
                "name": patch.name,
                "polygon": json.dumps([list(map(float, corner)) for corner in patch.polygon]),
            }
            insert(connection, "soil_patch", subject, row)
        for landform in terrain.landforms:
            row = {
                "terrain_id": key,
                "name": landform.name,
                "landform": landform.landform,
                "x": landform.x,
                "y": landform.y,
                "heading": landform.heading,
                "drivers": json.dumps(landform.drivers, sort_keys=True),
            }
            insert(connection, "landform_instance", f"landform '{landform.name}'", row)
        for obstacle in terrain.obstacles:
            _write_obstacle(connection, obstacle, key)
        write_sources(connection, terrain.sources)


def _write_soil(connection: sqlite3.Connection, soil: Soil) -> int:
    row = {column: getattr(soil, column) for column in SOIL_COLUMNS}
    present = connection.execute("SELECT * FROM soil WHERE name = ?", (soil.name,)).fetchone()
    if present is None:
        return insert(connection, "soil", f"soil '{soil.name}'", {"name": soil.name, **row})
    for column, value in row.items():
        if present[column] != value:
            raise InputRefused(
                f"soil '{soil.name}' has {column} = {value}, but the database holds {present[column]} under that name; rename the soil"
            )
    return present["id"]


def _write_obstacle(connection: sqlite3.Connection, obstacle: Obstacle, terrain: int) -> None:
    subject = f"obstacle '{obstacle.name}'"
    materials = dict(connection.execute("SELECT name, id FROM material").fetchall())
    if obstacle.material is not None and obstacle.material not in materials:
        raise InputRefused(
            f"{subject} is of '{obstacle.material}', which the database does not have; {nearest_names(obstacle.material, materials)}"
        )
    row = {
        "terrain_id": terrain,
        "name": obstacle.name,
        "material_id": materials.get(obstacle.material),
        **shape_columns(obstacle),
    }
    insert(connection, "obstacle", subject, row)


def _soil_key(soils: dict[str, int], name: str, subject: str) -> int:
    if name not in soils:
        raise InputRefused(f"{subject} names the soil '{name}', which the terrain does not have; {nearest_names(name, soils)}")
    return soils[name]


def _write_pair(connection: sqlite3.Connection, pair: MaterialPair, soils: dict[str, int]) -> None:
    subject = f"material pair {pair.material or 'any'} - {pair.soil or pair.other_material}"
    materials = dict(connection.execute("SELECT name, id FROM material").fetchall())
    for name in (pair.material, pair.other_material):
        if name is not None and name not in materials:
            raise InputRefused(f"{subject} names an unknown material; {nearest_names(name, materials)}")
    row = {
        "material_id": materials.get(pair.material),
        "other_material_id": materials.get(pair.other_material),
        "soil_id": None if pair.soil is None else _soil_key(soils, pair.soil, subject),
        "response": pair.response,
        "friction": pair.friction,
        "restitution": pair.restitution,
    }
    keys = ("material_id", "other_material_id", "soil_id")
    condition = " AND ".join(f"{k} IS ?" for k in keys)
    connection.execute(f"DELETE FROM material_pair WHERE {condition}", tuple(row[k] for k in keys))
    insert(connection, "material_pair", subject, row)


def _write_grid(connection: sqlite3.Connection, terrain: Terrain, soils: dict[str, int]) -> int:
    subject = f"terrain '{terrain.name}'"
    n_rows, n_cols = terrain.heights.shape
    row = {
        "name": terrain.name,
        "soil_id": _soil_key(soils, terrain.soil, subject),
        "n_rows": n_rows,
        "n_cols": n_cols,
        "posting_x": terrain.posting_x,
        "posting_y": terrain.posting_y,
        "x_west": terrain.x_west,
        "y_north": terrain.y_north,
        "crs": terrain.crs,
        "map_x": terrain.map_origin[0],
        "map_y": terrain.map_origin[1],
        "map_z": terrain.map_origin[2],
        "source": terrain.source,
    }
    key = insert(connection, "terrain", subject, row)
    for row0 in range(0, n_rows, TILE):
        for col0 in range(0, n_cols, TILE):
            tile = terrain.heights[row0 : row0 + TILE, col0 : col0 + TILE]
            values = {
                "terrain_id": key,
                "layer": "height",
                "row0": row0,
                "col0": col0,
                "n_rows": tile.shape[0],
                "n_cols": tile.shape[1],
                "dtype": "float64",
                "data": np.ascontiguousarray(tile, "<f8").tobytes(),
            }
            insert(connection, "terrain_tile", f"a tile of {subject}", values)
    return key


def read_terrain(path: Path, name: str | None = None) -> Terrain:
    """Read a terrain; without a name, the only one.

    Raises
    ------
    InputRefused : if there is none, none of that name, or several and no name was given.
    """
    with reading(path) as connection:
        rows = {r["name"]: r for r in connection.execute("SELECT * FROM terrain ORDER BY id")}
        if not rows:
            raise InputRefused(f"'{path}' has no terrain; add one: `rille terrain build SCENE.toml -o {path}`")
        if name is None and len(rows) > 1:
            raise InputRefused(f"'{path}' has several terrains; name one, {nearest_names('', rows)}")
        if name is not None and name not in rows:
            raise InputRefused(f"'{path}' has no terrain '{name}'; {nearest_names(name, rows)}")
        return _read(connection, rows[name] if name is not None else next(iter(rows.values())))


def read_soils(path: Path) -> tuple[Soil, ...]:
    """All soils of a database."""
    with reading(path) as connection:
        rows = connection.execute("SELECT * FROM soil ORDER BY id").fetchall()
        return tuple(Soil(name=r["name"], **{column: r[column] for column in SOIL_COLUMNS}) for r in rows)


def _read(connection: sqlite3.Connection, row: sqlite3.Row) -> Terrain:
    soils = {r["id"]: r for r in connection.execute("SELECT * FROM soil ORDER BY id")}
    patches = connection.execute("SELECT * FROM soil_patch WHERE terrain_id = ? ORDER BY id", (row["id"],)).fetchall()
    used = {row["soil_id"], *(p["soil_id"] for p in patches)}
    heights = np.full((row["n_rows"], row["n_cols"]), np.nan)
    tiles = connection.execute("SELECT * FROM terrain_tile WHERE terrain_id = ? AND layer = 'height'", (row["id"],))
    for tile in tiles:
        values = np.frombuffer(tile["data"], {"float32": "<f4", "float64": "<f8"}[tile["dtype"]])
        rows = slice(tile["row0"], tile["row0"] + tile["n_rows"])
        columns = slice(tile["col0"], tile["col0"] + tile["n_cols"])
        heights[rows, columns] = values.reshape(tile["n_rows"], tile["n_cols"])
    materials = dict(connection.execute("SELECT id, name FROM material").fetchall())
    pairs = connection.execute("SELECT * FROM material_pair WHERE soil_id IS NOT NULL ORDER BY id").fetchall()
    rigid = connection.execute("SELECT * FROM material_pair WHERE soil_id IS NULL ORDER BY id").fetchall()
    obstacles = connection.execute("SELECT * FROM obstacle WHERE terrain_id = ? ORDER BY id", (row["id"],)).fetchall()
    landforms = connection.execute("SELECT * FROM landform_instance WHERE terrain_id = ? ORDER BY id", (row["id"],))
    return Terrain(
        name=row["name"],
        heights=heights,
        posting_x=row["posting_x"],
        posting_y=row["posting_y"],
        x_west=row["x_west"],
        y_north=row["y_north"],
        soil=soils[row["soil_id"]]["name"],
        soils=tuple(
            Soil(name=soil["name"], **{column: soil[column] for column in SOIL_COLUMNS}) for key, soil in soils.items() if key in used
        ),
        pairs=tuple(
            MaterialPair(
                response=p["response"],
                material=materials.get(p["material_id"]),
                other_material=materials.get(p["other_material_id"]),
                soil=None if p["soil_id"] is None else soils[p["soil_id"]]["name"],
                friction=p["friction"],
                restitution=p["restitution"],
            )
            for p in (*pairs, *rigid)
            if p["soil_id"] is None or p["soil_id"] in used
        ),
        patches=tuple(
            SoilPatch(
                name=p["name"],
                soil=soils[p["soil_id"]]["name"],
                polygon=tuple((x, y) for x, y in json.loads(p["polygon"])),
            )
            for p in patches
        ),
        landforms=tuple(
            LandformInstance(
                name=r["name"],
                landform=r["landform"],
                x=r["x"],
                y=r["y"],
                heading=r["heading"],
                drivers=json.loads(r["drivers"]),
            )
            for r in landforms
        ),
        obstacles=tuple(
            Obstacle(
                name=r["name"],
                material=materials.get(r["material_id"]),
                **read_shape(r),
            )
            for r in obstacles
        ),
        materials=tuple(
            read_material(r)
            for r in connection.execute(
                "SELECT * FROM material WHERE id IN (SELECT material_id FROM obstacle WHERE terrain_id = ?)", (row["id"],)
            )
        ),
        crs=row["crs"],
        map_origin=(row["map_x"], row["map_y"], row["map_z"]),
        source=row["source"],
        sources=read_sources(connection, f"terrain {row['name']}"),
    )
