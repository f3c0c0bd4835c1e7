-- Recordings in blocks with clocks, corrections and what the data gate found. Samples become blocks of 4096 values; float64_block is a
-- function that the migration brings along: JSON array of numbers as text (17 digits keep every bit) -> float64
-- little endian, null = NaN.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name

ALTER TABLE recording RENAME TO old_recording;
ALTER TABLE channel RENAME TO old_channel;
ALTER TABLE sample RENAME TO old_sample;
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

INSERT INTO recording (id, name, scenario_id, source) SELECT id, name, scenario_id, source FROM old_recording;
INSERT INTO clock (id, recording_id, name) SELECT id, recording_id, name FROM old_channel;
INSERT INTO channel (id, recording_id, clock_id, name, quantity, target, unit, role, noise)
SELECT id, recording_id, id, name, quantity, target, unit, role, noise FROM old_channel;
CREATE TEMP TABLE numbered AS
SELECT channel_id, time, value, (row_number() OVER (PARTITION BY channel_id ORDER BY time) - 1) / 4096 AS block FROM old_sample;
INSERT INTO clock_block (clock_id, block, n, first, last, data)
SELECT channel_id, block, count(*), min(time), max(time), float64_block(json_group_array(printf('%!.17g', time)))
FROM (SELECT * FROM numbered ORDER BY channel_id, time) GROUP BY channel_id, block;
INSERT INTO sample_block (channel_id, block, n, data)
SELECT channel_id, block, count(*), float64_block(json_group_array(iif(value IS NULL, NULL, printf('%!.17g', value))))
FROM (SELECT * FROM numbered ORDER BY channel_id, time) GROUP BY channel_id, block;
DROP TABLE numbered;
DROP TABLE old_sample;
DROP TABLE old_channel;
DROP TABLE old_recording;

PRAGMA legacy_alter_table = OFF;
