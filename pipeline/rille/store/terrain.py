"""Terrain and soil values <-> rows."""

import hashlib
import json
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import (
    InputRefused,
    LandformInstance,
    MaterialPair,
    Obstacle,
    Population,
    Soil,
    SoilPatch,
    Terrain,
    nearest_names,
)
from rille.model.polygon import soil_codes, soil_names
from rille.store.database import insert, reading, update, writing
from rille.store.forget import forget_scenarios
from rille.store.rover import read_material, read_shape, read_sources, shape_columns, write_material, write_sources
from rille.store.tiles import TILE, Slices, StoredLayer, Values, write_tiles

SOIL_COLUMNS = tuple(name for name in Soil.__dataclass_fields__ if name != "name")  # the table holds what the value holds
GRID_COLUMNS = ("n_rows", "n_cols", "posting_x", "posting_y", "x_west", "y_north")

Progress = Callable[[str, float], None]


def write_terrain(path: Path, terrain: Terrain, *, replace: bool = False, progress: Progress | None = None) -> None:
    """Put a terrain with its soils into the database, in place of one of the same name.

    Heights are read window by window, so ``terrain.heights`` may be larger than memory. Soils are shared by all terrains of a
    database: a soil of the same name must have the same values.

    Raises
    ------
    InputRefused : if a scenario uses the present terrain of that name and ``replace`` is false (true deletes those scenarios
        and their runs), if a soil is missing or differs, or if a value breaks a rule of the schema.
    """
    with writing(path) as connection:
        _free(connection, path, terrain.name, replace)
        connection.execute("DELETE FROM terrain WHERE name = ?", (terrain.name,))
        soils = _write_matter(connection, terrain)
        key = insert(connection, "terrain", f"terrain '{terrain.name}'", _grid_row(terrain, soils))
        _write_tiles(connection, key, terrain, soils, None, progress)
        _write_features(connection, key, terrain, soils)


def update_terrain(
    path: Path, terrain: Terrain, windows: Sequence[Slices], *, replace: bool = False, progress: Progress | None = None
) -> int:
    """Bring a stored terrain to a changed one of the same name and grid, rewriting only the tiles that meet a changed window.

    Parameters
    ----------
    windows : (rows, columns) slices outside of which heights and marks of filled values are as they were. Soils are compared here.

    Returns
    -------
    Number of tiles written, all levels and layers.

    Raises
    ------
    InputRefused : if there is no terrain of that name or its grid is another one (then ``write_terrain``), and as that function.
    """
    with writing(path) as connection:
        present = connection.execute("SELECT * FROM terrain WHERE name = ?", (terrain.name,)).fetchone()
        if present is None:
            raise InputRefused(f"'{path}' has no terrain '{terrain.name}' to update; write it as a whole")
        for column, value in _grid_row(terrain, None).items():
            if column in GRID_COLUMNS and present[column] != value:
                raise InputRefused(
                    f"terrain '{terrain.name}' in '{path}' has {column} = {present[column]}, not {value}; write it as a whole"
                )
        _free(connection, path, terrain.name, replace)
        key = present["id"]
        connection.execute("DELETE FROM obstacle WHERE terrain_id = ?", (key,))  # written anew, and of materials that may have changed
        soils = _write_matter(connection, terrain)
        before = _read_patches(connection, key)
        row = _grid_row(terrain, soils)
        update(connection, "terrain", f"terrain '{terrain.name}'", key, row)
        held = connection.execute(
            "SELECT max(n_rows) AS n, max(row0 % ?) AS r FROM terrain_tile WHERE terrain_id = ?", (TILE, key)
        ).fetchone()
        same_tiles = held["n"] is not None and held["n"] <= TILE and held["r"] == 0
        layers = {"height", "filled"}
        if row["soil_id"] != present["soil_id"] or before != terrain.patches or not same_tiles:
            connection.execute("DELETE FROM terrain_tile WHERE terrain_id = ? AND layer = 'soil'", (key,))
            _write_tiles(connection, key, terrain, soils, None, progress, {"soil"})
        if not same_tiles:  # tiles of an older rille
            connection.execute("DELETE FROM terrain_tile WHERE terrain_id = ? AND layer <> 'soil'", (key,))
        touched = _write_tiles(connection, key, terrain, soils, windows if same_tiles else None, progress, layers)
        _write_features(connection, key, terrain, soils)
        return touched


