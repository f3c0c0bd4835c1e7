"""Screening and fitting on the toy: units far off, thresholds, orders, silent and equal hypotheses, intervals that hold."""

from dataclasses import replace

import numpy as np
import pytest

from rille.diagnosis.hypotheses.shape_tries import shape_tries
from rille.diagnosis.inference.accept import loud_channels
from rille.diagnosis.inference.fit import estimates, fit
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.screen import Signature, alike, screen
from rille.model.hypothesis import Setting
from rille.model.recording import Channel
from toy_evidence import catalogue, effect, named, number, parameter, recorded, shape


def first_of(screened):
    return screened.signatures[0]


@pytest.mark.parametrize("spread", [1e-4, 0.1, 30.0])
def test_a_spread_that_is_far_off_does_not_hide_a_hypothesis(spread):
    evidence = recorded((named("viscous", "left", coefficient=0.2),), seconds=10)
    right = effect("viscous", "left", number("coefficient", spread=spread))
    found = first_of(screen(evidence, [right, *(h for h in catalogue(("right",)) if h.kind in ("viscous", "coulomb", "mass"))]))
    assert found.hypothesis is right
    assert np.isclose(found.values["coefficient"], 0.2, rtol=0.1)


@pytest.mark.parametrize("spread", [0.01, 0.3, 20.0])
def test_what_acts_beyond_a_threshold_is_found_from_any_first_try(spread):
    evidence = recorded((named("limit", "right", inverse=0.3),), seconds=10)
    right = effect("limit", "right", number("inverse", upper=50.0, spread=spread))
    found = first_of(screen(evidence, [right]))
    assert not found.silent
    assert found.drop > 0.6 * Judge(evidence).excess
    fitted = fit(evidence, (right.at(found.values),))
    assert np.isclose(fitted.setting[0].values[0], 0.3, rtol=0.02)


@pytest.mark.parametrize("seconds", [3, 10])
def test_what_sets_in_between_a_step_that_does_nothing_and_one_that_drowns_all_is_found(seconds):
    """A force that is limited at 1/0.23, next to the largest that is commanded: the last trial of a bracket may do nothing. (It counted as
    silent then.)
    """
    evidence = recorded((named("limit", "right", inverse=0.23),), seconds=seconds)
    found = first_of(screen(evidence, [effect("limit", "right", number("inverse", upper=50.0, spread=0.05))]))
    assert not found.silent
    assert found.drop > 0.6 * Judge(evidence).excess


def test_one_loud_window_is_a_difference():
    """A push in one window of sixty, too little for a whole channel to differ by a quarter of its noise: its cart's channels are loud.
    Noise alone is in none.
    """

    def push(t, x, v):
        return np.array([0.3, 0.0]).reshape(2, 1, 1) * (abs(t - 10.25) < 0.25)

    quiet, pushed = recorded(seconds=30), recorded(seconds=30, extra=push)
    assert not len(loud_channels(Judge(quiet)))
    assert [pushed.channels[k].name for k in loud_channels(Judge(pushed))] == ["left position", "left speed"]


def test_what_promised_too_little_alone_is_compared_in_the_first_look():
    """One changes the first windows as two amplitudes of another do together, which was not run in all; a one-sided one cannot undo it."""
    one, other, against = (effect(kind, "left", *free) for kind, free in (
        ("tilt", [number("x", lower=-9, upper=9)]),
        ("bias", [number("a", lower=-9, upper=9), number("b", lower=-9, upper=9)]),
        ("drag", [number("c")]),
    ))  # fmt: skip
    axes = np.eye(3, dtype=np.float32)

    def signature(hypothesis, roughly, values, run=0.0):
        return Signature(hypothesis=hypothesis, values=values, drop=0.0, direction=np.full(4, run), one_sided=False, linear=None, tries=1,
                         silent=False, roughly=roughly)  # fmt: skip

    taken = signature(one, {"x": axes[0] + 2 * axes[1]}, {"x": 3.0}, run=1.0)
    likeness, values = alike(taken, signature(other, {"a": axes[0], "b": 4 * axes[1]}, {"a": 0.0, "b": 0.0}))
    assert likeness == pytest.approx(1.0)
    assert values == pytest.approx({"a": 3.0, "b": 1.5})
    assert alike(taken, signature(against, {"c": -axes[0]}, {"c": 0.0}))[0] == 0.0


@pytest.mark.parametrize("mass", [0.25, 0.4])
def test_a_number_that_is_far_too_large_is_found_though_trials_go_up(mass):
    """Accelerations go with 1/m: from a mass of 1.0 and a trial of 1.1 the linear promise points below the least mass, which is worse than
    none. Masses in between are tried, not those above.
    """
    evidence = recorded((named("mass", "left", mass=mass),), seconds=10)
    found = first_of(screen(evidence, [parameter("mass", "left", 1.0, 0.1)]))
    assert found.linear is not None
    assert found.linear[1]["mass"] == pytest.approx(0.1)
    assert found.drop > 0.6 * Judge(evidence).excess
    fitted = fit(evidence, (found.hypothesis.at(found.values),))
    assert np.isclose(fitted.setting[0].values[0], mass, rtol=0.02)


