"""Wheels drawn with CadQuery, axle along z, centre at the origin, millimetres: what tests of symmetry and collision shapes ask for."""

import functools
import math

import cadquery as cq
import numpy as np


@functools.cache
def grousered(
    *,
    radius: float = 150,
    width: float = 160,
    grousers: int = 24,
    height: float = 10,
    thickness: float = 6,
    wall: float | None = 4,
    spokes: int = 0,
    disc: float = 0,
    bolts: int = 0,
    keyway: bool = False,
    skew: float = 0,
    chevron: float = 0,
) -> cq.Workplane:
    """A wheel: rim of a wall (None: solid), hub, spokes or disc, straight grousers, oblique (``skew`` [deg]) or chevrons."""
    shape = cq.Workplane().circle(radius).extrude(width / 2, both=True)
    added = []
    if wall is not None:
        shape = shape.cut(cq.Workplane().circle(radius - wall).extrude(width, both=True))
        added.append(cq.Workplane().circle(0.2 * radius).extrude(0.3 * width, both=True))
    if spokes:
        spoke = cq.Workplane().box(radius - wall / 2, 0.08 * radius, 0.3 * width).translate(((radius - wall / 2) / 2, 0, 0))
        added += [spoke.rotate((0, 0, 0), (0, 0, 1), 360 * k / spokes) for k in range(spokes)]
    if disc:
        added.append(cq.Workplane().circle(radius - 1).extrude(disc / 2, both=True))
    inner = (wall or 4) / 2
    blade = cq.Workplane().box(height + inner, thickness, width).translate((radius + (height - inner) / 2, 0, 0))
    if skew or chevron:
        blade = oblique(radius, width, height, thickness, inner, skew or chevron, chevron != 0)
    added += [blade.rotate((0, 0, 0), (0, 0, 1), 360 * k / grousers) for k in range(grousers)]
    shape = cq.Workplane(obj=shape.val().fuse(*[part.val() for part in added])) if added else shape
    if bolts:
        shape = shape.cut(cq.Workplane().polarArray(0.14 * radius, 0, 360, bolts).circle(0.03 * radius).extrude(2 * width, both=True))
    if keyway:
        shape = shape.cut(cq.Workplane().box(0.06 * radius, 0.03 * radius, 2 * width).translate((0.03 * radius, 0, 0)))
    return shape


def oblique(radius, width, height, thickness, inner, angle, mirrored) -> cq.Workplane:
    """A blade that runs across the rim at an angle [deg]; mirrored: a V. Extruded outwards through the rim."""
    run = math.tan(math.radians(angle)) * width / (2 if mirrored else 1)
    t, w = thickness / 2, width / 2
    if mirrored:
        points = [(-t - run / 2, -w), (t - run / 2, -w), (t + run / 2, 0), (t - run / 2, w), (-t - run / 2, w), (-t + run / 2, 0)]
    else:
        points = [(-t - run / 2, -w), (t - run / 2, -w), (t + run / 2, w), (-t + run / 2, w)]
    return cq.Workplane("YZ").polyline(points).close().extrude(height + inner).translate((radius - inner, 0, 0))


def turned(shape: cq.Workplane) -> cq.Workplane:
    """Somewhere else, at an odd attitude: by ``TURN``, then shifted."""
    return shape.rotate((0, 0, 0), tuple(AXIS), 77).translate((310, -220, 145))


AXIS = np.array([1.0, 2.0, 3.0]) / math.sqrt(14)
_CROSS = np.cross(np.eye(3), AXIS)
TURN = np.eye(3) + math.sin(math.radians(77)) * _CROSS + (1 - math.cos(math.radians(77))) * _CROSS @ _CROSS
"""Rotation matrix of :func:`turned`: 77 degrees about (1, 2, 3) (Rodrigues)."""
