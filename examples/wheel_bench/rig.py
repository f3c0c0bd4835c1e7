"""A single-wheel rig: a carriage and a wheel on its axle. x forward, z up, mm; the rim touches z = 0.

Published: radius, width and height of the fins. Ours: everything that the bench does not feel, such as rim thickness and carriage.
"""

import cadquery as cq

from rille.cad import Mechanism

RIM, HUB = 4.0, 12.0
STEEL, GREY = cq.Color(0.55, 0.57, 0.60), cq.Color(0.30, 0.31, 0.34)


def wheel(radius: float, width: float, fins: int = 0, fin_height: float = 0.0) -> cq.Workplane:
    """Rim, disc and hub about the y axis with the middle in the origin; fins are straight blades across the rim."""
    plane = cq.Workplane("XZ", origin=(0, width / 2, 0))
    shape = plane.circle(radius).circle(radius - RIM).extrude(width)
    shape = shape.union(cq.Workplane("XZ", origin=(0, 2, 0)).circle(radius - RIM / 2).extrude(4)).union(plane.circle(HUB).extrude(width))
    blade = cq.Workplane().box(fin_height + 2, width, 2).translate((radius + fin_height / 2 - 1, 0, 0)) if fins else None
    for k in range(fins):
        shape = shape.union(blade.rotate((0, 0, 0), (0, 1, 0), 360.0 * k / fins))
    return shape


def rig(radius: float, width: float, fins: int = 0, fin_height: float = 0.0) -> Mechanism:
    """Carriage and wheel as a mechanism with one driven joint, ``wheel``."""
    axle = (0, 0, radius)
    post = cq.Workplane().box(30, 12, 2.4 * radius).translate((0, width / 2 + 14, 2.0 * radius))
    pin = cq.Workplane("XZ", origin=(0, width / 2 + 14, radius)).circle(6).extrude(14)
    assembly = cq.Assembly(name="rig").add(post.union(pin), name="carriage", color=GREY)
    assembly.add(wheel(radius, width, fins, fin_height), name="wheel", loc=cq.Location(axle), color=STEEL)
    m = Mechanism(assembly, default_material="aluminium")
    m.material("aluminium", density="2700 kg/m^3", source="EN AW-6061, nominal")
    for name in ("carriage", "wheel"):
        m.body(name, f"rig/{name}")
    m.joint("wheel", "hinge", parent="carriage", child="wheel", point=[f"{value} mm" for value in axle], axis=[0, 1, 0])
    m.drive("wheel", "speed", max_torque="20 N m")
    grousers = {"grousers": {"count": fins, "height": f"{fin_height} mm", "thickness": "2 mm"}} if fins else {}
    m.wheel("wheel", radius=f"{radius} mm", width=f"{width} mm", **grousers)
    return m
