"""A small rover on a small crater field, made by hand: what the page of replays and live sessions is tested with."""

import base64
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from rille.view.scene3d.glb import Glb

RADIUS, WIDTH, SPEED = 0.15, 0.14, 0.12  # of wheels [m], of the rover [m/s]
ORIGIN = (100.0, -50.0, 20.0)
PLACES = {"front_left": (0.36, 0.32), "front_right": (0.36, -0.32), "rear_left": (-0.36, 0.32), "rear_right": (-0.36, -0.32)}
POSTING, SIDE = 0.05, 241
SUN = np.array([-0.55, 0.45, 0.70]) / np.linalg.norm([-0.55, 0.45, 0.70])
CRATERS = (
    (2.6, 1.9, 1.1, 0.22),
    (4.4, -1.7, 0.9, 0.16),
    (-2.0, -2.2, 1.6, 0.25),
    (0.7, -2.4, 0.5, 0.09),
    (-1.4, 2.7, 0.8, 0.13),
    (5.4, 2.6, 0.6, 0.1),
)


def height(x: NDArray, y: NDArray) -> NDArray:
    """Of the ground [m]: swells and craters, minus the origin."""
    z = 0.06 * np.sin(0.9 * x + 0.4) * np.cos(0.7 * y) + 0.02 * np.sin(3.1 * x + 1.3 * y)
    for cx, cy, r, depth in CRATERS:
        q = np.hypot(x - cx, y - cy) / r
        z = z + np.where(q < 1.0, depth * (q**2 - 1.0) + 0.25 * depth, 0.25 * depth * np.exp(-((q - 1.0) * 3.0)))
    return z


@dataclass(frozen=True)
class Run:
    """time (n,), states (n, size), both as the page gets them."""

    time: NDArray[np.float64]
    states: NDArray[np.float32]
    events: Sequence[dict]


def layout(chassis: str = "chassis") -> dict:
    """Names and order of the numbers."""
    wheels = [f"wheel_{name}" for name in PLACES]
    return {
        "title": "Small rover, crater field",
        "origin": list(ORIGIN),
        "gravity": 1.62,
        "sun": SUN.tolist(),
        "bodies": [{"name": chassis, "root": True}, *({"name": name, "root": False} for name in wheels)],
        "joints": [{"name": f"axle_{name}", "kind": "hinge", "lower": None, "upper": None} for name in PLACES],
        "wheels": [
            {"name": f"wheel_{name}", "body": f"wheel_{name}", "joint": f"axle_{name}", "radius": RADIUS, "width": WIDTH, "axle": [0, 1, 0]}
            for name in PLACES
        ],
        "drives": [
            {
                "name": f"drive_{name}",
                "joint": f"axle_{name}",
                "mode": "speed",
                "max_speed": 2.0,
                "max_torque": 20.0,
                "lower": None,
                "upper": None,
            }
            for name in PLACES
        ],
    }


