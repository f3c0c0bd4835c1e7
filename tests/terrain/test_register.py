"""The register: built-in landforms, the user's library, folders of scenes; what is broken, and what is written about it all."""

import json
import os
from typing import Annotated

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import command
from rille.cli import terrain_library
from rille.model import InputRefused, Population
from rille.terrain import build, own
from rille.terrain.crowd import Crowd
from rille.terrain.document import page
from rille.terrain.exhibit import exhibit
from rille.terrain.grid import Grid
from rille.terrain.register import landforms, library_folder, read_register, soils

BOWL = """name = "bowl"
meaning = "bowl"
frame = "origin at the centre, height zero at the ground"
source = "test"
kind = "radial"
[radial]
points = [[0, -1], [2, -0.5], [4, 0.4], [6, 0]]
"""

app = typer.Typer()
app.command("show")(terrain_library.show)
app.command("register")(terrain_library.register)


@app.command("list")
def listed(as_json: Annotated[bool, typer.Option("--json")] = False) -> None:
    """The register without a scene."""
    terrain_library.list_register((), as_json)


def rille(*arguments):
    """Run a verb in this process; its result. What it refuses is raised."""
    result = CliRunner().invoke(app, list(map(str, arguments)))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture(autouse=True)
def library(tmp_path, monkeypatch):
    """A library of the user's own, for this test only."""
    folder = tmp_path / "library"
    monkeypatch.setenv("RILLE_LANDFORMS", str(folder))
    return folder


@pytest.fixture
def bowl(tmp_path):
    """A profile."""
    file = tmp_path / "bowl.toml"
    file.write_text(BOWL)
    return file


