"""Are the example rover and the real double pendulum what their pages say?"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from rille.cad import build, read_step, volume_properties
from rille.model import Rover


@pytest.fixture(scope="module")
def rover(repository: Path) -> Rover:
    return build(repository / "examples" / "rover" / "rover.toml")


def script(path: Path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_rover_mass_and_centre(rover):
    masses = np.array([b.properties.mass for b in rover.bodies])
    com = np.sum([b.properties.mass * b.properties.com for b in rover.bodies], axis=0) / masses.sum()
    assert masses.sum() == pytest.approx(140, abs=0.5)  # the documented mass, rounded
    assert abs(com[1]) < 1e-6  # left and right are mirror images; integrals of fillets are good to 1e-9 m
    assert com[2] < 0.5  # tips at atan(0.5 m half track / 0.48 m) = 46 degrees at least
    assert len(rover.wheels) == 6
    assert len(rover.bodies) == 15
    assert sum(j.name.startswith("steering") for j in rover.joints) == 4
    assert len(rover.differentials) == 1


def test_rover_is_symmetric(rover):
    bodies = {b.name: b.properties for b in rover.bodies}
    for name, left in bodies.items():
        if not name.endswith("_left"):
            continue
        right = bodies[name.replace("_left", "_right")]
        assert right.mass == pytest.approx(left.mass, rel=1e-9)
        np.testing.assert_allclose(right.com * [1, -1, 1], left.com, atol=1e-7)
        mirror = np.diag([1.0, -1.0, 1.0])
        # 1e-5: numeric integrals over the intersections of cylinders, which OCCT approximates, differ left and right.
        np.testing.assert_allclose(mirror @ right.inertia @ mirror, left.inertia, atol=1e-5 * left.inertia.max())


def test_rover_wheels_share_the_load(rover):
    """Statics on flat ground, one side, by the principle of moments.

    Bogie about its pivot: the loads of the middle and rear wheel balance its weight and that of what it carries.
    Whole rover about the y axis: Sum R_i x_i = W x_com, Sum R_i = W (the differential takes no moment from outside).
    """
    bodies = {b.name: b.properties for b in rover.bodies}
    joints = {j.name: j for j in rover.joints}
    total = sum(b.mass for b in bodies.values())
    x_com = sum(b.mass * b.com[0] for b in bodies.values()) / total
    carried = [bodies[n] for n in ("bogie_left", "knuckle_rear_left", "wheel_rear_left", "wheel_middle_left")]
    pivot = joints["bogie_left"].point[0]
    x = {place: joints[f"wheel_{place}_left"].point[0] for place in ("front", "middle", "rear")}
    equations = np.array([[1, 1, 1], [x["front"], x["middle"], x["rear"]], [0, x["middle"] - pivot, x["rear"] - pivot]])
    right = [total / 2, total / 2 * x_com, sum(b.mass * (b.com[0] - pivot) for b in carried)]
    loads = np.linalg.solve(equations, right)
    np.testing.assert_allclose(loads, total / 6, rtol=0.15)  # the design goal of the example


def test_rover_rims_touch_the_ground(rover):
    parts = {p.name: p for p in rover.parts}
    for wheel in rover.wheels:
        assert wheel.center[2] == pytest.approx(wheel.radius)
        instance = next(i for i in rover.instances if i.body == wheel.name)
        z = parts[instance.part].meshes[0].vertices[:, 2] + instance.pose.position[2]
        assert wheel.grouser is not None
        # The lowest grouser stands straight down: below z = 0 by its height (float32 vertices: 1e-6).
        assert z.min() == pytest.approx(-wheel.grouser.height, abs=1e-5)


def test_rover_step_is_what_its_script_draws(repository, tmp_path):
    folder = repository / "examples" / "rover"
    script(folder / "make_rover.py").export(tmp_path / "again.step")

    def volumes(path):
        assembly = read_step(path)
        return {i.path: volume_properties(assembly.prototypes[i.prototype].shape) for i in assembly.instances}

    kept, again = volumes(folder / "rover.step"), volumes(tmp_path / "again.step")
    assert kept.keys() == again.keys()
    for path, properties in kept.items():
        assert again[path].volume == pytest.approx(properties.volume, rel=1e-9), path
        np.testing.assert_allclose(again[path].com, properties.com, atol=1e-9)


def test_rover_in_python_is_the_rover_of_the_sheet(rover, repository):
    """The script draws what was exported: names, places and numbers of the sheet; masses and inertias to 1e-9 (15 digits in the file)."""
    scripted = build(repository / "examples" / "rover" / "rover.py")
    for field in ("joints", "drives", "wheels", "differentials"):
        assert {x.name: x for x in getattr(scripted, field)} == {x.name: x for x in getattr(rover, field)}
    mine = {body.name: body.properties for body in scripted.bodies}
    for body in rover.bodies:
        assert mine[body.name].mass == pytest.approx(body.properties.mass, rel=1e-9)
        np.testing.assert_allclose(mine[body.name].com, body.properties.com, atol=1e-9)
        np.testing.assert_allclose(mine[body.name].inertia, body.properties.inertia, atol=1e-9 * body.properties.inertia.max())


def test_double_pendulum(repository, rille_data):
    if not (rille_data / "data" / "cad" / "double_pendulum.step").is_file():
        pytest.skip("the double pendulum's STEP file is absent")
    pendulum = build(repository / "examples" / "double_pendulum" / "pendulum.toml")
    joints = {j.name: j for j in pendulum.joints}
    assert joints["mount"].parent is None
    assert joints["mount"].kind == "fixed"
    shoulder, elbow = (np.array(joints[name].point) for name in ("shoulder", "elbow"))
    axis = np.array(joints["shoulder"].axis)
    assert axis[2] == pytest.approx(0, abs=1e-12)  # horizontal
    assert np.linalg.norm(np.cross(axis, elbow - shoulder)) == pytest.approx(0.2, abs=1e-12)  # upper lever of design C.1
    bodies = {b.name: b.properties for b in pendulum.bodies}
    # The zero pose hangs: both centres lie straight below their hinges, to the 0.1 mm of screws that are not in pairs.
    for body, joint in (("upper_link", shoulder), ("lower_link", elbow)):
        arm = bodies[body].com - joint
        across = np.cross(axis, [0, 0, 1])
        assert abs(arm @ across) < 1e-4
        assert arm[2] < -0.1
    # Total of the two links within a third of the identified 1.149 kg: nominal densities, not tuned.
    assert bodies["upper_link"].mass + bodies["lower_link"].mass == pytest.approx(1.149, rel=0.33)


def test_comparison_prints_every_quantity(repository, rille_data, capsys):
    if not (rille_data / "data" / "cad" / "double_pendulum_identified_parameters.yml").is_file():
        pytest.skip("the identified parameters are absent")
    script(repository / "examples" / "double_pendulum" / "compare.py").main()
    assert capsys.readouterr().out.count("link:") == 8
