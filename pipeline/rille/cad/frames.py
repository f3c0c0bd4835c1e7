"""Named places of the sheet: by a named face, by a cylinder of a part, by coordinates; never by the number of a face."""

import numpy as np
from numpy.typing import NDArray

from rille.cad.assign import Inventory, matches
from rille.cad.component import Line, Placed
from rille.cad.entries import direction, known, positive, triple_of
from rille.cad.sheet import FrameSheet, JointSheet, RoverSheet
from rille.model import InputRefused, nearest_names
from rille.model.rotation import UP

Vector = NDArray[np.float64]

PARALLEL = np.radians(0.01)
"""Largest angle [rad] between an axis on the sheet and that of the geometry it names."""


class Frames:
    """Points and axes of the sheet, in M."""

    def __init__(self, page: RoverSheet, inventory: Inventory) -> None:
        self._page = page
        self._inventory = inventory
        self._up = UP[page.up]
        self._frames = {frame.name: frame for frame in page.frame}

    def point(self, values: list, what: str) -> Vector:
        """Point [m] in M of coordinates in the drawing."""
        return self._up @ triple_of(values, "length", what)

    def axis(self, values: list, what: str) -> Vector:
        """Unit direction in M of one in the drawing."""
        return self._up @ direction(values, what)

    def find(self, name: str, subject: str) -> Line:
        """Point and axis (None: a point only) in M of a named frame.

        Raises
        ------
        InputRefused : for an unknown frame, part, face or cylinder.
        """
        frame = self._frames[known(name, self._frames, "frame", subject)]
        what = f"frame '{frame.name}'"
        ways = [frame.face is not None, frame.cylinder is not None, frame.point is not None]
        if sum(ways) != 1:
            raise InputRefused(f"{what} needs exactly one of `face`, `cylinder` and `point`")
        if frame.part is None:
            if frame.point is None:
                raise InputRefused(f'{what} names a face or cylinder but no part; say which instance has it: part = "rover/arm"')
            axis = None if frame.axis is None else self.axis(frame.axis, f"axis of {what}")
            return self.point(frame.point, f"point of {what}"), axis
        instance = self._instance(frame.part, what)
        point, axis = self._in_part(frame, instance, what)
        turned = None if axis is None else instance.matrix[:3, :3] @ axis
        return instance.matrix[:3, :3] @ point + instance.matrix[:3, 3], turned

    def line_of(self, joint: JointSheet) -> tuple[Vector, Vector]:
        """Point and unit axis of a joint in M; the origin and z where its kind has none (a fixed joint needs neither).

        Raises
        ------
        InputRefused : if both geometry and coordinates are given and disagree, a hinge or prismatic joint has no axis, or a hinge or
            ball joint has no place.
        """
        subject = f"joint '{joint.name}'"
        if joint.at is not None and joint.point is not None:
            raise InputRefused(f"{subject} has both `at` and `point`; give one of them")
        point, axis = self._named_line(joint, subject)
        stated = None if joint.axis is None else self.axis(joint.axis, f"axis of {subject}")
        if axis is None and stated is None and joint.kind in ("hinge", "prismatic"):
            where = "without an `axis`" if joint.at is None else f"at frame '{joint.at}', which is only a point"
            raise InputRefused(f"{subject} is a {joint.kind} joint {where}; give the joint an `axis`, or `at` a [[frame]] that has one")
        if point is None and joint.kind in ("hinge", "spherical"):
            raise InputRefused(f"{subject} is a {joint.kind} joint without a place; give it a `point` in the drawing, or `at` a [[frame]]")
        return np.zeros(3) if point is None else point, self._agreed(joint, axis, stated)

    def _named_line(self, joint: JointSheet, subject: str) -> tuple[Vector | None, Vector | None]:
        """Place of a joint in M and the axis of the frame that it names; None for what nothing says."""
        if joint.at is not None:
            return self.find(joint.at, subject)
        return None if joint.point is None else self.point(joint.point, f"point of {subject}"), None

    def _agreed(self, joint: JointSheet, axis: Vector | None, stated: Vector | None) -> Vector:
        """The axis of a joint's frame, turned the way that the stated one points."""
        if axis is None or stated is None:
            found = stated if axis is None else axis
            return np.array([0.0, 0.0, 1.0]) if found is None else found
        apart = float(np.arcsin(min(1.0, np.linalg.norm(np.cross(axis, stated)))))
        if apart > PARALLEL:
            raise InputRefused(
                f"axis of joint '{joint.name}' is {np.degrees(apart):.3g} deg off the axis {np.round(axis, 6).tolist()} of frame "
                f"'{joint.at}'; it must agree within 0.01 deg, correct it or leave one of the two out"
            )
        return axis if axis @ stated > 0 else -axis

    def _instance(self, path: str, what: str) -> Placed:
        found = [p for p in self._inventory.instances if matches(p.path, path)]
        if not found:
            paths = [p.path for p in self._inventory.instances]
            raise InputRefused(f"{what} names the part '{path}', which the assembly does not have; {nearest_names(path, paths)}")
        if len(found) > 1:
            raise InputRefused(
                f"{what} names the part '{path}', which stands for {len(found)} instances; name one, for example '{found[0].path}'"
            )
        return found[0]

    def _in_part(self, frame: FrameSheet, instance: Placed, what: str) -> Line:
        if frame.face is not None:
            return instance.component.face(frame.face, what)
        if frame.cylinder is not None:
            radius = positive(frame.cylinder.radius, "length", f"radius of {what}")
            return instance.component.cylinder(radius, triple_of(frame.cylinder.near, "length", f"near of {what}"), what)
        axis = None if frame.axis is None else direction(frame.axis, f"axis of {what}")
        return triple_of(frame.point or [], "length", f"point of {what}"), axis