class TestReading:
    def test_built_in_landforms_are_the_files_of_the_library(self):
        register = read_register()
        assert register.builtin == set(register.landforms) == {f.stem for f in library_folder().glob("*.py") if f.stem[0] != "_"}
        assert register.broken == {}

    def test_the_users_library_then_folders_of_the_scene(self, library, tmp_path):
        """A landform of the scene's folder stands before one of the same name of the user's; files and folders are both read."""
        (library / "bowl").mkdir(parents=True)
        (library / "bowl/landform.toml").write_text(BOWL)
        scene = tmp_path / "forms"
        scene.mkdir()
        (scene / "bowl.toml").write_text(BOWL.replace('meaning = "bowl"', 'meaning = "deeper bowl"'))
        (scene / "dish.toml").write_text(BOWL.replace('name = "bowl"', 'name = "dish"'))
        assert landforms()["bowl"].meaning == "bowl"
        register = read_register([scene])
        assert register.landforms["bowl"].meaning == "deeper bowl"
        assert set(register.landforms) == {*register.builtin, "bowl", "dish"}
        assert register.files["bowl"] == scene / "bowl.toml"
        with pytest.raises(InputRefused, match=r"there is no folder .*nowhere"):
            read_register([tmp_path / "nowhere"])

    def test_a_changed_file_is_read_again(self, library):
        library.mkdir()
        file = library / "bowl.toml"
        file.write_text(BOWL)
        first = landforms()["bowl"]
        assert landforms()["bowl"] is first  # kept, not read again
        file.write_text(BOWL.replace('meaning = "bowl"', 'meaning = "dish"'))
        os.utime(file, ns=(1, 1))  # however coarse the clock of the disk is
        assert landforms()["bowl"].meaning == "dish"
        assert landforms()["bowl"].digest != first.digest != ""
        file.unlink()
        assert "bowl" not in landforms()

    @pytest.mark.parametrize(
        ("file", "content", "words"),
        [
            ("bowl.toml", "name = ", ["is not valid TOML"]),
            ("bowl.toml", BOWL.replace("radial]", "radiant]"), ["radiant"]),
            ("bowl.toml", BOWL.replace('name = "bowl"', 'name = "dish"'), ["is called 'dish'", "name it 'bowl'"]),
            ("crater.toml", BOWL.replace('name = "bowl"', 'name = "crater"'), ["name of a built-in landform", "rename it"]),
            ("bowl.toml", b"\xff\xfe", ["is not valid TOML"]),
        ],
    )
    def test_a_broken_one_is_named_and_the_rest_stays(self, library, file, content, words):
        library.mkdir()
        (library / file).write_bytes(content if isinstance(content, bytes) else content.encode())
        (library / "dish.toml").write_text(BOWL.replace('name = "bowl"', 'name = "dish"'))
        register = read_register()
        name = file.removesuffix(".toml")
        assert set(register.landforms) == {*register.builtin, "dish"}
        for word in (str(library / file), *words):
            assert word in register.broken[name]
        result = rille("list")
        assert "\ndish: bowl (own; " in result.stdout
        assert f"the own landform '{name}' is left out" in result.stderr
        assert json.loads(rille("list", "--json").stdout)[name]["broken"] == register.broken[name]
        if name not in register.builtin:
            with pytest.raises(InputRefused, match="landform 'a' is a 'bowl', which cannot be used"):
                register.find("bowl", "landform 'a'")

    def test_one_name_twice_in_one_folder_is_neither(self, library):
        (library / "bowl").mkdir(parents=True)
        (library / "bowl/landform.toml").write_text(BOWL)
        (library / "bowl.toml").write_text(BOWL)
        register = read_register()
        assert "two landforms 'bowl'" in register.broken["bowl"]
        assert "bowl" not in register.landforms

    def test_heights_that_vanished_are_refused(self, library):
        (library / "bowl").mkdir(parents=True)
        text = BOWL.split("kind")[0] + 'kind = "heights"\n'
        for name in ("length", "height"):
            text += f'[[driver]]\nname = "{name}"\nmeaning = "size"\nrange = [1, 9]\ndefault = 2\n'
        text += '[heights]\nfile = "heights.npy"\nposting = [1, 1]\nwest = -1\nnorth = 1\nlength = 2\nheight = 1\n'
        (library / "bowl/landform.toml").write_text(text)
        assert "heights.npy' of landform 'bowl' cannot be read" in read_register().broken["bowl"]
        np.save(library / "bowl/heights.npy", np.zeros(3))
        assert "no grid of heights" in read_register().broken["bowl"]
        np.save(library / "bowl/heights.npy", np.array([[0, 0, 0], [0, np.nan, 0], [0, 0, 0]]))
        with pytest.raises(InputRefused, match="not finite; register it again"):
            exhibit(landforms()["bowl"], landforms())

    def test_unknown_names_find_the_nearest(self):
        with pytest.raises(InputRefused, match="landform 'a' is a 'crate', which is not registered; did you mean 'crater'"):
            read_register().find("crate", "landform 'a'")


