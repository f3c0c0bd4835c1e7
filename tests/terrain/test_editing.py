"""Editing scenes: what is written, what stays, what is refused, and that no state of a file is ever lost."""

import fcntl
import multiprocessing
import os
import shutil
import stat
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pytest
import rasterio

from rille.model import InputRefused
from rille.terrain import build, editing, history
from rille.terrain.contents import contents
from rille.terrain.scene import read_scene
from rille.terrain.starter import new_scene

SCENE = """# my site
name = "site"  # trailing
soil = "lunar_sourcebook"

# what lies below
[base]
kind = "flat"   # no relief
size = ["20 m", "12 m"]
posting = "0.5 m"

# the big one
[[landform]]
name = "bowl"
landform = "crater"
x = "2 m"      # east of the lander
y = -1.5
drivers = { diameter = "4 m", relief = 0.5 } # old

# soft floor
[[soil_patch]]
name = "soft"
soil = "lunar_soft"
polygon = [
  [0, 0],  # south-west
  [1, 0],
  [1, 1],
]

[[landform]]
name = "hill"
landform = "mound"
x = "-40 dm"
y = "20 cm"
[landform.drivers]
diameter = "3 m"   # foot
height = "50 cm"

# a stone
[[obstacle]]
name = "stone"
kind = "box"
size = ["20 cm", 0.1, "0.1 m"]
x = "1 m"
y = "0 m"
material = "basalt"

[[material]]
name = "basalt"
"""


@pytest.fixture
def scene(tmp_path):
    """A scene with comments, tables out of order, a sub-table and a table over several lines."""
    file = tmp_path / "scene.toml"
    file.write_text(SCENE)
    return file


def refused(scene, words, verb, *arguments, **options):
    """An edit is refused with these words, and neither the file nor its folder changes, but for the empty history."""
    before = (scene.read_bytes(), scene.stat().st_mtime_ns)
    with pytest.raises(InputRefused, match=words) as refusal:
        verb(scene, *arguments, **options)
    assert "\n" not in str(refusal.value)
    assert (scene.read_bytes(), scene.stat().st_mtime_ns) == before
    assert {p.name for p in scene.parent.iterdir()} <= {scene.name, f".{scene.name}.history"}


# What is written


def test_what_is_placed_is_written_as_a_person_would_and_the_rest_keeps_every_byte(scene):
    change = editing.place(scene, "crater", x="5", y="-20cm", heading="30deg", age="3.5", soil="lunar_soft", drivers={"diameter": "1.5"})
    assert change.name == "crater_1"
    new = """[[landform]]
name = "crater_1"
landform = "crater"
x = "5 m"
y = "-20 cm"
heading = "30 deg"
age = 3.5
soil = "lunar_soft"
drivers = { diameter = "1.5 m" }

"""
    before, after = SCENE.split("# a stone")
    assert scene.read_text() == before + new + "# a stone" + after
    terrain = build(scene)
    assert [placed.name for placed in terrain.landforms] == ["bowl", "hill", "crater_1"]
    assert terrain.landforms[2].y == pytest.approx(-0.2)


def test_names_go_on_from_the_highest(scene):
    editing.place(scene, "crater", name="crater_7", drivers={"diameter": "1 m"})
    assert editing.place(scene, "crater", drivers={"diameter": "1 m"}).name == "crater_8"
    assert editing.place(scene, "mound", drivers={"diameter": "1 m", "height": "10 cm"}).name == "mound_1"


def test_moving_keeps_units_and_comments(scene):
    editing.move(scene, "bowl", by=("20 cm", "-50 cm"))
    editing.move(scene, "hill", by=("1", "5 m"))
    editing.move(scene, "stone", x="150 cm")
    assert scene.read_text() == (
        SCENE.replace('x = "2 m"      # east', 'x = "2.2 m"      # east')
        .replace("y = -1.5", 'y = "-2 m"')
        .replace('x = "-40 dm"', 'x = "-30 dm"')
        .replace('y = "20 cm"', 'y = "520 cm"')
        .replace('x = "1 m"', 'x = "150 cm"')
    )


