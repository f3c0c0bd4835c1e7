"""Meshes of a model as files: one per part, one per hull, or the whole mechanism at the zero pose."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.writing import FileNames, Names, writable
from rille.model import CollisionShape, InputRefused, Part, Rover
from rille.model.rotation import pose_matrix

Array = NDArray[np.float64]
Triangles = NDArray[np.int32]

FOLDER = "meshes"
"""Folder of the mesh files beside the model file."""

GLTF_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
"""M, z up, into the frame of glTF 2.0, y up (Khronos 2021, sec. 3.4)."""


def rgba(color: str) -> tuple[float, float, float, float]:
    """Colour ``#rrggbb`` as red, green, blue and alpha in 0 to 1."""
    return int(color[1:3], 16) / 255, int(color[3:5], 16) / 255, int(color[5:7], 16) / 255, 1.0


def linear(color: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """sRGB to linear light (IEC 61966-2-1), alpha as it is."""
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in color[:3])
    return red, green, blue, color[3]


def visual_mesh(part: Part) -> tuple[NDArray[np.float32], Triangles] | None:
    """All visual meshes of a part as one: vertices (n, 3) [m] and triangles (m, 3) in the part's frame; None: it has none."""
    meshes = [mesh for mesh in part.meshes if mesh.purpose == "visual" and len(mesh.triangles)]
    if not meshes:
        return None
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)])
    return np.concatenate([mesh.vertices for mesh in meshes]), np.asarray(triangles, dtype=np.int32)


def hull_mesh(vertices: Array) -> tuple[Array, Triangles] | None:
    """Surface of the convex hull of points (n, 3), triangles counter-clockwise from outside; None if they lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except (QhullError, ValueError):
        return None
    used, triangles = np.unique(hull.simplices, return_inverse=True)
    corners, triangles = vertices[used], triangles.reshape(-1, 3)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return corners, triangles.astype(np.int32)


def write_obj(path: Path, vertices: NDArray[np.floating], triangles: Triangles) -> None:
    """Write a Wavefront OBJ file whose coordinates read back exactly (trimesh rounds to a fixed number of decimals)."""
    digits = 9 if vertices.dtype == np.float32 else 17
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="ascii") as file:
            np.savetxt(file, vertices, f"v %.{digits}g %.{digits}g %.{digits}g")
            np.savetxt(file, triangles + 1, "f %d %d %d")


def write_part_meshes(rover: Rover, folder: Path) -> dict[str, str]:
    """Write the visual mesh of every part that is in use, once; returns file names in ``folder`` by the part's name."""
    used = {instance.part for instance in rover.instances}
    names, files = FileNames(), {}
    for part in rover.parts:
        mesh = visual_mesh(part) if part.name in used else None
        if mesh is not None:
            files[part.name] = names.take(part.name, ".obj")
            write_obj(folder / files[part.name], *mesh)
    return files


def write_hulls(shapes: Iterable[CollisionShape], folder: Path, note: Callable[[str], None]) -> dict[int, str]:
    """Write the hulls among collision shapes; returns file names in ``folder`` by the identity (``id``) of the shape."""
    names, files = FileNames(), {}
    for shape in shapes:
        if shape.kind != "hull" or shape.vertices is None:
            continue
        mesh = hull_mesh(np.asarray(shape.vertices, dtype=float))
        if mesh is None:
            note(f"a hull of body '{shape.body}' is flat and is left out of the collision shapes")
            continue
        files[id(shape)] = names.take(f"hull_{shape.body}", ".obj")
        write_obj(folder / files[id(shape)], *mesh)
    return files


def make_scene(rover: Rover, *, gltf: bool = False) -> Any:
    """The mechanism at the zero pose as ``trimesh.Scene``: a node per body, below it one per part instance; each part's mesh once.

    gltf : turned so that y is up, and with linear colours, as glTF 2.0 asks; else M, and the colours as they are.

    Raises
    ------
    InputRefused : if no part has a visual mesh.
    """
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    scene = trimesh.Scene(base_frame="world")
    names = Names(["world"])
    root = names.take("model")
    scene.graph.update(frame_from="world", frame_to=root, matrix=GLTF_UP if gltf else np.eye(4))
    frames: dict[str | None, tuple[str, Array]] = {None: (root, np.eye(4))}
    for body in rover.bodies:
        place = np.eye(4)
        place[:3, 3] = body.frame
        frames[body.name] = names.take(body.name), place
        scene.graph.update(frame_from=root, frame_to=frames[body.name][0], matrix=place)
    parts = {part.name: part for part in rover.parts}
    geometries: dict[str, str | None] = {}
    geometry_names = Names()
    for instance in rover.instances:
        part = parts[instance.part]
        if part.name not in geometries:
            mesh = visual_mesh(part)
            geometries[part.name] = None if mesh is None else geometry_names.take(part.name)
            if mesh is not None:
                color = linear(rgba(part.color)) if gltf else rgba(part.color)
                look = PBRMaterial(name=f"color_{part.color[1:]}", baseColorFactor=color, metallicFactor=0.0, roughnessFactor=0.8)
                made = trimesh.Trimesh(*mesh, process=False, visual=TextureVisuals(material=look))
                scene.geometry[geometries[part.name]] = made
        geometry = geometries[part.name]
        if geometry is not None:
            frame, place = frames[instance.body]
            pose = np.linalg.inv(place) @ pose_matrix(instance.pose)
            scene.graph.update(frame_from=frame, frame_to=names.take(instance.path), matrix=pose, geometry=geometry)
    if not scene.geometry:
        raise InputRefused("the model has no visual meshes to export; build it from CAD, or choose the format urdf, mjcf or sdf")
    return scene


def write_scene(rover: Rover, path: Path) -> Path:
    """Write the whole mechanism at the zero pose: Wavefront OBJ (``.obj`` and ``.mtl``; M, z up) or glTF (``.glb``; y up, as it asks).

    Lengths are metres in both. glTF keeps one mesh per part and one node per instance, below a node per body; OBJ has none of these.

    Raises
    ------
    InputRefused : for another suffix, a model without meshes, a place that cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix not in (".obj", ".glb"):
        raise InputRefused(f"'{path.name}' is neither .obj nor .glb; choose one of them")
    scene = make_scene(rover, gltf=suffix == ".glb")
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if suffix == ".glb":
            path.write_bytes(scene.export(file_type="glb"))
        else:
            _write_obj_scene(scene, path)
    return path


def _write_obj_scene(scene: Any, path: Path) -> None:
    from trimesh.exchange.obj import export_obj

    material_file = path.with_suffix(".mtl").name
    text, more = export_obj(scene, return_texture=True, include_normals=False, digits=9, mtl_name=material_file, header="written by rille")
    path.write_text(text, encoding="utf-8")
    for name, content in more.items():
        (path.parent / name).write_bytes(content if isinstance(content, bytes) else content.encode())
