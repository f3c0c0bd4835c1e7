"""A recording as a run: angles and quaternions that jump by a whole turn, delays, channels that never meet."""

from dataclasses import replace

import numpy as np
import pytest

from machines import cart
from rille.model import BodyTrace, InputRefused, Trace
from rille.model.quaternion import from_angles
from rille.model.recording import Channel, Recording
from rille.view import scene3d

TIME = np.linspace(0.0, 10.0, 101)
YAW = 0.7 * TIME  # more than one turn
ROVER = cart(5.0, 0.15, 0.165)
NOWHERE = np.full((len(TIME), 3), np.nan)


def beside():
    """A run that stands still."""
    still = np.zeros((len(TIME), 3))
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (len(TIME), 1))
    bodies = tuple(
        BodyTrace(name=b.name, position=still + b.frame, rotation=turned, velocity=NOWHERE, angular_velocity=NOWHERE) for b in ROVER.bodies
    )
    return Trace(run_id=1, scenario="s", status="done", message="", step=0.1, time=TIME, bodies=bodies, joints=(), wheels=(), events=())


def channel(quantity, component, value, target="chassis", **more):
    return Channel(
        name=f"{target}-{component}", quantity=quantity, component=component, target=target, unit="-", time=TIME, value=value, **more
    )


def heading_at(trace, time):
    """Heading of the chassis [rad], 0..2 pi, at a time."""
    k = int(np.argmin(np.abs(trace.time - time)))
    w, _, _, z = trace.bodies[0].rotation[k]
    return 2 * np.arctan2(z, w) % (2 * np.pi), trace.time[k]


@pytest.mark.parametrize("kind", ["angle", "quaternion"])
def test_a_heading_that_jumps_by_a_whole_turn_turns_on(kind):
    """Between two samples, one at +pi and one at -pi, the machine does not swing back through zero."""
    if kind == "angle":
        channels = [channel("part.orientation", "yaw", np.angle(np.exp(1j * YAW)))]
    else:
        turned = from_angles(np.column_stack([0 * YAW, 0 * YAW, YAW]))
        turned *= np.where(np.arange(len(TIME)) % 2, -1.0, 1.0)[:, None]  # every other one with the other sign
        channels = [channel("part.orientation", name, turned[:, k]) for k, name in enumerate("wxyz")]
    finer = Channel(
        name="x", quantity="part.position", component="x", target="chassis", unit="m", time=np.linspace(0, 10, 601), value=np.zeros(601)
    )
    trace, _ = scene3d.recorded_trace(Recording(name="r", channels=(*channels, finer)), ROVER, beside())
    assert len(trace.time) > 400  # between the samples, too
    for time in np.linspace(0.03, 9.9, 200):
        heading, at = heading_at(trace, time)
        assert abs(np.angle(np.exp(1j * (heading - 0.7 * at)))) < 1e-3


def test_a_channel_is_plotted_when_it_was_so_and_a_command_when_it_acts():
    late = channel("part.position", "x", TIME, delay=0.25)
    command = Channel(name="c", quantity="joint.velocity", target="j", unit="rad/s", role="command", delay=0.5, time=TIME, value=TIME)
    first, second = scene3d.extras(Recording(name="r", channels=(late, command)))
    assert first.time[0] == -0.25
    assert second.time[0] == 0.5


def test_channels_without_a_sample_say_nothing_and_such_that_never_meet_are_refused():
    empty = channel("part.position", "x", np.full(len(TIME), np.nan))
    with pytest.raises(InputRefused, match="says neither where chassis is"):
        scene3d.recorded_trace(Recording(name="r", channels=(empty,)), ROVER, beside())
    one = channel("part.position", "y", TIME)
    other = replace(channel("part.position", "z", TIME), time=TIME + 20)
    with pytest.raises(InputRefused, match="have no time in common"):
        scene3d.recorded_trace(Recording(name="r", channels=(one, other)), ROVER, beside())
