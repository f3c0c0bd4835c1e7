"""Importing in a test: a manifest from keys, and a database as the shelf."""

from rille import store
from rille.cli.import_recording import _Shelf
from rille.recording import import_recording, read_manifest, targets_of

ANGLE = """
[[channel]]
column = "q"
quantity = "joint.position"
target = "knee"
unit = "rad"
"""
CHANNELS = f"""{ANGLE}
[[channel]]
column = "v"
quantity = "joint.velocity"
target = "knee"
unit = "rad/s"
"""


def manifest(folder, file, top="", channels=CHANNELS, time='[time]\ncolumn = "t"\nunit = "s"\n', name="m.toml"):
    """Path of a manifest for ``file`` in ``folder``."""
    path = folder / name
    path.write_text(f'name = "drive"\nfile = "{file}"\n{top}\n{time}\n{channels}')
    return path


def load(path, database, *, gate=None, **options):
    """Import one manifest into a database, which is made if it is not there."""
    if not database.exists():
        store.create(database)
    sheet = read_manifest(path)
    targets = targets_of(store.read_rover(database))
    shelf = _Shelf(database, split=bool(sheet.sheet.split))
    with store.held_open(database):
        return import_recording(sheet, shelf, database.parent, targets=targets, gate=gate, **options)


class Nowhere:
    """A shelf and a sink that keep nothing."""

    def open(self, recording):
        return self

    def remove(self, name):
        pass

    def written(self, clock):
        return 0

    def write(self, clock, time, values):
        assert all(len(value) == len(time) for value in values.values())

    def commit(self):
        pass

    def finish(self, findings, corrections):
        pass
