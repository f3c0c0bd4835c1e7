"""A temporary folder that does not outlive its owner for long, even where that is killed."""

import fcntl
import os
import shutil
import tempfile
import time
from pathlib import Path

PREFIX = "rille-workers-"
LOCK = "owner"  # a file that its owner keeps locked; the lock goes with the process
YOUNG = 60.0  # [s] within which its owner may still be about to lock it


class Scratch:
    """A folder for temporary files. Folders whose owner was killed (kill -9, out of memory) are removed when the next one is made."""

    def __init__(self) -> None:
        remove_abandoned(Path(tempfile.gettempdir()))
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self.name = self._folder.name
        self._lock = os.open(Path(self.name) / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """Remove it with all that lies in it. A second time does nothing."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1
            self._folder.cleanup()


def remove_abandoned(place: Path) -> None:
    """Remove folders of ``Scratch`` in a place that nobody owns any more; those of other users, without a lock, and what cannot be removed
    stay.
    """
    for folder in place.glob(PREFIX + "*"):
        try:
            found = folder.lstat()
            if found.st_uid != os.getuid() or time.time() - found.st_mtime < YOUNG or folder.is_symlink():
                continue
            lock = os.open(folder / LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
        except OSError:
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
        except OSError:
            continue  # somebody owns it
        finally:
            os.close(lock)
