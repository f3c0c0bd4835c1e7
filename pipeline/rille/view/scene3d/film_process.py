"""The child process that draws films: ``python -m rille.view.scene3d.film_process job.npz``. Prints the share that is done."""

import json
import sys
from typing import Any

import numpy as np
from PIL import Image

from rille.view.scene3d.reading import things
from rille.view.scene3d.stage import Stage

# Colours of whole frames: what stands still, the legends, needs its own, too.
PALETTE = "split[a][b];[a]palettegen=max_colors=224:stats_mode=full[p];[b][p]paletteuse=dither=bayer:bayer_scale=5"


def main(job: str) -> None:
    """Draw what the job says."""
    import pyvista

    with np.load(job) as arrays:
        sheet = json.loads(arrays["sheet"].tobytes())
        data = {name: arrays[name] for name in arrays.files if name not in ("sheet", "scene")}
        scene = things(arrays["scene"].tobytes())
    plotter = pyvista.Plotter(off_screen=True, window_size=sheet["take"]["size"], lighting="none")
    stage = Stage(plotter, scene, sheet, data)
    count = len(data["times"])
    if sheet["stills"]:
        for number, target in enumerate(sheet["targets"]):
            Image.fromarray(stage.frame(number)).save(target)
            print((number + 1) / count, flush=True)
        return
    writer = _writer(sheet["targets"][0], sheet["take"])
    for number in range(count):
        writer.send(np.ascontiguousarray(stage.frame(number)))
        print((number + 1) / count, flush=True)
    writer.close()


def _writer(target: str, take: dict[str, Any]) -> Any:
    """ffmpeg, which takes frames."""
    import imageio_ffmpeg

    options: dict[str, Any] = {"codec": "libx264", "quality": 7, "macro_block_size": 2}
    if target.endswith(".gif"):
        words = ["-filter_complex", PALETTE, "-loop", "0"]
        options = {"codec": "gif", "quality": None, "macro_block_size": 1, "pix_fmt_out": "pal8", "output_params": words}
    writer = imageio_ffmpeg.write_frames(target, tuple(take["size"]), fps=take["fps"], **options)
    writer.send(None)
    return writer


if __name__ == "__main__":
    main(sys.argv[1])
