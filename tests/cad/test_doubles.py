"""A part that was pasted and never moved is told: its mass would count twice."""

import cadquery as cq

from rille.cad.files.step_reader import read_step

BOX = cq.Workplane("XY").box(10, 20, 30)


def notes_of(tmp_path, *placed):
    """Notes of an assembly of parts (name, shape, x [mm])."""
    whole = cq.Assembly(name="whole")
    for name, shape, x in placed:
        whole.add(shape, name=name, loc=cq.Location(cq.Vector(x, 0, 0)))
    whole.export(str(tmp_path / "whole.step"))
    return read_step(tmp_path / "whole.step").notes


def test_a_copy_in_one_place_is_told_by_name(tmp_path):
    (note,) = notes_of(tmp_path, ("one", BOX, 0), ("other", BOX, 40), ("copy", BOX, 40))
    assert "copy" in note
    assert "other" in note
    assert "its mass counts twice" in note


def test_a_copy_that_was_drawn_where_it_stands_is_told(tmp_path):
    """The same box, once placed 40 mm along x and once drawn there."""
    (note,) = notes_of(tmp_path, ("placed", BOX, 40), ("drawn", BOX.translate((40, 0, 0)), 0))
    assert "placed" in note
    assert "drawn" in note


def test_many_copies_are_five_sentences_and_a_number(tmp_path):
    notes = notes_of(tmp_path, *((f"copy_{k}", BOX, 0) for k in range(9)))
    assert len(notes) == 6
    assert notes[-1] == "3 more parts stand twice in one place"


def test_what_shares_a_centre_or_touches_is_no_copy(tmp_path):
    """A core in a shell of the same centre, and two boxes side by side."""
    shell = cq.Workplane("XY").box(14, 24, 34).cut(BOX)
    assert notes_of(tmp_path, ("core", BOX, 0), ("shell", shell, 0), ("beside", BOX, 14)) == ()
