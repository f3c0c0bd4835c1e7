"""Tracks of all channels of an import, and of the turnings that its orientations tell."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import ANGLES, AXES, Frame
from rille.model.turns import unwrapped
from rille.recording.gate.source import Source, Span
from rille.recording.gate.stretches import Stretch
from rille.recording.gate.track import Samples, Track, lay
from rille.recording.gate.turning import Turning, turnings

Array = NDArray[np.float64]
Lame = Mapping[str, Sequence[Span]]  # channel -> stretches [s] on which it is stuck or cut off
NOTHING: Samples = (np.empty(0), np.empty(0))


def lay_tracks(
    source: Source, stretches: Sequence[Stretch], lame: Sequence[Lame], tell: Callable[[str, float], None]
) -> tuple[dict[str, Track], dict[str, Turning]]:
    """Tracks by the names of channels and turnings, and the turnings that have one, by name: about the axes that the gyro is said to have,
    and about the other ones, with all that the numbers of a quaternion may be taken for.

    lame : of each recording. tell : called with the name of a channel and the part of them that is done.
    """
    apart = 4 * max(max(stretch.last - stretch.first for stretch in stretches), 1.0)
    used = [[channel for channel in recording.channels if channel.role != "ignore"] for recording in source.recordings]
    names = list(dict.fromkeys(channel.name for channels in used for channel in channels))
    tracks: dict[str, Track] = {}
    for j, name in enumerate(names):
        tell(name, j / len(names))
        track = _track(source, name, stretches, lame, apart)
        if track is not None:
            tracks[name] = track
    turns: dict[str, Turning] = {}
    by_parts: dict[tuple[str, ...], list[Turning]] = {}
    for turning in dict.fromkeys(way for channels in used for stated, _ in turnings(channels) for way in stated.ways()):
        by_parts.setdefault(turning.parts, []).append(turning)
    for parts, about in by_parts.items():
        samples, delay = _orientation(source, parts, stretches, lame)
        turned: dict[tuple[str, Frame], list[tuple[Array, Array]]] = {}
        for turning in about:
            way = turning.reading, turning.frame
            if way not in turned:
                turned[way] = [turning.samples(time, value) for time, value in samples]
            own = [(time, angles[:, AXES.index(turning.axis)]) for time, angles in turned[way]]
            track = lay(own, [stretch.first for stretch in stretches], apart, delay=delay)
            if track is not None:
                tracks[turning.name], turns[turning.name] = track, turning
    return tracks, turns


def _track(source: Source, name: str, stretches: Sequence[Stretch], lame: Sequence[Lame], apart: float) -> Track | None:
    samples: list[Samples] = []
    hold, delay = False, 0.0
    for stretch in stretches:
        channel = next((channel for channel in source.recordings[stretch.recording].channels if channel.name == name), None)
        if channel is None:
            samples.append(NOTHING)
            continue
        hold, delay = channel.role == "command", channel.delay if channel.role == "command" else -channel.delay
        time, value = _sound(source, name, stretch, lame)
        turned = channel.component in ANGLES or (channel.quantity == "joint.position" and channel.unit == "rad")
        samples.append((time, unwrapped(value) if turned else value))
    return lay(samples, [stretch.first for stretch in stretches], apart, hold=hold, delay=delay)


def _orientation(
    source: Source, parts: tuple[str, ...], stretches: Sequence[Stretch], lame: Sequence[Lame]
) -> tuple[list[tuple[Array, Array]], float]:
    """Of each stretch times (n,) and parts (n, 4) or (n, 3) of an orientation; and what is to be added to the times [s]."""
    samples, delay = [], 0.0
    for stretch in stretches:
        own = {channel.name: channel for channel in source.recordings[stretch.recording].channels}
        if own.keys() >= set(parts):
            delay = -own[parts[0]].delay
            read = [_sound(source, name, stretch, lame) for name in parts]
            samples.append((read[0][0], np.stack([value for _, value in read], axis=1)))
        else:
            samples.append((np.empty(0), np.empty((0, len(parts)))))
    return samples, delay


def _sound(source: Source, name: str, stretch: Stretch, lame: Sequence[Lame]) -> Samples:
    """Samples of a channel within a stretch, NaN where it is stuck or cut off."""
    time, value = source.samples(stretch.recording, name, (stretch.first, stretch.last))
    for begin, end in lame[stretch.recording].get(name, ()):
        value = np.where((time >= begin) & (time <= end), np.nan, value)
    return time, value