def test_turning_is_counted_in_degrees_from_minus_180_to_180(scene):
    assert editing.rotate(scene, "bowl", to="0.5 rad").entry["heading"] == "0.5 rad"
    assert editing.rotate(scene, "bowl", to="170 deg").entry["heading"] == "170 deg"
    assert editing.rotate(scene, "bowl", by="30 deg").entry["heading"] == "-160 deg"
    assert editing.rotate(scene, "bowl", by="-20 deg").entry["heading"] == "180 deg"
    assert editing.rotate(scene, "stone", by="15 deg").entry["heading"] == "15 deg"


def test_scaling(scene):
    assert editing.scale(scene, "bowl", by=1.5).entry["scale"] == 1.5
    assert editing.scale(scene, "bowl", by=1.2).entry["scale"] == 1.8
    assert editing.scale(scene, "bowl", to=1.0).entry["scale"] == 1.0
    assert editing.scale(scene, "stone", by=2.0).entry["size"] == ["40 cm", "0.2 m", "0.2 m"]
    refused(scene, "scale it --by", editing.scale, "stone", to=2.0)
    refused(scene, "must be larger than 0", editing.scale, "bowl", by=-1.0)


def test_drivers_are_set_and_taken_off_again(scene):
    change = editing.set_drivers(scene, "bowl", {"diameter": "6", "relief": ""}, soil="lunar_soft", age="4")
    assert change.entry["drivers"] == {"diameter": "6 m"}
    assert (change.entry["soil"], change.entry["age"]) == ("lunar_soft", 4)
    assert "# old" in scene.read_text()
    change = editing.set_drivers(scene, "hill", {"height": "70 cm"}, soil="", age="")
    assert 'diameter = "3 m"   # foot' in scene.read_text()
    assert change.entry["drivers"]["height"] == "70 cm"
    change = editing.set_drivers(scene, "hill", {"height": "", "angle": "20 deg"}, landform="cone")
    assert change.entry["landform"] == "cone"
    refused(scene, "does not set the driver 'relief'", editing.set_drivers, "bowl", {"relief": ""})
    refused(scene, "needs the driver 'diameter'", editing.set_drivers, "bowl", {"diameter": ""})


def test_what_lies_beside_the_ground_is_written_and_said(scene):
    """The ground spans x -10 to 10 and y -6 to 6 m; a crater of 4 m reaches up to 3 m from its centre."""
    assert editing.move(scene, "bowl", x="12 m").note == ""
    assert "beside the ground, which spans x -10 to 10 m and y -6 to 6 m" in editing.move(scene, "bowl", x="15 m").note


def test_what_falls_between_the_heights_is_not_called_beside_them(scene):
    """A crater of a decimetre at a posting of 0.5 m."""
    note = editing.place(scene, "crater", x="0.25 m", y="0.25 m", drivers={"diameter": "10 cm"}).note
    assert "lies between the heights of the ground, which stand 0.5 m apart" in note


def test_what_is_removed_takes_its_comment_along(scene):
    editing.remove(scene, "bowl")
    block = SCENE[SCENE.index("# the big one") : SCENE.index("# soft floor")]
    assert scene.read_text() == SCENE.replace(block, "")
    editing.remove(scene, "soft")
    assert "soft floor" not in scene.read_text()
    assert tomllib.loads(scene.read_text())["obstacle"][0]["name"] == "stone"


def test_the_last_table_of_a_file_can_go_and_one_can_come_after_it(scene):
    text = SCENE[: SCENE.index("# soft floor")].rstrip("\n")  # no line end at all
    scene.write_text(text)
    editing.place(scene, "crater", drivers={"diameter": "1 m"})
    assert scene.read_text().startswith(text + "\n\n[[landform]]\n")
    editing.remove(scene, "crater_1")
    assert scene.read_text() == text + "\n"


def test_line_ends_of_windows_stay(scene):
    scene.write_bytes(SCENE.replace("\n", "\r\n").encode())
    editing.rotate(scene, "bowl", to="3 deg")
    editing.place(scene, "crater", drivers={"diameter": "1 m"})
    content = scene.read_bytes()
    assert content.count(b"\r\n") == content.count(b"\n") > SCENE.count("\n")


