"""Channels that stood still while others show that the machine did not: what they said there is no evidence, and their fault is one.

The data gate finds them before any model is asked. A channel that stands at the farthest value that it says anywhere has met the end of its
range (``saturation``); elsewhere it is stuck. Where nothing else differs, that fault is the diagnosis.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.answer.statement import statement
from rille.diagnosis.evidence.held_out import Parts
from rille.diagnosis.inference.weights import probabilities
from rille.model import EffectKind
from rille.model.diagnosis import NAN, Diagnosis, Estimate, NamedTerm, RankedHypothesis
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel, GateFinding, Recording

CODES = ("stuck", "saturation")
LIMIT, STUCK = "saturation", "stuck"
WITHIN = 1e-9  # relative: samples at the end of a range say one number
LEAST_LEFT = 0.5  # share of its samples that a channel which is stuck within its range must have left, to be believed in the others
KNOWN = 1e-4  # relative: as well is the end of a range known that samples say


@dataclass(frozen=True, slots=True, kw_only=True)
class Stuck:
    """A channel that stood still. value [unit] : where. samples : how many said so. witnesses : channels that contradict. is_limit :
    whether it is the end of its range. sure : the channel contradicts itself.
    """

    channel: str
    unit: str
    value: float
    samples: int
    witnesses: tuple[str, ...]
    is_limit: bool
    sure: bool = False


def without_stuck(parts: Parts) -> tuple[Parts, tuple[Stuck, ...]]:
    """The recordings without the samples at which a channel stood still, and those channels. One that is stuck for most of a recording
    stays as it is, and takes no part in any fit.
    """
    everything = (*parts.training, *parts.held_out)
    largest = {c.name: 0.0 for recording in everything for c in recording.with_role("observed")}
    for recording in everything:
        for channel in recording.with_role("observed"):
            largest[channel.name] = max(largest[channel.name], float(np.nanmax(np.abs(channel.value), initial=0.0)))
    limits = {
        f.channel
        for recording in everything
        for f in recording.findings
        if _tells(f) and _value(f) >= (1 - WITHIN) * largest.get(f.channel, np.inf) > 0
    }
    found: dict[str, Stuck] = {}
    cleaned = [_cleaned(recording, limits, largest, found) for recording in everything]
    count = len(parts.training)
    return replace(parts, training=tuple(cleaned[:count]), held_out=tuple(cleaned[count:])), tuple(found.values())


def _tells(finding: GateFinding) -> bool:
    """Whether a finding says that a channel stood still."""
    return finding.code in CODES and finding.severity != "note"


def _value(finding: GateFinding) -> float:
    value = finding.detail.get("value")
    return abs(float(value)) if isinstance(value, (int, float)) else NAN


def _cleaned(recording: Recording, limits: set[str], largest: Mapping[str, float], found: dict[str, Stuck]) -> Recording:
    """One recording without these samples; what was found is added to ``found``."""
    channels, mended = [], set()
    for channel in recording.channels:
        findings = [f for f in recording.findings if f.channel == channel.name and _tells(f)]
        is_limit = channel.name in limits
        if channel.role != "observed" or not (findings or is_limit):
            channels.append(channel)
            continue
        far = (1 - WITHIN) * largest[channel.name]
        still = np.abs(channel.value) >= far if is_limit else _held(channel, findings)
        if np.any(still) and (is_limit or np.count_nonzero(~still) >= LEAST_LEFT * len(still)):
            mended.add(channel.name)
            channels.append(replace(channel, time=channel.time[~still], value=channel.value[~still]))
        else:
            channels.append(channel)
        if np.any(still):
            _note(found, channel, float(np.max(channel.value[still])), int(np.count_nonzero(still)), findings, is_limit)
    kept = tuple(f for f in recording.findings if not (f.channel in mended and f.code in CODES))
    return replace(recording, channels=tuple(channels), findings=kept) if mended else recording


def _held(channel: Channel, findings: Sequence[GateFinding]) -> NDArray[np.bool_]:
    """(m,) samples within the stretches that the gate names."""
    spans = [span for f in findings if isinstance(spans := f.detail.get("intervals"), list) for span in spans]
    return np.any([(channel.time >= a) & (channel.time <= b) for a, b in spans], axis=0) if spans else np.zeros(len(channel.time), bool)


def _note(found: dict[str, Stuck], channel: Channel, value: float, samples: int, findings: Sequence[GateFinding], is_limit: bool) -> None:
    before = found.get(channel.name)
    told = (name for f in findings if isinstance(names := f.detail.get("witnesses"), list) for name in names)
    found[channel.name] = Stuck(
        channel=channel.name,
        unit=channel.unit,
        value=before.value if before else value,
        samples=samples + (before.samples if before else 0),
        witnesses=tuple(dict.fromkeys((*(before.witnesses if before else ()), *told))),
        is_limit=is_limit,
        sure=is_limit and (any(f.detail.get("sure") is True for f in findings) or bool(before and before.sure)),
    )


def blamed(
    diagnosis: Diagnosis, stuck: Sequence[Stuck], kinds: Sequence[EffectKind], differing: Collection[str] | None = None
) -> Diagnosis:
    """The diagnosis with the channels that stood still told; where the model is at the noise without them, and another channel
    or they themselves contradict what they said, they are the diagnosis. So they are where only what is left of them differs, and nothing
    explains that.

    differing : channels that differ without what they said there; None: not told.
    """
    if not stuck:
        return diagnosis
    said = replace(diagnosis, notes=(*diagnosis.notes, *(_in_words(one) for one in stuck)))
    proven = [one for one in stuck if one.witnesses or one.sure]
    nothing_else = diagnosis.verdict == "cannot_know" and differing is not None and set(differing) <= {one.channel for one in proven}
    if not proven or not (diagnosis.verdict == "nothing_missing" or nothing_else):
        return said
    catalogue = {kind.name: kind for kind in kinds}
    terms = tuple(_named(one, catalogue) for one in proven)
    (weight,), _ = probabilities(np.zeros(1), np.zeros(1), 0.0)
    row = RankedHypothesis(
        terms=terms,
        title=" + ".join(term.term.hypothesis.title for term in terms),
        cause="sensor",
        probability=float(weight),
        gain=NAN,
        gain_error=NAN,
        explained=1.0,
    )
    told = statement("sensor_fault", terms, (row,), diagnosis.location, NAN, None, (), (), apart="; ".join(map(_in_words, proven)))
    setting = tuple(term.term for term in terms)
    return replace(said, verdict="sensor_fault", sentence=told, ranked=(row,), groups=(), experiments=(), setting=setting)


def _in_words(one: Stuck) -> str:
    against = f", while {' and '.join(repr(name) for name in one.witnesses)} moved" if one.witnesses else ""
    where = "the end of its range, " if one.is_limit else ""
    return f"'{one.channel}' stood at {where}{one.value:.6g} {one.unit} for {one.samples} samples, which took no part{against}"


def _named(one: Stuck, kinds: Mapping[str, EffectKind]) -> NamedTerm:
    """The fault in the words of the catalogue."""
    if not one.is_limit:
        return NamedTerm(term=Hypothesis(cause="sensor", kind=STUCK, target=one.channel, target_kind="channel", free=()).at(), estimates=())
    kind = kinds[LIMIT]
    number, value = kind.parameters[0], 1.0 / abs(one.value)
    unit = f"1/({one.unit})" if " " in one.unit or "/" in one.unit else f"1/{one.unit}"
    low, high = (1 - KNOWN) * value, (1 + KNOWN) * value
    free = FreeNumber(name=number.name, unit=unit, amplitude=True, lower=0.0, upper=number.upper, start=value, spread=value)
    hypothesis = Hypothesis(cause="sensor", kind=LIMIT, target=one.channel, target_kind="channel", free=(free,))
    estimate = Estimate(name=number.name, unit=unit, value=value, low=low, high=high, at_bound="", conditioning=0.0)
    return NamedTerm(
        term=hypothesis.at({number.name: value}), estimates=(estimate,), equation=kind.equation, source=kind.source, meaning=kind.meaning
    )
