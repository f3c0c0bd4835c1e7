-- Parts that have no mass (free surfaces) or no size (lumped masses), and elastic stops.
PRAGMA legacy_alter_table = ON;  -- references of other tables keep meaning the name

ALTER TABLE part RENAME TO old_part;
CREATE TABLE part (
  id INTEGER PRIMARY KEY,                                           -- [-] key
  name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),               -- [-] name of the prototype
  material_id INTEGER REFERENCES material(id),                      -- [-] material, if known
  brep_hash TEXT NOT NULL DEFAULT '',                               -- [-] digest of the exact geometry; the same shape, the same digest
  volume REAL NOT NULL CHECK (volume >= 0),                         -- [m^3] volume of its solids
  mass REAL NOT NULL CHECK (mass >= 0),                             -- [kg] mass of one instance; 0: only seen (free surfaces)
  com_x REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  com_y REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  com_z REAL NOT NULL,                                              -- [m] centre of mass in the part's frame
  ixx REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  iyy REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  izz REAL NOT NULL,                                                -- [kg m^2] inertia about the centre of mass, part's axes
  ixy REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x y dm
  ixz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int x z dm
  iyz REAL NOT NULL DEFAULT 0,                                      -- [kg m^2] tensor element -Int y z dm
  mass_provenance TEXT NOT NULL CHECK (mass_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  inertia_provenance TEXT NOT NULL CHECK (inertia_provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  color TEXT NOT NULL DEFAULT '#9aa0a6' CHECK (color GLOB '#??????'),  -- [-] colour as #rrggbb
  CHECK (ixx >= 0 AND iyy >= 0 AND izz >= 0),  -- 0: a lumped mass
  CHECK (ixx <= (iyy + izz) * 1.000001 AND iyy <= (ixx + izz) * 1.000001 AND izz <= (ixx + iyy) * 1.000001)
) STRICT;
INSERT INTO part SELECT * FROM old_part;
DROP TABLE old_part;

ALTER TABLE joint_limit RENAME TO old_joint_limit;
CREATE TABLE joint_limit (
  joint_id INTEGER PRIMARY KEY REFERENCES joint(id) ON DELETE CASCADE,  -- [-] hinge or prismatic joint
  lower REAL NOT NULL,                                              -- [rad or m] smallest position
  upper REAL NOT NULL,                                              -- [rad or m] largest position
  stiffness REAL CHECK (stiffness > 0),                             -- [N m/rad or N/m] of the stops; absent = rigid
  damping REAL CHECK (damping >= 0),                                -- [N m s/rad or N s/m] of the stops while pressed; absent = 0
  provenance TEXT NOT NULL CHECK (provenance IN ('stated', 'measured', 'geometry', 'cad_material', 'default')),  -- [-] kind of source
  CHECK (lower < upper),
  CHECK (damping IS NULL OR stiffness IS NOT NULL)
) STRICT;
INSERT INTO joint_limit (joint_id, lower, upper, provenance) SELECT joint_id, lower, upper, provenance FROM old_joint_limit;
DROP TABLE old_joint_limit;

PRAGMA legacy_alter_table = OFF;