def test_text_that_looks_like_a_table_is_none(scene):
    """Strings over several lines, brackets in strings, quoted keys and nested arrays."""
    trap = '"""\n[[landform]]\nname = "bowl"\n# x ]]\n"""'
    scene.write_text(SCENE.replace("[[material]]", f'[["material"]]  # [[landform]]\nsource = {trap}'))
    editing.move(scene, "bowl", x="7 m")
    assert trap in scene.read_text()
    assert tomllib.loads(scene.read_text())["landform"][0]["x"] == "7 m"


def test_one_name_for_two_things_needs_the_kind(scene):
    scene.write_text(SCENE.replace('name = "stone"', 'name = "bowl"'))
    refused(scene, "'bowl' is the name of landform and obstacle in .*; say which with --kind landform", editing.remove, "bowl")
    assert editing.remove(scene, "bowl", kind="obstacle").kind == "obstacle"


def test_a_list_of_inline_tables_is_left_alone(scene):
    array = 'landform = [{ name = "a", landform = "crater", x = 0, y = 0, drivers = { diameter = 2 } }]\n'
    top, base = SCENE[: SCENE.index("# what")], SCENE[SCENE.index("# what") : SCENE.index("# the big one")]
    scene.write_text(top + array + base)
    refused(scene, r"written as one array.*\[\[landform\]\]", editing.place, "crater", drivers={"diameter": "1 m"})
    refused(scene, r"within one array", editing.move, "a", x="1 m")


# What is refused


@pytest.mark.parametrize(
    ("words", "landform", "options"),
    [
        ("'kreater', which is not registered", "kreater", {}),
        ("'diametre', which crater does not have; did you mean 'diameter'", "crater", {"drivers": {"diametre": "5 m"}}),
        ("needs the driver 'diameter'", "crater", {}),
        (r"relief.*is 3 .*between 0\.01 and 1 .*fresh", "crater", {"drivers": {"diameter": "5 m", "relief": "3"}}),
        ("5 kg", "crater", {"drivers": {"diameter": "5 kg"}}),
        ("x is", "crater", {"x": "far", "drivers": {"diameter": "5 m"}}),
        ("heading is 30 without a unit; write for example '30 deg'", "crater", {"heading": "30", "drivers": {"diameter": "5 m"}}),
        ("angle.*is 0.2 without a unit", "cone", {"drivers": {"diameter": "5 m", "angle": "0.2"}}),
        ("soil 'moon_dust'", "crater", {"soil": "moon_dust", "drivers": {"diameter": "5 m"}}),
        ("2 landforms called 'bowl'", "crater", {"name": "bowl", "drivers": {"diameter": "5 m"}}),
        ("scale", "crater", {"scale": -2.0, "drivers": {"diameter": "5 m"}}),
        ("age of .* is 'old'", "crater", {"age": "old", "drivers": {"diameter": "5 m"}}),
        ("age of .* is '3 m'", "crater", {"age": "3 m", "drivers": {"diameter": "5 m"}}),
    ],
)
def test_what_a_scene_would_be_refused_for_is_never_written(scene, words, landform, options):
    refused(scene, words, editing.place, landform, **options)


def test_ages_are_times_or_bare_numbers_but_not_both(scene):
    """2 Gyr are older than 300 Myr and lie below; a bare 40 beside them could be anything."""
    young = editing.place(scene, "mound", name="young", age="300 Myr", drivers={"diameter": "3 m", "height": "1 m"})
    assert young.entry["age"] == "300 Myr"
    editing.place(scene, "crater", name="old", age="2 Gyr", drivers={"diameter": "3 m"})
    names = [item.instance.name for item in read_scene(scene).items]
    assert names.index("old") < names.index("young") < names.index("bowl")  # from the lowest to the topmost
    refused(scene, "age of landform 'odd' is 40 without a unit, and that of .* give all ages of the scene a unit, or none",
            editing.place, "mound", name="odd", age="40", drivers={"diameter": "3 m", "height": "1 m"})  # fmt: skip


