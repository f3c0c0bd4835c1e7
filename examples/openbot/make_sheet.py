"""Question: how do the 25 printed parts of the OpenBot MTV fit together, with no assembly drawing?

By their holes. Its page (isl-org/OpenBot, body/mtv/README.md) says which part is bolted to which; the bolt holes and pivots of the parts
say where: this script puts hole onto hole, turns the rocker until all six axles are level, and writes ``openbot.toml``. Points below are
centres of holes in the frames of the parts [mm], as ``rille cad inspect`` and :func:`rille.cad.suggestion.features.cylinders` show them;
``tests/cad/test_openbot.py`` looks whether the holes of the built model are in line.

    .venv/bin/python examples/openbot/make_sheet.py
"""

import csv
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar
from scipy.spatial.transform import Rotation

from rille.cad import load_assembly
from rille.model.sheet import expand

HERE = Path(__file__).parent
Vector = NDArray[np.float64]

DATA = "${RILLE_DATA}/data/cad/openbot_mtv"

WHEEL_RADIUS = 62.5
GAP = 10.0  # nuts on the threaded rod between bearing cover and rocker
HUB = 40.0  # from the motor's face to the middle of the wheel: hexagonal hub, and half a wheel that clears the enclosure
ROD = np.array([0.0, 225.0, 35.0])  # guide holes in the side walls of the compartment, in its frame: the axis of the rocker
FORWARD, LEFT, UP = np.eye(3)
MOTOR, WHEEL = 180.0, 160.0  # [g]
REST = 12.4  # angle of the rockers at which their springs rest [deg]: the chassis is level under its weight

HEAD = """# The OpenBot MTV (isl-org/OpenBot, MIT), a six-wheel rocker-bogie, from its printed parts. Written by make_sheet.py: see there.
#
# Frame: x forward, y left, z up; origin on the ground below the rod that the rockers turn on. The right side is declared, the left one is
# its mirror image, but for the joint of the rocker, which is printed as a part of its own. Level axles: rocker {angle:.2f} deg nose down,
# rod {height:.1f} mm up.
# Masses of printed parts: as weighed by group (quantities.csv), within a group by volume. Bought parts: estimates, each says of what.
tolerance = "0.5 mm"

[mirror]
of = "_right"
to = "_left"

[budget]
mass = "6.038 kg"
"""

JOINTS = """# The rod through the guide holes of the side walls. There is no differential: a shock absorber between each mid leg and the
# wall carries the chassis. About the rod it is a spring of 4.4 N m/rad (400 N/m at 0.105 m), at rest {rest} with the chassis level: two
# elastic stops that meet.
[[frame]]
name = "rod_right"
part = "chassis/rear"
cylinder = {{ radius = "0.6 mm", near = ["6 mm", "225 mm", "35 mm"] }}

[[frame]]
name = "rod_left"
part = "chassis/rear"
cylinder = {{ radius = "0.6 mm", near = ["267 mm", "225 mm", "35 mm"] }}

[[joint]]
name = "rocker_right"
kind = "hinge"
parent = "chassis"
child = "rocker_right"
at = "rod_right"
axis = [0, 1, 0]
lower = "{low} deg"
upper = "{high} deg"
stop = {{ stiffness = "4.4 N m/rad", damping = "0.3 N m s/rad" }}

[[frame]]
name = "pivot_right"
part = "rocker_right/end_joint"
cylinder = {{ radius = "3.25 mm" }}

[[joint]]
name = "bogie_right"
kind = "hinge"
parent = "rocker_right"
child = "bogie_right"
at = "pivot_right"
axis = [0, 1, 0]
lower = "-35 deg"  # at 35.6 deg the front leg meets the mid leg: `rille cad check`
upper = "35 deg"
"""


@dataclass(frozen=True)
class Part:
    """A placed part. rotation : (3, 3), its axes in the drawing. position : of its origin [mm]."""

    name: str
    file: str
    rotation: Vector
    position: Vector

    def at(self, *point: float) -> Vector:
        """A point of the part in the drawing [mm]."""
        return self.rotation @ np.array(point) + self.position


def turned(y: Vector, z: Vector) -> Vector:
    """Rotation that turns a part's y and z axes into these directions."""
    return np.column_stack([np.cross(y, z), y, z])


def pitched(angle: float) -> Vector:
    """Rotation about the lateral axis, nose down for a positive angle [rad]."""
    return Rotation.from_euler("y", angle).as_matrix()


