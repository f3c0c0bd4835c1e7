"""The command ``rille`` as a child process."""

import subprocess
import sys
from pathlib import Path

RILLE = str(Path(sys.executable).parent / "rille")


def rille(*arguments, **options):
    """Run the command to its end."""
    return subprocess.run([RILLE, *map(str, arguments)], capture_output=True, text=True, timeout=300, check=False, **options)


def assert_refused(done, *words):
    """Exit code 3, one sentence on stderr with the words, nothing on stdout."""
    assert done.returncode == 3, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("rille: ")
    assert done.stderr.count("\n") == 1, done.stderr
    for word in words:
        assert word in done.stderr
