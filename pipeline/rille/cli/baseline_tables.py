"""Tables of residuals for the baselines of a proof: from replays of windows, and from points of a bench."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rille.model import Effect
from rille.model.recording import MOTION_QUANTITIES, QUANTITIES, Channel, unit_of
from rille.proof.baselines.residuals import Input, ResidualTable, Scope

if TYPE_CHECKING:
    from rille.diagnosis.bench.bench_evidence import BenchEvidence
    from rille.diagnosis.evidence.evidence_part import Part
    from rille.diagnosis.evidence.replay_evidence import ReplayEvidence

Array = NDArray[np.float64]
NODES = 16  # parts of a window
FOLDS = 6  # parts of the recordings that are left out in turn
GRID = 2 * NODES  # instants of a window at which answers are simulated
FIRST_SHARE = 1e-3  # of the machine's weight, as trial force; with this length [m] as trial torque
LENGTH = 0.1
LOUD, QUIET, AIM = 30.0, 0.3, 3.0  # [sigma] largest answers to a trial force that are too large or too small, and what it is changed to
FOR_EVER = 1e5  # [s]
AXES = "xyz"


def time_table(evidence: "ReplayEvidence") -> ResidualTable:
    """Windows of replayed recordings: what is left of their samples, and how these answer to a force at every joint and body."""
    from rille.diagnosis.evidence.evidence import Metric

    machine = evidence.parts[0].simulator.machine()
    scope = _scope(machine)
    inputs = _inputs(scope)
    metric = Metric(evidence.window, evidence.start_gain)
    gain = np.concatenate([_gain(part, inputs, scope) for part in evidence.parts], axis=1)
    features = [_features(part, machine, scope) for part in evidence.parts]
    fold = np.concatenate([np.arange(len(p.first)) * max(2, FOLDS // len(evidence.parts)) // len(p.first) for p in evidence.parts])
    return ResidualTable(
        recording=tuple(evidence.recordings[k] for k in evidence.run),
        time=evidence.starts,
        part=np.unique(np.stack([evidence.run, fold]), axis=1, return_inverse=True)[1].ravel(),
        window=evidence.window,
        left=metric.whitened(evidence.residuals([()]))[0],
        gain=metric.whitened(gain).reshape(len(inputs), NODES, -1),
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
    """(n_inputs x NODES, m) answers [sigma] of the samples to a unit force in each part of its window, in the order of evidence.

    The answer to a step at the beginning of the window is simulated, S(t); that to a force from s1 to s2 is taken as S(t - s1) - S(t - s2).
    """
    begin, length = part.states[:, 0], part.last - part.states[:, 0]
    weight = sum(scope.masses.values()) * max(float(np.linalg.norm(scope.gravity)), 1.0)
    trial = np.array([FIRST_SHARE * weight * (1.0 if one.kind == "force" else LENGTH) for one in inputs])
    steps = _steps(part, inputs, trial)
    largest = np.max([np.abs(step).max(axis=(1, 2)) for step in steps], axis=0)
    change = (largest > 0) & ((largest > LOUD) | (largest < QUIET))
    if change.any():
        trial = np.where(change, trial * AIM / np.where(largest > 0, largest, 1.0), trial)
        chosen = np.flatnonzero(change)
        for step, again in zip(steps, _steps(part, [inputs[k] for k in chosen], trial[chosen]), strict=True):
            step[chosen] = again
    blocks = []
    for s, step in zip(part.samples, steps, strict=True):
        age = (s.time - begin[s.window]) / length[s.window] * GRID  # in instants of the grid
        direct = s.channel.quantity not in MOTION_QUANTITIES
        pulses = [_read(step, s.window, age - 2 * k, direct) - _read(step, s.window, age - 2 * (k + 1), direct) for k in range(NODES)]
        blocks.append(np.stack(pulses, axis=1) / trial[:, None, None])
    return part.ordered(blocks).reshape(len(inputs) * NODES, -1)


def _steps(part: "Part", inputs: Sequence[Input], trial: Array) -> list[Array]:
    """Of each channel (n_inputs, W, GRID) answers [sigma] to lasting trial forces; 0 where a run ended."""
    from rille.diagnosis.starts.start_fit import between

    n_windows, begin = len(part.first), part.states[:, 0]
    window = np.repeat(np.arange(n_windows), GRID)
    time = (begin[:, None] + (part.last - begin)[:, None] * np.arange(1, GRID + 1) / GRID).ravel()
    picks = [(window, time)] * len(part.samples)
    bare = [s.channel for s in part.samples]
    models = [part.simulator.changed(effects=[_push(one, size)]) for one, size in zip(inputs, trial, strict=True)]
    answers = part.simulator.predict_many([part.simulator, *models], part.states, part.last, bare, picks)
    found = []
    for s, answer in zip(part.samples, answers, strict=True):
        grid = replace(s, window=window, time=time, value=answer[0])
        changes = np.array([between(grid, one, answer[0]) for one in answer[1:]])
        found.append(np.nan_to_num(changes / s.noise).reshape(len(inputs), n_windows, GRID))
    return found


def _push(one: Input, size: float) -> Effect:
    always = {"start": 0.0, "duration": FOR_EVER}
    if one.kind == "effort":
        return Effect(kind="joint_pulse", target=one.target, parameters={"torque": float(size), **always})
    numbers = {f"{kind}_{axis}": 0.0 for kind in ("force", "torque") for axis in AXES}
    return Effect(kind="external_pulse", target=one.target, parameters=numbers | {f"{one.kind}_{one.axis}": float(size)} | always)


def _read(step: Array, window: NDArray[np.int64], age: Array, direct: bool) -> Array:
    """(n_inputs, m) step answers (n_inputs, W, GRID) at ages (m,) [instants]; 0 before. direct : they jump at the beginning."""
    before = step[:, :, :1] if direct else np.zeros_like(step[:, :, :1])
    whole = np.concatenate([before, step], axis=2)
    low = np.clip(np.floor(age).astype(np.int64), 0, GRID - 1)
    share = np.clip(age - low, 0.0, 1.0)
    value = (1 - share) * whole[:, window, low] + share * whole[:, window, low + 1]
    return np.where(age > 0, value, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Motion:
    """Simulated numbers at edges and middles of all parts of windows. value : (quantity, target, component) -> (W, 2 NODES + 1)."""

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
    begin = part.states[:, 0]
    edges = begin[:, None] + motion.length[:, None] * np.arange(NODES + 1) / NODES
    commands = drive_commands(part.recording, part.simulator.drives)
    for drive in machine.drives:
        time, value = commands.get(drive.name, (np.zeros(1), np.zeros(1)))
        at = [value[np.clip(np.searchsorted(time, t, side="right") - 1, 0, None)] for t in (0.5 * (edges[:, 1:] + edges[:, :-1]), edges)]
        found[f"command/{drive.joint}"] = at[0]
        found[f"command_rate/{drive.joint}"] = np.diff(at[1], axis=1) / (motion.length[:, None] / NODES)
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
    channels = [
        Channel(name=f"{q} {t} {c}", quantity=q, target=t, component=c, unit=unit_of(QUANTITIES[q], c), time=np.empty(0), value=np.empty(0))
        for q, t, c in wanted
    ]
    begin, n_windows, count = part.states[:, 0], len(part.first), 2 * NODES + 1
    length = part.last - begin
    share = np.arange(count) / (count - 1)
    share[0] = 1e-3  # forces are known from the end of the first step on
    time = (begin[:, None] + length[:, None] * share).ravel()
    picks = [(np.repeat(np.arange(n_windows), count), time)] * len(channels)
    answers = part.simulator.predict(part.states[None], part.last, channels, picks)
    return _Motion(value={key: a[0].reshape(n_windows, count) for key, a in zip(wanted, answers, strict=True)}, length=length)


def _of_body(motion: _Motion, body: Any, gravity: Array, inertia: Array) -> dict[str, Array]:
    """Position, velocity and felt acceleration of a centre of mass, axes and rate of the own angular momentum of its body, all in W."""
    read = {word: np.stack([motion.value[f"part.{word}", body.name, axis] for axis in AXES], axis=-1)
            for word in ("position", "linear_velocity", "angular_velocity")}  # fmt: skip
    turn = np.stack([motion.value["part.orientation", body.name, component] for component in "wxyz"], axis=-1)
    turn = np.where(np.isfinite(turn).all(axis=-1, keepdims=True), turn, np.array([1.0, 0.0, 0.0, 0.0]))  # of runs that ended
    matrix = Rotation.from_quat(turn.reshape(-1, 4), scalar_first=True).as_matrix().reshape(*turn.shape[:-1], 3, 3)
    arm = matrix @ (np.array(body.com) - np.array(body.frame))
    velocity = read["linear_velocity"] + np.cross(read["angular_velocity"], arm)
    felt = gravity - np.diff(velocity[:, ::2], axis=1) / (motion.length[:, None, None] / NODES)
    spin = np.einsum("wkij,jl,wkml,wkm->wki", matrix, inertia, matrix, read["angular_velocity"])  # R I R^T omega
    turning = np.diff(spin[:, ::2], axis=1) / (motion.length[:, None, None] / NODES)
    position = (read["position"] + arm)[:, 1::2]
    found = {}
    for k, axis in enumerate(AXES):
        found[f"position/{body.name}/{axis}"] = position[:, :, k]
        found[f"velocity/{body.name}/{axis}"] = velocity[:, 1::2, k]
        found[f"felt/{body.name}/{axis}"] = felt[:, :, k]
        found[f"turning/{body.name}/{axis}"] = turning[:, :, k]
        for j, column in enumerate(AXES):
            found[f"axis/{body.name}/{axis}{column}"] = matrix[:, 1::2, k, j]
    return found


def _inertia(machine: Any, body: str) -> Array:
    """(3, 3) about the centre of mass along the body's axes [kg m^2]; products that the model does not state are 0."""
    value = {word: machine.parameters.get(f"body.{body}.i{word}", (0.0,))[0] for word in ("xx", "yy", "zz", "xy", "xz", "yz")}
    return np.array([[value["".join(sorted((a, b)))] for b in AXES] for a in AXES])
