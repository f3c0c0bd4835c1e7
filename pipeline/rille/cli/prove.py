"""``rille prove``: sealed trials in which something is concealed. Without a verb: trials of a beacon are run."""

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.default_verb import RunByDefault
from rille.cli.talk import Json, print_json, say

if TYPE_CHECKING:
    from rille.model.ledger import Ledger

NOT_PROVEN = 5
NEEDS = ("mujoco", "numba", "pysindy", "sklearn")  # modules of the extra ``proof``
FLAWS = 20  # that are shown


app = typer.Typer(
    cls=RunByDefault,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Sealed trials: an independent generator makes recordings in which something is concealed, the truths are sealed,\n"
    "`rille diagnose` answers in rooms from which they cannot be read, the seals are opened, the answers are scored.\n\n"
    'Example: rille prove --beacon "any sentence that nobody could foresee" --quick -o proof',
)


@app.command("run")
def run(
    beacon: Annotated[str, typer.Option(help="Sentence from which every trial is drawn: another sentence, other trials.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder; default: proof-DIGEST of the beacon.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="16 strong trials of three small machines instead of 330.")] = False,
    machines: Annotated[str, typer.Option(help="Only these machines, with commas.")] = "",
    real: Annotated[
        list[Path] | None, typer.Option(help="Sheet of a trial of real recordings whose truth was logged apart, repeatable.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Trials at a time on this machine.", min=1)] = 2,
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler to spread trials over: tcp://HOST:8786.")] = None,
    minutes: Annotated[float | None, typer.Option(help="Begin no trial after so long; the same command goes on later.")] = None,
    baselines: Annotated[bool, typer.Option(help="Ask SINDy, a Gaussian process and tuning of parameters, too.")] = True,
    as_json: Json = False,
) -> None:
    """Make, seal, answer, open and score the trials of a beacon. Ctrl-C loses what is at work; the same command goes on.

    Writes ledger.db (which `rille prove verify` checks), table.md, table.json and report.html into the folder. The full set takes
    hours on 2 cores, --quick about 4 minutes.

    Example: rille prove run --beacon "headline of tomorrow's paper" -o proof
    Example: rille prove --beacon "rille" --quick --machines pendulum,arm -o proof
    Example: rille prove --beacon "a sentence" --real examples/double_pendulum/pushes_trial.toml -o proof
    """
    from rille.cli.prove_run import LEDGER, prove
    from rille.model import InputRefused, nearest_names
    from rille.proof.real import real_truth
    from rille.proof.trials import FULL, QUICK, SHARES

    if not beacon.strip():
        raise InputRefused("--beacon is empty; give any sentence")
    missing = [name for name in NEEDS if find_spec(name) is None]
    if missing:
        raise InputRefused(f"sealed trials need {', '.join(missing)}, which is not installed here; `pip install 'rille[proof]'`")
    extent = QUICK if quick else FULL
    chosen = tuple(word.strip() for word in machines.split(",") if word.strip()) or extent.machines
    for name in chosen:
        if name not in SHARES:
            raise InputRefused(f"--machines names '{name}', which is none; {nearest_names(name, list(SHARES))}")
    for number, sheet in enumerate(real or ()):
        real_truth(sheet, number)  # refused now rather than after hours
    folder = output or Path(f"proof-{hashlib.sha256(beacon.encode()).hexdigest()[:8]}")
    until = time.monotonic() + 60 * minutes if minutes is not None else float("inf")
    try:
        extent = replace(extent, machines=chosen)
        done = prove(folder, beacon, extent, real=real or (), workers=workers, scheduler=scheduler, baselines=baselines, until=until)
    except KeyboardInterrupt:
        say("finished trials are kept; the same command goes on")
        raise
    if not done:
        say(f"the time is up; the same command goes on in '{folder}'")
        return
    numbers = _write_tables(folder / LEDGER, folder)
    if as_json:
        print_json({"ledger": folder / LEDGER, **{name: value for name, value in numbers.items() if name != "scores"}})
    else:
        print((folder / "table.md").read_text(encoding="utf-8"), end="")
    say(f"wrote {folder}/ledger.db, table.md, table.json, report.html; check it: rille prove verify {quote(str(folder / 'ledger.db'))}")


@app.command("verify")
def verify(
    ledger: Annotated[Path, typer.Argument(help="Ledger (SQLite) of sealed trials.")],
    root: Annotated[str | None, typer.Option(help="Merkle root that was announced before the answers.")] = None,
    as_json: Json = False,
) -> int:
    """Check a ledger: seals, Merkle root, nonces, chain of answers, and every score, computed anew from truth and answer.

    Exit code 5 if anything does not hold.

    Example: rille prove verify proof/ledger.db
    Example: rille prove verify proof/ledger.db --root 3f9a...
    """
    from rille import store
    from rille.proof.scoring import score_answer
    from rille.proof.verify import verify as find_flaws

    held = store.read_ledger(ledger)
    flaws = [{"check": flaw.check, "trial": flaw.trial, "sentence": flaw.sentence} for flaw in find_flaws(held, score_answer)]
    if root is not None and root != held.plan.root:
        flaws.insert(0, {"check": "root", "trial": None, "sentence": f"the plan has the root {held.plan.root}, announced was {root}"})
    if as_json:
        print_json({"ledger": ledger, "beacon": held.plan.beacon, "root": held.plan.root, "trials": len(held.trials), "flaws": flaws})
    else:
        for flaw in flaws[:FLAWS]:
            print(flaw["sentence"])
        if len(flaws) > FLAWS:
            print(f"and {len(flaws) - FLAWS} more")
        print(f"{ledger}: {len(held.trials)} trials of the beacon '{held.plan.beacon}', root {held.plan.root}")
        many = f"{len(flaws)} flaw{'s' if len(flaws) > 1 else ''}"
        print(f"{many}: this ledger proves nothing" if flaws else "every seal, answer and score holds")
    return NOT_PROVEN if flaws else 0


@app.command("table")
def table(
    ledger: Annotated[Path, typer.Argument(help="Ledger of sealed trials, opened and scored.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for table.md, table.json and report.html.")] = Path(),
    as_json: Json = False,
) -> None:
    """Tables and page of a ledger.

    Example: rille prove table proof/ledger.db -o proof
    """
    from rille.model import InputRefused

    if output.exists() and not output.is_dir():
        raise InputRefused(f"'{output}' is a file; name a folder")
    numbers = _write_tables(ledger, output)
    if as_json:
        print_json(numbers)
    else:
        print((output / "table.md").read_text(encoding="utf-8"), end="")


@app.command("trial")
def trial(
    ledger: Annotated[Path, typer.Argument(help="Ledger whose truths are opened.")],
    number: Annotated[int, typer.Argument(help="Of the trial.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="New folder for the files of the trial.")],
    as_json: Json = False,
) -> None:
    """Make the files of one trial once more, with its truth beside them: to look at what was asked, and to diagnose it by hand.

    Example: rille prove trial proof/ledger.db 17 -o trial17
    """
    from rille import store
    from rille.cli.prove_run import make_trials, not_made
    from rille.model import InputRefused
    from rille.model.process import SAME_ROUNDING
    from rille.proof.seal import files_digest
    from rille.proof.strength import Unreachable
    from rille.proof.trials import Trial
    from rille.work import carry_out, opened_pool

    held = store.read_ledger(ledger)
    truth = next((json.loads(t.text) for t in held.truths if t.trial == number), None)
    if truth is None:
        why = "its seal is not opened" if held.trials and not held.truths else f"trials are numbered 0 to {len(held.trials) - 1}"
        raise InputRefused(f"trial {number} cannot be shown: {why}")
    if output.exists():
        raise InputRefused(f"'{output}' exists already; name a new folder")
    if truth["sort"] == "real":
        raise InputRefused(f"trial {number} is of real recordings, {truth['title']}; '{truth['sheet']}' says of which")
    made: list[tuple[int, Mapping[str, bytes], Mapping[str, Any]]] = []
    try:
        with opened_pool(make_trials, 1, None, SAME_ROUNDING) as pool:
            carry_out(pool, [(Trial.of(truth), truth)], 1, made.extend, lost=not_made)
    except Unreachable as error:
        raise InputRefused(f"{error}: another state of rille made it (version {held.plan.version}); check that one out") from None
    ((_, files, again),) = made
    output.mkdir(parents=True)
    for name, content in files.items():
        (output / name).write_bytes(content)
    if files_digest(output) != next(t.recording for t in held.trials if t.number == number):
        say(
            f"these are not the files that were sealed: another state of rille made those (version {held.plan.version}), or a processor"
            " that rounds differently"
        )
    (output / "truth.json").write_text(json.dumps(again, indent=2) + "\n", encoding="utf-8")
    answer = next((a for a in held.answers if a.trial == number), None)
    if answer is not None:
        (output / "answer.json").write_text(answer.text + "\n", encoding="utf-8")
    if as_json:
        print_json({"folder": output, "truth": again})
        return
    from rille.proof.scoring import title

    print(f"trial {number}: {title(again)} at {again['strength']:g} times the noise, {again['machine']}")
    say(f"diagnose it: cd {output} && rille import *.toml -o model.db && rille diagnose model.db --held-out held_out")


def _write_tables(ledger: Path, folder: Path) -> dict[str, Any]:
    """table.md, table.json and report.html of a ledger; returns the numbers."""
    from rille import store
    from rille.cli.prove_run import AGREEMENT
    from rille.model import InputRefused
    from rille.proof.failures import failures_markdown
    from rille.proof.summary import as_json, markdown
    from rille.view.proof_report import write_proof_report

    held = store.read_ledger(ledger)
    if not held.scores:
        raise InputRefused(f"the ledger '{ledger}' has no scores yet; `rille prove run` goes on until it has")
    lines, baselines, real = _lines(held)
    file = ledger.parent / AGREEMENT
    agreement = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    numbers = as_json(lines, baselines, agreement, real)
    folder.mkdir(parents=True, exist_ok=True)
    table = markdown(lines, baselines, agreement, real) + "\nWhat went wrong:\n\n" + failures_markdown(lines)
    (folder / "table.md").write_text(table, encoding="utf-8")
    (folder / "table.json").write_text(json.dumps(_plain(numbers), indent=1) + "\n", encoding="utf-8")
    facts = {"beacon": held.plan.beacon, "root": held.plan.root, "version": held.plan.version, "truth kept away by": held.plan.isolation}
    write_proof_report(folder / "report.html", numbers, facts=facts)
    return numbers


def _lines(held: "Ledger") -> tuple[list[dict[str, Any]], dict[str, list[dict[str, Any]]], list[dict[str, Any]]]:
    """Scores of the diagnosis, of each baseline, and of trials of real recordings."""
    found: dict[str, list[dict[str, Any]]] = {"diagnosis": [], "real": []}
    for score in held.scores:
        for name, line in json.loads(score.text).items():
            found.setdefault(name, []).append(line)
    lines, real = found.pop("diagnosis"), found.pop("real")
    return lines, found, real


def _plain(value: Any) -> Any:
    """NaN as null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and value != value else value
