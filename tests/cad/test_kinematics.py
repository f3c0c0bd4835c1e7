"""Forward kinematics: against closed forms, against the solver's own, and its refusals."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from machines import chain, free_arm
from random_machines import random_machine
from rille.model import Differential, InitialJointState, InputRefused, Joint, Scenario
from rille.model.kinematics import forward_kinematics, joint_motion, movable_joints, parents_first, position_sign

ROUNDING = 1e-12  # lengths of metres, chains of eight bodies: tens of roundings of 1e-16


def rotation(q):
    """Rotation matrix of a quaternion (w, x, y, z)."""
    w, v = q[0], np.asarray(q[1:])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def test_two_hanging_rods():
    """x = l1 sin a + ..., by hand: the rods hang along -z, the hinges turn about +y, so a positive angle swings to -x."""
    rover = chain([0.5, 0.4], [1.0, 0.7])
    rover = replace(rover, bodies=tuple(replace(b, frame=j.point) for b, j in zip(rover.bodies, rover.joints, strict=True)))
    poses = forward_kinematics(rover, {"hinge1": 0.3, "hinge2": -0.8})
    assert poses["link1"][:3, 3] == pytest.approx([0, 0, 0], abs=ROUNDING)
    assert poses["link2"][:3, 3] == pytest.approx([-0.5 * np.sin(0.3), 0, -0.5 * np.cos(0.3)], abs=ROUNDING)
    assert poses["link2"][:3, 0] == pytest.approx([np.cos(-0.5), 0, -np.sin(-0.5)], abs=ROUNDING)


def test_the_zero_pose_is_that_of_the_assembly():
    rover = random_machine(1)
    for body in rover.bodies:
        pose = forward_kinematics(rover, {})[body.name]
        assert np.array_equal(pose[:3, :3], np.eye(3))
        assert pose[:3, 3] == pytest.approx(body.frame, abs=ROUNDING)


@pytest.mark.parametrize("held", [False, True])
def test_the_solver_places_bodies_alike(make_model, held):
    """The solver's kinematics (C++) share nothing with these but the convention."""
    rng = np.random.default_rng(5)
    rover = replace(random_machine(3, held=held), effects=(), drives=(), collision_shapes=())
    rover = replace(rover, joints=tuple(replace(joint, limit=None) for joint in rover.joints))
    for _ in range(5):
        positions = {joint.name: float(rng.uniform(-3, 3)) for joint in movable_joints(rover)}
        states = tuple(InitialJointState(joint=name, position=value) for name, value in positions.items())
        bodies = Simulation(str(make_model(rover, Scenario(name="pose", duration=1, initial_states=states)))).bodies()
        poses = forward_kinematics(rover, positions)
        free = None if held else rover.bodies[0]
        for state, body in zip(bodies, rover.bodies, strict=True):
            pose = poses[body.name]
            offset = np.zeros(3) if free is None else np.asarray(free.frame)  # a free root stands where the scenario puts its frame
            assert state[:3] == pytest.approx(pose[:3, 3] - offset, abs=ROUNDING)
            assert rotation(state[3:7]) == pytest.approx(pose[:3, :3], abs=ROUNDING)


def test_tiny_angles_are_not_lost():
    """1 - cos q is 0 in floating point below 1e-8; the displacement -q^2/2 along the lever is not."""
    joint = Joint(name="j", kind="hinge", parent=None, child="b", point=(0, 0, 0), axis=(0, 0, 1))
    moved = joint_motion(joint, 1e-9) @ np.array([1.0, 0, 0, 1])
    assert moved[1] == pytest.approx(1e-9, rel=1e-15)
    turned = joint_motion(joint, 1e-9)[:3, :3]
    assert turned @ turned.T == pytest.approx(np.eye(3), abs=1e-16)


def test_joints_are_ordered_from_the_root():
    rover = random_machine(7, n_bodies=20)
    seen = set()
    for body, joint in parents_first(rover):
        assert joint is None or joint.parent is None or joint.parent in seen
        seen.add(body.name)
    assert len(seen) == 20


@pytest.mark.parametrize(("axis_b", "sign"), [((0, 0.6, 0.8), 1), ((0, -0.6, -0.8), -1)])
def test_sign_of_a_differential(axis_b, sign):
    rover = free_arm()
    shoulder = rover.joints[0]
    other = replace(shoulder, name="twin", child="lower", axis=axis_b)
    rover = replace(rover, joints=(shoulder, other))
    assert position_sign(rover, Differential(name="d", carrier="base", joint_a="shoulder", joint_b="twin")) == sign


def test_what_is_refused():
    rover = free_arm()
    shoulder, elbow = rover.joints
    with pytest.raises(InputRefused, match=r"'sholder'.*did you mean 'shoulder'"):
        forward_kinematics(rover, {"sholder": 1.0})
    with pytest.raises(InputRefused, match="is nan; give a finite value"):
        forward_kinematics(rover, {"shoulder": float("nan")})
    with pytest.raises(InputRefused, match="child of joints 'shoulder' and 'elbow'"):
        forward_kinematics(replace(rover, joints=(shoulder, replace(elbow, parent="base", child="upper"))), {})
    with pytest.raises(InputRefused, match="circle of joints"):
        forward_kinematics(replace(rover, joints=(replace(shoulder, parent="lower"), elbow)), {})
    with pytest.raises(InputRefused, match="names the body 'hand', which does not exist"):
        forward_kinematics(replace(rover, joints=(shoulder, replace(elbow, child="hand"))), {})
    crooked = replace(rover, joints=(shoulder, replace(shoulder, name="twin", child="lower", axis=(1, 0, 0))))
    with pytest.raises(InputRefused, match="parallel hinges, but 'shoulder' and 'twin' stand at"):
        position_sign(crooked, Differential(name="d", carrier="base", joint_a="shoulder", joint_b="twin"))
    with pytest.raises(InputRefused, match="'elbow' to be a hinge on its carrier 'base'"):
        position_sign(rover, Differential(name="d", carrier="base", joint_a="shoulder", joint_b="elbow"))
