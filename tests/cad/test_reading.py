"""Through the door: is a file read once, is what it holds the same the second time, and is whatever kills OCCT one sentence?"""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from rille.cad import read_step
from rille.cad.files import cache, child
from rille.cad.files.named_faces import named_face
from rille.cad.files.reading import load_assemblies, load_assembly, mesh_of, meshes_of
from rille.cad.files.script_reader import read_script
from rille.model import InputRefused


@pytest.fixture(autouse=True, scope="module")
def _folder(tmp_path_factory):
    """One cache for all tests of this file; each uses files of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RILLE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def children(monkeypatch):
    """The jobs that children were started for."""
    jobs = []
    run = child.run

    def counted(job, **options):
        jobs.append(job)
        return run(job, **options)

    monkeypatch.setattr(child, "run", counted)
    return jobs


def box_step(write_step, name, *sizes):
    import cadquery as cq

    return write_step(name, [(cq.Solid.makeBox(*size), f"box{k}") for k, size in enumerate(sizes)])


def test_same_as_in_process_and_from_the_cache(nested_step, children):
    direct, first, second = read_step(nested_step), load_assembly(nested_step), load_assembly(nested_step)
    assert [job["do"] for job in children] == ["read"]
    for found in (first, second):
        assert [i.path for i in found.instances] == [i.path for i in direct.instances]
        assert [i.color for i in found.instances] == [i.color for i in direct.instances]
        for a, b in zip(found.instances, direct.instances, strict=True):
            np.testing.assert_array_equal(a.matrix, b.matrix)
        for a, b in zip(found.prototypes, direct.prototypes, strict=True):
            assert (a.name, a.digest, a.n_solids, a.volume.volume) == (b.name, b.digest, b.n_solids, b.volume.volume)
            np.testing.assert_array_equal(a.volume.inertia, b.volume.inertia)
            np.testing.assert_array_equal(a.bounds, b.bounds)
    assert first.prototypes[0].shape.ShapeType() == direct.prototypes[0].shape.ShapeType()


def test_only_changed_parts_are_meshed_again(write_step, children):
    path = box_step(write_step, "changes.step", (10, 10, 10), (20, 20, 20))
    before = load_assembly(path)
    meshes = meshes_of(before.prototypes, 1e-4)
    assert [len(mesh.triangles) for mesh in meshes] == [12, 12]
    assert meshes_of(before.prototypes, 1e-4)[0].vertices.tolist() == meshes[0].vertices.tolist()
    box_step(write_step, "changes.step", (10, 10, 10), (20, 20, 30))
    meshes_of(load_assembly(path).prototypes, 1e-4)
    assert [job["do"] for job in children] == ["read", "mesh", "read", "mesh"]
    assert [part["name"] for part in children[-1]["parts"]] == ["box1"]
    mesh_of(before.prototypes[0], 2e-4)  # another tolerance
    assert len(children) == 5


def test_an_unchanged_build_imports_no_occt_and_takes_no_time(nested_step):
    meshes_of(load_assembly(nested_step).prototypes, 1e-3)
    script = f"""
