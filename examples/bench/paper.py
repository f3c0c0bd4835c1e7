"""The comparison of the original paper: wheels of 3, 5, 7 and 20 kg on the bench, the engine against a reference quadrature.

The engine is the rig as a multibody simulation in the solver, run until it has settled; the reference integrates the printed formulas
adaptively (``reference.py``). Prints the largest differences and writes the figure.

Usage: python examples/bench/paper.py [FIGURE.png]     about 2 s
"""

import sys
from pathlib import Path

import numpy as np
from reference import under_load

from rille import simulate, terrain
from rille.model import BenchPoints, BenchWheel
from rille.view.bench_plots import plot_bench

EARTH = 9.80665  # [m/s^2]
LOADS = np.array([3.0, 5.0, 7.0, 20.0]) * EARTH  # [N]
SLIPS = np.linspace(0.0, 0.8, 17)
WHEEL = BenchWheel(radius=0.15, width=0.165)
LAW = "bekker_wong"


def main(figure: Path) -> None:
    """Sweep both, compare, draw."""
    soil = terrain.soils()["lunar_sourcebook"]
    load, slip = (grid.ravel() for grid in np.meshgrid(LOADS, SLIPS, indexing="ij"))
    engine = simulate.bench(LAW, soil, WHEEL, load=load, slip_ratio=slip, method="dynamic")
    assert set(engine.status) == {"done"}, engine.status
    sinkage, pull, torque = np.array([under_load(LAW, soil, WHEEL.radius, WHEEL.width, w, s) for w, s in zip(load, slip, strict=True)]).T
    reference = BenchPoints(
        load=load,
        slip_ratio=slip,
        slip_angle=np.zeros_like(load),
        sinkage=sinkage,
        drawbar_pull=pull,
        side_force=np.zeros_like(load),
        drive_torque=torque,
    )
    print("mass [kg]   largest difference of sinkage   of drawbar pull / load   of torque / (load radius)")
    for w in LOADS:
        here = load == w
        differences = (
            np.abs(engine.points.sinkage / sinkage - 1)[here].max(),
            np.abs(engine.points.drawbar_pull - pull)[here].max() / w,
            np.abs(engine.points.drive_torque - torque)[here].max() / (w * WHEEL.radius),
        )
        print(f"{w / EARTH:9g} " + "".join(f"{value:26.1e}" for value in differences))
    title = f"Wheel of {2e3 * WHEEL.radius:g} x {1e3 * WHEEL.width:g} mm on {soil.name}, {LAW}"
    plot_bench(
        [("engine: the rig, simulated until it settles", engine.points)], figure, reference, title, dots="reference: adaptive quadrature"
    )
    print(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("paper.png"))
