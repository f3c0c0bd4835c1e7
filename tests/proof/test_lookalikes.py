"""A law is as strong as what no other law of the catalogue that may stand for it explains."""

from dataclasses import dataclass

import numpy as np
import pytest

from rille import store
from rille.proof.generator.strange_laws import strange_kinds
from rille.proof.hidden import Hidden, hidden_effect
from rille.proof.lookalikes import lookalikes
from rille.proof.machines import MAKERS
from rille.proof.making import Misfit, _left_by

KINDS = {kind.name: kind for kind in store.effect_kinds()}
N = 400
BASE = {"c": Misfit(z=np.random.default_rng(1).standard_normal(N), degrees=float(N))}


def concealed(kind, target, cause="effect"):
    machine = MAKERS["arm"](np.random.default_rng(1))
    own = KINDS.get(kind) or next(k for k in strange_kinds() if k.name == kind)
    return lookalikes(machine, hidden_effect(machine, own, target, np.random.default_rng(2), cause=cause), list(KINDS.values()))


def test_a_law_without_a_name_is_set_against_all_that_have_one_number():
    kinds = {other.kind for other in concealed("cubic_friction", "shoulder", cause="outside")}
    assert {"coulomb_friction", "viscous_friction", "load_friction", "motor_lag"} <= kinds
    assert not kinds & {"stribeck_friction", "linear_drag", "external_pulse"}  # more numbers, or of bodies
    assert {"linear_drag", "quadratic_drag"} <= {other.kind for other in concealed("root_drag", "fore", cause="outside")}


def test_numbers_of_either_sign_are_tried_both_ways():
    gains = [o for o in concealed("fading_motor", "shoulder", cause="outside") if o.kind == "command_gain"]
    assert sorted(np.sign(next(iter(o.direction.values()))) for o in gains) == [-1, 1]
    assert all(o.most > 0 for o in gains)


def test_an_effect_is_set_against_what_it_contains():
    assert [o.kind for o in concealed("stribeck_friction", "shoulder")] == ["coulomb_friction"]
    assert concealed("coulomb_friction", "shoulder") == ()


@dataclass
class Waves:
    """What is shown of a law: its wave times a power of the size."""

    wave: np.ndarray
    power: float = 1.0

    def __call__(self, other, size):
        return {"c": Misfit(z=BASE["c"].z + self.wave * size**self.power, degrees=float(N))}


OTHER = Hidden(cause="effect", kind="other", target="", direction={"n": 1.0}, most=1e3)
X = np.linspace(0, 20, N)


@pytest.mark.parametrize("power", [1.0, 1.2])
def test_what_is_left_of_a_mixture_is_the_part_that_does_not_look_alike(power):
    """3 sin(x) + 2 cos(3 x) beside sin(x) of any size, begun at a tenth: the RMS of 2 cos(3 x), whose products with sin(x) sum to nothing
    over many waves up to 3 %; a law that is not in proportion to its size is met by the second step up to (10^(1/1.2 - 1) - 1)^2 = 10 %
    of its own part, 0.1 * 3 beside 2 in quadrature another 2 %.
    """
    here = {"c": Misfit(z=BASE["c"].z + 3 * np.sin(X) + 2 * np.cos(3 * X), degrees=float(N))}
    left, channel = _left_by(here, BASE, Waves(np.sin(X), power), OTHER, 0.3)
    assert left == pytest.approx(2 / np.sqrt(2), rel=0.06)
    assert channel == "c"


def test_a_law_that_another_one_is_leaves_nothing():
    here = {"c": Misfit(z=BASE["c"].z + 3 * np.sin(X), degrees=float(N))}
    assert _left_by(here, BASE, Waves(np.sin(X)), OTHER, 0.3)[0] == pytest.approx(0, abs=1e-9)


def test_a_law_turned_round_explains_nothing():
    """Friction takes energy out: one that would have to put it in is no name."""
    here = {"c": Misfit(z=BASE["c"].z - 3 * np.sin(X), degrees=float(N))}
    assert _left_by(here, BASE, Waves(np.sin(X)), OTHER, 0.3)[0] == pytest.approx(3 / np.sqrt(2), rel=0.05)


def test_a_law_that_ends_the_drive_early_explains_nothing():
    """What is left is the excess: sqrt(1 + 3^2/2 - 1) of 3 sin(x) beside noise of 1, whose product with it is a tenth at most."""
    here = {"c": Misfit(z=BASE["c"].z + 3 * np.sin(X), degrees=float(N))}

    def shown(other, size):
        return {"c": Misfit(z=BASE["c"].z[: N // 2], degrees=N / 2)}

    assert _left_by(here, BASE, shown, OTHER, 0.3)[0] == pytest.approx(3 / np.sqrt(2), rel=0.1)
