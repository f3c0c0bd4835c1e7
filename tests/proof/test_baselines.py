"""Baselines of a proof: they find what they can say, and say nothing where nothing is missing."""

from dataclasses import replace

import numpy as np
import pytest

from rille import simulate
from rille.cli.baseline_tables import time_table
from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.replay_evidence import gather
from rille.model.hypothesis import Hypothesis, Term
from rille.proof.baselines import ResidualTable, Scope, TunedNumber, gaussian_process, named, sindy, tune
from rille.proof.baselines.names import Named, library, usual_sizes
from rille.proof.baselines.residuals import Input, gap_closed
from swung import model, recorded

N_WINDOWS, K, EACH = 24, 4, 30


def table(seed, force=None):
    """A hinge seen by samples of unit noise; ``force(q, w)`` is missing at it."""
    rng = np.random.default_rng(seed)
    time = np.arange(N_WINDOWS * K).reshape(N_WINDOWS, K) * 0.1
    phase = rng.uniform(0, 6.0)
    q, w = 1.2 * np.sin(1.3 * time + phase) + 0.3 * np.sin(4.1 * time), 1.56 * np.cos(1.3 * time + phase) + 1.23 * np.cos(4.1 * time)
    window = np.repeat(np.arange(N_WINDOWS), EACH)
    gain = np.abs(rng.normal(4.0, 2.0, (1, K, len(window))))
    made = ResidualTable(
        recording=("a",) * N_WINDOWS,
        time=time[:, 0],
        part=np.arange(N_WINDOWS) // 4,
        window=window,
        left=rng.standard_normal(len(window)),
        gain=gain,
        degrees=np.full(N_WINDOWS, float(EACH)),
        inputs=(Input(kind="effort", target="hinge"),),
        features={"position/hinge": q, "velocity/hinge": w},
        scope=Scope(joints={"hinge": "link"}),
    )
    return replace(made, left=made.left + made.answer(0, force(q, w))) if force else made


@pytest.mark.parametrize(
    ("kind", "size", "force"),
    [
        ("coulomb_friction", 0.2, lambda q, w: -0.2 * np.sign(w)),
        ("viscous_friction", 0.15, lambda q, w: -0.15 * w),
        ("torque_ripple", 0.2, lambda q, w: 0.2 * np.sin(6 * q)),
        ("joint_pulse", 0.2, lambda q, w: 0.2 + 0 * q),
    ],
)
def test_sindy_names_what_is_in_its_library(kind, size, force):
    answer = sindy(table(1, force), table(2, force))
    assert answer.differs
    assert answer.name == Named(cause="effect", kind=kind, target="hinge")
    assert answer.number == pytest.approx(size, rel=0.2)
    assert answer.gap_closed > 0.9


def test_a_friction_that_the_model_has_is_a_parameter():
    def force(q, w):
        return -0.15 * w

    known = Scope(joints={"hinge": "link"}, effects=(("viscous_friction", "hinge"),))
    answer = sindy(replace(table(1, force), scope=known), replace(table(2, force), scope=known))
    assert answer.name == Named(cause="parameter", kind="viscous_friction.coefficient", target="hinge")


def test_nothing_is_said_of_noise():
    said = [(sindy(table(seed), table(seed + 100)), gaussian_process(table(seed), table(seed + 100))) for seed in range(6)]
    assert sum(one.name is not None for one, _ in said) <= 1
    assert sum(one.differs for _, one in said) <= 1
    assert all(np.isnan(one.gap_closed) or abs(one.after - one.before) < 0.05 for pair in said for one in pair)


def test_a_process_closes_the_gap_without_a_name():
    def force(q, w):
        return 0.3 * np.tanh(2 * q) * np.cos(w)

    answer = gaussian_process(table(3, force), table(4, force))
    assert answer.name is None
    assert answer.differs
    assert answer.gap_closed > 0.5


def test_gap_closed_counts_from_the_noise():
    assert gap_closed(3.0, 2.0) == pytest.approx(0.5)
    assert gap_closed(3.0, 0.9) == 1.0
    assert np.isnan(gap_closed(0.95, 0.9))


