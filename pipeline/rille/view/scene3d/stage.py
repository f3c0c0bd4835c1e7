"""The stage of a film: actors that are loaded once and moved from frame to frame."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.rotation import matrix_of
from rille.view.scene3d.land import SUN
from rille.view.scene3d.marks import FORCES, Arrows, Path, Shadow
from rille.view.scene3d.overlay import BRIGHT, FAINT, Words, letters, panel, slip_legend, stamp
from rille.view.scene3d.reading import Piece, Thing
from rille.view.scene3d.ruts import SLIP, Pressed

Array = NDArray[Any]
SKY, PAPER = "#050608", ("#c9d0d8", "#f4f6f8")
GHOST, SEEN_THROUGH = "#f0a35e", 0.4  # the second colour of the page (web/colours.js)
LAMP = np.array([0.5, 1.0, 1.1])  # direction towards the light where there is no sun, from the machine's heading
ANGLE = 32.0  # [deg] opening of the camera upwards
FIT = 1.05  # of the machine's radius that the picture's half height holds
LOOKS = {"follow": (0.62, 0.78, 0.42), "chase": (-1.0, 0.0, 0.45), "top": (-0.012, 0.0, 1.0)}  # towards the camera: ahead, to a side, up
CLEARANCE = 0.3  # of the camera above the ground, in the machine's radius
SAMPLES = 16  # frames from which the machine's extent is taken


class Stage:
    """sheet : names and numbers of the job; data : its arrays; see ``film.py``."""

    def __init__(self, plotter: Any, scene: tuple[Thing, ...], sheet: dict[str, Any], data: dict[str, Array]) -> None:
        import pyvista

        self._plotter, self._sheet, self._data = plotter, sheet, data
        self._ahead = self._heading(data["rotations"][sheet["root"], 0])
        on_ground = any(thing.extras["rille"] == "terrain" for thing in scene)
        sun = (
            np.array(SUN) if on_ground else _level(self._ahead) @ LAMP
        )  # without ground no light is baked in: the machine is lit for the camera
        self._sun = sun / np.linalg.norm(sun)
        self._numbers = {name: k for k, name in enumerate(sheet["bodies"])}
        self._middle, self._size = self._extent(scene)
        if on_ground:
            plotter.set_background(SKY)
        else:
            plotter.set_background(PAPER[0], top=PAPER[1])
        if sheet["stills"]:
            plotter.enable_anti_aliasing("ssaa")
        else:
            plotter.enable_anti_aliasing("msaa", multi_samples=4)
        plotter.add_light(pyvista.Light(position=tuple(100 * self._sun), light_type="scene light", intensity=0.78))
        plotter.add_light(pyvista.Light(light_type="headlight", intensity=0.34))
        self._bodies: list[list[Any]] = [[] for _ in sheet["bodies"]]
        self._ghosts: list[list[Any]] = [[] for _ in sheet["bodies"]]
        self._pressed: Pressed | None = None
        self._ground: Any = None
        cast = []
        for thing in scene:
            number = self._numbers.get(thing.extras["name"]) if thing.extras["rille"] == "body" else None
            for piece in thing.pieces:
                self._add(thing, piece, number)
                if number is not None:
                    cast.append((number, piece.vertices, piece.triangles))
        self._shadow = Shadow(plotter, cast, self._sun, self._size) if self._pressed is not None and cast else None
        self._arrows = Arrows(plotter, sheet["wheels"], sheet["share"], self._size) if sheet["wheels"] and sheet["share"] > 0 else None
        self._path = Path(plotter, data["route"], self._pressed, self._size)
        self._legends = self._make_legends()

    def frame(self, number: int) -> Array:
        """The picture (rows, columns, 3) of that number; pictures come in the order of their times."""
        self._move(number)
        self._plotter.render()
        picture = np.array(self._plotter.screenshot(None, return_img=True)[:, :, :3])
        size = letters(picture.shape[0])
        stamp(picture, panel(self._words(number), size), size // 2, size // 2)
        x = size // 2
        for plate in self._legends:
            stamp(picture, plate, x, picture.shape[0] - plate.height - size // 2)
            x += plate.width + size // 2
        return picture

    def _add(self, thing: Thing, piece: Piece, number: int | None) -> None:
        import pyvista

        faces = np.hstack([np.full((len(piece.triangles), 1), 3), piece.triangles]).ravel()
        mesh = pyvista.PolyData(piece.vertices, faces)
        if piece.color.ndim == 2:
            mesh["color"] = (255 * piece.color).astype(np.uint8)
            self._plotter.add_mesh(mesh, scalars="color", rgb=True, lighting=False, show_scalar_bar=False)
            if thing.extras["rille"] == "terrain":
                self._ground, self._pressed = mesh, Pressed(np.array(mesh.points), np.array(mesh["color"]), thing.extras)
            return
        shaded: Any = mesh.clean()
        shaded = shaded.compute_normals(split_vertices=True, feature_angle=30)
        actor = self._plotter.add_mesh(shaded, color=tuple(piece.color), smooth_shading=True, specular=0.12)
        if number is None:
            return
        self._bodies[number].append(actor)
        if "ghost_positions" in self._data:
            self._ghosts[number].append(self._plotter.add_mesh(shaded, color=GHOST, opacity=SEEN_THROUGH, smooth_shading=True))

    def _move(self, number: int) -> None:
        data, sheet = self._data, self._sheet
        stored = max(0, int(np.searchsorted(data["stored"], float(data["times"][number]) + 1e-9)) - 1)
        if self._pressed is not None and self._pressed.press(data["tracks"], stored, [wheel["width"] for wheel in sheet["wheels"]]):
            self._ground.points = self._pressed.points
            self._ground["color"] = self._pressed.colors
        poses = [pose(data["rotations"][b, number], data["positions"][b, number]) for b in range(len(sheet["bodies"]))]
        for actors, where in zip(self._bodies, poses, strict=True):
            for actor in actors:
                actor.user_matrix = where
        if "ghost_positions" in data:
            self._move_ghost(number)
        if self._shadow is not None and self._pressed is not None:
            self._shadow.fall(poses, self._pressed)
        root = poses[sheet["root"]]
        if self._arrows is not None:
            self._arrows.point(data["tracks"], stored, poses, root[:3, 3])
        self._path.until(stored)
        self._aim(root)

    def _move_ghost(self, number: int) -> None:
        for b, actors in enumerate(self._ghosts):
            position, rotation = self._data["ghost_positions"][b, number], self._data["ghost_rotations"][b, number]
            known = bool(np.isfinite(position).all() and np.isfinite(rotation).all())
            for actor in actors:
                actor.SetVisibility(known)
                if known:
                    actor.user_matrix = pose(rotation, position)

    def _extent(self, scene: tuple[Thing, ...]) -> tuple[Array, float]:
        """Middle of the machine in axes of the root's heading, from the root, and its radius [m]; all its poses in the film have room."""
        data, root = self._data, self._sheet["root"]
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for number in np.unique(np.linspace(0, len(data["times"]) - 1, SAMPLES).astype(int)):
            back = _level(self._heading(data["rotations"][root, number])).T
            for thing in scene:
                if thing.extras["rille"] != "body" or thing.extras["name"] not in self._numbers:
                    continue
                b = self._numbers[thing.extras["name"]]
                where = pose(data["rotations"][b, number], data["positions"][b, number])
                for piece in thing.pieces:
                    cloud = (piece.vertices @ where[:3, :3].T + where[:3, 3] - data["positions"][root, number]) @ back.T
                    low, high = np.minimum(low, cloud.min(axis=0)), np.maximum(high, cloud.max(axis=0))
        if not np.isfinite(low).all():
            return np.zeros(3), 0.5
        return (low + high) / 2, max(0.02, float(np.linalg.norm(high - low)) / 2)

    def _aim(self, root: Array) -> None:
        camera, mode = self._plotter.camera, self._sheet["take"]["camera"]
        turn = _level(self._heading_of(root))
        focus = root[:3, 3] + turn @ self._middle
        if isinstance(mode, str):
            width, height = self._sheet["take"]["size"]
            distance = FIT * self._size / np.sin(np.radians(ANGLE) / 2) / min(1.0, width / height)
            look = np.array(LOOKS[mode])
            if mode == "follow":  # from the side that the sun shines on, wherever the machine turns
                turn = _level(self._ahead)
                look[1] *= 1.0 if (turn @ [0, 1, 0]) @ self._sun >= 0 else -1.0
            place = focus + turn @ (look / np.linalg.norm(look)) * distance
            if self._pressed is not None:
                place[2] = max(place[2], float(self._pressed.height(place[:1], place[1:2])[0]) + CLEARANCE * self._size)
        else:
            place = np.array(mode) - self._sheet["origin"]
        camera.focal_point, camera.position, camera.up, camera.view_angle = focus, place, (0, 0, 1), ANGLE
        self._plotter.reset_camera_clipping_range()

    def _heading(self, rotation: Array) -> float:
        return self._heading_of(pose(rotation, np.zeros(3)))

    @staticmethod
    def _heading_of(root: Array) -> float:
        return float(np.arctan2(root[1, 0], root[0, 0]))

    def _words(self, number: int) -> list[Words]:
        data, time = self._data, float(self._data["times"][number])
        lines: list[Words] = [[(self._sheet["title"], BRIGHT)], [(f"{time:.2f} s", BRIGHT)]]
        stored = max(0, int(np.searchsorted(data["stored"], time + 1e-9)) - 1)
        slip = data["tracks"][:, stored, SLIP] if len(data["tracks"]) else np.empty(0)
        slip = slip[np.isfinite(slip)]
        if len(slip):
            largest = slip[np.argmax(np.abs(slip))]
            lines[1].append((f"slip {np.mean(slip):.2f}, largest {largest:.2f}", FAINT))
        if self._sheet["ghost"]:
            lines.append([("pale:", _rgb(GHOST)), (self._sheet["ghost"], FAINT)])
        return lines

    def _make_legends(self) -> list[Any]:
        size = letters(self._sheet["take"]["size"][1])
        if self._arrows is None:
            return []
        words: Words = [(field.replace("_", " "), _rgb(color)) for field, color in FORCES.items()]
        words.append((f"{self._arrows.reach:.2g} m = {self._sheet['share']:.3g} N", FAINT))
        return [panel([words], size), *([] if self._pressed is None else [slip_legend(size)])]


def pose(rotation: Array, position: Array) -> Array:
    """Matrix (4, 4) of a quaternion w x y z and a position."""
    matrix = np.eye(4)
    matrix[:3, :3] = matrix_of(rotation)
    matrix[:3, 3] = position
    return matrix


def _level(heading: float) -> Array:
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
