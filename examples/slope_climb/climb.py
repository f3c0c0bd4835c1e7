"""Does a soil that was fitted on the bench predict how a rover slips uphill? Tohoku University, slopes of 11 to 14 degrees in dry sand.

The soil is fitted to the drawbar pull of a single wheel (as examples/soil_fit/tohoku.sh does). A rover of four such wheels then climbs in
the solver; its steady slip is compared with the measured one, and with the slip at which the bench alone would pull W sin(slope).

What the publication does not print is nominal here: wheelbase 0.6 m, track 0.5 m, centre of mass 0.15 m above ground. The weight a wheel,
64.7 N (6.6 kg), is that of the group's later paper, and agrees with the printed drawbar pull, W sin(slope).

Usage: python examples/slope_climb/climb.py [FIGURE.png]     about 10 s; needs the real data (RILLE_DATA)
"""

import csv
import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from rille._solver import Simulation
from scipy.optimize import brentq

from rille import diagnosis, simulate, store, terrain
from rille.model import (
    BenchWheel,
    Body,
    Command,
    Drive,
    Joint,
    MassProperties,
    MaterialPair,
    Rover,
    Scenario,
    Soil,
    Terrain,
    Wheel,
)

EARTH = 9.80665  # [m/s^2]
DATA = Path(os.environ.get("RILLE_DATA", "../shared")) / "data/wheel_bench"
WHEEL = BenchWheel(radius=0.09, width=0.10)
LOAD = 6.6 * EARTH  # [N] a wheel
SPEED = 0.05  # [m/s] of the rim
LAW = "bekker_wong"


def fitted_soil() -> tuple[Soil, Soil]:
    """Prior and fitted soil from drawbar pull at 24.5 and 53.9 N."""
    points = simulate.read_bench_csv(DATA / "tohoku_yoshida2003_drawbar_pull.csv")
    prior = terrain.soils()["fjs1_simulant"]

    def simulator(soil, given):
        return simulate.bench_at(LAW, soil, WHEEL, given)

    held = np.isclose(points.load, 34.3)
    result = diagnosis.fit_soil(simulator, points.where(~held), points.where(held), prior, ["friction_angle", "shear_modulus"])
    return prior, replace(result.soil, name="fitted")


def box(name: str, mass: float, com: tuple[float, float, float], size: tuple[float, float, float]) -> Body:
    """Homogeneous box."""
    x, y, z = (s * s for s in size)
    inertia = np.diag([y + z, x + z, x + y]) * mass / 12
    properties = MassProperties(mass=mass, com=np.array(com), inertia=inertia, mass_provenance="stated", inertia_provenance="stated")
    return Body(name=name, properties=properties)


def rover() -> Rover:
    """Four driven wheels on a stiff body."""
    bodies = [box("body", 4 * 5.6, (0, 0, 0.15), (0.5, 0.4, 0.1))]
    joints, drives, wheels = [], [], []
    for end, x in (("front", 0.3), ("rear", -0.3)):
        for side, y in (("left", 0.25), ("right", -0.25)):
            name, center = f"{end}_{side}", (x, y, WHEEL.radius)
            bodies.append(box(name, 1.0, center, (0.15, WHEEL.width, 0.15)))
            joints.append(Joint(name=name, kind="hinge", parent="body", child=name, point=center, axis=(0, 1, 0)))
            drives.append(Drive(name=name, joint=name, mode="speed", max_torque=50.0))
            wheels.append(Wheel(name=name, joint=name, center=center, radius=WHEEL.radius, width=WHEEL.width))
    return Rover(bodies=tuple(bodies), joints=tuple(joints), drives=tuple(drives), wheels=tuple(wheels))


def climb(soil: Soil, slope: float, folder: Path) -> float:
    """Mean slip ratio of the four wheels over the last 10 of 30 s, uphill along x on a slope [rad]."""
    x = np.linspace(-2, 4, 61)
    heights = np.tile(np.tan(slope) * x, (41, 1))
    ground = Terrain(
        name="slope",
        heights=heights,
        posting_x=0.1,
        posting_y=0.1,
        x_west=-2.0,
        y_north=2.0,
        soil=soil.name,
        soils=(soil,),
        pairs=(MaterialPair(response=LAW, soil=soil.name),),
    )
    machine = rover()
    scenario = Scenario(
        name="climb",
        duration=30,
        gravity=(0, 0, -EARTH),
        terrain="slope",
        placement="on_terrain",
        settle_time=5,
        commands=tuple(Command(drive=d.name, time=0.0, value=SPEED / WHEEL.radius) for d in machine.drives),
    )
    path = folder / f"{soil.name}_{slope:.4f}.db"
    store.create(path)
    store.write_rover(path, machine)
    store.write_terrain(path, ground)
    store.write_scenario(path, scenario)
    simulation = Simulation(str(path))
    simulation.settle()
    channels = [("wheel.slip_ratio", wheel.name, 0) for wheel in machine.wheels]
    slips = simulation.sample(30000, 100, channels)
    return float(slips[200:].mean())


def bench_slip(soil: Soil, slope: float) -> float:
    """Slip ratio at which a single wheel on the bench pulls W sin(slope) under W cos(slope); NaN if it never does."""

    def missing(slip: float) -> float:
        point = simulate.bench(LAW, soil, WHEEL, load=LOAD * np.cos(slope), slip_ratio=slip).points
        return float(point.drawbar_pull[0]) - LOAD * np.sin(slope)

    return brentq(missing, 0.0, 0.95) if missing(0.95) > 0 else np.nan


def main(figure: Path) -> None:
    """Fit, climb, compare, draw."""
    with (DATA / "tohoku_yoshida2003_slope_vs_slip.csv").open() as file:
        rows = [(np.radians(float(r["slope_deg"])), float(r["steady_slip"])) for r in csv.DictReader(file)]
    prior, fitted = fitted_soil()
    print("slope [deg]   measured slip   fitted soil: rover   (bench)   difference   prior soil: rover")
    table = []
    with tempfile.TemporaryDirectory() as folder:
        for slope, measured in rows:
            ours, bench, before = climb(fitted, slope, Path(folder)), bench_slip(fitted, slope), climb(prior, slope, Path(folder))
            table.append((np.degrees(slope), measured, ours, before))
            print(f"{table[-1][0]:11.0f} {measured:15.3f} {ours:20.3f} {bench:9.3f} {ours - measured:+12.3f} {before:19.3f}")
    draw(np.array(table), figure)
    print(figure)


def draw(table: np.ndarray, figure: Path) -> None:
    """Slip against slope."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    canvas, axis = plt.subplots(figsize=(5.6, 4.0), layout="constrained")
    axis.plot(table[:, 0], table[:, 1], "o", color="#333333", label="measured (Yoshida et al. 2003)")
    axis.plot(table[:, 0], table[:, 2], "-", color="#1b6ca8", label="rover, soil fitted on the bench")
    axis.plot(table[:, 0], table[:, 3], "--", color="#1b6ca8", label="rover, soil of the library (FJS-1)")
    axis.set(xlabel="slope [deg]", ylabel="slip ratio [-]", ylim=(0, None))
    axis.legend(frameon=False)
    axis.spines[["top", "right"]].set_visible(False)
    canvas.savefig(figure, dpi=130)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("climb.png"))
