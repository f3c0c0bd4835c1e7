"""Scenes, states, pages and animations show what the run says."""

import base64
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pygltflib as gl
import pytest

from effect_rigs import EARTH
from machines import cart, chain, plane
from rille import simulate, store
from rille.model import Command, InputRefused, Scenario
from rille.model.grid import bilinear
from rille.model.recording import Channel, Recording
from rille.model.rotation import matrix_of
from rille.view import scene3d
from rille.view.scene3d.reading import things
from rille.view.scene3d.ruts import Pressed
from rille.view.scene3d.tracks import WHEEL

HOSTILE = "</script><img src=x onerror=alert(1)>"
SINGLE = 1e-5  # [m] numbers of a page are float32, of a few metres around the origin: 2e-7 relative


@pytest.fixture
def shown(make_model):
    """Rover, terrain and run of a cart that drives up a slope."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=2, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    terrain = plane(0.1, 0.05)
    path = make_model(rover, scenario, terrain)
    simulate.run(path)
    trace = store.read_trace(path)
    view = scene3d.view_of(terrain, np.concatenate([b.position for b in trace.bodies]))
    return rover, terrain, trace, view


def test_bodies_stand_where_the_model_says_and_ground_has_the_terrains_heights(shown):
    rover, terrain, _, view = shown
    scene = scene3d.scene_glb(rover, terrain, view)
    found = things(scene)
    nodes = {node.name: node for node in gl.GLTF2.load_from_bytes(scene).nodes}
    for body in rover.bodies:
        assert np.array(nodes[body.name].translation) + view.origin == pytest.approx(np.array(body.frame))
    names = [thing.extras["name"] for thing in found if thing.extras["rille"] == "body"]
    assert names == [body.name for body in rover.bodies]
    ground = next(thing for thing in found if thing.extras["rille"] == "terrain")
    x, y, z = ground.pieces[0].vertices.T + np.array(view.origin)[:, None]
    corner = (terrain.x_west, terrain.y_north)
    expected = bilinear(np.asarray(terrain.heights), corner, (terrain.posting_x, terrain.posting_y), x, y, clamp=True)
    assert np.abs(z - expected).max() < SINGLE
    rows, columns = ground.extras["rows"], ground.extras["columns"]
    assert rows * columns == len(x)
    grid = ground.extras
    i, j = np.divmod(np.arange(len(x)), columns)
    assert np.abs(x - view.origin[0] - (grid["x_west"] + j * grid["posting_x"])).max() < SINGLE
    assert np.abs(y - view.origin[1] - (grid["y_north"] - i * grid["posting_y"])).max() < SINGLE


def test_states_are_those_of_the_run_in_the_order_of_the_layout(shown):
    rover, _, trace, view = shown
    layout = scene3d.layout(rover, view, title="t")
    states = scene3d.states(trace, rover, np.array(view.origin))
    assert states.dtype == np.float32
    assert states.shape == (len(trace.time), 7 * len(layout["bodies"]) + 4 * len(layout["joints"]) + 11 * len(layout["wheels"]))
    for k, body in enumerate(layout["bodies"]):
        run = next(b for b in trace.bodies if b.name == body["name"])
        assert np.abs(states[:, 7 * k : 7 * k + 3] + view.origin - run.position).max() < SINGLE
        assert np.abs(states[:, 7 * k + 3 : 7 * k + 7] - run.rotation).max() < SINGLE
    first = 7 * len(layout["bodies"]) + 4 * len(layout["joints"])
    for k, wheel in enumerate(layout["wheels"]):
        run = next(w for w in trace.wheels if w.name == wheel["name"])
        assert np.allclose(states[:, first + 11 * k + 4 + WHEEL.index("normal_load")], run.normal_load, rtol=1e-6)
        assert wheel["axle"] == [0.0, 1.0, 0.0]
    assert [body["name"] for body in layout["bodies"] if body["root"]] == ["chassis"]


def blob(value):
    return zlib.decompress(base64.b64decode(value["base64"]))


def test_the_page_holds_everything_asks_nobody_and_lets_no_name_become_a_script(shown):
    rover, terrain, trace, view = shown
    rover = replace(rover, bodies=(replace(rover.bodies[0], name=HOSTILE), *rover.bodies[1:]))
    layout = scene3d.layout(rover, view, title=HOSTILE)
    run = scene3d.Shown(label=HOSTILE, time=trace.time, states=scene3d.states(trace, rover, np.array(view.origin)), events=trace.events)
    text = scene3d.page(scene3d.source(layout, scene3d.scene_glb(rover, terrain, view), [run], "single"), HOSTILE)
    assert "<img" not in text
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text)
    assert text.count("</script>") == text.count("<script")
    source = json.loads(re.search(r'id="rille-source"[^>]*>(.*?)</script>', text, re.S)[1])
    assert source["layout"]["title"] == HOSTILE
    times = np.frombuffer(blob(source["runs"][0]["time"]))
    assert np.array_equal(times, trace.time)
    assert np.array_equal(
        np.frombuffer(blob(source["runs"][0]["states"]), "<f4").reshape(len(times), -1)[:, :7], run.states[:, :7], equal_nan=True
    )
    assert [event["kind"] for event in source["runs"][0]["events"]] == [event.kind for event in trace.events]


def test_long_runs_are_thinned_and_keep_beginning_and_end(shown, monkeypatch):
    rover, _, trace, view = shown
    monkeypatch.setattr("rille.view.scene3d.page_source.MOST_NUMBERS", 1000)
    run = scene3d.Shown(label="r", time=trace.time, states=scene3d.states(trace, rover, np.array(view.origin)))
    source = scene3d.source({}, b"", [run], "single")
    times = np.frombuffer(blob(source["runs"][0]["time"]))
    assert (times[0], times[-1]) == (trace.time[0], trace.time[-1])
    assert len(times) * run.states.shape[1] <= 1000 + run.states.shape[1]


def test_an_animation_stands_at_a_stored_time_where_the_run_did(shown):
    """Position and turn of every body in W: the root node's turn brings z up to y up."""
    rover, terrain, trace, view = shown
    gltf = gl.GLTF2.load_from_bytes(scene3d.animated_glb(rover, terrain, view, trace))
    animation, blob_ = gltf.animations[0], gltf.binary_blob()
    names = {number: node.name for number, node in enumerate(gltf.nodes)}

    def values(number):
        accessor = gltf.accessors[number]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        start = gltf.bufferViews[accessor.bufferView].byteOffset
        return np.frombuffer(blob_, "<f4", accessor.count * width, start).reshape(-1, width)

    seen = set()
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        time, moved = values(sampler.input)[:, 0], values(sampler.output)
        body = next(b for b in trace.bodies if b.name == names[channel.target.node])
        assert np.abs(time - trace.time).max() < SINGLE
        if channel.target.path == "translation":
            assert np.abs(moved + view.origin - body.position).max() < SINGLE
        else:
            turned = moved[:, [3, 0, 1, 2]]
            assert np.abs(np.abs((turned * body.rotation).sum(axis=1)) - 1).max() < 1e-6
            assert ((turned[1:] * turned[:-1]).sum(axis=1) > 0).all()  # never the long way round
        seen.add((body.name, channel.target.path))
    assert len(seen) == 2 * len(rover.bodies)
    top = gltf.nodes[gltf.scenes[0].nodes[0]]
    x, y, z, w = top.rotation
    assert matrix_of((w, x, y, z)) @ [0, 0, 1] == pytest.approx([0, 1, 0], abs=1e-12)