import sys, time  # processor time: the machine may be busy with other things
from pathlib import Path
from rille.cad.files.reading import load_assembly, meshes_of
start = time.process_time()
meshes_of(load_assembly(Path({str(nested_step)!r})).prototypes, 1e-3)
print(time.process_time() - start, "OCP" in sys.modules, "cadquery" in sys.modules)
"""
    # The version is handed on: code may be edited while the tests run.
    version = {**os.environ, "RILLE_CACHE_VERSION": cache.version()}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=version)
    seconds, *imported = done.stdout.split()
    assert imported == ["False", "False"]
    assert float(seconds) < 0.5  # measured 0.02 s


def test_many_files_share_one_child(write_step, children):
    paths = [box_step(write_step, f"many{k}.step", (10, 20, 10 + k)) for k in range(3)]
    broken = box_step(write_step, "many_broken.step", (1, 1, 1))
    broken.write_text(broken.read_text()[:3000])
    with pytest.raises(InputRefused, match=r"many_broken.step' cannot be read as STEP: it ends before END-ISO-10303-21"):
        load_assemblies([*paths, broken])
    assert [job["do"] for job in children] == ["read all", "read"]  # the second for the sentence on the broken one
    found = load_assemblies([*paths, paths[0]])
    assert [a.prototypes[0].volume.volume for a in found] == pytest.approx([2e-6, 2.2e-6, 2.4e-6, 2e-6])
    assert len(children) == 2


def test_external_files_are_part_of_the_key(write_step, tmp_path, monkeypatch, children):
    import cadquery as cq

    monkeypatch.chdir(tmp_path)
    rig = cq.Assembly(name="rig").add(cq.Workplane().box(10, 20, 30), name="box").add(cq.Workplane().sphere(5), name="ball")
    path = write_step("outer/main.step", rig, prefix="sub_")
    for sub in tmp_path.glob("sub_*"):
        sub.rename(path.parent / sub.name)
    first = load_assembly(path)
    sub = path.parent / "sub_box.stp"
    sub.write_text(sub.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    second = load_assembly(path)
    assert second.prototypes[0].volume.volume == pytest.approx(1000 * first.prototypes[0].volume.volume)
    assert len(children) == 2


def test_shapes_that_vanished_from_the_cache_are_read_again(write_step, children):
    path = box_step(write_step, "vanish.step", (10, 20, 30))
    digest = load_assembly(path).prototypes[0].digest
    cache.drop(f"brep {digest}")
    assert not load_assembly(path).prototypes[0].shape.IsNull()
    assert [job["do"] for job in children] == ["read", "read"]


def test_names_of_faces_travel_through_the_cache(tmp_path):
    import cadquery as cq

    solid = cq.Workplane().box(10, 20, 30)
    rig = cq.Assembly(name="rig").add(solid, name="block")
    rig.objects["block"].addSubshape(solid.faces(">Z").val(), name="top")
    rig.export(str(tmp_path / "faces.step"))
    for _ in range(2):
        prototype = load_assembly(tmp_path / "faces.step").prototypes[0]
        np.testing.assert_allclose(named_face(prototype, "top").point, [0, 0, 0.015], atol=1e-12)


def test_progress_and_notes(write_step):
    import cadquery as cq

    path = write_step("talk.step", [(cq.Solid.makeBox(1, 2, 3), "box"), (cq.Face.makePlane(5, 5), "sheet")])
    for _ in range(2):
        said, notes = [], []
        load_assembly(path, progress=lambda what, at, said=said: said.append((what, at)), note=notes.append)
        assert notes == ["part 'sheet' has no solid (free shells or curves): it has no mass and is only seen"]
        if said:
            assert said[0][0] == "reading entities"
            assert any(what.startswith("weighing ") for what, _ in said)
            assert all(0 <= at <= 1 for _, at in said)


# -- what dies or hangs -------------------------------------------------------------------------------------------------


def test_a_crash_of_occt_is_a_sentence(write_step):
    """A frame without its origin: OCCT follows a null pointer."""
    import cadquery as cq

    rig = cq.Assembly(name="rig").add(cq.Workplane().box(1, 2, 3), name="a").add(cq.Workplane().sphere(2), name="b")
    path = write_step("crash.step", rig)
    path.write_text(re.sub(r"(AXIS2_PLACEMENT_3D\('',)#\d+", r"\1#99999999", path.read_text()))
    with pytest.raises(InputRefused, match=r"makes the geometry kernel crash \(SIGSEGV\) while .* refers to #99999999, which is not there"):
        load_assembly(path)


def test_a_hang_of_occt_is_a_sentence(write_step, monkeypatch):
    """A rod whose edges have a radius of 5 mm, its surface one of 1000 km: OCCT makes triangles all the way round."""
    import cadquery as cq

    monkeypatch.setenv("RILLE_PATIENCE", "0.2")
    path = write_step("hang.step", [(cq.Solid.makeCylinder(5, 10), "rod")])
    path.write_text(re.sub(r"(CYLINDRICAL_SURFACE\('',#\d+,)5\.", r"\g<1>1.E9", path.read_text()))
    start = time.monotonic()
    with pytest.raises(InputRefused, match=r"was given up after 1 s while .*check"):
        meshes_of(load_assembly(path).prototypes, 1e-4)
    assert time.monotonic() - start < 30  # 1 s of processor time and the start; the machine may be busy


def test_impossible_numbers_are_refused_before_they_can_do_harm(write_step, children):
    import cadquery as cq

    path = write_step("absurd.step", [(cq.Solid.makeCylinder(5, 10), "rod")])
    path.write_text(re.sub(r"(CYLINDRICAL_SURFACE\('',#\d+,)5\.", r"\g<1>1.E308", path.read_text()))
    with pytest.raises(InputRefused, match=r"entity #\d+ of .* holds the number 1.E308"):
        load_assembly(path)


@pytest.mark.parametrize(
    ("job", "how"),
    [
        ("while True: pass", "was given up: its processor time is used up"),
        ("import os; os.kill(os.getpid(), 11)", r"crash \(SIGSEGV\)"),
        ("import os; os._exit(7)", r"end \(exit code 7\)"),
        ("import ctypes; ctypes.string_at(0)", r"crash \(SIGSEGV\)"),
    ],
)
def test_ends_of_a_child(job, how, tmp_path):
    script = tmp_path / "end.py"
    script.write_text(f"from rille.cad.files import read_process\nread_process.allow(1.0, lambda **message: None)\n{job}\n")
    with pytest.raises(InputRefused, match=how):
        load_assembly(script)


def test_a_reader_that_cannot_start_blames_no_file(write_step, monkeypatch):
    """No process starts within a millisecond; the patience multiplies this limit, too."""
    monkeypatch.setattr(child, "START", 1e-3)
    path = box_step(write_step, "busy.step", (10, 20, 31))
    with pytest.raises(InputRefused, match=r"^the CAD reader could not start within 0 s; the machine is busy: try again"):
        load_assembly(path)
    monkeypatch.setenv("RILLE_PATIENCE", "1e5")
    assert load_assembly(path).prototypes


def test_hunger_for_memory_is_a_sentence(tmp_path):
    script = tmp_path / "hungry.py"
    script.write_text("def build():\n    return bytearray(10**15)\n")
    with pytest.raises(InputRefused, match=r"MemoryError|needs more memory"):
        load_assembly(script)


def test_the_child_dies_with_its_parent(tmp_path):
    script = tmp_path / "sleep.py"
    script.write_text(f"import os, time, pathlib\npathlib.Path({str(tmp_path / 'pid')!r}).write_text(str(os.getpid()))\ntime.sleep(60)\n")
    code = f"from pathlib import Path; from rille.cad.files.reading import load_assembly; load_assembly(Path({str(script)!r}))"
    parent = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    for _ in range(300):
        if (tmp_path / "pid").exists() and (tmp_path / "pid").read_text():
            break
        time.sleep(0.1)
    pid = int((tmp_path / "pid").read_text())
    parent.send_signal(signal.SIGINT)
    parent.wait(10)
    for _ in range(50):
        if not Path(f"/proc/{pid}").exists():
            return
        time.sleep(0.1)
    os.kill(pid, signal.SIGKILL)
    pytest.fail("the child outlived its parent")


def test_a_cache_that_cannot_be_written_does_no_harm(write_step, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "file" / "cache"))
    path = box_step(write_step, "readonly.step", (10, 20, 30))
    (mesh,) = meshes_of(load_assembly(path).prototypes, 1e-4)
    assert len(mesh.triangles) == 12


# -- scripts ------------------------------------------------------------------------------------------------------------

SCRIPT = """
import cadquery as cq

