"""The ledger of sealed trials as values: what was planned and sealed, answered, opened and scored."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

AnswerStatus = Literal["done", "crashed", "too long", "refused"]
ANSWER_STATUSES: tuple[AnswerStatus, ...] = get_args(AnswerStatus)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProofPlan:
    """What was decided before the first answer. Digests are SHA-256 in hexadecimal.

    beacon : sentence that the trials are drawn from. version : of rille. code : digest of its code. isolation : of the process that
    diagnoses ("landlock 7", "other user", "none"). counts : sort of trial -> how many. root : Merkle root of the seals. sealed : when [s]
    since 1970-01-01 UTC.
    """

    beacon: str
    version: str
    code: str
    isolation: str
    counts: Mapping[str, int]
    root: str
    sealed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SealedTrial:
    """A trial as everybody may see it. seal : SHA-256(truth || nonce). recording : digest of the files that diagnosis gets."""

    number: int
    machine: str
    seal: str
    recording: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What diagnosis said of a trial.

    text : JSON if it is done, else the last that it said. sha256 : of the text. recording : digest of the files that it was given.
    seconds : wall time [s]. begun, ended : [s] since 1970-01-01 UTC. previous : chain hash of the answer before. chain : hash over
    ``previous`` and all else.
    """

    trial: int
    status: AnswerStatus
    text: str
    sha256: str
    recording: str
    seconds: float
    begun: float
    ended: float
    previous: str
    chain: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What opens a seal. text : canonical JSON of what is concealed. nonce : 32 bytes that nobody can guess."""

    trial: int
    text: str
    nonce: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How right an answer is. text : canonical JSON."""

    trial: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Ledger:
    """All of a ledger. trials, truths, scores : in order of their numbers. answers : in the order in which they were given."""

    plan: ProofPlan
    trials: tuple[SealedTrial, ...]
    answers: tuple[Answer, ...] = ()
    truths: tuple[Truth, ...] = ()
    scores: tuple[Score, ...] = ()