class TestTakingIn:
    def test_a_profile_with_its_comments(self, library, bowl):
        bowl.write_text("# surveyed on a Friday\n" + BOWL)
        result = rille("register", bowl)
        assert "registered 'bowl'" in result.stderr
        assert (library / "bowl/landform.toml").read_text() == bowl.read_text()
        rille("register", bowl, "--name", "dish")
        text = (library / "dish/landform.toml").read_text()
        assert text == bowl.read_text().replace('name = "bowl"', 'name = "dish"')
        assert set(landforms()) >= {"bowl", "dish"}
        assert sorted(path.name for path in library.iterdir()) == ["bowl", "dish"]  # nothing is left lying about

    def test_there_and_back(self, library, bowl, tmp_path):
        """A library that was copied, and a landform taken in once more from there, give the same heights."""
        import shutil

        import trimesh

        trimesh.creation.icosphere(radius=0.5).export(tmp_path / "ball.stl")
        facts = json.loads(rille("register", tmp_path / "ball.stl", "--unit", "m", "--embed", "20 cm", "--json").stdout)
        assert (facts["landform"], facts["kind"], facts["blend"]) == ("ball", "solid", "max")
        first = exhibit(landforms()["ball"], landforms())
        shutil.copytree(library, tmp_path / "copy")
        rille("register", tmp_path / "copy/ball/landform.toml", "--name", "bullet")
        second = exhibit(landforms()["bullet"], landforms())
        assert first.heights.tobytes() == second.heights.tobytes()
        assert first.heights.max() == pytest.approx(0.8, abs=1e-6)
        shown = json.loads(rille("show", "ball", "--set", "embedded=0", "-o", tmp_path / "ball.png", "--json").stdout)
        assert shown["heights_m"] == pytest.approx([0, 1], abs=1e-6)
        assert shown["own"]
        assert (tmp_path / "ball.png").stat().st_size < 60_000

    def test_a_step_file_states_its_unit(self, repository, tmp_path):
        """A plate of 40 x 30 x 5 mm with a hole: its top, and ground in the hole."""
        import cadquery

        cadquery.Workplane().box(40, 30, 5).faces(">Z").workplane().hole(10).val().exportStep(str(tmp_path / "plate.step"))
        rille("register", tmp_path / "plate.step")
        form = landforms()["plate"]
        values = form.values({}, "it")
        x, y = np.array([0.0, 0.003, 0.010, 0.019, 0.021]), np.array([0.0, 0.003, 0.010, -0.014, 0.0])
        assert form.profile(x, y, values) == pytest.approx([0, 0, 0.005, 0.005, 0], abs=1e-6)
        with pytest.raises(InputRefused, match="--unit means nothing"):
            rille("register", tmp_path / "plate.step", "--unit", "mm", "--force")

    def test_names_that_are_taken(self, library, bowl):
        rille("register", bowl)
        with pytest.raises(InputRefused, match=r"has a landform 'bowl' already; .*--force"):
            rille("register", bowl)
        bowl.write_text(BOWL.replace('meaning = "bowl"', 'meaning = "dish"'))
        assert "replaced 'bowl'" in rille("register", bowl, "--force").stderr
        assert landforms()["bowl"].meaning == "dish"
        with pytest.raises(InputRefused, match="'crater' is the name of a built-in landform"):
            rille("register", bowl, "--name", "crater", "--force")
        with pytest.raises(InputRefused, match="'2nd bowl' cannot name"):
            rille("register", bowl, "--name", "2nd bowl")

    def test_what_is_refused_leaves_the_library_as_it_was(self, library, bowl):
        rille("register", bowl)
        before = (library / "bowl/landform.toml").read_bytes()
        bowl.write_text(BOWL.replace("[6, 0]", "[6, 0.3]"))
        with pytest.raises(InputRefused, match=r"end at 6 with the height 0\.3"):
            rille("register", bowl, "--force")
        bowl.write_text(BOWL.replace("kind", 'soil = "mud"\nkind'))
        with pytest.raises(InputRefused, match="the soil 'mud', which the library does not have"):
            rille("register", bowl, "--force")
        assert (library / "bowl/landform.toml").read_bytes() == before
        assert [path.name for path in library.iterdir()] == ["bowl"]

    def test_a_library_that_cannot_be_written(self, bowl, tmp_path, monkeypatch):
        (tmp_path / "file").write_text("")
        with pytest.raises(InputRefused, match="could not be written"):
            rille("register", bowl, "--library", tmp_path / "file")

        def full(*_, **__):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("pathlib.Path.write_text", full)
        with pytest.raises(InputRefused, match="could not be written: No space left on device"):
            rille("register", bowl)

    def test_removing(self, library, bowl):
        rille("register", bowl)
        assert "'bowl' is no longer" in rille("register", "--remove", "bowl").stderr
        assert list(library.iterdir()) == []
        (library / "broken.toml").write_text("?")
        rille("register", "--remove", "broken")
        with pytest.raises(InputRefused, match="has no landform 'bowl'; there are none"):
            rille("register", "--remove", "bowl")

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            ([], ["nothing to register"]),
            (["absent.toml"], ["there is no file 'absent.toml'"]),
            (["bowl.toml", "--unit", "mm"], ["--unit means nothing", "profile", "write it into the file"]),
            (["bowl.toml", "--soil", "lunar_soft"], ["--soil means nothing"]),
            (["bowl.png", "--up", "z"], ["--up means nothing", "heights", "belongs to solid"]),
            (["bowl.stl", "--unit", "mm", "--fade", "1"], ["--fade means nothing", "solid"]),
            (["bowl.toml", "--kind", "cube"], ["profile, heights or solid"]),
            (["bowl.png", "--blend", "melt"], ["--blend is 'melt'"]),
        ],
    )
    def test_options_that_do_not_belong(self, bowl, tmp_path, monkeypatch, arguments, words):
        monkeypatch.chdir(tmp_path)
        for suffix in (".png", ".stl"):
            bowl.with_suffix(suffix).write_bytes(b"")
        with pytest.raises(InputRefused) as refused:
            rille("register", *arguments)
        for word in words:
            assert word in str(refused.value)