def fitted(name: str, file: str, rotation: Vector, hole: tuple[float, float, float], onto: Vector) -> Part:
    """The part whose hole comes to lie at a point of the drawing."""
    return Part(name, file, rotation, onto - rotation @ np.array(hole))


def motor(name: str, leg: Part, end: tuple[float, float, float], down: Vector) -> tuple[list[Part], Vector]:
    """Bracket, both halves of the enclosure and wheel at the free end of a leg; and the centre of the wheel.

    The bracket's plug is bolted into the leg; the halves slide through the bracket, which sits on the rim of the bottom half (four
    bolts); the shaft comes out of the top half, off its middle towards the leg as drawn.
    """
    axes = turned(-LEFT, -down)
    bracket = fitted(f"{name}/bracket", "MotorAssembly/Motor_Bracket", axes, (28.75, 12.25, 77.5), leg.at(*end))
    bottom = fitted(f"{name}/enclosure_bottom", "MotorAssembly/MotorEnclosure_Bottom", axes, (-3, 24, 28.75), bracket.at(-3, 0, 28.75))
    top = fitted(f"{name}/enclosure_top", "MotorAssembly/MotorEnclosure_Top", axes, (26.5, 0, 26.5), bottom.at(28.75, 4, 28.75))
    return [bracket, bottom, top], top.at(26.5, 70 + HUB, 33.5)


def side(nose_down: float, rod: Vector) -> tuple[dict[str, list[Part]], dict[str, Vector]]:
    """Parts of the right side by body, and the named points: pivots and wheel centres. nose_down : pitch of the rocker [rad]."""
    tilt = pitched(nose_down)
    lateral = np.array([0, -137.5 - 10 - GAP - 33, 0])  # wall, bearing cover, nuts, and the half of the joint towards the wall
    joint = fitted("rocker_right/joint_100", "Joints/100deg_Joint", tilt, (15.001, 0, 10.725), rod + lateral)
    ahead, back = tilt @ FORWARD, tilt @ np.array([-0.1673, 0, -0.9859])  # plugs of the joint; the second is 99.6 deg from the first
    middle = fitted(
        "rocker_right/mid_leg", "Legs/Mid_Leg", turned(np.cross(ahead, LEFT), ahead), (16.5, 16.5, 12.5), joint.at(40.7, 16, 11.818)
    )
    rear = fitted("rocker_right/rear_leg", "Legs/Rear_Leg", turned(LEFT, back), (16.5, 16.5, 12.5), joint.at(9.844, -28, -12.223))
    end = fitted("rocker_right/end_joint", "Joints/End_Joint", turned(LEFT, -ahead), (16, 16, 44.5), middle.at(16.5, 16.5, 145))
    cover = fitted("rocker_right/bearing_cover", "BearingCover/BearingCover", tilt @ turned(-FORWARD, UP), (0, 0, 0), end.at(16, 0, 19.5))
    pivot = end.at(16, -10, 19.5)
    angle = np.radians(45)
    corner = fitted("bogie_right/joint_90", "Joints/90deg_Joint", pitched(angle), (16.772, 29.5, 36.728), pivot - 0.5 * LEFT)
    legs, hubs = {}, {}
    for place, hole, down in (
        ("front", (42, 12, 41.5), pitched(angle) @ FORWARD),
        ("middle", (12, 12, 11.5), pitched(angle) @ -UP),
    ):
        leg = fitted(f"bogie_right/leg_{place}", "Legs/Front_Leg", turned(LEFT, down), (16.5, 16.5, 12.5), corner.at(*hole))
        module, hubs[place] = motor(f"bogie_right/motor_{place}", leg, (16.5, 16.5, 47.5), down)
        legs[place] = [leg, *module]
    module, hubs["rear"] = motor("rocker_right/motor_rear", rear, (16.5, 16.5, 123), back)
    bodies = {"rocker_right": [joint, middle, rear, end, cover, *module], "bogie_right": [corner, *legs["front"], *legs["middle"]]}
    for place, hub in hubs.items():
        bodies[f"wheel_{place}_right"] = [Part(f"wheel_{place}_right/wheel", "wheel.py", np.eye(3), hub)]
    return bodies, {"rod": joint.at(15.001, -5.5, 10.725), "pivot": corner.at(16.772, 12, 36.728), **hubs}


def level() -> tuple[float, float]:
    """Pitch of the rocker [rad] and height of the rod [mm] at which all axles are at the height of a wheel's radius."""

    def slope(angle: float) -> float:
        points = side(angle, np.zeros(3))[1]
        return float(points["middle"][2] - points["rear"][2])

    angle = root_scalar(slope, bracket=(0, 1)).root
    return angle, WHEEL_RADIUS - float(side(angle, np.zeros(3))[1]["rear"][2])


