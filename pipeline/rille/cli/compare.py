"""``rille compare``: what the model gives for the recordings of a database, and where it differs."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.places import require_place, require_png
from rille.cli.recording_names import MEANT, chosen_recordings
from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.model.comparison import Comparison
    from rille.model.difference import Difference
    from rille.model.recording import Recording

Update = Callable[[str, float], None]
SHORTEST = 1e-3  # [s]
CONTRADICTIONS = ("bad_channel", "disagreement", "gain", "bias", "sign", "spike", "stuck")  # codes of findings
MOST_DOUBTS = 8
NOISE_FROM = 30  # recordings of one manifest that tell its sensors' noise


def compare(
    database: Annotated[Path, typer.Argument(help="Database with a model and recordings.")],
    recording: Annotated[list[str] | None, typer.Argument(help=f"Names of recordings; {MEANT}")] = None,
    window: Annotated[str, typer.Option(help="Length of the windows that are replayed, each from the smoothed recorded state.")] = "0.5 s",
    whole: Annotated[bool, typer.Option("--whole", help="Replay every recording in one go instead of in windows.")] = False,
    inverse: Annotated[
        bool, typer.Option("--inverse", help="Inverse dynamics: efforts that the motion needs, against those recorded.")
    ] = False,
    scenario: Annotated[str | None, typer.Option(help="Scenario (terrain, gravity); default: the recording's, else the only one.")] = None,
    report: Annotated[Path | None, typer.Option("--output", "-o", help="HTML: the report, one file that works offline.")] = None,
    csv: Annotated[Path | None, typer.Option(help="CSV: the table of channels, per recording too if there are several.")] = None,
    figure: Annotated[
        Path | None, typer.Option(help="PNG of bench points: measured, repeatability and simulated; one per recording.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Replay recordings with the model and show where, when and under which conditions it differs beyond the noise.

    Commands come from the recordings; channels are simulated as the sensors would have seen them. Exit code 0 whether or not it differs.

    Example: rille compare rover.db drive --window "0.5 s" -o report.html --csv table.csv
    Example: rille compare pendulum.db 'acrobot/*' --inverse --json
    """
    from rille import store
    from rille.diagnosis.comparison.difference import find_difference
    from rille.diagnosis.comparison.difference_json import difference_csv, difference_json, difference_lines
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    if whole and inverse:
        raise InputRefused("--whole and --inverse are two ways to compare; choose one")
    length = to_si(window, "time", "--window")
    if not length >= SHORTEST:
        raise InputRefused(f"--window is {length:g} s; it must be at least {SHORTEST:g} s, and some samples long; 0.2 to 1 s is usual")
    require_png(figure)
    require_place(report, csv, figure)
    names = chosen_recordings(store.recording_names(database), recording, database)
    heads = [store.read_recording(database, name, samples=False) for name in names]
    kinds = {head.kind for head in heads}
    if len(kinds) > 1:
        points = [head.name for head in heads if head.kind == "points"]
        raise InputRefused(f"recordings over time and of bench points ({', '.join(points[:5])}) are compared one kind at a time; name them")
    mode = "points" if kinds == {"points"} else "inverse_dynamics" if inverse else "whole" if whole else "windows"
    if figure is not None and mode != "points":
        raise InputRefused("--figure draws bench points; recordings over time are drawn in the report: -o report.html")
    scenarios = [] if mode == "points" else [_scenario(database, head, scenario) for head in heads]
    notes: list[str] = []
    with progress("comparing") as update:
        comparisons = _comparisons(database, heads, scenarios, mode, length, update)
        update("statistics", 0.98)
        difference = find_difference(comparisons)
        difference = replace(difference, notes=(*difference.notes, *_doubts(heads)))
        if report is not None:
            update("report", 0.99)
            notes = _write_report(report, database, difference, comparisons, heads, scenarios)
    figures = [] if figure is None else _draw_points(figure, comparisons)
    if csv is not None:
        csv.write_text(difference_csv(difference), encoding="utf-8")
    if as_json:
        print_json(difference_json(difference))
    else:
        print("\n".join(difference_lines(difference)))
    for note in (*difference.notes, *notes):
        say(note)
    for path in (report, csv, *figures):
        if path is not None:
            say(f"wrote {path}")
    return 0


def _scenario(database: Path, recording: "Recording", wanted: str | None) -> str:
    """Name of the scenario of the replay: the wanted one, else the recording's, else the database's only one."""
    from rille import store

    return store.read_scenario(database, wanted or recording.scenario).name


