"""Is what cannot be used refused, in one sentence that names it, with nothing stored?"""

import contextlib
import math
import random

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from command import assert_refused, rille
from recording_files import write_bag, write_mcap
from recording_import import CHANNELS, Nowhere, load, manifest
from rille import store
from rille.model import InputRefused
from rille.recording import import_recording, read_manifest
from rille.recording.gate import gate

ROWS = "".join(f"{k * 0.01!r},{math.sin(k * 0.01)!r},{math.cos(k * 0.01)!r}\n" for k in range(200))
GOOD = "t,q,v\n" + ROWS


def refuse(folder, match, path, **options):
    """One sentence, and nothing stored."""
    with pytest.raises(InputRefused, match=match) as refusal:
        load(path, folder / "m.db", **options)
    assert "\n" not in str(refusal.value)
    if (folder / "m.db").exists():
        assert store.recording_names(folder / "m.db", unfinished=True) == ()


FILES = {
    "missing column": (GOOD.replace("q", "angle", 1), "no column 'q'; known: 'angle', 't', 'v'"),
    "nearly the name": (GOOD.replace("v\n", "vv\n", 1), "no column 'v'; did you mean 'vv'"),
    "duplicate header": (GOOD.replace("t,q,v", "t,q,v,q", 1).replace("\n0", ",0\n0"), "2 columns named 'q'"),
    "no header": (ROWS, "has no header: line 1 holds numbers"),
    "header only": ("t,q,v\n", "a header .* but no rows"),
    "empty": ("", "is empty"),
    "comments only": ("# nothing\n# here\n", "comments only"),
    "prose": ("Dear all,\nthe robot broke today.\nBest, K.\n", "no column 't'|no column 'q'"),
    "short row": (GOOD + "2.0,1\n", "line 202 .* has 2 fields, the header has 3"),
    "no number": (GOOD + "2.0,1,fast\n", "line 202, column 'v' .* is 'fast', which is no number"),
    "no time": (GOOD + ",1,2\n", "row 201 .* has no time"),
    "infinite": (GOOD + "2.0,inf,1\n", "is infinite in row 201"),
    "epoch": (GOOD.replace("\n0.0,", "\n1700000000.0,", 1), "counts from some epoch or is in another unit"),
}


@pytest.mark.parametrize("what", FILES)
def test_files(tmp_path, what):
    text, match = FILES[what]
    (tmp_path / "d.csv").write_text(text)
    refuse(tmp_path, match, manifest(tmp_path, "d.csv"))


def test_files_that_are_not_what_they_say(tmp_path):
    (tmp_path / "d.parquet").write_text(GOOD)
    refuse(tmp_path, r"holds CSV \(text\), but its ending says Parquet", manifest(tmp_path, "d.parquet"))
    (tmp_path / "d.csv").write_bytes(bytes(range(256)) * 20)
    refuse(tmp_path, "holds binary data", manifest(tmp_path, "d.csv"))
    (tmp_path / "e.csv").write_text(GOOD)
    refuse(tmp_path, 'manifest says format = "mcap"', manifest(tmp_path, "e.csv", top='format = "mcap"'))
    (tmp_path / "u.csv").write_text(GOOD, encoding="utf-16")
    refuse(tmp_path, "UTF-16", manifest(tmp_path, "u.csv"))
    (tmp_path / "folder").mkdir()
    refuse(tmp_path, "no ROS 2 bag", manifest(tmp_path, "folder"))
    pq.write_table(pa.table({"t": [0.0], "q": ["fast"], "v": [1.0]}), tmp_path / "s.parquet")
    refuse(tmp_path, "column 'q' .* holds string, no numbers", manifest(tmp_path, "s.parquet"))


CHANNEL_ERRORS = {
    "unknown unit": (('"rad"', '"radd"'), "unit 'radd', which is unknown; did you mean 'rad'"),
    "wrong dimension": (('"rad/s"', '"rad"'), "has the unit rad, but joint.velocity is measured in rad/s or m/s"),
    "turns or radians": (('"rad/s"', '"Hz"'), "may mean turns or radians"),
    "no unit": (('unit = "rad"\n', ""), "says no unit"),
    "unreadable unit": (('"rad"', '"rad**"'), "cannot be read"),
    "unknown quantity": (("joint.velocity", "joint.speed"), "quantity 'joint.speed', which is none known here"),
    "component of a scalar": (('"joint.velocity"', '"joint.velocity"\ncomponent = "x"'), "is one number"),
    "no component": (("joint.velocity", "part.linear_velocity"), "says no component"),
    "two for one": (("joint.velocity", "joint.position"), "has the unit rad/s"),
    "unknown key": (('target = "knee"', 'targt = "knee"'), "unknown; did you mean 'target'"),
    "scale 0": (('unit = "rad"\n', 'unit = "rad"\nscale = 0\n'), "is not 0"),
    "scale of another dimension": (('unit = "rad"\n', 'unit = "rad"\nscale = "2 N"\n'), "rad times the scale 2 N"),
    "negative noise": (('unit = "rad"\n', 'unit = "rad"\nnoise = -1\n'), "must be larger than 0"),
    "delay before": (('unit = "rad"\n', 'unit = "rad"\ndelay = "-7 ms"\n'), "delay of channel 'q' is -7 ms; it must lie in 0 to 10 s"),
    "delay too long": (('unit = "rad"\n', 'unit = "rad"\ndelay = "7 min"\n'), "delay of channel 'q' is 7 min; it must lie in 0 to 10 s"),
    "delay not a number": (('unit = "rad"\n', 'unit = "rad"\ndelay = nan\n'), "delay"),
    "role": (('unit = "rad"\n', 'unit = "rad"\nrole = "input"\n'), "'channel\\[1\\].role' is refused"),
    "several targets": (('"knee"', '["knee", "hip"]'), "only a command may have several"),
}