def test_refused_input_ends_with_one_sentence_and_code_3(tmp_path, bowl):
    """Through the command as users call it."""
    command.assert_refused(command.rille("terrain", "register", tmp_path / "no.stl"), "there is no file", "no.stl")
    command.assert_refused(command.rille("terrain", "register", bowl, "--name", "crater"), "'crater'", "built-in")
    command.assert_refused(command.rille("terrain", "show", "crate"), "did you mean 'crater'")


class TestShowing:
    def test_values_follow_their_links(self):
        register = read_register()
        name = next(n for n, form in register.landforms.items() if any(d.link for d in form.drivers))
        form = register.landforms[name]
        facts = json.loads(rille("show", name, "--json").stdout)
        assert facts["values"] == pytest.approx(form.values(dict(form.example), "it"))
        assert [d["name"] for d in facts["drivers"]] == [d.name for d in form.drivers]

    def test_drivers_can_be_set(self, tmp_path):
        facts = json.loads(rille("show", "crater", "--set", "diameter=400 cm", "-o", tmp_path / "c.png", "--json").stdout)
        assert facts["values"]["diameter"] == 4.0
        assert (tmp_path / "c.png").is_file()
        assert "4 m" in rille("show", "crater", "--set", "diameter=4").stdout

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["crate"], ["did you mean 'crater'"]),
            (["crater", "--set", "size=1"], ["'size', which crater does not have"]),
            (["crater", "--set", "diameter=1kg"], ["1kg"]),
            (["crater", "--set", "diameter=1e9"], ["must lie between"]),
            (["crater", "--set", "diameter"], ["no NAME=VALUE"]),
            (["crater", "-o", "crater.pdf"], ["is no PNG"]),
        ],
    )
    def test_refusals(self, arguments, words):
        with pytest.raises(InputRefused) as refused:
            rille("show", *arguments)
        for word in words:
            assert word in str(refused.value)

    def test_a_cut_goes_through_what_there_is(self):
        """The tracks of a sine track lie beside its axis: the profile is cut where they are."""
        register = landforms()
        for name, form in register.items():
            shown = exhibit(form, register, points=120)
            largest = np.abs(shown.heights).max()
            assert largest > 0, name
            assert np.abs(shown.cut_x[1]).max() > 0.15 * largest, name


class TestThePage:
    def test_it_is_what_the_register_says(self, repository):
        """`rille terrain list --document terrain_library` was run after the last change of a landform."""
        register = read_register()
        pictures = {name: f"pictures/{name}.png" for name in register.builtin}
        written = (repository / "terrain_library/README.md").read_text(encoding="utf-8")
        assert written == page(register, pictures, terrain_library.SHEET_PICTURE)

    def test_each_landform_has_its_picture(self, repository):
        folder = repository / "terrain_library/pictures"
        names = {"register", *read_register().builtin}
        assert {file.stem for file in folder.glob("*.png")} == names
        for file in folder.glob("*.png"):
            assert file.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
            assert 5_000 < file.stat().st_size < (60_000 if file.stem != "register" else 200_000), file

    def test_it_is_written_anew(self, tmp_path, monkeypatch):
        """Two landforms only, so that it is quick."""
        register = read_register()
        few = {name: register.landforms[name] for name in ("crater", "mound")}
        from dataclasses import replace

        monkeypatch.setattr("rille.terrain.register.read_register", lambda folders=(): replace(register, landforms=few))
        terrain_library.document(tmp_path / "out", as_json=False)
        text = (tmp_path / "out/README.md").read_text()
        assert "| [mound](#mound) |" in text
        assert {file.name for file in (tmp_path / "out/pictures").iterdir()} == {"crater.png", "mound.png", "register.png"}
        (tmp_path / "file").write_text("")
        with pytest.raises(InputRefused, match="could not be written"):
            terrain_library.document(tmp_path / "file", as_json=False)


