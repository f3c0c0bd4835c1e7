"""Diagnosis of bench points: planted laws are named or grouped, complete models left alone, soils calibrated before a law is missed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench_rigs import KINDS, LUGGED, SLIPS, WHEEL, made_rig
from effect_rigs import LUNAR_SOIL
from rille.diagnosis.answer.prove import NOT_CARRIED
from rille.diagnosis.bench.bench_calibration import calibrate, plain
from rille.diagnosis.bench.bench_diagnosis import diagnose_bench
from rille.diagnosis.bench.bench_evidence import gather_bench
from rille.diagnosis.bench.bench_hypotheses import bench_hypotheses, conditional, open_terms
from rille.diagnosis.bench.bench_search import PAIRED, Rival, _ahead, _pairs, excess
from rille.model import Effect

OTHER_SOIL = replace(
    LUNAR_SOIL, friction_angle=0.9 * LUNAR_SOIL.friction_angle, frictional_modulus=1.4 * LUNAR_SOIL.frictional_modulus
)  # what the database says of a soil that is LUNAR_SOIL: published values scatter more


def planted(kind, **numbers):
    """An effect on the wheel."""
    return (Effect(kind=kind, parameters=numbers),)


def diagnosed(*rigs, **more):
    """The answer."""
    return diagnose_bench(rigs, kinds=KINDS, **more)


def members(diagnosis):
    """Kinds of effects that the answer leaves open, the best first."""
    return [row.terms[-1].term.hypothesis.kind for row in diagnosis.ranked if row.group == 0]


@pytest.mark.parametrize(
    ("kind", "numbers", "wheel"),
    [
        ("slip_sinkage", {"slip_gain": 0.15}, WHEEL),
        ("grouser_thrust", {"efficiency": 1.0}, LUGGED),
        ("lateral_bulldozing", {"efficiency": 0.8}, WHEEL),
        ("bulldozing", {"efficiency": 0.8}, WHEEL),
        ("exit_angle", {"ratio_change": 0.4}, WHEEL),
        ("rolling_resistance", {"coefficient": 0.05}, WHEEL),
    ],
)
def test_a_law_on_a_known_soil_is_named_with_its_number(kind, numbers, wheel):
    """56 points, no number of the soil open: the value within 3 half intervals of 95 %, the gap closed to 10 %."""
    made = diagnosed(made_rig(planted=planted(kind, **numbers), wheel=wheel))
    assert made.verdict == "named"
    assert members(made) == [kind]
    (estimate,) = made.ranked[0].terms[0].estimates
    assert abs(estimate.value - next(iter(numbers.values()))) < 1.5 * (estimate.high - estimate.low)
    assert made.proof.gap_closed == pytest.approx(1, abs=0.1)
    assert [term.hypothesis.kind for term in made.setting] == [kind]


def test_exit_angle_and_the_soil_s_own_exit_ratio_are_one_group_on_an_open_soil():
    """The same law twice: an added ratio is the soil's. It is not told which."""
    made = diagnosed(made_rig(planted=planted("exit_angle", ratio_change=0.4), known=False))
    assert made.verdict in ("group", "parameter")
    assert {"exit_angle", "exit_sinkage_ratio"} & set(members(made))


def test_nothing_is_missing_where_nothing_is():
    """Three seeds of noise: silent."""
    for seed in range(3):
        assert diagnosed(made_rig(seed=seed, known=False)).verdict == "nothing_missing"


def test_a_wrong_soil_is_calibrated_and_no_law_is_named():
    """Friction angle 10 % low, stiffness 40 % high in the database: neither alone explains the curves, both reach the noise on points left
    out. As several numbers may stand for laws, though only one of them is told by itself.
    """
    made = diagnosed(made_rig(soil=OTHER_SOIL, known=False))
    assert made.verdict == "group"
    assert made.ranked[0].title.startswith("numbers of")
    assert made.ranked[0].probability < 0.5
    assert not [term for term in made.setting if term.hypothesis.cause == "effect"]
    assert made.proof.after < 1.2 < made.proof.before
    moved = {term.hypothesis.kind: term.numbers for term in made.setting}
    assert moved["friction_angle"]["friction_angle"] == pytest.approx(LUNAR_SOIL.friction_angle, rel=0.03)