@pytest.mark.parametrize("what", CHANNEL_ERRORS)
def test_channels(tmp_path, what):
    (old, new), match = CHANNEL_ERRORS[what]
    (tmp_path / "d.csv").write_text(GOOD)
    refuse(tmp_path, match, manifest(tmp_path, "d.csv", channels=CHANNELS.replace(old, new, 1)))


def test_numbers_beyond_all_machines(tmp_path):
    """Finite, but not before (or only after) the conversion; dropped on purpose it does no harm; 1e14 is left to the gate."""
    (tmp_path / "d.csv").write_text(GOOD + "2.0,1,3e15\n2.01,1,1\n")
    refuse(tmp_path, r"channel 'v' .* is 3e\+15 rad/s in its row 201 \(at 2 s\).*is the unit or scale right", manifest(tmp_path, "d.csv"))
    load(manifest(tmp_path, "d.csv", channels=CHANNELS.replace("rad/s", "deg/s")), tmp_path / "deg.db")
    drop = '[[correction]]\nkind = "drop_samples"\nchannel = "v"\nstart = 1.995\nend = 2.005\nreason = "damaged"\n'
    load(manifest(tmp_path, "d.csv", channels=CHANNELS + drop), tmp_path / "drop.db")
    (tmp_path / "d.csv").write_text(GOOD)
    large = CHANNELS + "scale = 1e17\n"
    refuse(tmp_path, r"channel 'v' .* is 1e\+17 rad/s in its row 1 ", manifest(tmp_path, "d.csv", channels=large))
    whole = '[[correction]]\nkind = "sort"\nreason = "x"\n'
    refuse(tmp_path, r"channel 'v' .* is 1e\+17 rad/s in its row 1 ", manifest(tmp_path, "d.csv", channels=large + whole))


def test_two_columns_for_one_quantity(tmp_path):
    (tmp_path / "d.csv").write_text(GOOD)
    twins = CHANNELS.replace("joint.velocity", "joint.position").replace("rad/s", "rad")
    refuse(tmp_path, "'q' and 'v' are both joint.position of knee .observed.*redundant = true", manifest(tmp_path, "d.csv", channels=twins))
    load(manifest(tmp_path, "d.csv", channels=twins + "redundant = true\n"), tmp_path / "m.db")


def test_times(tmp_path):
    (tmp_path / "d.csv").write_text(GOOD)
    refuse(tmp_path, "no column 'time'", manifest(tmp_path, "d.csv", time='[time]\ncolumn = "time"'))
    refuse(tmp_path, "unit of the time", manifest(tmp_path, "d.csv", time='[time]\ncolumn = "t"\nunit = "rad"'))
    refuse(tmp_path, "says no column of the time", manifest(tmp_path, "d.csv", time=""))
    refuse(tmp_path, "no row .* has v = 7", manifest(tmp_path, "d.csv", time='[where]\nv = 7\n[time]\ncolumn = "t"'))


def test_corrections(tmp_path):
    (tmp_path / "d.csv").write_text(GOOD)
    for step, match in (
        ('kind = "resample"\nreason = "x"', "needs 'rate'"),
        ('kind = "sort"', "'correction\\[1\\].reason' is missing"),
        ('kind = "cut"\nreason = "x"', "needs start, end or both"),
        ('kind = "cut"\nstart = 1e4\nreason = "x"', "no samples left"),
        ('kind = "drop_samples"\nchannel = "w"\nstart = 1\nreason = "x"', "names the channel 'w'"),
        ('kind = "unwrap"\nby = "1 rad"\nreason = "x"', "needs the channel whose values"),
        ('kind = "unwrap"\nchannel = "q"\nreason = "x"', "needs 'by'"),
        ('kind = "unwrap"\nchannel = "q"\nby = "0 rad"\nreason = "x"', "it must be larger than 0"),
        ('kind = "sort"\nclock = "tt"\nreason = "x"', "names the clock 'tt'; did you mean 't'"),
        ('kind = "sort"\nby = 1\nreason = "x"', "has 'by', which has no meaning there"),
    ):
        refuse(tmp_path, match, manifest(tmp_path, "d.csv", channels=CHANNELS + f"[[correction]]\n{step}\n"))


