"""Recordings of a rover on soft soil."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect, Scenario
from rille.proof.generator.reading import Reading
from rille.proof.generator.rover_on_soil import RoverOnSoil
from rille.proof.generator.rover_readout import Trace, read
from rille.proof.subject import Subject

Array = NDArray[np.float64]
STEP = 2e-3  # [s]


def ride(machine: Subject, scenario: Scenario, laws: Sequence[Effect], readings: Sequence[Reading], step: float = STEP) -> list[Array]:
    """Values (n,) of each reading, of a rover that was placed on its terrain and has settled before t = 0.

    step : of integration [s], at most.

    Raises
    ------
    PhysicsFailed : if a wheel leaves the terrain or is buried, or speeds are not finite.
    """
    rover = RoverOnSoil(machine, scenario, (*machine.effects, *laws))
    rover.place()
    rover.settle(scenario.settle_time, step)
    n = int(np.ceil(scenario.duration / step - 1e-9))
    h = scenario.duration / n
    wanted = {(r.quantity, r.target) for r in readings}
    wanted |= {("part.orientation", r.target) for r in readings if r.frame == "body"}
    traces = {one: Trace(states=[], made=[]) for one in wanted}
    for k in range(n + 1):
        for (quantity, target), trace in traces.items():
            trace.states.append(rover.state(quantity, target))
        if k == n:
            break
        rover.step(k * h, h)
        for (quantity, target), trace in traces.items():
            trace.made.append(rover.made(quantity, target))
    for (quantity, _), trace in traces.items():
        if quantity == "part.linear_acceleration":
            trace.made = list(np.diff(np.array(trace.states), axis=0) / h - np.array(scenario.gravity))
    instants = np.linspace(0.0, scenario.duration, n + 1)
    return [read(r, instants, traces[r.quantity, r.target], traces.get(("part.orientation", r.target))) for r in readings]
