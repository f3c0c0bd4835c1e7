"""The door of a room: shuts it behind itself, then becomes the command. ``python -I -m rille.proof.enter SETTING COMMAND...``

SETTING is JSON: ``landlock`` (or not), ``read``, ``write`` (paths), ``memory`` [bytes] or null, ``parent`` (its process), ``status`` (a
pipe that closes when the command runs; before that it takes what went wrong).
"""

import ctypes
import json
import os
import resource
import signal
import sys

from rille.proof import landlock

PARENT_DEATH_SIGNAL = 1  # of prctl


def main() -> None:
    """Die with the parent, bound the memory, give up all files but the room's, run the command."""
    setting, command = json.loads(sys.argv[1]), sys.argv[2:]
    status = int(setting["status"])
    try:
        ctypes.CDLL(None).prctl(PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != setting["parent"]:
            raise OSError("the program that opened the room is gone")
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if setting["memory"] is not None:
            resource.setrlimit(resource.RLIMIT_AS, (setting["memory"], setting["memory"]))
        if setting["landlock"]:
            landlock.restrict(setting["read"], setting["write"])
        os.set_inheritable(status, False)
        os.execve(command[0], command, os.environ)
    except (OSError, ValueError) as error:
        os.write(status, str(error).encode())
        sys.exit(127)


if __name__ == "__main__":
    main()
