"""An answer that reaches the noise is doubted where another law would still take something away, and only there."""

from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.inference.doubt import brief, doubt, vague
from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rivals import Rivals, swapped_together
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.settle import State, exchange
from rille.model.diagnosis import Estimate, NamedTerm
from toy_evidence import catalogue, effect, named, number, recorded

CHEAP = [h for h in catalogue() if h.kind not in ("ripple", "push")]


def under(truth, answer):
    """The judge of an answer that was fitted to recordings of a machine with ``truth``."""
    evidence = recorded((truth,), seconds=20)
    first = Judge(evidence)
    (fitted,) = fit_together(first, [[(answer,)]])
    return Judge(evidence.relinearised(fitted.setting), fitted.setting)


def test_the_right_answer_is_not_doubted():
    truth = named("quadratic", "left", coefficient=0.03)
    assert doubt(under(truth, truth), CHEAP, {truth.hypothesis.title}) == ("", None)


def test_a_law_that_only_acts_alike_is_doubted():
    """Drag in proportion to speed for drag with its square: at the noise as a whole, but not in what the square would take away."""
    truth, answer = named("quadratic", "left", coefficient=0.03), named("viscous", "left", coefficient=0.03)
    against, other = doubt(under(truth, answer), CHEAP, {answer.hypothesis.title})
    assert truth.hypothesis.title in against
    assert other.hypothesis == truth.hypothesis
    drop = float(against.split("chi-squared ")[1].split(")")[0])
    assert doubt(under(truth, answer), CHEAP, {answer.hypothesis.title}, 400.0 * drop) == ("", None)  # a trifle of what was found
    assert doubt(under(truth, answer), [truth.hypothesis], {truth.hypothesis.title}) == (
        "",
        None,
    )  # what the answer leaves open is no objection


@pytest.mark.parametrize(
    ("coefficient", "extra", "said"),
    [
        (0.3, None, "viscous of right"),  # three times the noise is left, and one law would take it all away
        (0.0, lambda t, x, v: np.stack([0 * v[0], 0.5 * np.sin(11.0 * t) + 0.8 * np.sin(7.0 * t + x[0])]), ""),  # as in a real machine
    ],
    ids=["one law", "many things"],
)
def test_far_from_the_noise_one_law_is_an_objection_and_many_things_are_none(coefficient, extra, said):
    """Friction on one cart was found; there is more on the other."""
    found = named("coulomb", "left", force=2.0)
    evidence = recorded((found, named("viscous", "right", coefficient=coefficient)), seconds=20, extra=extra)
    first = Judge(evidence)
    (fitted,) = fit_together(first, [[(found,)]])
    judge = Judge(evidence.relinearised(fitted.setting), fitted.setting)
    assert judge.excess > 0.3 * judge.degrees
    against, _ = doubt(judge, CHEAP, {found.hypothesis.title}, first.chi2 - judge.chi2)
    assert (said in against) if said else against == ""


@pytest.mark.parametrize("size", [0.1, 0.2])
def test_what_only_acts_alike_is_not_named(size):
    """A force with the 1.5th power of speed, which quadratic drag follows up to little: seen by another law, or as what is left."""
    extra = recorded(seconds=20, extra=lambda t, x, v: np.stack([-size * np.sign(v[0]) * np.abs(v[0]) ** 1.5, 0 * v[1]]))
    found = search(extra, CHEAP)
    assert found.verdict == "unknown"
    assert found.nothing >= 0.5
    assert "only acts like" in found.notes[-1]


def test_two_pieces_that_could_each_be_another_could_both_be():
    a, b, c, d = (effect(kind, "left", number("size")).at({"size": 1.0}) for kind in ("lag", "coulomb", "delay", "stribeck"))
    settings = [(a, b), (c, b), (a, d), (d, b)]
    standing = SimpleNamespace(
        fitted=[SimpleNamespace(setting=s) for s in settings], confounded=SimpleNamespace(order=(1, 2, 3, 4), number=(-1, 0, 0, 0, 1))
    )
    assert swapped_together(standing, (a, b), 0) == [(c, d)]


@pytest.mark.parametrize("target", ["left", "right"])
def test_a_stand_in_is_among_the_rivals_of_every_piece(target):
    """Of friction on one cart and drag on the other: each stands with its own kin, however little those explain alone."""
    truth = (named("coulomb", "left", force=0.4), named("quadratic", "right", coefficient=0.3))
    found = search(recorded(truth, seconds=12), CHEAP)
    tried = {t.term.hypothesis.title for row in found.ranked for t in row.terms}
    assert {"left": "viscous of left", "right": "viscous of right"}[target] in tried


