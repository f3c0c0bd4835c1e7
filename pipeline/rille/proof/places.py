"""What a command in a room may read besides it: Python, rille, libraries; found out, as far as it differs between machines."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

# Where Linux keeps libraries, fonts and time zones, what the loader and the C library read, and how many processors there are. Of /proc no
# process, not even its own: import and diagnosis need none, and the command line of the parent tells the beacon.
SYSTEM = ("/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/share", "/usr/bin", "/usr/local/lib", "/usr/local/share", "/lib", "/lib64", "/bin")
SETTINGS = tuple(
    f"/etc/{name}"
    for name in (
        "ld.so.cache",
        "ld.so.conf",
        "ld.so.conf.d",
        "alternatives",
        "fonts",
        "localtime",
        "mime.types",
        "nsswitch.conf",
        "passwd",
        "group",
    )
)
KERNEL = ("/dev/random", "/dev/urandom", "/dev/zero", "/proc/cpuinfo", "/proc/meminfo", "/sys/devices/system")
OUTWARD = ("/dev/null",)
DATA = ("schema", "terrain_library")  # of rille, beside the package in a checkout
PATIENCE = 60.0  # [s]

ASK_PATHS = """
import importlib.util, json, sys
found = importlib.util.find_spec("rille")
print(json.dumps([*sys.path, sys.prefix, sys.base_prefix, sys.exec_prefix, *found.submodule_search_locations]))
"""


@cache
def python_folders() -> tuple[Path, ...]:
    """Folders that this Python and rille are read from, as a fresh interpreter names them; what holds another is named once."""
    done = subprocess.run([sys.executable, "-I", "-c", ASK_PATHS], capture_output=True, text=True, timeout=PATIENCE, check=True)
    named = [Path(path) for path in json.loads(done.stdout) if path]
    named += [package.parent.parent / name for package in named if package.name == "rille" for name in DATA]
    found = {path.resolve() for path in named if path.exists()}
    return tuple(sorted(path for path in found if not any(path != other and path.is_relative_to(other) for other in found)))
