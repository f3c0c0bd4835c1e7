"""Question: which part masses and placements make the SO-101 arm of its STEP files the arm of its published URDF?

The URDF (TheRobotStudio/SO-ARM100, Apache-2.0) is the assembly drawing here: the origins of its visuals place the parts, whose STEP
frames are those of its meshes (millimetres against metres). Its links give mass and centre only per link; the masses of the parts
follow from them by non-negative least squares. Writes ``so101.toml``, which is then read without the URDF. Run it again only if the
parts change:

    .venv/bin/python examples/so101/make_sheet.py
"""

import functools
import re
import warnings
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from rille.cad import Prototype, load_assembly
from rille.model.rotation import from_rpy
from rille.model.sheet import expand

HERE = Path(__file__).parent
STEP = "${RILLE_DATA}/data/cad/so101/STEP"
URDF = "${RILLE_DATA}/data/cad/so101/Simulation/so101_new_calib.urdf"

FILES = {  # mesh of the URDF (without version) -> STEP file
    "base_motor_holder_so101": "Base_motor_holder_SO101",
    "base_so101": "Base_SO101",
    "sts3215_03a": "STS3215_03a",
    "sts3215_03a_no_horn": "STS3215_03a",  # the only part without a STEP file of its own
    "waveshare_mounting_plate_so101": "WaveShare_Mounting_Plate_SO101",
    "motor_holder_so101_base": "Motor_holder_SO101_Base",
    "rotation_pitch_so101": "Rotation_Pitch_SO101",
    "upper_arm_so101": "Upper_arm_SO101",
    "under_arm_so101": "Under_arm_SO101",
    "motor_holder_so101_wrist": "Motor_holder_SO101_Wrist",
    "wrist_roll_pitch_so101": "Wrist_Roll_Pitch_SO101",
    "wrist_roll_follower_so101": "Follower_Specific/Wrist_Roll_Follower_SO101",
    "moving_jaw_so101": "Follower_Specific/Moving_Jaw_SO101",
}
HEAD = """# The SO-101 arm (TheRobotStudio/SO-ARM100, Apache-2.0) from its STEP parts with stated masses. Written by make_sheet.py.
#
# Placements: the origins of the visuals of its URDF at the zero pose; frame of the drawing = base link, z up, x to the front.
# Masses: fitted to mass and centre of the URDF's links (non-negative least squares, before rounding within 0.02 g of a whole gram),
# stated in whole grams. The servo comes out at 58 g in five links independently. Their inertias are those of the drawn solids.
# The wrist's servo ("no horn") has no STEP file; the one with a horn stands in for it, and 1 g more, as the wrist's mass and centre ask.
# Joint axes: the horns of the servos, by their cylinders. Limits and ways of turning: the URDF; no geometry tells them.
# Friction and torque: joints_properties.xml beside the URDF (for MuJoCo).
tolerance = "0.3 mm"
"""


@dataclass(frozen=True)
class Placed:
    """A part in the drawing. name : of its [[place]]. file : its STEP file. matrix : (4, 4), part -> drawing [m]."""

    name: str
    file: str
    body: str
    matrix: NDArray[np.float64]


def below(element: ET.Element, path: str) -> ET.Element:
    """The element at a path below another one."""
    found = element.find(path)
    if found is None:
        raise SystemExit(f"the URDF has no <{path}> in <{element.tag} name='{element.attrib.get('name', '')}'>")
    return found


def numbers(text: str) -> NDArray[np.float64]:
    """Numbers of an attribute."""
    return np.array([float(word) for word in text.split()])


def pose(origin: ET.Element) -> NDArray[np.float64]:
    """(4, 4) of an <origin>, metres; right angles, which the URDF gives to six digits, are made exact."""
    rpy = numbers(origin.attrib["rpy"])
    right = np.round(rpy / (np.pi / 2)) * np.pi / 2
    matrix = np.eye(4)
    matrix[:3, :3] = from_rpy(*np.where(np.abs(rpy - right) < 1e-5, right, rpy))
    matrix[:3, 3] = numbers(origin.attrib["xyz"])
    return matrix


