"""Wheels and bodies on rock: Coulomb friction, restitution, and pairs of materials, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import EARTH
from machines import LUNAR_SOIL, box, cart, plane
from rille.model import CollisionShape, Command, Material, MaterialPair, Obstacle, Pose, Rover, Scenario

WEIGHT = 4 * 5.0 * EARTH  # [N] of the cart


def bedrock(slope=0.0, friction=0.6, **more):
    """A slope along x that is as hard as rock."""
    return replace(plane(slope), pairs=(MaterialPair(response="rigid", soil="lunar_sourcebook", friction=friction),), **more)


def on_ground(duration=3.0, value=0.0, **more):
    """The cart, settled, its wheels commanded to one speed [rad/s]."""
    commands = tuple(Command(drive=d.name, time=0.0, value=value) for d in cart(5.0, 0.15, 0.165).drives)
    return Scenario(
        name="s",
        duration=duration,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        placement="on_terrain",
        settle_time=2,
        commands=commands,
        **more,
    )


def test_a_wheel_on_rock_rolls_without_slip_and_pulls_what_the_slope_asks(make_model):
    """10 degrees, friction 0.6: v = r w; the four torques are m g r sin(slope), for no work is lost where nothing slips."""
    slope = np.radians(10)
    simulation = Simulation(str(make_model(cart(5.0, 0.15, 0.165), on_ground(value=1.0), bedrock(np.tan(slope)))))
    simulation.settle()
    simulation.step(1000)
    start = simulation.bodies()[0, :3]
    assert simulation.step(2000) == "running"
    moved = np.linalg.norm(simulation.bodies()[0, :3] - start)
    assert moved == pytest.approx(0.15 * 1.0 * 2.0, rel=1e-3)  # creep of the regularised contact
    wheels = simulation.wheels()
    assert wheels[:, 10].sum() == pytest.approx(WEIGHT * 0.15 * np.sin(slope), rel=1e-3)
    assert wheels[:, 7].sum() == pytest.approx(WEIGHT * np.cos(slope), rel=1e-3)
    assert simulation.energy_balance()["soil_loss"] == 0


@pytest.mark.parametrize(("degrees", "slides"), [(25.0, False), (35.0, True)])
def test_locked_wheels_hold_below_the_friction_angle_and_slide_beyond(make_model, degrees, slides):
    """Friction 0.6 holds up to 31 degrees; beyond, a = g (sin - 0.6 cos)."""
    slope = np.radians(degrees)
    simulation = Simulation(str(make_model(cart(5.0, 0.15, 0.165), on_ground(), bedrock(np.tan(slope)))))
    simulation.settle()
    before = simulation.bodies()[0, 7:10]
    start = simulation.bodies()[0, :3]
    simulation.step(500)
    gained = np.linalg.norm(simulation.bodies()[0, 7:10]) - np.linalg.norm(before)
    if slides:
        assert gained / 0.5 == pytest.approx(EARTH * (np.sin(slope) - 0.6 * np.cos(slope)), rel=0.01)
    else:
        assert np.linalg.norm(simulation.bodies()[0, :3] - start) < 1e-5


def dropped(make_model, restitution=0.0, friction=0.5, height=0.5, materials=True):
    """A ball above a flat rock; both of named materials."""
    shape = CollisionShape(body="ball", kind="sphere", pose=Pose(), size=(0.1,), material="steel")
    ball = Rover(
        bodies=(box("ball", 2.0, (0, 0, 0), (0.1, 0.1, 0.1)),),
        collision_shapes=(shape,),
        materials=(Material(name="steel", density=7800.0),),
    )
    rock = Obstacle(name="slab", kind="box", pose=Pose(position=(0, 0, 0.0)), size=(2.0, 2.0, 0.4), material="basalt")
    pairs = (
        MaterialPair(response="bekker_wong", soil="lunar_sourcebook"),
        MaterialPair(response="rigid", friction=0.5, restitution=0.0),
        MaterialPair(response="rigid", material="basalt", other_material="steel", friction=friction, restitution=restitution),
    )
    terrain = replace(
        plane(), obstacles=(rock,), pairs=pairs if materials else pairs[:2], materials=(Material(name="basalt", density=2900.0),)
    )
    start = Pose(position=(0, 0, 0.2 + 0.1 + height))
    scenario = Scenario(name="s", duration=3, gravity=(0, 0, -EARTH), terrain="plane", start=start)
    return Simulation(str(make_model(ball, scenario, terrain)))


def peak_after_bounce(simulation):
    """Largest height of the ball's lowest point over the rock after the first contact."""
    heights = simulation.sample(1500, 1, [("part.position", "ball", 2)])[:, 0] - 0.3
    first = int(np.argmax(np.diff(heights) > -1e-6))  # it falls until here
    assert 0.3 < 1e-3 * first < 0.34  # sqrt(2 h / g) = 0.319 s
    return heights[first:].max()


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_a_ball_bounces_to_the_square_of_its_restitution(make_model, restitution):
    """h1 = e^2 h0. A step of 1 ms at 3 m/s places the impact to 3 mm of 500: 2 %."""
    assert peak_after_bounce(dropped(make_model, restitution)) == pytest.approx(restitution**2 * 0.5, abs=0.02 * 0.5)