def test_every_term_is_finite_and_named():
    one = table(5)
    terms = library(one, usual_sizes(one))
    assert len({term.words for term in terms}) == len(terms)
    assert all(np.isfinite(force).all() and force.shape == one.shape for term in terms for _, force in term.forces)


def numbers(count):
    name = [Named(cause="parameter", kind=f"number_{k}", target="") for k in range(count)]
    return [TunedNumber(name=n, word=n.kind, unit="1", value=1.0, lower=0.5, upper=2.0, spread=0.2) for n in name]


def test_tuning_names_the_number_that_is_off():
    rng = np.random.default_rng(3)
    slopes, noise = rng.normal(0, 4, (3, 200)), rng.standard_normal(200)
    tuned = tune(numbers(3), lambda values: noise - (values - np.array([1.0, 1.3, 1.0])) @ slopes)
    chi2 = (np.array([900.0]), np.array([100.0])), (np.array([100.0]), np.array([100.0]))
    answer = named(numbers(3), tuned, *chi2)
    assert answer.name == Named(cause="parameter", kind="number_1", target="")
    assert answer.number == pytest.approx(0.3, abs=0.1)
    assert answer.gap_closed == 1.0


def test_tuning_says_nothing_of_noise_and_minds_bounds():
    rng = np.random.default_rng(4)
    slopes, noise = rng.normal(0, 4, (3, 200)), rng.standard_normal(200)
    chi2 = (np.array([100.0]), np.array([100.0]))
    quiet = tune(numbers(3), lambda values: noise - (values - 1.0) @ slopes)
    assert named(numbers(3), quiet, chi2, chi2).name is None
    far = tune(numbers(3), lambda values: noise - (values - np.array([9.0, 1.0, 1.0])) @ slopes)
    assert 1.9 < far.values[0] <= 2.0


def test_tuning_does_not_choose_between_numbers_that_do_the_same():
    rng = np.random.default_rng(5)
    slope, noise = rng.normal(0, 4, 200), rng.standard_normal(200)
    tuned = tune(numbers(2), lambda values: noise - (values - np.array([1.2, 1.0])) @ np.stack([slope, slope]))
    chi2 = (np.array([100.0]), np.array([100.0]))
    answer = named(numbers(2), tuned, chi2, chi2)
    assert answer.differs
    assert answer.name is None


def test_terms_answer_as_the_laws_do(make_model):
    """Of a two-link pendulum the first order of each law, by its term, beside a replay with the law itself: within a fifth."""
    path, scenario = model(make_model, 3)
    evidence = gather({"swing": simulate.Replayer(path)}, [recorded(path, scenario, 3)], window=0.5)
    metric = Metric(evidence.window, evidence.start_gain)
    made = time_table(evidence)
    assert made.size() == pytest.approx(np.sqrt(np.sum(metric.whitened(evidence.residuals([()]))[0] ** 2) / np.sum(metric.degrees)))
    terms = {term.words: term for term in library(made, usual_sizes(made))}
    bodies = list(made.scope.masses)
    for kind, target, words, number in (
        ("viscous_friction", "hinge2", "-w at hinge2", "coefficient"),
        ("coulomb_friction", "hinge1", "-sign(w) at hinge1", "torque"),
        ("linear_drag", bodies[-1], f"-v at {bodies[-1]}", "coefficient"),
        ("mass_change", bodies[-1], f"g - a at {bodies[-1]}", "mass"),
        ("com_offset", bodies[-1], f"x x (g - a) at {bodies[-1]}", "x"),
    ):
        size = 1e-4
        numbers = {number: size} | ({"y": 0.0, "z": 0.0} if number == "x" else {})
        law = Hypothesis(cause="effect", kind=kind, target=target, target_kind="", free=(), fixed=numbers)
        base, other = metric.whitened(evidence.residuals([(), (Term(hypothesis=law, values=()),)]))
        exact = base - other
        first = size * sum(made.answer(place, force) for place, force in terms[words].forces)
        assert np.linalg.norm(exact - first) < 0.2 * np.linalg.norm(exact), kind
