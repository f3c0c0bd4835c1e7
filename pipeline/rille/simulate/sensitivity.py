"""How channels answer to parameters: derivatives of short windows, by central differences over threads."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Channel = tuple[str, str, int]  # quantity, target, component


def sensitivities(
    model: Any,
    steps: Mapping[str, float],
    motions: ArrayLike,
    *,
    n_steps: int,
    every: int,
    channels: Sequence[Channel],
    threads: int = 0,
) -> NDArray[np.float64]:
    """Derivatives of channels with respect to parameters, d y / d p = (y(p + d) - y(p - d)) / 2 d.

    Each window starts from the same motion for both sides, so that what is differentiated is the physics of the window alone.

    Parameters
    ----------
    model : a ``rille._solver.Model``; not changed.
    steps : parameter (a name of ``model.parameters()``) -> step d [unit of the parameter]. The error is of second order in d: a step of
        1e-3 of the value is usually good; where a stick or a limit lies between both sides, the difference is a secant.
    motions : (n_windows, 8 + n_q + n_v), rows of ``Simulation.motion()``.
    n_steps, every, channels, threads : as of ``rille._solver.windows``.

    Returns
    -------
    Shape (n_parameters, n_windows, n_steps // every, n_channels) in the order of ``steps``; NaN after a run has ended.

    Raises
    ------
    InputRefused : for a parameter that the model does not have, or one that leaves its bounds by the step.
    """
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    models = []
    for name, step in steps.items():
        for side in (step, -step):
            changed = model.copy()
            changed.set(name, model.get(name) + side)
            models.append(changed)
    rows = np.ascontiguousarray(np.atleast_2d(np.asarray(motions, dtype=float)))
    answers = _solver.windows(models, rows, n_steps, every, list(channels), threads=threads)
    widths = 2 * np.array(list(steps.values()))
    return (answers[0::2] - answers[1::2]) / widths[:, None, None, None]
