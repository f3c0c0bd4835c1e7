"""The child process that draws films: ``python -m rille.view.scene3d.film_process job.npz``. Prints the share that is done."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.rotation import matrix_of
from rille.view.scene3d.land import SUN
from rille.view.scene3d.reading import Thing, things
from rille.view.scene3d.ruts import Pressed

Array = NDArray[Any]
SKY, SHADOW = "#050608", "#3a3733"
LIFT = 0.015  # [m] of shadows above the ground
LOOKS = {"follow": (1.15, 1.05, 0.66), "chase": (-1.6, 0.0, 0.75), "top": (-0.02, 0.0, 1.9)}  # from the machine, in its sizes
LOAD, PULL, SIDE = "#ffffff", "#67c28f", "#c39bff"
ARROW = 0.9  # length of an arrow as long as the largest load, in sizes of the machine
ACCENT = "#6fb1f0"


def main(job: str) -> None:
    """Draw what the job says."""
    import pyvista

    with np.load(job) as arrays:
        sheet = json.loads(arrays["sheet"].tobytes())
        data = {name: arrays[name] for name in ("times", "stored", "positions", "rotations", "tracks", "path")}
        scene = things(arrays["scene"].tobytes())
    plotter = pyvista.Plotter(off_screen=True, window_size=sheet["take"]["size"], lighting="none")
    stage = Stage(plotter, scene, sheet, data)
    if sheet["stills"]:
        for number, target in enumerate(sheet["targets"]):
            stage.show(number)
            plotter.screenshot(target)
            print((number + 1) / len(sheet["targets"]), flush=True)
        return
    import imageio_ffmpeg

    target = sheet["targets"][0]
    count = len(data["times"])
    options = {"codec": "libx264", "quality": 7, "macro_block_size": 2} if target.endswith(".mp4") else {"codec": "gif", "quality": None}
    if target.endswith(".gif"):
        palette = "split[a][b];[a]palettegen=max_colors=192:stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4"
        options |= {"pix_fmt_out": "pal8", "output_params": ["-filter_complex", palette, "-loop", "0"], "macro_block_size": 1}
    width, height = sheet["take"]["size"]
    writer = imageio_ffmpeg.write_frames(target, (width, height), fps=sheet["take"]["fps"], **options)
    writer.send(None)
    for number in range(count):
        stage.show(number)
        picture = np.asarray(plotter.screenshot(None, return_img=True))
        writer.send(np.ascontiguousarray(picture[:, :, :3]))
        print((number + 1) / count, flush=True)
    writer.close()


class Stage:
    """Actors that are moved from frame to frame."""

    def __init__(self, plotter: Any, scene: tuple[Thing, ...], sheet: dict[str, Any], data: dict[str, Array]) -> None:
        import pyvista

        self._plotter, self._sheet, self._data = plotter, sheet, data
        self._sun = np.array(SUN) / np.linalg.norm(SUN)
        plotter.set_background(SKY)
        plotter.enable_anti_aliasing("msaa", multi_samples=4)
        plotter.add_light(pyvista.Light(position=tuple(100 * self._sun), light_type="scene light", intensity=0.95))
        plotter.add_light(pyvista.Light(light_type="headlight", intensity=0.42))
        self._bodies: dict[str, list[Any]] = {}
        self._shadows: dict[str, list[Any]] = {}
        self._pressed: Pressed | None = None
        self._ground: Any = None
        on_ground = any(thing.extras["rille"] == "terrain" for thing in scene)
        for thing in scene:
            for piece in thing.pieces:
                self._add(thing, piece, on_ground)
        machine = [p.vertices for thing in scene if thing.extras["rille"] == "body" for p in thing.pieces]
        spread = data["positions"][:, 0] - data["positions"][sheet["root"], 0]
        reaches = [float(np.linalg.norm(v, axis=1).max()) for v in machine]
        self._size = max(0.05, float(np.linalg.norm(spread, axis=1).max()) + (min(reaches) if reaches else 0.1))
        self._arrows = self._make_arrows()
        self._path = self._make_path()
        self._text = plotter.add_text("", position="upper_left", font_size=11, color="white", font="arial")
        self._frame = -1

    def _add(self, thing: Thing, piece: Any, on_ground: bool) -> None:
        import pyvista

        faces = np.hstack([np.full((len(piece.triangles), 1), 3), piece.triangles]).ravel()
        mesh = pyvista.PolyData(piece.vertices, faces)
        kind, name = thing.extras["rille"], thing.extras["name"]
        if piece.color.ndim == 2:
            mesh["color"] = (255 * piece.color).astype(np.uint8)
            self._plotter.add_mesh(mesh, scalars="color", rgb=True, lighting=False, show_scalar_bar=False)
            if kind == "terrain":
                self._ground, self._pressed = mesh, Pressed(mesh.points, mesh["color"], thing.extras)
            return
        shaded = mesh.clean().compute_normals(split_vertices=True, feature_angle=30)
        actor = self._plotter.add_mesh(shaded, color=tuple(piece.color), smooth_shading=True, specular=0.15)
        if kind != "body":
            return
        self._bodies.setdefault(name, []).append(actor)
        if on_ground:
            self._shadows.setdefault(name, []).append(self._plotter.add_mesh(mesh, color=SHADOW, lighting=False))

    def _make_arrows(self) -> list[list[tuple[Any, int]]]:
        import pyvista

        shape = pyvista.Arrow(start=(0, 0, 0), direction=(1, 0, 0), tip_length=0.18, tip_radius=0.035, shaft_radius=0.013)
        tracks = self._data["tracks"]
        return [
            [(self._plotter.add_mesh(shape, color=color, lighting=False), k) for color, k in ((LOAD, 7), (PULL, 8), (SIDE, 9))]
            for _ in tracks
        ]

    def _make_path(self) -> Any:
        import pyvista

        where = self._data["path"]
        line = pyvista.MultipleLines(points=np.vstack([where[:1], where]))
        self._plotter.add_mesh(line, color=ACCENT, line_width=3, lighting=False)
        return line

    def show(self, number: int) -> None:
        """The frame of that number; frames come in their order."""
        data, sheet = self._data, self._sheet
        time = float(data["times"][number])
        stored = int(np.searchsorted(data["stored"], time + 1e-9)) - 1
        if self._pressed is not None and len(data["tracks"]):
            self._pressed.press(data["tracks"], stored, [wheel["width"] for wheel in sheet["wheels"]])
            self._ground.points = self._pressed.points
            self._ground["color"] = self._pressed.colors
        poses = [_matrix(data["rotations"][b, number], data["positions"][b, number]) for b in range(len(sheet["bodies"]))]
        flat = self._shadow_matrix(max(stored, 0))
        for name, pose in zip(sheet["bodies"], poses, strict=True):
            for actor in self._bodies.get(name, []):
                actor.user_matrix = pose
            for actor in self._shadows.get(name, []):
                actor.user_matrix = flat @ pose
        self._point_arrows(max(stored, 0), poses[sheet["root"]])
        where = data["path"]
        points = np.repeat(where[number : number + 1], len(where) + 1, axis=0)
        points[: number + 1] = where[: number + 1]
        self._path.points = points
        self._aim(poses[sheet["root"]])
        self._tell(time, max(stored, 0))
        self._plotter.render()

    def _shadow_matrix(self, stored: int) -> Array:
        """Projection along the sun onto the plane through the places where the wheels stand."""
        tracks = self._data["tracks"]
        feet = tracks[:, stored, [0, 1, 3]] if len(tracks) >= 3 else np.zeros((0, 3))
        if len(feet) < 3:
            return np.diag([1.0, 1.0, 0.0, 1.0])
        middle = feet.mean(axis=0)
        slope, *_ = np.linalg.lstsq(feet[:, :2] - middle[:2], feet[:, 2] - middle[2], rcond=None)
        normal = np.array([-slope[0], -slope[1], 1.0])
        shear = np.eye(3) - np.outer(self._sun, normal) / (normal @ self._sun)
        matrix = np.eye(4)
        matrix[:3, :3] = shear
        base = middle + [0, 0, LIFT]
        matrix[:3, 3] = base - shear @ base
        return matrix

    def _point_arrows(self, stored: int, root: Array) -> None:
        tracks = self._data["tracks"]
        if not len(tracks):
            return
        largest = max(float(np.nanmax(np.abs(tracks[:, :, 7]))), 1e-9)
        forward = root[:3, 0]
        for track, arrows in zip(tracks, self._arrows, strict=True):
            state = track[stored]
            before, after = track[max(0, stored - 3), :3], track[min(len(track) - 1, stored + 3), :3]
            heading = after - before if np.linalg.norm(after - before) > 1e-4 else forward
            heading = heading * (1 if heading @ forward >= 0 else -1) / np.linalg.norm(heading)
            foot = np.array([state[0], state[1], state[3] - state[6] + 0.01])
            directions = (np.array([0.0, 0.0, 1.0]), heading, np.cross([0, 0, 1], heading))
            for (actor, k), direction in zip(arrows, directions, strict=True):
                actor.user_matrix = _arrow(foot, direction, ARROW * self._size * state[k] / largest)

    def _aim(self, root: Array) -> None:
        """The camera stays so far from the machine; chasing, it turns with its heading."""
        mode = self._sheet["take"]["camera"]
        focus = root[:3, 3] + [0, 0, 0.1 * self._size]
        looks = np.array(LOOKS[mode])
        heading = np.arctan2(root[1, 0], root[0, 0]) if mode != "follow" else 0.0
        c, s = np.cos(heading), np.sin(heading)
        away = np.array([c * looks[0] - s * looks[1], s * looks[0] + c * looks[1], looks[2]]) * 2.4 * self._size
        camera = self._plotter.camera
        camera.focal_point, camera.position, camera.up = focus, focus + away, (0, 0, 1)
        camera.view_angle = 32.0
        self._plotter.reset_camera_clipping_range()

    def _tell(self, time: float, stored: int) -> None:
        lines = [self._sheet["title"], f"t = {time:.2f} s"]
        if len(self._data["tracks"]):
            slip = self._data["tracks"][:, stored, 4]
            lines.append(f"slip ratio {np.nanmean(slip):.2f} (largest {slip[np.nanargmax(np.abs(slip))]:.2f})")
        self._text.set_text("upper_left", "\n".join(lines))


def _matrix(rotation: Array, position: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = matrix_of(rotation)
    matrix[:3, 3] = position
    return matrix


def _arrow(foot: Array, direction: Array, length: float) -> Array:
    """Places the unit arrow along x; an arrow without length is a point."""
    if not np.isfinite(length) or abs(length) < 1e-6:
        return np.diag([0.0, 0.0, 0.0, 1.0]) + np.pad(foot[:, None], ((0, 1), (3, 0)))
    along = direction * np.sign(length)
    side = np.cross(along, [0.3, 0.9, 0.1])
    side /= np.linalg.norm(side)
    thick = min(1.0, 0.5 + abs(length))
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([along * abs(length), side * thick, np.cross(along, side) * thick])
    matrix[:3, 3] = foot
    return matrix


if __name__ == "__main__":
    main(str(Path(sys.argv[1])))