def test_the_gate_refuses_and_a_manifest_accepts(tmp_path):
    """Time in milliseconds declared as seconds, and a long run of missing values."""
    t = np.arange(3000) * 0.01
    slow = {"t": 1e3 * t, "q": np.sin(t), "v": np.cos(t)}
    pq.write_table(pa.table(slow), tmp_path / "d.parquet")
    refuse(tmp_path, "the data gate refuses recording 'drive'.*(ms|millisecond)", manifest(tmp_path, "d.parquet"), gate=gate)
    holes = {"t": t, "q": np.where((t > 5) & (t < 12), np.nan, np.sin(t)), "v": np.cos(t)}
    pq.write_table(pa.table(holes), tmp_path / "d.parquet")
    refuse(tmp_path, r"data gate refuses.*accepted = \[\"missing\"\]", manifest(tmp_path, "d.parquet"), gate=gate)
    accepting = CHANNELS.replace('unit = "rad"\n', 'unit = "rad"\nmissing = "accept"\n')
    (done,) = load(manifest(tmp_path, "d.parquet", channels=accepting), tmp_path / "m.db", gate=gate)
    (told,) = (finding for finding in done.recording.findings if finding.code == "missing")
    assert told.severity == "warning"
    assert told.message.endswith("the manifest accepts it")


@pytest.mark.parametrize("make", [write_mcap, write_bag])
def test_damaged_bags(tmp_path, make):
    """Cut or overwritten anywhere: refused, or read as far as the format can tell; never another error."""
    whole = make(tmp_path / ("d.mcap" if make is write_mcap else "d.bag"), n=300)
    content = whole.read_bytes()
    channels = '[[channel]]\ncolumn = "/joint_states.position[0]"\nquantity = "joint.position"\ntarget = "left"\nunit = "rad"\n'
    path = manifest(tmp_path, whole.name, channels=channels, time="")
    rng = random.Random(11)
    for k in range(15):
        bad = bytearray(content[: rng.randrange(20, len(content))] if k % 2 else content)
        for _ in range(rng.randrange(1, 30)):
            bad[rng.randrange(16, len(bad))] = rng.randrange(256)
        whole.write_bytes(bad)
        with contextlib.suppress(InputRefused):
            import_recording(read_manifest(path), Nowhere(), tmp_path)


def test_damaged_tables(tmp_path):
    rng = random.Random(12)
    pq.write_table(pa.table({c: np.linspace(0, 1, 500) for c in ("t", "q", "v")}), tmp_path / "g.parquet")
    for k in range(40):
        name = f"{k}.{'csv' if k % 2 else 'parquet'}"
        bad = bytearray(GOOD.encode() if k % 2 else (tmp_path / "g.parquet").read_bytes())
        for _ in range(rng.randrange(1, 8)):
            bad[rng.randrange(len(bad))] = rng.randrange(256)
        (tmp_path / name).write_bytes(bad[: rng.randrange(1, len(bad) + 1)])
        with contextlib.suppress(InputRefused):
            import_recording(read_manifest(manifest(tmp_path, name)), Nowhere(), tmp_path)


def test_what_the_gate_refuses_is_told_and_reported(tmp_path):
    """All findings on stderr, the refusal last, and the page of the gate; nothing stays in the database."""
    (tmp_path / "d.csv").write_text(
        "t,q,v\n" + "".join(f"{k},{math.sin(k * 0.001)!r},{math.cos(k * 0.001)!r}\n" for k in range(0, 20000, 10))
    )
    done = rille("import", manifest(tmp_path, "d.csv"), "-o", tmp_path / "m.db", "--report", tmp_path / "gate.html")
    assert done.returncode == 3
    *findings, refusal = done.stderr.splitlines()
    assert refusal.startswith("rille: the data gate refuses recording 'drive'")
    assert any(line.startswith("error: drive: clock") for line in findings)
    assert "time_unit" in (tmp_path / "gate.html").read_text()
    assert not (tmp_path / "m.db").exists()


def test_the_command_says_one_sentence_and_leaves_no_database(tmp_path):
    (tmp_path / "d.csv").write_text(GOOD)
    (tmp_path / "m.toml").write_text("this is no TOML")
    assert_refused(rille("import", tmp_path / "m.toml", "-o", tmp_path / "m.db"), "is no manifest")
    assert_refused(rille("import", tmp_path / "none.toml", "-o", tmp_path / "m.db"), "no manifest")
    path = manifest(tmp_path, "d.csv", channels=CHANNELS.replace("joint.velocity", "joint.velocty"))
    assert_refused(rille("import", path, "-o", tmp_path / "m.db"), "did you mean 'joint.velocity'")
    assert not list(tmp_path.glob("m.db*"))
    done = rille("import", manifest(tmp_path, "d.csv"), "-o", tmp_path / "m.db", "--json", "--report", tmp_path / "gate.html")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "gate.html").stat().st_size > 1000
    assert_refused(rille("import", manifest(tmp_path, "d.csv"), "-o", tmp_path / "m.db"), "already", "rille record remove")
    listed = rille("record", "list", tmp_path / "m.db")
    assert "drive" in listed.stdout
    assert rille("record", "remove", tmp_path / "m.db", "drive").returncode == 0
    assert_refused(rille("record", "remove", tmp_path / "m.db", "drive"), "holds no recording", "rille import")