def state_at(x: float, y: float, yaw: float, rolled: float, slip: float, wave: float) -> NDArray[np.float32]:
    """State vector of the rover standing at x, y (minus the origin)."""
    c, s = np.cos(yaw), np.sin(yaw)
    corners = {name: (x + c * px - s * py, y + s * px + c * py) for name, (px, py) in PLACES.items()}
    ground = {name: float(height(np.array(p[0]), np.array(p[1]))) for name, p in corners.items()}
    loads = np.array([42.0, 40.0, 38.0, 41.0]) * (1 + 0.12 * np.sin(wave + np.arange(4)))
    sinkage = 0.024 * (loads / 40.0) ** 0.8 * (1 + 0.9 * max(0.0, slip))
    pitch = -np.arctan2(ground["front_left"] + ground["front_right"] - ground["rear_left"] - ground["rear_right"], 4 * 0.36)
    roll = np.arctan2(ground["front_left"] + ground["rear_left"] - ground["front_right"] - ground["rear_right"], 4 * 0.32)
    cr, sr, cp, sp, cy, sy = (*(f(0.5 * a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin)),)
    turn = np.array([cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy])
    z = float(np.mean(list(ground.values()))) + RADIUS + 0.16 - float(np.mean(sinkage))
    values: list[float] = [x, y, z, *turn]
    spin = np.array([np.cos(0.5 * rolled), 0.0, np.sin(0.5 * rolled), 0.0])
    yawed = np.array([np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)])
    wheel_turn = [yawed[0] * spin[0], -yawed[3] * spin[2], yawed[0] * spin[2], yawed[3] * spin[0]]
    for k, name in enumerate(PLACES):
        values += [*corners[name], ground[name] - sinkage[k] + RADIUS, *wheel_turn]
    for _ in PLACES:
        values += [rolled, SPEED / RADIUS, 3.0 + slip, 2.0 * rolled]
    for k, name in enumerate(PLACES):
        own = slip + 0.08 * np.sin(1.7 * wave + k)
        values += [
            *corners[name],
            ground[name] - sinkage[k] + RADIUS,
            ground[name],
            own,
            0.05 * np.sin(wave),
            sinkage[k],
            loads[k],
            14.0 * own + 3.0 * np.sin(wave + k),
            6.0 * np.sin(0.8 * wave + 2 * k),
            2.0 + 3.0 * own,
        ]
    return np.array(values, dtype=np.float32)


def run(seconds: float = 40.0, rate: float = 25.0, aside: float = 0.0, slip: float = 0.12) -> Run:
    """A drive along a gentle curve. aside : other lateral place, so that two runs differ."""
    time = np.arange(0.0, seconds + 0.5 / rate, 1.0 / rate)
    x, y, yaw, rolled, states = -1.6, -0.4 + aside, 0.35, 0.0, []
    for t in time:
        now = slip + 0.45 * np.exp(-(((t - 0.6 * seconds) / 3.0) ** 2)) - 0.3 * np.exp(-(((t - 0.25 * seconds) / 2.0) ** 2))
        states.append(state_at(x, y, yaw, rolled, now, 0.5 * t))
        step = SPEED / rate * (1 - max(0.0, now))
        yaw += (0.10 * np.sin(0.22 * t) + 0.02 * aside) / rate
        x, y, rolled = x + step * np.cos(yaw), y + step * np.sin(yaw), rolled + SPEED / rate / RADIUS
    events = [
        {"time": 0.0, "kind": "contact", "subject": "wheel_front_left", "message": "touches the ground"},
        {"time": 0.62 * seconds, "kind": "limit_reached", "subject": "axle_rear_left", "message": "torque limit of 20 N m"},
    ]
    return Run(time, np.array(states, dtype=np.float32), events)


def part(glb: Glb, mesh: trimesh.Trimesh, grey: Sequence[float]) -> int:
    """A node with a mesh whose edges are sharp."""
    mesh = mesh.copy()
    mesh.unmerge_vertices()
    return glb.node("part", mesh=glb.mesh(mesh.vertices, mesh.faces, normals=mesh.vertex_normals, material=glb.material(np.array(grey))))


