"""Question: how does the same rover look without a STEP file and without a sheet?

The assembly of ``make_rover.py`` with its bodies, joints and drives in Python; built like a sheet:

    .venv/bin/rille cad build examples/rover/rover.py -o rover.db
"""

from make_rover import (
    AXLE_X,
    BEAM_Z,
    BOGIE_PIVOT_X,
    GROUSER_HEIGHT,
    GROUSER_THICKNESS,
    GROUSERS,
    LEG_Y,
    ROCKER_PIVOT_Z,
    ROCKER_Y,
    TRACK_Y,
    WHEEL_RADIUS,
    WHEEL_WIDTH,
    rover,
)

from rille.cad import Mechanism

MASSES = {  # [kg] of structure with what is inside; the wheels weigh what aluminium weighs
    "body": 68.5,
    "pivot_shaft": 2.0,
    "deck": 7.0,
    "solar_cells": 2.5,
    "mast": 2.8,
    "camera_head": 3.2,
    "*_cameras": 0.4,
    "antenna": 0.6,
    "rocker_*": 5.0,
    "bogie_*": 4.0,
    "knuckle_*": 2.4,
}
KNUCKLE_Z = 418.0


def mm(*values: float) -> list[str]:
    """A point of the drawing."""
    return [f"{value} mm" for value in values]


def build() -> Mechanism:
    """The left side and what lies in the middle; the right side is its mirror image."""
    m = Mechanism(rover(), default_material="aluminium", mirror={"of": "_left", "to": "_right", "normal": "y"})
    for match, mass in MASSES.items():
        m.part(match, mass=mass)
    for name in ("chassis", "rocker_left", "bogie_left"):
        m.body(name, f"rover/{name}")
    swing = {"axis": [0, 1, 0], "lower": "-35 deg", "upper": "35 deg"}
    m.joint("rocker_left", "hinge", parent="chassis", child="rocker_left", point=mm(0, ROCKER_Y, ROCKER_PIVOT_Z), **swing)
    m.joint("bogie_left", "hinge", parent="rocker_left", child="bogie_left", point=mm(BOGIE_PIVOT_X, LEG_Y, BEAM_Z), **swing)
    m.differential("differential", carrier="chassis", joint_a="rocker_left", joint_b="rocker_right")
    for place, x in AXLE_X.items():
        carrier = "rocker_left" if place == "front" else "bogie_left"
        if place != "middle":
            knuckle, steering = f"knuckle_{place}_left", f"steering_{place}_left"
            m.body(knuckle, f"rover/{knuckle}")
            turn = {"axis": [0, 0, 1], "lower": "-60 deg", "upper": "60 deg"}
            m.joint(steering, "hinge", parent=carrier, child=knuckle, point=mm(x, TRACK_Y, KNUCKLE_Z), **turn)
            m.drive(steering, "position", max_torque="30 N m", max_speed="20 deg/s")
            carrier = knuckle
        wheel = f"wheel_{place}_left"
        m.body(wheel, f"rover/{wheel}")
        m.joint(wheel, "hinge", parent=carrier, child=wheel, point=mm(x, TRACK_Y, WHEEL_RADIUS), axis=[0, 1, 0])
        m.drive(wheel, "speed", max_torque="15 N m", max_speed="3 rad/s")
        grousers = {"count": GROUSERS, "height": f"{GROUSER_HEIGHT} mm", "thickness": f"{GROUSER_THICKNESS} mm"}
        m.wheel(wheel, radius=f"{WHEEL_RADIUS} mm", width=f"{WHEEL_WIDTH} mm", material="aluminium", grousers=grousers)
    return m
