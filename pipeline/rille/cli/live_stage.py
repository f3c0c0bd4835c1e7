"""What a live session on a database is made of."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from rille.model import Pose, Rover, Scenario

STEM = "live"


def live_scenario(database: Path, scenario: str | None, step: float | None) -> Scenario:
    """The scenario that a session begins with: ground, gravity and start of one that there is, without its commands.

    Parameters
    ----------
    scenario : a file (TOML) or a name; None: the only one. step : time step [s] instead of its own.

    Raises
    ------
    InputRefused : as for ``rille run``.
    """
    from rille import simulate, store
    from rille.store.steering import LONGEST

    if scenario is not None and scenario.endswith(".toml"):
        rover = store.read_rover(database)
        sheet = simulate.read_scenario_file(Path(scenario), rover)
        store.write_scenario(database, sheet)
        scenario = sheet.name
    base = store.read_scenario(database, scenario)
    return replace(base, duration=LONGEST, commands=(), changes=(), step=base.step if step is None else step)


def live_stage(database: Path, base: Scenario, rover: Rover, origin: tuple[float, float, float]) -> Any:
    """The stage of a session whose pictures are less of ``origin`` [m]."""
    from rille import live, simulate, store

    def opened(name: str, saved: str | None = None) -> live.Opened:
        try:
            return live.Opened(run=simulate.steered_run(database, name, saved=saved), scenario=name)
        except Exception:
            store.remove_unused(database, name)
            raise

    def fresh(place: tuple[float, float, float] | None) -> live.Opened:
        begun = base
        if place is not None:
            x, y, heading = place
            rotation = base.start.rotation if math.isnan(heading) else (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
            begun = replace(base, start=Pose(position=(x, y, base.start.position[2]), rotation=rotation))
        return opened(store.write_steered(database, begun, STEM))

    def fits(state: store.SavedState) -> bool:
        """Whether it is a state of the world that this session shows."""
        kept = store.read_scenario(database, state.scenario)
        same = (kept.terrain, kept.placement, kept.gravity) == (base.terrain, base.placement, base.gravity)
        return same and math.isclose(state.step, base.step, rel_tol=1e-9)

    return live.Stage(
        fresh=fresh,
        loaded=lambda saved: opened(store.write_continued(database, saved, STEM), saved),
        discard=lambda name: store.remove_unused(database, name),
        saves=lambda: [state.name for state in store.saved_states(database) if fits(state)],
        beyond_reach=lambda drive, value, time: simulate.beyond_reach(rover, drive, value, time),
        step=base.step,
        wheels=live.driven_wheels(rover),
        origin=origin,
        objects=tuple(objects_of(rover)),
        on_ground=base.placement == "on_terrain",
    )


def objects_of(rover: Rover) -> list[dict[str, Any]]:
    """Index of everything that can be read: quantity, target, unit, components, and whether it can be set."""
    vector, quaternion = ["x", "y", "z"], ["w", "x", "y", "z"]
    carried = {joint.child for joint in rover.joints}
    found: list[dict[str, Any]] = []

    def add(quantity: str, target: str, unit: str, components: list[str], writable: bool = False) -> None:
        found.append({"quantity": quantity, "target": target, "unit": unit, "components": components, "writable": writable})

    for body in rover.bodies:
        root = body.name not in carried
        add("part.position", body.name, "m", vector, root)
        add("part.orientation", body.name, "-", quaternion, root)
        add("part.linear_velocity", body.name, "m/s", vector, root)
        add("part.angular_velocity", body.name, "rad/s", vector, root)
    for joint in rover.joints:
        if joint.kind not in ("hinge", "prismatic"):
            continue
        hinge = joint.kind == "hinge"
        add("joint.position", joint.name, "rad" if hinge else "m", [""], True)
        add("joint.velocity", joint.name, "rad/s" if hinge else "m/s", [""], True)
        add("joint.effort", joint.name, "N m" if hinge else "N", [""])
    for drive in rover.drives:
        if drive.torque_constant is not None:
            add("motor.current", drive.name, "A", [""])
            if drive.resistance is not None:
                add("motor.voltage", drive.name, "V", [""])
    for wheel in rover.wheels:
        for quantity, unit in (
            *(("slip_ratio", "-"), ("slip_angle", "rad"), ("sinkage", "m"), ("normal_load", "N")),
            *(("drawbar_pull", "N"), ("side_force", "N"), ("drive_torque", "N m")),
        ):
            add(f"wheel.{quantity}", wheel.name, unit, [""])
    return found
