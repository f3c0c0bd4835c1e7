"""Laws of joints and bodies in the implicit steps of a rover."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect
from rille.proof.generator.mechanism import Mechanism
from rille.proof.generator.moment import Moment
from rille.proof.generator.motion import laws_of
from rille.proof.generator.soil_laws import SOIL_LAWS
from rille.proof.subject import Subject

Array = NDArray[np.float64]


class RoverLaws:
    """All laws of joints and bodies of a rover, with their states.

    Forces are those at the end of a step, found by iteration. What a law of a joint gains on its effort at rest is taken along its chord.
    States follow the trapezoidal rule.
    """

    def __init__(self, mechanism: Mechanism, machine: Subject, effects: Sequence[Effect]) -> None:
        self._moment = Moment(mechanism, machine.rover)
        self._laws = laws_of(machine, [effect for effect in effects if effect.kind not in SOIL_LAWS])
        joints = {joint.name for joint in machine.rover.joints if joint.kind != "fixed"}
        self._rows = [mechanism.row(law.target) if law.target in joints else None for law in self._laws]
        self._states: list[Array] = []
        self._rates: list[Array] = []
        self._ends: list[tuple[Array, Array]] = []

    def begin(self, q: Array, z: Array) -> None:
        """States at t = 0."""
        self._moment.at(0.0, q, z)
        self._states = [law.start(self._moment) for law in self._laws]
        self._rates = [np.zeros(law.states) for law in self._laws]

    def forces(self, time: float, step: float, q: Array, z: Array, efforts: Mapping[str, float]) -> tuple[Array, Array]:
        """Reduced forces (size,) at the end of a step [s] with velocities z, and their slope (size, size), symmetric.

        time : of the end of the step [s]. q : at its beginning; the mechanism was moved there. efforts : joint -> effort of its drive.
        """
        moment = self._moment
        moment.time, moment.q, moment.drive_effort = time, q, dict(efforts)
        force, slope = np.zeros(len(z)), np.zeros((len(z), len(z)))
        self._ends = []
        for k, (law, row) in enumerate(zip(self._laws, self._rows, strict=True)):
            moment.z = z
            half = self._states[k] + 0.5 * step * self._rates[k]
            rate = self._rates[k]
            for _ in range(4 if law.states else 1):  # to its implicit end
                moment.force = np.zeros(len(z))
                rate = law.act(moment, half + 0.5 * step * rate)
            self._ends.append((half + 0.5 * step * rate, rate))
            force += moment.force
            if row is None:
                continue
            length = row @ row
            speed, effort = float(row @ z), float(moment.force @ row) / length
            if abs(speed) < 1e-12:
                speed = 1e-12
            moment.z, moment.force = z - speed / length * row, np.zeros(len(z))
            law.act(moment, self._states[k])
            chord = (float(moment.force @ row) / length - effort) / speed
            if chord > 0:
                slope += chord * np.outer(row, row)
        return force, slope

    def advance(self) -> None:
        """States at the end of the step for which forces were asked last."""
        for k, (state, rate) in enumerate(self._ends):
            self._states[k], self._rates[k] = state, rate

    def memory(self) -> list[Array]:
        """What steps go on from: states of all laws, then their rates."""
        return [*self._states, *self._rates]

    def remember(self, memory: Sequence[Array]) -> None:
        """Go on from there."""
        n = len(self._laws)
        self._states, self._rates = list(memory[:n]), list(memory[n:])

    @property
    def any(self) -> bool:
        """Whether there is any law."""
        return bool(self._laws)
