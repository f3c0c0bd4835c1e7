-- Effects, obstacles, watches, sensors, gains, reactions, energies, ruts, checkpoints and bench points.
--
-- Tables whose CHECKs or comments change are made anew under their own text and filled from the old ones. The catalogue of effects was
-- empty in version 1 (its solver refused effects); `effects.sql` fills it after this step.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name

ALTER TABLE material_pair RENAME TO old_material_pair;
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
INSERT INTO material_pair (id, material_id, other_material_id, soil_id, response, friction, restitution)
SELECT id, material_id, other_material_id, soil_id, response, CASE response WHEN 'rigid' THEN coalesce(friction, 0.5) ELSE friction END, restitution
FROM old_material_pair;  -- rigid pairs must say their friction now
DROP TABLE old_material_pair;

ALTER TABLE drive RENAME TO old_drive;
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
INSERT INTO drive (id, name, joint_id, mode, max_torque, max_speed, position_gain, provenance)
SELECT id, name, joint_id, mode, max_torque, max_speed, position_gain, provenance FROM old_drive;
DROP TABLE old_drive;

ALTER TABLE sensor RENAME TO old_sensor;
CREATE TABLE sensor (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  quantity TEXT NOT NULL CHECK (quantity LIKE '%.%'),               -- [-] what it measures: "joint.velocity"; the list is in schema/README.md
  target TEXT NOT NULL,                                             -- [-] name of the body, joint or wheel
  rate REAL NOT NULL CHECK (rate > 0),                              -- [Hz] samples per second
  frame TEXT NOT NULL DEFAULT 'world' CHECK (frame IN ('world', 'body'))  -- [-] axes in which vectors are given
) STRICT;
INSERT INTO sensor (id, name, quantity, target, rate)
SELECT id, name, quantity, target, rate FROM old_sensor;
DROP TABLE old_sensor;

ALTER TABLE terrain_tile RENAME TO old_terrain_tile;
CREATE TABLE terrain_tile (
  terrain_id INTEGER NOT NULL REFERENCES terrain(id) ON DELETE CASCADE,  -- [-] terrain
  layer TEXT NOT NULL CHECK (layer IN ('height')),                  -- [-] height: surface in W; ruts belong to runs (rut_tile)
  row0 INTEGER NOT NULL CHECK (row0 >= 0),                          -- [-] first row of the tile, counted from the north
  col0 INTEGER NOT NULL CHECK (col0 >= 0),                          -- [-] first column of the tile, counted from the west
  n_rows INTEGER NOT NULL CHECK (n_rows >= 1),                      -- [-] rows in the tile
  n_cols INTEGER NOT NULL CHECK (n_cols >= 1),                      -- [-] columns in the tile
  dtype TEXT NOT NULL CHECK (dtype IN ('float32', 'float64')),      -- [-] type of the values, little endian
  data BLOB NOT NULL,                                               -- [m] values, row by row, row 0 north; NaN = no value
  PRIMARY KEY (terrain_id, layer, row0, col0),
  CHECK (length(data) = n_rows * n_cols * CASE dtype WHEN 'float32' THEN 4 ELSE 8 END)
) STRICT;
INSERT INTO terrain_tile (terrain_id, layer, row0, col0, n_rows, n_cols, dtype, data)
SELECT terrain_id, layer, row0, col0, n_rows, n_cols, dtype, data FROM old_terrain_tile WHERE layer = 'height';
DROP TABLE old_terrain_tile;

DROP TABLE effect_kind;
CREATE TABLE effect_kind (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the law
  family TEXT NOT NULL,                                             -- [-] wheel_soil, rolling, drive, body, sensor or expression
  target TEXT NOT NULL CHECK (target IN ('wheel', 'joint', 'body', 'sensor', 'terrain', 'world', 'any')),  -- [-] what it acts on
  passive INTEGER NOT NULL CHECK (passive IN (0, 1)),               -- [-] 1 = can only take energy out
  channel TEXT NOT NULL,                                            -- [-] quantities that can reveal it, by commas
  equation TEXT NOT NULL,                                           -- [-] the law in one line, in the names of its parameters
  meaning TEXT NOT NULL,                                            -- [-] the physics in one sentence
  source TEXT NOT NULL                                              -- [-] reference
) STRICT;

DROP TABLE effect_parameter;
CREATE TABLE effect_parameter (
  effect_kind_id INTEGER NOT NULL REFERENCES effect_kind(id) ON DELETE CASCADE,  -- [-] law
  name TEXT NOT NULL,                                               -- [-] name of the parameter
  unit TEXT NOT NULL,                                               -- [-] its SI unit
  amplitude INTEGER NOT NULL CHECK (amplitude IN (0, 1)),           -- [-] 1 = the effect vanishes where all such parameters are 0
  lower REAL NOT NULL,                                              -- [unit] smallest value
  upper REAL NOT NULL,                                              -- [unit] largest value
  typical REAL NOT NULL,                                            -- [unit] usual value where the effect is present; default of what is no amplitude
  spread REAL NOT NULL CHECK (spread > 0),                          -- [unit] 1 sigma of the prior around the usual value
  meaning TEXT NOT NULL,                                            -- [-] what it says
  PRIMARY KEY (effect_kind_id, name),
  CHECK (lower <= typical AND typical <= upper)
) STRICT;

DROP TABLE effect;
CREATE TABLE effect (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  effect_kind_id INTEGER NOT NULL REFERENCES effect_kind(id),       -- [-] law
  target TEXT NOT NULL,                                             -- [-] name of the wheel, joint, body, sensor or terrain; '*' = every one
  parameters TEXT NOT NULL DEFAULT '{}' CHECK (json_valid(parameters))  -- [SI] JSON object: parameter -> value; absent amplitudes are 0
) STRICT;

ALTER TABLE run RENAME TO old_run;
CREATE TABLE run (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  scenario_id INTEGER NOT NULL REFERENCES scenario(id) ON DELETE CASCADE,  -- [-] scenario
  solver TEXT NOT NULL,                                             -- [-] program and version
  step REAL NOT NULL CHECK (step > 0),                              -- [s] time step that was used
  status TEXT NOT NULL CHECK (status IN ('running', 'done', 'stopped', 'interrupted', 'left_terrain', 'wheel_buried', 'diverged')),  -- [-] outcome
  time_reached REAL NOT NULL DEFAULT 0,                             -- [s] simulated time so far
  message TEXT NOT NULL DEFAULT ''                                  -- [-] the outcome in a sentence
) STRICT;
INSERT INTO run (id, scenario_id, solver, step, status, time_reached, message)
SELECT id, scenario_id, solver, step, status, time_reached, message FROM old_run;
DROP TABLE old_run;

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

PRAGMA legacy_alter_table = OFF;
