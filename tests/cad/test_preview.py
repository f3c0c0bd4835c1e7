"""Does the preview show what is there, with the volumes of what was drawn?"""

import json
import math

import numpy as np
import pytest

from command import assert_refused, rille
from rille import store
from rille.cad.collision.summary import summarize_collision
from rille.model import Body, CollisionShape, MassProperties, Mesh, Part, PartInstance, Pose, Rover

PROPERTIES = MassProperties(mass=1.0, com=np.zeros(3), inertia=np.eye(3), mass_provenance="stated", inertia_provenance="stated")
CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
TRIANGLES = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]]).astype(np.int32)


@pytest.fixture(scope="module")
def rover():
    """A unit cube between two boxes that overlap by half, a ball of the same part, and a body without pieces."""
    mesh = Mesh(vertices=CUBE, triangles=TRIANGLES, tolerance=1e-3)
    half = (1.0, 1.0, 1.0)
    return Rover(
        parts=(Part(name="cube", volume=1.0, properties=PROPERTIES, meshes=(mesh,)),),
        instances=tuple(PartInstance(path=name, part="cube", pose=Pose(), body=name) for name in ("pair", "ball", "bare")),
        bodies=tuple(Body(name=name, properties=PROPERTIES) for name in ("pair", "ball", "bare")),
        collision_shapes=(
            CollisionShape(body="pair", kind="box", pose=Pose(position=(0.5, 0.5, 0.5)), size=half),
            CollisionShape(body="pair", kind="box", pose=Pose(position=(1.0, 0.5, 0.5)), size=half),
            CollisionShape(body="ball", kind="sphere", pose=Pose(position=(0.5, 0.5, 0.5)), size=(0.5,)),
        ),
    )


def test_volumes(rover):
    pair, ball, bare = summarize_collision(rover)
    assert (pair.kinds, pair.pieces, pair.parts_volume) == ({"box": 2}, 2, 1.0)
    assert pair.ratio == pytest.approx(1.5, rel=1e-9)  # the half that two unit boxes share counts once
    assert ball.ratio == pytest.approx(math.pi / 6, rel=1e-12)
    assert (bare.pieces, bare.ratio) == (0, None)


def test_command(rover, tmp_path):
    model, picture = tmp_path / "model.db", tmp_path / "pictures" / "both.png"
    store.create(model)
    store.write_rover(model, rover)
    done = rille("cad", "preview", model, "-o", picture, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert [(row["body"], row["pieces"]) for row in said["bodies"]] == [("pair", 2), ("ball", 1), ("bare", 0)]
    if said["notes"]:
        pytest.skip(f"no picture on this machine: {said['notes'][0]}")
    assert picture.read_bytes()[:4] == b"\x89PNG"
    one = rille("cad", "preview", model, "-o", picture, "--body", "ball")
    assert one.stdout.splitlines()[1].split()[:2] == ["ball", "1"]
    assert len(one.stdout.splitlines()) == 2
    assert_refused(rille("cad", "preview", model, "-o", picture, "--body", "wheel"), "no body 'wheel'", "pair, ball, bare")