def test_ruts_are_as_deep_as_wheels_sank_and_nowhere_else(shown):
    rover, terrain, trace, view = shown
    thing = next(t for t in things(scene3d.scene_glb(rover, terrain, view)) if t.extras["rille"] == "terrain")
    ground = thing.pieces[0].vertices
    pressed = Pressed(ground, np.full((len(ground), 3), 200, np.uint8), thing.extras)
    origin = np.array(view.origin)
    tracks = np.array(
        [np.column_stack([w.center - origin, w.ground_height - origin[2], *(getattr(w, f) for f in WHEEL)]) for w in trace.wheels]
    )
    pressed.press(tracks, len(trace.time) - 1, [w.width for w in rover.wheels])
    depth = ground[:, 2] - pressed.points[:, 2]
    deepest = max(w.sinkage.max() for w in trace.wheels)
    slope = 0.12  # the ground rises by so much within half a cell and half a wheel
    assert 0.5 * deepest < depth.max() < deepest + slope * (0.165 + 0.05)
    assert (depth > 0).mean() < 0.1
    assert (pressed.colors[depth > 1e-4] < 200).all()


def test_machines_without_ground_wheels_or_meshes_are_shown(make_model):
    rover = chain([1.0, 0.5], [1.0, 1.0])
    path = make_model(rover, Scenario(name="s", duration=0.5))
    simulate.run(path)
    trace = store.read_trace(path)
    view = scene3d.view_of(None, np.concatenate([b.position for b in trace.bodies]))
    found = things(scene3d.scene_glb(rover, None, view))
    assert [thing.extras["name"] for thing in found] == [body.name for body in rover.bodies]
    assert all(thing.pieces for thing in found)
    assert scene3d.layout(rover, view, title="t")["wheels"] == []
    assert np.isfinite(scene3d.states(trace, rover, np.array(view.origin))).all()


