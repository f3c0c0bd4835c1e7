-- Runs that are steered while they go: states put elsewhere, the log of what was asked, and states kept by name.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name
ALTER TABLE scenario RENAME TO old_scenario;
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
INSERT INTO scenario (id, name, terrain_id, gravity_x, gravity_y, gravity_z, duration, step, output_interval, integrator, placement, settle_time, start_x, start_y, start_z,
start_qw, start_qx, start_qy, start_qz, start_vx, start_vy, start_vz, start_wx, start_wy, start_wz)
SELECT id, name, terrain_id, gravity_x, gravity_y, gravity_z, duration, step, output_interval, integrator, placement, settle_time, start_x, start_y, start_z,
start_qw, start_qx, start_qy, start_qz, start_vx, start_vy, start_vz, start_wx, start_wy, start_wz
FROM old_scenario;
DROP TABLE old_scenario;
PRAGMA legacy_alter_table = OFF;

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
  data BLOB NOT NULL                                                -- [-] complete state of the solver, in its own format
) STRICT;
