"""CoACD (Wei et al. 2022) in a process of its own: it writes to stdout, may take minutes, and can crash on what is not closed.

``python -m rille.cad.collision.coacd_process job.npz hulls.npz`` is the child.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def coacd_pieces(
    vertices: Array, triangles: NDArray[np.int64], *, concavity: float, most: int, time_limit: float
) -> tuple[list[Array], str | None]:
    """Vertices of convex pieces, shape (k, 3) each, or a sentence that says why there are none.

    concavity : CoACD's threshold, of the part's size normalised to 2. most : largest number of pieces. time_limit : [s].
    """
    with tempfile.TemporaryDirectory(prefix="rille-coacd-") as folder:
        job, done = Path(folder) / "job.npz", Path(folder) / "hulls.npz"
        np.savez(job, vertices=vertices, triangles=triangles, concavity=concavity, most=most)
        command = [sys.executable, "-m", "rille.cad.collision.coacd_process", str(job), str(done)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=time_limit)
        except subprocess.TimeoutExpired:
            return [], f"CoACD took more than {time_limit:g} s"
        if run.returncode != 0 or not done.is_file():
            last = (run.stderr.strip().splitlines() or ["no word"])[-1]
            how = f"signal {-run.returncode}" if run.returncode < 0 else f"code {run.returncode}"
            return [], f"CoACD failed ({how}: {last})"
        with np.load(done) as arrays:
            return [arrays[name] for name in arrays.files], None


def main(job: str, done: str) -> None:
    """Decompose the job's mesh."""
    import coacd

    coacd.set_log_level("error")
    with np.load(job) as arrays:
        mesh = coacd.Mesh(arrays["vertices"], arrays["triangles"])
        parts = coacd.run_coacd(mesh, threshold=float(arrays["concavity"]), max_convex_hull=int(arrays["most"]), seed=0)
    np.savez(done, *[np.asarray(vertices, np.float64) for vertices, _ in parts])


if __name__ == "__main__":
    main(*sys.argv[1:])
