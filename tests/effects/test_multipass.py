"""A trailing wheel in the rut of a leading one meets packed soil."""

import numpy as np
import pytest
from rille._solver import Simulation
from scipy.integrate import quad

from effect_rigs import EARTH, LUNAR_SOIL
from machines import cart, plane
from rille.model import Command, Effect, Scenario

K_U, Z_GROWTH = 1e6, 5.03e8


def drive(make_model, *effects):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=15, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=3, commands=commands
    )
    simulation = Simulation(str(make_model(rover, scenario, plane(), effects)))
    simulation.settle()
    assert simulation.step(14000) == "running", simulation.message
    return dict(zip(simulation.wheel_names, simulation.wheels(), strict=True))


def packed_load(z, z_u, slip):
    """Adaptive quadrature of the vertical force on packed soil: reloading line up to z_u, virgin curve below. Returns N and T."""
    soil, r, b = LUNAR_SOIL, 0.15, 0.165
    k = soil.cohesive_modulus / b + soil.frictional_modulus
    k_u = max(K_U + Z_GROWTH * z_u, k)
    z_e = z_u - k * z_u / k_u
    entry = np.arccos(1 - (z - z_e) / r)
    peak = (soil.peak_angle_offset + soil.peak_angle_slip * slip) * entry
    leave = -np.arccos(1 - min(1.0, k * z_u / (k_u * (z - z_e))) * (z - z_e) / r)  # what was packed before comes back elastically

    def sigma(t):
        front = t if t >= peak else entry - (t - leave) / (peak - leave) * (entry - peak)
        d = r * (np.cos(front) - np.cos(entry)) + z_e
        return k * d if d > z_u else max(0.0, k_u * (d - z_e))

    def tau(t):
        j = r * ((entry - t) - (1 - slip) * (np.sin(entry) - np.sin(t)))
        return (soil.cohesion + sigma(t) * np.tan(soil.friction_angle)) * -np.expm1(-j / soil.shear_modulus)

    normal = quad(lambda t: sigma(t) * np.cos(t) + tau(t) * np.sin(t), leave, entry, points=[peak], limit=200)[0]
    torque = quad(tau, leave, entry, points=[peak], limit=200)[0]
    return r * b * normal, r * r * b * torque


def test_the_trailing_wheels_follow_the_packed_law(make_model):
    """Their load and torque equal an independent quadrature at the depth of the front wheels' rut.

    Columns of wheels(): see the binding. 1 %: the rut is stored per cell in single precision at a quarter of the wheel's width, and load
    is measured while the cart rocks by 1e-4.
    """
    wheels = drive(make_model, Effect(kind="multipass", parameters={"memory": 1.0, "unload_stiffness": K_U, "stiffness_growth": Z_GROWTH}))
    front, rear = wheels["wheel_front_left"], wheels["wheel_rear_left"]
    slip, sinkage, load, torque = rear[4], rear[6], rear[7], rear[10]
    normal, drive_torque = packed_load(sinkage, front[6], slip)
    assert normal == pytest.approx(load, rel=0.01)
    assert drive_torque == pytest.approx(torque, rel=0.01, abs=0.01)


def test_the_trailing_wheels_sink_little_beyond_the_rut_and_slip_less(make_model):
    base = drive(make_model)
    packed = drive(make_model, Effect(kind="multipass", parameters={"memory": 1.0}))
    assert abs(base["wheel_rear_left"][6] - base["wheel_front_left"][6]) < 2e-3
    assert 0 <= packed["wheel_rear_left"][6] - packed["wheel_front_left"][6] < 3e-3
    # Less soil is compacted by the second wheel, so that the cart as a whole needs less slip.
    assert packed["wheel_rear_left"][4] < base["wheel_rear_left"][4] - 0.01


def test_hardly_any_memory_is_virgin_soil(make_model):
    """The law is continuous: with a memory of 1e-7 of the rut the wheels stand and pull as on virgin soil. What comes back behind the wheel
    grows with the square root of the exit ratio, 1e-7 p(z)/(k_u z) here: 3e-4 of the contact's length.
    """
    base, hardly = drive(make_model), drive(make_model, Effect(kind="multipass", parameters={"memory": 1e-7}))
    for wheel in base:
        assert hardly[wheel][[4, 6, 7, 10]] == pytest.approx(base[wheel][[4, 6, 7, 10]], rel=2e-3, abs=1e-5)