def _comparisons(
    database: Path, heads: Sequence["Recording"], scenarios: Sequence[str], mode: str, window: float, update: Update
) -> list["Comparison"]:
    """One comparison per recording, in their order."""
    if mode == "points":
        from rille import store
        from rille.cli.compare_points import compare_points

        found = []
        for k, head in enumerate(heads):
            update(head.name, k / len(heads))
            found.append(compare_points(database, store.read_recording(database, head.name)))
        return found
    return _replayed(database, heads, scenarios, mode, window, update)


def _replayed(
    database: Path, heads: Sequence["Recording"], scenarios: Sequence[str], mode: str, window: float, update: Update
) -> list["Comparison"]:
    """Replays; many recordings on all cores at once, each thread with its own replayer, one recording with all cores for its windows."""
    import os
    import threading
    from concurrent.futures import CancelledError, ThreadPoolExecutor

    from rille import diagnosis, simulate, store

    names = [head.name for head in heads]
    cores = os.cpu_count() or 1
    workers = min(cores, len(names))
    own, stopped = threading.local(), threading.Event()
    shares = [0.0] * len(names)
    noises = {} if mode == "inverse_dynamics" else _shared_noises(database, heads)

    def replay(k: int) -> "Comparison":
        def told(done: int, total: int, stage: str) -> None:
            if stopped.is_set():
                raise CancelledError
            shares[k] = done / max(total, 1)
            update(f"{names[k]}: {stage}", 0.97 * sum(shares) / len(names))

        replayers = own.__dict__.setdefault("replayers", {})
        if scenarios[k] not in replayers:
            replayers[scenarios[k]] = simulate.Replayer(database, scenarios[k], threads=max(1, cores // workers))
        recording = store.read_recording(database, names[k])
        way: Any = {
            "windows": partial(diagnosis.compare_windows, window=window, noise=noises.get(recording.manifest)),
            "whole": partial(diagnosis.compare_whole, noise=noises.get(recording.manifest)),
            "inverse_dynamics": diagnosis.compare_inverse,
        }[mode]
        found = way(replayers[scenarios[k]], recording, on_progress=told)
        shares[k] = 1.0
        return found

    pool = ThreadPoolExecutor(workers)
    try:
        return [future.result() for future in [pool.submit(replay, k) for k in range(len(names))]]
    finally:
        stopped.set()  # after a refusal or Ctrl-C the others end at their next sign of life
        pool.shutdown(cancel_futures=True)


def _doubts(heads: Sequence["Recording"]) -> list[str]:
    """What the data gate says of channels that contradict each other: a difference may be theirs instead of the model's."""
    said = dict.fromkeys(f.message for head in heads for f in head.findings if f.code in CONTRADICTIONS)
    return [f"the data gate, before any model: {message}" for message in said][:MOST_DOUBTS]


def _shared_noises(database: Path, heads: Sequence["Recording"]) -> dict[str, dict[str, tuple[float, str]]]:
    """Noise of the channels by manifest: recordings that one manifest brought in were made by the same sensors."""
    from rille import diagnosis, store

    together: dict[str, list[str]] = {}
    for head in heads:
        together.setdefault(head.manifest, []).append(head.name)
    found = {}
    for manifest, group in together.items():
        if len(group) > 1 and manifest:
            chosen = group[:: -(-len(group) // NOISE_FROM)]
            found[manifest] = diagnosis.shared_noise([store.read_recording(database, name) for name in chosen])
    return found


def _draw_points(figure: Path, comparisons: Sequence["Comparison"]) -> list[Path]:
    """One picture per recording, named after it if there are several."""
    from rille.view.bench_difference_plots import plot_points

    paths = []
    for comparison in comparisons:
        word = comparison.recording.replace("/", "_")
        path = figure if len(comparisons) == 1 else figure.with_name(f"{figure.stem}_{word}{figure.suffix}")
        plot_points(comparison, path, comparison.recording)
        paths.append(path)
    return paths


def _write_report(
    path: Path,
    database: Path,
    difference: "Difference",
    comparisons: Sequence["Comparison"],
    heads: Sequence["Recording"],
    scenarios: Sequence[str],
) -> list[str]:
    """The HTML page, with the rover and the terrain of the first scenario; notes about what could not be drawn."""
    from rille import store
    from rille.view.difference_report import write_difference_report

    rover = terrain = None
    if scenarios:
        rover = store.read_rover(database)
        name = store.read_scenario(database, scenarios[0]).terrain
        terrain = store.read_terrain(database, name) if name is not None else None
    findings = {head.name: head.findings for head in heads}
    return write_difference_report(path, difference, comparisons, rover=rover, terrain=terrain, gate_findings=findings)
