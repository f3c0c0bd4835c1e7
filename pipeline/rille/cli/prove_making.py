"""Trials as files: what a room of a sealed trial holds, and how strong what is concealed is."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rille.model import Effect
    from rille.model.comparison import Comparison
    from rille.model.recording import Recording
    from rille.proof.making import Made, Misfits
    from rille.proof.subject import Subject
    from rille.proof.trials import Drawn

WINDOW = 0.5  # [s] in which the strength is measured
ACCEPTED = ("sign", "unit", "range", "stuck")  # what a fault may look like to the data gate, which else would refuse it before diagnosis
MODEL = "model.db"


def write_model(drawn: "Drawn", path: Path) -> None:
    """The base model of a trial, with its scenarios, as a new database."""
    from rille import store

    path.unlink(missing_ok=True)
    write_subject(drawn.machine, path)
    for scenario in drawn.scenarios:
        store.write_scenario(path, scenario)


def write_subject(machine: "Subject", path: Path) -> None:
    """The model of a machine as a new database."""
    from rille import store

    store.create(path)
    store.write_rover(path, machine.rover)
    if machine.terrain is not None:
        store.write_terrain(path, machine.terrain)
    store.write_effects(path, machine.effects)


def misfits_of(model: Path) -> "Misfits":
    """Measures recordings against the base model in a database, in windows of 0.5 s, as ``rille compare`` does; of wheels on ground,
    which take long to simulate, with starts near the smoothed ones and derivatives at twice the step.
    """
    import numpy as np

    from rille import diagnosis, simulate
    from rille.cli.compare_points import compare_points
    from rille.diagnosis.comparison.pooled import pool
    from rille.proof.making import Misfit

    def in_windows(recording: "Recording", effects: "Sequence[Effect]") -> "Comparison":
        simulator = simulate.Replayer(model, recording.name, threads=1).changed(effects)
        if not simulator.has_ground:
            return diagnosis.compare_windows(simulator, recording, window=WINDOW)
        return diagnosis.compare_windows(simulator, recording, window=WINDOW, rough=2 * simulator.step, far=0.0)

    def misfits(recordings: "Sequence[Recording]", effects: "Sequence[Effect]") -> Mapping[str, Misfit]:
        assert not effects or all(one.kind == "time" for one in recordings)
        compared = [compare_points(model, one) if one.kind == "points" else in_windows(one, effects) for one in recordings]
        return {c.channel.name: Misfit(z=c.z, degrees=float(np.sum(c.degrees))) for c in pool(compared) if not c.left_out}

    return misfits


def make_room(drawn: "Drawn", folder: Path, truth: "Mapping[str, Any] | None" = None) -> "Made":
    """Make a trial: its recordings, their manifests and the base model in a new folder, and nothing of the truth.

    truth : what was concealed when it was made before; None: it is made for the first time.

    Raises
    ------
    Unreachable : if this draw cannot be made as strong as wanted, or is not that of the truth.
    """
    from rille.proof.making import make, make_again

    folder.mkdir(parents=True, exist_ok=True)
    model = folder / MODEL
    write_model(drawn, model)
    made = make(drawn, misfits_of(model)) if truth is None else make_again(drawn, truth)
    for recording in made.recordings:
        write_recording(recording, folder, hides_noise=drawn.hides_noise)
    return made


def write_recording(recording: "Recording", folder: Path, *, hides_noise: bool, accepted: "Sequence[str]" = ACCEPTED) -> Path:
    """File and manifest of a recording; returns the manifest. accepted : findings that the data gate is not to refuse."""
    from rille.model.sheet import toml_string
    from rille.recording.writing import manifest_text, write_recording_file

    if recording.kind == "points":
        return write_points(recording, folder, hides_noise=hides_noise)
    file = folder / f"{recording.name}.parquet"
    addresses = write_recording_file(file, recording, {})
    text = manifest_text(recording, file.name, "parquet", addresses, hidden=frozenset(["noise"]) if hides_noise else frozenset())
    manifest = file.with_suffix(".toml")
    codes = ", ".join(toml_string(code) for code in accepted)
    manifest.write_text(f"accepted = [{codes}]\n{text}", encoding="utf-8")
    return manifest


def write_points(recording: "Recording", folder: Path, *, hides_noise: bool = False) -> Path:
    """A table of points and its manifest."""
    import numpy as np

    file = folder / f"{recording.name}.csv"
    header = ",".join(channel.name for channel in recording.channels)
    np.savetxt(file, np.column_stack([c.value for c in recording.channels]), delimiter=",", header=header, comments="", fmt="%.12g")
    setup = {name: recording.setup[name] for name in ("soil", "law", "gravity")}
    lines = [f'name = "{recording.name}"', f'file = "{file.name}"', 'kind = "points"', "", "[bench]"]
    lines += [f'{name} = "{value}"' for name, value in setup.items()] + [f'speed = "{recording.setup["speed"]!r} m/s"']
    for channel in recording.channels:
        lines += ["", "[[channel]]", f'column = "{channel.name}"', f'quantity = "{channel.quantity}"', f'target = "{channel.target}"']
        lines += [f'unit = "{channel.unit}"', f'role = "{channel.role}"']
        lines += [f'noise = "{channel.noise!r} {channel.unit}"'] if channel.noise and not hides_noise else []
    manifest = file.with_suffix(".toml")
    manifest.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return manifest