print("talk")

def build():
    assembly = cq.Assembly(name="räder").add(cq.Workplane().box(10, 20, 30), name="Träger")
    return assembly.add(cq.Workplane().sphere(5), loc=cq.Location((0, 0, 50)))
"""


def test_script(tmp_path):
    script = tmp_path / "wheels.py"
    script.write_text(SCRIPT, encoding="utf-8")
    assembly = load_assembly(script)
    assert [i.path for i in assembly.instances] == ["räder/Träger", "räder/part"]
    assert assembly.prototypes[0].volume.volume == pytest.approx(6e-6, rel=1e-9)
    assert mesh_of(assembly.prototypes[0], 1e-4).triangles.shape == (12, 3)
    assert assembly.tables == {}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("def build():\n    return 1 / 0\n", r"ZeroDivisionError: division by zero at line 2: 'return 1 / 0'; correct the script"),
        ("def build(:\n", r"SyntaxError.* at line 1"),
        ("import cadquery as cq\ndef build():\n    return cq.Workplane().box(1, 1, 0)\n", r"failed with .* at line 3"),
        ("x = 1\n", r"defines no function build\(\)"),
        ("def build():\n    return 42\n", r"returns int; it must be a cadquery.Assembly"),
        ("import cadquery as cq\ndef build():\n    return cq.Assembly()\n", r"without any shape"),
        ("raise SystemExit('enough')\n", r"SystemExit: enough at line 1"),
        ("from rille.model import InputRefused\nraise InputRefused('my own sentence')\n", r"^my own sentence$"),
    ],
)
def test_errors_of_scripts(tmp_path, monkeypatch, text, sentence):
    monkeypatch.setattr(sys, "path", list(sys.path))  # in this process, which costs no start of a child
    monkeypatch.setattr(sys, "argv", list(sys.argv))
    script = tmp_path / "wrong.py"
    script.write_text(text)
    with pytest.raises(InputRefused, match=sentence) as refusal:
        read_script(script)
    assert "\n" not in str(refusal.value)


def test_missing_script(tmp_path):
    with pytest.raises(InputRefused, match="there is no script"):
        load_assembly(tmp_path / "absent.py")
