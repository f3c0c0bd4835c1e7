"""Does a gyro measure about the axes that the manifest says, and are the numbers of its body's quaternion in that order?

A slip in either makes three channels wrong at once, and what each pair of them shows by itself (a turned sign) would mislead.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import AXES, GateFinding
from rille.recording.gate.frames import BETTER, SURE
from rille.recording.gate.lag import Fit, fit_lag
from rille.recording.gate.relations import Pair
from rille.recording.gate.track import Track, windows
from rille.recording.gate.turning import QUATERNION, READINGS, STATED, WHOSE, Turning

Array = NDArray[np.float64]
Trio = tuple[tuple[Pair, Fit], tuple[Pair, Fit], tuple[Pair, Fit]]  # turnings and rates about x, y and z
ALIKE, CHANCE = 3.0, 0.005  # times the part of a rate that the best leaves, and a part besides it, up to which another is as good
FEWEST = 64  # windows
SIGNED = [np.eye(3)[list(order)] * np.array(signs)[:, None] for order in permutations(range(3)) for signs in product((1.0, -1.0), repeat=3)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Slip:
    """What may be meant: rates = axes times those of a turning.

    way : that turning, about x. other_frame : whether its axes are those of another frame than the manifest says. axes : (3, 3), a
    permutation with signs. unexplained : (3,), part of each rate.
    """

    way: Turning
    other_frame: bool
    axes: Array
    unexplained: Array

    @property
    def count(self) -> int:
        """Of the things that the manifest has wrong. Axes are turned as one, or columns of two are mixed up, or all signs are turned."""
        turned, swapped = np.linalg.det(self.axes) > 0, np.all(self.axes >= 0)
        rates = 0 if np.array_equal(self.axes, np.eye(3)) else 1 if turned or swapped or np.array_equal(self.axes, -np.eye(3)) else 3
        return (self.way.reading != STATED) + self.other_frame + rates

    @property
    def of_frame(self) -> bool:
        """Whether the axes are those of W instead of the body's or the other way round, and nothing else."""
        return self.count == 1 and self.other_frame

    @property
    def by_pairs(self) -> bool:
        """Whether nothing or the sign of one rate is wrong, which pairs of channels tell."""
        return self.way.reading == STATED and not self.other_frame and float(np.trace(self.axes)) >= 1 and self.diagonal

    @property
    def diagonal(self) -> bool:
        """Whether no rate is about another axis but for its sign."""
        return np.count_nonzero(np.diag(self.axes)) == len(AXES)


def check_axes(
    tracks: Mapping[str, Track], fits: Sequence[tuple[Pair, Fit]], turns: Mapping[str, Turning]
) -> tuple[list[GateFinding], set[str]]:
    """Findings ``axes`` and ``quaternion``, and the rates that they explain: of gyros whose three rates fit a whole orientation badly, and
    well with one slip put right.
    """
    found: list[GateFinding] = []
    explained: set[str] = set()
    for trio in _trios(fits, turns):
        findings = _examine(tracks, trio, turns[trio[0][0].first])
        if findings:
            found += findings
            explained |= {pair.second for pair, _ in trio}
    return found, explained


def _trios(fits: Sequence[tuple[Pair, Fit]], turns: Mapping[str, Turning]) -> Iterator[Trio]:
    """The first rates about x, y and z that go with one orientation, then the second ones."""
    about: dict[tuple[tuple[str, ...], str], dict[str, list[tuple[Pair, Fit]]]] = {}
    for pair, fit in fits:
        turning = turns.get(pair.first)
        if turning is not None:
            about.setdefault((turning.parts, turning.frame), {}).setdefault(turning.axis, []).append((pair, fit))
    for axes in about.values():
        if axes.keys() == set(AXES):
            yield from zip(axes["x"], axes["y"], axes["z"], strict=False)


def _examine(tracks: Mapping[str, Track], trio: Trio, turning: Turning) -> list[GateFinding]:
    if all(fit.agreement > SURE and fit.gain > 0 for _, fit in trio):
        return []
    slips = _slips(tracks, [tracks[pair.second] for pair, _ in trio], turning)
    if not slips:
        return []
    best = min(slips, key=lambda slip: float(slip.unexplained.sum()))
    alike = [slip for slip in slips if np.all(slip.unexplained <= ALIKE * best.unexplained + CHANCE)]
    if any(slip.by_pairs for slip in alike):
        return []
    fewest = min(slip.count for slip in alike)
    named = sorted((slip for slip in alike if slip.count == fewest), key=lambda slip: float(slip.unexplained.sum()))
    if named[0].of_frame or all(slip.way.reading == STATED and np.array_equal(slip.axes, -np.eye(3)) for slip in named):
        return []  # what pairs tell
    stated = _unexplained([fit for _, fit in trio], np.eye(3))
    right = _unexplained(_fits(tracks, trio, named[0]), named[0].axes)
    if right > 1 - SURE or right > BETTER * stated:
        return []
    return _findings(trio, turning, named, 1 - stated, 1 - right)


