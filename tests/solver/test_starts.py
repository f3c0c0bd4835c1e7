"""Joints start where the scenario says, and what is coupled to them, or closes a loop with them, starts where it must."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import free_space
from machines import box
from rille.model import Differential, Gear, InitialJointState, InputRefused, Joint, LoopClosure, Rover, StateChange

GEARS = (Gear(name="first", joint_a="j0", joint_b="j1", ratio=2.0), Gear(name="second", joint_a="j2", joint_b="j1", ratio=-4.0))


def discs(**coupled):
    """Four discs on parallel hinges at the world."""
    bodies = tuple(box(f"b{k}", 1.0, (0, k, 0), (0.3, 0.1, 0.3)) for k in range(4))
    joints = tuple(Joint(name=f"j{k}", kind="hinge", parent=None, child=f"b{k}", point=(0, k, 0), axis=(0, 1, 0)) for k in range(4))
    return Rover(bodies=bodies, joints=joints, **coupled)


def four_bar(crank=0.2, coupler=0.5, rocker=0.4, ground=0.45):
    """A crank at the origin, a coupler, a rocker; drawn with the crank upright, in the plane y = 0."""
    top = np.array([0, 0, crank])
    reach = np.array([ground, 0, 0]) - top
    d = np.linalg.norm(reach)
    along = (coupler**2 - rocker**2 + d**2) / (2 * d)
    pin = top + along * reach / d + np.sqrt(coupler**2 - along**2) * np.array([-reach[2], 0, reach[0]]) / d
    points = (np.zeros(3), top, pin, np.array([ground, 0, 0]))
    bodies = tuple(
        box(name, 1.0, tuple((a + b) / 2), (0.05, 0.05, 0.05))
        for name, a, b in zip(("crank", "coupler", "rocker"), points, points[1:], strict=False)
    )
    pins = (("a", None, "crank", points[0]), ("b", "crank", "coupler", points[1]), ("c", None, "rocker", points[3]))
    joints = tuple(Joint(name=n, kind="hinge", parent=p, child=c, point=tuple(at), axis=(0, 1, 0)) for n, p, c, at in pins)
    return Rover(
        bodies=bodies, joints=joints, loop_closures=(LoopClosure(name="pin", body_a="coupler", body_b="rocker", point=tuple(pin)),)
    )


def started(make_model, rover, *states, **more):
    starts = tuple(InitialJointState(joint=j, position=q, velocity=v) for j, q, v in states)
    return Simulation(str(make_model(rover, free_space(initial_states=starts, **more))))


def test_what_is_geared_starts_along(make_model):
    """q1 = 2 q0 = -4 q2, to rounding, and nothing jumps: after a step of 1 ms all have moved by their speed."""
    simulation = started(make_model, discs(gears=GEARS), ("j0", 1.0, 0.3))
    wanted = np.array([1.0, 2.0, -0.5, 0.0])
    assert simulation.joints()[:, 0] == pytest.approx(wanted, abs=1e-15)
    simulation.step(1)
    assert simulation.joints()[:, 0] == pytest.approx(wanted * (1 + 0.3e-3), abs=1e-12)
    assert simulation.joints()[:, 1] == pytest.approx(0.3 * wanted, abs=1e-9)


def test_a_differential_starts_along(make_model):
    rover = discs()
    carried = tuple(replace(joint, parent="b0" if joint.name in ("j1", "j2") else None) for joint in rover.joints)
    rover = replace(rover, joints=carried, differentials=(Differential(name="d", carrier="b0", joint_a="j1", joint_b="j2"),))
    simulation = started(make_model, rover, ("j2", 0.2, 0.0))
    assert simulation.joints()[:, 0] == pytest.approx([0, -0.2, 0.2, 0], abs=1e-15)


def test_a_change_goes_through_a_chain_of_gears(make_model):
    """Without this the couplings would tear the discs to a compromise, at hundreds of rad/s."""
    change = StateChange(time=0.01, quantity="joint.position", target="j2", values=(0.5,))
    simulation = started(make_model, discs(gears=GEARS), changes=(change,))
    simulation.step(15)
    assert simulation.joints()[:, 0] == pytest.approx([-1.0, -2.0, 0.5, 0], abs=1e-12)
    assert np.abs(simulation.joints()[:, 1]).max() < 1e-9


def test_starts_that_contradict_a_gear_are_refused(make_model):
    with pytest.raises(InputRefused, match=r"starts joint 'j0' at 1 .* joint 'j1' at 1.5 .*'j1' moves 2 times as far"):
        started(make_model, discs(gears=GEARS), ("j0", 1.0, 0.0), ("j1", 1.5, 0.0))
    assert started(make_model, discs(gears=GEARS), ("j0", 1.0, 0.0), ("j1", 2.0, 0.0)).joints()[2, 0] == pytest.approx(-0.5)


@pytest.mark.parametrize("angle", [0.4, -0.9, 2.5])
def test_a_loop_closes_about_the_crank(make_model, angle):
    """Grashof (0.2 + 0.5 <= 0.4 + 0.45), so that the crank can turn around. Closed to 1e-9 m; and the speeds are those of the
    closed loop: a step of 0.1 ms moves every joint by its speed, to first order in the step.
    """
    simulation = started(make_model, four_bar(), ("a", angle, 2.0), step=1e-4)
    before = simulation.joints()[:, :2].copy()
    assert before[0] == pytest.approx([angle, 2.0], abs=1e-15)
    assert np.abs(before[1:]).min() > 0.01
    assert simulation.closure_error() < 1e-9
    simulation.step(1)
    moved = (simulation.joints()[:, 0] - before[:, 0]) / 1e-4
    assert moved == pytest.approx(before[:, 1], rel=5e-3, abs=5e-3)


def test_a_joint_of_a_loop_that_is_put_elsewhere_takes_the_loop_along(make_model):
    change = StateChange(time=0.01, quantity="joint.position", target="a", values=(1.0,))
    simulation = started(make_model, four_bar(), changes=(change,))
    simulation.step(15)
    assert simulation.closure_error() < 1e-6
    assert simulation.joints()[0, 0] == pytest.approx(1.0, abs=1e-6)


def test_a_loop_that_cannot_close_is_refused(make_model):
    with pytest.raises(InputRefused, match="leave a loop open by"):
        started(make_model, four_bar(), ("a", 0.4, 0.0), ("b", 0.4, 0.0), ("c", 0.4, 0.0))
    rover = four_bar(crank=0.4, coupler=0.3, rocker=0.3, ground=0.4)  # the crank cannot point away from the rocker
    with pytest.raises(InputRefused, match="leave a loop open by"):
        started(make_model, rover, ("a", -1.5, 0.0))