def angles(rotation: NDArray[np.float64]) -> list[str]:
    """Roll, pitch, yaw of R = Rz Ry Rx as the sheet writes them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # at a pitch of 90 deg one angle is free; it is put to zero
        return [quantity(v, 5, "deg") for v in Rotation.from_matrix(rotation).as_euler("xyz", degrees=True)]


def quantity(value: float, digits: int, unit: str) -> str:
    """A number with its unit, without trailing zeros and without minus zero."""
    return f'"{round(float(value), digits) + 0.0:.10g} {unit}"'


def link_frames(robot: ET.Element) -> dict[str, NDArray[np.float64]]:
    """Frames of the links at the zero pose, (4, 4) in the base link."""
    frames = {"base_link": np.eye(4)}
    joints = robot.findall("joint")
    while len(frames) <= len(joints):
        for joint in joints:
            parent, child = (below(joint, key).attrib["link"] for key in ("parent", "child"))
            if parent in frames:
                frames[child] = frames[parent] @ pose(below(joint, "origin"))
    return frames


def placed_parts(robot: ET.Element, frames: dict[str, NDArray[np.float64]]) -> list[Placed]:
    """Every visual of the URDF as a part."""
    found = []
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            mesh = re.sub(r"_v\d+$", "", Path(below(visual, "geometry/mesh").attrib["filename"]).stem)
            body = body_name(link.attrib["name"])
            name = "servo" if mesh.startswith("sts3215") else mesh.replace("_so101", "")
            matrix = frames[link.attrib["name"]] @ pose(below(visual, "origin"))
            found.append(Placed(f"{body}/{name}", FILES[mesh], body, matrix))
    return found


def body_name(link: str) -> str:
    """Name of the body of a link."""
    return link.removesuffix("_link").removesuffix("_so101_v1")


def fitted_masses(robot: ET.Element, frames: dict[str, NDArray[np.float64]], parts: list[Placed]) -> dict[str, float]:
    """Mass of every placed part [kg], so that link mass and first moment (over 5 cm, to weigh them alike) are met best."""
    masses = {}
    for link in robot.findall("link"):
        inertial = below(link, "inertial")
        mass, center = float(below(inertial, "mass").attrib["value"]), numbers(below(inertial, "origin").attrib["xyz"])
        frame = frames[link.attrib["name"]]
        center = frame[:3, :3] @ center + frame[:3, 3]
        mine = [p for p in parts if p.body == body_name(link.attrib["name"])]
        if not mine:
            continue
        offsets = [center_of_mass(p) - center for p in mine]
        rows = np.vstack([np.ones(len(mine)), np.transpose(offsets) / 0.05])
        fitted, _ = nnls(rows, np.array([mass, 0, 0, 0]))
        masses |= {p.name: float(value) for p, value in zip(mine, fitted, strict=True)}
    return masses


def center_of_mass(part: Placed) -> NDArray[np.float64]:
    """Centre of mass of a part in the drawing [m]."""
    solid = solid_of(part.file)
    return part.matrix[:3, :3] @ solid.volume.com + part.matrix[:3, 3]


@functools.cache
def solid_of(file: str) -> Prototype:
    """The part of a STEP file that has a solid, at the origin of its file; the cable clips beside it are free surfaces."""
    assembly = load_assembly(expand(f"{STEP}/{file}.step", HERE))
    return next(p for p in assembly.prototypes if p.n_solids)


def sheet(robot: ET.Element) -> str:
    """The text of ``so101.toml``."""
    frames = link_frames(robot)
    parts = placed_parts(robot, frames)
    masses = {name: round(1e3 * mass) for name, mass in fitted_masses(robot, frames, parts).items()}
    lines = [HEAD]
    lines += [place(part) for part in parts]
    for file in dict.fromkeys(part.file for part in parts):
        fitted = [masses[part.name] for part in parts if part.file == file]
        name = solid_of(file).name
        lines.append(f'[[part]]\nmatch = "{Path(file).name if name == "SOLID" else name}"\nmass = "{min(fitted)} g"\n')
        lines += [rest(part, masses[part.name] - min(fitted)) for part in parts if part.file == file and masses[part.name] > min(fitted)]
    lines += [f'[[body]]\nname = "{body}"\n' for body in dict.fromkeys(p.body for p in parts)]
    lines.append('[[joint]]\nname = "mount"\nkind = "fixed"\nchild = "base"\n')
    hinges = [joint for joint in robot.findall("joint") if joint.attrib["type"] == "revolute"]
    return "\n".join(lines + [hinge(joint, frames) for joint in reversed(hinges)])


def place(part: Placed) -> str:
    """Where a part is."""
    return f"""[[place]]
name = "{part.name}"
file = "{STEP}/{part.file}.step"
body = "{part.body}"
position = [{", ".join(quantity(1e3 * v, 4, "mm") for v in part.matrix[:3, 3])}]
rpy = [{", ".join(angles(part.matrix[:3, :3]))}]
"""


def rest(part: Placed, grams: int) -> str:
    """What an instance weighs more than the others of its kind, spread over its box."""
    size = np.abs(part.matrix[:3, :3]) @ np.diff(solid_of(part.file).bounds, axis=0)[0]
    return f"""[[mass]]
name = "rest_of_{part.name.replace("/", "_")}"
body = "{part.body}"
mass = "{grams} g"
at = [{", ".join(quantity(1e3 * v, 2, "mm") for v in center_of_mass(part))}]
size = [{", ".join(quantity(1e3 * v, 1, "mm") for v in size)}]
"""


def hinge(joint: ET.Element, frames: dict[str, NDArray[np.float64]]) -> str:
    """Tables of a joint: its frame at the horn of the parent's servo, its limits, its friction and its drive."""
    name, limit = joint.attrib["name"], below(joint, "limit").attrib
    parent, child = (below(joint, key).attrib["link"] for key in ("parent", "child"))
    axis = frames[child][:3, :3] @ numbers(below(joint, "axis").attrib["xyz"])
    return f"""[[frame]]
name = "{name}_horn"
part = "{body_name(parent)}/servo"
cylinder = {{ radius = "10 mm", near = ["12.5 mm", 0, 0] }}

[[joint]]
name = "{name}"
kind = "hinge"
parent = "{body_name(parent)}"
child = "{body_name(child)}"
at = "{name}_horn"
axis = [{", ".join(f"{v + 0.0:.8g}" for v in np.round(axis, 8))}]
lower = "{limit["lower"]} rad"
upper = "{limit["upper"]} rad"
friction = {{ coulomb = "0.052 N m", viscous = "0.6 N m s/rad" }}

[[drive]]
joint = "{name}"
mode = "torque"
max_torque = "3.35 N m"
"""


if __name__ == "__main__":
    text = sheet(ET.parse(expand(URDF, HERE)).getroot())
    (HERE / "so101.toml").write_text(text, encoding="utf-8")
    print(f"wrote {HERE / 'so101.toml'}")
