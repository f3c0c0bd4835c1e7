-- A study of `rille sweep`: its design, and what came of every case; one SQLite file of its own.
--
-- The design is written before the first case is run; a finished case is one transaction with its outcomes. While cases wait, SQLite may keep
-- a log beside the file (-wal, -shm); once all are done it is one file again. Numbers are SI, angles radians;
-- of a factor or an outcome in the unit that its row names. View `result` has one row per case, a column per factor and per outcome.

PRAGMA application_id = 1380537172;  -- "RIST"
PRAGMA user_version = 1;

CREATE TABLE study (
  id INTEGER PRIMARY KEY CHECK (id = 1),                            -- [-] key; a file has one study
  name TEXT NOT NULL CHECK (length(name) > 0),                      -- [-] name
  design TEXT NOT NULL CHECK (design IN ('grid', 'latin_hypercube', 'sobol')),  -- [-] how cases were chosen
  samples INTEGER NOT NULL CHECK (samples >= 0),                    -- [-] base samples of a design that is drawn; 0 of a grid
  seed INTEGER NOT NULL,                                            -- [-] seed of its draws
  second_order INTEGER NOT NULL CHECK (second_order IN (0, 1)),     -- [-] sobol: whether pairs of factors can be told
  model_file TEXT NOT NULL,                                         -- [-] name of the model's file
  version TEXT NOT NULL,                                            -- [-] version of rille that made the study
  sheet_sha256 TEXT NOT NULL CHECK (length(sheet_sha256) = 64 AND sheet_sha256 NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of what was asked
  model_sha256 TEXT NOT NULL CHECK (length(model_sha256) = 64 AND model_sha256 NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of model, scenario and terrain
  trace_time BLOB NOT NULL CHECK (length(trace_time) % 8 = 0)       -- [s] common times of traces, 64-bit little-endian; empty if none are kept
) STRICT;

CREATE TABLE factor (
  id INTEGER PRIMARY KEY CHECK (id > 0),                            -- [-] place in the study, from 1 on
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] what varies, such as soil.lunar.cohesion
  unit TEXT NOT NULL,                                               -- [-] unit of its values; '-' for numbers and for factors of what the model has
  relative INTEGER NOT NULL CHECK (relative IN (0, 1)),             -- [-] values are factors of what the model has
  spread TEXT NOT NULL CHECK (spread IN ('uniform', 'log', 'normal', 'values')),  -- [-] distribution
  low REAL NOT NULL,                                                -- [unit] lower end of uniform and log
  high REAL NOT NULL CHECK (spread NOT IN ('uniform', 'log') OR high > low),  -- [unit] upper end of uniform and log
  mean REAL NOT NULL,                                               -- [unit] of normal
  sigma REAL NOT NULL CHECK (spread <> 'normal' OR sigma > 0),      -- [unit] standard deviation of normal
  choices TEXT NOT NULL CHECK (json_valid(choices)),                -- [unit] JSON list of values
  CHECK (spread <> 'log' OR low > 0)
) STRICT;

CREATE TABLE measure (
  id INTEGER PRIMARY KEY CHECK (id > 0),                            -- [-] place in the study, from 1 on
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the outcome
  unit TEXT NOT NULL,                                               -- [-] unit of its values
  meaning TEXT NOT NULL,                                            -- [-] in words
  main INTEGER NOT NULL CHECK (main IN (0, 1))                      -- [-] shown first
) STRICT;

CREATE TABLE traced_channel (
  id INTEGER PRIMARY KEY CHECK (id > 0),                            -- [-] place in the study, from 1 on
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name
  unit TEXT NOT NULL,                                               -- [-] unit of its values
  quantity TEXT NOT NULL,                                           -- [-] as of a sensor
  target TEXT NOT NULL,                                             -- [-] joint, wheel, body or drive
  component INTEGER NOT NULL CHECK (component BETWEEN 0 AND 3)      -- [-] of a vector or quaternion
) STRICT;

CREATE TABLE "case" (
  number INTEGER PRIMARY KEY CHECK (number >= 0),                   -- [-] number, from 0 on; the order of the design
  status TEXT NOT NULL DEFAULT 'waiting' CHECK (status IN
    ('waiting', 'done', 'stopped', 'left_terrain', 'wheel_buried', 'diverged', 'refused', 'error', 'worker_died')),  -- [-] how it ended
  reason TEXT NOT NULL DEFAULT ''                                   -- [-] why it did not go as planned, in a sentence
) STRICT;

CREATE TABLE setting (
  "case" INTEGER NOT NULL REFERENCES "case"(number),                -- [-] case
  name TEXT NOT NULL REFERENCES factor(name),                       -- [-] factor
  value REAL NOT NULL,                                              -- [unit of the factor] value
  PRIMARY KEY ("case", name)
) STRICT, WITHOUT ROWID;

CREATE TABLE outcome (
  "case" INTEGER NOT NULL REFERENCES "case"(number),                -- [-] case
  name TEXT NOT NULL REFERENCES measure(name),                      -- [-] measure
  value REAL NOT NULL,                                              -- [unit of the measure] value
  PRIMARY KEY ("case", name)
) STRICT, WITHOUT ROWID;

CREATE TABLE trace (
  "case" INTEGER NOT NULL REFERENCES "case"(number),                -- [-] case
  name TEXT NOT NULL REFERENCES traced_channel(name),               -- [-] channel
  samples BLOB NOT NULL CHECK (length(samples) % 4 = 0),            -- [unit of the channel] at study.trace_time, 32-bit little-endian; NaN after the end
  PRIMARY KEY ("case", name)
) STRICT, WITHOUT ROWID;
