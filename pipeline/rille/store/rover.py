"""Rover values <-> rows."""

import sqlite3
from pathlib import Path
from typing import Any

import numpy as np

from rille.model import (
    Body,
    CollisionShape,
    Differential,
    Drive,
    Gear,
    Grouser,
    InputRefused,
    Joint,
    JointLimit,
    LoopClosure,
    MassProperties,
    Material,
    Mesh,
    Obstacle,
    Part,
    PartInstance,
    Pose,
    Rover,
    Sensor,
    SourceFile,
    Wheel,
    nearest_names,
)
from rille.model.recording import find_quantity
from rille.store.database import insert, reading, update, writing
from rille.store.effects import effect_rows, insert_effect
from rille.store.forget import forget_scenarios

MADE_OF_MATERIAL = ("part", "wheel", "obstacle")
ROVER_TABLES = (
    "sensor",
    "grouser",
    "wheel",
    "loop_closure",
    "gear",
    "differential",
    "drive",
    "joint_limit",
    "joint",
    "collision_shape",
    "mesh",
    "part_instance",
    "body",
    "part",
)  # children before parents


def write_rover(path: Path, rover: Rover, *, replace: bool = False) -> None:
    """Put the rover into the database, in place of the one it holds.

    Scenarios and runs belong to the rover that they were made for: if there are any, ``replace=True`` deletes them.

    Raises
    ------
    InputRefused : if scenarios or runs depend on the present rover and ``replace`` is false, if the rover refers to a name
        that it does not have, or if a value breaks a rule of the schema. The database is then as it was.
    """
    with writing(path) as connection:
        dependants = [t for t in ("scenario", "run") if connection.execute(f"SELECT 1 FROM {t} LIMIT 1").fetchone()]
        if dependants and not replace:
            raise InputRefused(
                f"'{path}' holds {' and '.join(t + 's' for t in dependants)} of its present rover; "
                "use another file, or --force to delete them with it"
            )
        connection.execute("DELETE FROM run")
        forget_scenarios(connection, "SELECT id FROM scenario")
        for table in ROVER_TABLES:
            connection.execute(f"DELETE FROM {table}")
        connection.execute("DELETE FROM effect")  # they act on parts of the rover
        kept = " UNION ".join(
            f"SELECT {column} FROM {table} WHERE {column} IS NOT NULL"
            for table, column in (("obstacle", "material_id"), ("material_pair", "material_id"), ("material_pair", "other_material_id"))
        )
        connection.execute(f"DELETE FROM material WHERE id NOT IN ({kept})")  # what the terrain says of materials stays
        connection.execute("DELETE FROM provenance WHERE subject = 'rover'")
        _Writer(connection, rover).write()


