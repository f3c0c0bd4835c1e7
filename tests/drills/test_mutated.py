"""Files that went wrong on their way: whatever bytes a reader meets, it gives a value or a refusal in a sentence. Never another exception.

A few hundred mutations of a good file for every reader, always the same; ``RILLE_DRILLS=long`` makes 10 000 of each.
"""

import os
import sqlite3
import time
import warnings
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin

from machines import chain
from recording_files import write_bag, write_mcap
from recording_import import manifest
from rille import simulate, store, terrain
from rille.model import Drive, InputRefused, Rover
from rille.proof.real import read_real
from rille.recording import read_manifest
from rille.recording.reading import open_source
from rille.recording.reading.piece import Wanted
from rille.store.database import reading
from rille.store.soundness import columns
from rille.study import read_study_sheet
from rille.terrain.scene import read_scene

COUNT = 10_000 if os.environ.get("RILLE_DRILLS") == "long" else 150
SLOWEST = 5.0  # [s] that one file may take
WORDS = [
    b"nan",
    b"inf",
    b"1e999",
    b"-1",
    b"0",
    b"",
    b"1e308",
    b"99999999999999999999",
    b"\xff\xfe",
    b"\x00",
    b'"',
    b"[",
    b"]]",
    b"=",
    b"'",
    b"\n",
    b"true",
    b"{}",
]


def mutated(content: bytes, chance: np.random.Generator) -> bytes:
    """Between one and four changes: flipped bits, cut ends, pieces doubled or moved, numbers and words replaced, lines lost or doubled."""
    data = bytearray(content)
    for _ in range(int(chance.integers(1, 5))):
        kind, n = int(chance.integers(7)), len(data)
        if n < 2:
            return bytes(data)
        start = int(chance.integers(n))
        stop = min(n, start + int(chance.integers(1, 40)))
        if kind == 0:
            data[start] ^= 1 << int(chance.integers(8))
        elif kind == 1:
            del data[max(1, start) :]
        elif kind == 2:
            data[start:stop] = data[start:stop] * 2
        elif kind == 3:
            data[start:stop] = WORDS[int(chance.integers(len(WORDS)))]
        elif kind == 4:
            other = int(chance.integers(n))
            data[start:stop] = data[other : other + (stop - start)]
        else:
            lines = bytes(data).split(b"\n")
            line = int(chance.integers(len(lines)))
            lines[line : line + 1] = [] if kind == 5 else [lines[line]] * 2
            data = bytearray(b"\n".join(lines))
    return bytes(data)


def drill(good: Path, read: Callable[[Path], object], tmp_path: Path, seed: int) -> tuple[int, list[str]]:
    """Mutate a file so often; how many were read, and the sentences of the others."""
    content, chance = good.read_bytes(), np.random.default_rng(seed)
    path = tmp_path / f"mutated{good.suffix}"
    read_, sentences = 0, []
    for number in range(COUNT):
        path.write_bytes(mutated(content, chance))
        began = time.perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read(path)
            read_ += 1
        except InputRefused as refusal:
            sentences.append(str(refusal))
        except Exception as error:
            kept = Path(os.environ.get("RILLE_KEEP", str(tmp_path))) / f"bad-{number}{good.suffix}"
            kept.write_bytes(path.read_bytes())
            raise AssertionError(f"mutation {number} of seed {seed} ({kept}): {type(error).__name__}: {error}") from error
        assert time.perf_counter() - began < SLOWEST, f"mutation {number} of seed {seed} took too long"
    assert all(sentence.strip() for sentence in sentences)
    return read_, sentences


def every_piece(path: Path) -> None:
    """All of a table, or of two topics by their headers and by their log."""
    source = open_source(path)
    joints = ("/joint_states.position[0]", "/joint_states.velocity[1]")
    if source.table:
        asked = [Wanted(clocks={"t": ("q",)})]
    else:
        asked = [Wanted(clocks={"/joint_states": joints}, header=True), Wanted(clocks={"/joint_states": joints, "/x": ("/x.data",)})]
    for wanted in asked:
        source.check(wanted.columns if source.table else [column for columns in wanted.clocks.values() for column in columns])
        for _ in source.pieces(wanted):
            pass


