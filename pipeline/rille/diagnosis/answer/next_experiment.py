"""What to record next: the maneuver in which hypotheses that recordings cannot tell apart differ most, in sigmas of the sensors at hand.

Each member of a group runs through each maneuver of the library with the numbers it was fitted with. As in a diagnosis, the runs are
compared in short windows from common starts, and what another start could explain counts for nothing: d^T (I + D D^T)^-1 d, summed over
windows, is the expected log-likelihood ratio times two.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.answer.maneuvers import Maneuver, library, scenario_text
from rille.diagnosis.evidence.applied import applied
from rille.diagnosis.evidence.evidence import ENDED, Metric
from rille.diagnosis.hypotheses.natural import natural
from rille.diagnosis.hypotheses.sensor_faults import said, true_instants
from rille.model import InputRefused
from rille.model.diagnosis import Experiment
from rille.model.errors import PhysicsFailed
from rille.model.hypothesis import Setting
from rille.model.quaternion import product
from rille.model.recording import Channel, Recording
from rille.model.rover import COMMAND_QUANTITIES

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Progress = Callable[[int, int, str], None] | None
WINDOW = 0.5  # [s]
FASTEST = 200.0  # [Hz] faster sensors are read every few samples: their noise counts as much less
MOST_MEMBERS = 4
ENOUGH = 3.0  # [sigma] less separates nothing
LEAST_NOISE = 1e-9
# 1 sigma by which a start is not known, as wide as a smoother leaves it [m or rad, m/s or rad/s]
START = {"position": 3e-3, "velocity": 3e-2}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sensor:
    """A channel without samples, its noise [unit] and its rate [Hz]."""

    channel: Channel
    noise: float
    rate: float


def next_experiments(
    simulator: Any,
    recordings: Sequence[Recording],
    members: Sequence[Setting],
    *,
    titles: Sequence[str] = (),
    now: float = float("nan"),
    most: int = 3,
    on_progress: Progress = None,
) -> tuple[Experiment, ...]:
    """Maneuvers that separate the members of a group, best first.

    Parameters
    ----------
    simulator : of the base model, as ``rille.simulate.Replayer``; it stays as it is. recordings : for the sensors, their rates and noises,
        and for how fast and strong the machine usually is.
    members : fitted settings; the first ``MOST_MEMBERS`` count. titles : of the members, for the sentences.
    now : how far the recordings separate them [sigma], NaN: not told.

    Returns
    -------
    At most ``most``; none if there are fewer than two members or no maneuver runs to its end. The separation is that of the two members
    that are hardest to tell apart; where the best is below ``ENOUGH`` it is told alone, and that none of the library separates them.
    """
    members = list(members)[:MOST_MEMBERS]
    names = [titles[k] if k < len(titles) else _title(member) for k, member in enumerate(members)]
    sensors = _sensors(recordings)
    if len(members) < 2 or not sensors:
        return ()
    machine = simulator.machine()
    tied = {joint for a, b, _ in simulator.ratios for joint in (a, b)}
    maneuvers = library(machine, natural(machine, [c for r in recordings for c in r.channels]), sorted(tied))
    variants = [applied(simulator.changed(), member) for member in members]
    found: list[tuple[float, Maneuver]] = []
    for number, maneuver in enumerate(maneuvers):
        if on_progress:
            on_progress(number, len(maneuvers), maneuver.name)
        rough = _separation(variants, members, maneuver, sensors, free_starts=False)
        if rough is not None:
            found.append((float(np.min(rough)), maneuver))
    found.sort(key=lambda pair: -pair[0])
    told: list[Experiment] = []
    pairs = _pairs(len(members))
    for _, maneuver in found[: most + 1]:
        sigmas = _separation(variants, members, maneuver, sensors, free_starts=True)
        if sigmas is None:
            continue
        hardest = int(np.argmin(sigmas))
        a, b = pairs[hardest]
        told.append(_experiment(variants[0], maneuver, float(sigmas[hardest]), names[a], names[b], now))
    told.sort(key=lambda e: -e.separation)
    return tuple(e for k, e in enumerate(told[:most]) if k == 0 or e.separation >= ENOUGH)


def _pairs(n: int) -> list[tuple[int, int]]:
    return [(a, b) for a in range(n) for b in range(a + 1, n)]


def _title(setting: Setting) -> str:
    return " + ".join(term.hypothesis.title for term in setting) or "the model as it is"


def _sensors(recordings: Sequence[Recording]) -> list[_Sensor]:
    """Observed channels of all recordings by name, with a noise and a rate."""
    found: dict[str, _Sensor] = {}
    for channel in (c for r in recordings for c in r.with_role("observed")):
        good = np.isfinite(channel.value)
        if channel.name in found or good.sum() < 8:
            continue
        noise = channel.noise or float(np.median(np.abs(np.diff(channel.value[good]))) / 0.954) or (channel.resolution or 0.0) / np.sqrt(12)
        rate = 1.0 / max(float(np.median(np.diff(channel.time))), 1e-6)
        if noise > LEAST_NOISE:
            bare = replace(channel, time=np.empty(0), value=np.empty(0), delay=0.0)
            found[channel.name] = _Sensor(channel=bare, noise=noise * max(1.0, np.sqrt(rate / FASTEST)), rate=min(rate, FASTEST))
    return list(found.values())


def _separation(
    variants: Sequence[Any], members: Sequence[Setting], maneuver: Maneuver, sensors: Sequence[_Sensor], *, free_starts: bool
) -> Array | None:
    """(pairs,) expected differences [sigma] of the members over a maneuver; None if the first member's run does not reach its end."""
    try:
        driven = [_driven(variant, maneuver) for variant in variants]
        state = _begin(driven[0], maneuver)
        if state is None:
            return None
        states = [state]
        for _ in range(round(maneuver.duration / WINDOW) - 1):
            state, ended = driven[0].advance(states[-1], states[-1][0] + WINDOW)
            if ended:
                return None
            states.append(state)
    except (InputRefused, PhysicsFailed):
        return None
    nodes = np.stack(states)
    stops = nodes[:, 0] + WINDOW
    picks = [_picks(nodes[:, 0], sensor.rate) for sensor in sensors]
    noise = np.concatenate([np.full(len(time), s.noise) for s, (_, time) in zip(sensors, picks, strict=True)])
    windows = np.concatenate([window for window, _ in picks])
    order = np.argsort(windows, kind="stable")

    def shown(number: int, starts: Array) -> Array:
        return _shown(driven[number], members[number], starts, stops, sensors, picks) / noise

    base = shown(0, nodes[None])[0]
    others = [base] + [shown(k, nodes[None])[0] for k in range(1, len(driven))]
    if not np.isfinite(base).all():
        return None
    gain = np.zeros((len(base), 0))
    if free_starts:
        moved, size = _moved(nodes, variants[0])
        gain = np.nan_to_num((shown(0, moved) - base).T)
        gain = np.clip(gain, -1e6, 1e6) if size else gain
    metric = Metric(windows[order], gain[order])
    differences = [np.where(np.isfinite(others[b] - others[a]), others[b] - others[a], ENDED) for a, b in _pairs(len(others))]
    whitened = metric.whitened(np.stack([d[order] for d in differences]))
    return np.sqrt(np.sum(np.square(whitened), axis=1))


