-- A saved state is loaded only into the world that it was saved in; of older ones that world is not known.
ALTER TABLE saved_state RENAME TO old_saved_state;
CREATE TABLE saved_state (
  name TEXT PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 64),      -- [-] name
  run_id INTEGER NOT NULL REFERENCES run(id) ON DELETE CASCADE,     -- [-] run that it was saved in
  step INTEGER NOT NULL CHECK (step >= 0),                          -- [-] number of steps taken
  time REAL NOT NULL CHECK (time >= 0),                             -- [s] simulated time
  data BLOB NOT NULL,                                               -- [-] complete state of the solver, in its own format
  model_hash TEXT NOT NULL DEFAULT ''                               -- [-] digest of rover, effects and ground, so that it is loaded into no others; empty: not known
) STRICT;
INSERT INTO saved_state (name, run_id, step, time, data) SELECT name, run_id, step, time, data FROM old_saved_state;
DROP TABLE old_saved_state;
