"""Question: how does a CAD assembly look that rille can drive?

Draws a six-wheel rocker-bogie rover of the 140 kg class (Yutu, MER) in CadQuery and exports it as ``rover.step``. The
sheet ``rover.toml`` beside it says which parts move together and how. Run it again after changing a dimension:

    .venv/bin/python examples/rover/make_rover.py
"""

import math
import re
from pathlib import Path

import cadquery as cq

HERE = Path(__file__).parent

# Dimensions [mm]. x forward, y left, z up; the rims touch z = 0 at the zero pose.
WHEEL_RADIUS = 150.0
WHEEL_WIDTH = 165.0
GROUSERS = 24
GROUSER_HEIGHT = 10.0
GROUSER_THICKNESS = 6.0
AXLE_X = {"front": 620.0, "middle": 0.0, "rear": -620.0}
TRACK_Y = 500.0  # half the track: centre of the wheels
LEG_Y = 385.0  # legs and bogies run inside the wheels
ROCKER_Y = 345.0
BEAM_Z = 440.0  # height of the beams' ends and of the bogie pivots
ROCKER_PIVOT_Z = 520.0
BOGIE_PIVOT_X = -310.0

GOLD, DARK, WHITE, GREY, BLUE, BLACK = (
    cq.Color(*rgb)
    for rgb in (
        (0.78, 0.58, 0.20),
        (0.16, 0.17, 0.20),
        (0.85, 0.86, 0.88),
        (0.42, 0.44, 0.47),
        (0.05, 0.09, 0.28),
        (0.03, 0.03, 0.04),
    )
)


def box(x: float, y: float, z: float, center: tuple[float, float, float], fillet: float = 0.0) -> cq.Workplane:
    """Box of the given lengths around a centre."""
    shape = cq.Workplane().box(x, y, z)
    if fillet:
        shape = shape.edges("|Z").fillet(fillet)
    return shape.translate(center)


def rod(radius: float, start: tuple[float, float, float], end: tuple[float, float, float]) -> cq.Workplane:
    """Round bar between two points."""
    direction = cq.Vector(*end) - cq.Vector(*start)
    return cq.Workplane(obj=cq.Solid.makeCylinder(radius, direction.Length, cq.Vector(*start), direction))


def beam(start: tuple[float, float], end: tuple[float, float], y: float, height: float, width: float) -> cq.Workplane:
    """Flat beam in a plane y = const between two points (x, z)."""
    (x0, z0), (x1, z1) = start, end
    length = ((x1 - x0) ** 2 + (z1 - z0) ** 2) ** 0.5
    pitch = -math.degrees(math.atan2(z1 - z0, x1 - x0))
    shape = cq.Workplane().box(length + height, width, height).edges("|Y").fillet(0.3 * height)
    turned = shape.rotate((0, 0, 0), (0, 1, 0), pitch)
    return turned.translate(((x0 + x1) / 2, y, (z0 + z1) / 2))


def wheel() -> cq.Workplane:
    """Rim with grousers, a disc with holes, and a hub that holds the drive; axle along y, centre at the origin."""
    plane = cq.Workplane("XZ", origin=(0, WHEEL_WIDTH / 2, 0))
    rim = plane.circle(WHEEL_RADIUS).circle(WHEEL_RADIUS - 4).extrude(WHEEL_WIDTH)
    disc = cq.Workplane("XZ", origin=(0, 2.5, 0)).circle(WHEEL_RADIUS - 2).polarArray(95, 0, 360, 8).circle(26).extrude(5)
    hub = cq.Workplane("XZ", origin=(0, 60, 0)).circle(34).extrude(120)
    shape = rim.union(disc).union(hub)
    blade = box(GROUSER_HEIGHT + 2, WHEEL_WIDTH, GROUSER_THICKNESS, (WHEEL_RADIUS + GROUSER_HEIGHT / 2 - 1, 0, 0))
    for k in range(GROUSERS):
        shape = shape.union(blade.rotate((0, 0, 0), (0, 1, 0), 360.0 * k / GROUSERS))
    return shape


def knuckle(side: float) -> cq.Workplane:
    """Steering actuator above the wheel, bracket, leg and axle; the steering axis passes through the wheel's centre."""
    inward = (TRACK_Y - LEG_Y) * side
    housing = rod(38, (0, 0, 325), (0, 0, 418))
    bracket = box(56, abs(inward) + 40, 24, (0, -inward / 2, 342))
    leg = box(50, 22, 230, (0, -inward, 239), 6)
    axle = rod(24, (0, -inward, WHEEL_RADIUS), (0, -60 * side, WHEEL_RADIUS))
    return housing.union(bracket).union(leg).union(axle)


