"""Question: how far is a model from CAD and nominal densities from the machine that its makers identified?

Prints link masses, distances of the centres of mass from the joints, and inertias about the joints, beside the
identified values of design C.1. They differ, since densities are nominal and cables, bearings and glue are not drawn:
that is the point of stating measured masses in the sheet.
"""

from pathlib import Path

import numpy as np

from rille.cad import build
from rille.model.sheet import expand

HERE = Path(__file__).parent


def identified_values() -> dict[str, float]:
    """The makers' identified parameters: m [kg], lengths l, centres r [m], inertias about the joints I [kg m^2]."""
    text = expand("${RILLE_DATA}/data/cad/double_pendulum_identified_parameters.yml", HERE).read_text()
    return {key: float(value) for key, value in (line.split(":") for line in text.splitlines() if line.strip())}


def cad_values() -> dict[str, float]:
    """The same quantities of the model that the sheet builds."""
    rover = build(HERE / "pendulum.toml")
    joints = {joint.name: np.array(joint.point) for joint in rover.joints}
    bodies = {body.name: body.properties for body in rover.bodies}
    axis = np.array(next(j.axis for j in rover.joints if j.name == "shoulder"))
    values = {"l1": float(np.linalg.norm(np.cross(axis, joints["elbow"] - joints["shoulder"])))}
    weight = next(i for i in rover.instances if "weight_0_5kg" in i.path)
    values["l2"] = float(np.linalg.norm(np.cross(axis, np.array(weight.pose.position) - joints["elbow"])))
    for number, (link, joint) in enumerate((("upper_link", "shoulder"), ("lower_link", "elbow")), start=1):
        properties = bodies[link]
        arm = float(np.linalg.norm(np.cross(axis, properties.com - joints[joint])))
        values[f"m{number}"] = properties.mass
        values[f"r{number}"] = arm
        values[f"I{number}"] = float(axis @ properties.inertia @ axis) + properties.mass * arm**2
    return values


def main() -> None:
    """Print the table."""
    identified, cad = identified_values(), cad_values()
    meaning = {
        "m": "mass [kg]",
        "l": "length [m]",
        "r": "centre of mass from the joint [m]",
        "I": "inertia about the joint [kg m^2]",
    }
    print(f"{'quantity':<38} {'CAD':>9} {'identified':>11} {'difference':>11}")
    for link, number in (("upper link", 1), ("lower link", 2)):
        for symbol, text in meaning.items():
            key = f"{symbol}{number}"
            difference = 100 * (cad[key] / identified[key] - 1)
            print(f"{link + ': ' + text:<38} {cad[key]:9.4f} {identified[key]:11.4f} {difference:+10.1f} %")


if __name__ == "__main__":
    main()