def test_names_that_are_not_there(scene):
    refused(scene, "no landform or obstacle called 'bowls'; did you mean 'bowl'", editing.move, "bowls", x="1 m")
    refused(scene, "no landform or population or soil patch or obstacle called 'x'", editing.remove, "x")
    refused(scene, "no landform or obstacle called 'soft'", editing.move, "soft", x="1 m")
    refused(scene, "needs --x and --y, or --by", editing.move, "bowl")
    refused(scene, "needs --to or --by", editing.rotate, "bowl", to="1 deg", by="1 deg")
    refused(scene, "the angle is|angle is 5 without a unit", editing.rotate, "bowl", by="5")


def test_a_scene_that_is_missing_or_broken(scene, tmp_path):
    with pytest.raises(InputRefused, match=r"there is no scene .*rille terrain new"):
        editing.undo(tmp_path / "none.toml")
    scene.write_text(SCENE + "[[landform]\n")
    refused(scene, "not valid TOML", editing.move, "bowl", x="1 m")
    scene.write_bytes(SCENE.encode() + b"# \xff\n")
    refused(scene, "not UTF-8", editing.move, "bowl", x="1 m")


# The history


def test_undo_and_redo_pass_through_every_state(scene):
    texts = [SCENE]
    for x in ("1 m", "2 m", "3 m"):
        editing.move(scene, "bowl", x=x, y="0 m")
        texts.append(scene.read_text())
    assert editing.undo(scene).what == ("move bowl",)
    assert scene.read_text() == texts[2]
    done = editing.undo(scene, 2)
    assert (done.undo, done.redo) == (0, 3)
    assert scene.read_text() == SCENE
    refused(scene, "has no edit to undo, not 1", editing.undo)
    editing.redo(scene, 3)
    assert scene.read_text() == texts[3]
    refused(scene, "has no edit to redo, not 2", editing.redo, 2)
    refused(scene, "has 3 edits to undo, not 4", editing.undo, 4)


def test_an_edit_after_an_undo_loses_nothing(scene):
    """a, b, undo both, c: going back from c passes through a and b again."""
    texts = {SCENE}
    for name in ("a", "b"):
        editing.place(scene, "crater", name=name, drivers={"diameter": "1 m"})
        texts.add(scene.read_text())
    editing.undo(scene, 2)
    editing.place(scene, "crater", name="c", drivers={"diameter": "1 m"})
    texts.add(scene.read_text())
    seen = {scene.read_text()}
    for _ in range(history.read_journal(scene).at):
        editing.undo(scene)
        seen.add(scene.read_text())
    assert seen == texts
    assert scene.read_text() == SCENE


def test_edits_by_hand_are_states_too(scene):
    editing.move(scene, "bowl", x="1 m")
    by_hand = scene.read_text().replace("trailing", "by hand")
    scene.write_text(by_hand)
    editing.move(scene, "bowl", x="3 m")
    assert "by hand" in scene.read_text()
    assert editing.undo(scene, 2).what == ("move bowl", history.HAND)
    assert "by hand" not in scene.read_text()
    editing.redo(scene)
    assert scene.read_text() == by_hand


def test_undo_mends_what_a_hand_broke(scene):
    editing.move(scene, "bowl", x="1 m")
    good = scene.read_text()
    scene.write_text("oh no")
    assert editing.undo(scene).what == (history.HAND,)
    assert scene.read_text() == good


def test_what_changes_nothing_is_no_state(scene):
    editing.rotate(scene, "bowl", to="3 deg")
    assert editing.rotate(scene, "bowl", to="3 deg").edited.what == ()
    assert len(history.read_journal(scene).states) == 2


def test_a_broken_history_is_said_and_the_scene_stays(scene):
    editing.move(scene, "bowl", x="1 m")
    (history.folder_of(scene) / "journal.json").write_text('{"at": 7, "states": []}')
    refused(scene, "history of .* cannot be read .*move the folder", editing.undo)


def test_a_state_that_was_tampered_with_is_not_restored(scene):
    editing.move(scene, "bowl", x="1 m")
    first = history.read_journal(scene).states[0].digest
    (history.folder_of(scene) / f"{first}.toml").write_text("else")
    refused(scene, "was changed on disk", editing.undo)


# Nothing is half-written