DRIVES: dict[str, Literal["speed", "position"]] = {
    f"wheel_{row}_{side}": "speed" for row in ("front", "middle", "rear") for side in ("left", "right")
} | {f"steering_{row}_{side}": "position" for row in ("front", "rear") for side in ("left", "right")}
HINGE = chain([1.0], [1.0]).joints[0]
SIX_WHEELER = Rover(
    joints=tuple(replace(HINGE, name=name) for name in DRIVES),
    drives=tuple(Drive(name=name, joint=name, mode=mode, max_torque=1.0) for name, mode in DRIVES.items()),
)
SHEETS = {
    "scenario": ("examples/first_drive/traverse.toml", lambda path: simulate.read_scenario_file(path, SIX_WHEELER)),
    "scene": ("examples/terrain/composed.toml", lambda path: read_scene(path)),
    "study": ("examples/sweep/soft_ground.toml", read_study_sheet),
    "trial of a real machine": ("examples/double_pendulum/friction_trial.toml", read_real),
}


@pytest.mark.parametrize("name", SHEETS)
def test_sheets(repository, tmp_path, name):
    file, read = SHEETS[name]
    copy = tmp_path / Path(file).name
    copy.write_bytes((repository / file).read_bytes())
    _, refused = drill(copy, read, tmp_path, 1)
    assert len(refused) > COUNT / 5


def test_manifests(tmp_path):
    good = manifest(tmp_path, "d.csv")
    _, refused = drill(good, read_manifest, tmp_path, 2)
    assert len(refused) > COUNT / 5


@pytest.mark.parametrize("kind", ["csv", "parquet", "mcap json", "mcap cdr", "bag"])
def test_recordings(tmp_path, kind):
    if kind == "csv":
        good = tmp_path / "d.csv"
        good.write_text("t,q,v\n" + "".join(f"{0.01 * k},{np.sin(0.1 * k):.6f},{k}\n" for k in range(60)))
    elif kind == "parquet":
        import pyarrow
        import pyarrow.parquet

        good = tmp_path / "d.parquet"
        pyarrow.parquet.write_table(pyarrow.table({"t": np.arange(60.0), "q": np.sin(np.arange(60.0))}), good)
    elif kind == "bag":
        good = write_bag(tmp_path / "d.bag", n=30)
    else:
        good = write_mcap(tmp_path / "d.mcap", kind.split()[1], n=30)
    every_piece(good)
    drill(good, every_piece, tmp_path, 3)


def test_a_folder_of_a_ros_2_bag(tmp_path):
    folder = write_bag(tmp_path / "d", n=30)
    for file in sorted(folder.iterdir()):
        good = file.read_bytes()

        def read(path: Path, file: Path = file) -> None:
            file.write_bytes(path.read_bytes())
            every_piece(folder)

        copy = tmp_path / f"copy{file.suffix}"
        copy.write_bytes(good)
        drill(copy, read, tmp_path, 4)
        file.write_bytes(good)


@pytest.mark.parametrize("ending", [".tif", ".npy", ".asc"])
def test_elevation_models(tmp_path, ending):
    heights = np.add.outer(np.arange(20.0), np.arange(24.0)).astype("f4")
    good = tmp_path / f"dem{ending}"
    if ending == ".npy":
        np.save(good, heights)
    elif ending == ".tif":
        with rasterio.open(
            good, "w", driver="GTiff", width=24, height=20, count=1, dtype="float32", transform=from_origin(0, 20, 1, 1)
        ) as file:
            file.write(heights, 1)
    else:
        head = "ncols 24\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9999\n"
        good.write_text(head + "\n".join(" ".join(f"{v:.1f}" for v in row) for row in heights))
    drill(good, terrain.read_dem, tmp_path, 5)


def test_bench_tables(tmp_path):
    good = tmp_path / "bench.csv"
    good.write_text("slip_ratio,load [N],drawbar_pull [N],sinkage [mm]\n" + "".join(f"{0.1 * k},30,{2 * k},{5 + k}\n" for k in range(9)))
    simulate.read_bench_csv(good)
    drill(good, simulate.read_bench_csv, tmp_path, 6)


def read_database(path: Path) -> None:
    """All that Python reads of a model on the ground "plane"."""
    store.read_rover(path)
    store.read_scenario(path)
    store.read_terrain(path, "plane")
    store.info(path)


def test_databases(make_model, tmp_path):
    """Pages of a model's file: Python reads it, or says that it is damaged."""
    from machines import cart, plane
    from rille.model import Scenario

    path = make_model(cart(5.0, 0.15, 0.165), Scenario(name="s", duration=1, terrain="plane", placement="on_terrain"), plane())

    whole = tmp_path / "whole.db"
    with sqlite3.connect(path) as source, sqlite3.connect(whole) as target:
        source.backup(target)
        target.execute("PRAGMA journal_mode = DELETE")
    read_database(whole)
    drill(whole, read_database, tmp_path, 7)


