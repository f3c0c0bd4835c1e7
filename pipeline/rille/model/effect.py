"""Effects: physics beyond the base model, and faults of sensors. The catalogue is ``schema/effects.sql``."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectParameter:
    """A number of a law. amplitude : the effect vanishes where all such parameters are 0.

    lower, upper : bounds; typical : usual value, and default of what is no amplitude; spread : 1 sigma around it; all in ``unit``.
    search : how diagnosis looks for what is no amplitude: ``local`` from its usual value, ``scale`` over decades about it, ``phase`` around
    the circle, ``order`` over whole numbers, ``place`` over where the machine was, ``time`` over when it was, ``fixed``: it stays.
    """

    name: str
    unit: str
    amplitude: bool
    lower: float
    upper: float
    typical: float
    spread: float
    meaning: str
    search: str = "local"


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectKind:
    """A law of the catalogue. target : wheel, joint, body, sensor, terrain, world or any. passive : can only take energy out.

    memory : it has a state that motion does not tell (a rut, a lag): what it does depends on what was before.
    needs : what must be there for it to act: ``drive`` at the joint, ``grousers`` on the wheel, ``soft_ground``, ``gravity`` or ''.
    channel : quantities that can reveal it. equation, meaning, source : in words.
    """

    name: str
    family: str
    target: str
    passive: bool
    channel: str
    equation: str
    meaning: str
    source: str
    parameters: tuple[EffectParameter, ...]
    memory: bool = False
    needs: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """A law at work in a model. target : name of what it acts on, ``*`` = every one. parameters : SI; absent amplitudes are 0.

    An ``expression`` also has ``formula``, ``output``, ``constants`` (name -> [value, unit]) and ``target_kind`` among its parameters.
    """

    kind: str
    target: str = "*"
    parameters: Mapping[str, object] = field(default_factory=dict)

    def as_dict(self) -> dict[str, object]:
        """Kind, target and parameters as plain values, for JSON."""
        return {"kind": self.kind, "target": self.target, "parameters": dict(self.parameters)}
