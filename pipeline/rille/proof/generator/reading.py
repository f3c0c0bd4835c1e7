"""What is read of a simulated machine, and when."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One number at many instants.

    quantity, target, component : as in ``rille.model.recording.QUANTITIES`` (component '' for a scalar). frame : axes of vectors, of
    the world or of the body itself. times : (n,) [s], ascending, within the scenario.
    """

    quantity: str
    target: str
    component: str
    frame: Literal["world", "body"]
    times: NDArray[np.float64]