class _Names:
    """Keys of the rows of one table by name; an unknown name is a sentence with the nearest ones."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.keys: dict[str, int] = {}

    def key(self, name: str | None, subject: str) -> int | None:
        if name is None:
            return None
        if name not in self.keys:
            raise InputRefused(f"{subject} names the {self.what} '{name}', which does not exist; {nearest_names(name, self.keys)}")
        return self.keys[name]


def mass_columns(properties: MassProperties) -> dict[str, object]:
    """Columns of mass, centre of mass and inertia that ``part`` and ``body`` share."""
    inertia = properties.inertia
    columns: dict[str, object] = {"mass": float(properties.mass)}
    columns |= {f"com_{axis}": float(v) for axis, v in zip("xyz", properties.com, strict=True)}
    columns |= {f"i{a}{b}": float(inertia["xyz".index(a), "xyz".index(b)]) for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
    columns |= {"mass_provenance": properties.mass_provenance, "inertia_provenance": properties.inertia_provenance}
    return columns


def pose_columns(pose: Pose) -> dict[str, object]:
    """Columns x y z qw qx qy qz."""
    names = ("x", "y", "z", "qw", "qx", "qy", "qz")
    return dict(zip(names, map(float, (*pose.position, *pose.rotation)), strict=True))


def shape_columns(solid: CollisionShape | Obstacle) -> dict[str, object]:
    """Columns of a convex solid: kind, its pose, size_x size_y size_z, vertices."""
    sizes: list[float | None] = list(map(float, solid.size))
    if solid.kind == "cylinder":
        sizes = [sizes[0], None, sizes[1]]
    sizes += [None] * (3 - len(sizes))
    vertices = None if solid.vertices is None else np.ascontiguousarray(solid.vertices, "<f8").tobytes()
    columns: dict[str, object] = {"kind": solid.kind, **pose_columns(solid.pose), "vertices": vertices}
    return columns | dict(zip(("size_x", "size_y", "size_z"), sizes, strict=True))


def read_shape(row: sqlite3.Row) -> dict[str, Any]:
    """kind, pose, size and vertices of a convex solid, as written by ``shape_columns``."""
    return {
        "kind": row["kind"],
        "pose": read_pose(row),
        "size": tuple(v for v in (row["size_x"], row["size_y"], row["size_z"]) if v is not None),
        "vertices": None if row["vertices"] is None else np.frombuffer(row["vertices"], "<f8").reshape(-1, 3),
    }


def write_material(connection: sqlite3.Connection, material: Material) -> int:
    """Key of a material. Rovers and terrains share them: one that is there already gets another density only if nothing is made of it.

    Raises
    ------
    InputRefused : if something is, or the density is none.
    """
    there = connection.execute("SELECT id, density FROM material WHERE name = ?", (material.name,)).fetchone()
    row = {f: getattr(material, f) for f in ("name", "density", "provenance", "source")}
    if there is None:
        return insert(connection, "material", f"material '{material.name}'", row)
    if there["density"] != material.density:
        for table in MADE_OF_MATERIAL:
            user = connection.execute(f"SELECT name FROM {table} WHERE material_id = ?", (there["id"],)).fetchone()
            if user is not None:
                raise InputRefused(
                    f"material '{material.name}' has a density of {material.density:g} kg/m^3 here, and {there['density']:g} kg/m^3 in the "
                    f"database, where the {table} '{user['name']}' is made of it; state the same density, or choose "
                    "another name"
                )
        update(connection, "material", f"material '{material.name}'", there["id"], row)
    return there["id"]


def read_material(row: sqlite3.Row) -> Material:
    """A row of table ``material``."""
    return Material(name=row["name"], density=row["density"], provenance=row["provenance"], source=row["source"])


def write_part(connection: sqlite3.Connection, part: Part, material: Material | None) -> int:
    """Key of a part, written with its material."""
    return insert_part(connection, part, None if material is None else write_material(connection, material))


def insert_part(connection: sqlite3.Connection, part: Part, material_key: int | None) -> int:
    """Key of a part, written with its meshes."""
    subject = f"part '{part.name}'"
    row = {
        "name": part.name,
        "material_id": material_key,
        "brep_hash": part.brep_hash,
        "volume": part.volume,
        **mass_columns(part.properties),
        "color": part.color,
    }
    part_key = insert(connection, "part", subject, row)
    for mesh in part.meshes:
        row = {
            "part_id": part_key,
            "purpose": mesh.purpose,
            "tolerance": mesh.tolerance,
            "n_vertices": len(mesh.vertices),
            "n_triangles": len(mesh.triangles),
            "vertices": np.ascontiguousarray(mesh.vertices, "<f4").tobytes(),
            "triangles": np.ascontiguousarray(mesh.triangles, "<i4").tobytes(),
        }
        insert(connection, "mesh", f"mesh of {subject}", row)
    return part_key


def write_sources(connection: sqlite3.Connection, sources: tuple[SourceFile, ...]) -> None:
    """Rows of table ``provenance``."""
    for source in sources:
        row = {"subject": source.subject, "file": source.file, "sha256": source.sha256, "tool": source.tool}
        insert(connection, "provenance", f"source file '{source.file}'", row)


class _Writer:
    """Writes one rover table by table, parents first, remembering keys by name."""

    def __init__(self, connection: sqlite3.Connection, rover: Rover) -> None:
        self.connection = connection
        self.rover = rover
        self.materials = _Names("material")
        self.parts = _Names("part")
        self.bodies = _Names("body")
        self.joints = _Names("joint")

    def write(self) -> None:
        write_sources(self.connection, self.rover.sources)
        self.write_parts()
        self.write_bodies()
        self.write_joints()
        self.write_wheels()
        self.write_sensors()
        for effect in self.rover.effects:
            insert_effect(self.connection, effect)

    def write_parts(self) -> None:
        for material in self.rover.materials:
            self.materials.keys[material.name] = write_material(self.connection, material)
        for part in self.rover.parts:
            key = self.materials.key(part.material, f"part '{part.name}'")
            self.parts.keys[part.name] = insert_part(self.connection, part, key)

    def write_bodies(self) -> None:
        for body in self.rover.bodies:
            row = {"name": body.name, **dict(zip(("frame_x", "frame_y", "frame_z"), map(float, body.frame), strict=True))}
            row |= mass_columns(body.properties)
            self.bodies.keys[body.name] = insert(self.connection, "body", f"body '{body.name}'", row)
        for instance in self.rover.instances:
            subject = f"part instance '{instance.path}'"
            row = {
                "path": instance.path,
                "part_id": self.parts.key(instance.part, subject),
                "body_id": self.bodies.key(instance.body, subject),
                **pose_columns(instance.pose),
            }
            insert(self.connection, "part_instance", subject, row)
        for shape in self.rover.collision_shapes:
            subject = f"collision shape of body '{shape.body}'"
            row = {
                "body_id": self.bodies.key(shape.body, subject),
                "material_id": self.materials.key(shape.material, subject),
                **shape_columns(shape),
            }
            insert(self.connection, "collision_shape", subject, row)

    def write_joints(self) -> None:
        for joint in self.rover.joints:
            subject = f"joint '{joint.name}'"
            row = {
                "name": joint.name,
                "kind": joint.kind,
                "parent_body_id": self.bodies.key(joint.parent, subject),
                "child_body_id": self.bodies.key(joint.child, subject),
                **dict(zip("xyz", map(float, joint.point), strict=True)),
                **dict(zip(("axis_x", "axis_y", "axis_z"), map(float, joint.axis), strict=True)),
            }
            self.joints.keys[joint.name] = insert(self.connection, "joint", subject, row)
            if joint.limit is not None:
                row = {
                    "joint_id": self.joints.keys[joint.name],
                    "lower": joint.limit.lower,
                    "upper": joint.limit.upper,
                    "stiffness": joint.limit.stiffness,
                    "damping": joint.limit.damping,
                    "provenance": joint.limit.provenance,
                }
                insert(self.connection, "joint_limit", f"limit of {subject}", row)
        for drive in self.rover.drives:
            subject = f"drive '{drive.name}'"
            row = {
                "name": drive.name,
                "joint_id": self.joints.key(drive.joint, subject),
                "mode": drive.mode,
                "max_torque": drive.max_torque,
                "max_speed": drive.max_speed,
                "position_gain": drive.position_gain,
                "speed_gain": drive.speed_gain,
                "integral_gain": drive.integral_gain,
                "torque_constant": drive.torque_constant,
                "resistance": drive.resistance,
                "provenance": drive.provenance,
            }
            insert(self.connection, "drive", subject, row)
        for differential in self.rover.differentials:
            subject = f"differential '{differential.name}'"
            row = {
                "name": differential.name,
                "carrier_body_id": self.bodies.key(differential.carrier, subject),
                "joint_a_id": self.joints.key(differential.joint_a, subject),
                "joint_b_id": self.joints.key(differential.joint_b, subject),
            }
            insert(self.connection, "differential", subject, row)
        for gear in self.rover.gears:
            subject = f"gear '{gear.name}'"
            row = {
                "name": gear.name,
                "joint_a_id": self.joints.key(gear.joint_a, subject),
                "joint_b_id": self.joints.key(gear.joint_b, subject),
                "ratio": gear.ratio,
            }
            insert(self.connection, "gear", subject, row)
        for closure in self.rover.loop_closures:
            subject = f"loop closure '{closure.name}'"
            row = {
                "name": closure.name,
                "body_a_id": self.bodies.key(closure.body_a, subject),
                "body_b_id": self.bodies.key(closure.body_b, subject),
                **dict(zip("xyz", map(float, closure.point), strict=True)),
            }
            insert(self.connection, "loop_closure", subject, row)

    def write_wheels(self) -> None:
        for wheel in self.rover.wheels:
            subject = f"wheel '{wheel.name}'"
            row = {
                "name": wheel.name,
                "joint_id": self.joints.key(wheel.joint, subject),
                "material_id": self.materials.key(wheel.material, subject),
                **dict(zip("xyz", map(float, wheel.center), strict=True)),
                "radius": wheel.radius,
                "width": wheel.width,
            }
            key = insert(self.connection, "wheel", subject, row)
            if wheel.grouser is not None:
                row = {
                    "wheel_id": key,
                    "count": wheel.grouser.count,
                    "height": wheel.grouser.height,
                    "thickness": wheel.grouser.thickness,
                }
                insert(self.connection, "grouser", f"grousers of {subject}", row)

    def write_sensors(self) -> None:
        targets = {
            "joint": {joint.name for joint in self.rover.joints},
            "part": {body.name for body in self.rover.bodies},
            "wheel": {wheel.name for wheel in self.rover.wheels},
            "motor": {drive.name for drive in self.rover.drives},
        }
        for sensor in self.rover.sensors:
            subject = f"sensor '{sensor.name}'"
            names = targets[find_quantity(sensor.quantity, subject).name.partition(".")[0]]
            if sensor.target not in names:
                raise InputRefused(
                    f"{subject} reads '{sensor.target}', which the rover does not have; {nearest_names(sensor.target, names)}"
                )
            row = {f: getattr(sensor, f) for f in ("name", "quantity", "target", "rate", "frame")}
            insert(self.connection, "sensor", subject, row)


def read_rover(path: Path) -> Rover:
    """Read the rover back, equal in value to what was written.

    Raises
    ------
    InputRefused : if the file is no database of rille.
    """
    with reading(path) as connection:
        return _Reader(connection).read()


class _Reader:
    """Reads one rover table by table, turning keys back into names."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self.connection = connection
        self.names = {
            table: dict(connection.execute(f"SELECT id, name FROM {table}").fetchall()) for table in ("material", "part", "body", "joint")
        }

    def rows(self, sql: str) -> list[sqlite3.Row]:
        return self.connection.execute(sql).fetchall()

    def read(self) -> Rover:
        materials, parts, bodies, joints = (self.names[t] for t in ("material", "part", "body", "joint"))
        return Rover(
            materials=tuple(read_material(r) for r in self.rows("SELECT * FROM material ORDER BY id")),
            parts=read_parts(self.connection),
            instances=tuple(
                PartInstance(path=r["path"], part=parts[r["part_id"]], body=bodies.get(r["body_id"]), pose=read_pose(r))
                for r in self.rows("SELECT * FROM part_instance ORDER BY id")
            ),
            bodies=tuple(
                Body(name=r["name"], frame=(r["frame_x"], r["frame_y"], r["frame_z"]), properties=_mass(r))
                for r in self.rows("SELECT * FROM body ORDER BY id")
            ),
            collision_shapes=self.shapes(),
            joints=self.joints(),
            drives=tuple(
                Drive(
                    name=r["name"],
                    joint=joints[r["joint_id"]],
                    mode=r["mode"],
                    max_torque=r["max_torque"],
                    max_speed=r["max_speed"],
                    position_gain=r["position_gain"],
                    speed_gain=r["speed_gain"],
                    integral_gain=r["integral_gain"],
                    torque_constant=r["torque_constant"],
                    resistance=r["resistance"],
                    provenance=r["provenance"],
                )
                for r in self.rows("SELECT * FROM drive ORDER BY id")
            ),
            differentials=tuple(
                Differential(
                    name=r["name"],
                    carrier=bodies[r["carrier_body_id"]],
                    joint_a=joints[r["joint_a_id"]],
                    joint_b=joints[r["joint_b_id"]],
                )
                for r in self.rows("SELECT * FROM differential ORDER BY id")
            ),
            gears=tuple(
                Gear(name=r["name"], joint_a=joints[r["joint_a_id"]], joint_b=joints[r["joint_b_id"]], ratio=r["ratio"])
                for r in self.rows("SELECT * FROM gear ORDER BY id")
            ),
            loop_closures=tuple(
                LoopClosure(
                    name=r["name"],
                    body_a=bodies[r["body_a_id"]],
                    body_b=bodies.get(r["body_b_id"]),
                    point=(r["x"], r["y"], r["z"]),
                )
                for r in self.rows("SELECT * FROM loop_closure ORDER BY id")
            ),
            wheels=self.wheels(materials, joints),
            sensors=tuple(
                Sensor(name=r["name"], quantity=r["quantity"], target=r["target"], rate=r["rate"], frame=r["frame"])
                for r in self.rows("SELECT * FROM sensor ORDER BY id")
            ),
            effects=effect_rows(self.connection),
            sources=read_sources(self.connection, "rover"),
        )

    def shapes(self) -> tuple[CollisionShape, ...]:
        return tuple(
            CollisionShape(body=self.names["body"][r["body_id"]], material=self.names["material"].get(r["material_id"]), **read_shape(r))
            for r in self.rows("SELECT * FROM collision_shape ORDER BY id")
        )

    def joints(self) -> tuple[Joint, ...]:
        bodies = self.names["body"]
        limits = {
            r["joint_id"]: JointLimit(**{name: r[name] for name in ("lower", "upper", "stiffness", "damping", "provenance")})
            for r in self.rows("SELECT * FROM joint_limit")
        }
        return tuple(
            Joint(
                name=r["name"],
                kind=r["kind"],
                parent=bodies.get(r["parent_body_id"]),
                child=bodies[r["child_body_id"]],
                point=(r["x"], r["y"], r["z"]),
                axis=(r["axis_x"], r["axis_y"], r["axis_z"]),
                limit=limits.get(r["id"]),
            )
            for r in self.rows("SELECT * FROM joint ORDER BY id")
        )

    def wheels(self, materials: dict[int, str], joints: dict[int, str]) -> tuple[Wheel, ...]:
        grousers = {
            r["wheel_id"]: Grouser(count=r["count"], height=r["height"], thickness=r["thickness"])
            for r in self.rows("SELECT * FROM grouser")
        }
        return tuple(
            Wheel(
                name=r["name"],
                joint=joints[r["joint_id"]],
                center=(r["x"], r["y"], r["z"]),
                radius=r["radius"],
                width=r["width"],
                material=materials.get(r["material_id"]),
                grouser=grousers.get(r["id"]),
            )
            for r in self.rows("SELECT * FROM wheel ORDER BY id")
        )


