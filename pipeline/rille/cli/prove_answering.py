"""A sealed trial is answered: its files go into a room, `rille import` and `rille diagnose` run there, what they say comes back."""

import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rille.model.ledger import AnswerStatus
    from rille.proof.room import Stay

LIMIT = 3600.0  # [s] that an answer may take, on machines that are slow or shared, too
LAST_WORDS = 2000  # characters of a failure that are kept
MOST_RANKED = 12
# What is kept of the answer: all that the score reads, and what a reader of the ledger wants to see.
ASK = "ask.json"  # in a room of real recordings: what diagnosis is asked; the recordings are imported already
KEPT = ("verdict", "sentence", "ranked", "groups", "leftover", "unknown_like", "limits", "notes", "data_problems", "transients")


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """An answer as it was given. text : JSON {"diagnosis": ..., baselines by name}, or the last words of a failure. recording : digest
    of the files. begun, ended : [s] since 1970-01-01 UTC.
    """

    trial: int
    status: "AnswerStatus"
    text: str
    recording: str
    seconds: float
    begun: float
    ended: float


def answer_files(
    trial: int, files: Mapping[str, bytes], secrets: Sequence[str] = (), baselines: bool = True, limit: float = LIMIT
) -> Given:
    """Diagnose the files of a trial in a room of its own, and ask the baselines there, too.

    secrets : paths that the room must not reach. limit : [s].
    """
    from rille.cli.prove_making import MODEL
    from rille.proof.room import stay
    from rille.proof.seal import canonical_json, files_digest
    from rille.proof.trials import HELD_OUT

    rille = Path(sys.executable).parent / "rille"
    with tempfile.TemporaryDirectory(prefix="rille-trial-") as place:
        folder = Path(place) / "trial"
        folder.mkdir()
        for name, content in files.items():
            (folder / name).write_bytes(content)
        digest = files_digest(folder)
        manifests = sorted(name for name in files if name.endswith(".toml"))
        hidden = [Path(secret) for secret in secrets if Path(secret).exists()]
        said: dict[str, Any] = {}
        ask = json.loads(files[ASK]) if ASK in files else ["--held-out", HELD_OUT]
        steps = [[rille, "import", *manifests, "-o", MODEL]] if manifests else []
        steps.append([rille, "diagnose", MODEL, *ask, "--json"])
        stays = _through(steps, folder, limit, hidden)
        took = stays[-1]
        if len(stays) == len(steps) and _ok(took):
            said["diagnosis"] = _kept(json.loads(took.output))
        if baselines and "diagnosis" in said and ASK not in files:
            other = stay([sys.executable, "-I", "-m", "rille.cli.prove_baselines", MODEL], folder, limit=limit, secrets=hidden)
            said |= json.loads(other.output) if _ok(other) else {"baselines_failed": (other.errors or other.kind)[-LAST_WORDS:]}
        done = "diagnosis" in said
        return Given(
            trial=trial,
            status="done" if done else took.status,
            text=canonical_json(said) if done else took.errors[-LAST_WORDS:],
            recording=digest,
            seconds=sum(one.seconds for one in stays),
            begun=stays[0].begun,
            ended=took.ended,
        )


def _through(steps: Sequence[Sequence[str | Path]], folder: Path, limit: float, secrets: Sequence[Path]) -> "list[Stay]":
    """Commands in a room, one after the other, until one fails."""
    from rille.proof.room import stay

    stays: list[Stay] = []
    for step in steps:
        stays.append(stay(step, folder, limit=limit, secrets=secrets))
        if not _ok(stays[-1]):
            break
    return stays


def _ok(took: "Stay") -> bool:
    return took.kind == "done" and took.code == 0


def _kept(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The answer without what only its own page needs: curves, texts of maneuvers."""
    kept: dict[str, Any] = {name: answer[name] for name in KEPT}
    kept["ranked"] = [
        entry for k, entry in enumerate(answer["ranked"]) if k < MOST_RANKED or entry["group"] == answer["ranked"][0]["group"]
    ]
    kept["location"] = {name: answer["location"][name] for name in ("shape", "targets", "sentence")}
    kept["proof"] = {k: v for k, v in answer["proof"].items() if k not in ("channels", "ablation")} if answer["proof"] else None
    kept["experiments"] = [{"name": one["name"], "sentence": one["sentence"]} for one in answer["experiments"]]
    return kept
