"""What a diagnosis says: the verdict and every number behind it. Values only; ``finding`` rows and JSON are made of them."""

from dataclasses import dataclass, field
from typing import Literal

from rille.model.hypothesis import Cause, Hypothesis, Setting, Term

NAN = float("nan")
Verdict = Literal["nothing_missing", "named", "group", "parameter", "sensor_fault", "unknown", "cannot_know"]
VERDICTS: dict[Verdict, str] = {
    "nothing_missing": "the model reproduces the recordings to their noise",
    "named": "one missing piece of physics (or several, each named) explains the difference",
    "group": "one of a group that these recordings cannot tell apart explains the difference",
    "parameter": "a number of the model is wrong; its physics is complete",
    "sensor_fault": "a sensor is wrong; the model is not",
    "unknown": "something is missing that the catalogue has no name for",
    "cannot_know": "these recordings cannot tell",
}
NAMING: tuple[Verdict, ...] = ("named", "group", "parameter", "sensor_fault")  # verdicts that give a name


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A number with its 95 % interval [unit]. at_bound : '' , 'lower' or 'upper'. conditioning : correlation in size with the others of
    the fit, 0 (alone) to 1 (not told apart).
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    at_bound: str = ""
    conditioning: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedTerm:
    """One piece of the answer. equation, source, meaning : of the catalogue ('' for a parameter). start, stop [s] : when it acts, NaN:
    always. ``term`` is what the solver runs.
    """

    term: Term
    estimates: tuple[Estimate, ...]
    equation: str = ""
    source: str = ""
    meaning: str = ""
    start: float = NAN
    stop: float = NAN


@dataclass(frozen=True, slots=True, kw_only=True)
class RankedHypothesis:
    """A hypothesis (or a set of them together) with what speaks for it.

    probability : calibrated. gain, gain_error [nats] : log-likelihood of held-out windows above that of the base model, 1 standard error.
    behind, behind_error [nats] : how far the best is ahead of it. explained [-] : share of what is beyond the noise that it takes away.
    group : number of the group of those that cannot be told apart. loses_because : sentence, '' for the best.
    """

    terms: tuple[NamedTerm, ...]
    title: str
    cause: Cause
    probability: float
    gain: float
    gain_error: float
    explained: float
    group: int = 0
    behind: float = 0.0
    behind_error: float = 0.0
    bic: float = NAN
    loses_because: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Hypotheses that these recordings cannot tell apart. correlation : of their signatures with that of the first, largest."""

    number: int
    members: tuple[str, ...]
    probability: float
    correlation: float
    sentence: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A stretch of time in which a recording differs. size [noise] : root of the mean excess. target, channel : that differ most there."""

    recording: str
    start: float
    stop: float
    size: float
    target: str = ""
    channel: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetScore:
    """How much of what is beyond the noise sits at a joint, wheel, part or drive. p, q : of differing at all."""

    kind: str
    name: str
    share: float
    size: float
    differs: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """Where, when and under which conditions. shape : ``everywhere``, ``transient`` (few short spans), ``place`` (a patch of the ground),
    ``regime`` (with a condition), ``nowhere``. regimes : sentences, strongest first.
    """

    shape: Literal["everywhere", "transient", "place", "regime", "nowhere"]
    targets: tuple[TargetScore, ...] = ()
    spans: tuple[Span, ...] = ()
    regimes: tuple[str, ...] = ()
    sentence: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Transient:
    """A short push. kind : ``external_pulse`` or ``joint_pulse``. component : ``force_x`` ... of a body, ``torque`` of a joint.
    amplitude, amplitude_error : SI. start, duration, peak_time [s]. score : [standard errors] above what the calibration runs show.
    """

    recording: str
    kind: str
    target: str
    component: str
    start: float
    duration: float
    peak_time: float
    amplitude: float
    amplitude_error: float
    score: float
    probability: float = NAN


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelFit:
    """One channel of one recording before and after. rms_before, rms_after, floor [unit]. normalised_* [noise]."""

    recording: str
    channel: str
    held_out: bool
    unit: str
    rms_before: float
    rms_after: float
    floor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """How much nearer the noise recordings come that the fit has not seen. gap_closed : G = (R0 - R1)/(R0 - Rfloor) with 95 % interval low
    to high; before, after : R0 and R1, root mean squares in sigmas. left : share of the excess of chi-squared that stays, chance set
    aside; NaN if there was none. likelier [nats] : their log-likelihood above that under the model as it is; NaN if not told.
    """

    gap_closed: float
    low: float
    high: float
    before: float
    after: float
    left: float = NAN
    likelier: float = NAN


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof(Gap):
    """Replay of recordings (or windows) that the fit has not seen. floor : Rfloor. held_out : what was held out, in words. touched : the
    gap of those channels alone that the answer changes there; None if these are all, or not told apart. channels : one row each, also of
    the training part.
    """

    floor: float
    held_out: str
    touched: Gap | None = None
    channels: tuple[ChannelFit, ...] = ()
    ablation: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """What to record next. separation [-] : expected difference of the hypotheses, in sigmas, over the maneuver. scenario : TOML of a
    maneuver. points : CSV of the conditions of a bench. now [-] : separation of the recordings at hand.
    """

    name: str
    purpose: str
    separation: float
    sentence: str
    scenario: str = ""
    points: str = ""
    now: float = NAN


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """The answer. model : database. setting : what ``rille apply`` puts into the model; sensor faults are not applied.

    ranked : best first. data_problems, limits : sentences of the data gate, and of what these recordings cannot tell. leftover [-] : share
    of what is beyond the noise that ``setting`` leaves. unknown_like : a formula that behaves like what is missing. look : what the
    names of the stages that found it begin with.
    """

    model: str
    scenario: str
    recordings: tuple[str, ...]
    held_out: tuple[str, ...]
    verdict: Verdict
    sentence: str
    location: Location
    setting: Setting = ()
    ranked: tuple[RankedHypothesis, ...] = ()
    groups: tuple[Group, ...] = ()
    transients: tuple[Transient, ...] = ()
    proof: Proof | None = None
    experiments: tuple[Experiment, ...] = ()
    data_problems: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    leftover: float = NAN
    unknown_like: str = ""
    notes: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    look: str = ""

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """Those of ``setting``."""
        return tuple(term.hypothesis for term in self.setting)
