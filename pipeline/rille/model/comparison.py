"""A recording beside what the model gives for it: residuals per channel and window. Values only; ``diagnosis`` makes statistics of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel

Array = NDArray[np.float64]
Mode = Literal["windows", "whole", "inverse_dynamics", "points"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedChannel:
    """One observed channel.

    channel : its description, without samples. time : (n,) [s] of the recording. measured, simulated : (n,) [unit]; simulated at the
    instants that the sensor speaks of, not rounded as it rounds. window : (n,) number of the window that each sample belongs to.
    noise : 1 sigma [unit] by which residuals are normalised. noise_from : ``stated``, ``innovations``, ``differences``, ``repeats``,
    ``resolution`` or ``assumed``. noise_degrees : of freedom that it was estimated with, if few.
    left_out : why the channel takes no part in fits and rankings ('' = it does).
    start_gain : (n,) standard deviation [unit] that the uncertainty of the window's start state gives to this sample; 0 if unknown.
    instants : root mean square [unit] of what simulating all a quarter of a step later would change: no simulation knows time better.
    """

    channel: Channel
    time: Array
    measured: Array
    simulated: Array
    window: NDArray[np.int64]
    noise: float
    noise_from: str = "stated"
    noise_degrees: float = float("inf")
    left_out: str = ""
    start_gain: Array = field(default_factory=lambda: np.empty(0))
    instants: float = 0.0

    @property
    def residual(self) -> Array:
        """measured - simulated [unit]; angles of orientations (roll, pitch, yaw) are wrapped to [-pi, pi)."""
        difference = self.measured - self.simulated
        if self.channel.component in ("roll", "pitch", "yaw"):
            difference = (difference + np.pi) % (2 * np.pi) - np.pi
        return difference


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareWindow:
    """One stretch that was replayed from the smoothed recorded state.

    start, stop : [s] of the recording. shift : distance of the fitted start state from the smoothed one, in standard deviations [-].
    ended : why the simulation ended early, '' if it did not.
    """

    number: int
    start: float
    stop: float
    shift: float = 0.0
    ended: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Regimes:
    """Conditions along the replay, from the simulation. time, window : (m,). values : name -> (m,).

    Names: ``speed`` [m/s], ``turning_rate`` [rad/s], ``slope`` [rad] of the ground below the root (or its tilt), ``heading`` [rad], ``x``,
    ``y`` [m] of the root; per wheel ``slip_ratio/NAME`` [-], ``normal_load/NAME`` [N], of bench points also ``slip_angle/NAME`` [rad]; per
    joint ``joint_speed/NAME`` [rad/s or m/s], ``effort/NAME``. Of bench points ``point`` is the number of the point in the recording.
    """

    time: Array
    window: NDArray[np.int64]
    values: Mapping[str, Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One recording replayed by one model."""

    recording: str
    model: str
    scenario: str
    mode: Mode
    channels: tuple[ComparedChannel, ...]
    windows: tuple[CompareWindow, ...]
    regimes: Regimes
    notes: tuple[str, ...] = ()
