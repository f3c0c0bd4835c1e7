"""Points of a single-wheel bench, calculated or measured."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CONDITIONS = {"load": "N", "slip_ratio": "1", "slip_angle": "rad"}
RESPONSES = {"sinkage": "m", "drawbar_pull": "N", "side_force": "N", "drive_torque": "N m"}


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchWheel:
    """radius of the rim, width, grouser_height [m]; grouser_count 0: smooth."""

    radius: float
    width: float
    grouser_count: int = 0
    grouser_height: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchPoints:
    """Steady points, arrays of one length n.

    Conditions: load [N], slip_ratio [-] in [-1, 1], slip_angle [rad]. Responses, NaN where unknown: sinkage [m],
    drawbar_pull [N] along the heading, side_force [N] against the drift, drive_torque [N m].
    """

    load: Array
    slip_ratio: Array
    slip_angle: Array
    sinkage: Array
    drawbar_pull: Array
    side_force: Array
    drive_torque: Array

    @classmethod
    def at(cls, load: ArrayLike, slip_ratio: ArrayLike, slip_angle: ArrayLike = 0.0) -> Self:
        """Conditions, scalars or (n,), without responses."""
        grid = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, dtype=float)) for v in (load, slip_ratio, slip_angle)))
        unknown = np.full(len(grid[0]), np.nan)
        return cls(**dict(zip(CONDITIONS, grid, strict=True)), **dict.fromkeys(RESPONSES, unknown))

    def __len__(self) -> int:
        return len(self.load)

    def where(self, chosen: NDArray[np.bool_]) -> Self:
        """The points that are chosen, (n,) flags."""
        return type(self)(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    def known(self) -> tuple[str, ...]:
        """Names of the responses of which there is at least one number."""
        return tuple(name for name in RESPONSES if np.isfinite(getattr(self, name)).any())