def _crash_at(scene, fatal):
    """Move in a process that dies at its n-th fsync or rename, as by a power cut."""
    count = 0

    def dying(function):
        def call(*arguments, **options):
            nonlocal count
            count += 1
            if count == fatal:
                os._exit(9)
            return function(*arguments, **options)

        return call

    os.fsync = dying(os.fsync)
    Path.replace = dying(Path.replace)
    editing.move(scene, "bowl", x="9 m")
    os._exit(0)


def test_a_crash_at_any_moment_leaves_the_old_scene_or_the_new_one(scene):
    """The process dies at every fsync and rename in turn; then the next edits work, and undo still finds every state."""
    editing.move(scene, "bowl", x="1 m")
    seen = set()
    context = multiprocessing.get_context("fork")
    for fatal in range(1, 30):
        before = scene.read_text()
        child = context.Process(target=_crash_at, args=(scene, fatal))
        child.start()
        child.join(60)
        after = scene.read_text()
        assert after in (before, before.replace('x = "1 m"      # east', 'x = "9 m"      # east'))
        seen.add(after != before)
        editing.move(scene, "bowl", x="1 m")
        if child.exitcode == 0:
            break
    assert child.exitcode == 0
    assert fatal > 6
    assert seen == {True, False}
    while history.read_journal(scene).at > 0:
        editing.undo(scene)
    assert scene.read_text() == SCENE


@pytest.mark.parametrize("trouble", ["write", "fsync", "rename"])
def test_a_full_disk_is_one_sentence_and_changes_nothing(scene, monkeypatch, trouble):
    import errno

    editing.move(scene, "bowl", x="1 m")

    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    if trouble == "fsync":
        monkeypatch.setattr(os, "fsync", full)
    elif trouble == "rename":
        monkeypatch.setattr(Path, "replace", full)
    else:
        original = Path.open
        monkeypatch.setattr(Path, "open", lambda self, *a, **k: full() if "w" in str(a) + str(k) else original(self, *a, **k))
    refused(scene, "cannot be written.*No space left.*nothing was changed", editing.move, "bowl", x="4 m")
    monkeypatch.undo()
    editing.move(scene, "bowl", x="4 m")
    assert editing.undo(scene, 2).what == ("move bowl", "move bowl")


def _move_as_someone_else(scene, answer):
    if os.geteuid() == 0:
        os.seteuid(65534)
    try:
        editing.move(scene, "bowl", x="4 m")
    except InputRefused as refusal:
        answer.put(str(refusal))


@pytest.mark.parametrize("edited_before", [False, True])
def test_a_folder_that_cannot_be_written_is_one_sentence(edited_before):
    """As a user who may read the scene, but not write beside it; root may everything, so a child process becomes someone else."""
    folder = Path(tempfile.mkdtemp())  # pytest's own folders are closed to others
    try:
        scene = folder / "scene.toml"
        scene.write_text(SCENE)
        if edited_before:
            editing.move(scene, "bowl", x="1 m")
            history.folder_of(scene).chmod(0o555)
            (history.folder_of(scene) / "lock").chmod(0o444)
        folder.chmod(0o555)
        before = scene.read_bytes()
        context = multiprocessing.get_context("fork")
        answer = context.Queue()
        child = context.Process(target=_move_as_someone_else, args=(scene, answer))
        child.start()
        sentence = f"'{scene}' cannot be edited (Permission denied); nothing was changed; copy it to a folder of yours"
        assert answer.get(timeout=60) == sentence
        child.join(60)
        assert scene.read_bytes() == before
    finally:
        folder.chmod(0o755)
        shutil.rmtree(folder)


def test_someone_elses_edit_is_not_overwritten(scene, monkeypatch):
    monkeypatch.setattr(editing, "read_scene", lambda path: scene.write_text(SCENE + "# mine\n"))
    with pytest.raises(InputRefused, match="changed by someone else just now; nothing was written"):
        editing.move(scene, "bowl", x="1 m")
    assert scene.read_text() == SCENE + "# mine\n"


