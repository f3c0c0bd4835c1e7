"""A channel that stands still while others move: no evidence of the machine, and the diagnosis where nothing else differs."""

from dataclasses import replace

import numpy as np
import pytest

from made_diagnosis import made_diagnosis
from rille import store
from rille.diagnosis.evidence.held_out import Parts
from rille.diagnosis.stuck import blamed, without_stuck
from rille.model.recording import Channel, GateFinding, Recording
from rille.recording.gate import gate

KINDS = store.effect_kinds()
TIME = np.arange(0, 10, 0.01)


def recording(name, phase, limit=np.inf, held=(), findings=True):
    """A swing of 1 rad about an axis: position (cut off at ``limit``, held still within ``held`` [s]) and speed, examined by the gate."""
    rng = np.random.default_rng(int(10 * phase))
    position = np.sin(2 * TIME + phase) + 1e-3 * rng.standard_normal(len(TIME))
    for begin, end in held:
        inside = (begin <= TIME) & (end > TIME)
        position[inside] = position[np.argmax(inside)]
    speed = 2 * np.cos(2 * TIME + phase) + 1e-2 * rng.standard_normal(len(TIME))
    about = {"target": "shoulder", "clock": "time", "time": TIME}
    channels = (
        Channel(name="angle", quantity="joint.position", unit="rad", noise=1e-3, value=np.clip(position, -limit, limit), **about),
        Channel(name="rate", quantity="joint.velocity", unit="rad/s", noise=1e-2, value=speed, **about),
    )
    made = Recording(name=name, channels=channels)
    return replace(made, findings=gate([made])[0]) if findings else made


def parts(*recordings):
    return Parts(training=tuple(recordings[:-1]), held_out=(recordings[-1],), how="")


def test_samples_at_the_end_of_a_range_are_set_aside_in_all_recordings():
    """The gate sees flat tops in recordings with long ones; where only a few samples touch the same end they go, too."""
    made = parts(recording("one", 0.0, limit=0.8), recording("two", 1.0, limit=0.8))
    cleaned, (stuck,) = without_stuck(made)
    assert stuck.channel == "angle"
    assert stuck.is_limit
    assert abs(stuck.value) == 0.8
    assert stuck.witnesses == ("rate",)
    for before, after in zip((*made.training, *made.held_out), (*cleaned.training, *cleaned.held_out), strict=True):
        assert np.max(np.abs(after.channel("angle").value)) < 0.8
        assert len(after.channel("angle").value) == np.count_nonzero(np.abs(before.channel("angle").value) < 0.8)
        assert np.array_equal(after.channel("rate").value, before.channel("rate").value)
        assert "angle" not in after.flagged("stuck", "saturation")


def test_a_stretch_within_the_range_is_set_aside_alone():
    made = parts(recording("one", 0.0, held=[(3.0, 3.5)]), recording("two", 1.0))
    cleaned, (stuck,) = without_stuck(made)
    assert not stuck.is_limit
    assert len(cleaned.training[0].channel("angle").value) == pytest.approx(len(TIME) - 50, abs=1)
    assert cleaned.held_out == made.held_out


def test_what_is_stuck_for_most_of_a_recording_takes_no_part():
    """As before: the finding stays, and with it the channel stays out."""
    made = parts(recording("one", 0.0, held=[(1.0, 8.0)]), recording("two", 1.0))
    cleaned, (stuck,) = without_stuck(made)
    assert stuck.samples > 0.5 * len(TIME)
    assert "angle" in cleaned.training[0].flagged("stuck")


def test_sound_channels_stay_as_they_are():
    made = parts(recording("one", 0.0), recording("two", 1.0))
    cleaned, stuck = without_stuck(made)
    assert cleaned == made
    assert stuck == ()


