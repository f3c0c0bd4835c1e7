"""Writes the database that the fuzz target mutates: small, with a row in every table that the solver reads.

Usage: python solver/tests/fuzz_seed.py SEED.db
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from machines import LUNAR_SOIL, box, cart, plane
from rille import store
from rille.model import (
    CollisionShape,
    Command,
    Effect,
    Gear,
    InitialJointState,
    Joint,
    JointLimit,
    LoopClosure,
    Material,
    MaterialPair,
    Obstacle,
    Pose,
    Scenario,
    Sensor,
    SoilPatch,
    Watch,
)


def write(path: Path) -> None:
    """A cart with a mast, a rocker under a limit, hulls, rocks, a soil patch, sensors, watches and an effect of every family."""
    rover = cart(5.0, 0.15, 0.165)
    bodies = (*rover.bodies, box("mast", 1.0, (0, 0, 0.6), (0.1, 0.1, 0.6)), box("twin", 1.0, (0.2, 0, 0.6), (0.1, 0.1, 0.6)))
    joints = (
        *rover.joints,
        Joint(
            name="mast",
            kind="hinge",
            parent="chassis",
            child="mast",
            point=(0, 0, 0.3),
            axis=(0, 1, 0),
            limit=JointLimit(lower=-0.2, upper=0.2, stiffness=500.0, damping=5.0),
        ),
        Joint(name="twin", kind="hinge", parent="chassis", child="twin", point=(0.2, 0, 0.3), axis=(0, 1, 0)),
    )
    corners = np.array([[x, y, z] for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (-0.05, 0.05)])
    shapes = (
        CollisionShape(body="chassis", kind="box", pose=Pose(position=(0, 0, 0.25)), size=(0.8, 0.5, 0.2)),
        CollisionShape(body="mast", kind="hull", pose=Pose(position=(0, 0, 0.6)), vertices=corners),
    )
    rover = replace(
        rover,
        materials=(Material(name="steel", density=7800.0, provenance="stated"),),
        bodies=bodies,
        joints=joints,
        collision_shapes=shapes,
        gears=(Gear(name="pair", joint_a="mast", joint_b="twin", ratio=1.0),),
        loop_closures=(LoopClosure(name="bar", body_a="mast", body_b="twin", point=(0.1, 0, 0.3)),),
        sensors=(Sensor(name="imu", quantity="part.linear_acceleration", target="chassis", rate=100.0, frame="body"),),
    )
    terrain = plane(0.05, 0.02)
    rocks = (
        Obstacle(name="ball", kind="sphere", pose=Pose(position=(0.8, 0.4, 0.0)), size=(0.15,)),
        Obstacle(name="block", kind="hull", pose=Pose(position=(0.0, 0.0, -0.05)), vertices=corners, material="steel"),
    )
    hard = replace(LUNAR_SOIL, name="bedrock")
    terrain = replace(
        terrain,
        soils=(*terrain.soils, hard),
        pairs=(
            *terrain.pairs,
            MaterialPair(response="rigid", soil="bedrock", friction=0.6),
            MaterialPair(response="rigid", friction=0.5, restitution=0.1),
        ),
        patches=(SoilPatch(name="slab", soil="bedrock", polygon=((-1.0, -1.0), (0.2, -1.0), (0.2, 1.0), (-1.0, 1.0))),),
        obstacles=rocks,
    )
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    watches = (
        Watch(name="far", quantity="part.position", target="chassis", above=0.001, action="command", drive="wheel_rear_left", value=0.5),
        Watch(name="contact", event="contact_begin", action="mark"),
    )
    scenario = Scenario(
        name="s",
        duration=1.0,
        gravity=(0, 0, -9.81),
        terrain="plane",
        placement="on_terrain",
        settle_time=0.02,
        commands=commands,
        watches=watches,
        initial_states=(InitialJointState(joint="mast", position=0.1),),
    )
    effects = (
        Effect(kind="multipass", parameters={"memory": 1.0}),
        Effect(kind="skid_scrub", parameters={"friction": 0.5}),
        Effect(kind="backlash", target="wheel_rear_left", parameters={"gap": 0.01}),
        Effect(kind="payload_slosh", target="chassis", parameters={"mass": 2.0}),
        Effect(kind="delay", target="imu", parameters={"delay": 0.01}),
        Effect(
            kind="expression",
            target="mast",
            parameters={
                "formula": "-k*velocity",
                "output": "joint.effort",
                "target_kind": "joint",
                "gain": 1.0,
                "constants": {"k": [0.1, "N m s/rad"]},
            },
        ),
    )
    path.unlink(missing_ok=True)
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, terrain)
    store.write_scenario(path, scenario)
    store.write_effects(path, effects)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