def recording_of(trace, joints, root=None):
    """Channels of a run: positions of joints, and of the root what is named."""
    channels = [
        Channel(name=j.name, quantity="joint.position", target=j.name, unit="rad", time=trace.time, value=j.position)
        for j in trace.joints
        if j.name in joints
    ]
    if root is not None:
        body = trace.bodies[0]
        for k, axis in enumerate("xyz"):
            channels.append(
                Channel(
                    name=axis,
                    quantity="part.position",
                    component=axis,
                    target=body.name,
                    unit="m",
                    time=trace.time,
                    value=body.position[:, k],
                )
            )
        for k, axis in enumerate("wxyz"):
            channels.append(
                Channel(
                    name=f"q{axis}",
                    quantity="part.orientation",
                    component=axis,
                    target=body.name,
                    unit="1",
                    time=trace.time,
                    value=body.rotation[:, k],
                )
            )
    return Recording(name="real", channels=tuple(channels))


def test_a_recording_that_says_it_all_stands_where_the_run_did(shown):
    rover, _, trace, _ = shown
    recording = recording_of(trace, [j.name for j in trace.joints], root="chassis")
    other, notes = scene3d.recorded_trace(recording, rover, trace)
    assert notes == []
    for body in other.bodies:
        run = next(b for b in trace.bodies if b.name == body.name)
        for k in range(3):
            assert np.abs(body.position[:, k] - np.interp(other.time, trace.time, run.position[:, k])).max() < 2e-4  # between samples
    wheel = next(w for w in trace.wheels if w.name == other.wheels[0].name)
    assert np.abs(other.wheels[0].center[0] - wheel.center[0]).max() < 1e-7  # the solver's joints stand so near their axes
    assert np.isnan(other.wheels[0].normal_load).all()
    assert len(scene3d.extras(recording)) == len(recording.channels)


def test_what_a_recording_does_not_say_is_told(shown):
    rover, _, trace, _ = shown
    other, notes = scene3d.recorded_trace(recording_of(trace, ["wheel_front_left"]), rover, trace)
    assert any("3 joints were not recorded" in note for note in notes)
    assert any("of 'chassis' were not recorded and are those of run" in note for note in notes)
    assert np.abs(other.bodies[0].position[-1] - trace.bodies[0].position[-1]).max() < 1e-9
    with pytest.raises(InputRefused, match="says neither where chassis is"):
        scene3d.recorded_trace(recording_of(trace, []), rover, trace)
