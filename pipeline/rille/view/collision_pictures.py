"""Visual meshes and collision pieces over each other."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import CollisionShape, InputRefused, Rover
from rille.view.drawing import Camera, Drawing, Item, draw
from rille.view.obstacles import facet_item, facets, hull_points
from rille.view.pose import placed_meshes

Array = NDArray[np.float64]

VISUAL = "#a4a9b0"
SIZE = (900, 860)
VIEW_ANGLE = 30.0
PANELS = ("visual mesh", "both", "collision pieces")


def draw_collision(rover: Rover, path: Path, *, body: str | None = None, ratios: Mapping[str, float | None] | None = None) -> list[str]:
    """Draw the visual meshes, the collision pieces over them, and the pieces alone, side by side into a PNG.

    Parameters
    ----------
    body : draw this one only; without it the whole rover at the zero pose.
    ratios : volume of the pieces over that of the parts, by body; written above.

    Returns
    -------
    Notes about what could not be drawn, empty if all was.

    Raises
    ------
    InputRefused : if the rover has no such body, or there is neither a mesh nor a collision shape to draw.
    """
    names = [b.name for b in rover.bodies]
    if body is not None and body not in names:
        raise InputRefused(f"the model has no body '{body}'; it has {', '.join(names)}")
    shapes = [shape for shape in rover.collision_shapes if body in (None, shape.body)]
    visual = _visual_items(rover, body)
    if not shapes and not visual:
        raise InputRefused(f"{f'body {body!r}' if body else 'the model'} has neither visual meshes nor collision shapes to draw")
    solid = [_piece_item(shape, k) for k, shape in enumerate(shapes)]
    # A little larger than they are, so that their faces win against those of the mesh that they share.
    glass = [_piece_item(shape, k, opacity=0.42, grown=1.01) for k, shape in enumerate(shapes)]
    camera, sun = _camera([*visual, *solid])
    panels = (visual, [*visual, *glass], solid)
    path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    with tempfile.TemporaryDirectory(prefix="rille-view-") as folder:
        files = [Path(folder) / f"panel{k}.png" for k in range(3)]
        notes = draw(
            {
                file: Drawing(items=items or [_nothing(camera)], camera=camera, size=SIZE, background=("#eef1f5", "#ffffff"), sun=sun)
                for file, items in zip(files, panels, strict=True)
            }
        )
        if not notes:
            _compose(files, path, _title(shapes, body, ratios or {}))
    return notes


def _title(shapes: list[CollisionShape], body: str | None, ratios: Mapping[str, float | None]) -> str:
    pieces = f"{len(shapes)} collision piece{'' if len(shapes) == 1 else 's'}"
    if body is None:
        pieces += f" on {len({shape.body for shape in shapes})} bodies"
    known = {name: ratio for name, ratio in ratios.items() if ratio is not None and body in (None, name)}
    if not known:
        return pieces if body is None else f"{body}: {pieces}"
    worst = max(known, key=lambda name: known[name])
    if body is not None:
        return f"{body}: {pieces}, volume ratio {known[worst]:.3g}"
    return f"{pieces}, volume ratio {min(known.values()):.3g} to {known[worst]:.3g} ({worst})"


def _visual_items(rover: Rover, body: str | None) -> list[Item]:
    """Visual meshes of the bodies in M at the zero pose."""
    return [
        Item(vertices=vertices, triangles=mesh.triangles, color=VISUAL)
        for name, mesh, vertices in placed_meshes(rover)
        if body in (None, name)
    ]


def _piece_item(shape: CollisionShape, number: int, *, opacity: float = 1.0, grown: float = 1.0) -> Item:
    """One piece, faceted, in a colour of its own: hues a golden angle apart. grown : about its middle."""
    from matplotlib.colors import hsv_to_rgb, to_hex

    corners = facets(shape)
    red, green, blue = hsv_to_rgb((number * 0.381966 % 1.0, 0.55, 0.93))
    middle = hull_points(shape).mean(axis=0)
    return facet_item(middle + grown * (corners - middle), to_hex((red, green, blue)), opacity)


def _camera(items: list[Item]) -> tuple[Camera, tuple[float, float, float]]:
    """From the front left, slightly above, as near as everything fits; and where the light comes from."""
    cloud = np.concatenate([item.vertices for item in items])
    toward = np.array([0.66, -0.66, 0.36])
    toward /= np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    middle = np.zeros(3)
    for axis in (right, up, toward):
        along = cloud @ axis
        middle += axis * (along.min() + along.max()) / 2
    arms = cloud - middle
    # Nearest distance at which every point is inside of the view: |across| <= (distance - depth) tan(half angle).
    slope = np.tan(np.deg2rad(VIEW_ANGLE) / 2)
    wide = np.abs(arms @ right) / (slope * SIZE[0] / SIZE[1])
    high = np.abs(arms @ up) / slope
    distance = 1.06 * float((np.maximum(wide, high) + arms @ toward).max())
    sun = toward + 0.55 * up
    sun /= np.linalg.norm(sun)
    place = middle + distance * toward
    return Camera(position=_triple(place), focus=_triple(middle), view_angle=VIEW_ANGLE), _triple(sun)


def _nothing(camera: Camera) -> Item:
    """A triangle too small to see: a picture needs something to draw."""
    corner = np.array(camera.focus)
    return Item(vertices=corner + 1e-9 * np.eye(3), triangles=np.array([[0, 1, 2]]), opacity=0.0)


def _compose(files: list[Path], path: Path, title: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(18, 6.6), layout="constrained")
    for axis, file, name in zip(axes, files, PANELS, strict=True):
        axis.imshow(pyplot.imread(file))
        axis.set_title(name, fontsize=13, color="#444a52")
        axis.set_axis_off()
    figure.suptitle(title, fontsize=16)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise InputRefused(f"the picture '{path}' cannot be written: {error}") from None
    finally:
        pyplot.close(figure)


def _triple(v: Array) -> tuple[float, float, float]:
    x, y, z = map(float, v)
    return x, y, z
