"""The data gate: all checks, over the recordings of one import."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import ANGLES, Channel, GateFinding, Recording
from rille.model.rover import Vector
from rille.recording.gate.agreement import check_agreement
from rille.recording.gate.axes import check_axes
from rille.recording.gate.clock import RATES, check_clock, check_common_time
from rille.recording.gate.frames import check_frames
from rille.recording.gate.gravity import check_gravity
from rille.recording.gate.header import check_header
from rille.recording.gate.lag import Fit, fit_lag
from rille.recording.gate.missing import check_missing
from rille.recording.gate.motion import LEVEL, TILTS, Held, contradicts, manner_of
from rille.recording.gate.noise import check_noise
from rille.recording.gate.quantisation import check_quantisation
from rille.recording.gate.ranges import check_range
from rille.recording.gate.relations import Pair, related
from rille.recording.gate.saturation import FlatTops, check_saturation, flat_tops
from rille.recording.gate.source import Load, Source, Span
from rille.recording.gate.spikes import check_spikes
from rille.recording.gate.stretches import BINS, MOST, Stretch, activity, choose
from rille.recording.gate.stuck import check_stuck, held_stretches
from rille.recording.gate.track import Track
from rille.recording.gate.tracks import Lame, lay_tracks
from rille.recording.gate.witness import check_witnesses
from rille.recording.gate.wrapped import check_wrapped
from rille.recording.points_gate import points_findings

Array = NDArray[np.float64]
Findings = tuple[GateFinding, ...]
Progress = Callable[[str, float], None]


def gate(
    recordings: Sequence[Recording], on_progress: Progress | None = None, *, load: Load | None = None, gravity: Vector | None = None
) -> tuple[Findings, ...]:
    """What is wrong or remarkable in the recordings of one import, one tuple per recording; nothing is changed.

    Channels of one name in several recordings are one sensor: what they say of each other is pooled over all of them, and such a finding
    stands in every recording that has the channel. Channels with role ``ignore`` are not looked at.

    Parameters
    ----------
    on_progress : called with what is being done and the fraction done.
    load : ``load(recording, channel, span)`` reads a channel, all of it or within ``span`` [s], of recordings that come without samples,
        so that one channel at a time is in memory.
    gravity : [m/s^2] in W, that accelerometers were under; None: not known.
    """
    if not recordings or recordings[0].kind == "points":
        return tuple((*check_header(recording), *points_findings(recording)) for recording in recordings)
    source = Source(recordings, load)
    pairs = [related(recording.channels) for recording in source.recordings]
    found: list[list[GateFinding]] = []
    stretches: list[Stretch] = []
    heads: dict[str, Channel] = {}
    tell = on_progress or (lambda what, fraction: None)
    for k in range(len(source.recordings)):
        findings, chosen = _single(source, k, pairs[k], max(MOST // len(recordings), 2000), heads, tell)
        found.append(findings + ([] if gravity is None else check_gravity(source, k, gravity)))
        stretches += chosen
    lame = [_intervals(findings) for findings in found]
    for finding, names in _together(source, pairs, stretches, lame, heads, tell):
        for k, recording in enumerate(source.recordings):
            own = {channel.name for channel in recording.channels}
            if names <= own:
                found[k].append(finding)
    found = [_without_bad_witnesses(findings) for findings in found]
    tell("done", 1.0)
    rank = {"error": 0, "warning": 1, "note": 2}
    return tuple(tuple(sorted(findings, key=lambda finding: rank[finding.severity])) for findings in found)


def _intervals(findings: Sequence[GateFinding]) -> dict[str, list[Span]]:
    lame: dict[str, list[Span]] = {}
    for finding in findings:
        intervals = finding.detail.get("intervals")
        if finding.code in ("stuck", "saturation") and finding.severity != "note" and isinstance(intervals, list):
            lame.setdefault(finding.channel, []).extend((begin, end) for begin, end in intervals)
    return lame


def _without_bad_witnesses(findings: list[GateFinding]) -> list[GateFinding]:
    """Without those that rest on the word of a bad channel only."""
    bad = {finding.channel for finding in findings if finding.code == "bad_channel"}
    kept = []
    for finding in findings:
        witnesses = finding.detail.get("witnesses")
        if not isinstance(witnesses, list) or not witnesses or not bad.issuperset(witnesses):
            kept.append(finding)
    return kept


def _single(
    source: Source, k: int, pairs: Sequence[Pair], share: int, heads: dict[str, Channel], tell: Progress
) -> tuple[list[GateFinding], list[Stretch]]:
    """Checks of each channel by itself; the stretches that comparisons shall look at."""
    recording = source.recordings[k]
    used = [channel for channel in recording.channels if channel.role != "ignore"]
    rated = {channel.clock for channel in used if channel.role == "observed" and channel.quantity in RATES}
    found = check_header(recording)
    active, clocks, manners = np.zeros(BINS), {}, {}
    held: dict[str, tuple[int, list[Held], list[FlatTops]]] = {}
    for j, bare in enumerate(used):
        tell(f"channel {bare.name}", 0.7 * (k + j / len(used)) / len(source.recordings))
        channel = source.channel(k, bare.name)
        time, value = channel.time, channel.value
        if not len(time):
            continue
        if channel.clock not in clocks:
            clocks[channel.clock] = Stamps.of(channel, rates=channel.clock in rated)
        clock = clocks[channel.clock]
        heads.setdefault(channel.name, replace(channel, time=time[:10_000].copy(), value=np.empty(0)))
        found += check_missing(channel)
        if not np.isfinite(value).any():
            continue
        resolution, notes = (None, []) if channel.role == "command" else check_quantisation(channel)
        found += notes + check_range(channel) + check_spikes(channel, resolution) + check_wrapped(channel) + check_noise(channel)
        manners[channel.name] = manner_of(value, resolution)
        if not clock.forward:
            continue
        stretches = held_stretches(channel, manners[channel.name]) if channel.role == "observed" else []
        held[channel.name] = (len(value), stretches, flat_tops(channel, manners[channel.name]))
        if len(time) > share:
            active += activity(time, value, clock.first, clock.last)
    for channel in used:
        if channel.name in held:
            count, stretches, tops = held[channel.name]
            said = partial(contradicts, source, k, channel.name, manners=manners, pairs=pairs)
            cut = check_saturation(channel, count, tops, said)
            extremes = {finding.detail["value"] for finding in cut}
            found += cut + check_stuck(channel, count, [stretch for stretch in stretches if stretch.value not in extremes], said)
    moving = {channel.clock for channel in used if channel.name in manners and manners[channel.name].spread > 0}
    watched = {channel.clock for channel in used if channel.role == "observed"}
    for name, clock in clocks.items():
        excused = set() if name in moving else {"time_unit"}
        excused |= set() if name in watched else {"time_unit", "clock_gap", "clock_lost", "clock_jitter"}  # commands stamp changes only
        found += [finding for finding in clock.findings if finding.code not in excused]
    if not clocks:
        return found, []
    found += check_common_time({name: (clock.first, clock.last) for name, clock in clocks.items()}, clocks.keys() - watched)
    first, last = min(clock.first for clock in clocks.values()), max(clock.last for clock in clocks.values())
    return found, choose(k, first, last, max(clock.count for clock in clocks.values()), share, active)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamps:
    """What is known of a clock: findings, first and last stamp [s], number of stamps, and whether none goes backwards."""

    findings: list[GateFinding]
    first: float
    last: float
    count: int
    forward: bool

    @classmethod
    def of(cls, channel: Channel, *, rates: bool) -> "Stamps":
        """Of the clock of a channel with samples; ``rates`` as in ``check_clock``."""
        time = channel.time
        finite = time[np.isfinite(time)]
        first, last = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
        forward = bool(np.all(time[1:] >= time[:-1]))
        return cls(findings=check_clock(channel.clock, time, rates=rates), first=first, last=last, count=len(time), forward=forward)


def _together(
    source: Source,
    pairs: Sequence[Sequence[Pair]],
    stretches: Sequence[Stretch],
    lame: Sequence[Lame],
    heads: Mapping[str, Channel],
    tell: Progress,
) -> list[tuple[GateFinding, set[str]]]:
    """Findings from comparisons, each with the names of the channels that it compares."""
    distinct = list(dict.fromkeys(pair for of_one in pairs for pair in of_one))
    if not distinct or not stretches:
        return []
    tracks, turns = lay_tracks(source, stretches, lame, lambda name, part: tell(f"stretches of {name}", 0.7 + 0.1 * part))
    heads = {**heads, **{name: turning.channel(heads[turning.parts[0]]) for name, turning in turns.items()}}
    turned = {pair.second for pair in distinct if pair.first in turns}
    fits: list[tuple[Pair, Fit]] = []
    for j, pair in enumerate(distinct):
        tell(f"{pair.first} against {pair.second}", 0.8 + 0.2 * j / len(distinct))
        if pair.first in tracks and pair.second in tracks and _comparable(pair, heads, tracks, turned):
            fit = fit_lag(tracks[pair.first], tracks[pair.second], pair.order, response=pair.kind == "response")
            if fit is not None:
                fits.append((pair, fit))
    found, explained = check_axes(tracks, fits, turns)
    frames = check_frames(tracks, [(pair, fit) for pair, fit in fits if pair.second not in explained], turns)
    explained |= {finding.channel for finding in frames}
    fits = [(pair, fit) for pair, fit in fits if pair.first not in turns or pair.second not in explained]
    found += frames
    found += check_agreement(heads, fits) + check_witnesses(tracks, fits, {name: turning.parts for name, turning in turns.items()})
    owner = {name: turning.parts[0] for name, turning in turns.items()}
    return [
        (
            replace(finding, channel=owner.get(finding.channel, finding.channel)),
            {owner.get(name, name) for key in ("first", "second") if (name := str(finding.detail.get(key, "")))},
        )
        for finding in found
    ]


def _comparable(pair: Pair, heads: Mapping[str, Channel], tracks: Mapping[str, Track], turned: Collection[str]) -> bool:
    """Whether the second of a pair is the rate of the first: of a turning always, of an angle of a body while that stays level.

    turned : rates of which a turning is known. The angles that it is made of say the same, but for a tilt.
    """
    first = heads[pair.first]
    if pair.kind != "rate" or first.quantity != "part.orientation" or first.component not in ANGLES:
        return True
    if pair.second in turned:
        return False
    tilts = [n for n, c in heads.items() if (c.quantity, c.target) == (first.quantity, first.target) and c.component in TILTS]
    return all(float(np.nanquantile(np.abs(tracks[name].value), 0.99)) <= LEVEL for name in tilts if name in tracks)
