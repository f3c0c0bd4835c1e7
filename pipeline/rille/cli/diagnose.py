"""``rille diagnose``: what a model lacks, by the recordings that it does not reproduce."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.places import require_place
from rille.cli.recording_names import MEANT, chosen_recordings
from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.cli.stages import Stages
    from rille.diagnosis.diagnose import Options
    from rille.model.diagnosis import Diagnosis
    from rille.model.finding import Finding
    from rille.model.recording import Recording

SHORTEST = 0.01  # [s]
MOST = 8


def diagnose(
    database: Annotated[Path, typer.Argument(help="Database with a model and recordings.")],
    recording: Annotated[list[str] | None, typer.Argument(help=f"Names of recordings to learn from; {MEANT}")] = None,
    held_out: Annotated[
        list[str] | None, typer.Option(help="Recordings to prove the answer on, repeatable; default: some of several, the end of one.")
    ] = None,
    calm: Annotated[
        list[str] | None,
        typer.Option(help="Recordings of the same machine in which nothing pushed it, repeatable: short pushes in the others are found."),
    ] = None,
    window: Annotated[
        str | None, typer.Option(help="Length of the windows that are replayed; default: as long as errors of their starts stay small.")
    ] = None,
    scenario: Annotated[str | None, typer.Option(help="Scenario (terrain, gravity); default: the recording's, else the only one.")] = None,
    most: Annotated[int, typer.Option(help=f"Pieces of an answer at most, 1 to {MOST}.")] = 4,
    only: Annotated[
        list[str] | None, typer.Option(help="Try only hypotheses of this kind, cause (effect, parameter, sensor) or target; repeatable.")
    ] = None,
    without: Annotated[list[str] | None, typer.Option(help="Leave out hypotheses of this kind, cause or target; repeatable.")] = None,
    report: Annotated[Path | None, typer.Option("--output", "-o", help="HTML: the report, one file that works offline.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler to spread replays over: tcp://HOST:8786.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Begin anew, whatever an interrupted diagnosis left.")] = False,
    as_json: Json = False,
) -> None:
    """Say what differs, where, which physics (or number, or sensor) is behind it, how sure that is, and how much better the model gets.

    The answer is kept in the database as a finding: `rille apply` writes the improved model. Ctrl-C keeps finished stages; the same command
    goes on from there.

    Example: rille diagnose rover.db drive/1 drive/2 --held-out drive/3 -o report.html
    Example: rille diagnose pendulum.db 'acrobot/*' --without sensor --json
    Example: rille diagnose pendulum.db 'disturbed/*' --calm 'acrobot/*' --calm 'pendubot/*' -o pushes.html
    """
    from rille import store
    from rille.cli.proposal import makes_no_better
    from rille.diagnosis.answer.diagnosis_json import diagnosis_json, diagnosis_lines
    from rille.diagnosis.diagnose import Options
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    length = to_si(window, "time", "--window") if window is not None else None
    if length is not None and not length >= SHORTEST:
        raise InputRefused(f"--window is {length:g} s; it must be at least {SHORTEST:g} s, and some samples long; 0.2 to 1 s is usual")
    if not 1 <= most <= MOST:
        raise InputRefused(f"--most is {most}; an answer has 1 to {MOST} pieces")
    _require_writable(database, report)
    if calm and (held_out or only or without):
        raise InputRefused("--calm looks for pushes alone; --held-out, --only and --without belong to the search for what is missing")
    training, aside = _named(database, recording, calm or held_out, scenario)
    both = {r.name for r in training} & {r.name for r in aside}
    if calm and both:
        raise InputRefused(f"recording '{min(both)}' cannot be calm and be searched for pushes at once; name it once")
    options = Options(window=length, most=most, only=tuple(only or ()), without=tuple(without or ()))
    stages = _stages(database, training, aside, options, bool(calm), fresh)
    with progress("diagnosing") as update:
        try:
            work = _pushed if calm else _diagnosed
            diagnosis = work(database, training, aside, options, scheduler, stages, update)
        except KeyboardInterrupt:
            say("finished stages are kept; the same command goes on from there")
            raise
        diagnosis = replace(diagnosis, model=str(database))
        numbers = diagnosis_json(diagnosis)
        update("report", 0.99)
        finding = store.write_finding(database, _finding(diagnosis, numbers))
        if report is not None:
            _write_report(report, database, diagnosis, numbers, finding.name, stages)
    stages.done()
    if as_json:
        print_json({"finding": finding.name, **numbers})
    else:
        print("\n".join(diagnosis_lines(diagnosis)))
    if stages.found:
        say(f"taken from an earlier run of this command: {', '.join(stages.found)} (--fresh begins anew)")
    for note in diagnosis.notes:
        say(note)
    gap = diagnosis.proof.gap_closed if diagnosis.proof is not None else None
    changes = not makes_no_better(diagnosis.verdict, gap) and any(term.hypothesis.cause != "sensor" for term in diagnosis.setting)
    say(
        f"kept as {finding.name} in {database}"
        + (f"; `rille apply {quote(str(database))} {quote(finding.name)} -o improved.db`" if changes else "")
    )
    if report is not None:
        say(f"wrote {report}")


def _require_writable(database: Path, report: Path | None) -> None:
    """Refuse at once what would fail after minutes."""
    import os

    from rille.model import InputRefused

    require_place(report)
    if database.is_file() and not os.access(database, os.W_OK):
        raise InputRefused(f"'{database}' is read-only, and the finding belongs into it; make it writable or diagnose a copy")


def _named(
    database: Path, recording: list[str] | None, held_out: list[str] | None, scenario: str | None
) -> tuple[list["Recording"], list["Recording"]]:
    """Recordings to learn from and to prove on, with samples, each with the scenario that it is replayed in."""
    from rille import store
    from rille.model import InputRefused

    known = store.recording_names(database)
    aside = chosen_recordings(known, held_out, database) if held_out else []
    names = chosen_recordings(known, recording, database)
    if not recording:
        names = [name for name in names if name not in aside]
    if not names:
        raise InputRefused("all recordings are held out, none is left to learn from; name fewer with --held-out")
    read = {name: store.read_recording(database, name) for name in [*names, *aside]}
    kinds = {r.kind for r in read.values()}
    if len(kinds) > 1:
        points = [r.name for r in read.values() if r.kind == "points"]
        raise InputRefused(
            f"recordings over time and of bench points ({', '.join(points[:5])}) are diagnosed one kind at a time; name them"
        )
    if kinds == {"time"}:
        read = {name: replace(r, scenario=store.read_scenario(database, scenario or r.scenario).name) for name, r in read.items()}
    return [read[name] for name in names], [read[name] for name in aside]


def _stages(
    database: Path, training: Sequence["Recording"], aside: Sequence["Recording"], options: "Options", calm: bool, fresh: bool
) -> "Stages":
    """Stages of this very question: model, samples, options and code."""
    import json

    from rille import store
    from rille.cli.content import code_digest, recording_digest
    from rille.cli.stages import Stages

    key = {
        "model": store.model_digest(database),
        "recordings": [recording_digest(r) for r in training],
        "held_out": [recording_digest(r) for r in aside],
        "options": asdict(options) | {"calm": calm},
        "code": code_digest(),
    }
    stages = Stages(json.dumps(key, sort_keys=True))
    if fresh:
        stages.forget()
    return stages


def _diagnosed(
    database: Path,
    training: Sequence["Recording"],
    aside: Sequence["Recording"],
    options: "Options",
    scheduler: str | None,
    stages: "Stages",
    update: Callable[[str, float], None],
) -> "Diagnosis":
    """Recordings over time by replays, bench points by the bench."""
    from rille import store
    from rille.cli.bench_rigs import bench_rig
    from rille.cli.simulators import simulators
    from rille.diagnosis.bench.bench_diagnosis import diagnose_bench
    from rille.diagnosis.diagnose import diagnose
    from rille.diagnosis.hypotheses.candidates import of_kind

    kinds = store.effect_kinds()
    if training[0].kind == "points":
        rigs, others = ([bench_rig(database, r)[0] for r in part] for part in (training, aside))
        return diagnose_bench(
            rigs,
            others,
            kinds=kinds,
            model=str(database),
            most=options.most,
            chosen=lambda hypotheses: of_kind(hypotheses, only=options.only, without=options.without),
            stage=stages,
            on_progress=update,
        )
    with simulators(database, scheduler) as simulator_of:
        return diagnose(simulator_of, training, aside, kinds=kinds, options=options, stage=stages, on_progress=update)


def _pushed(
    database: Path,
    training: Sequence["Recording"],
    calm: Sequence["Recording"],
    options: "Options",
    scheduler: str | None,
    stages: "Stages",
    update: Callable[[str, float], None],
) -> "Diagnosis":
    """Short pushes beside calm recordings."""
    from rille import store
    from rille.cli.simulators import simulators
    from rille.diagnosis.pushes.diagnose_pushes import WINDOW, diagnose_pushes
    from rille.model import InputRefused

    if training[0].kind == "points":
        raise InputRefused("--calm looks for pushes over time; bench points have none")
    with simulators(database, scheduler) as simulator_of:
        window = options.window or WINDOW
        kinds = store.effect_kinds()
        return diagnose_pushes(simulator_of, training, calm, kinds=kinds, window=window, stage=stages, on_progress=update)


def _finding(diagnosis: "Diagnosis", numbers: dict[str, Any]) -> "Finding":
    from rille.model.finding import Finding

    best = diagnosis.ranked[0] if diagnosis.ranked and (diagnosis.setting or diagnosis.verdict == "sensor_fault") else None
    group = next((g for g in diagnosis.groups if best is not None and g.number == best.group), None)
    probability = group.probability if diagnosis.verdict == "group" and group is not None else best.probability if best else math.nan
    return Finding(
        verdict=diagnosis.verdict,
        sentence=diagnosis.sentence,
        target=best.title if best is not None else "",
        probability=min(max(probability, 0.0), 1.0) if math.isfinite(probability) else None,
        recordings=diagnosis.recordings,
        held_out=diagnosis.held_out,
        setting=numbers["setting"],
        detail=numbers,
    )


def _write_report(path: Path, database: Path, diagnosis: "Diagnosis", numbers: dict[str, Any], finding: str, stages: "Stages") -> None:
    """The page, with the machine and the ground of the model, and the curves that the stages have."""
    from rille import store
    from rille.cli.proposal import proposal
    from rille.diagnosis.comparison.difference import find_difference
    from rille.view.diagnosis_report import write_diagnosis_report

    comparisons = stages.get(diagnosis.look + "comparisons") or ()
    proof = stages.get(diagnosis.look + "proof")
    improved = stages.get("improved") or (proof[1] if isinstance(proof, tuple) else ())
    proposed = proposal(database, diagnosis.setting, diagnosis.scenario)
    points = any(comparison.mode == "points" for comparison in comparisons)
    terrain = None if points or proposed.scenario is None else store.read_scenario(database, proposed.scenario).terrain
    write_diagnosis_report(
        path,
        diagnosis,
        numbers,
        finding=finding,
        changes=proposed.changes,
        difference=stages.get(diagnosis.look + "difference") or (find_difference(comparisons) if comparisons else None),
        comparisons=comparisons,
        improved=improved,
        rover=None if points else store.read_rover(database),
        terrain=store.read_terrain(database, terrain) if terrain is not None else None,
    )
