"""Is the truth really out of reach of a command in the room, and does rille work there all the same?"""

import ctypes
import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

import swung
from recorded import commanded, record
from rille import store
from rille.model import Effect, InputRefused
from rille.proof import landlock, room
from rille.proof.probe import probe
from rille.proof.seal import conceal
from rille.proof.vault import write_vault
from rille.recording.writing import manifest_text, write_recording_file

RILLE = Path(sys.executable).parent / "rille"
shut = pytest.mark.skipif(landlock.version() == 0, reason="this kernel has no Landlock; a room here keeps nothing out")
MARK = "the truth is backlash at the elbow"


@pytest.fixture
def folder(tmp_path):
    """An empty room."""
    path = tmp_path / "room"
    path.mkdir()
    return path


@pytest.fixture
def secret(tmp_path):
    """A file beside the room that its owner may read."""
    path = tmp_path / "truth.json"
    path.write_text(MARK)
    return path


def python(folder, code, *arguments, limit=30.0, **options):
    """Python code in the room."""
    return room.stay([sys.executable, "-c", code, *arguments], folder, limit=limit, **options)


# --- what is kept out


@shut
def test_vault_folders_and_the_parent_cannot_be_read(tmp_path, folder, secret):
    vault = tmp_path / "vault/truths.json"
    write_vault(vault, [conceal(0, {"kind": "backlash"})])
    found = probe(folder, [vault, vault.parent, secret, tmp_path])
    assert len(found) == 4 + 3
    assert [attempt.path for attempt in found if attempt.readable] == []
    assert {attempt.said for attempt in found} == {"Permission denied"}
    assert os.listdir(folder) == []  # noqa: PTH208


READING = {  # each prints what it got of the file, or of this process: its number is sys.argv[2], an address in it sys.argv[3]
    "through a link that it makes": "os.symlink(secret, 'link'); print(open('link').read())",
    "through a hard link": "os.link(secret, 'hard'); print(open('hard').read())",
    "by another program": "print(subprocess.run(['/usr/bin/cat', secret], capture_output=True, text=True, check=True).stdout)",
    "through a process of another": "print(open(f'/proc/{parent}/root{secret}').read())",
    "in its environment": "print(open(f'/proc/{parent}/environ').read())",
    "in its command line": "print(open(f'/proc/{parent}/cmdline').read())",
    "in its memory": "print(os.pread(os.open(f'/proc/{parent}/mem', os.O_RDONLY), 8, address))",
    "by tracing it": "assert libc.ptrace(0x4206, parent, None, None) == 0, ctypes.get_errno(); print('traced')",  # PTRACE_SEIZE
    "by reading its memory across": (
        "b = ctypes.create_string_buffer(8); mine = (ctypes.c_size_t * 2)(ctypes.addressof(b), 8)\n"
        "theirs = (ctypes.c_size_t * 2)(address, 8)\n"
        "assert libc.process_vm_readv(parent, mine, 1, theirs, 1, 0) == 8, ctypes.get_errno(); print(b.raw)"
    ),
    "by a signal to it": "os.kill(parent, 0); print('sent')",
}
SPOILING = {
    "by moving it in": "os.rename(secret, 'moved'); print(open('moved').read())",
    "on the disk itself": "os.mknod('disk', 0o60600, os.makedev(254, 0)); print('made')",
    "by writing to it": "open(secret, 'w').write('x'); print('written')",
    "by removing it": "os.remove(secret); print('removed')",
}
BEFORE = """
import ctypes, os, subprocess, sys
secret, parent, address = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
libc = ctypes.CDLL(None, use_errno=True)
"""
REFUSED = (
    "PermissionError",
    "CalledProcessError",
    "AssertionError: 1\n",
    "Invalid cross-device link",
)  # 1: EPERM; EXDEV: Landlock's for links


@pytest.fixture
def arguments(secret):
    """What the attempts are told."""
    held = ctypes.create_string_buffer(b"12345678")
    yield str(secret), str(os.getpid()), str(ctypes.addressof(held))
    del held


@shut
@pytest.mark.parametrize("way", [*READING, *SPOILING])
def test_a_command_that_tries_reaches_nothing(folder, secret, arguments, way):
    if way == "by a signal to it" and landlock.version() < 6:
        pytest.skip("Landlock keeps signals in from version 6 on")
    got = python(folder, BEFORE + (READING | SPOILING)[way], *arguments)
    assert got.output.strip() == "", got
    assert any(word in got.errors for word in REFUSED), got.errors
    assert secret.read_text() == MARK


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may read the memory of its parent on every Linux")
@pytest.mark.parametrize("way", READING)
def test_the_same_attempts_succeed_outside(tmp_path, arguments, way):
    """The control: it is the room that keeps the secret, not a slip of the attempts."""
    command = [sys.executable, "-c", BEFORE + READING[way], *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=30, check=True)
    assert done.stdout.strip() != ""


@pytest.mark.skipif(landlock.version() < 4, reason="Landlock denies TCP from version 4 on")
def test_there_is_no_way_out_over_tcp(folder):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = str(server.getsockname()[1])
        got = python(folder, "import socket, sys; socket.create_connection(('127.0.0.1', int(sys.argv[1])))", port)
        assert "PermissionError" in got.errors
    assert "PermissionError" in python(folder, "import socket; socket.create_server(('127.0.0.1', 0))").errors


def test_nothing_of_the_environment_is_handed_on(folder, monkeypatch):
    monkeypatch.setenv("RILLE_BEACON", "a sentence")
    got = python(folder, "import os; print(dict(os.environ)); print(os.getcwd())", environment={"OMP_NUM_THREADS": "1"})
    assert "a sentence" not in got.output
    assert "'OMP_NUM_THREADS': '1'" in got.output
    assert got.output.splitlines()[1] == str(folder.resolve())


