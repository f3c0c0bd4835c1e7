"""The benchmark of diagnosis: recordings that the solver makes with one thing wrong, diagnosed, scored.

    bench.py run [--quick] [--machines pendulum,arm] [--seeds 0,1]   make, diagnose and score; goes on where it was interrupted
    bench.py table                                                   tables and picture of what is done
    bench.py make TRIAL -o FOLDER                                    the files of one trial
    bench.py one TRIAL                                               one trial, its score as a line of JSON
    bench.py calibrate                                               probabilities from trials of `run --development N`

A trial is a process of its own: what crashes or takes too long is a result, too. One line of JSON for each finished trial in
``out/bench-diagnosis/scores.jsonl``.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

from trials import Trial, development, full, quick, trial_named

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "out/bench-diagnosis"
LONGEST = {"rover": 3600.0}  # [s] that a trial may take
USUAL = 1800.0


def main() -> int:
    """The program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    run = verbs.add_parser("run")
    run.add_argument("--quick", action="store_true")
    run.add_argument("--development", type=int, default=0, metavar="N", help="N trials to calibrate on, instead of the benchmark")
    run.add_argument("--machines", default="pendulum,arm,free_body,bench,rover")
    run.add_argument("--seeds", default="0")
    run.add_argument("--workers", type=int, default=2)
    run.add_argument("--minutes", type=float, default=1e9, help="begin no trial after so long")
    run.add_argument("--sizes", action="store_true", help="only find out how large each fault must be")
    run.add_argument("--only", default="", help="text that the names of trials contain")
    for verb in ("make", "one", "size"):
        one = verbs.add_parser(verb)
        one.add_argument("trial")
        one.add_argument("-o", "--output", type=Path)
    table = verbs.add_parser("table")
    table.add_argument("-o", "--output", type=Path, default=HERE / "results")
    verbs.add_parser("calibrate")
    given = parser.parse_args()
    if given.verb == "make":
        return make_one(given.trial, given.output)
    if given.verb in ("one", "size"):
        work = do_one if given.verb == "one" else size_one
        print(json.dumps(work(trial_named(given.trial), given.output)))
        return 0
    if given.verb == "table":
        from tables import write_tables

        write_tables(read_lines(OUT / "scores.jsonl"), given.output)
        return 0
    if given.verb == "calibrate":
        from calibrating import calibrate

        calibrate(read_lines(OUT / "development.jsonl"))
        return 0
    if given.development:
        chosen: Iterable[Trial] = development(0, given.development)
    else:
        machines, seeds = given.machines.split(","), [int(seed) for seed in given.seeds.split(",")]
        chosen = (t for t in quick(seeds[0]) if t.machine in machines) if given.quick else full(machines, seeds)
    file = OUT / ("sizes.jsonl" if given.sizes else "development.jsonl" if given.development else "scores.jsonl")
    run_all([trial for trial in chosen if given.only in trial.name], file, given)
    if not given.development and not given.sizes:
        from tables import write_tables

        write_tables(read_lines(file), OUT if given.quick else HERE / "results")
    return 0


def make_one(name: str, folder: Path) -> int:
    """The files of a trial, with its truth."""
    from making import make

    from rille.proof.strength import Unreachable

    try:
        truth = make(trial_named(name), folder)
    except Unreachable as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    (folder / "truth.json").write_text(json.dumps(asdict(truth), indent=2) + "\n", encoding="utf-8")
    print(f"{name}: {truth.numbers}, excess {truth.strength:.2f} times the noise in {truth.channel}; {folder}/model.db")
    return 0


def do_one(trial: Trial, kept: Path | None = None) -> dict:
    """Make, diagnose and score one trial."""
    from asking import diagnose_files
    from making import make
    from scoring import scored

    from rille.proof.strength import Unreachable
    from rille.proof.trials import HELD_OUT, TRAINING

    with tempfile.TemporaryDirectory() as place:
        folder = kept or Path(place) / "trial"
        size = known_sizes().get(trial.name)
        if size is not None and size < 0:
            return {"trial": trial.name, "status": "unreachable"}
        begin = time.perf_counter()
        try:
            truth = make(trial, folder, size)
        except Unreachable as error:
            return {"trial": trial.name, "status": "unreachable", "message": str(error)}
        made = time.perf_counter() - begin
        facts = {"trial": trial.name, "truth": asdict(truth), "making": made}
        begin = time.perf_counter()
        try:
            answer = diagnose_files(folder / "model.db", TRAINING, (HELD_OUT,), without=trial.concealed)
        except Exception:
            return facts | {"status": "crashed", "message": traceback.format_exc()[-2000:]}
        score = scored(truth, answer, time.perf_counter() - begin)
        return facts | {"status": "done", "score": asdict(score), "sentence": answer.sentence, "seconds": dict(answer.seconds)}