def _free(connection: sqlite3.Connection, path: Path, name: str, replace: bool) -> None:
    """Remove what depends on the terrain of that name, if that is allowed."""
    users = connection.execute(
        "SELECT scenario.name AS name FROM scenario JOIN terrain ON terrain.id = terrain_id WHERE terrain.name = ?", (name,)
    ).fetchall()
    if users and not replace:
        raise InputRefused(
            f"terrain '{name}' in '{path}' is used by scenario '{users[0]['name']}'; "
            "choose another name, or --force to delete that scenario and its runs"
        )
    forget_scenarios(connection, "SELECT scenario.id FROM scenario JOIN terrain ON terrain.id = terrain_id WHERE terrain.name = ?", (name,))


def _write_matter(connection: sqlite3.Connection, terrain: Terrain) -> dict[str, int]:
    """Soils, materials and pairs; returns the keys of the soils by name."""
    soils = {soil.name: write_soil(connection, soil) for soil in terrain.soils}
    for material in terrain.materials:
        write_material(connection, material)
    for pair in terrain.pairs:
        _write_pair(connection, pair, soils)
    return soils


def _write_features(connection: sqlite3.Connection, key: int, terrain: Terrain, soils: dict[str, int]) -> None:
    """Everything that stands on the grid, in place of what stood there."""
    for table in ("soil_patch", "obstacle"):
        connection.execute(f"DELETE FROM {table} WHERE terrain_id = ?", (key,))
    connection.execute("DELETE FROM landform_instance WHERE terrain_id = ? AND population_id IS NULL", (key,))
    connection.execute("DELETE FROM provenance WHERE subject = ?", (f"terrain {terrain.name}",))
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
        subject = f"landform '{landform.name}'"
        row = {
            "terrain_id": key,
            "name": landform.name,
            "landform": landform.landform,
            "x": landform.x,
            "y": landform.y,
            "heading": landform.heading,
            "scale": landform.scale,
            "soil_id": _soil_key(soils, landform.soil, subject) if landform.soil else None,
            "age": landform.age,
            "drivers": json.dumps(landform.drivers, sort_keys=True),
        }
        insert(connection, "landform_instance", subject, row)
    _write_populations(connection, key, terrain.populations)
    for obstacle in terrain.obstacles:
        _write_obstacle(connection, obstacle, key)
    write_sources(connection, terrain.sources)


def _write_populations(connection: sqlite3.Connection, key: int, populations: Sequence[Population]) -> None:
    """Populations and their members in their order; those before the first that differs from what is stored are left as they are."""
    stored = connection.execute("SELECT id, name, digest FROM landform_population WHERE terrain_id = ? ORDER BY id", (key,)).fetchall()
    wanted = [(population.name, _digest(population)) for population in populations]
    same = 0
    while same < min(len(stored), len(wanted)) and (stored[same]["name"], stored[same]["digest"]) == wanted[same]:
        same += 1
    for row in stored[same:]:
        connection.execute("DELETE FROM landform_instance WHERE terrain_id = ? AND population_id = ?", (key, row["id"]))
        connection.execute("DELETE FROM landform_population WHERE id = ?", (row["id"],))
    for population, (_, digest) in list(zip(populations, wanted, strict=True))[same:]:
        subject = f"population '{population.name}'"
        row = {
            "terrain_id": key,
            "name": population.name,
            "landform": population.landform,
            "law": json.dumps(population.law, sort_keys=True),
            "digest": digest,
        }
        group = insert(connection, "landform_population", subject, row)
        names = list(population.drivers)
        template = "{" + ", ".join(json.dumps(name).replace("%", "%%") + ": %r" for name in names) + "}"
        columns = (population.x, population.y, population.heading, *(population.drivers[name] for name in names))
        members = zip(*(np.asarray(column, np.float64).tolist() for column in columns), strict=True)
        try:
            connection.executemany(
                "INSERT INTO landform_instance (terrain_id, name, landform, scale, x, y, heading, population_id, drivers) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    (key, population.name, population.landform, population.scale, x, y, h, group, template % tuple(v))
                    for x, y, h, *v in members
                ),
            )
        except sqlite3.IntegrityError as error:
            raise InputRefused(f"{subject} has a member with a place or driver that is no finite number ({error})") from error


def _digest(population: Population) -> str:
    """SHA-256 of everything that a population is."""
    found = hashlib.sha256(
        json.dumps([population.landform, population.law, population.scale, list(population.drivers)], sort_keys=True).encode()
    )
    for column in (population.x, population.y, population.heading, *population.drivers.values()):
        found.update(np.ascontiguousarray(column, "<f8").tobytes())
    return found.hexdigest()


def write_soil(connection: sqlite3.Connection, soil: Soil) -> int:
    """Key of the soil in a database that is open already; one of that name must have the same values."""
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


def _grid_row(terrain: Terrain, soils: dict[str, int] | None) -> dict[str, Any]:
    n_rows, n_cols = terrain.heights.shape
    return {
        "name": terrain.name,
        "soil_id": None if soils is None else _soil_key(soils, terrain.soil, f"terrain '{terrain.name}'"),
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
        "map_heading": terrain.map_heading,
        "source": terrain.source,
    }


