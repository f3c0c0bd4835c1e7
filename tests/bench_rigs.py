"""Made-up benches: points of a rig with a law planted, with the noise of real ones."""

from dataclasses import replace

import numpy as np

from effect_rigs import LUNAR_SOIL
from rille import simulate, store
from rille.diagnosis.bench.bench_rig import BenchRig
from rille.model import BenchPoints, BenchWheel
from rille.model.recording import Channel, Recording

NOISE = {"sinkage": 4e-4, "drawbar_pull": 0.5, "side_force": 0.5, "drive_torque": 0.06}
SLIPS, ANGLES, LOADS = (-0.3, -0.1, 0.05, 0.2, 0.35, 0.5, 0.7), (0.0, 20.0), (60.0, 180.0)
WHEEL = BenchWheel(radius=0.12, width=0.12)
LUGGED = replace(WHEEL, grouser_count=20, grouser_height=0.012)
KINDS = store.effect_kinds()


def simulator(speed=0.05):
    """The bench of the solver."""

    def run(points, soil, wheel, effects):
        conditions = {"load": points.load, "slip_ratio": points.slip_ratio, "slip_angle": points.slip_angle}
        rows = simulate.effect_rows(effects, KINDS)
        result = simulate.bench("bekker_wong", soil, wheel, effects=rows, speed=speed, **conditions)
        return result.points, result.status

    return run


def made_rig(
    name="rig",
    *,
    planted=(),
    wheel=WHEEL,
    true_soil=LUNAR_SOIL,
    soil=None,
    known=True,
    speed=0.05,
    slips=SLIPS,
    angles=ANGLES,
    loads=LOADS,
    repeats=2,
    seed=1,
    channels=tuple(NOISE),
    target="wheel",
    shift=None,
    **setup,
):
    """A recording with effects planted, and the bench that is assumed for it. shift : channel -> what its sensor makes of it."""
    random = np.random.default_rng(seed)
    grid = np.array([(w, s, np.radians(a)) for w in loads for a in angles for s in slips for _ in range(repeats)])
    points = BenchPoints.at(*grid.T)
    truth, status = simulator(speed)(points, true_soil, wheel, planted)
    assert set(status) == {"done"}
    number = np.arange(len(points), dtype=float)
    measured = tuple(
        Channel(
            name=channel,
            quantity=f"wheel.{channel}",
            target=target,
            unit="m" if channel == "sinkage" else "N",
            time=number,
            value=(shift or {}).get(channel, lambda v: v)(getattr(truth, channel)) + NOISE[channel] * random.standard_normal(len(points)),
        )
        for channel in channels
    )
    assumed = replace(soil or true_soil, provenance="measured" if known else "stated")
    recording = Recording(name=name, kind="points", setup=setup, channels=measured)
    return BenchRig(recording=recording, conditions=points, wheel=target, shape=wheel, soil=assumed, speed=speed, run=simulator(speed))
