"""Frozen facts of a model in memory, as diagnosis takes them."""

from typing import Any

from rille.model import Effect
from rille.model.machine import Machine, MachineBody, MachineDrive, MachineJoint, MachineSensor, MachineWheel


def machine_facts(model: Any) -> Machine:
    """What a model of ``rille._solver`` is."""
    facts = model.facts
    wheels = tuple(
        MachineWheel(name=n, joint=j, radius=r, width=w, grouser_count=c, grouser_height=h, soft=soft)
        for n, j, r, w, c, h, soft in facts["wheels"]
    )
    return Machine(
        root=model.root,
        has_ground=model.has_ground and bool(model.root),
        soft_ground=any(wheel.soft for wheel in wheels),
        gravity=facts["gravity"],
        terrain=facts["terrain"],
        joints=tuple(
            MachineJoint(name=n, kind=kind, parent=p, child=c, point=point, axis=axis, lower=low, upper=high)
            for n, kind, p, c, point, axis, low, high in facts["joints"]
        ),
        drives=tuple(
            MachineDrive(name=n, joint=j, mode=m, max_torque=t, max_speed=s, speed_gain=g, torque_constant=k, resistance=r)
            for n, j, m, t, s, g, k, r in facts["drives"]
        ),
        wheels=wheels,
        bodies=tuple(MachineBody(name=n, mass=m, com=com, frame=frame) for n, m, com, frame in facts["bodies"]),
        sensors=tuple(MachineSensor(name=n, quantity=q, target=t) for n, q, t in facts["sensors"]),
        soils=tuple(facts["soils"]),
        effects=tuple(_effect(*row) for row in model.effects),
        parameters=dict(model.bounds()),
    )


def _effect(
    kind: str, target: str, numbers: dict[str, float], formula: str, output: str, constants: dict[str, tuple[float, str]]
) -> Effect:
    parameters: dict[str, object] = dict(numbers)
    if formula:
        parameters |= {"formula": formula, "output": output, "constants": {name: list(pair) for name, pair in constants.items()}}
    return Effect(kind=kind, target=target, parameters=parameters)


def add_effect(model: Any, effect: Effect) -> None:
    """Add an effect to a model of ``rille._solver``; what it does not say is as in the catalogue of the database.

    Raises
    ------
    InputRefused : for a law, target, parameter or value that catalogue and model do not have.
    """
    given = dict(effect.parameters)
    words = {key: str(given.pop(key)) for key in ("formula", "output", "target_kind") if key in given}
    constants = {name: (float(v[0]), str(v[1])) for name, v in dict(given.pop("constants", {})).items()}  # type: ignore[call-overload]
    numbers = {name: float(value) for name, value in given.items()}  # type: ignore[arg-type]
    model.add_effect(effect.kind, effect.target, numbers, constants=constants, **words)