def test_soils_are_read_once_and_checked():
    assert soils()["lunar_sourcebook"].friction_angle == pytest.approx(np.radians(35))


def test_own_folder_is_stated_by_the_environment(library, monkeypatch):
    assert own.own_folder() == library
    monkeypatch.delenv("RILLE_LANDFORMS")
    assert own.own_folder().parts[-4:] == (".local", "share", "rille", "landforms")


class TestInAScene:
    SCENE = """name = "yard"
soil = "lunar_sourcebook"
library = ["forms"]
[base]
kind = "flat"
size = [20, 16]
posting = 0.1
[[landform]]
name = "a"
landform = "bowl"
x = 2
y = -1
drivers = { diameter = "6 m", height = "1 m" }
"""

    @pytest.fixture
    def scene(self, tmp_path, monkeypatch):
        """A scene that brings its own landform along."""
        monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
        (tmp_path / "forms").mkdir()
        (tmp_path / "forms/bowl.toml").write_text(BOWL)
        file = tmp_path / "yard.toml"
        file.write_text(self.SCENE)
        return file

    def test_it_lies_where_it_was_placed(self, scene):
        """Bowl of half its drawn diameter: -1 m in the centre at (2, -1), 0.4 m on the rim 2 m from it, 0 from 3 m on."""
        heights = np.asarray(build(scene).heights[0:161, 0:201])
        assert heights[90, 120] == pytest.approx(-1)
        assert heights[90, [100, 140]] == pytest.approx([0.4, 0.4])
        assert heights[[70, 110], 120] == pytest.approx([0.4, 0.4])
        assert heights[90, [90, 150]] == pytest.approx([0, 0], abs=1e-12)

    def test_a_changed_landform_is_evaluated_again(self, scene):
        """What is kept of the last evaluation knows by which file it was made: 1 m from the centre, -0.5 m becomes -0.7 m."""
        assert build(scene).heights[90:91, 110:111][0, 0] == pytest.approx(-0.5)
        file = scene.parent / "forms/bowl.toml"
        file.write_text(BOWL.replace("[2, -0.5]", "[2, -0.7]"))
        assert build(scene).heights[90:91, 110:111][0, 0] == pytest.approx(-0.7)

    def test_a_population_is_the_sum_of_its_members(self, library):
        """The compiled loop works from a table, whose error is below a thousandth of the height."""
        library.mkdir()
        (library / "bowl.toml").write_text(BOWL)
        form = landforms()["bowl"]
        random = np.random.default_rng(1)
        x, y = random.uniform(-6, 6, (2, 20))
        drivers = {"diameter": random.uniform(1, 8, 20), "height": random.uniform(0.1, 1, 20)}
        population = Population(name="many", landform="bowl", x=x, y=y, heading=np.zeros(20), drivers=drivers)
        grid = Grid(n_rows=81, n_cols=121, posting_x=0.1, posting_y=0.1, x_west=-6, y_north=4)
        stamped = np.zeros(grid.shape)
        Crowd(population=population, landform=form).stamp(stamped, grid, grid.whole)
        px, py = grid.points(grid.whole)
        members = [{name: float(values[k]) for name, values in drivers.items()} for k in range(20)]
        expected = sum(form.profile(px - x[k], py - y[k], members[k]) for k in range(20))
        assert np.abs(stamped - expected).max() < 1e-3
        assert np.abs(expected).max() > 0.5
