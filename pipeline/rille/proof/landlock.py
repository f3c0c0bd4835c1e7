"""Landlock: a process of Linux gives up, for itself and all its children, every file but those of some folders.

Only system calls (landlock(7), https://docs.kernel.org/userspace-api/landlock.html), no other module of rille: it runs between fork and
exec. It holds for root too. It denies contents, not names: whether a path exists can still be asked. Devices cannot be made, other
processes not be traced, so neither their memory nor their environment be read. TCP is denied from version 4 on; signals and abstract
sockets to processes outside from version 6 on. UDP and named Unix sockets are not denied by any version to 7.
"""

import ctypes
import os
from collections.abc import Sequence

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446  # numbers of the system calls, the same on all usual processors
VERSION_FLAG, PATH_BENEATH = 1, 1
NO_NEW_PRIVS = 38  # of prctl

EXECUTE, WRITE_FILE, READ_FILE, READ_DIR, REMOVE_DIR, REMOVE_FILE = (1 << k for k in range(6))
MAKE_CHAR, MAKE_DIR, MAKE_REG, MAKE_SOCK, MAKE_FIFO, MAKE_BLOCK, MAKE_SYM = (1 << k for k in range(6, 13))
REFER, TRUNCATE, IOCTL_DEV = (1 << k for k in range(13, 16))
READ = EXECUTE | READ_FILE | READ_DIR
WRITE = WRITE_FILE | REMOVE_DIR | REMOVE_FILE | MAKE_DIR | MAKE_REG | MAKE_SOCK | MAKE_FIFO | MAKE_SYM | REFER | TRUNCATE
OF_FILES = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE  # what a rule about a single file may grant
FILE_RIGHTS = ((1, (1 << 13) - 1), (2, REFER), (3, TRUNCATE), (5, IOCTL_DEV))  # since version
TCP = 3  # bind, connect; since version 4
SCOPES = 3  # abstract Unix sockets, signals; since version 6


class _Ruleset(ctypes.Structure):
    _fields_ = [("files", ctypes.c_uint64), ("network", ctypes.c_uint64), ("scopes", ctypes.c_uint64)]


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = [("allowed", ctypes.c_uint64), ("folder", ctypes.c_int32)]


def version() -> int:
    """Version of the kernel's Landlock (its ABI); 0: it has none, or it is switched off."""
    try:
        return max(0, _call(CREATE_RULESET, None, ctypes.c_size_t(0), VERSION_FLAG))
    except OSError:
        return 0


def restrict(read: Sequence[str], write: Sequence[str]) -> None:
    """Deny this thread and its children all files but these, for ever.

    read : folders or files that may be read and run. write : those that may be read, written, run. Paths that are missing are skipped.

    Raises
    ------
    OSError : if the kernel refuses.
    """
    have = version()
    files = sum(rights for since, rights in FILE_RIGHTS if have >= since)
    ruleset = _Ruleset(files, TCP if have >= 4 else 0, SCOPES if have >= 6 else 0)
    size = 8 if have < 4 else 16 if have < 6 else 24
    rules = _call(CREATE_RULESET, ctypes.byref(ruleset), ctypes.c_size_t(size), 0)
    try:
        for paths, rights in ((read, READ), (write, READ | WRITE)):
            for path in paths:
                _allow(rules, path, rights & files)
        if ctypes.CDLL(None, use_errno=True).prctl(NO_NEW_PRIVS, 1, 0, 0, 0):
            raise OSError(ctypes.get_errno(), "prctl(PR_SET_NO_NEW_PRIVS) failed")
        _call(RESTRICT_SELF, rules, 0)
    finally:
        os.close(rules)


def _allow(rules: int, path: str, rights: int) -> None:
    try:
        handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except FileNotFoundError:
        return
    try:
        rights = rights if os.path.isdir(path) else rights & OF_FILES  # noqa: PTH112
        rule = _PathBeneath(rights, handle)
        _call(ADD_RULE, rules, PATH_BENEATH, ctypes.byref(rule), 0)
    finally:
        os.close(handle)


def _call(*arguments: object) -> int:
    found = ctypes.CDLL(None, use_errno=True).syscall(*arguments)
    if found < 0:
        raise OSError(ctypes.get_errno(), f"system call {arguments[0]} of Landlock: {os.strerror(ctypes.get_errno())}")
    return found
