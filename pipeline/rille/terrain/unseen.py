"""What a scene places without a trace on its own grid: beside the ground, or between its heights."""

from collections.abc import Iterable

from rille.model import SoilPatch
from rille.terrain.composition import Item
from rille.terrain.crowd import Crowd
from rille.terrain.grid import Grid
from rille.terrain.placed import Placed


def unseen(grid: Grid, items: Iterable[Item], patches: Iterable[SoilPatch]) -> dict[str, str]:
    """What leaves no trace, by its subject ("landform 'pit'"): why, in words that go on from there.

    A population does if nothing of it was to be expected on the ground; one of which chance placed nothing there does not count.
    """
    from shapely import Polygon, box

    x, y = grid.axes(grid.whole)
    ground = box(x[0], y[-1], x[-1], y[0])
    spans = f"the ground, which spans x {x[0]:g} to {x[-1]:g} m and y {y[-1]:g} to {y[0]:g} m"
    found: dict[str, str] = {}
    for item in items:
        if not item.window(grid).empty:
            continue
        if isinstance(item, Placed):
            between = ground.intersects(Polygon(item.footprint()))
            found[f"landform '{item.instance.name}'"] = _between(grid) if between else f"lies beside {spans}"
        elif item.population.law["expected"]["number"][0] == 0:
            found[f"population '{item.population.name}'"] = f"lies beside {spans}" if _beside(item) else f"finds no room on {spans}"
    for patch in patches:
        if not ground.intersects(Polygon(patch.polygon)):
            found[f"soil patch '{patch.name}'"] = f"lies beside {spans}"
    return found


def _between(grid: Grid) -> str:
    step = f"{grid.posting_x:g} m" if grid.posting_x == grid.posting_y else f"{grid.posting_x:g} m x {grid.posting_y:g} m"
    return f"lies between the heights of the ground, which stand {step} apart, and changes none of them; take a smaller posting"


def _beside(crowd: Crowd) -> bool:
    """Whether its region shares no area with the ground; otherwise its density or its zones leave none."""
    x0, y0, x1, y1 = crowd.population.law["box"]
    return x0 >= x1 or y0 >= y1
