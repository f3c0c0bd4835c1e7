"""A model driven by the commands of a recording: states forward, channels as the sensors would have seen them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect, InputRefused
from rille.model.comparison import Regimes
from rille.model.machine import Machine
from rille.model.quaternion import angle_of
from rille.model.recording import Channel, Recording
from rille.simulate.machine_facts import add_effect, machine_facts
from rille.simulate.observe import observer
from rille.simulate.prediction import Picks, Trajectories, batches, predicted, trajectories
from rille.simulate.replay_commands import drive_commands

Array = NDArray[np.float64]


class Replayer:
    """Replays recordings with one model and scenario of a database.

    A state is a row as of ``rille._solver.Simulation.state()``: time, root position, quaternion w x y z, velocity, angular velocity in W,
    positions and velocities of ``joints``.

    path : model.db. scenario : name; None: the only one. step : [s], None: the scenario's. threads : 0: one a core.
    Raises InputRefused if there is no such model or scenario.
    """

    def __init__(self, path: Path | str, scenario: str | None = None, step: float | None = None, threads: int = 0) -> None:
        from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

        self._solver = _solver
        self._threads = threads
        self.path = Path(path)
        self.scenario = scenario or ""
        self._commands: Mapping[str, tuple[Array, Array]] = {}
        model = _solver.Model(str(path), scenario, step)
        self.own_step: float = model.step  # whatever ``changed`` makes of it
        self._take(model, model, model)

    def _take(self, model: Any, bare: Any, driven: Any) -> None:
        """model : as in the database. bare : without commands of drives that a recording commands; driven : with the recording's."""
        self._model, self._bare, self._driven = model, bare, driven
        self._placer = self._solver.Simulation(bare)
        self.step: float = model.step
        self.root: str = model.root
        self.joints: tuple[str, ...] = tuple(self._placer.state_joints)
        self.ratios: tuple[tuple[str, str, float], ...] = tuple(model.ratios)
        self.drives: tuple[tuple[str, str, str], ...] = tuple(model.drives)
        self.wheel_joints: tuple[tuple[str, str], ...] = tuple(model.wheel_joints)
        self.on_terrain: bool = model.placed_on_terrain
        self.has_ground: bool = model.has_ground and bool(self.root)
        self.has_memory: bool = model.has_memory
        self._late: float = model.command_delay

    def changed(
        self,
        effects: Sequence[Effect] = (),
        parameters: Mapping[str, float] | None = None,
        step: float | None = None,
        integrator: str | None = None,
    ) -> "Replayer":
        """The same model with more effects, other numbers or another integration, driven by the same recording.

        Parameters
        ----------
        effects : on top of the model's own. parameters : new values by name, see ``machine().parameters``. step : [s]. integrator :
            ``auto``, ``semi_implicit_euler`` or ``rk4``. None: as it is.

        Raises
        ------
        InputRefused : for what the model or the catalogue of its database does not have, values outside their bounds, and a model that
            cannot be simulated.
        """
        made = object.__new__(Replayer)
        made._solver, made._threads, made.path, made.scenario, made._commands, made.own_step = (
            self._solver, self._threads, self.path, self.scenario, self._commands, self.own_step,
        )  # fmt: skip
        models: dict[int, Any] = {}
        for model in (self._model, self._bare, self._driven):
            if id(model) in models:
                continue
            models[id(model)] = changed = model.copy()
            if step is not None:
                changed.set_step(step)
            if integrator is not None:
                changed.set_integrator(integrator)
            for effect in effects:
                add_effect(changed, effect)
            for name, value in (parameters or {}).items():
                changed.set(name, float(value))
        made._take(*(models[id(model)] for model in (self._model, self._bare, self._driven)))
        return made

    def machine(self) -> Machine:
        """Facts of the model in its scenario, with the numbers that ``changed`` can set."""
        return machine_facts(self._model)

    def drive_by(self, recording: Recording) -> None:
        """Take the commands of a recording; drives that it does not command keep those of the scenario.

        Raises
        ------
        InputRefused : as of ``drive_commands``, and for observed channels whose target or quantity the model does not have.
        """
        self._commands = drive_commands(recording, self.drives)
        self._bare = self._model.copy()
        for drive in self._commands:
            self._bare.set_commands(drive, np.empty(0), np.empty(0))
        self._driven = self._bare.copy()
        for drive, (time, value) in self._commands.items():
            self._driven.set_commands(drive, time, value)
        observed = recording.with_role("observed")
        for channel in observed:
            self._require_known(channel, recording.name)
        self._solver.Simulation(self._bare).sample(1, 1, list(observer(observed).needs))  # refuses what it does not have

    def _require_known(self, channel: Channel, recording: str) -> None:
        if channel.quantity in ("joint.position", "joint.velocity", "joint.effort") and channel.target not in self._placer.joint_names:
            self._refuse(channel, recording, "joint", self._placer.joint_names)
        if channel.quantity.startswith("part.") and channel.target not in self._placer.body_names:
            self._refuse(channel, recording, "part", self._placer.body_names)
        if channel.quantity.startswith("wheel.") and channel.target not in self._placer.wheel_names:
            self._refuse(channel, recording, "wheel", self._placer.wheel_names)

    @staticmethod
    def _refuse(channel: Channel, recording: str, kind: str, known: Sequence[str]) -> None:
        from rille.model import nearest_names

        raise InputRefused(
            f"channel '{channel.name}' of recording '{recording}' is of {kind} '{channel.target}', which the model does not have; "
            f"{nearest_names(channel.target, list(known))}"
        )

    def rest(self, x: float | None = None, y: float | None = None, heading: float | None = None) -> Array:
        """State (n,) from which the scenario begins, settled; on the ground at x, y [m] with that heading [rad] if they are given."""
        model = self._bare
        if self.root and x is not None and y is not None and heading is not None:
            model = model.copy()
            model.set_start(x, y, heading)
        simulation = self._solver.Simulation(model)
        if model.settle_time > 0:
            simulation.settle()
        return simulation.state()[0]

    def advance(self, state: Array, stop: float) -> tuple[Array, str]:
        """State (n,) at the time ``stop`` [s] of a run from ``state``, and why the run ended before ('' if it did not)."""
        simulation = self._solver.Simulation(self._stretch(state[0], stop))
        simulation.start_at(self._motions(state[None])[0])
        outcome = simulation.step(max(1, round((stop - state[0]) / self.step)))
        return simulation.state()[0], "" if outcome == "running" else simulation.message

    def _stretch(self, start: float, stop: float) -> object:
        """The model with the commands of that time only: a list of hours need not be read again for every window."""
        model = self._bare.copy()
        for drive, (time, value) in self._commands.items():
            # Of those up to the end of the first step the last two: one may act within that step, the other holds at its beginning.
            first = max(0, int(np.searchsorted(time, start - self._late + self.step, side="right")) - 2)
            last = int(np.searchsorted(time, stop + self.step, side="right"))
            model.set_commands(drive, np.ascontiguousarray(time[first:last]), np.ascontiguousarray(value[first:last]))
        return model

    def _motions(self, states: Array) -> Array:
        return self._placer.motions(np.ascontiguousarray(states))

    def heights(self, points: Array) -> Array:
        """Height [m] of the ground at points (n, 2) of W, (n,); NaN beside it. Zeros for a model without ground."""
        if not self.has_ground:
            return np.zeros(len(points))
        return self._model.ground_height(np.ascontiguousarray(points, dtype=float))[:, 0]

    def predict(self, states: Array, stops: Array, channels: Sequence[Channel], picks: Picks) -> list[Array]:
        """What the channels would have shown, from several start states in every window.

        Parameters
        ----------
        states : (k, n_windows, n) start states; their times are whole multiples of the step and the same for all k. Of a model that has a
            memory they ascend: what is not motion goes on from window to window, in the run of the first of the k.
        stops : (n_windows,) [s]. picks : of each channel, window and time [s] of its samples, delays taken off; windows ascend.

        Returns
        -------
        Of each channel (k, m) [unit]; NaN after a run has ended.
        """
        return [values[0] for values in self._predicted([self], states, stops, channels, picks, carried=False)]

    def predict_many(
        self, others: Sequence["Replayer"], states: Array, stops: Array, channels: Sequence[Channel], picks: Picks, carried: bool = False
    ) -> list[Array]:
        """What the channels would have shown with several models, from the same start in every window.

        Parameters
        ----------
        others : the models, of one step; as ``changed`` makes them. states : (n_windows, n). stops, picks : as of ``predict``.
        carried : what is not motion goes on from window to window in all of them, not only in those that have a memory.

        Returns
        -------
        Of each channel (n_models, m) [unit]; NaN after a run has ended.
        """
        return [values[:, 0] for values in self._predicted(others, states[None], stops, channels, picks, carried=carried)]

    def trajectories(self, states: Array, stops: Array, channels: Sequence[Channel]) -> Trajectories:
        """Runs from start states (n_windows, n) to ``stops`` (n_windows,) [s], to be read at any instants; of a model without memory."""
        return trajectories(self._driven, self._motions(states), stops=stops, channels=channels, step=self.step, threads=self._threads)

    def _predicted(
        self, models: Sequence["Replayer"], states: Array, stops: Array, channels: Sequence[Channel], picks: Picks, *, carried: bool
    ) -> list[Array]:
        k, n_windows, size = states.shape
        if not models:
            return [np.empty((0, k, len(time))) for _, time in picks]
        steps = {model.step for model in models}
        if len(steps) > 1:
            raise ValueError(f"models that predict together need one step, not {sorted(steps)}")
        flat = states.reshape(k * n_windows, size)
        return predicted(
            [model._driven for model in models],
            [model._motions(flat).reshape(k, n_windows, -1) for model in models],
            [carried or model.has_memory for model in models],
            stops=stops,
            channels=channels,
            picks=picks,
            step=steps.pop(),
            threads=self._threads,
        )

    def regimes(self, states: Array, stops: Array, interval: float = 0.05) -> Regimes:
        """Conditions along the windows that start from ``states`` (n_windows, n), about every ``interval`` [s]."""
        needs = [("part.position", self.root, k) for k in range(3)] if self.root else []
        needs += [("part.orientation", self.root, k) for k in range(4)] if self.root else []
        needs += [("part.linear_velocity", self.root, k) for k in range(3)] if self.root else []
        needs += [("part.angular_velocity", self.root, 2)] if self.root else []
        offset = len(needs)
        named = [
            (f"{word}/{wheel}", (f"wheel.{word}", wheel, 0)) for wheel, _ in self.wheel_joints for word in ("slip_ratio", "normal_load")
        ]
        named += [(f"joint_speed/{joint}", ("joint.velocity", joint, 0)) for joint in self.joints]
        named += [(f"effort/{joint}", ("joint.effort", joint, 0)) for _, joint, _ in self.drives]
        needs += [need for _, need in named]
        shortest = float(np.min(stops - states[:, 0]))
        every = max(1, round(min(interval, shortest / 4) / self.step))
        n_steps = np.maximum(every, np.round((stops - states[:, 0]) / self.step).astype(np.int64))
        rows, times, windows = [], [], []
        for first, last in batches(n_steps // every * len(needs)):
            longest = int(n_steps[first:last].max())
            steps = self._solver.windows([self._driven], self._motions(states[first:last]), longest, every, needs, threads=self._threads)[0]
            for window in range(first, last):
                count = int(n_steps[window] // every)
                rows.append(steps[window - first, :count])
                times.append(states[window, 0] + self.step * every * np.arange(1, count + 1))
                windows.append(np.full(count, window))
        all_rows = np.concatenate(rows)
        whole = np.isfinite(all_rows).all(axis=1)
        all_rows = all_rows[whole]
        values = {name: all_rows[:, offset + k] for k, (name, _) in enumerate(named)}
        if self.root:
            values |= self._root_regimes(all_rows)
        return Regimes(time=np.concatenate(times)[whole], window=np.concatenate(windows)[whole], values=values)

    def _root_regimes(self, rows: Array) -> dict[str, Array]:
        """Conditions of the root from its position, quaternion, velocity and turning rate, rows of (m, 11)."""
        x, y = rows[:, 0], rows[:, 1]
        turn = rows[:, 3:7]
        tilt = np.arccos(np.clip(1 - 2 * (turn[:, 1] ** 2 + turn[:, 2] ** 2), -1, 1))
        slope = tilt
        if self.has_ground:
            reach = 0.25  # [m] slope of the ground over twice this length
            east, west = (self.heights(np.stack([x + s, y], axis=1)) for s in (reach, -reach))
            north, south = (self.heights(np.stack([x, y + s], axis=1)) for s in (reach, -reach))
            ground = np.arctan(np.hypot(east - west, north - south) / (2 * reach))
            slope = np.where(np.isfinite(ground), ground, tilt)
        return {
            "speed": np.hypot(rows[:, 7], rows[:, 8]),
            "turning_rate": rows[:, 10],
            "slope": slope,
            "heading": angle_of(turn, "yaw"),
            "x": x,
            "y": y,
        }

    def why_ended(self, state: Array, stop: float) -> str:
        """Why a run from that state does not reach ``stop`` [s]; '' if it does."""
        return self.advance(state, stop)[1]

    def missing_efforts(self, states: Array, span: float, speeds: Array) -> tuple[Array, Array]:
        """Mean efforts [N m or N] of the drives over ``span`` [s], and those that lack for the joints to have ``speeds`` at its end.

        tau = M (v - v_simulated) / span, with M of the state half-way: all friction and effects of the model, and every change of a command
        within the span, are at work.

        Parameters
        ----------
        states : (m, n) starts of mechanisms that the world holds. speeds : (m, n_joints) [rad/s or m/s].

        Returns
        -------
        (m, n_joints) each; NaN where a run ended. Joints that a ratio ties together: the sum of factor times effort is what counts.
        """
        n_steps = max(1, round(span / self.step))
        needs = [("joint.velocity", joint, 0) for joint in self.joints] + [("joint.effort", joint, 0) for joint in self.joints]
        needs += [("joint.position", joint, 0) for joint in self.joints]
        n = len(self.joints)
        applied, lacking = np.full((len(states), n), np.nan), np.full((len(states), n), np.nan)
        to_dof = self._joint_directions(states[0])
        for first, last in batches(np.full(len(states), n_steps * len(needs))):
            steps = self._solver.windows([self._driven], self._motions(states[first:last]), n_steps, 1, needs, threads=self._threads)[0]
            applied[first:last] = steps[:, :, n : 2 * n].mean(axis=1)
            half_way = states[first:last].copy()
            half_way[:, 14 : 14 + n] = steps[:, n_steps // 2, 2 * n :]
            half_way[:, 14 + n :] = steps[:, n_steps // 2, :n]
            change = (speeds[first:last] - steps[:, -1, :n]) / (n_steps * self.step)
            whole = np.isfinite(change).all(axis=1) & np.isfinite(half_way).all(axis=1)
            motions = np.full((last - first, self._placer.motion().shape[1]), np.nan)
            motions[whole] = self._motions(half_way[whole])
            for k in np.flatnonzero(whole):
                self._placer.start_at(motions[k])
                effort = self._placer.inverse_dynamics(to_dof @ change[k]) - self._placer.inverse_dynamics(np.zeros(len(to_dof)))
                lacking[first + k] = to_dof.T @ effort[0]
        return applied, lacking

    def _joint_directions(self, state: Array) -> Array:
        """(n_v, n_joints): generalised velocity of a unit speed of each joint."""
        n = len(self.joints)
        rows = np.repeat(state[None], n + 1, axis=0)
        rows[:, 8:14] = 0
        rows[:, 14 + n :] = 0
        rows[1:, 14 + n :] = np.eye(n)
        size = self._placer.n_v
        motions = self._motions(rows)[:, -size:]
        return (motions[1:] - motions[0]).T
