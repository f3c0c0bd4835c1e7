"""Recordings of bench points as evidence: curves take the place of windows, and the rig's simulator that of the replay.

Points have no start that would have to be guessed: ``start_gain`` has no columns. What a bench leaves open otherwise (soil numbers, a load
that was not printed, a zero that is not known) is open for all curves alike, and belongs into a setting (``bench_hypotheses.open_terms``).
``run`` is the part that is left out together when a setting is judged by what it has not seen: curves of equal conditions, over all
recordings, so that a held-out part asks for slip angles, loads or slips that were not fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.bench.bench_rig import BenchRig, faulty, responses
from rille.diagnosis.comparison.bench_difference import RESPONSES, Curves, Scatter, find_curves, find_scatter, repeat_groups
from rille.diagnosis.evidence.evidence import ENDED, Array, Whole
from rille.model import BenchPoints, InputRefused
from rille.model.hypothesis import Setting
from rille.model.recording import Channel

FEWEST = 9  # windows that there should be to judge by; curves are cut where there are fewer
FEWEST_OF_CHANNEL = 4  # windows that each channel should be in
PARTS = 6  # that are left out one after the other


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Numbers that one channel of one rig measured, sorted like the evidence. point : (n,) of the rig. place : (n,) in the evidence.
    known_by : degrees of freedom of its noise.
    """

    rig: int
    channel: Channel
    response: str
    point: Whole
    place: Whole
    value: Array
    known_by: float = float("inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchEvidence:
    """``Evidence`` of bench points. points : of each rig, those that have all conditions. labels : of the windows, in words."""

    rigs: tuple[BenchRig, ...]
    points: tuple[BenchPoints, ...]
    parts: tuple[Measured, ...]
    labels: tuple[str, ...]
    channels: tuple[Channel, ...]
    channel: Whole
    window: Whole
    time: Array
    sigma: Array
    run: Whole
    starts: Array
    stops: Array
    start_gain: Array

    def residuals(self, settings: Sequence[Setting]) -> Array:
        """(k, N) of k settings; points that the soil does not carry count ``ENDED``."""
        result = np.empty((len(settings), len(self.window)))
        for row, setting in zip(result, settings, strict=True):
            found = [responses(rig, points, setting)[0] for rig, points in zip(self.rigs, self.points, strict=True)]
            for part in self.parts:
                rig = self.rigs[part.rig]
                simulated = faulty(part.channel, getattr(found[part.rig], part.response)[part.point], setting, rig)
                off = (part.value - simulated) / self.sigma[part.place]
                row[part.place] = np.where(np.isfinite(off), off, ENDED)
        return result

    @property
    def noise_error(self) -> float:
        """Standard deviation of chi-squared [-] that comes of noises that are estimates of few degrees of freedom."""
        return float(np.sqrt(sum(2.0 * len(part.place) ** 2 / part.known_by for part in self.parts)))

    def relinearised(self, setting: Setting) -> "BenchEvidence":
        """Itself: there are no starts."""
        return self

    def subset(self, windows: Whole, *, roughly: bool = False) -> "BenchEvidence":  # as good for a first look as for all
        """Only these windows (ascending), renumbered from 0."""
        kept = np.isin(self.window, windows)
        place = np.cumsum(kept) - 1
        parts, used = [], [np.zeros(len(points), dtype=bool) for points in self.points]
        for part in self.parts:
            inside = kept[part.place]
            used[part.rig][part.point[inside]] = True
            parts.append(replace(part, point=part.point[inside], place=place[part.place[inside]], value=part.value[inside]))
        number = [np.cumsum(flags) - 1 for flags in used]
        return replace(
            self,
            points=tuple(points.where(flags) for points, flags in zip(self.points, used, strict=True)),
            parts=tuple(replace(part, point=number[part.rig][part.point]) for part in parts if len(part.point)),
            labels=tuple(self.labels[w] for w in windows),
            channel=self.channel[kept],
            window=np.searchsorted(windows, self.window[kept]),
            time=self.time[kept],
            sigma=self.sigma[kept],
            run=self.run[windows],
            starts=self.starts[windows],
            stops=self.stops[windows],
            start_gain=self.start_gain[kept],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Piece:
    """A part of a curve that becomes a window. middle : (3,) mean slip ratio, slip angle and logarithm of the load."""

    rig: int
    points: Whole
    middle: Array
    label: str


def gather_bench(rigs: Sequence[BenchRig]) -> BenchEvidence:
    """Evidence of recordings of points, with the noise that repeats show.

    Raises
    ------
    InputRefused : if nothing was measured that the bench gives, or no point can be simulated.
    """
    known, drafts, pieces = [], [], []
    for k, rig in enumerate(rigs):
        conditions = rig.conditions
        stated = np.isfinite(conditions.load) & np.isfinite(conditions.slip_ratio) & np.isfinite(conditions.slip_angle)
        points = conditions.where(stated)
        if not len(points):
            raise InputRefused(
                f"no point of recording '{rig.recording.name}' has a load, a slip ratio and a slip angle; check its channels"
            )
        known.append(points)
        answer, _ = responses(rig, points, ())
        curves, bad = find_curves(points), rig.recording.flagged("bad_channel", "stuck")
        groups = repeat_groups(points, curves.sweep)
        values = []
        for channel in rig.recording.with_role("observed"):
            if channel.quantity in RESPONSES and channel.name not in bad:
                here = replace(channel, value=channel.value[stated], time=channel.time[stated])
                simulated = getattr(answer, RESPONSES[channel.quantity])
                if np.isfinite(here.value).any():
                    values.append(np.isfinite(here.value))
                    drafts.append((k, here, find_scatter(here, simulated, points, groups, curves)))
        pieces.extend(_pieces(k, rigs, points, curves, groups, values))
    if not drafts:
        name, flagged = rigs[0].recording.name, [c.name for rig in rigs for c in rig.recording.with_role("observed")]
        why = f"the data gate flags {', '.join(flagged)}" if flagged else "it has no observed channel"
        raise InputRefused(f"recording '{name}' has nothing to judge the bench by: {why}; the bench gives {', '.join(RESPONSES)}")
    return _evidence(tuple(rigs), tuple(known), drafts, pieces)


def _evidence(
    rigs: tuple[BenchRig, ...], points: tuple[BenchPoints, ...], drafts: list[tuple[int, Channel, Scatter]], pieces: list[_Piece]
) -> BenchEvidence:
    channels: dict[tuple[str, str], int] = {}
    rows: list[tuple[int, float, int, int, int, float]] = []  # window, time, channel, draft, point, sigma
    filled = [p for p in pieces if any(k == p.rig and np.isfinite(c.value[p.points]).any() for k, c, _ in drafts)]
    for w, piece in enumerate(filled):
        for d, (k, channel, scatter) in enumerate(drafts):
            if k != piece.rig:
                continue
            number = channels.setdefault((channel.name, channel.target), len(channels))
            rows += [(w, float(i), number, d, int(j), scatter.sigma) for i, j in enumerate(piece.points) if np.isfinite(channel.value[j])]
    table = np.array(sorted(rows, key=lambda row: row[:3]))
    window, draft = table[:, 0].astype(np.int64), table[:, 3].astype(np.int64)
    point = table[:, 4].astype(np.int64)
    parts = []
    for d, (k, channel, scatter) in enumerate(drafts):
        place = np.flatnonzero(draft == d)
        bare = replace(channel, time=np.empty(0), value=np.empty(0))
        response = RESPONSES[channel.quantity]
        parts.append(
            Measured(
                rig=k,
                channel=bare,
                response=response,
                point=point[place],
                place=place,
                value=channel.value[point[place]],
                known_by=scatter.known_by,
            )
        )
    named = {key: next(p.channel for p in parts if (p.channel.name, p.channel.target) == key) for key in channels}
    return BenchEvidence(
        rigs=rigs,
        points=points,
        parts=tuple(parts),
        labels=tuple(piece.label for piece in filled),
        channels=tuple(named.values()),
        channel=table[:, 2].astype(np.int64),
        window=window,
        time=table[:, 1],
        sigma=table[:, 5],
        run=_left_out_together(filled),
        starts=np.zeros(len(filled)),
        stops=np.array([float(len(piece.points)) for piece in filled]),
        start_gain=np.zeros((len(table), 0)),
    )


def _pieces(
    rig: int, rigs: Sequence[BenchRig], points: BenchPoints, curves: Curves, groups: Whole, known: list[NDArray[np.bool_]]
) -> list[_Piece]:
    """The curves of a rig; each in pieces along its sweep, repeats together, where there are few of them, or few of one of its channels.

    known : (n,) flags of the points that each channel has a value at.
    """
    n_curves = int(curves.label.max()) + 1
    share = -(-FEWEST // (n_curves * len(rigs)))
    made = []
    for number in range(n_curves):
        here = curves.order[curves.label[curves.order] == number]
        rare = [len(np.unique(curves.label[flags])) for flags in known if flags[here].any()]
        steps = [here[groups[here] == g] for g in dict.fromkeys(groups[here].tolist())]
        count = min(max(share, -(-FEWEST_OF_CHANNEL // min(rare, default=FEWEST_OF_CHANNEL))), len(steps))
        for piece in np.array_split(np.arange(len(steps)), count):
            inside = np.concatenate([steps[s] for s in piece])
            middle = np.array([points.slip_ratio[inside].mean(), points.slip_angle[inside].mean(), np.log(points.load[inside]).mean()])
            name = rigs[rig].recording.name
            label = f"{name}: slip angle {np.degrees(middle[1]):.3g} deg, load {np.exp(middle[2]):.3g} N, slip {middle[0]:.2g}"
            made.append(_Piece(rig=rig, points=inside, middle=middle, label=label))
    return made


def _left_out_together(pieces: list[_Piece]) -> NDArray[np.int64]:
    """(W,) part of each window: pieces of equal conditions go together, and parts are of about one size."""
    middle = np.array([piece.middle for piece in pieces])
    spread = np.ptp(middle, axis=0)
    steps = np.where(spread > 1e-3, np.round(middle / np.where(spread > 1e-3, 0.05 * spread, 1.0)), 0.0)
    _, same = np.unique(steps, axis=0, return_inverse=True)
    return (same.ravel() % PARTS).astype(np.int64)
