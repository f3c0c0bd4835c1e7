"""The child process that draws: ``python -m rille.view.draw_process job.npz``."""

import json
import os
import sys

import numpy as np


def main(job: str) -> None:
    """Draw every picture of a job file made by :mod:`rille.view.drawing`."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    with np.load(job) as arrays:
        for sheet in json.loads(arrays["job"].tobytes()):
            plotter = pyvista.Plotter(off_screen=True, window_size=list(sheet["size"]), lighting="none")
            plotter.set_background(sheet["background"][0], top=sheet["background"][1])
            sun = np.array(sheet["sun"])
            plotter.add_light(pyvista.Light(position=tuple(100 * sun), light_type="scene light", intensity=0.95))
            plotter.add_light(pyvista.Light(light_type="headlight", intensity=0.32))
            for item in sheet["items"]:
                add(plotter, item, arrays)
            if sheet["labels"]:
                points, texts = zip(*sheet["labels"], strict=True)
                plotter.add_point_labels(
                    np.array(points), list(texts), font_size=20, text_color="white", shape=None, show_points=False, always_visible=True
                )
            position, focus, up, angle = sheet["camera"]
            plotter.camera.position, plotter.camera.focal_point, plotter.camera.up = position, focus, up
            plotter.camera.view_angle = angle
            plotter.reset_camera_clipping_range()
            plotter.enable_anti_aliasing("ssaa")
            plotter.screenshot(sheet["path"])
            plotter.close()


def add(plotter, item: dict, arrays) -> None:
    """One mesh."""
    import pyvista

    key = item["key"]
    triangles = arrays[key + "t"]
    faces = np.hstack([np.full((len(triangles), 1), 3), triangles]).ravel()
    mesh = pyvista.PolyData(arrays[key + "v"].astype(float), faces)
    options = {"opacity": item["opacity"], "lighting": item["lit"], "show_scalar_bar": False}
    if key + "c" in arrays:
        plotter.add_mesh(mesh, scalars=arrays[key + "c"], rgb=True, **options)
    elif key + "s" in arrays:
        bar = {
            "title": item["title"],
            "color": "white",
            "vertical": False,
            "position_x": 0.68,
            "position_y": 0.03,
            "width": 0.29,
            "height": 0.07,
            "title_font_size": 22,
            "label_font_size": 18,
            "fmt": "%.2f",
        }
        options["show_scalar_bar"] = bool(item["title"])
        plotter.add_mesh(mesh, scalars=arrays[key + "s"], cmap="turbo", clim=item["limits"], scalar_bar_args=bar, **options)
    else:
        shaded = mesh.compute_normals(split_vertices=True, feature_angle=30) if item["lit"] else mesh
        plotter.add_mesh(shaded, color=item["color"], smooth_shading=item["lit"], specular=0.15 if item["lit"] else 0.0, **options)


if __name__ == "__main__":
    main(sys.argv[1])
