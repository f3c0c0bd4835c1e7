"""Turning a wheel on the spot takes friction x load x mean distance in the footprint."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad

from effect_rigs import EARTH, sample
from machines import box, plane
from rille.model import Command, Drive, Effect, Joint, MaterialPair, Pose, Rover, Scenario, Wheel


def turntable(make_model, *effects, ground=None):
    """A wheel under a yaw drive: the world holds a yaw body, which carries a post that slides, which carries the wheel."""
    center = (0.0, 0.0, 0.15)
    bodies = tuple(box(n, m, center, (0.2, 0.2, 0.2)) for n, m in (("yaw", 5.0), ("post", 7.0), ("wheel", 3.0)))
    joints = (
        Joint(name="yaw", kind="hinge", parent=None, child="yaw", point=center, axis=(0, 0, 1)),
        Joint(name="slide", kind="prismatic", parent="yaw", child="post", point=center, axis=(0, 0, 1)),
        Joint(name="axle", kind="hinge", parent="post", child="wheel", point=center, axis=(0, 1, 0)),
    )
    drives = (Drive(name="yaw", joint="yaw", mode="speed", max_torque=1e4), Drive(name="axle", joint="axle", mode="speed", max_torque=1e4))
    wheels = (Wheel(name="wheel", joint="axle", center=center, radius=0.15, width=0.165),)
    scenario = Scenario(
        name="s",
        duration=3.0,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        start=Pose(position=(0, 0, 0)),
        commands=(Command(drive="yaw", time=0.0, value=0.2),),
    )
    path = make_model(Rover(bodies=bodies, joints=joints, drives=drives, wheels=wheels), scenario, ground or plane(), effects)
    return sample(path, 3000, ("joint.effort", "yaw"), ("wheel.normal_load", "wheel"), ("wheel.sinkage", "wheel"), every=3000)[0]


def test_the_yaw_drive_works_against_the_footprint(make_model):
    """Mean distance by double quadrature over the rectangle contact length x width; the base model resists nothing on the spot."""
    base = turntable(make_model)
    effort, load, sinkage = turntable(make_model, Effect(kind="skid_scrub", parameters={"friction": 0.6}))
    length = 0.15 * np.sin(np.arccos(1 - sinkage / 0.15))
    total, _ = dblquad(lambda y, x: np.hypot(x, y), -length / 2, length / 2, -0.165 / 2, 0.165 / 2)
    assert load == pytest.approx(10 * EARTH, rel=1e-3)
    assert effort - base[0] == pytest.approx(0.6 * load * total / (length * 0.165), rel=2e-3)
    assert abs(base[0]) < 0.01 * effort


def test_hard_ground_is_touched_along_a_line(make_model):
    """Mean distance of the points of a line of the wheel's width: width/4. Friction of the pair acts at one point, which does not move."""
    hard = replace(plane(), pairs=(MaterialPair(response="rigid", soil="lunar_sourcebook", friction=0.5),))
    base = turntable(make_model, ground=hard)
    effort, load, _ = turntable(make_model, Effect(kind="skid_scrub", parameters={"friction": 0.6}), ground=hard)
    assert load == pytest.approx(10 * EARTH, rel=1e-3)
    assert effort - base[0] == pytest.approx(0.6 * load * 0.165 / 4, rel=1e-3)
