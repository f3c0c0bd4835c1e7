"""Numbers of the model that are far off: no small step of them from where they are tells where they belong."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from machines import LUNAR_SOIL, cart, plane
from recorded import commanded, record
from rille import simulate, store
from rille.diagnosis.diagnose import Options, diagnose
from rille.diagnosis.inference.rivals import MOST, RIVALS, alternatives, rivals_of
from rille.model import Command, Scenario
from rille.model.recording import Channel
from toy_evidence import effect, number

EARTH = 9.80665
SENSORS = [
    *(Channel(name=f"p{c}", quantity="part.position", target="chassis", component=c, unit="m", noise=0.02, clock="fixes") for c in "xyz"),
    Channel(name="yaw", quantity="part.orientation", target="chassis", component="yaw", unit="rad", noise=0.01, clock="compass"),
    *(
        Channel(
            name=f"w{c}",
            quantity="part.angular_velocity",
            target="chassis",
            component=c,
            unit="rad/s",
            noise=5e-3,
            frame="body",
            clock="gyro",
        )
        for c in "xyz"
    ),
    *(
        Channel(name=f"{quantity} {wheel}", quantity=quantity, target=wheel, unit=unit, noise=noise, clock="wheels")
        for wheel in ("wheel_front_left", "wheel_front_right", "wheel_rear_right")
        for quantity, unit, noise in (("joint.velocity", "rad/s", 0.02), ("joint.effort", "N m", 0.1))
    ),
]
SLOW = {"fixes": 20, "compass": 5}  # samples of the others to one of theirs


def drive(name, speeds):
    """Left and right wheels at other speeds [rad/s] every four seconds."""
    commands = [
        Command(drive=f"wheel_{end}_{side}", time=4.0 * k, value=value)
        for k, pair in enumerate(speeds)
        for side, value in zip(("left", "right"), pair, strict=True)
        for end in ("front", "rear")
    ]
    return Scenario(
        name=name,
        duration=4.0 * len(speeds),
        step=2e-3,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        placement="on_terrain",
        settle_time=2,
        commands=tuple(commands),
    )


def test_a_soil_a_third_as_stiff_is_found_with_all_that_sinks_as_deep(make_model):
    """Wheels stand twice as deep; under starts of the base model every window begins with a jolt. Stiffness is found to 5 %, and the
    sinkage exponent that gives the same depth at this load stands beside it: no recording at one load tells them apart (Bekker 1969).
    """
    soft = replace(LUNAR_SOIL, frictional_modulus=LUNAR_SOIL.frictional_modulus / 3)
    drives = {"first": drive("first", [(2, 2), (3, 2), (1, 2)]), "second": drive("second", [(2, 3), (2, 1)])}
    runs, paths = [], {}
    for seed, (name, scenario) in enumerate(drives.items()):
        truth = make_model(cart(5.0, 0.15, 0.165), scenario, plane(0.03, soil=soft))
        run = record(truth, SENSORS, duration=scenario.duration, rate=20, seed=seed, jitter=2e-3)
        few = tuple(replace(c, time=c.time[:: SLOW.get(c.clock, 1)], value=c.value[:: SLOW.get(c.clock, 1)]) for c in run.channels)
        runs.append(commanded(replace(run, name=name, scenario=name, channels=few), scenario, "joint.velocity"))
        paths[name] = make_model(cart(5.0, 0.15, 0.165), scenario, plane(0.03))

    found = diagnose(
        lambda name: simulate.Replayer(paths[name or "first"]),
        runs[:1],
        runs[1:],
        kinds=store.effect_kinds(),
        options=Options(only=("parameter",)),
    )
    rows = {row.title: row for row in found.ranked}
    right = rows["frictional_modulus of lunar_sourcebook"]
    assert found.verdict in ("parameter", "group")
    assert right.group == 0
    assert right.terms[0].estimates[0].value == pytest.approx(soft.frictional_modulus, rel=0.05)
    assert rows["sinkage_exponent of lunar_sourcebook"].group == 0


def test_rivals_are_all_that_are_close_behind_the_best():
    """Chi-squared of the base is 100. Ten laws take 95 to 99 of it away, two take 50, and three others do what the piece does: the ten and
    the three are looked at again, no more than a dozen; where only one is close, as many as ever.
    """

    def fitted(kind, chi2):
        return SimpleNamespace(setting=(effect(kind, "left", number("size")).at(),), chi2=chi2)

    alike = [fitted(f"alike {k}", 70.0).setting[0] for k in range(3)]
    far = [fitted(f"far {k}", 50.0) for k in range(7)]
    close = [fitted(f"close {k}", 5.0 - 0.4 * k) for k in range(10)]
    many = rivals_of(alike, [], [*far, *close], 100.0)
    assert many.count == MOST
    assert [t.hypothesis.kind for t in many.terms[:MOST]] == [f"alike {k}" for k in range(3)] + [f"close {k}" for k in range(9, 0, -1)]
    assert len(many.terms) == 20  # the rest is kept for what is simpler at the same target
    few = rivals_of(alike, [], [*far, close[0]], 100.0)
    assert few.count == RIVALS
    taken = close[0].setting
    assert len(alternatives(taken, 0, [few])) == 1 + RIVALS
