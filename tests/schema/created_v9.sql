-- rille's contract: the one place in the repository that creates tables.
--
-- Everything between the programs of rille crosses this schema. SI units and radians throughout. Each column ends in
-- "-- [unit] meaning" inside the parentheses: SQLite keeps that text, so the units travel in every file.
--
-- Frames. W: world, x forward/east, y left/north, z up (REP-103). M: model frame, the frame of the CAD assembly; every
-- pose, point and axis of the model is given in M at the zero pose, the pose in which the assembly was drawn. B: body
-- frame, parallel to M at the zero pose, origin at body.frame_*. Quaternions are (w, x, y, z), unit, Hamilton.
-- Values of provenance: stated (written by a person), measured, geometry (computed from B-rep), cad_material, default.

PRAGMA application_id = 1380535372;  -- "RILL"
PRAGMA user_version = 9;

-- ---------------------------------------------------------------- where values come from

CREATE TABLE provenance (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  subject TEXT NOT NULL,                                            -- [-] what was made: "rover", "terrain", "scenario"
  file TEXT NOT NULL,                                               -- [-] the file that it was read from
  sha256 TEXT NOT NULL CHECK (length(sha256) = 64),                 -- [-] digest of that file
  tool TEXT NOT NULL                                                -- [-] program and version that read it
) STRICT;

-- ---------------------------------------------------------------- materials and soils

