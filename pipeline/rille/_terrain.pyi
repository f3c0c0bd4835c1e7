"""Types of the compiled module rille._terrain (solver/src/binding/terrain_module.cpp)."""

import numpy as np
from numpy.typing import NDArray

class RadialShapes:
    def __init__(self, knots: NDArray[np.float64], counts: NDArray[np.int64], cells: NDArray[np.float64]) -> None: ...
    @property
    def n_states(self) -> int: ...

class RadialForms:
    def __init__(
        self,
        column: NDArray[np.float64],
        row: NDArray[np.float64],
        matrix: NDArray[np.float64],
        amplitude: NDArray[np.float64],
        state: NDArray[np.float64],
    ) -> None: ...
    def __len__(self) -> int: ...

def stamp(
    shapes: RadialShapes, forms: RadialForms, heights: NDArray[np.float64], row0: int, column0: int, highest: bool, threads: int
) -> None: ...
def stamp_points(
    shapes: RadialShapes,
    forms: RadialForms,
    column: NDArray[np.float64],
    row: NDArray[np.float64],
    heights: NDArray[np.float64],
    highest: bool,
) -> None: ...
