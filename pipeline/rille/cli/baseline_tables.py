"""Tables of residuals for the baselines of a proof: from replays of windows, and from points of a bench."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rille.model import Effect
from rille.model.recording import QUANTITIES, Channel, unit_of
from rille.proof.baselines.residuals import Input, ResidualTable, Scope

if TYPE_CHECKING:
    from rille.diagnosis.bench.bench_evidence import BenchEvidence
    from rille.diagnosis.evidence.evidence_part import Part
    from rille.diagnosis.evidence.replay_evidence import ReplayEvidence

Array = NDArray[np.float64]
NODES, ON_GROUND = 12, 4  # parts of a window; wheels on the ground change slowly, and take long to simulate
FOLDS = 6  # parts of the recordings that are left out in turn
FIRST_SHARE = 1e-3  # of the machine's weight, as trial force; with this length [m] as trial torque
LENGTH = 0.1
LOUD, QUIET, AIM = 30.0, 0.3, 3.0  # [sigma] largest answers to a trial force that are too large or too small, and what it is changed to
DEAF = 1e-3  # [sigma] answer to the first trial force, below which nothing is told of it
FOR_EVER = 1e5  # [s]
EARLIEST = 1e-9  # [s] after the beginning of a force
AXES = "xyz"
ROOT = (("position", AXES), ("orientation", "wxyz"), ("linear_velocity", AXES), ("angular_velocity", AXES))


def time_table(evidence: "ReplayEvidence") -> ResidualTable:
    """Windows of replayed recordings: what is left of their samples, and how these answer to a force at every joint and body."""
    from rille.diagnosis.evidence.evidence import Metric

    machine = evidence.parts[0].simulator.machine()
    scope = _scope(machine)
    inputs = _inputs(scope)
    metric = Metric(evidence.window, evidence.start_gain)
    gain = np.concatenate([_gain(_rough(part), inputs, scope) for part in evidence.parts], axis=1)
    features = [_features(part, machine, scope) for part in evidence.parts]
    fold = np.concatenate([np.arange(len(p.first)) * max(2, FOLDS // len(evidence.parts)) // len(p.first) for p in evidence.parts])
    return ResidualTable(
        recording=tuple(evidence.recordings[k] for k in evidence.run),
        time=evidence.starts,
        part=np.unique(np.stack([evidence.run, fold]), axis=1, return_inverse=True)[1].ravel(),
        window=evidence.window,
        left=metric.whitened(evidence.residuals([()]))[0],
        gain=metric.whitened(gain).reshape(len(inputs), _nodes(evidence.parts[0]), -1),
        degrees=metric.degrees,
        inputs=inputs,
        features={name: np.concatenate([f[name] for f in features]) for name in features[0]},
        scope=scope,
    )


def points_table(evidence: "BenchEvidence") -> ResidualTable:
    """Points of a bench: each is a window of one part, and the inputs are the responses themselves."""
    from rille.diagnosis.bench.bench_rig import responses

    rig = np.zeros(len(evidence.window), dtype=np.int64)
    point, response = rig.copy(), np.empty(len(rig), dtype=object)
    columns: dict[str, str] = {}
    for part in evidence.parts:
        rig[part.place], point[part.place], response[part.place] = part.rig, part.point, part.response
        columns.setdefault(part.response, part.channel.name)
    pairs, window = np.unique(np.stack([rig, point]), axis=1, return_inverse=True)
    order = np.argsort(window.ravel(), kind="stable")
    window, response, sigma = window.ravel()[order], response[order], evidence.sigma[order]
    firsts = np.searchsorted(window, np.arange(pairs.shape[1]))
    inputs = tuple(Input(kind="response", target=name) for name in columns)
    simulated = [responses(one, points, ())[0] for one, points in zip(evidence.rigs, evidence.points, strict=True)]

    def at_points(of: Sequence[Any], word: str) -> Array:
        return np.array([getattr(of[r], word)[p] for r, p in pairs.T])[:, None]

    conditions = {word: at_points(evidence.points, word) for word in ("load", "slip_ratio", "slip_angle")}
    first = evidence.rigs[0]
    return ResidualTable(
        recording=tuple(evidence.rigs[r].recording.name for r in pairs[0]),
        time=pairs[1].astype(float),
        part=evidence.run[evidence.window[order][firsts]],
        window=window,
        left=evidence.residuals([()])[0][order],
        gain=np.stack([np.where(response == one.target, 1 / sigma, 0.0)[None] for one in inputs]),
        degrees=np.bincount(window).astype(float),
        inputs=inputs,
        features=conditions | {f"simulated/{word}": at_points(simulated, word) for word in (*columns, "sinkage")},
        scope=Scope(wheels={first.wheel: ""}, soil=first.soil.name, channels=columns),
    )


def _scope(machine: Any) -> Scope:
    from rille.diagnosis.hypotheses.natural import matters, moving_bodies

    heavy = matters(machine, moving_bodies(machine))
    gravity = [machine.parameters.get(f"gravity.{axis}", (0.0,))[0] for axis in AXES]
    return Scope(
        joints={j.name: j.child for j in machine.joints if j.kind in ("hinge", "prismatic")},
        drives={d.joint: d.mode for d in machine.drives},
        root=machine.root,
        masses={b.name: b.mass for b in machine.bodies if b.name in heavy},
        wheels={w.name: w.joint for w in machine.wheels} if machine.has_ground else {},
        radii={w.name: w.radius for w in machine.wheels},
        gravity=(gravity[0], gravity[1], gravity[2]),
        effects=tuple((effect.kind, effect.target) for effect in machine.effects),
        soil=machine.soils[0] if machine.soils else "",
    )


def _inputs(scope: Scope) -> tuple[Input, ...]:
    """Efforts of all joints, forces and torques on bodies that matter, forces on those that carry wheels."""
    carriers = [body for joint, body in scope.joints.items() if joint in scope.wheels.values()]
    bodies = dict.fromkeys([*scope.masses, *carriers])
    return (
        *(Input(kind="effort", target=joint) for joint in scope.joints),
        *(Input(kind="force", target=body, axis=axis) for body in bodies for axis in AXES),
        *(Input(kind="torque", target=body, axis=axis) for body in scope.masses for axis in AXES),
    )


def _gain(part: "Part", inputs: Sequence[Input], scope: Scope) -> Array:
    """(n_inputs x K, m) answers [sigma] of the samples to a unit force in each part of its window, in the order of evidence.

    A force that acts from s1 to s2 answers as one from s1 on less one from s2 on: the motion is replayed from each s with a lasting force.
    """
    nodes = _nodes(part)
    weight = sum(scope.masses.values()) * max(float(np.linalg.norm(scope.gravity)), 1.0)
    trial = np.array([FIRST_SHARE * weight * (1.0 if one.kind == "force" else LENGTH) for one in inputs])
    first = _steps(part, inputs, trial, 1)
    largest = np.max([np.abs(step).max(axis=(1, 2)) for step in first], axis=0)
    felt = np.flatnonzero(largest > DEAF)  # a servo that holds exactly, or a wall, lets nothing be felt
    other = (largest > LOUD) | (largest < QUIET)
    trial = np.where(other, trial * AIM / np.maximum(largest, DEAF), trial)
    blocks = [np.zeros((len(inputs), nodes, len(s.time))) for s in part.samples]
    for block, step in zip(blocks, _steps(part, [inputs[int(k)] for k in felt], trial[felt], nodes), strict=True):
        block[felt] = (step - np.concatenate([step[:, 1:], np.zeros_like(step[:, :1])], axis=1)) / trial[felt, None, None]
    return part.ordered(blocks).reshape(len(inputs) * nodes, -1)


def _rough(part: "Part") -> "Part":
    """Replayed with larger steps, if these do for derivatives."""
    return part if part.rough is None else replace(part, simulator=part.rough)


def _nodes(part: "Part") -> int:
    """K, of how many parts windows are."""
    return ON_GROUND if part.simulator.has_ground else NODES


def _edges(part: "Part") -> Array:
    """(W, K + 1) [s] where the parts of the windows begin and end, whole multiples of the step."""
    begin, step, nodes = part.states[:, 0], part.simulator.step, _nodes(part)
    edges = begin[:, None] + (part.last - begin)[:, None] * np.arange(nodes + 1) / nodes
    return np.round(edges / step) * step


def _steps(part: "Part", inputs: Sequence[Input], trial: Array, count: int) -> list[Array]:
    """Of each channel (n_inputs, count, m) answers [sigma] to trial forces that last from the first ``count`` edges on; 0 before them, and
    where a run ended.
    """
    from rille.diagnosis.starts.start_fit import between

    edges, n_windows = _edges(part), len(part.first)
    states = part.states if count == 1 else _states(part, edges[:, :count])
    stops = np.repeat(part.last, count)
    later, picks = [], []
    for s in part.samples:
        node, sample = np.nonzero(s.time > edges[s.window, :count].T + EARLIEST)
        window = s.window[sample] * count + node
        order = np.argsort(window, kind="stable")
        later.append((node[order], sample[order]))
        picks.append((window[order], s.time[sample[order]]))
    models = [part.simulator.changed(effects=[_push(one, size)]) for one, size in zip(inputs, trial, strict=True)]
    answers = part.simulator.predict_many(
        [part.simulator, *models], states.reshape(n_windows * count, -1), stops, [s.channel for s in part.samples], picks
    )
    found = []
    for s, answer, (node, sample), pick in zip(part.samples, answers, later, picks, strict=True):
        there = replace(s, window=pick[0], time=pick[1], value=answer[0])
        step = np.zeros((len(inputs), count, len(s.time)))
        step[:, node, sample] = np.nan_to_num(np.array([between(there, one, answer[0]) for one in answer[1:]]) / s.noise)
        found.append(step)
    return found


def _states(part: "Part", time: Array) -> Array:
    """(W, k, n) simulated states at instants (W, k) [s], the first of which are where windows begin."""
    simulator, (n_windows, count) = part.simulator, time.shape
    wanted = [(f"part.{word}", simulator.root, axis) for word, axes in ROOT for axis in axes] if simulator.root else []
    wanted += [(f"joint.{word}", joint, "") for word in ("position", "velocity") for joint in simulator.joints]
    values = _simulated(part, wanted, time)
    rows = np.zeros((n_windows, count, part.states.shape[1]))
    rows[:, :, 0] = time
    rows[:, :, 1 if simulator.root else rows.shape[2] - len(wanted) :] = np.stack(list(values.values()), axis=-1)
    if not simulator.root:
        rows[:, :, 1 : rows.shape[2] - len(wanted)] = part.states[:, None, 1 : rows.shape[2] - len(wanted)]
    lost = ~np.isfinite(rows).all(axis=2)  # a run that ended: what follows has no answer, whatever it begins from
    rows[lost] = part.states[np.nonzero(lost)[0]]
    rows[:, :, 0] = time
    rows[:, 0] = part.states
    return rows


def _simulated(part: "Part", wanted: Sequence[tuple[str, str, str]], time: Array) -> dict[tuple[str, str, str], Array]:
    """(quantity, target, component) -> (W, k) at instants (W, k) [s] of the windows; NaN after a run has ended."""
    channels = [
        Channel(name=f"{q} {t} {c}", quantity=q, target=t, component=c, unit=unit_of(QUANTITIES[q], c), time=np.empty(0), value=np.empty(0))
        for q, t, c in wanted
    ]
    picks = [(np.repeat(np.arange(len(time)), time.shape[1]), time.ravel())] * len(channels)
    answers = part.simulator.predict(part.states[None], part.last, channels, picks)
    return {key: answer[0].reshape(time.shape) for key, answer in zip(wanted, answers, strict=True)}


def _push(one: Input, size: float) -> Effect:
    always = {"start": 0.0, "duration": FOR_EVER}
    if one.kind == "effort":
        return Effect(kind="joint_pulse", target=one.target, parameters={"torque": float(size), **always})
    numbers = {f"{kind}_{axis}": 0.0 for kind in ("force", "torque") for axis in AXES}
    return Effect(kind="external_pulse", target=one.target, parameters=numbers | {f"{one.kind}_{one.axis}": float(size)} | always)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Motion:
    """Simulated numbers at edges and middles of all parts of windows. value : (quantity, target, component) -> (W, 2 K + 1).
    length (W, 1) [s] : of a part.
    """

    value: dict[tuple[str, str, str], Array]
    length: Array

    def middle(self, quantity: str, target: str, component: str = "") -> Array:
        return self.value[quantity, target, component][:, 1::2]


def _features(part: "Part", machine: Any, scope: Scope) -> dict[str, Array]:
    """Simulated motion of one recording, names as in ``rille.proof.baselines.names``."""
    from rille.simulate.replay_commands import drive_commands

    motion = _motion(part, scope)
    found: dict[str, Array] = {}
    for joint in scope.joints:
        found[f"position/{joint}"], found[f"velocity/{joint}"] = (motion.middle(f"joint.{q}", joint) for q in ("position", "velocity"))
    edges = _edges(part)
    commands = drive_commands(part.recording, part.simulator.drives)
    for drive in machine.drives:
        time, value = commands.get(drive.name, (np.zeros(1), np.zeros(1)))
        at = [value[np.clip(np.searchsorted(time, t, side="right") - 1, 0, None)] for t in (0.5 * (edges[:, 1:] + edges[:, :-1]), edges)]
        found[f"command/{drive.joint}"] = at[0]
        found[f"command_rate/{drive.joint}"] = np.diff(at[1], axis=1) / motion.length
        found[f"effort/{drive.joint}"] = motion.middle("joint.effort", drive.joint)
    for body in machine.bodies:
        if body.name in scope.masses:
            found |= _of_body(motion, body, np.array(scope.gravity), _inertia(machine, body.name))
    for wheel in scope.wheels:
        for word in ("normal_load", "slip_ratio", "slip_angle", "sinkage"):
            found[f"{word}/{wheel}"] = motion.middle(f"wheel.{word}", wheel)
    if scope.wheels:
        found["turning_rate"] = motion.middle("part.angular_velocity", scope.root, "z")
    return {name: np.nan_to_num(values) for name, values in found.items()}


def _motion(part: "Part", scope: Scope) -> _Motion:
    wanted = [(f"joint.{word}", joint, "") for joint in scope.joints for word in ("position", "velocity")]
    wanted += [("joint.effort", joint, "") for joint in scope.drives]
    for body in scope.masses:
        wanted += [(f"part.{word}", body, axis) for word in ("position", "linear_velocity", "angular_velocity") for axis in AXES]
        wanted += [("part.orientation", body, component) for component in "wxyz"]
    wanted += [(f"wheel.{word}", wheel, "") for wheel in scope.wheels for word in ("normal_load", "slip_ratio", "slip_angle", "sinkage")]
    edges = _edges(part)
    time = np.empty((len(edges), 2 * edges.shape[1] - 1))
    time[:, ::2], time[:, 1::2] = edges, 0.5 * (edges[:, 1:] + edges[:, :-1])
    time[:, 0] += part.simulator.step  # forces are known from the end of the first step on
    return _Motion(value=_simulated(part, wanted, time), length=np.diff(edges, axis=1)[:, :1])


def _of_body(motion: _Motion, body: Any, gravity: Array, inertia: Array) -> dict[str, Array]:
    """Position, velocity and felt acceleration of a centre of mass, axes and rate of the own angular momentum of its body, all in W."""
    read = {word: np.stack([motion.value[f"part.{word}", body.name, axis] for axis in AXES], axis=-1)
            for word in ("position", "linear_velocity", "angular_velocity")}  # fmt: skip
    turn = np.stack([motion.value["part.orientation", body.name, component] for component in "wxyz"], axis=-1)
    turn = np.where(np.isfinite(turn).all(axis=-1, keepdims=True), turn, np.array([1.0, 0.0, 0.0, 0.0]))  # of runs that ended
    matrix = Rotation.from_quat(turn.reshape(-1, 4), scalar_first=True).as_matrix().reshape(*turn.shape[:-1], 3, 3)
    arm = matrix @ (np.array(body.com) - np.array(body.frame))
    velocity = read["linear_velocity"] + np.cross(read["angular_velocity"], arm)
    felt = gravity - np.diff(velocity[:, ::2], axis=1) / motion.length[:, :, None]
    spin = np.einsum("wkij,jl,wkml,wkm->wki", matrix, inertia, matrix, read["angular_velocity"])  # R I R^T omega
    turning = np.diff(spin[:, ::2], axis=1) / motion.length[:, :, None]
    rates = np.cross(read["angular_velocity"][:, :, None], np.swapaxes(matrix, 2, 3))  # of the axes of the body, one a row
    swing = np.diff(rates[:, ::2], axis=1) / motion.length[:, :, None, None]
    position = (read["position"] + arm)[:, 1::2]
    found = {}
    for k, axis in enumerate(AXES):
        found[f"position/{body.name}/{axis}"] = position[:, :, k]
        found[f"velocity/{body.name}/{axis}"] = velocity[:, 1::2, k]
        found[f"felt/{body.name}/{axis}"] = felt[:, :, k]
        found[f"turning/{body.name}/{axis}"] = turning[:, :, k]
        for j, column in enumerate(AXES):
            found[f"axis/{body.name}/{axis}{column}"] = matrix[:, 1::2, k, j]
            found[f"swing/{body.name}/{axis}{column}"] = swing[:, :, j, k]
    return found


def _inertia(machine: Any, body: str) -> Array:
    """(3, 3) about the centre of mass along the body's axes [kg m^2]; products that the model does not state are 0."""
    value = {word: machine.parameters.get(f"body.{body}.i{word}", (0.0,))[0] for word in ("xx", "yy", "zz", "xy", "xz", "yz")}
    return np.array([[value["".join(sorted((a, b)))] for b in AXES] for a in AXES])
