-- The ledger of sealed trials: one SQLite file that a third party can verify (`rille prove verify LEDGER`).
--
-- Before the truths are opened it holds only their seals. Rows are added, never changed: triggers refuse it, and whoever takes
-- them away is found by the hashes. Digests are SHA-256 in lower-case hexadecimal. Times are [s] since 1970-01-01 UTC.

PRAGMA application_id = 1380535376;  -- "RILP"
PRAGMA user_version = 1;

CREATE TABLE plan (
  id INTEGER PRIMARY KEY CHECK (id = 1),                            -- [-] key; a ledger has one plan
  beacon TEXT NOT NULL CHECK (length(beacon) > 0),                  -- [-] sentence that the trials are drawn from
  version TEXT NOT NULL CHECK (length(version) > 0),                -- [-] version of rille that generates and diagnoses
  code_sha256 TEXT NOT NULL CHECK (length(code_sha256) = 64 AND code_sha256 NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of the package's code
  isolation TEXT NOT NULL CHECK (isolation GLOB 'landlock [0-9]*' OR isolation IN ('other user', 'none')),  -- [-] what keeps the truth from diagnosis
  counts TEXT NOT NULL CHECK (json_valid(counts)),                  -- [-] JSON {sort of trial: how many}
  merkle_root TEXT NOT NULL CHECK (length(merkle_root) = 64 AND merkle_root NOT GLOB '*[^0-9a-f]*'),  -- [-] Merkle root (RFC 6962) of the seals
  sealed REAL NOT NULL CHECK (sealed > 0)                           -- [s] when the plan was sealed
) STRICT;

CREATE TABLE trial (
  number INTEGER PRIMARY KEY CHECK (number >= 0),                   -- [-] number, from 0 on
  machine TEXT NOT NULL CHECK (length(machine) > 0),                -- [-] name of the machine
  seal TEXT NOT NULL UNIQUE CHECK (length(seal) = 64 AND seal NOT GLOB '*[^0-9a-f]*'),  -- [-] SHA-256(truth || nonce)
  recording_sha256 TEXT NOT NULL CHECK (length(recording_sha256) = 64 AND recording_sha256 NOT GLOB '*[^0-9a-f]*')  -- [-] digest of the files that diagnosis gets
) STRICT;

CREATE TABLE answer (
  id INTEGER PRIMARY KEY,                                           -- [-] place in the chain, from 1 on
  trial INTEGER NOT NULL UNIQUE REFERENCES trial(number),           -- [-] number of the trial
  status TEXT NOT NULL CHECK (status IN ('done', 'crashed', 'too long', 'refused')),  -- [-] how diagnosis ended
  answer TEXT NOT NULL,                                             -- [-] JSON of the answer; of a failure the last that it said
  answer_sha256 TEXT NOT NULL CHECK (length(answer_sha256) = 64 AND answer_sha256 NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of column answer
  recording_sha256 TEXT NOT NULL CHECK (length(recording_sha256) = 64 AND recording_sha256 NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of the files that were diagnosed
  seconds REAL NOT NULL CHECK (seconds >= 0),                       -- [s] wall time of the diagnosis
  begun REAL NOT NULL CHECK (begun > 0),                            -- [s] when it began
  ended REAL NOT NULL CHECK (ended > 0),                            -- [s] when it ended
  previous TEXT NOT NULL UNIQUE CHECK (length(previous) = 64 AND previous NOT GLOB '*[^0-9a-f]*'),  -- [-] chain hash of the answer before; of the first the plan's
  chain TEXT NOT NULL UNIQUE CHECK (length(chain) = 64 AND chain NOT GLOB '*[^0-9a-f]*'),  -- [-] digest of this row with `previous` in it
  CHECK (status <> 'done' OR json_valid(answer))
) STRICT;

CREATE TABLE truth (
  trial INTEGER PRIMARY KEY REFERENCES trial(number),               -- [-] number of the trial
  truth TEXT NOT NULL CHECK (json_valid(truth)),                    -- [-] canonical JSON of what is concealed
  nonce BLOB NOT NULL UNIQUE CHECK (length(nonce) = 32)             -- [-] 32 bytes that nobody could guess
) STRICT;

CREATE TABLE score (
  trial INTEGER PRIMARY KEY REFERENCES truth(trial),                -- [-] number of the trial
  score TEXT NOT NULL CHECK (json_valid(score))                     -- [-] canonical JSON of how right the answer is
) STRICT;

CREATE TRIGGER plan_stays BEFORE UPDATE ON plan BEGIN SELECT RAISE(ABORT, 'the plan is sealed'); END;
CREATE TRIGGER plan_is_kept BEFORE DELETE ON plan BEGIN SELECT RAISE(ABORT, 'the plan is sealed'); END;
CREATE TRIGGER trial_stays BEFORE UPDATE ON trial BEGIN SELECT RAISE(ABORT, 'the trials are sealed'); END;
CREATE TRIGGER trial_is_kept BEFORE DELETE ON trial BEGIN SELECT RAISE(ABORT, 'the trials are sealed'); END;
CREATE TRIGGER answer_stays BEFORE UPDATE ON answer BEGIN SELECT RAISE(ABORT, 'an answer is given once'); END;
CREATE TRIGGER answer_is_kept BEFORE DELETE ON answer BEGIN SELECT RAISE(ABORT, 'an answer is given once'); END;
CREATE TRIGGER truth_stays BEFORE UPDATE ON truth BEGIN SELECT RAISE(ABORT, 'a truth is opened once'); END;
CREATE TRIGGER truth_is_kept BEFORE DELETE ON truth BEGIN SELECT RAISE(ABORT, 'a truth is opened once'); END;
CREATE TRIGGER score_stays BEFORE UPDATE ON score BEGIN SELECT RAISE(ABORT, 'a score is given once'); END;
CREATE TRIGGER score_is_kept BEFORE DELETE ON score BEGIN SELECT RAISE(ABORT, 'a score is given once'); END;

CREATE TRIGGER truth_comes_last BEFORE INSERT ON truth
WHEN (SELECT count(*) FROM answer) < (SELECT count(*) FROM trial)
BEGIN SELECT RAISE(ABORT, 'truths are opened after the last answer'); END;
CREATE TRIGGER answer_comes_first BEFORE INSERT ON answer
WHEN EXISTS (SELECT 1 FROM truth)
BEGIN SELECT RAISE(ABORT, 'answers are given before the first truth is opened'); END;