def _driven(simulator: Any, maneuver: Maneuver) -> Any:
    """A copy that is given the maneuver's commands."""
    copy = simulator.changed()
    modes = {drive: mode for drive, _, mode in simulator.drives}
    channels = [
        Channel(
            name=f"command {drive}",
            quantity=COMMAND_QUANTITIES[modes[drive]],
            target=drive,
            unit="",
            role="command",
            time=np.array([time for time, _ in values]),
            value=np.array([value for _, value in values]),
        )
        for drive, values in maneuver.commands.items()
    ]
    copy.drive_by(Recording(name=maneuver.name, channels=tuple(channels)))
    return copy


def _begin(simulator: Any, maneuver: Maneuver) -> Array | None:
    """State from which the maneuver begins; None if a joint is to be moved that has no place in the state."""
    state = np.array(simulator.rest(), dtype=float)
    state[0] = 0.0
    n = len(simulator.joints)
    if not simulator.has_ground:
        state[14 + n :] = 0.0
    for joint, position in maneuver.positions.items():
        if joint not in simulator.joints:
            return None
        state[14 + simulator.joints.index(joint)] = position
    if maneuver.velocity is not None:
        state[8:11] = maneuver.velocity
    if maneuver.turning is not None:
        state[11:14] = maneuver.turning
    return state


