-- What diagnosis must know of a law (memory, how its numbers are looked for), and findings with names that `rille apply` knows.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name

ALTER TABLE effect_kind RENAME TO old_effect_kind;
ALTER TABLE effect_parameter RENAME TO old_effect_parameter;
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
  spread REAL NOT NULL CHECK (spread > 0),                          -- [unit] 1 sigma of the prior around the usual value
  meaning TEXT NOT NULL,                                            -- [-] what it says
  PRIMARY KEY (effect_kind_id, name),
  CHECK (lower <= typical AND typical <= upper)
) STRICT;
INSERT INTO effect_kind SELECT id, name, family, target, passive, 0, '', channel, equation, meaning, source FROM old_effect_kind;
INSERT INTO effect_parameter SELECT effect_kind_id, name, unit, amplitude, 'local', lower, upper, typical, spread, meaning FROM old_effect_parameter;
DROP TABLE old_effect_parameter;
DROP TABLE old_effect_kind;

ALTER TABLE finding RENAME TO old_finding;
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
INSERT INTO finding (id, name, created, verdict, target, probability, sentence, recording_id, recordings, detail)
SELECT id, 'diagnosis-' || id, '',
  iif(verdict IN ('nothing_missing', 'unknown'), verdict, 'named'),
  iif(verdict IN ('nothing_missing', 'unknown'), target, verdict || iif(target = '', '', ' of ' || target)),
  probability, '', recording_id, (SELECT json_group_array(name) FROM recording WHERE recording.id = recording_id), detail
FROM old_finding;
DROP TABLE old_finding;

PRAGMA legacy_alter_table = OFF;
