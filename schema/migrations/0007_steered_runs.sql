-- Runs that are steered while they go: states put elsewhere, the log of what was asked, and states kept by name.
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
