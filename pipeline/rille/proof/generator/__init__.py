"""The independent generator: recordings of machines, with no physics in common with the solver.

Bodies and joints are MuJoCo's, soil is integrated by adaptive quadrature, the equations of motion are integrated by methods and with
steps of their own. Only values (``rille.model``, ``rille.proof.subject``) are shared with the rest of rille.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect, Scenario
from rille.proof.generator.motion import motion
from rille.proof.generator.reading import Reading
from rille.proof.subject import Subject


def simulate(machine: Subject, scenario: Scenario, laws: Sequence[Effect], readings: Sequence[Reading]) -> list[NDArray[np.float64]]:
    """Values (n,) of each reading of a machine that goes through a scenario.

    laws : at work in the machine, beside those that its model has; of the catalogue, or strange ones.

    Raises
    ------
    PhysicsFailed : if the motion cannot be carried to its end.
    """
    if machine.rover.wheels:
        from rille.proof.generator.ride import ride

        return ride(machine, scenario, laws, readings)
    return motion(machine, scenario, laws, readings)
