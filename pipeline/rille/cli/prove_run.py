"""Sealed trials from a beacon: made, sealed, answered in rooms, opened, scored. Every step is kept, and the same command goes on."""

import json
import math
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rille.cli.talk import say
from rille.model.process import SAME_ROUNDING

if TYPE_CHECKING:
    from rille.cli.prove_answering import Given
    from rille.model.ledger import Ledger
    from rille.proof.trials import Extent, Trial

LEDGER, VAULT, ROOMS, TRUTHS, AGREEMENT = "ledger.db", "vault.json", "rooms", "truths", "agreement.json"
PRIVATE = 0o600

Files = Mapping[str, bytes]
Waiting = Sequence[tuple["Trial | RealTrial", Mapping[str, Any] | None]]
"""Trials that are to be made, each with its truth, if it is known."""


def prove(
    folder: Path,
    beacon: str,
    extent: "Extent",
    *,
    real: Sequence[Path] = (),
    workers: int,
    scheduler: str | None,
    baselines: bool,
    until: float,
) -> bool:
    """Bring the proof in a folder as far as time allows. real : sheets of trials of real recordings, which come after those of the beacon.
    until : no new trial is begun after this [s, monotonic].

    Returns
    -------
    Whether it is finished.

    Raises
    ------
    InputRefused : if the folder holds another proof.
    """
    from rille import store
    from rille.proof.trials import plan

    folder.mkdir(parents=True, exist_ok=True)
    trials: list[Trial | RealTrial] = list(plan(beacon, extent))
    trials += [RealTrial(number=n, sheet=sheet) for n, sheet in enumerate(real, start=len(trials))]
    _require_same(folder, beacon, extent, real)
    ledger = folder / LEDGER
    place = _Place(workers=workers, scheduler=scheduler, until=until)
    if not ledger.exists():
        if not _make(place, folder, trials):
            return False
        _seal(folder, beacon, trials)
    shutil.rmtree(folder / TRUTHS, ignore_errors=True)  # they are in the vault
    root = store.read_ledger(ledger).plan.root
    say(f"sealed: Merkle root {root}")
    if not _restore(place, folder, trials) or not _answer(place, folder, baselines):
        return False
    _agree(place, folder, beacon, trials)
    _open(folder)
    return True