CREATE TABLE material (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  density REAL NOT NULL CHECK (density > 0),                        -- [kg/m^3] mass per volume
  provenance TEXT NOT NULL CHECK (provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  source TEXT NOT NULL DEFAULT ''                                   -- [-] reference
) STRICT;

CREATE TABLE soil (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  sinkage_exponent REAL NOT NULL CHECK (sinkage_exponent BETWEEN 0.3 AND 3.0),  -- [-] n, pressure grows as sinkage^n
  cohesive_modulus REAL NOT NULL,                                   -- [N/m^(n+1)] Bekker kc; negative fits are published
  frictional_modulus REAL NOT NULL CHECK (frictional_modulus >= 0), -- [N/m^(n+2)] Bekker kphi
  cohesion REAL NOT NULL CHECK (cohesion >= 0),                     -- [Pa] c
  friction_angle REAL NOT NULL CHECK (friction_angle >= 0 AND friction_angle < 1.5707),  -- [rad] internal friction angle phi
  shear_modulus REAL NOT NULL CHECK (shear_modulus > 0),            -- [m] longitudinal shear deformation modulus K (kx)
  lateral_shear_modulus REAL NOT NULL CHECK (lateral_shear_modulus > 0),  -- [m] lateral shear deformation modulus ky
  peak_angle_offset REAL NOT NULL CHECK (peak_angle_offset BETWEEN 0 AND 1),  -- [-] a0 in theta_m = (a0 + a1 s) theta_f
  peak_angle_slip REAL NOT NULL CHECK (peak_angle_slip BETWEEN -1 AND 1),  -- [-] a1 in theta_m = (a0 + a1 s) theta_f
  exit_sinkage_ratio REAL NOT NULL DEFAULT 0 CHECK (exit_sinkage_ratio BETWEEN 0 AND 2),  -- [-] lambda in theta_r = -acos(1 - lambda z/r)
  density REAL NOT NULL CHECK (density > 0),                        -- [kg/m^3] bulk density
  damping REAL NOT NULL DEFAULT 30000 CHECK (damping >= 0),         -- [Pa s/m] pressure per speed of penetration
  reece_cohesive_modulus REAL,                                      -- [-] Reece kc'; absent = kc read at the wheel's width
  reece_frictional_modulus REAL,                                    -- [-] Reece kphi'; absent = kphi read at the wheel's width
  provenance TEXT NOT NULL CHECK (provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  source TEXT NOT NULL DEFAULT ''                                   -- [-] reference
) STRICT;

CREATE TABLE material_pair (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  material_id INTEGER REFERENCES material(id) ON DELETE CASCADE,    -- [-] first partner; absent = any material
  other_material_id INTEGER REFERENCES material(id) ON DELETE CASCADE,  -- [-] second partner of a rigid pair; absent without soil = any material
  soil_id INTEGER REFERENCES soil(id) ON DELETE CASCADE,            -- [-] second partner of a wheel-soil pair, or ground that is met as if rigid
  response TEXT NOT NULL CHECK (response IN ('rigid', 'bekker', 'bekker_wong', 'reece')),  -- [-] law of the contact
  friction REAL CHECK (friction >= 0),                              -- [-] Coulomb friction coefficient (rigid)
  restitution REAL CHECK (restitution BETWEEN 0 AND 1),             -- [-] ratio of normal speeds after and before impact (rigid)
  CHECK (other_material_id IS NULL OR soil_id IS NULL),
  CHECK (response = 'rigid' OR soil_id IS NOT NULL),           -- bekker, bekker_wong, reece need a soil; rigid: rocks, bedrock
  CHECK (response <> 'rigid' OR friction IS NOT NULL),
  UNIQUE (material_id, other_material_id, soil_id)
) STRICT;

-- ---------------------------------------------------------------- parts and moving bodies

CREATE TABLE part (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the prototype
  material_id INTEGER REFERENCES material(id),                      -- [-] material, if known
  brep_hash TEXT NOT NULL DEFAULT '',                               -- [-] digest of the exact geometry; the same shape, the same digest
  volume REAL NOT NULL CHECK (volume >= 0),                         -- [m^3] volume of its solids
  mass REAL NOT NULL CHECK (mass >= 0),                             -- [kg] mass of one instance; 0: only seen (free surfaces)
  com_x REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  com_y REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  com_z REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  ixx REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  iyy REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  izz REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  ixy REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x y dm
  ixz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x z dm
  iyz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int y z dm
  mass_provenance TEXT NOT NULL CHECK (mass_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  inertia_provenance TEXT NOT NULL CHECK (inertia_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  color TEXT NOT NULL DEFAULT '#9aa0a6' CHECK (color GLOB '#??????'),  -- [-] colour as #rrggbb
  CHECK (ixx >= 0 AND iyy >= 0 AND izz >= 0),  -- 0: a lumped mass
  CHECK (ixx <= (iyy + izz) * 1.000001 AND iyy <= (ixx + izz) * 1.000001 AND izz <= (ixx + iyy) * 1.000001)
) STRICT;

CREATE TABLE body (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the moving part
  frame_x REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the body frame in M
  frame_y REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the body frame in M
  frame_z REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the body frame in M
  mass REAL NOT NULL CHECK (mass > 0),                              -- [kg] total mass of its parts
  com_x REAL NOT NULL,                                              -- [m] centre of mass in M at the zero pose
  com_y REAL NOT NULL,                                              -- [m] centre of mass in M at the zero pose
  com_z REAL NOT NULL,                                              -- [m] centre of mass in M at the zero pose
  ixx REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, axes of M
  iyy REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, axes of M
  izz REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, axes of M
  ixy REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x y dm
  ixz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x z dm
  iyz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int y z dm
  mass_provenance TEXT NOT NULL CHECK (mass_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] weakest source among its parts
  inertia_provenance TEXT NOT NULL CHECK (inertia_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] weakest source among its parts
  CHECK (ixx > 0 AND iyy > 0 AND izz > 0),
  CHECK (ixx <= (iyy + izz) * 1.000001 AND iyy <= (ixx + izz) * 1.000001 AND izz <= (ixx + iyy) * 1.000001)
) STRICT;

CREATE TABLE part_instance (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  path TEXT NOT NULL UNIQUE CHECK (length(path) > 0),               -- [-] place in the assembly: "rover/rocker_left/wheel_front"
  part_id INTEGER NOT NULL REFERENCES part(id),                     -- [-] prototype
  body_id INTEGER REFERENCES body(id) ON DELETE SET NULL,           -- [-] moving part that it belongs to
  x REAL NOT NULL,                                                  -- [m] origin of the part's frame in M
  y REAL NOT NULL,                                                  -- [m] origin of the part's frame in M
  z REAL NOT NULL,                                                  -- [m] origin of the part's frame in M
  qw REAL NOT NULL DEFAULT 1,                                       -- [-] orientation of the part's frame in M
  qx REAL NOT NULL DEFAULT 0,                                       -- [-] orientation of the part's frame in M
  qy REAL NOT NULL DEFAULT 0,                                       -- [-] orientation of the part's frame in M
  qz REAL NOT NULL DEFAULT 0,                                       -- [-] orientation of the part's frame in M
  CHECK (abs(qw * qw + qx * qx + qy * qy + qz * qz - 1) < 1e-6)
) STRICT;

CREATE TABLE mesh (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  part_id INTEGER NOT NULL REFERENCES part(id) ON DELETE CASCADE,   -- [-] the prototype it pictures, in the part's frame
  purpose TEXT NOT NULL CHECK (purpose IN ('visual', 'collision')), -- [-] what it is for
  tolerance REAL NOT NULL CHECK (tolerance > 0),                    -- [m] largest distance from the exact surface
  n_vertices INTEGER NOT NULL CHECK (n_vertices >= 3),              -- [-] number of vertices
  n_triangles INTEGER NOT NULL CHECK (n_triangles >= 1),            -- [-] number of triangles
  vertices BLOB NOT NULL,                                           -- [m] float32 little endian, (n_vertices, 3)
  triangles BLOB NOT NULL,                                          -- [-] int32 little endian, (n_triangles, 3), counter-clockwise from outside
  CHECK (length(vertices) = 12 * n_vertices AND length(triangles) = 12 * n_triangles)
) STRICT;

CREATE TABLE collision_shape (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  body_id INTEGER NOT NULL REFERENCES body(id) ON DELETE CASCADE,   -- [-] moving part that carries it
  material_id INTEGER REFERENCES material(id),                      -- [-] material of its surface
  kind TEXT NOT NULL CHECK (kind IN ('box', 'sphere', 'cylinder', 'hull')),  -- [-] shape
  x REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  y REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  z REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  qw REAL NOT NULL DEFAULT 1,                                       -- [-] orientation in M; a cylinder's axis is its z
  qx REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in M
  qy REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in M
  qz REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in M
  size_x REAL CHECK (size_x > 0),                                   -- [m] box: full length along x; sphere, cylinder: radius
  size_y REAL CHECK (size_y > 0),                                   -- [m] box: full length along y
  size_z REAL CHECK (size_z > 0),                                   -- [m] box: full length along z; cylinder: full height
  vertices BLOB,                                                    -- [m] hull: float64 little endian, (n, 3), relative to the centre
  CHECK (abs(qw * qw + qx * qx + qy * qy + qz * qz - 1) < 1e-6),
  CHECK (kind <> 'hull' OR (vertices IS NOT NULL AND length(vertices) >= 96 AND length(vertices) % 24 = 0)),
  CHECK (kind = 'hull' OR size_x IS NOT NULL),
  CHECK (kind <> 'box' OR (size_y IS NOT NULL AND size_z IS NOT NULL)),
  CHECK (kind <> 'cylinder' OR size_z IS NOT NULL)
) STRICT;

-- ---------------------------------------------------------------- joints and drives

CREATE TABLE joint (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  kind TEXT NOT NULL CHECK (kind IN ('hinge', 'prismatic', 'fixed', 'spherical')),  -- [-] freedom
  parent_body_id INTEGER REFERENCES body(id),                       -- [-] carrier; absent = the world
  child_body_id INTEGER NOT NULL UNIQUE REFERENCES body(id),        -- [-] carried body; has one carrier
  x REAL NOT NULL,                                                  -- [m] a point on the axis in M at the zero pose
  y REAL NOT NULL,                                                  -- [m] a point on the axis in M at the zero pose
  z REAL NOT NULL,                                                  -- [m] a point on the axis in M at the zero pose
  axis_x REAL NOT NULL DEFAULT 0,                                   -- [-] unit axis in M; positive by the right-hand rule
  axis_y REAL NOT NULL DEFAULT 0,                                   -- [-] unit axis in M
  axis_z REAL NOT NULL DEFAULT 1,                                   -- [-] unit axis in M
  CHECK (parent_body_id IS NULL OR parent_body_id <> child_body_id),
  CHECK (abs(axis_x * axis_x + axis_y * axis_y + axis_z * axis_z - 1) < 1e-6)
) STRICT;

CREATE TABLE joint_limit (
  joint_id INTEGER PRIMARY KEY REFERENCES joint(id) ON DELETE CASCADE,  -- [-] hinge or prismatic joint
  lower REAL NOT NULL,                                              -- [rad or m] smallest position
  upper REAL NOT NULL,                                              -- [rad or m] largest position
  stiffness REAL CHECK (stiffness > 0),                             -- [N m/rad or N/m] of the stops; absent = rigid
  damping REAL CHECK (damping >= 0),                                -- [N m s/rad or N s/m] of the stops while pressed; absent = 0
  provenance TEXT NOT NULL CHECK (provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  CHECK (lower < upper),
  CHECK (damping IS NULL OR stiffness IS NOT NULL)
) STRICT;

CREATE TABLE drive (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  joint_id INTEGER NOT NULL UNIQUE REFERENCES joint(id),            -- [-] hinge or prismatic joint that it moves
  mode TEXT NOT NULL CHECK (mode IN ('speed', 'torque', 'position')),  -- [-] what a command sets
  max_torque REAL NOT NULL CHECK (max_torque > 0),                  -- [N m or N] largest effort at the joint
  max_speed REAL CHECK (max_speed > 0),                             -- [rad/s or m/s] largest commanded speed; absent = no bound
  position_gain REAL NOT NULL DEFAULT 5 CHECK (position_gain > 0),  -- [1/s] position mode: commanded speed per position error
  speed_gain REAL CHECK (speed_gain > 0),                           -- [N m s/rad or N s/m] effort per speed error; absent = holds the speed exactly up to max_torque
  integral_gain REAL NOT NULL DEFAULT 0 CHECK (integral_gain >= 0), -- [N m/rad or N/m] effort per integrated speed error; needs speed_gain
  torque_constant REAL CHECK (torque_constant > 0),                 -- [N m/A] effort at the joint per motor current; absent = unknown
  resistance REAL CHECK (resistance > 0),                           -- [ohm] resistance of the winding; absent = unknown
  provenance TEXT NOT NULL CHECK (provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  CHECK (integral_gain = 0 OR speed_gain IS NOT NULL)
) STRICT;

CREATE TABLE differential (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  carrier_body_id INTEGER NOT NULL REFERENCES body(id),             -- [-] carrier; both inputs are hinged to it
  joint_a_id INTEGER NOT NULL REFERENCES joint(id),                 -- [-] hinge carrier -> first input
  joint_b_id INTEGER NOT NULL REFERENCES joint(id),                 -- [-] hinge carrier -> second input
  CHECK (joint_a_id <> joint_b_id)                                  -- turns about a common direction: theta_a + theta_b = 2 theta_carrier
) STRICT;

CREATE TABLE gear (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  joint_a_id INTEGER NOT NULL REFERENCES joint(id),                 -- [-] first joint
  joint_b_id INTEGER NOT NULL REFERENCES joint(id),                 -- [-] second joint
  ratio REAL NOT NULL CHECK (ratio <> 0),                           -- [-] q_b = ratio q_a
  CHECK (joint_a_id <> joint_b_id)
) STRICT;

CREATE TABLE loop_closure (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  body_a_id INTEGER NOT NULL REFERENCES body(id),                   -- [-] first body
  body_b_id INTEGER REFERENCES body(id),                            -- [-] second body; absent = the world
  x REAL NOT NULL,                                                  -- [m] common point in M at the zero pose
  y REAL NOT NULL,                                                  -- [m] common point in M at the zero pose
  z REAL NOT NULL,                                                  -- [m] common point in M at the zero pose
  CHECK (body_b_id IS NULL OR body_a_id <> body_b_id)
) STRICT;

CREATE TABLE wheel (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  joint_id INTEGER NOT NULL UNIQUE REFERENCES joint(id),            -- [-] hinge that it turns on; its child is the wheel's body
  material_id INTEGER REFERENCES material(id),                      -- [-] material of the rim
  x REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  y REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  z REAL NOT NULL,                                                  -- [m] centre in M at the zero pose
  radius REAL NOT NULL CHECK (radius > 0),                          -- [m] radius of the rim, without grousers
  width REAL NOT NULL CHECK (width > 0)                             -- [m] width of the rim
) STRICT;

CREATE TABLE grouser (
  wheel_id INTEGER PRIMARY KEY REFERENCES wheel(id) ON DELETE CASCADE,  -- [-] wheel that carries them
  count INTEGER NOT NULL CHECK (count > 0),                         -- [-] number around the rim
  height REAL NOT NULL CHECK (height > 0),                          -- [m] height above the rim
  thickness REAL NOT NULL CHECK (thickness > 0)                     -- [m] thickness along the rim
) STRICT;

CREATE TABLE sensor (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  quantity TEXT NOT NULL CHECK (quantity LIKE '%.%'),               -- [-] what it measures: "joint.velocity"; the list is in schema/README.md
  target TEXT NOT NULL,                                             -- [-] name of the body, joint or wheel
  rate REAL NOT NULL CHECK (rate > 0),                              -- [Hz] samples per second
  frame TEXT NOT NULL DEFAULT 'world' CHECK (frame IN ('world', 'body'))  -- [-] axes in which vectors are given
) STRICT;

-- ---------------------------------------------------------------- terrain

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

CREATE TABLE soil_patch (
  id INTEGER PRIMARY KEY,                                           -- [-] key; where patches overlap, the larger key lies on top
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  soil_id INTEGER NOT NULL REFERENCES soil(id),                     -- [-] soil inside
  name TEXT NOT NULL,                                               -- [-] name
  polygon TEXT NOT NULL CHECK (json_valid(polygon))                 -- [m] JSON [[x, y], ...] in W, at least three corners, closed by itself
) STRICT;

CREATE TABLE obstacle (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  name TEXT NOT NULL CHECK (length(name) > 0),                      -- [-] name
  material_id INTEGER REFERENCES material(id),                      -- [-] material of its surface
  kind TEXT NOT NULL CHECK (kind IN ('box', 'sphere', 'cylinder', 'hull')),  -- [-] shape; it does not move
  x REAL NOT NULL,                                                  -- [m] centre in W
  y REAL NOT NULL,                                                  -- [m] centre in W
  z REAL NOT NULL,                                                  -- [m] centre in W
  qw REAL NOT NULL DEFAULT 1,                                       -- [-] orientation in W; a cylinder's axis is its z
  qx REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in W
  qy REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in W
  qz REAL NOT NULL DEFAULT 0,                                       -- [-] orientation in W
  size_x REAL CHECK (size_x > 0),                                   -- [m] box: full length along x; sphere, cylinder: radius
  size_y REAL CHECK (size_y > 0),                                   -- [m] box: full length along y
  size_z REAL CHECK (size_z > 0),                                   -- [m] box: full length along z; cylinder: full height
  vertices BLOB,                                                    -- [m] hull: float64 little endian, (n, 3), relative to the centre
  UNIQUE (terrain_id, name),
  CHECK (abs(qw * qw + qx * qx + qy * qy + qz * qz - 1) < 1e-6),
  CHECK (kind <> 'hull' OR (vertices IS NOT NULL AND length(vertices) >= 96 AND length(vertices) % 24 = 0)),
  CHECK (kind = 'hull' OR size_x IS NOT NULL),
  CHECK (kind <> 'box' OR (size_y IS NOT NULL AND size_z IS NOT NULL)),
  CHECK (kind <> 'cylinder' OR size_z IS NOT NULL)
) STRICT;

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

-- ---------------------------------------------------------------- effects: physics beyond the base model

CREATE TABLE effect_kind (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the law
  family TEXT NOT NULL,                                             -- [-] wheel_soil, rolling, drive, body, sensor or expression
  target TEXT NOT NULL CHECK (target IN ('wheel', 'joint', 'body', 'sensor', 'terrain', 'world', 'any')),  -- [-] what it acts on
  passive INTEGER NOT NULL CHECK (passive IN (0, 1)),               -- [-] 1 = can only take energy out
  memory INTEGER NOT NULL CHECK (memory IN (0, 1)),                 -- [-] 1 = has a state that motion does not tell (a rut, a lag): what it does depends on what was before
  needs TEXT NOT NULL CHECK (needs IN ('', 'drive', 'grousers', 'soft_ground', 'gravity')),  -- [-] what must be there for it to act: a drive at the joint, grousers on the wheel, a soft ground, gravity
  channel TEXT NOT NULL,                                            -- [-] quantities that can reveal it, by commas
  equation TEXT NOT NULL,                                           -- [-] the law in one line, in the names of its parameters
  meaning TEXT NOT NULL,                                            -- [-] the physics in one sentence
  source TEXT NOT NULL                                              -- [-] reference
) STRICT;

CREATE TABLE effect_parameter (
  effect_kind_id INTEGER NOT NULL REFERENCES effect_kind(id) ON DELETE CASCADE,  -- [-] law
  name TEXT NOT NULL,                                               -- [-] name of the parameter
  unit TEXT NOT NULL,                                               -- [-] its SI unit
  amplitude INTEGER NOT NULL CHECK (amplitude IN (0, 1)),           -- [-] 1 = the effect vanishes where all such parameters are 0
  search TEXT NOT NULL CHECK (search IN ('local', 'scale', 'phase', 'order', 'place', 'time', 'fixed')),  -- [-] how diagnosis looks for it: from its usual value, over decades, around the circle, over whole numbers, over where or when the machine was; fixed: stays
  lower REAL NOT NULL,                                              -- [unit] smallest value
  upper REAL NOT NULL,                                              -- [unit] largest value
  typical REAL NOT NULL,                                            -- [unit] usual value where the effect is present; default of what is no amplitude
  spread REAL NOT NULL CHECK (spread > 0),                          -- [unit] 1 sigma of the prior around the usual value; of a scale how far up it reaches
  meaning TEXT NOT NULL,                                            -- [-] what it says
  PRIMARY KEY (effect_kind_id, name),
  CHECK (lower <= typical AND typical <= upper)
) STRICT;

CREATE TABLE effect (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  effect_kind_id INTEGER NOT NULL REFERENCES effect_kind(id),       -- [-] law
  target TEXT NOT NULL,                                             -- [-] name of the wheel, joint, body, sensor or terrain; '*' = every one
  parameters TEXT NOT NULL DEFAULT '{}' CHECK (json_valid(parameters))  -- [SI] JSON object: parameter -> value; absent amplitudes are 0
) STRICT;

-- ---------------------------------------------------------------- scenarios

CREATE TABLE scenario (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  terrain_id INTEGER REFERENCES terrain(id),                        -- [-] ground; absent = free space
  gravity_x REAL NOT NULL DEFAULT 0,                                -- [m/s^2] gravity in W
  gravity_y REAL NOT NULL DEFAULT 0,                                -- [m/s^2] gravity in W
  gravity_z REAL NOT NULL,                                          -- [m/s^2] gravity in W; Moon -1.625, Earth -9.80665
  duration REAL NOT NULL CHECK (duration > 0),                      -- [s] simulated time
  step REAL NOT NULL CHECK (step > 0 AND step <= 0.1),              -- [s] time step of the integration
  output_interval REAL NOT NULL CHECK (output_interval > 0),        -- [s] distance of stored states
  integrator TEXT NOT NULL DEFAULT 'auto' CHECK (integrator IN ('auto', 'semi_implicit_euler', 'rk4')),  -- [-] auto: rk4 while no constraint row is present
  placement TEXT NOT NULL CHECK (placement IN ('on_terrain', 'as_given')),  -- [-] on_terrain: height and tilt come from the ground under the wheels
  settle_time REAL NOT NULL DEFAULT 0 CHECK (settle_time >= 0),     -- [s] time to come to rest, drives held, before t = 0
  start_x REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the root body's frame in W
  start_y REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the root body's frame in W
  start_z REAL NOT NULL DEFAULT 0,                                  -- [m] origin of the root body's frame in W (as_given)
  start_qw REAL NOT NULL DEFAULT 1,                                 -- [-] orientation of the root body in W
  start_qx REAL NOT NULL DEFAULT 0,                                 -- [-] orientation of the root body in W
  start_qy REAL NOT NULL DEFAULT 0,                                 -- [-] orientation of the root body in W
  start_qz REAL NOT NULL DEFAULT 0,                                 -- [-] orientation of the root body in W
  start_vx REAL NOT NULL DEFAULT 0,                                 -- [m/s] velocity of the root body's origin in W
  start_vy REAL NOT NULL DEFAULT 0,                                 -- [m/s] velocity of the root body's origin in W
  start_vz REAL NOT NULL DEFAULT 0,                                 -- [m/s] velocity of the root body's origin in W
  start_wx REAL NOT NULL DEFAULT 0,                                 -- [rad/s] angular velocity of the root body in W
  start_wy REAL NOT NULL DEFAULT 0,                                 -- [rad/s] angular velocity of the root body in W
  start_wz REAL NOT NULL DEFAULT 0,                                 -- [rad/s] angular velocity of the root body in W
  steered_from TEXT NOT NULL DEFAULT '',                            -- [-] name of the scenario that was steered to give this one; empty = stated
  CHECK (output_interval >= step * 0.999999),
  CHECK (placement = 'as_given' OR terrain_id IS NOT NULL),
  CHECK (abs(start_qw * start_qw + start_qx * start_qx + start_qy * start_qy + start_qz * start_qz - 1) < 1e-6)
) STRICT;

CREATE TABLE initial_state (
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  joint_id INTEGER NOT NULL REFERENCES joint(id) ON DELETE CASCADE, -- [-] hinge or prismatic joint
  position REAL NOT NULL DEFAULT 0,                                 -- [rad or m] position at t = 0
  velocity REAL NOT NULL DEFAULT 0,                                 -- [rad/s or m/s] velocity at t = 0
  PRIMARY KEY (scenario_id, joint_id)
) STRICT;

CREATE TABLE command (
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  drive_id INTEGER NOT NULL REFERENCES drive(id) ON DELETE CASCADE, -- [-] drive
  time REAL NOT NULL CHECK (time >= 0),                             -- [s] holds from this time until the next command
  value REAL NOT NULL,                                              -- [rad/s, rad or N m] set value, by the mode of the drive
  PRIMARY KEY (scenario_id, drive_id, time)
) STRICT;

CREATE TABLE state_change (
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  number INTEGER NOT NULL CHECK (number >= 1),                      -- [-] order; the numbers of one change share it
  component INTEGER NOT NULL DEFAULT 0 CHECK (component BETWEEN 0 AND 3),  -- [-] which number of a vector
  time REAL NOT NULL CHECK (time >= 0),                             -- [s] at the beginning of the step that begins then
  quantity TEXT NOT NULL CHECK (quantity IN ('joint.position', 'joint.velocity', 'part.position', 'part.orientation', 'part.linear_velocity', 'part.angular_velocity')),  -- [-] what is put elsewhere
  target TEXT NOT NULL,                                             -- [-] name of the joint, or of the body that no joint carries
  value REAL NOT NULL,                                              -- [SI] new value, in W
  PRIMARY KEY (scenario_id, number, component)
) STRICT;

CREATE TABLE watch (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  name TEXT NOT NULL CHECK (length(name) > 0),                      -- [-] name
  event TEXT,                                                       -- [-] kind of event that it waits for: "stuck"; absent = a quantity is compared
  quantity TEXT CHECK (quantity LIKE '%.%'),                        -- [-] quantity that is compared, as of a sensor: "part.position"
  component INTEGER NOT NULL DEFAULT 0 CHECK (component BETWEEN 0 AND 3),  -- [-] which number of a vector
  target TEXT NOT NULL DEFAULT '',                                  -- [-] name of the body, joint or wheel; empty = any
  above REAL,                                                       -- [SI] happens while the quantity is above this
  below REAL,                                                       -- [SI] happens while the quantity is below this
  hold REAL NOT NULL DEFAULT 0 CHECK (hold >= 0),                   -- [s] for so long without a break
  action TEXT NOT NULL CHECK (action IN ('mark', 'stop', 'command')),  -- [-] mark: an event; stop: ends the run; command: sets a drive
  drive_id INTEGER REFERENCES drive(id) ON DELETE CASCADE,          -- [-] command: drive
  value REAL,                                                       -- [rad/s, rad or N m] command: set value
  CHECK ((event IS NULL) <> (quantity IS NULL)),
  CHECK (quantity IS NULL OR above IS NOT NULL OR below IS NOT NULL),
  CHECK ((action = 'command') = (drive_id IS NOT NULL AND value IS NOT NULL)),
  UNIQUE (scenario_id, name)
) STRICT;

-- ---------------------------------------------------------------- results

CREATE TABLE run (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  solver TEXT NOT NULL,                                             -- [-] program and version
  step REAL NOT NULL CHECK (step > 0),                              -- [s] time step that was used
  duration REAL CHECK (duration > 0),                               -- [s] simulated time that it was to take; absent: until it was ended, or not known
  status TEXT NOT NULL CHECK (status IN ('running', 'done', 'stopped', 'interrupted', 'left_terrain', 'wheel_buried', 'diverged')),  -- [-] outcome
  time_reached REAL NOT NULL DEFAULT 0,                             -- [s] simulated time so far
  message TEXT NOT NULL DEFAULT ''                                  -- [-] the outcome in a sentence
) STRICT;

CREATE TABLE body_state (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  body_id INTEGER NOT NULL REFERENCES body(id),                     -- [-] moving part
  x REAL NOT NULL,                                                  -- [m] origin of the body frame in W
  y REAL NOT NULL,                                                  -- [m] origin of the body frame in W
  z REAL NOT NULL,                                                  -- [m] origin of the body frame in W
  qw REAL NOT NULL,                                                 -- [-] orientation of the body frame in W
  qx REAL NOT NULL,                                                 -- [-] orientation of the body frame in W
  qy REAL NOT NULL,                                                 -- [-] orientation of the body frame in W
  qz REAL NOT NULL,                                                 -- [-] orientation of the body frame in W
  vx REAL NOT NULL,                                                 -- [m/s] velocity of that origin in W
  vy REAL NOT NULL,                                                 -- [m/s] velocity of that origin in W
  vz REAL NOT NULL,                                                 -- [m/s] velocity of that origin in W
  wx REAL NOT NULL,                                                 -- [rad/s] angular velocity in W
  wy REAL NOT NULL,                                                 -- [rad/s] angular velocity in W
  wz REAL NOT NULL,                                                 -- [rad/s] angular velocity in W
  PRIMARY KEY (run_id, time, body_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE joint_state (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  joint_id INTEGER NOT NULL REFERENCES joint(id),                   -- [-] hinge or prismatic joint
  position REAL NOT NULL,                                           -- [rad or m] zero at the CAD pose
  velocity REAL NOT NULL,                                           -- [rad/s or m/s] rate of the position
  effort REAL NOT NULL,                                             -- [N m or N] effort of its drive in the last step
  work REAL NOT NULL,                                               -- [J] work done by its drive since t = 0
  PRIMARY KEY (run_id, time, joint_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE wheel_state (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  wheel_id INTEGER NOT NULL REFERENCES wheel(id),                   -- [-] wheel
  x REAL NOT NULL,                                                  -- [m] centre in W
  y REAL NOT NULL,                                                  -- [m] centre in W
  z REAL NOT NULL,                                                  -- [m] centre in W
  ground_height REAL NOT NULL,                                      -- [m] height of the undisturbed terrain below the centre
  slip_ratio REAL NOT NULL CHECK (slip_ratio BETWEEN -1 AND 1),     -- [-] 1 - v/(r w) driving, (r w)/v - 1 braking
  slip_angle REAL NOT NULL,                                         -- [rad] direction of travel against the wheel's plane, to the left positive
  sinkage REAL NOT NULL,                                            -- [m] depth of the lowest point of the rim; 0 in the air
  normal_load REAL NOT NULL,                                        -- [N] soil's force on the wheel along the ground's normal
  drawbar_pull REAL NOT NULL,                                       -- [N] soil's force on the wheel along its heading (forward in M)
  side_force REAL NOT NULL,                                         -- [N] soil's force on the wheel along its axle, to the left
  drive_torque REAL NOT NULL,                                       -- [N m] torque that the soil's shear asks of the axle; positive where it drives forward, whichever way the joint's axis points
  PRIMARY KEY (run_id, time, wheel_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE joint_reaction (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  joint_id INTEGER NOT NULL REFERENCES joint(id),                   -- [-] joint of any kind
  fx REAL NOT NULL,                                                 -- [N] force of the carrier on the carried body in W
  fy REAL NOT NULL,                                                 -- [N] force of the carrier on the carried body in W
  fz REAL NOT NULL,                                                 -- [N] force of the carrier on the carried body in W
  tx REAL NOT NULL,                                                 -- [N m] torque of the carrier on the carried body about the joint's point, in W
  ty REAL NOT NULL,                                                 -- [N m] torque of the carrier on the carried body about the joint's point, in W
  tz REAL NOT NULL,                                                 -- [N m] torque of the carrier on the carried body about the joint's point, in W
  PRIMARY KEY (run_id, time, joint_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE energy_state (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  kinetic REAL NOT NULL,                                            -- [J] kinetic energy
  potential REAL NOT NULL,                                          -- [J] potential energy, 0 at t = 0
  drive_work REAL NOT NULL,                                         -- [J] done by drives since t = 0
  soil_loss REAL NOT NULL,                                          -- [J] left in the soil since t = 0
  joint_loss REAL NOT NULL,                                         -- [J] lost in joints, limits and transmissions since t = 0
  contact_loss REAL NOT NULL,                                       -- [J] lost on rocks and rigid ground since t = 0
  external_work REAL NOT NULL,                                      -- [J] done by other forces (drag, tether, pulse) since t = 0
  residual REAL NOT NULL,                                           -- [J] what the balance leaves open: error of the integration
  PRIMARY KEY (run_id, time)
) STRICT, WITHOUT ROWID;

CREATE TABLE sensor_sample (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  sensor_id INTEGER NOT NULL REFERENCES sensor(id),                 -- [-] sensor
  time REAL NOT NULL,                                               -- [s] time by the sensor's own clock
  component INTEGER NOT NULL CHECK (component BETWEEN 0 AND 3),     -- [-] which number of a vector or quaternion
  value REAL NOT NULL,                                              -- [SI] what the sensor says
  PRIMARY KEY (run_id, sensor_id, time, component)
) STRICT, WITHOUT ROWID;

CREATE TABLE rut_tile (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  layer TEXT NOT NULL CHECK (layer IN ('sinkage', 'pressure')),     -- [-] sinkage [m]: largest depth below the undisturbed terrain; pressure [Pa]: largest normal stress there
  row0 INTEGER NOT NULL CHECK (row0 >= 0),                          -- [-] first row of the tile, counted from the north
  col0 INTEGER NOT NULL CHECK (col0 >= 0),                          -- [-] first column of the tile, counted from the west
  n_rows INTEGER NOT NULL CHECK (n_rows >= 1),                      -- [-] rows in the tile
  n_cols INTEGER NOT NULL CHECK (n_cols >= 1),                      -- [-] columns in the tile
  posting REAL NOT NULL CHECK (posting > 0),                        -- [m] distance of neighbouring values, both ways
  x_west REAL NOT NULL,                                             -- [m] x in W of column 0 of the whole grid
  y_north REAL NOT NULL,                                            -- [m] y in W of row 0 of the whole grid
  data BLOB NOT NULL,                                               -- [m or Pa] float32 little endian, row by row, row 0 north; 0 = untouched
  PRIMARY KEY (run_id, layer, row0, col0),
  CHECK (length(data) = 4 * n_rows * n_cols)
) STRICT;

CREATE TABLE checkpoint (
  run_id INTEGER PRIMARY KEY REFERENCES run(id) ON DELETE CASCADE,  -- [-] run
  step INTEGER NOT NULL CHECK (step >= 0),                          -- [-] number of steps taken
  model_hash TEXT NOT NULL,                                         -- [-] digest of the model, so that no other one is resumed
  data BLOB NOT NULL                                                -- [-] complete state of the solver, in its own format
) STRICT;

CREATE TABLE command_log (
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run that was steered
  number INTEGER NOT NULL CHECK (number >= 1),                      -- [-] order of arrival
  time REAL NOT NULL,                                               -- [s] simulated time at arrival
  received TEXT NOT NULL,                                           -- [-] when it came, UTC, ISO 8601
  sender TEXT NOT NULL,                                             -- [-] who gave it
  sequence INTEGER,                                                 -- [-] the sender's number of it
  request TEXT NOT NULL,                                            -- [-] what was asked, as JSON
  refused TEXT NOT NULL DEFAULT '',                                 -- [-] why it was refused; empty: it was done
  PRIMARY KEY (run_id, number)
) STRICT;

CREATE TABLE saved_state (
  name TEXT PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 64),      -- [-] name
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run that it was saved in
  step INTEGER NOT NULL CHECK (step >= 0),                          -- [-] number of steps taken
  time REAL NOT NULL CHECK (time >= 0),                             -- [s] simulated time
  data BLOB NOT NULL,                                               -- [-] complete state of the solver, in its own format
  model_hash TEXT NOT NULL DEFAULT ''                               -- [-] digest of rover, effects and ground, so that it is loaded into no others; empty: not known
) STRICT;

CREATE TABLE bench_point (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  bench TEXT NOT NULL,                                              -- [-] name of the series
  method TEXT NOT NULL CHECK (method IN ('quasi_static', 'dynamic', 'measured')),  -- [-] root of the integrals, simulated rig, or measured
  soil TEXT NOT NULL,                                               -- [-] soil
  response TEXT NOT NULL,                                           -- [-] wheel-soil law
  radius REAL NOT NULL CHECK (radius > 0),                          -- [m] wheel
  width REAL NOT NULL CHECK (width > 0),                            -- [m] wheel
  load REAL NOT NULL,                                               -- [N] vertical load
  slip_ratio REAL NOT NULL CHECK (slip_ratio BETWEEN -1 AND 1),     -- [-] slip ratio
  slip_angle REAL NOT NULL DEFAULT 0,                               -- [rad] direction of travel against the wheel's plane
  sinkage REAL,                                                     -- [m] sinkage
  drawbar_pull REAL,                                                -- [N] along the heading
  side_force REAL,                                                  -- [N] along the axle
  drive_torque REAL,                                                -- [N m] about the axle
  status TEXT NOT NULL DEFAULT 'done'                               -- [-] done, not_carried (sank to the axle) or not_settled
) STRICT;

CREATE TABLE event (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run
  time REAL NOT NULL,                                               -- [s] simulated time
  kind TEXT NOT NULL,                                               -- [-] name of what happened: "limit_reached"
  subject TEXT NOT NULL,                                            -- [-] name of the body, joint or wheel
  message TEXT NOT NULL                                             -- [-] sentence with the numbers
) STRICT;

-- ---------------------------------------------------------------- recordings and findings

CREATE TABLE recording (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  kind TEXT NOT NULL DEFAULT 'time' CHECK (kind IN ('time', 'points')),  -- [-] time: samples over time; points: steady points of a wheel bench, numbered 0, 1, 2 in place of the time
  scenario_id INTEGER REFERENCES scenario(id),                      -- [-] scenario that it was recorded in
  source TEXT NOT NULL DEFAULT '',                                  -- [-] file that it was read from
  digest TEXT NOT NULL DEFAULT '',                                  -- [-] SHA-256 of that file
  manifest TEXT NOT NULL DEFAULT '',                                -- [-] the manifest (TOML) that it was imported by
  setup TEXT NOT NULL DEFAULT '{}' CHECK (json_valid(setup)),       -- [-] JSON, points: wheel, soil, wheel-soil law and gravity of the bench
  status TEXT NOT NULL DEFAULT 'complete' CHECK (status IN ('importing', 'complete'))  -- [-] importing: interrupted; import again to go on
) STRICT;

CREATE TABLE clock (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  recording_id INTEGER NOT NULL REFERENCES recording(id) ON DELETE CASCADE,  -- [-] recording
  name TEXT NOT NULL,                                               -- [-] table or topic whose channels were sampled together
  UNIQUE (recording_id, name)
) STRICT;

CREATE TABLE clock_block (
  clock_id INTEGER NOT NULL REFERENCES clock(id) ON DELETE CASCADE, -- [-] clock
  block INTEGER NOT NULL CHECK (block >= 0),                        -- [-] number of the block; all but the last hold 4096 values
  n INTEGER NOT NULL CHECK (n BETWEEN 1 AND 4096),                  -- [-] values in the block
  first REAL NOT NULL,                                              -- [s] smallest time in the block
  last REAL NOT NULL,                                               -- [s] largest time in the block
  data BLOB NOT NULL,                                               -- [s] times in the recording, float64 little endian
  PRIMARY KEY (clock_id, block),
  CHECK (length(data) = 8 * n)
) STRICT;

CREATE TABLE channel (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  recording_id INTEGER NOT NULL REFERENCES recording(id) ON DELETE CASCADE,  -- [-] recording
  clock_id INTEGER NOT NULL REFERENCES clock(id) ON DELETE CASCADE, -- [-] clock that stamped its samples
  name TEXT NOT NULL,                                               -- [-] name of the column in the source
  quantity TEXT NOT NULL CHECK (quantity LIKE '%.%'),               -- [-] controlled vocabulary: "joint.velocity"
  component TEXT NOT NULL DEFAULT '' CHECK (component IN ('', 'x', 'y', 'z', 'w', 'roll', 'pitch', 'yaw')),  -- [-] which number of a vector or an orientation
  target TEXT NOT NULL,                                             -- [-] name in the model
  unit TEXT NOT NULL,                                               -- [-] SI unit of the stored values
  role TEXT NOT NULL CHECK (role IN ('observed', 'command', 'ignore')),  -- [-] use
  frame TEXT NOT NULL DEFAULT 'world' CHECK (frame IN ('world', 'body')),  -- [-] axes in which vectors are given
  noise REAL CHECK (noise > 0),                                     -- [unit] 1 sigma, if known; all of it, from sample to sample and slow
  slow_noise REAL CHECK (slow_noise > 0),                           -- [unit] 1 sigma of that part of the noise that varies slowly (coloured), if known
  delay REAL NOT NULL DEFAULT 0,                                    -- [s] observed: the value stamped t is that of t - delay; command: what is stamped t acts at t + delay
  resolution REAL CHECK (resolution > 0),                           -- [unit] step of the quantised values, if known
  UNIQUE (recording_id, name)
) STRICT;

CREATE TABLE sample_block (
  channel_id INTEGER NOT NULL REFERENCES channel(id) ON DELETE CASCADE,  -- [-] channel
  block INTEGER NOT NULL CHECK (block >= 0),                        -- [-] number of the block: its times are in the block of this number of the clock
  n INTEGER NOT NULL CHECK (n BETWEEN 1 AND 4096),                  -- [-] values in the block
  data BLOB NOT NULL,                                               -- [unit of the channel] values, float64 little endian; NaN = missing. View sample shows them by rows
  PRIMARY KEY (channel_id, block),
  CHECK (length(data) = 8 * n)
) STRICT;

CREATE TABLE correction (
  recording_id INTEGER NOT NULL REFERENCES recording(id) ON DELETE CASCADE,  -- [-] recording
  step INTEGER NOT NULL CHECK (step >= 1),                          -- [-] order in which the corrections were made at import
  kind TEXT NOT NULL,                                               -- [-] what was done: "scale", "sort"
  channel TEXT NOT NULL DEFAULT '',                                 -- [-] name of the channel or clock; empty = the whole recording
  detail TEXT NOT NULL DEFAULT '{}' CHECK (json_valid(detail)),     -- [-] JSON: the numbers
  reason TEXT NOT NULL DEFAULT '',                                  -- [-] why, as the manifest says
  PRIMARY KEY (recording_id, step)
) STRICT;

CREATE TABLE gate_finding (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  recording_id INTEGER NOT NULL REFERENCES recording(id) ON DELETE CASCADE,  -- [-] recording
  code TEXT NOT NULL,                                               -- [-] kind of finding: "stuck"
  severity TEXT NOT NULL CHECK (severity IN ('error', 'warning', 'note')),  -- [-] error: refused unless the manifest accepts its code
  channel TEXT NOT NULL DEFAULT '',                                 -- [-] name of the channel or clock; empty = the whole recording
  detail TEXT NOT NULL CHECK (json_valid(detail)),                  -- [-] JSON: value, bound, intervals, the other channel
  message TEXT NOT NULL                                             -- [-] sentence with the numbers and what to do next
) STRICT;

CREATE TABLE finding (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] what `rille apply` calls it: "diagnosis-1"
  created TEXT NOT NULL,                                            -- [-] when it was made, UTC, ISO 8601
  verdict TEXT NOT NULL CHECK (verdict IN ('nothing_missing', 'named', 'group', 'parameter', 'sensor_fault', 'unknown', 'cannot_know')),  -- [-] kind of answer
  target TEXT NOT NULL DEFAULT '',                                  -- [-] what is named, and of what: "coulomb_friction of hub_fl"
  probability REAL CHECK (probability BETWEEN 0 AND 1),             -- [-] calibrated probability
  sentence TEXT NOT NULL,                                           -- [-] the answer in words
  recording_id INTEGER REFERENCES recording(id) ON DELETE CASCADE,  -- [-] first of the recordings that were diagnosed
  recordings TEXT NOT NULL DEFAULT '[]' CHECK (json_valid(recordings)),  -- [-] JSON list: names of those that it was fitted to
  held_out TEXT NOT NULL DEFAULT '[]' CHECK (json_valid(held_out)), -- [-] JSON list: names of those that it was proved on
  setting TEXT NOT NULL DEFAULT '[]' CHECK (json_valid(setting)),   -- [SI] JSON list: terms that `rille apply` puts into the model
  detail TEXT NOT NULL CHECK (json_valid(detail))                   -- [-] JSON: every number behind the answer
) STRICT;