def _write_tiles(
    connection: sqlite3.Connection,
    key: int,
    terrain: Terrain,
    soils: dict[str, int],
    windows: Sequence[Slices] | None,
    progress: Progress | None,
    layers: set[str] | None = None,
) -> int:
    """Tiles of the layers asked for (default: all) that meet the windows (None: all)."""
    n_rows, n_cols = terrain.heights.shape
    say = progress or (lambda what, fraction: None)
    layers = layers or {"height", "soil", "filled"}
    base = _soil_key(soils, terrain.soil, f"terrain '{terrain.name}'")
    names = soil_names(terrain.soil, terrain.patches)
    keys = np.array([_soil_key(soils, name, "a soil patch") for name in names], np.int32)
    x = terrain.x_west + np.arange(n_cols, dtype=np.float64) * terrain.posting_x
    y = terrain.y_north - np.arange(n_rows, dtype=np.float64) * terrain.posting_y

    def heights(rows: slice, columns: slice) -> Values:
        return terrain.heights[rows, columns]

    def soil(rows: slice, columns: slice) -> Values:
        return keys[soil_codes(terrain.soil, terrain.patches, x[columns], y[rows])]

    def filled(rows: slice, columns: slice) -> Values:
        assert terrain.filled is not None
        return np.asarray(terrain.filled[rows, columns], np.uint8)

    touched = 0
    for layer, source, default, dtype, wanted in (
        ("height", heights, float("nan"), "float64", True),
        ("soil", soil, base, "uint8" if keys.max() < 256 else "int32", len(names) > 1),
        ("filled", filled, 0, "uint8", terrain.filled is not None),
    ):
        if layer not in layers:
            continue
        if not wanted:
            connection.execute("DELETE FROM terrain_tile WHERE terrain_id = ? AND layer = ?", (key, layer))
            continue
        touched += write_tiles(
            connection,
            key,
            layer,
            (n_rows, n_cols),
            source,
            default=default,
            dtype=dtype,
            windows=windows,
            progress=lambda fraction, layer=layer: say(f"storing {layer}", fraction),
        )
    return touched


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredWindow:
    """Part of a layer of a stored terrain. values : (n_rows, n_cols). x (n_cols,), y (n_rows,) descending [m] in W.

    soils : names by the numbers in ``values``, for the layer ``soil``.
    """

    values: NDArray[Any]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    soils: dict[int, str]


def read_window(
    path: Path,
    name: str | None = None,
    *,
    layer: Literal["height", "soil", "filled"] = "height",
    level: int = 0,
    rows: slice = slice(None),
    columns: slice = slice(None),
) -> StoredWindow:
    """Read a window of a layer at a level of detail: what a viewer needs.

    Parameters
    ----------
    name : of the terrain; None: the only one. level : k holds every 2^k-th value. rows, columns : counted in that level.

    Raises
    ------
    InputRefused : as ``read_terrain``.
    """
    with reading(path) as connection:
        row = _find(connection, path, name)
        soils = dict(connection.execute("SELECT id, name FROM soil").fetchall()) if layer == "soil" else {}
    default = {"height": float("nan"), "soil": row["soil_id"], "filled": 0}[layer]
    stored = StoredLayer(path, row["id"], layer, (row["n_rows"], row["n_cols"]), level=level, default=default)
    (r0, r1, _), (c0, c1, _) = rows.indices(stored.shape[0]), columns.indices(stored.shape[1])
    return StoredWindow(
        values=stored[rows, columns],
        x=row["x_west"] + np.arange(c0, c1, dtype=np.float64) * row["posting_x"] * (1 << level),
        y=row["y_north"] - np.arange(r0, r1, dtype=np.float64) * row["posting_y"] * (1 << level),
        soils=soils,
    )


def read_terrain(path: Path, name: str | None = None, *, heights: bool = True) -> Terrain:
    """Read a terrain; without a name, the only one.

    heights : False leaves heights in the database: ``terrain.heights`` then has ``.shape`` and reads the windows that it is
    indexed with by two slices.

    Raises
    ------
    InputRefused : if there is none, none of that name, or several and no name was given.
    """
    with reading(path) as connection:
        row = _find(connection, path, name)
        shape = (row["n_rows"], row["n_cols"])
        stored = StoredLayer(path, row["id"], "height", shape)
        filled = None
        if connection.execute("SELECT 1 FROM terrain_tile WHERE terrain_id = ? AND layer = 'filled' LIMIT 1", (row["id"],)).fetchone():
            filled = StoredLayer(path, row["id"], "filled", shape, default=0)
        if heights:
            return _read(connection, row, stored[:, :], None if filled is None else filled[:, :].astype(bool))
        return _read(connection, row, stored, filled)