def test_several_numbers_of_a_soil_may_stand_for_laws():
    """Three numbers wrong at once, none of which explains the curves alone: they are found, but laws could bend the curves alike, so that
    nothing is said of complete physics.
    """
    soil = replace(OTHER_SOIL, shear_modulus=0.7 * LUNAR_SOIL.shear_modulus)
    made = diagnosed(made_rig(soil=soil, known=False))
    assert made.verdict == "group"
    assert made.ranked[0].title.startswith("numbers of")
    assert made.ranked[0].probability < 0.5
    assert "laws" in made.groups[0].members[1]
    assert made.sentence.startswith("Numbers of the model are wrong, or something that these recordings cannot tell from it")
    moved = {term.hypothesis.kind: term.numbers for term in made.setting}
    assert moved["friction_angle"]["friction_angle"] == pytest.approx(LUNAR_SOIL.friction_angle, rel=0.03)


def test_a_law_is_named_on_top_of_a_wrong_soil():
    """Slip sinkage in a soil that the database has wrong: found beside the calibration, with its number (4 half intervals)."""
    rig = made_rig(planted=planted("slip_sinkage", slip_gain=0.2), soil=OTHER_SOIL, known=False, angles=(0.0,))
    wanted = ("slip_sinkage", "sinkage_transient", "exit_angle", "bulldozing", "bias")
    made = diagnosed(rig, chosen=lambda hypotheses: [h for h in hypotheses if h.kind in wanted])
    assert members(made)[0] == "slip_sinkage"
    assert made.verdict in ("named", "group")
    (estimate,) = made.ranked[0].terms[0].estimates
    assert abs(estimate.value - 0.2) < 2 * (estimate.high - estimate.low)


def test_speeds_and_widths_must_vary_to_be_told():
    """At one speed a law of speed is at best one of a group, and says so; at three it is named."""
    law = planted("rate_dependence", gain=0.5, reference_speed=0.1, exponent=0.5)
    one = diagnosed(made_rig(planted=law, speed=0.1, angles=(0.0,)))
    assert one.verdict == "group"
    assert "speed was the same" in " ".join(one.limits)
    rigs = [made_rig(f"v{k}", planted=law, speed=speed, seed=k, angles=(0.0,)) for k, speed in enumerate((0.02, 0.1, 0.5))]
    three = diagnosed(*rigs)
    assert three.verdict == "named"
    assert members(three) == ["rate_dependence"]
    assert conditional(rigs, KINDS) == {"plate_size": "width"}


def test_plate_size_shows_between_two_widths():
    """Two wheels on one soil: named, or in a group for the rate of one of them cannot be excluded at one speed."""
    law = planted("plate_size", exponent=0.6, reference_width=0.12)
    wide = made_rig("wide", planted=law, wheel=replace(WHEEL, width=0.2), target="wide", seed=2, angles=(0.0,))
    made = diagnosed(made_rig("narrow", planted=law, angles=(0.0,)), wide)
    assert made.verdict in ("named", "group")
    assert "plate_size" in members(made)


def test_plate_size_about_a_width_that_no_wheel_has():
    """A law about a plate that is narrower than either makes both wheels sink less: what is common to them is not a number of the soil.
    Its numbers within 3 half intervals.
    """
    law = planted("plate_size", exponent=0.4, reference_width=0.06)
    wide = made_rig("wide", planted=law, wheel=replace(WHEEL, width=0.2), target="wide", seed=2)
    made = diagnosed(made_rig("narrow", planted=law), wide)
    assert (made.verdict, members(made)) == ("named", ["plate_size"])
    found = {e.name: e for e in made.ranked[0].terms[0].estimates}
    for name, value in (("exponent", 0.4), ("reference_width", 0.06)):
        assert abs(found[name].value - value) < 1.5 * (found[name].high - found[name].low)