def size_one(trial: Trial, kept: Path | None = None) -> dict:
    """How large the fault of a trial must be: -1, if it cannot be so strong."""
    from making import Maker

    from rille.proof.strength import Unreachable

    with tempfile.TemporaryDirectory() as place:
        begin = time.perf_counter()
        try:
            size, strength, channel = Maker(trial, kept or Path(place)).size(trial.strength) if trial.strength > 0 else (0.0, 0.0, "")
        except Unreachable as error:
            return {"trial": trial.name, "size": -1.0, "status": "unreachable", "message": str(error)}
        seconds = time.perf_counter() - begin
        return {"trial": trial.name, "size": size, "status": "made", "strength": strength, "channel": channel, "seconds": seconds}


def known_sizes() -> dict[str, float]:
    """Sizes of faults that were looked for before, by trial; -1: none is large enough."""
    return {line["trial"]: line["size"] for line in read_lines(OUT / "sizes.jsonl") if "size" in line}


def read_lines(file: Path) -> list[dict]:
    """Lines of a file of JSON lines; [] if there is none. A line that was cut off is left out."""
    found = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.is_file() else []:
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return found


def run_all(trials: list[Trial], file: Path, given: argparse.Namespace) -> None:
    """Every trial that has no line yet, several at a time."""
    OUT.mkdir(parents=True, exist_ok=True)
    done = {line["trial"] for line in read_lines(file)}
    waiting = [trial for trial in trials if trial.name not in done]
    print(f"{len(trials)} trials, {len(trials) - len(waiting)} done before", file=sys.stderr)
    begin, count = time.perf_counter(), 0

    def work(trial: Trial) -> dict | None:
        return in_process("size" if given.sizes else "one", trial) if time.perf_counter() - begin < 60 * given.minutes else None

    with ThreadPoolExecutor(given.workers) as pool, file.open("a", encoding="utf-8") as lines:
        futures = [pool.submit(work, trial) for trial in waiting]
        try:
            for future in as_completed(futures):
                line = future.result()
                if line is None:
                    continue
                count += 1
                if not given.sizes or "size" in line:
                    lines.write(json.dumps(line) + "\n")
                    lines.flush()
                if not given.sizes:
                    _remember(line)
                left = (time.perf_counter() - begin) / count * (len(waiting) - count)
                print(f"{count}/{len(waiting)} {_short(line)} ({left / 60:.0f} min left)", file=sys.stderr)
        except KeyboardInterrupt:
            for future in futures:
                future.cancel()
            print("interrupted; the same command goes on", file=sys.stderr)
            raise SystemExit(130) from None


def _remember(line: dict) -> None:
    """The size of a fault, so that no later run need look for it."""
    known = line["trial"] in known_sizes()
    size = -1.0 if line["status"] == "unreachable" else line.get("truth", {}).get("size")
    if size is not None and not known:
        with (OUT / "sizes.jsonl").open("a", encoding="utf-8") as sizes:
            sizes.write(json.dumps({"trial": line["trial"], "size": size}) + "\n")


def _short(line: dict) -> str:
    if line["status"] == "made":
        return f"{line['trial']}: size {line['size']:.3g}, excess {line['strength']:.2f} in {line['channel']}, {line['seconds']:.0f} s"
    if line["status"] != "done":
        return f"{line['trial']}: {line['status']} {line.get('message', '')[-200:]}"
    score = line["score"]
    word = "right" if score["top"] else "in group" if score["grouped"] else "abstained" if score["abstained"] else "WRONG"
    if "/none/" in line["trial"]:
        word = "right" if score["verdict"] == "nothing_missing" else "abstained" if score["abstained"] else "WRONG"
    return f"{line['trial']}: {word}, {score['verdict']} {score['answer']}, {line['making']:.0f} + {score['seconds']:.0f} s"


def in_process(verb: str, trial: Trial) -> dict:
    """A trial in a process of its own."""
    limit = LONGEST.get(trial.machine, USUAL)
    try:
        done = subprocess.run(
            [sys.executable, str(HERE / "bench.py"), verb, trial.name], capture_output=True, text=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        return {"trial": trial.name, "status": "too long", "message": f"over {limit:g} s"}
    if done.returncode != 0:
        return {"trial": trial.name, "status": "crashed", "message": done.stderr[-2000:]}
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    sys.exit(main())
