"""Distance of the wheels across, which many rows make together, as the solver moves them (solver/src/model/track_width.cpp)."""

import sqlite3

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused

Array = NDArray[np.float64]

VERTICAL = 0.9  # cosine of the tilt below which a hinge counts as steering
LEVEL = 1e-3  # level part that an axle needs to have a direction


def track_width(connection: sqlite3.Connection) -> float:
    """Distance [m] of the outermost wheel centres across, along the first wheel's axle; 0 with less than two wheels."""
    places = _across(connection)[1]
    return float(places.max() - places.min()) if len(places) > 1 else 0.0


def spread_wheels(connection: sqlite3.Connection, width: float) -> None:
    """Move the wheels, with their steering and all that it carries, so that they stand ``width`` [m] apart; the middle stays.

    Raises
    ------
    InputRefused : if the model has no two wheels across.
    """
    direction, places = _across(connection)
    drawn = float(places.max() - places.min()) if len(places) > 1 else 0.0
    if not drawn > 0 or not width > 0:
        raise InputRefused(f"the wheels stand {drawn:g} m apart across and cannot be moved to {width:g} m; the finding is of another model")
    middle = (places.max() + places.min()) / 2
    joints = {row["child_body_id"]: row for row in connection.execute("SELECT * FROM joint")}
    moved: set[int] = set()
    for row, place in zip(connection.execute("SELECT joint_id FROM wheel ORDER BY id").fetchall(), places, strict=True):
        top = _top(joints, next(joint for joint in joints.values() if joint["id"] == row["joint_id"]))
        if top["id"] not in moved:
            moved.add(top["id"])
            _move(connection, joints, top["child_body_id"], (width / drawn - 1) * (place - middle) * direction)


def _across(connection: sqlite3.Connection) -> tuple[Array, Array]:
    """Level unit vector across, and how far each wheel's centre lies along it [m]."""
    rows = connection.execute(
        "SELECT wheel.x, wheel.y, wheel.z, axis_x, axis_y FROM wheel JOIN joint ON joint.id = joint_id ORDER BY wheel.id"
    ).fetchall()
    direction = np.array([rows[0]["axis_x"], rows[0]["axis_y"], 0.0]) if rows else np.zeros(3)
    size = float(np.linalg.norm(direction))
    direction = direction / size if size > LEVEL else np.zeros(3)
    return direction, np.array([[row["x"], row["y"], row["z"]] for row in rows]).reshape(-1, 3) @ direction


def _top(joints: dict[int, sqlite3.Row], joint: sqlite3.Row) -> sqlite3.Row:
    """The wheel's joint, or the steering hinge above it."""
    while (above := joints.get(joint["parent_body_id"])) is not None:
        if above["kind"] != "hinge" or abs(above["axis_z"]) < VERTICAL or above["parent_body_id"] is None:
            break
        joint = above
    return joint


def _move(connection: sqlite3.Connection, joints: dict[int, sqlite3.Row], first: int, by: Array) -> None:
    """Move a body with all that it carries by a vector [m]."""
    bodies = {first}
    for _ in joints:
        bodies |= {child for child, joint in joints.items() if joint["parent_body_id"] in bodies}
    shift = tuple(map(float, by))
    for body in bodies:
        for table, column in (("part_instance", "body_id"), ("collision_shape", "body_id"), ("loop_closure", "body_a_id")):
            connection.execute(f"UPDATE {table} SET x = x + ?, y = y + ?, z = z + ? WHERE {column} = ?", (*shift, body))
        connection.execute("UPDATE joint SET x = x + ?, y = y + ?, z = z + ? WHERE child_body_id = ?", (*shift, body))
        wheel = "UPDATE wheel SET x = x + ?, y = y + ?, z = z + ? WHERE joint_id = (SELECT id FROM joint WHERE child_body_id = ?)"
        connection.execute(wheel, (*shift, body))
        frame = "frame_x = frame_x + ?, frame_y = frame_y + ?, frame_z = frame_z + ?"
        centre = "com_x = com_x + ?, com_y = com_y + ?, com_z = com_z + ?"
        connection.execute(f"UPDATE body SET {frame}, {centre} WHERE id = ?", (*shift, *shift, body))
