-- Layers and levels of detail of terrain tiles; turned maps; scaled, aged landforms with soils, and populations of them.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name

ALTER TABLE terrain RENAME TO old_terrain;
CREATE TABLE terrain (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  soil_id INTEGER NOT NULL REFERENCES soil(id),                     -- [-] soil where no patch lies
  n_rows INTEGER NOT NULL CHECK (n_rows >= 2),                      -- [-] number of height values from north to south; n values bound n-1 cells
  n_cols INTEGER NOT NULL CHECK (n_cols >= 2),                      -- [-] number of height values from west to east
  posting_x REAL NOT NULL CHECK (posting_x > 0),                    -- [m] distance of neighbouring columns
  posting_y REAL NOT NULL CHECK (posting_y > 0),                    -- [m] distance of neighbouring rows
  x_west REAL NOT NULL,                                             -- [m] x in W of column 0
  y_north REAL NOT NULL,                                            -- [m] y in W of row 0, the northernmost
  crs TEXT NOT NULL DEFAULT '',                                     -- [-] projection (WKT or authority code) of map coordinates
  map_x REAL NOT NULL DEFAULT 0,                                    -- [m] map easting of the origin of W
  map_y REAL NOT NULL DEFAULT 0,                                    -- [m] map northing of the origin of W
  map_z REAL NOT NULL DEFAULT 0,                                    -- [m] map height of z = 0 in W
  map_heading REAL NOT NULL DEFAULT 0,                              -- [rad] turn of W's x against map east, from east towards north
  source TEXT NOT NULL DEFAULT ''                                   -- [-] where the heights come from
) STRICT;
INSERT INTO terrain (id, name, soil_id, n_rows, n_cols, posting_x, posting_y, x_west, y_north, crs, map_x, map_y, map_z, source)
SELECT id, name, soil_id, n_rows, n_cols, posting_x, posting_y, x_west, y_north, crs, map_x, map_y, map_z, source FROM old_terrain;
DROP TABLE old_terrain;

ALTER TABLE terrain_tile RENAME TO old_terrain_tile;
CREATE TABLE terrain_tile (
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  layer TEXT NOT NULL CHECK (layer IN ('height', 'soil', 'filled')),  -- [-] height: surface in W; soil: soil.id, absent = terrain.soil_id; filled: 1 where the base had no height, absent = 0
  level INTEGER NOT NULL DEFAULT 0 CHECK (level BETWEEN 0 AND 30),  -- [-] level of detail: 0 = everything, k = every 2^k-th value of rows and columns from 0 on
  row0 INTEGER NOT NULL CHECK (row0 >= 0),                          -- [-] first row of the tile, counted from the north in rows of its level
  col0 INTEGER NOT NULL CHECK (col0 >= 0),                          -- [-] first column of the tile, counted from the west in columns of its level
  n_rows INTEGER NOT NULL CHECK (n_rows >= 1),                      -- [-] rows in the tile
  n_cols INTEGER NOT NULL CHECK (n_cols >= 1),                      -- [-] columns in the tile
  dtype TEXT NOT NULL CHECK (dtype IN ('float32', 'float64', 'uint8', 'int32')),  -- [-] type of the values, little endian
  data BLOB NOT NULL,                                               -- [m or -] values, row by row, row 0 north; heights: NaN = no value
  PRIMARY KEY (terrain_id, layer, level, row0, col0),
  CHECK (length(data) = n_rows * n_cols * CASE dtype WHEN 'uint8' THEN 1 WHEN 'float64' THEN 8 ELSE 4 END),
  CHECK ((layer = 'height') = (dtype IN ('float32', 'float64')))
) STRICT;
INSERT INTO terrain_tile (terrain_id, layer, row0, col0, n_rows, n_cols, dtype, data)
SELECT terrain_id, layer, row0, col0, n_rows, n_cols, dtype, data FROM old_terrain_tile;
DROP TABLE old_terrain_tile;

ALTER TABLE landform_instance RENAME TO old_landform_instance;
CREATE TABLE landform_population (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  name TEXT NOT NULL CHECK (length(name) > 0),                      -- [-] identifier in the scene
  landform TEXT NOT NULL,                                           -- [-] registered name of what it consists of
  law TEXT NOT NULL DEFAULT '{}' CHECK (json_valid(law)),           -- [SI] JSON object: the law it was drawn from, with its numbers, region and seed
  digest TEXT NOT NULL DEFAULT '',                                  -- [-] SHA-256 of its members, so that an unchanged one is not written again
  UNIQUE (terrain_id, name)
) STRICT;

CREATE TABLE landform_instance (
  id INTEGER PRIMARY KEY,                                           -- [-] key; of equal age, later ones lie on earlier ones
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  name TEXT NOT NULL,                                               -- [-] identifier in the scene; members of a population have its name
  landform TEXT NOT NULL,                                           -- [-] registered name
  x REAL NOT NULL,                                                  -- [m] origin of the landform's frame in W
  y REAL NOT NULL,                                                  -- [m] origin of the landform's frame in W
  heading REAL NOT NULL DEFAULT 0,                                  -- [rad] turn about z from x towards y
  scale REAL NOT NULL DEFAULT 1 CHECK (scale > 0),                  -- [-] enlargement in all directions
  soil_id INTEGER REFERENCES soil(id),                              -- [-] soil of its surface; absent = that of the ground
  age REAL,                                                         -- [-] order in time: the older lie below the younger; absent = youngest
  population_id INTEGER REFERENCES landform_population(id) ON DELETE CASCADE,  -- [-] population that it belongs to; absent = placed by itself
  drivers TEXT NOT NULL CHECK (json_valid(drivers))                 -- [SI] JSON object: driver -> value
) STRICT;

CREATE UNIQUE INDEX placed_landform ON landform_instance (terrain_id, name) WHERE population_id IS NULL;
INSERT INTO landform_instance (id, terrain_id, name, landform, x, y, heading, drivers)
SELECT id, terrain_id, name, landform, x, y, heading, drivers FROM old_landform_instance;
DROP TABLE old_landform_instance;

PRAGMA legacy_alter_table = OFF;