def _find(connection: sqlite3.Connection, path: Path, name: str | None) -> sqlite3.Row:
    rows = {r["name"]: r for r in connection.execute("SELECT * FROM terrain ORDER BY id")}
    if not rows:
        raise InputRefused(f"'{path}' has no terrain; add one: `rille terrain build SCENE.toml -o {quote(str(path))}`")
    if name is None and len(rows) > 1:
        raise InputRefused(f"'{path}' has several terrains; name one, {nearest_names('', rows)}")
    if name is not None and name not in rows:
        raise InputRefused(f"'{path}' has no terrain '{name}'; {nearest_names(name, rows)}")
    return rows[name] if name is not None else next(iter(rows.values()))


def read_soils(path: Path) -> tuple[Soil, ...]:
    """All soils of a database."""
    with reading(path) as connection:
        rows = connection.execute("SELECT * FROM soil ORDER BY id").fetchall()
        return tuple(Soil(name=r["name"], **{column: r[column] for column in SOIL_COLUMNS}) for r in rows)


def _read_patches(connection: sqlite3.Connection, key: int) -> tuple[SoilPatch, ...]:
    rows = connection.execute(
        "SELECT soil_patch.name AS name, soil.name AS soil, polygon FROM soil_patch JOIN soil ON soil.id = soil_id WHERE terrain_id = ? "
        "ORDER BY soil_patch.id",
        (key,),
    )
    return tuple(SoilPatch(name=r["name"], soil=r["soil"], polygon=tuple((x, y) for x, y in json.loads(r["polygon"]))) for r in rows)


def _read_populations(connection: sqlite3.Connection, key: int) -> tuple[Population, ...]:
    populations = []
    for row in connection.execute("SELECT * FROM landform_population WHERE terrain_id = ? ORDER BY id", (key,)).fetchall():
        members = connection.execute(
            "SELECT x, y, heading, scale, drivers FROM landform_instance WHERE terrain_id = ? AND population_id = ? ORDER BY id",
            (key, row["id"]),
        ).fetchall()
        places = np.array([tuple(m)[:3] for m in members], np.float64).reshape(-1, 3)
        drivers = json.loads("[" + ",".join(m["drivers"] for m in members) + "]")
        names = list(drivers[0]) if drivers else []
        populations.append(
            Population(
                name=row["name"],
                landform=row["landform"],
                x=places[:, 0].copy(),
                y=places[:, 1].copy(),
                heading=places[:, 2].copy(),
                drivers={name: np.array([d[name] for d in drivers], np.float64) for name in names},
                scale=members[0]["scale"] if members else 1.0,
                law=json.loads(row["law"]),
            )
        )
    return tuple(populations)


def _read(connection: sqlite3.Connection, row: sqlite3.Row, heights: Any, filled: Any) -> Terrain:
    soils = {r["id"]: r for r in connection.execute("SELECT * FROM soil ORDER BY id")}
    patches = _read_patches(connection, row["id"])
    landforms = connection.execute(
        "SELECT landform_instance.*, soil.name AS soil FROM landform_instance LEFT JOIN soil ON soil.id = soil_id "
        "WHERE terrain_id = ? AND population_id IS NULL ORDER BY landform_instance.id",
        (row["id"],),
    ).fetchall()
    names = {soils[row["soil_id"]]["name"], *(p.soil for p in patches), *(r["soil"] for r in landforms)}
    used = {key for key, soil in soils.items() if soil["name"] in names}
    materials = dict(connection.execute("SELECT id, name FROM material").fetchall())
    pairs = connection.execute("SELECT * FROM material_pair WHERE soil_id IS NOT NULL ORDER BY id").fetchall()
    rigid = connection.execute("SELECT * FROM material_pair WHERE soil_id IS NULL ORDER BY id").fetchall()
    obstacles = connection.execute("SELECT * FROM obstacle WHERE terrain_id = ? ORDER BY id", (row["id"],)).fetchall()
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
        patches=patches,
        landforms=tuple(
            LandformInstance(
                name=r["name"],
                landform=r["landform"],
                x=r["x"],
                y=r["y"],
                heading=r["heading"],
                scale=r["scale"],
                drivers=json.loads(r["drivers"]),
                soil=r["soil"] or "",
                age=r["age"],
            )
            for r in landforms
        ),
        populations=_read_populations(connection, row["id"]),
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
        map_heading=row["map_heading"],
        filled=filled,
        source=row["source"],
        sources=read_sources(connection, f"terrain {row['name']}"),
    )