def _picks(starts: Array, rate: float) -> tuple[Whole, Array]:
    """Window and time [s] of the samples of a sensor in every window."""
    count = max(1, int(WINDOW * rate))
    offsets = (np.arange(count) + 1) * (WINDOW / count)
    return np.repeat(np.arange(len(starts)), count), (starts[:, None] + offsets).ravel()


def _shown(
    simulator: Any, member: Setting, starts: Array, stops: Array, sensors: Sequence[_Sensor], picks: Sequence[tuple[Whole, Array]]
) -> Array:
    """(k, N) what the sensors say, with the faults that the member supposes; sensors one after the other."""
    faults = tuple(term for term in member if term.hypothesis.cause == "sensor")
    times = [true_instants(faults, s.channel, time) for s, (_, time) in zip(sensors, picks, strict=True)]
    answers = simulator.predict(starts, stops, [s.channel for s in sensors], [(w, t) for (w, _), t in zip(picks, times, strict=True)])
    return np.concatenate([said(faults, s.channel, a, t) for s, a, t in zip(sensors, answers, times, strict=True)], axis=1)


def _moved(nodes: Array, simulator: Any) -> tuple[Array, int]:
    """Starts (d, W, n), each moved by one sigma along one coordinate: the root's pose and motion, or the joints' if the world holds it."""
    n = len(simulator.joints)
    moved = []
    for offset, size in _coordinates(bool(simulator.root), n):
        states = nodes.copy()
        if offset < 0:  # a turn of the root about axis -1 - offset
            half = np.zeros(4)
            half[0], half[-offset] = np.cos(size / 2), np.sin(size / 2)
            states[:, 4:8] = product(half[None], states[:, 4:8])
        else:
            states[:, offset] += size
        moved.append(states)
    return np.stack(moved), len(moved)


def _coordinates(free: bool, n: int) -> Iterable[tuple[int, float]]:
    if free:
        yield from ((k, START["position"]) for k in (1, 2, 3))
        yield from ((-k, START["position"]) for k in (1, 2, 3))
        yield from ((k, START["velocity"]) for k in range(8, 14))
        return
    yield from ((14 + k, START["position"]) for k in range(n))
    yield from ((14 + n + k, START["velocity"]) for k in range(n))


def _experiment(simulator: Any, maneuver: Maneuver, separation: float, one: str, other: str, now: float) -> Experiment:
    machine = simulator.machine()
    state = simulator.rest()
    heading = 2 * np.arctan2(state[7], state[4])
    positions = {} if machine.has_ground else dict(zip(simulator.joints, state[14:].tolist(), strict=False))
    text = scenario_text(maneuver, machine, step=simulator.step, start=(*state[1:4].tolist(), float(heading)), positions=positions)
    known = f" (the recordings: {now:.1f})" if np.isfinite(now) else ""
    verdict = f"is expected to tell '{one}' from '{other}' by {separation:.1f} sigmas{known}"
    if separation < ENOUGH:
        verdict = (
            f"tells '{one}' from '{other}' by {separation:.1f} sigmas only, and no maneuver of the library does better: another sensor, or "
            "less noise, is needed"
        )
    return Experiment(
        name=maneuver.name,
        purpose=maneuver.purpose,
        separation=separation,
        scenario=text,
        sentence=f"'{maneuver.name}' for {maneuver.duration:g} s ({maneuver.purpose}) {verdict}",
        now=now,
    )