def test_a_sensor_that_lies_is_no_physics():
    """An offset of 2 N of the side force; and one mounted the other way round."""
    off = diagnosed(made_rig(shift={"side_force": lambda value: value + 2.0}))
    assert (off.verdict, members(off)) == ("sensor_fault", ["bias"])
    assert off.ranked[0].terms[0].estimates[0].value == pytest.approx(2.0, abs=0.3)
    turned = diagnosed(made_rig(shift={"side_force": lambda value: -value}))
    assert turned.verdict == "sensor_fault"
    assert members(turned)[0] == "wrong_sign"


def test_lugs_are_named_on_a_wheel_that_the_model_thinks_smooth():
    """The effect needs grousers; the answer says so and does not put it into a model that has none."""
    rig = made_rig(planted=planted("grouser_thrust", efficiency=1.0), wheel=LUGGED)
    made = diagnosed(replace(rig, shape=WHEEL))
    assert (made.verdict, members(made)) == ("named", ["grouser_thrust"])
    assert made.setting == ()
    assert "grousers" in " ".join(made.notes)


def test_an_unknown_zero_and_load_are_no_difference():
    """Sinkage from a mark 30 mm off and a load 8 % off, both declared: no law is named for them."""
    rig = made_rig(shift={"sinkage": lambda value: value - 0.03}, unknown_zero=["sinkage"], load=100.0, load_error=0.1, loads=(100.0,))
    evidence = gather_bench([rig])
    found = calibrate(evidence, open_terms([rig], [rig.soil.name]))
    assert np.sqrt(found.chi2 / len(evidence.window)) < 1.3
    made = diagnosed(rig)
    assert made.verdict in ("nothing_missing", "parameter")
    assert not [term for term in made.setting if term.hypothesis.cause == "effect"]


def test_evidence_counts_points_that_the_soil_does_not_carry():
    """A soil too soft: ENDED, not NaN; and a subset gives the same residuals as the whole."""
    rig = made_rig(known=False)
    evidence = gather_bench([rig])
    soft = open_terms([rig])
    terms = [t for t in soft if t.hypothesis.kind == "frictional_modulus"]
    drowned = tuple(t.hypothesis.at({"log_factor": -6.0}) for t in terms)
    residuals = evidence.residuals([(), drowned])
    assert np.isfinite(residuals).all()
    assert (residuals[1] == 10.0).any()
    some = np.array([0, 2])
    assert np.allclose(evidence.subset(some).residuals([()])[0], residuals[0][np.isin(evidence.window, some)])


def test_what_nothing_feels_is_no_hypothesis():
    """Scrub about the vertical and ripple have no part in steady points; soils come back as absolute numbers."""
    rig = made_rig(known=False)
    kinds = {hypothesis.kind for hypothesis in bench_hypotheses([rig], KINDS)}
    assert {"slip_sinkage", "bulldozing", "rolling_resistance", "bias", "scale"} <= kinds
    assert not {"skid_scrub", "coulomb_friction", "delay", "drift"} & kinds
    made = plain(open_terms([rig]))
    stiffness = next(term for term in made if term.hypothesis.kind == "frictional_modulus")
    assert stiffness.numbers["frictional_modulus"] == pytest.approx(LUNAR_SOIL.frictional_modulus)


def few_points(law, seed=1, **more):
    """Straight on at one load, two channels: what a single afternoon gives."""
    few = {"slips": (0.0, 0.1, 0.2, 0.3), "angles": (0.0,), "loads": (100.0,), "channels": ("drawbar_pull", "sinkage")}
    return made_rig(planted=law, seed=seed, **{**few, **more})