@pytest.mark.parametrize(("excess", "wider"), [(0.2, True), (0.0, False)], ids=["falls with speed", "is constant"])
def test_a_wider_law_takes_the_place_of_the_one_that_it_contains(excess, wider):
    """Friction that falls with speed where friction was found, begun at no friction at all; not where it is friction and no more."""
    truth = named("stribeck", "left", coulomb=0.4, excess=excess, speed=0.3)
    evidence = recorded((truth,), seconds=20)
    judge = Judge(evidence)
    (found,) = fit_together(judge, [[(named("coulomb", "left", force=0.3),)]])
    under = Judge(evidence.relinearised(found.setting), found.setting)
    state = State(always=(), first=judge, judge=under, pieces=list(found.setting), rivals=[Rivals()])
    assert exchange(state, evidence, 0, named("stribeck", "left", coulomb=0.0, excess=0.05, speed=0.1), len(CHEAP)) == wider
    (piece,) = state.pieces
    assert piece.hypothesis.kind == ("stribeck" if wider else "coulomb")
    if wider:
        assert piece.numbers["coulomb"] == pytest.approx(0.4, rel=0.05)
        assert piece.numbers["excess"] == pytest.approx(excess, rel=0.2)
        assert state.judge.chi2 < under.chi2


@pytest.mark.parametrize(
    ("conditioning", "with_shape", "vagueness"),
    [(0.999, False, False), (0.9, False, True), (0.999, True, True)],
)
def test_amplitudes_that_are_told_only_together_are_told(conditioning, with_shape, vagueness):
    """An offset in two directions that do nearly the same: each may be nothing if the other is larger, 0.3 +- 4. If the other were known
    it would be 0.3 +- 4 sqrt(1 - c^2): 0.18 or 1.7. A law with a shape beside them bends to other shapes.
    """
    free = [number("x", lower=-9.0, upper=9.0), number("y", lower=-9.0, upper=9.0)]
    estimates = [Estimate(name=n.name, unit="m", value=0.3, low=-3.7, high=4.3, conditioning=conditioning) for n in free]
    if with_shape:
        free.append(number("length", amplitude=False))
        estimates.append(Estimate(name="length", unit="m", value=0.3, low=0.1, high=9.0))
    term = effect("offset", "left", *free).at({n.name: 0.3 for n in free})
    assert bool(vague([NamedTerm(term=term, estimates=tuple(estimates))])) == vagueness


@pytest.mark.parametrize(("low", "vagueness"), [(0.0, True), (0.01, False)])
def test_a_law_without_any_number_that_is_told_is_vague(low, vagueness):
    """A cable that may be as soft as none, as long and anchored anywhere: what it does is seen, but not that it is one."""
    term = effect("cable", "left", number("stiffness"), number("length", amplitude=False)).at({"stiffness": 0.07, "length": 0.3})
    estimates = (
        Estimate(name="stiffness", unit="N/m", value=0.07, low=low, high=1.1),
        Estimate(name="length", unit="m", value=0.3, low=0.1, high=9.0),
    )
    said = vague([NamedTerm(term=term, estimates=estimates)])
    assert ("stiffness 0 to 1.1 N/m" in said) == vagueness
    assert bool(said) == vagueness


@pytest.mark.parametrize(
    ("terms", "after", "found", "doubted"),
    [
        ("push", 1250.0, 200.0, True),  # a quarter more than the noise is left everywhere, the push takes less
        ("push", 1250.0, 400.0, False),  # it takes more
        ("push", 1010.0, 200.0, False),  # noise is what it is taken for
        ("push coulomb", 1250.0, 200.0, False),  # a law that lasts is no matter of a moment
    ],
)
def test_a_push_in_what_is_too_loud_everywhere_is_doubted(terms, after, found, doubted):
    """1000 degrees of freedom, of noise that is not stated."""
    pieces = tuple(next(h for h in catalogue() if h.kind == kind and h.target == "left").at() for kind in terms.split())
    against = brief(SimpleNamespace(chi2=after, degrees=1000.0), pieces, found)
    assert ("state the noise" in against) == doubted
