"""A ball drawn as a sphere about the origin, millimetres: the baseball of ball_drops.csv, 222.5 mm around."""

import math

import cadquery as cq

RADIUS = 222.5 / (2 * math.pi)


def build() -> cq.Assembly:
    """One sphere."""
    return cq.Assembly(name="drawing").add(cq.Workplane().sphere(RADIUS), name="ball", color=cq.Color(0.92, 0.9, 0.84))