def read_parts(connection: sqlite3.Connection) -> tuple[Part, ...]:
    """All parts with their meshes."""
    names = dict(connection.execute("SELECT id, name FROM material").fetchall())
    meshes: dict[int, list[Mesh]] = {}
    for r in connection.execute("SELECT * FROM mesh ORDER BY id"):
        mesh = Mesh(
            vertices=np.frombuffer(r["vertices"], "<f4").reshape(-1, 3),
            triangles=np.frombuffer(r["triangles"], "<i4").reshape(-1, 3),
            tolerance=r["tolerance"],
            purpose=r["purpose"],
        )
        meshes.setdefault(r["part_id"], []).append(mesh)
    return tuple(
        Part(
            name=r["name"],
            volume=r["volume"],
            properties=_mass(r),
            material=names.get(r["material_id"]),
            brep_hash=r["brep_hash"],
            color=r["color"],
            meshes=tuple(meshes.get(r["id"], ())),
        )
        for r in connection.execute("SELECT * FROM part ORDER BY id")
    )


def read_sources(connection: sqlite3.Connection, subject: str) -> tuple[SourceFile, ...]:
    """Rows of table ``provenance`` about ``subject``."""
    rows = connection.execute("SELECT * FROM provenance WHERE subject = ? ORDER BY id", (subject,))
    return tuple(SourceFile(subject=r["subject"], file=r["file"], sha256=r["sha256"], tool=r["tool"]) for r in rows)


def read_pose(row: sqlite3.Row) -> Pose:
    """Pose of columns x y z qw qx qy qz."""
    return Pose(position=(row["x"], row["y"], row["z"]), rotation=(row["qw"], row["qx"], row["qy"], row["qz"]))


def _mass(row: sqlite3.Row) -> MassProperties:
    inertia = np.array(
        [
            [row["ixx"], row["ixy"], row["ixz"]],
            [row["ixy"], row["iyy"], row["iyz"]],
            [row["ixz"], row["iyz"], row["izz"]],
        ]
    )
    return MassProperties(
        mass=row["mass"],
        com=np.array([row["com_x"], row["com_y"], row["com_z"]]),
        inertia=inertia,
        mass_provenance=row["mass_provenance"],
        inertia_provenance=row["inertia_provenance"],
    )
