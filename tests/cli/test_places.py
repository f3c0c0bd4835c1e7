"""Is a result written only where nothing that is needed lies?"""

import sqlite3
from contextlib import closing

import pytest

from rille.cli.places import require_place
from rille.model import InputRefused


def test_new_and_old_results_have_a_place(tmp_path):
    (tmp_path / "old.html").write_text("<html>")
    (tmp_path / "empty.db").touch()
    require_place(tmp_path / "new.html", None, tmp_path / "old.html", tmp_path / "empty.db", reads=[tmp_path / "sheet.toml", None])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("model.db", "is a database, and would be written over"),
        ("link", "is a database, and would be written over"),
        ("sheet.toml", "is what is read, and would be written over"),
        ("away/../sheet.toml", "is what is read, and would be written over"),
        ("nowhere/a.html", "there is no folder"),
        ("away", "it is a folder"),
    ],
)
def test_what_is_needed_is_not_written_over(tmp_path, name, words):
    (tmp_path / "away").mkdir()
    (tmp_path / "sheet.toml").write_text("a = 1")
    with closing(sqlite3.connect(tmp_path / "model.db")) as connection, connection:
        connection.execute("CREATE TABLE t (x)")
    (tmp_path / "link").symlink_to(tmp_path / "model.db")
    with pytest.raises(InputRefused, match=words):
        require_place(tmp_path / "a.png", tmp_path / name, reads=[tmp_path / "sheet.toml"])


def test_two_results_are_two_files(tmp_path):
    with pytest.raises(InputRefused, match="for two results"):
        require_place(tmp_path / "a", tmp_path / "b", tmp_path / "a")