def scene(chassis: str = "chassis") -> bytes:
    """The glb: chassis with panel and mast, four wheels with grousers, the terrain's grid."""
    glb, box = Glb(), lambda size, at: trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))
    body = [
        part(glb, box((0.72, 0.40, 0.16), (0, 0, 0.08)), (0.62, 0.55, 0.32)),
        part(glb, box((0.80, 0.62, 0.02), (-0.02, 0, 0.20)), (0.03, 0.05, 0.12)),
        part(glb, box((0.04, 0.04, 0.42), (0.28, 0, 0.38)), (0.6, 0.6, 0.6)),
        part(glb, box((0.08, 0.22, 0.09), (0.29, 0, 0.62)), (0.8, 0.8, 0.8)),
        *(part(glb, box((0.05, 0.05, 0.22), (px, 0.24 * np.sign(py), -0.05)), (0.35, 0.35, 0.38)) for px, py in PLACES.values()),
    ]
    glb.node("chassis", position=[0, 0, 0.4], children=body, extras={"rille": "body", "name": chassis}, top=True)
    lying = trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0))
    tyre = trimesh.creation.cylinder(0.94 * RADIUS, WIDTH, sections=40, transform=lying)
    bars = [
        box((0.02, WIDTH, 0.02), (0, 0, 0)).apply_transform(
            trimesh.transformations.rotation_matrix(a, (0, 1, 0)) @ trimesh.transformations.translation_matrix((0.95 * RADIUS, 0, 0))
        )
        for a in np.linspace(0, 2 * np.pi, 18, endpoint=False)
    ]
    hub = trimesh.creation.cylinder(0.4 * RADIUS, 1.06 * WIDTH, sections=24, transform=lying)
    for name, (px, py) in PLACES.items():
        parts = [
            part(glb, tyre, (0.45, 0.46, 0.48)),
            part(glb, trimesh.util.concatenate(bars), (0.3, 0.3, 0.32)),
            part(glb, hub, (0.15, 0.15, 0.16)),
        ]
        glb.node(name, position=[px, py, 0.15], children=parts, extras={"rille": "body", "name": f"wheel_{name}"}, top=True)
    _terrain(glb)
    return glb.to_bytes()


def _terrain(glb: Glb) -> None:
    half = 0.5 * POSTING * (SIDE - 1)
    west, north = 1.5 - half, half
    x, y = np.meshgrid(west + POSTING * np.arange(SIDE), north - POSTING * np.arange(SIDE))
    z = height(x, y)
    slope_y, slope_x = np.gradient(z, -POSTING, POSTING)
    light = np.clip((SUN[2] - slope_x * SUN[0] - slope_y * SUN[1]) / np.sqrt(1 + slope_x**2 + slope_y**2), 0.0, 1.0) * 0.78 + 0.22
    grain = np.random.default_rng(3).normal(0.0, 0.02, z.shape)
    colours = (np.array([0.30, 0.285, 0.26]) * (light + grain)[..., None]).clip(0, 1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(SIDE - 1), np.arange(SIDE - 1), indexing="ij")
    k = (i * SIDE + j).ravel()
    faces = np.concatenate([np.column_stack([k, k + SIDE, k + 1]), np.column_stack([k + 1, k + SIDE, k + SIDE + 1])])
    grid = {"rows": SIDE, "columns": SIDE, "x_west": west, "y_north": north, "posting_x": POSTING, "posting_y": POSTING}
    mesh = glb.mesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces, colors=colours, material=glb.material(np.full(3, 0.5)))
    glb.node("ground", mesh=mesh, extras={"rille": "terrain", "name": "ground", **grid}, top=True)


def packed(array: NDArray, *, deflate: bool = False) -> object:
    """Base64 of an array, as the page reads it."""
    if deflate:
        return {"base64": base64.b64encode(zlib.compress(array.tobytes())).decode(), "encoding": "deflate"}
    return base64.b64encode(array.tobytes()).decode()


def source(
    *runs: Run, mode: str = "single", labels: Sequence[str] = ("run 1", "run 2"), chassis: str = "chassis", deflate: bool = True
) -> dict:
    """What a replay's page holds."""
    extra = {"label": "imu roll rate", "unit": "rad/s", "time": packed(runs[0].time), "values": packed(0.02 * np.sin(runs[0].time))}
    return {
        "kind": "replay",
        "layout": layout(chassis),
        "scene": base64.b64encode(scene(chassis)).decode(),
        "mode": mode,
        "runs": [
            {
                "label": label,
                "time": packed(each.time, deflate=deflate),
                "states": packed(each.states, deflate=deflate),
                "events": list(each.events),
                "extra": [extra],
            }
            for label, each in zip(labels, runs, strict=False)
        ],
    }