@pytest.mark.parametrize("finished", [0, 30])
def test_studies(tmp_path, finished):
    """Pages of a study's file: every reader gives a value or says that it is damaged. All cases wait, or all are done with traces."""
    from rille.model.study import CaseResult, Factor, TracedChannel
    from rille.study import design_cases
    from study.function_studies import angles, plan

    channel = TracedChannel(name="joint.position.a", unit="rad", quantity="joint.position", target="a", component=0)
    factors = (*angles(2), Factor(name="x3", unit="-", spread="values", values=(1.0, 2.0, 4.0)))
    asked = plan("latin_hypercube", 30, factors, traced=(channel,), trace_time=(0.0, 0.5, 1.0))
    good = tmp_path / "study.db"
    store.create_study(good, asked, design_cases(asked, 2, 1000))
    with store.study_held(good):
        results = [CaseResult(number=k, status="done", outcomes={"y": 1.0 * k}, traces=np.full((1, 3), k)) for k in range(finished)]
        store.add_results(good, asked, results)

    def read(damaged: Path) -> None:
        """Each reader by itself: where one refuses, another may not."""
        refusals = []
        for one in (store.read_plan, store.read_study, store.waiting_cases, lambda path: store.read_traces(path, channel.name)):
            try:
                one(damaged)
            except InputRefused as refusal:
                refusals.append(refusal)
        if refusals:
            raise refusals[0]

    read(good)
    read_, refused = drill(good, read, tmp_path, 8)
    assert min(read_, len(refused)) > COUNT / 20


ODD_VALUES = (None, 0, -1, 1e-300, 1e300, float("inf"), 2**62, -(2**62), "", "x", "nan", b"", b"\xff\xfe\x00", "a" * 5000, "'; --")


def test_cells_of_databases(tmp_path):
    """Any cell of a model set past its rules to what cannot be: Python and the solver read it, or refuse it in a sentence."""
    from rille._solver import Model, Simulation

    from remembering import make_remembering

    good, damaged, chance = tmp_path / "good.db", tmp_path / "damaged.db", np.random.default_rng(8)
    make_remembering(good)
    with closing(sqlite3.connect(good)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")
        cells = [
            (table, column, row)
            for table, names in columns(connection).items()
            for row in range(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])
            for column in names
        ]
    content = good.read_bytes()
    refused = {"python": 0, "solver": 0}

    def solve(path: Path) -> None:
        simulation = Simulation(Model(str(path)))
        simulation.settle()
        simulation.step(5)

    for _ in range(COUNT):
        damaged.write_bytes(content)
        table, column, row = cells[int(chance.integers(len(cells)))]
        value = ODD_VALUES[int(chance.integers(len(ODD_VALUES)))]
        with closing(sqlite3.connect(damaged)) as connection:
            connection.execute("PRAGMA ignore_check_constraints = ON")
            try:
                key = connection.execute(f"SELECT rowid FROM {table} LIMIT 1 OFFSET {row}").fetchone()[0]
                connection.execute(f"UPDATE {table} SET {column} = ? WHERE rowid = ?", (value, key))
                connection.commit()
            except sqlite3.Error:
                continue  # of another type, or a number twice: SQLite itself holds to that
        for name, read in (("python", read_database), ("solver", solve)):
            try:
                read(damaged)
            except InputRefused:
                refused[name] += 1
            except Exception as error:
                raise AssertionError(f"{table}.{column} = {value!r:.40} in row {row}, {name}: {type(error).__name__}: {error}") from error
    assert refused["solver"]


@pytest.mark.parametrize(
    ("damage", "reader", "sentence"),
    [
        ("UPDATE terrain SET n_rows = -1", lambda path: store.read_terrain(path, "plane"), "CHECK constraint failed in terrain"),
        (
            "UPDATE joint SET child_body_id = 999 WHERE id = (SELECT min(id) FROM joint)",
            store.read_rover,
            "refers to a row of body that does not exist",
        ),
        ("ALTER TABLE body RENAME COLUMN mass TO mess", store.read_rover, "table body lacks column mass"),
    ],
)
def test_a_damaged_row_is_told_as_such(tmp_path, damage, reader, sentence):
    """What is wrong with the file is in the sentence, though its pages are whole; a whole file is not blamed for a fault of ours."""
    from remembering import make_remembering

    path = tmp_path / "m.db"
    make_remembering(path)
    with pytest.raises(KeyError, match="ours"), reading(path):
        raise KeyError("ours")
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute("PRAGMA legacy_alter_table = ON")
        connection.execute(damage)
        connection.commit()
    with pytest.raises(InputRefused, match=f"{sentence}|cannot be read"):
        reader(path)
    assert any(sentence in problem for problem in store.check(path))
