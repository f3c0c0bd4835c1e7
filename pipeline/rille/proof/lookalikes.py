"""Laws of the catalogue that may stand for another one, so that a recording shows neither of them for what it is."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from rille.model import EffectKind
from rille.proof.hidden import Hidden, effect_targets
from rille.proof.subject import Subject

CONTAINED: Mapping[str, tuple[str, ...]] = {"stribeck_friction": ("coulomb_friction",)}
"""Effects with all that another one has, and more -> those."""


def lookalikes(machine: Subject, hidden: Hidden, kinds: Sequence[EffectKind]) -> tuple[Hidden, ...]:
    """Laws of the catalogue with one number and no other that may stand for what is concealed at its target.

    For a law outside the catalogue: all of them, since any of them would be a name for it. For an effect: those that it contains. What
    the machine has already counts, too: more of it would be a wrong number.
    """
    found, bare = [], replace(machine, effects=())
    for kind in kinds:
        stands = hidden.cause == "outside" or kind.name in CONTAINED.get(hidden.kind, ())
        if stands and len(kind.parameters) == 1 and hidden.target in effect_targets(bare, kind):
            found += [_sided(hidden.target, kind, bound) for bound in (kind.parameters[0].lower, kind.parameters[0].upper) if bound]
    return tuple(found)


def _sided(target: str, kind: EffectKind, bound: float) -> Hidden:
    """A law whose number goes from 0 towards a bound."""
    number = kind.parameters[0]
    usual = math.copysign(abs(number.typical) or number.spread, bound)
    most = 0.95 * bound / usual
    return Hidden(cause="effect", kind=kind.name, target=target, direction={number.name: usual}, first=min(0.3, 0.3 * most), most=most)