def test_what_changes_nothing_is_silent_and_last():
    evidence = recorded((named("coulomb", "left", force=0.4),), seconds=5)
    screened = screen(evidence, [h for h in catalogue() if h.kind in ("nothing", "coulomb")])
    assert [s.silent for s in screened.signatures] == [False] * 3 + [True] * 3
    assert all(s.drop == 0 and not s.direction.any() for s in screened.signatures[3:])


def test_all_targets_and_the_only_target_are_one_hypothesis():
    """'*' moves both carts; with the other one's hypothesis renamed to do the same, only the one with a name is kept."""
    evidence = recorded((named("coulomb", "*", force=0.4),), seconds=5)
    every = effect("coulomb", "*", number("force", spread=0.3))
    only = replace(every, target="both")
    kept = screen(evidence, [every, only]).signatures
    assert [s.hypothesis.target for s in kept] == ["both"]


def test_orders_and_phase_come_out_of_few_trials():
    evidence = recorded((named("ripple", "left", force=0.5, cycles=17, phase=1.0),), seconds=25)
    ripple = next(h for h in catalogue() if h.kind == "ripple" and h.target == "left")
    found = first_of(screen(evidence, [ripple]))
    assert found.values["cycles"] == 17
    assert np.isclose(found.values["phase"], 1.0, atol=0.1)
    assert np.isclose(found.values["force"], 0.5, rtol=0.15)


class Narrow:
    """Evidence in which a clock that is 3.017 % off explains all, one that is a part of a percent nearer or farther half of it, others
    nothing, or worse. asked : rates that were."""

    def __init__(self, evidence):
        self._evidence = evidence
        self.asked = []

    def __getattr__(self, name):
        return getattr(self._evidence, name)

    def residuals(self, settings):
        rates = [next((t.values[0] for t in setting if t.hypothesis.kind == "skew"), 0.0) for setting in settings]
        self.asked += rates
        bare = [tuple(t for t in setting if t.hypothesis.kind != "skew") for setting in settings]
        left = [
            1 + 0.1 * np.tanh(abs(rate) / 0.005) - 0.4 * np.exp(-abs(rate - 0.03) / 0.01) - 0.6 * np.exp(-(((rate - 0.03017) / 3e-4) ** 2))
            for rate in rates
        ]
        return np.array(left)[:, None] * self._evidence.residuals(bare)


def test_what_is_far_off_is_met_by_tries_that_come_closer():
    """Nothing near none tells of it: the first try promises nothing, as of a clock whose stamps are a turn of the motion off by the end."""
    evidence = Narrow(recorded((named("viscous", "left", coefficient=0.2),), seconds=10))
    skew = number("skew", lower=-0.5, upper=0.5, spread=1e-3)
    tries = tuple(v for size in (0.001, 0.005, 0.013, 0.022, 0.037, 0.06) for v in (size, -size))
    (far,) = screen(evidence, [effect("skew", "left", replace(skew, tries=tries))]).signatures
    assert far.values["skew"] == pytest.approx(0.03017, abs=2e-4)  # within the narrow one: a fit goes on from there
    assert far.drop > 0.8 * Judge(evidence).excess
    (near,) = screen(evidence, [effect("skew", "left", skew)]).signatures
    assert near.drop < 0.5 * far.drop


def test_what_is_far_off_is_tried_only_where_nothing_near_is_enough():
    """Tries of a clock that promises nothing near take many replays of their own: none where something else explains everything."""
    truth = named("viscous", "left", coefficient=0.2)
    evidence = Narrow(recorded((truth,), seconds=10))
    clock = effect("skew", "left", replace(number("skew", lower=0.0, upper=0.5, spread=1e-3), tries=(0.1, 0.2)))
    other = next(h for h in catalogue() if h.kind == "push" and h.target == "right")
    screen(evidence, [clock, truth.hypothesis])
    assert not {0.1, 0.2} & set(evidence.asked)
    screen(evidence, [clock, other])
    assert {0.1, 0.2} <= set(evidence.asked)


def test_a_number_that_the_recordings_do_not_tell_is_not_counted():
    """Of a law with a number that does nothing here, only the other counts."""
    truth = named("viscous", "left", coefficient=0.2)
    evidence = recorded((truth,), seconds=10)
    (free,) = truth.hypothesis.free
    wide = effect("viscous", "left", free, number("idle", lower=-1, spread=0.1))
    assert fit(evidence, (truth,)).told == pytest.approx(1.0, abs=0.01)
    assert fit(evidence, (wide.at({"coefficient": 0.2, "idle": 0.0}),)).told == pytest.approx(1.0, abs=0.01)


def test_given_places_are_tried_instead_of_own_guesses():
    push = next(h for h in catalogue() if h.kind == "push" and h.target == "left")
    tries = shape_tries(push, (1.0, 2.0), ({"start": 7.0},))
    assert tries == [{"start": 7.0, "duration": 0.3}]
    assert [t["start"] for t in shape_tries(push, (1.0, 2.0))] == [1.0, 2.0]