def compartment(height: float) -> list[Part]:
    """Parts of the chassis. They are drawn in one frame (x to the left, y to the rear) but for a few."""
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    origin = np.array([0, -137.5, height]) - turn @ ROD

    def put(name: str, file: str, shift: tuple[float, float, float] = (0, 0, 0), about: Vector | None = None) -> Part:
        rotation = turn if about is None else turn @ about
        return Part(f"chassis/{name}", file, rotation, origin + turn @ np.array(shift))

    round_z = Rotation.from_euler("z", 180, degrees=True).as_matrix()
    parts = [
        put("front", "Compartment/Compartment_Front"),
        put("rear", "Compartment/Compartment_Rear"),
        put("roof_front", "Compartment/Roof_Front"),
        put("roof_rear", "Compartment/Roof_Rear"),
        put("door", "Compartment/Compartment_Door"),
        put("buffer_left", "Buffer/Buffer_Right"),  # the files call left what is left to somebody who faces the machine
        put("buffer_right", "Buffer/Buffer_Left"),
        put("battery_mount_1", "Compartment/Compartment_Battery_Mount-P1", (0, -20, 0)),  # its bore onto the rod
        put("battery_mount_2", "Compartment/Compartment_Battery_Mount-P2", (0, -20, 0)),
        put("phone_mount", "PhoneMount/Phone_Mount", (87.5, 25, 97)),  # four holes over those of the roof, on 8 mm isolators
        put("name_front", "Buffer/Name_Front", (1.5, 20, 0)),  # onto the front wall
        put("name_back", "Buffer/Name_Back", (1.5, 20, 0)),
        put("bearing_cover_right", "BearingCover/BearingCover", (0, 225, 35)),
        put("bearing_cover_left", "BearingCover/BearingCover", (275, 225, 35), round_z),
    ]
    for name, x in (("right", 0.0), ("left", 207.0)):  # sockets over the cable holes of the roof: 34 and 241
        parts.append(put(f"headlight_{name}", "Compartment/Headlight_Front", (x, 0, 0)))
        parts.append(put(f"headlight_cap_{name}", "Compartment/Headlight_Rear", (x, 0, 0)))
        tail = (68.0 + x, 62 + 260.5, -5)
        parts.append(put(f"taillight_{name}", "Compartment/Headlight_Front", tail, round_z))
        parts.append(put(f"taillight_cap_{name}", "Compartment/Headlight_Rear", tail, round_z))
    return parts


def printed_masses() -> dict[str, float]:
    """Printed mass of one part [g] by its name: that of its group, shared by volume (quantities.csv gives masses per group)."""
    with expand(f"{DATA}/quantities.csv", HERE).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    groups: list[tuple[float, list[tuple[str, int, float]]]] = []
    for row in rows:
        if row["printed_mass_g_of_group"]:
            groups.append((float(row["printed_mass_g_of_group"].split()[0]), []))
        part = load_assembly(expand(f"{DATA}/{row['file']}", HERE)).prototypes[0]
        groups[-1][1].append((part.name, int(row["quantity"]), part.volume.volume))
    masses = {}
    for grams, parts in groups:
        volume = sum(count * v for _, count, v in parts)
        masses |= {name: grams * v / volume for name, _, v in parts}
    return masses


def numbers(values: Iterable[float], digits: int = 3) -> str:
    """Lengths of the sheet."""
    return ", ".join(f'"{round(float(v), digits) + 0.0:g} mm"' for v in values)


def place(part: Part) -> str:
    """Where a part is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # at a pitch of 90 deg one angle is free; it is put to zero
        angles = Rotation.from_matrix(part.rotation).as_euler("xyz", degrees=True)
    file = part.file if part.file.endswith(".py") else f"{DATA}/{part.file}.step"
    turns = ", ".join(f'"{round(float(a), 4) + 0.0:g} deg"' for a in angles)
    return f"""[[place]]
name = "{part.name}"
file = "{file}"
body = "{part.name.split("/")[0]}"
position = [{numbers(part.position)}]
rpy = [{turns}]
"""


def mass(name: str, body: str, grams: float, at: Vector, size: tuple[float, float, float], note: str) -> str:
    """A lumped mass."""
    return f"""[[mass]]  # {note}