def test_the_pair_of_the_two_materials_counts_and_else_that_of_any(make_model):
    assert peak_after_bounce(dropped(make_model, 0.8)) > 0.25
    assert peak_after_bounce(dropped(make_model, 0.8, materials=False)) < 0.01


def test_what_a_ball_loses_on_a_rock_is_booked(make_model):
    """All of m g h when it does not bounce, to 1 %."""
    simulation = dropped(make_model)
    simulation.step(2000)
    energy = simulation.energy_balance()
    assert energy["contact_loss"] == pytest.approx(2.0 * EARTH * 0.5, rel=0.01)
    assert abs(energy["residual"]) < 0.01 * energy["contact_loss"]


def test_soil_and_bedrock_side_by_side(make_model):
    """A patch of rock in the soil: wheels sink on the one and not on the other."""
    from rille.model import SoilPatch

    rock = replace(LUNAR_SOIL, name="rock")
    east = SoilPatch(name="outcrop", soil="rock", polygon=((0.0, -8.0), (12.0, -8.0), (12.0, 8.0), (0.0, 8.0)))
    pairs = (*plane().pairs, MaterialPair(response="rigid", soil="rock", friction=0.6))
    terrain = replace(plane(), soils=(LUNAR_SOIL, rock), patches=(east,), pairs=pairs)
    simulation = Simulation(str(make_model(cart(5.0, 0.15, 0.165), on_ground(), terrain)))
    simulation.settle()
    sinkage = dict(zip(simulation.wheel_names, simulation.wheels()[:, 6], strict=True))
    assert sinkage["wheel_front_left"] < 1e-3 < 5e-3 < sinkage["wheel_rear_left"]


def test_friction_opposes_the_sliding_whichever_way_it_goes(make_model):
    """Skid steering: four wheels at (+-L/2, +-B/2), equal loads, right ones faster by dw. Each force opposes its sliding, so that the
    moments F_y L/2 = F_x B/2 ask for s_x / s_y = L/B of the sliding speeds, with s_y = w L/2: the yaw rate is w = r dw / (B + L^2/B)
    at every heading. Loads are equal only to a per cent or two while it turns: 2 %."""
    machine = cart(5.0, 0.15, 0.165)
    scenario = on_ground(duration=6.0)
    commands = tuple(Command(drive=d.name, time=0.0, value=3.0 if "right" in d.name else 1.0) for d in machine.drives)
    simulation = Simulation(str(make_model(machine, replace(scenario, commands=commands), bedrock())))
    simulation.settle()
    simulation.step(1000)
    rates = []
    for _ in range(20):
        assert simulation.step(200) == "running"
        rates.append(simulation.bodies()[0, 12])
    place = {w.name: w.center for w in machine.wheels}
    long = place["wheel_front_left"][0] - place["wheel_rear_left"][0]
    broad = place["wheel_front_left"][1] - place["wheel_front_right"][1]
    assert np.ptp(rates) < 0.01 * np.mean(rates)
    assert np.mean(rates) == pytest.approx(0.15 * 2.0 / (broad + long**2 / broad), rel=0.02)