def rocker(side: float) -> cq.Workplane:
    """Bent arm from the front steering over the chassis pivot to the bogie pivot."""
    y = ROCKER_Y * side
    front = beam((AXLE_X["front"], BEAM_Z), (0, ROCKER_PIVOT_Z), y, 52, 26)
    back = beam((0, ROCKER_PIVOT_Z), (BOGIE_PIVOT_X, BEAM_Z), y, 52, 26)
    shelf = box(84, abs(TRACK_Y - ROCKER_Y) + 84, 34, (AXLE_X["front"], side * (TRACK_Y + ROCKER_Y) / 2, BEAM_Z), 12)
    boss = rod(46, (0, y - 20 * side, ROCKER_PIVOT_Z), (0, y + 26 * side, ROCKER_PIVOT_Z))
    return front.union(back).union(shelf).union(boss)


def bogie(side: float) -> cq.Workplane:
    """Beam from the rear steering to the middle wheel's leg, turning on a pin in its middle."""
    y = LEG_Y * side
    bar = beam((AXLE_X["rear"], BEAM_Z), (AXLE_X["middle"], BEAM_Z), y, 46, 26)
    shelf = box(84, abs(TRACK_Y - LEG_Y) + 84, 34, (AXLE_X["rear"], side * (TRACK_Y + LEG_Y) / 2, BEAM_Z), 12)
    leg = box(50, 22, 320, (AXLE_X["middle"], y, 284), 6)
    axle = rod(24, (0, y, WHEEL_RADIUS), (0, side * (TRACK_Y - 60), WHEEL_RADIUS))
    pin = rod(34, (BOGIE_PIVOT_X, y - 24 * side, BEAM_Z), (BOGIE_PIVOT_X, y + 28 * side, BEAM_Z))
    return bar.union(shelf).union(leg).union(axle).union(pin)


def joined(shapes: list[cq.Workplane]) -> cq.Workplane:
    """Shapes side by side as one part."""
    return cq.Workplane(obj=cq.Compound.makeCompound([shape.val() for shape in shapes]))


def chassis() -> cq.Assembly:
    """Body box with deck, mast with camera head, and antenna; the differential gear is on the shaft inside."""
    body = box(860, 560, 290, (0, 0, 530), 40)
    pivots = rod(30, (0, -325, ROCKER_PIVOT_Z), (0, 325, ROCKER_PIVOT_Z))
    panel = box(1040, 640, 18, (-20, 0, 692), 30)
    bare = [(4, 1), (0, 1)]  # mast and antenna stand there
    cells = [box(185, 190, 6, (-20 + 205 * (i - 2), 205 * (j - 1), 704)) for i in range(5) for j in range(3) if (i, j) not in bare]
    mast = rod(24, (390, 0, 675), (390, 0, 1260)).union(rod(42, (390, 0, 701), (390, 0, 760)))
    head = box(110, 290, 105, (405, 0, 1305), 14)
    eyes = rod(30, (450, 90, 1308), (472, 90, 1308)).union(rod(30, (450, -90, 1308), (472, -90, 1308)))
    dish = cq.Workplane(obj=cq.Solid.makeCone(20, 150, 60, cq.Vector(-430, 0, 880), cq.Vector(-0.35, 0, 0.9)))
    stem = rod(12, (-430, 0, 675), (-430, 0, 890))
    fronts = rod(26, (425, 150, 570), (445, 150, 570)).union(rod(26, (425, -150, 570), (445, -150, 570)))
    return (
        cq.Assembly(name="chassis")
        .add(body, name="body", color=GOLD)
        .add(pivots, name="pivot_shaft", color=GREY)
        .add(panel, name="deck", color=WHITE)
        .add(joined(cells), name="solar_cells", color=BLUE)
        .add(mast, name="mast", color=WHITE)
        .add(head, name="camera_head", color=WHITE)
        .add(eyes, name="stereo_cameras", color=BLACK)
        .add(fronts, name="hazard_cameras", color=BLACK)
        .add(dish, name="antenna", color=WHITE)
        .add(stem, name="antenna_stem", color=GREY)
    )


def rover() -> cq.Assembly:
    """The whole assembly."""
    assembly = cq.Assembly(name="rover").add(chassis())
    tyre = wheel()
    for tail, side in (("left", 1.0), ("right", -1.0)):
        assembly.add(rocker(side), name=f"rocker_{tail}", color=DARK)
        assembly.add(bogie(side), name=f"bogie_{tail}", color=DARK)
        bracket = knuckle(side)
        for place, x in AXLE_X.items():
            at = cq.Location(cq.Vector(x, TRACK_Y * side, 0))
            if place != "middle":
                assembly.add(bracket, name=f"knuckle_{place}_{tail}", loc=at, color=GREY)
            center = cq.Location(cq.Vector(x, TRACK_Y * side, WHEEL_RADIUS))
            assembly.add(tyre, name=f"wheel_{place}_{tail}", loc=center, color=WHITE)
    return assembly


def export(path: Path) -> None:
    """Write the STEP file, without the date in its header.

    Geometry and names are the same every time; the order of the colours in the file is not (OCCT).
    """
    rover().export(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"(FILE_NAME\('[^']*',')[^']*(')", r"\g<1>2026-01-01T00:00:00\2", text, count=1))


if __name__ == "__main__":
    export(HERE / "rover.step")
    print(f"wrote {HERE / 'rover.step'}")
