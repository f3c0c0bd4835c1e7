"""Points of a wheel bench with noise, as a recording."""

import numpy as np

from rille import simulate, store
from rille.model.recording import Recording
from rille.proof.points import LAW, MEASURED, as_measured, conditions, rim
from rille.proof.subject import Subject

SPEED = 0.05  # [m/s]
SLIPS_EACH = 8  # how many slip ratios a recording has


def points_recording(machine: Subject, name: str, seed: int, rng: np.random.Generator) -> Recording:
    """What a bench of the solver measures of the wheel; every recording has its own conditions.

    rng : draws the conditions, the same at every size of the fault. seed : of the noise.
    """
    assert machine.terrain is not None
    where = conditions(np.random.default_rng([*name.encode(), int(rng.integers(1 << 31))]), SLIPS_EACH)
    effects = simulate.effect_rows(machine.effects, store.effect_kinds())
    gravity, wheel, soil = abs(machine.gravity[2]), machine.rover.wheels[0], machine.terrain.soils[0]
    points = simulate.bench(LAW, soil, rim(wheel), **where, effects=effects, gravity=gravity, speed=SPEED, threads=1).points
    made = {word: getattr(points, word) for word in MEASURED}
    return as_measured(soil, name, wheel.name, SPEED, where, made, np.random.default_rng(seed))
