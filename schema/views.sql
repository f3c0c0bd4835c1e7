-- Results with names instead of keys, for people who query with plain SQL. Views are remade freely; they hold nothing.

DROP VIEW IF EXISTS part_state;
CREATE VIEW part_state AS  -- pose and velocity of every moving part by name
  SELECT run_id, time, body.name AS part, x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz
  FROM body_state JOIN body ON body.id = body_id;

DROP VIEW IF EXISTS joint_trace;
CREATE VIEW joint_trace AS
  SELECT run_id, time, joint.name AS joint, position, velocity, effort, work
  FROM joint_state JOIN joint ON joint.id = joint_id;

DROP VIEW IF EXISTS drive_trace;
CREATE VIEW drive_trace AS  -- effort [N m or N], speed, power [W] and work [J] of every drive
  SELECT run_id, time, drive.name AS drive, effort, velocity, effort * velocity AS power, work
  FROM joint_state JOIN drive USING (joint_id);

DROP VIEW IF EXISTS wheel_trace;
CREATE VIEW wheel_trace AS
  SELECT run_id, time, wheel.name AS wheel, wheel_state.x, wheel_state.y, wheel_state.z, ground_height, slip_ratio, slip_angle,
         sinkage, normal_load, drawbar_pull, side_force, drive_torque
  FROM wheel_state JOIN wheel ON wheel.id = wheel_id;

DROP VIEW IF EXISTS run_summary;
CREATE VIEW run_summary AS
  SELECT run.id AS run_id, scenario.name AS scenario, status, time_reached, run.duration, run.step, solver, message
  FROM run JOIN scenario ON scenario.id = scenario_id;

-- Samples of recordings by rows; a missing value is NULL. Blocks hold float64 little endian, and plain SQL takes them apart: sign, exponent
-- and fraction of IEEE 754 from their 16 hexadecimal digits (instr gives 0 for the digit 0).
DROP VIEW IF EXISTS sample;
CREATE VIEW sample AS
  WITH RECURSIVE
    place(k) AS (SELECT 0 UNION ALL SELECT k + 1 FROM place WHERE k < 4095),
    bytes AS (
      SELECT recording.name AS recording, channel.name AS channel, channel.unit AS unit, 4096 * clock_block.block + place.k AS number,
             hex(substr(clock_block.data, 8 * place.k + 1, 8)) AS time_hex, hex(substr(sample_block.data, 8 * place.k + 1, 8)) AS value_hex
      FROM sample_block JOIN channel ON channel.id = sample_block.channel_id JOIN recording ON recording.id = channel.recording_id
           JOIN clock_block ON clock_block.clock_id = channel.clock_id AND clock_block.block = sample_block.block
           JOIN place ON place.k < sample_block.n
    ),
    digits AS (
      SELECT *,
             instr('123456789ABCDEF', substr(time_hex, 15, 1)) % 8 * 256 + instr('123456789ABCDEF', substr(time_hex, 16, 1)) * 16 + instr('123456789ABCDEF', substr(time_hex, 13, 1)) AS time_exponent,
             instr('123456789ABCDEF', substr(time_hex, 14, 1)) * 281474976710656 + instr('123456789ABCDEF', substr(time_hex, 11, 1)) * 17592186044416 + instr('123456789ABCDEF', substr(time_hex, 12, 1)) * 1099511627776 +
             instr('123456789ABCDEF', substr(time_hex, 9, 1)) * 68719476736 + instr('123456789ABCDEF', substr(time_hex, 10, 1)) * 4294967296 + instr('123456789ABCDEF', substr(time_hex, 7, 1)) * 268435456 +
             instr('123456789ABCDEF', substr(time_hex, 8, 1)) * 16777216 + instr('123456789ABCDEF', substr(time_hex, 5, 1)) * 1048576 + instr('123456789ABCDEF', substr(time_hex, 6, 1)) * 65536 +
             instr('123456789ABCDEF', substr(time_hex, 3, 1)) * 4096 + instr('123456789ABCDEF', substr(time_hex, 4, 1)) * 256 + instr('123456789ABCDEF', substr(time_hex, 1, 1)) * 16 +
             instr('123456789ABCDEF', substr(time_hex, 2, 1)) * 1 AS time_fraction,
             instr('123456789ABCDEF', substr(value_hex, 15, 1)) % 8 * 256 + instr('123456789ABCDEF', substr(value_hex, 16, 1)) * 16 + instr('123456789ABCDEF', substr(value_hex, 13, 1)) AS value_exponent,
             instr('123456789ABCDEF', substr(value_hex, 14, 1)) * 281474976710656 + instr('123456789ABCDEF', substr(value_hex, 11, 1)) * 17592186044416 + instr('123456789ABCDEF', substr(value_hex, 12, 1)) * 1099511627776 +
             instr('123456789ABCDEF', substr(value_hex, 9, 1)) * 68719476736 + instr('123456789ABCDEF', substr(value_hex, 10, 1)) * 4294967296 + instr('123456789ABCDEF', substr(value_hex, 7, 1)) * 268435456 +
             instr('123456789ABCDEF', substr(value_hex, 8, 1)) * 16777216 + instr('123456789ABCDEF', substr(value_hex, 5, 1)) * 1048576 + instr('123456789ABCDEF', substr(value_hex, 6, 1)) * 65536 +
             instr('123456789ABCDEF', substr(value_hex, 3, 1)) * 4096 + instr('123456789ABCDEF', substr(value_hex, 4, 1)) * 256 + instr('123456789ABCDEF', substr(value_hex, 1, 1)) * 16 +
             instr('123456789ABCDEF', substr(value_hex, 2, 1)) * 1 AS value_fraction
      FROM bytes
    )
  SELECT recording, channel, number,
    CASE WHEN time_exponent < 2047 THEN iif(instr('123456789ABCDEF', substr(time_hex, 15, 1)) >= 8, -1, 1) * iif(time_exponent = 0, time_fraction, time_fraction + 4503599627370496) *
         pow(2.0, max(time_exponent, 1) - 1075) END AS time,
    CASE WHEN value_exponent < 2047 THEN iif(instr('123456789ABCDEF', substr(value_hex, 15, 1)) >= 8, -1, 1) * iif(value_exponent = 0, value_fraction, value_fraction + 4503599627370496) *
         pow(2.0, max(value_exponent, 1) - 1075) END AS value,
    unit
  FROM digits;
