"""Question: how are identified parameters stated on a sheet, where CAD gives others?

Writes ``identified.toml``: the drawing and the joints of ``pendulum.toml``, with the masses, centres, inertias, friction and motors that
the makers of the machine identified (``double_pendulum_identified_parameters.yml``); and ``frictionless.toml``, the same without friction.
Their equation of motion (q1 of the upper link from hanging down, q2 of the lower against the upper; inertias about the joints) is

    M11 = I1 + I2 + m2 l1^2 + 2 m2 l1 r2 cos q2 + (gr^2 + 1) Ir,  M12 = I2 + m2 l1 r2 cos q2 - gr Ir,  M22 = I2 + gr^2 Ir

with the friction b w + cf arctan(100 w). Ir is a rotor behind a gear of ratio gr: here each rotor is a body of its own on a hinge that
a [[gear]] ties to its joint, which gives these terms exactly. Dry friction is that of fast motion, cf pi/2 (94 % of it at 0.1 rad/s).

    .venv/bin/python examples/double_pendulum/make_identified.py
"""

import math
import re
from pathlib import Path

from rille.model.sheet import expand

HERE = Path(__file__).parent
PARAMETERS = "${RILLE_DATA}/data/cad/double_pendulum_identified_parameters.yml"
ROTOR = 0.07  # [kg] estimate, taken from the upper link; only the rotor's spin is identified
SLENDER = 1e-3  # [kg m^2] of a link about its own length: plays no part in the plane, but a body must have one

HEAD = """# The double pendulum as its makers identified it, from pendulum.toml and their parameters: written by make_identified.py.
#
# Masses, centres and inertias of the links are identified, and override what the drawing gives. The rotors of the motors turn 6 times as
# fast as their joints; the elbow's rotor turns against it.
"""


def identified() -> dict[str, float]:
    """The makers' parameters, SI."""
    text = expand(PARAMETERS, HERE).read_text()
    return {key: float(value) for key, value in (line.split(":") for line in text.splitlines() if line.strip())}


def link(p: dict[str, float], number: int, joint: tuple[float, float]) -> str:
    """Lines of [[body]] for a link: mass [kg], centre, inertia about it. joint : (y, z) of its joint in the drawing [mm]."""
    mass = p[f"m{number}"] - (ROTOR if number == 1 else 0.0)
    # The elbow's rotor sits at the end of the upper link, where the link's centre of mass is: taking it away leaves centre and spread.
    assert math.isclose(p["r1"], p["l1"])
    spread = p[f"I{number}"] - p[f"m{number}"] * p[f"r{number}"] ** 2
    center = joint[0] - 1e3 * p[f"r{number}"]
    numbers = ", ".join(f"{value:.8g}" for value in (spread, SLENDER, spread, 0, 0, 0))
    return f'mass = "{mass:.8g} kg"\ncom = ["0 mm", "{center:.8g} mm", "{joint[1]:g} mm"]\ninertia = [{numbers}]\n'


def rotor(p: dict[str, float], joint: str, parent: str, at: tuple[float, float], ratio: float) -> str:
    """Tables of a rotor. at : (y, z) of its joint in the drawing [mm]."""
    point = f'["0 mm", "{at[0]:g} mm", "{at[1]:g} mm"]'
    thin = f"{p['Ir'] / 2:.8g}"
    return f"""[[body]]
name = "rotor_{joint}"
mass = "{ROTOR} kg"
com = {point}
inertia = [{thin}, {thin}, {p["Ir"]:.8g}, 0, 0, 0]

[[joint]]
name = "rotor_{joint}"
kind = "hinge"
parent = "{parent}"
child = "rotor_{joint}"
point = {point}
axis = [0, 0, 1]

[[gear]]
name = "gear_{joint}"
joint_a = "{joint}"
joint_b = "rotor_{joint}"
ratio = {ratio:g}

[[drive]]
joint = "{joint}"
mode = "torque"
max_torque = "{p["tl1" if joint == "shoulder" else "tl2"]:g} N m"
"""


def friction(p: dict[str, float], number: int) -> str:
    """Line of a [[joint]]."""
    return f'friction = {{ coulomb = "{p[f"cf{number}"] * math.pi / 2:.6g} N m", viscous = "{p[f"b{number}"]:g} N m s/rad" }}\n'


def sheet(text: str, p: dict[str, float]) -> str:
    """The text of ``identified.toml`` from that of ``pendulum.toml``."""
    shoulder, elbow = (63.0, 97.5), (-137.0, 142.0)
    text = re.sub(r"\A(#.*\n)+", HEAD, text)
    for name, added in (
        ("upper_link", link(p, 1, shoulder)),
        ("lower_link", link(p, 2, elbow)),
        ("shoulder", friction(p, 1)),
        ("elbow", friction(p, 2)),
    ):
        text = text.replace(f'name = "{name}"\n', f'name = "{name}"\n{added}')
    text = text.replace('parts = ["*/motor_mount"', 'mass = "1 kg"  # held by the world\nparts = ["*/motor_mount"')
    rotors = (rotor(p, "shoulder", "stand", shoulder, p["gr"]), rotor(p, "elbow", "upper_link", elbow, -p["gr"]))
    return "\n".join([text, *rotors])


if __name__ == "__main__":
    made = sheet((HERE / "pendulum.toml").read_text(encoding="utf-8"), identified())
    (HERE / "identified.toml").write_text(made, encoding="utf-8")
    (HERE / "frictionless.toml").write_text(re.sub(r"friction = .*\n", "", made), encoding="utf-8")
    print(f"wrote {HERE / 'identified.toml'} and frictionless.toml")
