"""Folders of workers: gone with their owner, or when the next one is made if it was killed."""

import os
import subprocess
import sys
import time
from pathlib import Path

from rille.work.scratch import Scratch, remove_abandoned

OWNER = "from rille.work.scratch import Scratch; s = Scratch(); print(s.name, flush=True); input()"


def old(folder):
    """Made two minutes ago."""
    os.utime(folder, (time.time() - 120,) * 2)


def test_a_folder_goes_when_its_owner_was_killed_and_not_before(tmp_path):
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(tmp_path)}
    )
    (name,) = owner.stdout.readline().split()
    (tmp_path / name / "begun").write_text("half a file")
    old(name)
    remove_abandoned(tmp_path)
    assert Path(name).exists()  # somebody owns it
    owner.kill()
    owner.wait()
    old(name)
    remove_abandoned(tmp_path)
    assert not Path(name).exists()


def test_young_folders_links_and_others_stay(tmp_path):
    (tmp_path / "rille-workers-young").mkdir()
    (tmp_path / "rille-workers-young" / "owner").touch()
    (tmp_path / "rille-workers-without-a-lock").mkdir()
    old(tmp_path / "rille-workers-without-a-lock")
    (tmp_path / "other").mkdir()
    (tmp_path / "rille-workers-link").symlink_to(tmp_path / "other")
    old(tmp_path / "other")
    remove_abandoned(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"rille-workers-young", "rille-workers-without-a-lock", "other", "rille-workers-link"}


def test_a_folder_is_removed_once(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    made = Scratch()
    made.remove()
    made.remove()
    assert list(tmp_path.iterdir()) == []