def _require_same(folder: Path, beacon: str, extent: "Extent", real: Sequence[Path]) -> None:
    """The folder is new, or of this very proof."""
    from rille.model import InputRefused

    asked: dict[str, Any] = {"beacon": beacon, "counts": dict(extent.counts), "machines": list(extent.machines)}
    asked |= {"strengths": list(extent.strengths), "real": [sheet.name for sheet in real]}
    file = folder / "plan.json"
    if file.exists():
        kept = json.loads(file.read_text(encoding="utf-8"))
        if kept != asked:
            raise InputRefused(
                f"'{folder}' holds the trials of the beacon '{kept['beacon']}', {kept['counts']}; name another folder with -o"
            )
    elif any(folder.iterdir()):
        raise InputRefused(f"'{folder}' is not empty and holds no trials; name another folder with -o")
    else:
        file.write_text(json.dumps(asked) + "\n", encoding="utf-8")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Where trials are made and answered: so many processes, or the cluster of a Dask scheduler. Nothing is begun after ``until`` [s,
    monotonic].
    """

    workers: int
    scheduler: str | None
    until: float

    def each(
        self,
        what: str,
        work: Any,
        items: Iterable[Any],
        count: int,
        finish: Callable[[Any], None],
        lost: Any,
        variables: Mapping[str, str] | None = None,
    ) -> bool:
        """Do all items, one at a time and worker. Whether all are done. lost : as of ``carry_out``. variables : as of ``opened_pool``."""
        from rille.work import carry_out, opened_pool

        begin = time.monotonic()

        def tell(done: int) -> None:
            left = (time.monotonic() - begin) / done * (count - done)
            say(f"{what} {done} of {count}, about {left / 60:.0f} min left")

        def keep(results: Sequence[Any]) -> None:
            for result in results:
                finish(result)

        if not count:
            return True
        if time.monotonic() >= self.until:
            return False
        with opened_pool(work, min(self.workers, count), self.scheduler, variables) as pool:
            return carry_out(pool, items, count, keep, lost=lost, tell=tell, ahead=1, until=self.until)

    def make(self, what: str, waiting: "Waiting", keep: "Callable[[tuple[int, Files, Mapping[str, Any]]], None]") -> bool:
        """Make trials, for the first time or again: with the same bits. Whether all are done."""
        return self.each(what, make_trials, waiting, len(waiting), keep, not_made, SAME_ROUNDING)


# --- made


def make_trials(asked: "Waiting") -> list[tuple[int, Files, Mapping[str, Any]]]:
    """Of each trial (with its truth, if it is known) its number, its files and its truth. Runs on any worker; under SAME_ROUNDING where
    the files are to be those that were made elsewhere, to the last bit.
    """
    from rille.cli.prove_real import make_real_trial

    return [
        make_real_trial(trial.number, trial.sheet) if isinstance(trial, RealTrial) else make_trial(trial, truth) for trial, truth in asked
    ]


def make_trial(trial: "Trial", truth: Mapping[str, Any] | None = None) -> tuple[int, dict[str, bytes], dict[str, Any]]:
    """The files of a trial and its truth. truth : of a trial that was made before: the draw and sizes that were found then."""
    from rille.proof.making import MOST_DRAWS
    from rille.proof.strength import Unreachable

    if truth is not None:
        return _made_once(replace(trial, draw=truth["draw"]), truth)
    last = ""
    for _ in range(MOST_DRAWS):
        try:
            return _made_once(trial, None)
        except Unreachable as error:
            last, trial = str(error), trial.again()
    raise Unreachable(
        f"trial {trial.number} ({trial.sort}, {trial.machine}, {trial.strength:g}): {MOST_DRAWS} draws could not be made; {last}"
    )


def _made_once(trial: "Trial", truth: Mapping[str, Any] | None) -> tuple[int, dict[str, bytes], dict[str, Any]]:
    """One draw of a trial. Raises Unreachable."""
    import tempfile

    from rille import store
    from rille.cli.prove_making import MODEL, make_room
    from rille.proof.generator.strange_laws import strange_kinds
    from rille.proof.trials import Drawn

    with tempfile.TemporaryDirectory(prefix="rille-making-") as place:
        room = Path(place) / "room"
        made = make_room(Drawn(trial, store.effect_kinds(), strange_kinds()), room, truth)
        passing = store.beside(room / MODEL)  # it was read, and nothing is in them
        files = {file.name: file.read_bytes() for file in sorted(room.iterdir()) if file not in passing}
        return trial.number, files, made.truth


@dataclass(frozen=True, slots=True, kw_only=True)
class RealTrial:
    """A trial of real recordings. sheet : see ``rille.proof.real``."""

    number: int
    sheet: Path


def _make(place: _Place, folder: Path, trials: "Sequence[Trial | RealTrial]") -> bool:
    """Files of all trials into rooms; truths into files that only the owner reads, until they are sealed. Truths are all that must be kept
    to go on: rooms that are gone are made again from them.
    """
    truths = folder / TRUTHS
    truths.mkdir(mode=0o700, exist_ok=True)

    def keep(found: tuple[int, Files, Mapping[str, Any]]) -> None:
        number, files, truth = found
        _furnish(folder / ROOMS / f"{number:03d}", files)
        part = truths / f"{number:03d}.part"
        part.touch(PRIVATE)
        part.write_text(json.dumps(truth), encoding="utf-8")
        part.rename(truths / f"{number:03d}.json")  # the last step: what has a truth is whole

    waiting: list[tuple[Trial | RealTrial, Mapping[str, Any] | None]] = []
    for trial in trials:
        known = truths / f"{trial.number:03d}.json"
        if not known.exists():
            waiting.append((trial, None))
        elif not (folder / ROOMS / f"{trial.number:03d}").exists():
            waiting.append((trial, json.loads(known.read_text(encoding="utf-8"))))
    waiting.sort(key=lambda one: _is_quick(one[0]))
    return place.make("made", waiting, keep)


def _is_quick(trial: "Trial | RealTrial") -> tuple[bool, bool]:
    """Sorts what takes longest to make to the front, so that no worker waits for the last one: rovers, and of these laws that no catalogue
    has, whose size is searched for beside that of all that look like them (up to half an hour, where others take a minute).
    """
    if isinstance(trial, RealTrial) or trial.machine != "rover":
        return True, True
    return False, trial.sort != "outside"


def not_made(asked: "tuple[Trial | RealTrial, Any]", why: str) -> Any:
    """Refuses a trial that takes its worker along, as ``carry_out`` asks. Raises InputRefused."""
    from rille.model import InputRefused

    raise InputRefused(f"trial {asked[0].number} could not be made: {why}; the same command tries it again")


def _furnish(room: Path, files: Files) -> None:
    """Files into a new room."""
    shutil.rmtree(room, ignore_errors=True)
    room.mkdir(parents=True)
    for name, content in files.items():
        (room / name).write_bytes(content)


# --- sealed


def _seal(folder: Path, beacon: str, trials: "Sequence[Trial | RealTrial]") -> None:
    """Truths and nonces into the vault, seals and Merkle root into a new ledger."""
    import rille
    from rille import store
    from rille.cli.content import code_digest
    from rille.model.ledger import ProofPlan, SealedTrial
    from rille.proof.room import isolation
    from rille.proof.seal import conceal, files_digest, merkle_root, seal
    from rille.proof.vault import read_vault, write_vault

    vault = folder / VAULT
    if not vault.exists():
        read = [json.loads((folder / TRUTHS / f"{t.number:03d}.json").read_text(encoding="utf-8")) for t in trials]
        write_vault(vault, [conceal(truth["number"], truth) for truth in read])
    truths = read_vault(vault)
    plan = ProofPlan(
        beacon=beacon,
        version=rille.__version__,
        code=code_digest(()),
        isolation=isolation(),
        counts=dict(Counter("real" if isinstance(trial, RealTrial) else str(trial.sort) for trial in trials)),
        root=merkle_root([seal(truth) for truth in truths]),
        sealed=time.time(),
    )
    machines = {trial.number: trial.sheet.stem if isinstance(trial, RealTrial) else trial.machine for trial in trials}
    sealed = [
        SealedTrial(
            number=truth.trial,
            machine=machines[truth.trial],
            seal=seal(truth),
            recording=files_digest(folder / ROOMS / f"{truth.trial:03d}"),
        )
        for truth in truths
    ]
    store.create_ledger(folder / LEDGER, plan, sealed)


# --- answered


def _restore(place: _Place, folder: Path, trials: "Sequence[Trial | RealTrial]") -> bool:
    """Rooms that are wanted and gone, made again. Ledger and vault are all that must be kept to go on: beacon, or sheet, and truths make
    the rest, and digests that were sealed show that it is the same, to the last bit (SAME_ROUNDING).
    """
    from rille import store
    from rille.model import InputRefused
    from rille.proof.seal import files_digest
    from rille.proof.vault import read_vault

    ledger = store.read_ledger(folder / LEDGER)
    recordings = {trial.number: trial.recording for trial in ledger.trials}
    have = {answer.trial for answer in ledger.answers}
    rooms = {trial.number: folder / ROOMS / f"{trial.number:03d}" for trial in trials if trial.number not in have}
    missing = [trial for trial in trials if trial.number in rooms and not rooms[trial.number].exists()]
    truths = {truth.trial: json.loads(truth.text) for truth in read_vault(folder / VAULT, ledger.plan.root)} if missing else {}
    waiting = [(trial, truths[trial.number]) for trial in missing]

    def keep(found: tuple[int, Files, Mapping[str, Any]]) -> None:
        number, files, _ = found
        part = folder / ROOMS / f"{number:03d}.part"
        _furnish(part, files)
        if files_digest(part) != recordings[number]:
            shutil.rmtree(part)
            raise InputRefused(
                f"trial {number} was made again, and its files are not those that were sealed: this is another version of rille or of its"
                " libraries, or a processor that rounds differently; go on with"
                f" {ledger.plan.version} on such a machine as sealed them, with the folder '{folder / ROOMS}' if it is kept, or begin anew"
                " with another -o"
            )
        part.rename(rooms[number])

    if waiting:
        say(f"{len(waiting)} rooms are gone; their trials are made again")
    return place.make("made again", waiting, keep)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answering:
    """Answers trials, given by number and files. secrets, baselines : as of ``answer_files``."""

    secrets: tuple[str, ...]
    baselines: bool

    def __call__(self, given: "Sequence[tuple[int, Files]]") -> "list[Given]":
        from rille.cli.prove_answering import answer_files

        return [answer_files(number, files, self.secrets, self.baselines) for number, files in given]


def _answer(place: _Place, folder: Path, baselines: bool) -> bool:
    """Answers of all trials into the ledger, one after the other as they come."""
    from rille import store
    from rille.cli.prove_answering import Given
    from rille.proof.seal import answered, chain_start

    path = folder / LEDGER
    ledger = store.read_ledger(path)
    _show_that_the_truth_is_shut_away(folder, ledger)
    last = [ledger.answers[-1].chain if ledger.answers else chain_start(ledger.plan, ledger.trials)]
    recordings = {trial.number: trial.recording for trial in ledger.trials}

    def keep(given: Given) -> None:
        answer = answered(last[0], given.trial, given.status, given.text, given.recording, given.seconds, given.begun, given.ended)
        store.add_answer(path, answer)
        last[0] = answer.chain

    def lost(item: tuple[int, Files], why: str) -> Given:
        now = time.time()
        return Given(trial=item[0], status="crashed", text=why, recording=recordings[item[0]], seconds=0.0, begun=now, ended=now)

    have = {answer.trial for answer in ledger.answers}
    waiting = [number for number in recordings if number not in have]
    items = ((number, _files(folder / ROOMS / f"{number:03d}")) for number in waiting)
    work = _Answering(secrets=tuple(str((folder / name).resolve()) for name in (VAULT, LEDGER)), baselines=baselines)
    return place.each("answered", work, items, len(waiting), keep, lost)


def _files(room: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(room.iterdir()) if file.is_file()}


def _show_that_the_truth_is_shut_away(folder: Path, ledger: "Ledger") -> None:
    """Try to read vault and ledger from within a room, before the first answer."""
    import tempfile

    from rille.model import InputRefused
    from rille.proof.probe import probe
    from rille.proof.room import isolation

    with tempfile.TemporaryDirectory(prefix="rille-probe-") as place:
        attempts = probe(Path(place), [folder / VAULT, folder / LEDGER])
    open_ones = [attempt for attempt in attempts if attempt.readable]
    if isolation() == "none":
        say("this machine can shut no room (no Landlock, not root): the ledger says that the truth was not kept from diagnosis")
    elif open_ones:
        raise InputRefused(f"from within a room '{open_ones[0].path}' could be read ({open_ones[0].said}); nothing was answered")
    else:
        say(f"{len(attempts)} attempts to read the truth from within a room failed ({ledger.plan.isolation})")


# --- agreed, opened


def _agree(place: _Place, folder: Path, beacon: str, trials: "Sequence[Trial | RealTrial]") -> None:
    """How far generator and solver are apart with nothing concealed, on each machine that there are trials of, into a file."""
    from rille.cli.prove_agreement import DRAWS, agreements
    from rille.model import InputRefused

    file = folder / AGREEMENT
    if file.exists():
        return
    found: dict[str, list[float]] = {}

    def lost(item: tuple[str, str, int], why: str) -> Any:
        raise InputRefused(f"generator and solver could not be compared ({item[1]}): {why}; the same command tries it again")

    machines = sorted({trial.machine for trial in trials if not isinstance(trial, RealTrial)})
    items = [(beacon, machine, draw) for machine in machines for draw in range(DRAWS)]
    whole = replace(place, until=math.inf)
    whole.each("compared", agreements, items, len(items), lambda one: found.setdefault(one[0], []).append(one[1]), lost)
    worst = {machine: max(values) for machine, values in sorted(found.items())}
    file.write_text(json.dumps(worst) + "\n", encoding="utf-8")


def _open(folder: Path) -> None:
    """Truths into the ledger; another program scores them."""
    from rille import store
    from rille.model import InputRefused
    from rille.proof.vault import read_vault

    path = folder / LEDGER
    ledger = store.read_ledger(path)
    if not ledger.truths:
        store.open_truths(path, read_vault(folder / VAULT, ledger.plan.root))
    if not ledger.scores:
        done = subprocess.run([sys.executable, "-I", "-m", "rille.cli.prove_score", path], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise InputRefused(f"the answers could not be scored: {done.stderr.strip()[-500:]}; all are kept, the same command goes on")
