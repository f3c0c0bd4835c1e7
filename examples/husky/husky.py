"""The Husky A200 as far as replaying its drives needs it: body, top plate, bumpers and four wheels. x forward, z up, ground at z = 0, mm.

Wheel radius and distance of the wheels across are those of the recordings (165 and 550 mm); wheelbase, width of the wheels and size of
the body those of its published description (husky/husky, husky_description/urdf, BSD). Shapes are ours.
"""

import cadquery as cq

RADIUS, WIDTH = 165.0, 114.3
WHEELBASE, TRACK = 512.0, 550.0
BODY = (987.4, 410.0, 247.5)
FLOOR = 132.3  # height of the body's underside: axles lie 32.8 mm above it
YELLOW, DARK, BLACK = cq.Color(0.95, 0.75, 0.1), cq.Color(0.22, 0.22, 0.24), cq.Color(0.1, 0.1, 0.11)


def wheel() -> cq.Workplane:
    """A wheel about the y axis with its middle in the origin."""
    disc = cq.Workplane("XZ", origin=(0, WIDTH / 2, 0)).circle(RADIUS).circle(70).extrude(WIDTH).edges("%CIRCLE").fillet(8)
    return disc.union(cq.Workplane("XZ", origin=(0, WIDTH / 2 - 20, 0)).circle(71).extrude(WIDTH - 40))


def chassis() -> cq.Assembly:
    """Body, plate and bumpers."""
    length, width, height = BODY
    body = cq.Workplane().box(0.8 * length, width, height).edges("|Y").chamfer(30).translate((0, 0, FLOOR + height / 2))
    plate = cq.Workplane().box(0.75 * length, 571, 6).translate((0, 0, FLOOR + height + 3))
    bumper = cq.Workplane().box(0.1 * length, 571, 80).edges("|Z").fillet(20)
    assembly = cq.Assembly(name="chassis").add(body, name="body", color=YELLOW).add(plate, name="top_plate", color=DARK)
    for name, side in (("front_bumper", 1), ("rear_bumper", -1)):
        assembly.add(bumper, name=name, loc=cq.Location((side * 0.45 * length, 0, FLOOR + 110)), color=DARK)
    return assembly


def build() -> cq.Assembly:
    """The whole machine."""
    husky = cq.Assembly(name="husky").add(chassis())
    for end, x in (("front", WHEELBASE / 2), ("rear", -WHEELBASE / 2)):
        for side, y in (("left", TRACK / 2), ("right", -TRACK / 2)):
            husky.add(wheel(), name=f"{end}_{side}", loc=cq.Location((x, y, RADIUS)), color=BLACK)
    return husky
