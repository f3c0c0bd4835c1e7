"""Runs as the numbers of a page: float32 states, whose order the layout tells."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Trace

Array = NDArray[np.float64]
WHEEL = ("slip_ratio", "slip_angle", "sinkage", "normal_load", "drawbar_pull", "side_force", "drive_torque")
JOINT = ("position", "velocity", "effort", "work")


def states(trace: Trace, rover: Rover, origin: Array) -> NDArray[np.float32]:
    """States (n, 7 bodies + 4 joints + 11 wheels) of a run: of bodies x y z less origin [m] and quaternion w x y z; of joints of one
    freedom position, velocity, effort, work; of wheels centre and ground height less origin [m], then ``WHEEL``. NaN where unknown."""
    n = len(trace.time)
    columns: list[Array] = []
    bodies = {body.name: body for body in trace.bodies}
    joints = {joint.name: joint for joint in trace.joints}
    wheels = {wheel.name: wheel for wheel in trace.wheels}
    for body in rover.bodies:
        found = bodies.get(body.name)
        columns += [np.full((n, 7), np.nan)] if found is None else [found.position - origin, found.rotation]
    for joint in rover.joints:
        if joint.kind not in ("hinge", "prismatic"):
            continue
        found = joints.get(joint.name)
        columns.append(np.full((n, 4), np.nan) if found is None else np.column_stack([getattr(found, name) for name in JOINT]))
    for wheel in rover.wheels:
        found = wheels.get(wheel.name)
        if found is None:
            columns.append(np.full((n, 11), np.nan))
            continue
        columns += [
            found.center - origin,
            (found.ground_height - origin[2])[:, None],
            np.column_stack([getattr(found, name) for name in WHEEL]),
        ]
    return np.concatenate(columns, axis=1).astype(np.float32) if columns else np.empty((n, 0), np.float32)