def test_intervals_hold_the_truth_as_often_as_they_say():
    """20 seeds x 2 numbers at 95 %: fewer than 34 of 40 has a probability below 0.5 %."""
    truth = (named("coulomb", "left", force=0.4), named("mass", "right", mass=1.1))
    start: Setting = tuple(term.hypothesis.at({n.name: n.absent + 0.5 * n.spread for n in term.hypothesis.free}) for term in truth)
    inside = 0
    for seed in range(20):
        evidence = recorded(truth, seconds=5, seed=seed)
        fitted = fit(evidence, start)
        numbers = [e for term in estimates(fitted, Judge(evidence).metric.edges) for e in term]
        inside += sum(e.low <= t.values[0] <= e.high for e, t in zip(numbers, truth, strict=True))
    assert inside >= 34


def test_a_fit_from_absent_numbers_arrives():
    evidence = recorded((named("viscous", "left", coefficient=0.2),), seconds=5)
    viscous = named("viscous", "left").hypothesis
    assert np.isclose(fit(evidence, (viscous.at(),)).setting[0].values[0], 0.2, rtol=0.05)


def test_bounds_are_kept_and_told():
    """Friction that drives: its amplitude stays at zero, and says that it is at its bound."""
    evidence = recorded(seconds=5, extra=lambda t, x, v: 0.3 * v)
    fitted = fit(evidence, (named("viscous", "left", coefficient=0.1),))
    (only,) = estimates(fitted, Judge(evidence).metric.edges)[0]
    assert (only.value, only.at_bound) == (0.0, "lower")


def test_an_end_never_pays():
    """A setting that a run does not survive costs more than the base, however bad that is."""
    evidence = recorded(seconds=5, extra=lambda t, x, v: 30.0 + 0 * x)
    judge = Judge(evidence)
    wild = effect("viscous", "left", number("coefficient", lower=-1e6, upper=1e6)).at({"coefficient": -1e5})
    (lost,) = judge.whitened([(wild,)])
    assert judge.chi2 > 1e4
    assert lost @ lost > judge.chi2


class Felt:
    """An accelerometer and nothing else: 2 kHz of a push of 3 from 0.9 to 1.1 s, with noise of 0.3, in windows of half a second."""

    NOISE, RISE = 0.3, 2e-4

    def __init__(self):
        self.time = np.arange(0, 2, 5e-4)
        self.channels = (
            Channel(name="felt", quantity="part.linear_acceleration", target="left", component="x", unit="m/s^2", role="observed"),
        )
        self.channel, self.window = np.zeros(len(self.time), dtype=int), (2 * self.time + 1e-9).astype(int)
        self.run, self.starts = np.zeros(4, dtype=int), np.arange(4) / 2
        self.stops = self.starts + 0.5
        self.sigma, self.start_gain = np.full(len(self.time), self.NOISE), np.zeros((len(self.time), 0))
        self.measured = self.shown(force=3.0, start=0.9, duration=0.2) + np.random.default_rng(1).normal(0, self.NOISE, len(self.time))

    def shown(self, force, start, duration):
        """The push, that sets in and ends within fractions of a millisecond."""
        return force * (np.clip((self.time - start) / self.RISE, 0, 1) - np.clip((self.time - start - duration) / self.RISE, 0, 1))

    def residuals(self, settings):
        """As of ``Evidence``."""
        return np.array([(self.measured - sum((self.shown(**t.numbers) for t in s), 0.0 * self.time)) / self.NOISE for s in settings])


@pytest.mark.parametrize(("start", "duration"), [(0.93, 0.17), (0.87, 0.23), (0.9, 0.15), (0.9, 0.25), (0.95, 0.2)])
def test_the_edges_of_a_push_are_found_from_either_side(start, duration):
    """What is felt before a push begins says nothing of one that begins later: with derivatives to one side alone it stays where it is.

    Both edges to a hundredth of a second, the force to the twentieth that this makes of the impulse.
    """
    push = effect(
        "push", "left", number("force", lower=-100), shape("start", 0.0, 0, 2, "time", 0.2), shape("duration", 0.2, 0.01, 1, "scale")
    )
    found = fit(Felt(), (push.at({"force": 2.5, "start": start, "duration": duration}),)).setting[0].numbers
    assert (found["start"], found["start"] + found["duration"]) == pytest.approx((0.9, 1.1), abs=0.01)
    assert found["force"] == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("late", [0.04, 0.1, 0.2])
def test_a_number_whose_derivative_is_not_known_yet_stays(late):
    """The first trial change of the duration is shorter than a step, so that nothing answers: what is usual must not pull it away."""
    evidence = recorded((named("push", "left", force=2.0, start=3.1, duration=0.8),), seconds=10)
    late_push = named("push", "left", force=1.5, start=3.1 + late, duration=0.8 - late)
    fitted = fit(evidence, (late_push,))
    assert fitted.setting[0].numbers == pytest.approx({"force": 2.0, "start": 3.1, "duration": 0.8}, rel=0.03)
