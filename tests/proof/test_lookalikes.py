"""A law is as strong as what no other law of the catalogue that may stand for it explains."""

import numpy as np
import pytest

from rille import store
from rille.proof.generator.strange_laws import strange_kinds
from rille.proof.hidden import Hidden, hidden_effect
from rille.proof.lookalikes import lookalikes
from rille.proof.machines import MAKERS
from rille.proof.making import Misfit, _about_as_strong, excess, least_left

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


MOST = 1e3
X = np.linspace(0, 20, N)


def left_of(shown, explained):
    """What is left of a recording that shows this, by a law that explains ``explained(size)`` of it, begun at 0.3."""

    def beside(size):
        return {"c": Misfit(z=BASE["c"].z + shown - explained(size), degrees=float(N))}

    return least_left(beside, excess(beside(0.0), BASE), BASE, 0.3, MOST)


@pytest.mark.parametrize("power", [0.7, 1.0, 2.0])
def test_what_is_left_of_a_mixture_is_the_part_that_does_not_look_alike(power):
    """3 sin(x) + 2 cos(3 x) beside sin(x) of any size, begun far off: the RMS of 2 cos(3 x), whose products with sin(x) and with the noise
    sum to nothing over many waves up to 3 % and 5 %.
    """
    left, channel = left_of(3 * np.sin(X) + 2 * np.cos(3 * X), lambda size: np.sin(X) * size**power)
    assert left == pytest.approx(2 / np.sqrt(2), rel=0.06)
    assert channel == "c"


def test_a_law_that_another_one_is_leaves_nothing():
    """A size that is off by 1 % leaves 3 % of the noise; beside noise the excess is the root of a difference that may go either way."""
    assert left_of(3 * np.sin(X), lambda size: np.sin(X) * size)[0] < 0.2


def test_a_law_that_acts_by_fits_and_starts_is_followed_to_the_size_that_explains_most():
    """Friction that holds above a size and lets go below it: the way there is no straight line."""
    assert left_of(3 * np.sin(X), lambda size: np.sin(X) * 3 * np.tanh((size / 2.5) ** 3) / np.tanh(1.0))[0] < 0.3


def test_a_law_turned_round_explains_nothing():
    """Friction takes energy out: one that would have to put it in is no name. Vanishing sizes leave what there is, within 5 %."""
    assert left_of(-3 * np.sin(X), lambda size: np.sin(X) * size)[0] == pytest.approx(3 / np.sqrt(2), rel=0.05)


def test_a_law_that_ends_the_drive_early_explains_nothing():
    """What is left is the excess: sqrt(1 + 3^2/2 - 1) of 3 sin(x) beside noise of 1, whose product with it is a tenth at most."""
    here = {"c": Misfit(z=BASE["c"].z + 3 * np.sin(X), degrees=float(N))}
    short = {"c": Misfit(z=BASE["c"].z[: N // 2], degrees=N / 2)}
    for ended in (short, None):
        found = least_left(lambda size, ended=ended: ended, excess(here, BASE), BASE, 0.3, MOST)
        assert found[0] == pytest.approx(3 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize(
    ("slope", "size"), [(2.0, 1.0), (0.05, 10.0), (0.0, 0.0)], ids=["shows at once", "shows at its bound", "shows nothing"]
)
def test_a_law_begins_where_it_is_about_as_strong(slope, size):
    """In proportion to the first size that shows: 0.3, 1.8, then the bound of 10."""
    law = Hidden(cause="effect", kind="coulomb_friction", target="joint", direction={"torque": 1.0}, first=0.3, most=10.0)
    assert _about_as_strong(lambda tried: (slope * tried, "speed"), 2.0, law) == pytest.approx(size)