def _slips(tracks: Mapping[str, Track], rates: Sequence[Track], turning: Turning) -> list[_Slip]:
    """All of them; empty where too little is known."""
    known = {way: [tracks[name] for axis in AXES if (name := way.about(axis).name) in tracks] for way in turning.ways()}
    if any(len(about) < len(AXES) for about in known.values()):
        return []
    query, half = windows([*rates, *known[turning]])
    if len(query) < FEWEST:
        return []
    wanted = _centred([track.mean(query, half, 0) for track in rates])
    slips = []
    for way, about in known.items():
        given = _centred([track.mean(query, half, 1) for track in about])
        along, power = wanted @ given.T, max(float(np.sum(given**2)), 1e-300)
        for axes in SIGNED:
            gain = max(float(np.sum(axes * along)) / power, 0.0)  # one of all three, as of a wrong unit
            left = np.sum((wanted - gain * axes @ given) ** 2, axis=1) / np.maximum(np.sum(wanted**2, axis=1), 1e-300)
            slips.append(_Slip(way=way, other_frame=way.frame != turning.frame, axes=axes, unexplained=np.minimum(left, 1.0)))
    return slips


def _centred(values: Sequence[Array]) -> Array:
    """(3, m) without its means."""
    stacked = np.stack(values)
    return stacked - stacked.mean(axis=1, keepdims=True)


def _fits(tracks: Mapping[str, Track], trio: Trio, slip: _Slip) -> list[Fit | None]:
    """Each rate against the turning that it is of by a slip, with a delay and a gain of its own, as what the manifest says was fitted."""
    about = [slip.way.about(AXES[int(np.argmax(np.abs(row)))]) for row in slip.axes]
    return [fit_lag(tracks[turn.name], tracks[pair.second], pair.order) for turn, (pair, _) in zip(about, trio, strict=True)]


def _unexplained(fits: Sequence[Fit | None], axes: Array) -> float:
    """1 - R^2 of three rates together; of one that is turned against what it is of by ``axes``, all."""
    if any(fit is None for fit in fits):
        return 1.0
    known = [fit for fit in fits if fit is not None]
    power = np.array([fit.spread**2 for fit in known])
    left = [1 - fit.agreement if fit.gain * sign > 0 else 1.0 for fit, sign in zip(known, axes.sum(axis=1), strict=True)]
    return float(power @ np.array(left) / max(float(power.sum()), 1e-300))


def _findings(trio: Trio, turning: Turning, named: Sequence[_Slip], stated: float, right: float) -> list[GateFinding]:
    """One about the quaternion if its numbers may be others; else one per rate that is about another axis."""
    detail = {"first": trio[0][0].first, "agreement": stated, "other": right}
    shown = f"(R^2 {right:.3f} of the three rates, {max(stated, 0.0):.2f} as the manifest says)"
    texts = list(dict.fromkeys(_text(trio, turning, slip) for slip in named))
    first = named[0]
    whose = WHOSE[first.way.frame]
    if any(slip.way.reading != STATED for slip in named):
        message = f"{'; or else '.join(texts)} {shown}"
        message += "" if len(texts) == 1 else "; the motion does not tell which: look it up, and correct that one only"
        detail |= {"second": trio[0][0].second, "readings": sorted({slip.way.reading for slip in named} - {STATED})}
        return [GateFinding(code="quaternion", severity="error", channel=turning.parts[0], detail=detail, message=message)]
    found = []
    for k, (pair, _) in enumerate(trio):
        if first.axes[k, k] == 1 and not first.other_frame:
            continue
        doubt = "" if len(named) == 1 else "; other axes fit as well, as the body turns too little about some: look up how it is mounted"
        how = (
            "mounted upside down, or the orientation is that of other axes (z down)"
            if first.diagonal
            else "mounted otherwise, or columns are mixed up"
        )
        message = (
            f"'{pair.second}' turns about {_axis(first.axes[k])} of {whose} and not about {AXES[k]} of "
            f"{WHOSE[turning.frame]}, as the manifest says {shown}: the sensor is {how}; "
            f"{_right(first.axes[k])}, and what else is in its housing (accelerometers) likewise{doubt}"
        )
        own = detail | {"second": pair.second, "axis": _axis(first.axes[k]), "sure": len(named) == 1}
        found.append(GateFinding(code="axes", severity="error", channel=pair.second, detail=own, message=message))
    return found


def _text(trio: Trio, turning: Turning, slip: _Slip) -> str:
    """What is meant, in words, and what to do."""
    parts = ", ".join(f"'{part}'" for part in turning.parts)
    which, _ = READINGS[slip.way.reading]
    whose = WHOSE[slip.way.frame]
    if slip.way.reading == STATED:
        rates = [f"'{pair.second}' about {_axis(row)}" for (pair, _), row in zip(trio, slip.axes, strict=True)]
        return f"{', '.join(rates)} of {whose} is what the gyro measures"
    if slip.way.reading == "inverse":
        text = f"{parts} are the inverse of the orientation (they turn vectors of W into the body): set scale = -1 for the last three"
    else:
        true = [QUATERNION[which.index(slot)] for slot in range(len(QUATERNION))]
        given = ", ".join(f'component = "{component}" for {part!r}' for component, part in zip(true, turning.parts, strict=True))
        text = f"the quaternion was written in the order {slip.way.reading}, and its numbers are given for others: set {given}"
    return text + (f"; and the gyro measures in {whose}'s axes: state its frame" if slip.other_frame else "")


def _axis(row: Array) -> str:
    k = int(np.argmax(np.abs(row)))
    return f"{'-' if row[k] < 0 else ''}{AXES[k]}"


def _right(row: Array) -> str:
    turned = " and turn the sign of its scale" if row.min() < 0 else ""
    return f'set component = "{_axis(row).removeprefix("-")}"{turned}'