@shut
def test_it_may_write_into_its_folder_and_a_private_one_that_goes(folder):
    code = "import tempfile; open('here', 'w').write('1'); f = tempfile.mkstemp()[1]; open(f, 'w').write('2'); print(f)"
    got = python(folder, code)
    assert got.code == 0, got.errors
    assert (folder / "here").read_text() == "1"
    assert not Path(got.output.strip()).parent.exists()


def test_a_secret_in_the_room_or_beside_python_is_refused(folder):
    for place in (folder / "truth.json", Path(sys.prefix) / "truth.json", Path("/usr/share/truth.json")):
        with pytest.raises(InputRefused, match="which the room may read; put it elsewhere"):
            python(folder, "print(1)", secrets=[place])


def test_a_probe_of_a_secret_that_is_not_there_is_refused(folder):
    with pytest.raises(InputRefused, match="does not exist, so that nothing is shown"):
        probe(folder, [folder / "none"])


# --- how a stay ends


def test_ends_are_told_apart(folder):
    done = python(folder, "import sys; print('said'); print('meant', file=sys.stderr); sys.exit(3)")
    assert (done.kind, done.code, done.signal, done.output, done.errors) == ("done", 3, "", "said\n", "meant\n")
    assert done.ended - done.begun == pytest.approx(done.seconds, abs=1e-3)
    crashed = python(folder, "import os; os.abort()")
    assert (crashed.kind, crashed.code, crashed.signal) == ("crashed", None, "SIGABRT")
    assert crashed.status == "crashed"
    for code, status in ((0, "done"), (1, "crashed"), (3, "refused"), (4, "refused")):
        assert python(folder, f"raise SystemExit({code})").status == status


def test_what_takes_too_long_is_ended_with_all_that_it_started(folder):
    """The child keeps touching a file; after the end it does not any more."""
    child = "import time\nwhile True: open('beat', 'w').write(str(time.time())); time.sleep(0.02)"
    code = f"import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', {child!r}]); print('on', flush=True); time.sleep(60)"
    got = python(folder, code, limit=1.5)
    assert (got.kind, got.code, got.signal) == ("too long", None, "")
    assert got.output == "on\n"
    assert 1.5 <= got.seconds < 6
    last = (folder / "beat").read_text()
    time.sleep(0.3)
    assert (folder / "beat").read_text() == last


def test_what_it_leaves_behind_ends_with_it(folder):
    child = "import time\nwhile True: open('beat', 'w').write(str(time.time())); time.sleep(0.02)"
    code = f"import os, subprocess, sys, time; subprocess.Popen([sys.executable, '-c', {child!r}])\nwhile not os.path.exists('beat'): pass"
    assert python(folder, code).code == 0
    last = (folder / "beat").read_text()
    time.sleep(0.3)
    assert (folder / "beat").read_text() == last


def test_memory_is_bounded_where_asked(folder):
    code = "x = bytearray(400 << 20); print(len(x))"
    assert "MemoryError" in python(folder, code, memory=300 << 20).errors
    assert python(folder, code).code == 0


def test_a_command_that_is_not_there_is_no_end(folder):
    with pytest.raises(room.RoomFailed, match="No such file"):
        room.stay(["/none/at/all"], folder, limit=5)
    with pytest.raises(InputRefused, match="does not exist"):
        room.stay(["/bin/true"], folder / "none", limit=5)


# --- where there is no Landlock


def test_without_landlock_the_stay_says_so(folder, secret, monkeypatch):
    """In a process of its own: not being dumpable is for good."""
    code = f"""
import sys
from pathlib import Path
from rille.proof import landlock, room
from rille.proof.probe import probe
landlock.version = lambda: 0
room._other_user_reaches_python = lambda: False
got = room.stay([sys.executable, "-c", "print(open({str(secret)!r}).read())"], Path({str(folder)!r}), limit=30)
assert (got.isolation, got.output.strip()) == ("none", {MARK!r}), got
assert [a.readable for a in probe(Path({str(folder)!r}), [Path({str(secret)!r})])][0]
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr


# --- rille itself


@pytest.fixture
def trial(make_model, folder):
    """A room with a double pendulum and a recording of one with more friction."""
    base, scenario = swung.model(make_model, 3, duration=3.0)
    friction = Effect(kind="viscous_friction", target="hinge2", parameters={"coefficient": 0.05})
    real, _ = swung.model(make_model, 3, effects=(friction,), duration=3.0)
    recording = commanded(record(real, swung.sensors(), duration=3.0, rate=200, seed=5), scenario)
    shutil.copy(base, folder / "model.db")
    addresses = write_recording_file(folder / "swing.parquet", recording, {})
    (folder / "swing.toml").write_text(manifest_text(recording, "swing.parquet", "parquet", addresses))
    return folder


def test_rille_imports_and_diagnoses_in_the_room(trial, secret):
    brought = room.stay([RILLE, "import", "swing.toml", "-o", "model.db"], trial, limit=120, secrets=[secret])
    assert (brought.kind, brought.code) == ("done", 0), brought.errors
    command = [RILLE, "diagnose", "model.db", "--only", "viscous_friction", "--json", "-o", "report.html"]
    found = room.stay(command, trial, limit=240, secrets=[secret], environment={"OMP_NUM_THREADS": "1"})
    assert (found.kind, found.code) == ("done", 0), found.errors
    assert "viscous_friction" in found.output
    assert (trial / "report.html").stat().st_size > 0
    assert store.read_findings(trial / "model.db")
    assert found.isolation == room.isolation()
