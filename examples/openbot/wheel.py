"""The wheel of the OpenBot MTV: bought, and so not among its parts. Drawn from the catalogue size of a 2.8" tyre.

Outer diameter 125 mm, width 70 mm, rim 2.8 inch (docs.leorover.tech, "Tires dimensions"); hub and disc are ours. Axle along y, centre
at the origin, millimetres.
"""

import cadquery as cq

RADIUS = 62.5
WIDTH = 70.0
RIM = 36.0


def build() -> cq.Assembly:
    """Tyre with rounded shoulders, rim disc and hub as one part."""
    plane = cq.Workplane("XZ", origin=(0, WIDTH / 2, 0))
    tyre = plane.circle(RADIUS).circle(RIM).extrude(WIDTH).edges("%CIRCLE").edges(cq.selectors.RadiusNthSelector(-1)).fillet(8)
    disc = cq.Workplane("XZ", origin=(0, 4, 0)).circle(RIM + 0.5).extrude(8)
    hub = cq.Workplane("XZ", origin=(0, 15, 0)).circle(12).extrude(30)
    return cq.Assembly(name="bought").add(tyre.union(disc).union(hub), name="wheel", color=cq.Color(0.10, 0.10, 0.11))
