-- A run that was interrupted goes on for as long as was asked for; of older runs that is not known.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name
ALTER TABLE run RENAME TO old_run;
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
INSERT INTO run (id, scenario_id, solver, step, status, time_reached, message)
SELECT id, scenario_id, solver, step, status, time_reached, message FROM old_run;
DROP TABLE old_run;
PRAGMA legacy_alter_table = OFF;
