"""Benches that recordings of points were made on, from a database: which wheel, soil, law and effects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rille.diagnosis.bench.bench_rig import BenchRig, RigSimulator
    from rille.model import BenchPoints, BenchWheel, Effect, Soil
    from rille.model.recording import Recording

STEEPEST = 1.5  # [rad] slip angle from which on the bench of the solver has no heading speed to speak of


def bench_rig(path: Path, recording: "Recording") -> tuple["BenchRig", tuple[str, ...]]:
    """The bench of a recording of points, and notes on it.

    The wheel is the database's, with the effects on it, if it has one of that name, else that of the manifest. The soil is that of the
    manifest, by name from the database before the library; without one there, the database's only soil.

    Raises
    ------
    InputRefused : if wheel or soil are not known, or the points are none.
    """
    from rille import simulate, store
    from rille.diagnosis.bench.bench_rig import BenchRig
    from rille.recording.points import bench_conditions, bench_target

    name = bench_target(recording)
    wheel, effects, notes = _wheel(path, recording, name)
    soil = bench_soil(path, recording.setup, recording.name)
    if recording.setup.get("soil_known"):
        soil = replace(soil, provenance="measured")
    law = str(recording.setup.get("law", "bekker_wong"))
    gravity = abs(simulate.surface_gravity(_number(recording.setup.get("gravity", "earth"))))
    by_travel = recording.setup.get("slip_speed") == "travel"
    speed = float(_number(recording.setup.get("speed", 0.05)))
    shape = f"{1e3 * wheel.radius:.4g} x {1e3 * wheel.width:.4g} mm"
    acting = f", {', '.join(effect.kind for effect in effects)}" if effects else ""
    notes = [f"bench: wheel of radius x width {shape}, {soil.name}, {law}{acting}", *notes]
    if by_travel:
        notes.append(
            "recorded slip ratios mean the speed of travel; the bench was given those along the heading, 1 - cos(slip angle) (1 - slip)"
        )
    made = BenchRig(
        recording=recording,
        conditions=bench_conditions(recording),
        wheel=name,
        shape=wheel,
        soil=soil,
        speed=speed,
        run=_simulator(law, effects, gravity, speed, by_travel),
        own_soil=any(one.name == soil.name for one in store.read_soils(path)),
    )
    return made, tuple(notes)


def _simulator(law: str, acting: Sequence["Effect"], gravity: float, speed: float, by_travel: bool) -> "RigSimulator":
    """The bench of the solver; slip angles that it has no speeds for have no answer."""
    import numpy as np

    from rille import simulate, store
    from rille.recording.points import along_heading

    kinds = store.effect_kinds()

    def run(points: "BenchPoints", soil: "Soil", wheel: "BenchWheel", effects: Sequence["Effect"]) -> tuple["BenchPoints", Sequence[str]]:
        able = np.abs(points.slip_angle) < STEEPEST
        status = np.full(len(points), "slip angle above 86 deg", dtype=object)
        values = {field: np.full(len(points), np.nan) for field in points.__dataclass_fields__}
        if able.any():
            some = points.where(able)
            slip = along_heading(some.slip_ratio, some.slip_angle) if by_travel else some.slip_ratio
            result = simulate.bench(
                law,
                soil,
                wheel,
                load=some.load,
                slip_ratio=slip,
                slip_angle=some.slip_angle,
                effects=simulate.effect_rows([*acting, *effects], kinds),
                gravity=gravity,
                speed=speed,
            )
            status[able] = result.status
            for field, value in values.items():
                value[able] = getattr(result.points, field)
            values["slip_ratio"] = points.slip_ratio
        return type(points)(**values), list(status)

    return run


def _wheel(path: Path, recording: "Recording", name: str) -> tuple["BenchWheel", list["Effect"], list[str]]:
    """The wheel, the effects on it, and what there is to say about it."""
    from rille import store
    from rille.model import BenchWheel, InputRefused

    wheels = {wheel.name: wheel for wheel in store.read_rover(path).wheels}
    stated: Mapping[str, Any] = recording.setup.get("wheel") or {}  # pyright: ignore[reportAssignmentType]
    acting = [replace(e, target="*") for e in store.read_effects(path) if e.target in ("*", name) and _acts_on_wheels(e)]
    if name in wheels:
        made = wheels[name]
        count, height = (made.grouser.count, made.grouser.height) if made.grouser is not None else (0, 0.0)
        wheel = BenchWheel(radius=made.radius, width=made.width, grouser_count=count, grouser_height=height)
        other = [
            f"{key} {1e3 * getattr(wheel, key):.4g} mm (manifest: {1e3 * stated[key]:.4g} mm)"
            for key in ("radius", "width", "grouser_height")
            if key in stated and abs(getattr(wheel, key) - stated[key]) > 0.01 * max(abs(stated[key]), 1e-6)
        ]
        return wheel, acting, [f"the model's wheel '{name}' has {', '.join(other)}; the model's was used"] if other else []
    if not stated:
        raise InputRefused(
            f"'{path}' has no wheel '{name}', and the manifest of recording '{recording.name}' states none; "
            "state radius and width in [bench], or build a rover with this wheel into the database"
        )
    return BenchWheel(**stated), acting, []


def _acts_on_wheels(effect: "Effect") -> bool:
    from rille import store

    target = store.find_effect_kind(effect.kind).target
    return target == "wheel" or (target == "any" and effect.parameters.get("target_kind") == "wheel")


def bench_soil(path: Path, setup: Mapping[str, object], name: str) -> "Soil":
    """Soil of a bench: named or written in ``setup``, else the database's only one. ``name`` is the recording's.

    Raises
    ------
    InputRefused : if it is not known, or there is none or several to choose from.
    """
    from rille import store, terrain
    from rille.cli.rig import pick_soil
    from rille.model import InputRefused
    from rille.model.sheet import validate_sheet
    from rille.terrain.register import SoilSheet

    own = {soil.name: soil for soil in store.read_soils(path)}
    chosen = pick_soil(dict(terrain.soils()) | own, str(setup["soil"])) if "soil" in setup else None
    values: Mapping[str, object] = setup.get("soil_values") or {}  # pyright: ignore[reportAssignmentType]
    if values:
        base: dict[str, object] = {"name": "bench"}
        if chosen is not None:
            base |= {key: getattr(chosen, key) for key in SoilSheet.model_fields} | {"name": f"{chosen.name} (changed)"}
        return validate_sheet(base | dict(values), SoilSheet, f"[bench.soil_values] of recording '{name}'").value()
    if chosen is not None:
        return chosen
    if len(own) != 1:
        which = f"the database has several, {', '.join(own)}" if own else "the database has none"
        raise InputRefused(
            f"recording '{name}' does not say which soil its wheel ran in, and {which}; state soil in [bench] of its manifest"
        )
    return next(iter(own.values()))


def _number(value: object) -> float | str:
    """A value of the setup, which is JSON."""
    return value if isinstance(value, int | float | str) else str(value)