def test_the_fault_is_the_diagnosis_where_nothing_else_differs():
    """The catalogue's number of a range of 0.8 rad is 1.25 1/rad."""
    _, stuck = without_stuck(parts(recording("one", 0.0, limit=0.8), recording("two", 1.0, limit=0.8)))
    nothing = replace(made_diagnosis(), verdict="nothing_missing", ranked=(), groups=(), setting=(), proof=None)
    told = blamed(nothing, stuck, KINDS)
    assert told.verdict == "sensor_fault"
    assert told.ranked[0].title == "saturation of angle"
    (estimate,) = told.ranked[0].terms[0].estimates
    assert (estimate.name, estimate.unit, estimate.value) == ("inverse_range", "1/rad", pytest.approx(1.25, rel=1e-6))
    assert "while 'rate' moved" in told.sentence


@pytest.mark.parametrize(
    ("verdict", "differing", "blames"),
    [
        ("cannot_know", ("angle",), True),
        ("cannot_know", (), True),
        ("cannot_know", None, False),  # the comparison says nothing of the model
        ("cannot_know", ("angle", "rate"), False),  # something else differs, too
        ("unknown", ("angle",), False),  # a law without a name may explain it
    ],
)
def test_the_fault_is_the_diagnosis_where_only_what_is_left_of_the_channel_differs(verdict, differing, blames):
    _, stuck = without_stuck(parts(recording("one", 0.0, limit=0.8), recording("two", 1.0, limit=0.8)))
    told = blamed(replace(made_diagnosis(), verdict=verdict), stuck, KINDS, differing)
    assert told.verdict == ("sensor_fault" if blames else verdict)
    if blames:
        assert [row.title for row in told.ranked] == ["saturation of angle"]
        assert told.groups == told.experiments == ()


def test_beside_another_answer_it_is_a_note():
    _, stuck = without_stuck(parts(recording("one", 0.0, limit=0.8), recording("two", 1.0, limit=0.8)))
    other = made_diagnosis()
    told = blamed(other, stuck, KINDS)
    assert (told.verdict, told.ranked) == (other.verdict, other.ranked)
    assert "angle" in told.notes[-1]


def test_without_a_witness_nobody_is_blamed():
    """A value that is held may be true where no other channel tells."""
    held = GateFinding(code="stuck", severity="warning", channel="angle", detail={"value": 0.3, "intervals": [[3.0, 3.5]]}, message="")
    one = replace(recording("one", 0.0, held=[(3.0, 3.5)], findings=False), findings=(held,))
    _, stuck = without_stuck(parts(one, recording("two", 1.0)))
    nothing = replace(made_diagnosis(), verdict="nothing_missing", ranked=(), groups=(), setting=(), proof=None)
    assert blamed(nothing, stuck, KINDS).verdict == "nothing_missing"


def test_a_finding_that_tells_no_stretch_keeps_the_channel_out():
    """Which samples are wrong is not known: none of them is believed."""
    held = GateFinding(code="stuck", severity="warning", channel="angle", message="")
    made = parts(replace(recording("one", 0.0, findings=False), findings=(held,)), recording("two", 1.0))
    cleaned, stuck = without_stuck(made)
    assert cleaned == made
    assert stuck == ()


def test_a_channel_may_contradict_itself():
    """A short top that no other channel is quick enough to contradict is blamed where the gate says that chance does not make it."""
    sure = GateFinding(
        code="saturation", severity="warning", channel="angle", message="", detail={"value": 0.8, "witnesses": [], "sure": True}
    )
    one = replace(recording("one", 0.0, limit=0.8, findings=False), findings=(sure,))
    _, found = without_stuck(parts(one, recording("two", 1.0, limit=0.8, findings=False)))
    answer = blamed(made_diagnosis(verdict="nothing_missing"), found, KINDS)
    assert answer.verdict == "sensor_fault"
    unsure = replace(one, findings=(replace(sure, detail={"value": 0.8, "witnesses": []}),))
    _, found = without_stuck(parts(unsure, recording("two", 1.0, limit=0.8, findings=False)))
    assert blamed(made_diagnosis(verdict="nothing_missing"), found, KINDS).verdict == "nothing_missing"