def test_sixteen_points_are_enough_to_see_a_law():
    """Two loads, four slips, twice each: sinkage off by 30 times its noise."""
    made = diagnosed(few_points(planted("slip_sinkage", slip_gain=0.8), slips=(0.1, 0.15, 0.2, 0.25), loads=(60.0, 180.0)))
    assert (made.verdict, members(made)) == ("named", ["slip_sinkage"])


def test_a_noise_of_few_repeats_is_no_reason_for_a_law():
    """Seven groups of two: the noise is known to 27 % and may come out at half of what it is. Twenty seeds, none missing: all silent."""
    verdicts = [diagnosed(few_points((), seed=seed, slips=SLIPS)).verdict for seed in range(20)]
    assert verdicts == ["nothing_missing"] * 20


def test_points_without_repeats_or_too_few_to_judge_are_said_to_be():
    """Three points, one of each: their noise is a guess and nothing can be told, though the law is plain at more of them."""
    made = diagnosed(few_points(planted("slip_sinkage", slip_gain=0.8), slips=(0.0, 0.1, 0.2), repeats=1))
    assert made.verdict == "cannot_know"
    assert "Nothing could be judged" in made.sentence
    assert not made.setting


def test_the_points_that_it_asks_for_tell_the_group_apart():
    """Bulldozing at one load looks like an offset of the force sensor. Points of the best sweep, recorded on the same rig, tell."""
    law = planted("bulldozing", efficiency=3.0)
    first = few_points(law)
    made = diagnosed(first)
    assert (made.verdict, set(members(made))) == ("group", {"bias", "bulldozing"})
    best = made.experiments[0]
    assert best.separation > 10 > 3 > best.now
    table = np.array([[float(cell) for cell in line.split(",")] for line in best.points.splitlines()[1:]])
    assert np.ptp(table[:, 1]) == np.ptp(table[:, 2]) == 0  # a sweep of load
    second = few_points(law, loads=tuple(table[:, 0]), slips=(table[0, 1],), seed=2, name="asked for")
    both = diagnosed(first, second)
    assert (both.verdict, members(both)) == ("named", ["bulldozing"])


def test_of_the_same_law_twice_no_points_tell():
    """An added exit ratio is the soil's own."""
    made = diagnosed(made_rig(planted=planted("exit_angle", ratio_change=0.4), known=False))
    (only,) = made.experiments
    assert only.separation < 1
    assert "no sweep" in only.sentence


def test_numbers_of_a_soil_that_the_model_lacks_are_told_but_not_put_there():
    """A soil of the manifest alone: there is no row that `rille apply` could write them to."""
    made = diagnosed(replace(made_rig(soil=OTHER_SOIL, known=False), own_soil=False))
    assert made.verdict == "group"
    assert made.setting == ()
    (note,) = (note for note in made.notes if "soil_values" in note)
    assert "friction_angle 0." in note


def test_what_cannot_be_known_moves_no_number():
    """Fewer points than the soil has numbers: a fit is made, and not offered to `rille apply`."""
    at_will = {"sinkage": lambda value: value + np.repeat([0.0, 0.02, -0.01, 0.015], 2)}  # of four slips, twice each
    made = diagnosed(few_points((), known=False, channels=("sinkage",), shift=at_will))
    assert made.verdict == "cannot_know"
    assert made.setting == ()