name = "{name}"
body = "{body}"
mass = "{grams:g} g"
at = [{numbers(at, 1)}]
size = [{numbers(size)}]
"""


def lumps(chassis: Part, bodies: dict[str, list[Part]]) -> list[str]:
    """What is bought: motors, battery, electronics."""
    lines = [
        mass("battery", "chassis", 340, chassis.at(137.5, 262, 14), (138, 47, 28), "4500 mAh 3S LiPo in a hard case"),
        mass("boards", "chassis", 260, chassis.at(137.5, 140, 48), (200, 180, 20), "power board, 2 motor drivers, converter, ESP32"),
        mass("cables", "chassis", 200, chassis.at(137.5, 150, 20), (200, 250, 30), "7-core cable, glands, switches, lights"),
        mass("rod", "chassis", 75, chassis.at(137.5, 225, 35), (6, 360, 6), "M6 threaded rod, 0.36 m with its nuts"),
        mass("phone", "chassis", 250, chassis.at(137.5, 60, 150), (20, 75, 150), "phone with its holder"),
    ]
    for body, parts in bodies.items():
        for top in (part for part in parts if part.name.endswith("enclosure_top")):
            name = top.name.split("/")[1]
            lines.append(mass(f"{name}_right", body, MOTOR, top.at(26.5, 37.5, 26.5), (37, 57, 37), "JGB37-520 with encoder"))
    leg = next(part for part in bodies["rocker_right"] if part.name.endswith("mid_leg"))
    lines.append(mass("shock_right", "rocker_right", 45, leg.at(16.5, 16.5, 102.5) + 12 * LEFT, (16, 16, 90), "90 mm shock absorber"))
    lines.append(mass("bolts_rocker_right", "rocker_right", 60, leg.at(16.5, 16.5, 60), (200, 40, 40), "bolts, nuts, cable"))
    corner = bodies["bogie_right"][0]
    lines.append(mass("bolts_bogie_right", "bogie_right", 60, corner.at(16.8, 12, 20), (120, 40, 60), "bolts, nuts, cable"))
    return lines


def wheels(hubs: dict[str, Vector]) -> list[str]:
    """Joint, wheel and drive of the right wheels: on the bores through which the motors' shafts come."""
    lines = []
    for where, hub in hubs.items():
        body = "rocker_right" if where == "rear" else "bogie_right"
        name = f"wheel_{where}_right"
        lines.append(f"""[[frame]]
name = "shaft_{where}_right"
part = "{body}/motor_{where}/enclosure_top"
cylinder = {{ radius = "6.25 mm", near = ["26.5 mm", "68 mm", "33.5 mm"] }}

[[joint]]
name = "{name}"
kind = "hinge"
parent = "{body}"
child = "{name}"
at = "shaft_{where}_right"
axis = [0, 1, 0]

[[wheel]]
joint = "{name}"
radius = "{WHEEL_RADIUS:g} mm"
width = "70 mm"
center = [{numbers(hub)}]

[[drive]]
joint = "{name}"
mode = "speed"
motor = {{ stall_torque = "1.0 N m", no_load_speed = "178 rpm" }}
""")
    return lines


def shape(body: str) -> str:
    """Collision shape: a hull around the chassis; rockers and bogies are bent, so piece by piece of each part."""
    return 'collision = "auto"\n' if body.startswith(("rocker", "bogie")) else ""


def sheet() -> str:
    """The text of ``openbot.toml``."""
    angle, height = level()
    bodies, points = side(angle, np.array([0, 0, height]))
    chassis = compartment(height)
    joint = bodies["rocker_right"][0]
    twin = Part(
        "rocker_left/joint_100", "Joints/100deg_Joint_Mirror", joint.rotation, joint.position * [1, 0, 1] - (56 + joint.position[1]) * LEFT
    )
    parts = [*chassis, *(part for body in bodies.values() for part in body), twin]
    masses = [f'[[part]]\nmatch = "{name}"\nmass = "{grams:.2f} g"\n' for name, grams in printed_masses().items()]
    hubs = {where: points[where] for where in ("front", "middle", "rear")}
    return "\n".join(
        [
            HEAD.format(angle=np.degrees(angle), height=height),
            *masses,
            f'[[part]]\nmatch = "wheel"\nmass = "{WHEEL:g} g"  # assumed\n',
            *map(place, parts),
            *lumps(chassis[0], bodies),
            *(f'[[body]]\nname = "{body}"\n{shape(body)}' for body in ("chassis", *bodies)),
            JOINTS.format(rest=f"{REST:g} deg", low=REST - 0.1, high=REST + 0.1),
            *wheels(hubs),
        ]
    )


if __name__ == "__main__":
    (HERE / "openbot.toml").write_text(sheet(), encoding="utf-8")
    print(f"wrote {HERE / 'openbot.toml'}")
