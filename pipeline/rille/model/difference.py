"""Where a model differs from recordings: statistics of the residuals per channel, window, target and regime. Values only.

Normalised means divided by the channel's noise (1 sigma): 1 is the noise floor. p is the probability of so much or more if the model were
right, q the same after Benjamini-Hochberg over all of its kind; ``differs`` is q < ``Difference.false_discovery_rate`` together with a size
that matters (``diagnosis.verdict`` says which). Numbers that could not be told are NaN.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.comparison import Mode
from rille.model.recording import full_name

Array = NDArray[np.float64]
NAN = float("nan")
Verdict = Literal["white", "biased", "delayed", "scaled", "coloured", "spiky", "noisy", "left out", "no data"]
VERDICTS: dict[Verdict, str] = {
    "white": "nothing beyond the noise",
    "biased": "a constant offset explains most of what is beyond the noise",
    "delayed": "a delay against the simulation explains most of what is beyond the noise",
    "scaled": "a gain against the simulation explains most of what is beyond the noise",
    "coloured": "the residual is correlated in time, and no single bias, delay or gain explains it",
    "spiky": "a few far samples make up what is beyond the noise",
    "noisy": "uncorrelated in time, but larger than the noise",
    "left out": "takes no part in fits, rankings and the verdict",
    "no data": "too few samples, or no noise known to judge them by",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Whiteness:
    """Correlation in time of the residuals of one channel, pooled over windows.

    autocorrelation : (K,) at lags 1..K samples [-], corrected for the fitted start states. band : (K,) 95 % of the white ones stay within
    +-band. statistic : Ljung-Box, robust to unequal variance; chi-squared with ``lags`` degrees of freedom under whiteness. p : of it.
    lag1, lag1_error : first autocorrelation and its standard error.
    """

    autocorrelation: Array
    band: Array
    lags: int
    statistic: float
    p: float
    lag1: float
    lag1_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LagFit:
    """measured(t) = gain simulated(t - delay) + offset, fitted over all windows. Errors: 1 sigma, robust to correlated residuals.

    delay [s] : positive when the measurement comes later. explained_* : share of the residual's mean square that it alone takes away.
    In windows mode part of a delay is taken up by the fitted start states: the true one is at least as large.
    """

    delay: float = NAN
    delay_error: float = NAN
    gain: float = NAN
    gain_error: float = NAN
    explained_by_delay: float = NAN
    explained_by_gain: float = NAN


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelDifference:
    """One channel over all windows of all recordings that have it.

    name, quantity, component, target, unit : of the channel. windows : number of windows with samples. n : finite residuals.
    noise [unit], noise_from : as in ``ComparedChannel``; root mean square over the recordings (normalising is per recording).
    rms, rms_low, rms_high [unit] : root mean square of the residual and its 95 % interval (bootstrap of blocks in time).
    bias, bias_error [unit] : mean and standard error (blocks). normalised, normalised_low, normalised_high [-] : RMS over noise, root of
    chi-squared over its degrees of freedom (the fitted start states take some).
    p_size : of chi-squared against the noise. p_bias : of the bias. p_delay : of the delay. p_window : of the size of its
    worst window, among all of its windows. The smallest of these and of whiteness, times their number, is ``p``.
    structure [-] : RMS over noise of the part that is correlated in time. peak [-] : largest normalised residual, at ``peak_time`` [s] of
    ``peak_recording``, window ``peak_window``. left_out : why it takes no part ('' = it does).
    """

    name: str
    quantity: str
    component: str
    target: str
    unit: str
    n: int
    windows: int
    noise: float = NAN
    noise_from: str = ""
    rms: float = NAN
    rms_low: float = NAN
    rms_high: float = NAN
    bias: float = NAN
    bias_error: float = NAN
    normalised: float = NAN
    normalised_low: float = NAN
    normalised_high: float = NAN
    structure: float = NAN
    whiteness: Whiteness | None = None
    lag_fit: LagFit = field(default_factory=LagFit)
    p_size: float = NAN
    p_bias: float = NAN
    p_delay: float = NAN
    p_window: float = NAN
    p: float = NAN
    q: float = NAN
    differs: bool = False
    verdict: Verdict = "no data"
    peak: float = NAN
    peak_time: float = NAN
    peak_recording: str = ""
    peak_window: int = -1
    left_out: str = ""

    @property
    def of(self) -> str:
        """What was measured of what, as ``full_name`` says it."""
        return full_name(self.quantity, self.component, self.target)

    @property
    def judged(self) -> bool:
        """Whether it takes part and has samples enough, with a known noise."""
        return self.verdict not in ("left out", "no data")


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowDifference:
    """One window over all channels that take part. ``rank`` 1 is the worst; ``Difference.windows`` is in this order.

    start, stop [s]. n : samples. normalised [-] : root of chi-squared over its degrees of freedom. chi2, degrees, p, q. channel, target :
    those that exceed the noise most there ('' if none does); share [-] : their part of all that is beyond the noise.
    channels : name -> normalised RMS in this window. shift [-], ended : as in ``CompareWindow``.
    """

    recording: str
    number: int
    rank: int
    start: float
    stop: float
    n: int
    normalised: float
    chi2: float
    degrees: float
    p: float
    q: float = NAN
    differs: bool = False
    channel: str = ""
    target: str = ""
    share: float = NAN
    channels: dict[str, float] = field(default_factory=dict)
    shift: float = 0.0
    ended: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetDifference:
    """One joint, part, wheel or drive over its channels; worst first.

    kind : what ``name`` is. normalised [-] : RMS over noise of all of its samples. excess [-] : sqrt(normalised^2 - 1), 0 at the floor and
    below. share [-] : part of all that is beyond the noise. channels : names, worst first.
    """

    kind: Literal["joint", "part", "wheel", "drive"]
    name: str
    channels: tuple[str, ...]
    n: int
    normalised: float
    excess: float
    share: float
    differs: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RegimeDifference:
    """One channel's normalised residual against one regime; strongest first.

    edges : (B + 1,) of quantile bins [unit of the regime]. centre, n, rms, bias, rms_error, bias_error : (B,); residuals normalised.
    trend [-], trend_error : change of the normalised residual from the lowest to the highest of the regime's values (linear in their rank).
    growth [-], growth_error : the same of its square. explained [-] : share of the residual's mean square that the bins' biases take away.
    p : of trend and growth together. ``regime`` : name as in ``Regimes.values``.
    """

    channel: str
    regime: str
    edges: Array
    centre: Array
    n: NDArray[np.int64]
    rms: Array
    rms_error: Array
    bias: Array
    bias_error: Array
    trend: float
    trend_error: float
    growth: float
    growth_error: float
    explained: float
    p: float
    q: float = NAN
    differs: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDifference:
    """One channel in one recording: n, rms [unit], bias [unit], normalised [-]."""

    recording: str
    channel: str
    n: int
    rms: float
    bias: float
    normalised: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """What one model misses in a list of recordings.

    differs : at least one channel does. sentence : the verdict in words. channels : in the order of the recording. windows, targets,
    regimes : worst first. runs : per recording and channel, in order. chi2_per_degree [-] : over all channels that take part; 1 at the
    noise floor.
    """

    model: str
    recordings: tuple[str, ...]
    mode: Mode
    differs: bool
    sentence: str
    chi2_per_degree: float
    channels: tuple[ChannelDifference, ...]
    windows: tuple[WindowDifference, ...]
    targets: tuple[TargetDifference, ...]
    regimes: tuple[RegimeDifference, ...]
    runs: tuple[RunDifference, ...]
    notes: tuple[str, ...] = ()
    false_discovery_rate: float = 0.05

    @property
    def judged(self) -> bool:
        """Whether any channel could be judged."""
        return any(row.judged for row in self.channels)

    def channel(self, name: str) -> ChannelDifference:
        """The channel of that name; KeyError if there is none."""
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise KeyError(name)