def ahead(one, other, windows=12):
    """``_ahead`` of two residuals (N,) in so many windows of equal length, all numbers independent, none of the soil open."""
    evidence = SimpleNamespace(labels=("",) * windows, window=np.repeat(np.arange(windows), len(one) // windows), noise_error=0.0)
    rivals = [SimpleNamespace(held_out=r, whole=SimpleNamespace(residual=r, setting=())) for r in (one, other)]
    return _ahead(evidence, *rivals, float(len(one)))


def test_what_leaves_only_noise_need_be_ahead_of_that_alone():
    """A misfit of 3 noises in 2 of 12 windows makes 0.5 * 240 * log(1 + 9/6) = 110 nats. Their scatter over windows is as large as they
    are: two of twelve say everything. The noise of 40 numbers that differ by 3 says sqrt(40 * 9) / 2.5 = 7.6.
    """
    noise = np.random.default_rng(1).standard_normal(240)
    noise /= np.sqrt(np.mean(noise**2))
    misfit = np.where(np.arange(240) < 40, 3.0, 0.0)
    gain, error = ahead(noise, noise + misfit)
    assert gain == pytest.approx(110, rel=0.1)
    assert error == pytest.approx(7.6, rel=0.4)
    gain, error = ahead(1.5 * noise, 1.5 * (noise + misfit))  # far from noise itself: windows are all that there is
    assert error > 0.4 * gain


def test_of_two_that_leave_less_than_the_noise_the_better_is_ahead():
    """Chi-squared of 240 numbers 10 % below their count, and at it: half of the difference is 12 nats, since the noise is known."""
    noise = np.random.default_rng(1).standard_normal(240)
    noise /= np.sqrt(np.mean(noise**2))
    gain, _ = ahead(np.sqrt(0.9) * noise, noise)
    assert gain == pytest.approx(12)


def test_pieces_of_an_answer_are_tried_two_at_a_time_whatever_did_well_before():
    """Two laws planted, and an answer of these and a third, found in later rounds: eight others did well in the first round, and fill the
    pool. The two alone are the best pair, so that the third can go.
    """
    laws = (*planted("slip_sinkage", slip_gain=0.15), *planted("rolling_resistance", coefficient=0.05))
    rig = made_rig(planted=laws, wheel=LUGGED, angles=(0.0,))
    evidence = gather_bench([rig])
    whole = calibrate(evidence, ())
    first = Rival(extra=(), whole=whole, held_out=whole.residual)
    terms = [h.at({n.name: n.absent + 0.1 * n.spread for n in h.free}) for h in bench_hypotheses([rig], KINDS) if h.free]
    own = [term for term in terms if term.hypothesis.kind in ("slip_sinkage", "rolling_resistance")]
    others = [term for term in terms if term not in own][:PAIRED]
    assert (len(own), len(others)) == (2, PAIRED)
    did_well = SimpleNamespace(rivals=[SimpleNamespace(extra=(term,)) for term in others])
    best = SimpleNamespace(extra=(others[0], *own))
    pairs = _pairs(evidence, first, [did_well], best, excess(evidence, whole.residual, 0), lambda share: None)
    assert {term.hypothesis.kind for term in pairs.rivals[0].extra} == {"slip_sinkage", "rolling_resistance"}


def test_each_of_two_pieces_may_be_another():
    """Lugs act like a larger friction of the soil: whichever came first, with the second piece beside it both are in the answer."""
    both = (Effect(kind="grouser_thrust", parameters={"efficiency": 0.5}), Effect(kind="sinkage_transient", parameters={"depth": 0.004}))
    made = diagnosed(made_rig(planted=both, wheel=LUGGED, known=False, angles=(0.0,), slips=(-0.1, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7)))
    answers = [{t.term.hypothesis.kind for t in row.terms} for row in made.ranked if row.group == 0]
    assert {"grouser_thrust", "sinkage_transient"} in answers


def test_what_leaves_much_of_what_was_held_out_is_not_named():
    """The law of the fitted points alone leaves nothing of a rig that has it, too; where another law acts there besides, a fifth."""
    law = planted("slip_sinkage", slip_gain=0.15)
    fitted = made_rig(planted=law)
    alike = diagnosed(fitted, held_out=[made_rig(planted=law, seed=5)])
    assert alike.verdict == "named"
    assert alike.proof.left == 0.0
    other = diagnosed(fitted, held_out=[made_rig(planted=(*law, *planted("lateral_bulldozing", efficiency=0.8)), seed=5)])
    assert other.verdict == "unknown"
    assert 0.15 < other.proof.left < 0.3
    assert other.ranked[0].probability < 0.5 < alike.ranked[0].probability
    assert NOT_CARRIED in other.notes
