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
  SELECT run.id AS run_id, scenario.name AS scenario, status, time_reached, run.step, solver, message
  FROM run JOIN scenario ON scenario.id = scenario_id;