def test_another_command_at_the_same_file_is_waited_for_and_then_named(scene, monkeypatch):
    editing.move(scene, "bowl", x="1 m")
    monkeypatch.setattr(history, "PATIENCE", 0.1)
    with (history.folder_of(scene) / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        refused(scene, "another command is editing", editing.move, "bowl", x="2 m")
    editing.move(scene, "bowl", x="2 m")


def _place_some(scene, who):
    for k in range(4):
        editing.place(scene, "crater", name=f"{who}{k}", drivers={"diameter": "1 m"})


def test_edits_at_the_same_time_all_arrive(scene):
    context = multiprocessing.get_context("fork")
    children = [context.Process(target=_place_some, args=(scene, who)) for who in "ab"]
    for child in children:
        child.start()
    for child in children:
        child.join(60)
        assert child.exitcode == 0
    names = {entry["name"] for entry in tomllib.loads(scene.read_text())["landform"]}
    assert {f"{who}{k}" for who in "ab" for k in range(4)} <= names
    assert len(history.read_journal(scene).states) == 9


def test_mode_and_links_stay(scene, tmp_path):
    scene.chmod(0o640)
    link = tmp_path / "link.toml"
    link.symlink_to("scene.toml")
    editing.move(link, "bowl", x="1 m")
    assert link.is_symlink()
    assert 'x = "1 m"      # east' in scene.read_text()
    assert stat.S_IMODE(scene.stat().st_mode) == 0o640
    assert editing.undo(scene).what == ("move bowl",)


# To begin with


@pytest.mark.parametrize("base", ["flat", "plane", "fractal"])
def test_a_new_scene_can_be_built_at_once(tmp_path, base):
    file = tmp_path / "new.toml"
    new_scene(file, base=base, size=("8 m", "6 m"), posting="0.5 m")
    assert build(file).heights.shape == (13, 17)
    editing.place(file, "crater", drivers={"diameter": "2 m"})
    before = file.read_bytes()
    with pytest.raises(InputRefused, match="exists already"):
        new_scene(file)
    assert file.read_bytes() == before


@pytest.mark.parametrize("missing", [0, 5])
def test_a_new_scene_on_a_dem_with_holes_fills_them_and_says_so(tmp_path, missing):
    heights = np.add.outer(np.arange(12.0), np.arange(10.0))
    heights[4, 2 : 2 + missing] = np.nan
    transform = rasterio.Affine(2, 0, 500000, 0, -2, 4000000)
    size = {"height": 12, "width": 10, "count": 1, "dtype": "float64"}
    with rasterio.open(tmp_path / "dem.tif", "w", driver="GTiff", crs="EPSG:32633", transform=transform, **size) as raster:
        raster.write(heights, 1)
    file = tmp_path / "new.toml"
    notes = new_scene(file, base="dem", dem="dem.tif")
    assert notes == (("5 heights of 'dem.tif' are missing; the scene interpolates them (fill_holes = true)",) if missing else ())
    filled = build(file).filled
    assert (0 if filled is None else filled.sum()) == missing


def test_a_new_scene_that_cannot_be_is_not_written(tmp_path):
    file = tmp_path / "new.toml"
    for words, options in (
        ("needs its file: --dem", {"base": "dem"}),
        ("--dem needs --base dem", {"dem": "a.tif"}),
        ("a.tif", {"base": "dem", "dem": "a.tif"}),
        ("soil 'dust'", {"soil": "dust"}),
        ("size", {"size": ("8 kg", "6 m")}),
    ):
        with pytest.raises(InputRefused, match=words) as refusal:
            new_scene(file, **options)
        assert ".new" not in str(refusal.value)
        assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputRefused, match="cannot be written"):
        new_scene(tmp_path / "nowhere" / "new.toml")


def test_what_a_scene_holds(scene):
    held = contents(scene)
    assert (held["name"], held["base"]) == ("site", "flat")
    bowl, hill = held["kinds"]["landform"]
    assert (bowl["x_m"], bowl["y_m"], bowl["heading_deg"], bowl["of"]) == (2.0, -1.5, 0.0, "crater")
    assert bowl["drivers"] == {"diameter": "4 m", "relief": 0.5}
    assert hill["x_m"] == pytest.approx(-4.0)
    assert [entry["name"] for entry in held["kinds"]["obstacle"]] == ["stone"]
    assert held["kinds"]["soil_patch"][0]["facts"] == "lunar_soft, 3 corners"
