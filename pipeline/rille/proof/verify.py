"""What is wrong with a ledger, from its values alone: anybody can ask, nobody needs to be trusted.

It finds what was changed after the sealing. That a whole ledger was made anew it cannot find: for that the root must be known from
elsewhere, from before the answers.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from rille.model.ledger import Answer, Ledger
from rille.proof.seal import NONCE_BYTES, chain_hash, chain_start, merkle_root, seal, sha256

Check = Literal["count", "root", "nonce", "seal", "recording", "answer", "chain", "score"]
Scoring = Callable[[Mapping[str, Any], Answer], Mapping[str, Any]]
"""Truth and answer -> score, as plain JSON values."""

HEX = re.compile("[0-9a-f]{64}")
SAME = 1e-9  # relative: scores are computed anew on another machine


@dataclass(frozen=True, slots=True, kw_only=True)
class Flaw:
    """One thing that is wrong. trial : where, if it is of one trial. sentence : what, with the numbers."""

    check: Check
    sentence: str
    trial: int | None = None


def verify(ledger: Ledger, score: Scoring | None = None) -> tuple[Flaw, ...]:
    """All flaws of a ledger; () if it holds.

    score : computes a score anew, to be compared with the stored one to 1e-9; None leaves the numbers of scores unchecked.
    """
    checks = (_count, _root, _nonces, _seals, _recordings, _answers, _chain, _stored_scores)
    found = [flaw for check in checks for flaw in check(ledger)]
    return (*found, *(_scores(ledger, score) if score is not None else ()))


def _count(ledger: Ledger) -> Iterator[Flaw]:
    """As many trials as planned, numbered without a gap, each answered and opened."""
    planned = sum(ledger.plan.counts.values())
    numbers = [trial.number for trial in ledger.trials]
    if len(numbers) != planned:
        yield Flaw(check="count", sentence=f"the plan has {planned} trials, the ledger {len(numbers)}")
    for number in sorted(set(range(planned)) - set(numbers)):
        yield Flaw(check="count", trial=number, sentence=f"trial {number} of {planned} is missing")
    for number in sorted(set(numbers) - set(range(planned))):
        yield Flaw(check="count", trial=number, sentence=f"trial {number} is beyond the {planned} of the plan")
    parts = (
        ("answer", "neither an answer nor a recorded failure", [a.trial for a in ledger.answers]),
        ("truth", "no opened truth", [t.trial for t in ledger.truths]),
    )
    for name, lacks, given in parts:
        for number in sorted(set(numbers) - set(given)):
            yield Flaw(check="count", trial=number, sentence=f"trial {number} has {lacks}")
        for number in sorted(set(given) - set(numbers)):
            yield Flaw(check="count", trial=number, sentence=f"there is an {name} of trial {number}, which was never sealed")
        for number, times in sorted(Counter(given).items()):
            if times > 1:
                yield Flaw(check="count", trial=number, sentence=f"trial {number} has {times} {name}s; one is allowed")


def _root(ledger: Ledger) -> Iterator[Flaw]:
    for trial in ledger.trials:
        if not HEX.fullmatch(trial.seal):
            yield Flaw(check="root", trial=trial.number, sentence=f"the seal of trial {trial.number} is no SHA-256: '{trial.seal}'")
            return
    found = merkle_root([trial.seal for trial in ledger.trials])
    if found != ledger.plan.root:
        yield Flaw(check="root", sentence=f"the seals have the Merkle root {found}, the plan states {ledger.plan.root}")


def _nonces(ledger: Ledger) -> Iterator[Flaw]:
    first: dict[bytes, int] = {}
    for truth in ledger.truths:
        if len(truth.nonce) != NONCE_BYTES:
            sentence = f"the nonce of trial {truth.trial} has {len(truth.nonce)} bytes; it needs {NONCE_BYTES}"
            yield Flaw(check="nonce", trial=truth.trial, sentence=sentence)
        other = first.setdefault(truth.nonce, truth.trial)
        if other != truth.trial:
            yield Flaw(check="nonce", trial=truth.trial, sentence=f"trials {other} and {truth.trial} share one nonce")


def _seals(ledger: Ledger) -> Iterator[Flaw]:
    sealed = {trial.number: trial.seal for trial in ledger.trials}
    for truth in ledger.truths:
        if truth.trial in sealed and seal(truth) != sealed[truth.trial]:
            sentence = f"the seal of trial {truth.trial} is broken: truth and nonce give {seal(truth)}, sealed was {sealed[truth.trial]}"
            yield Flaw(check="seal", trial=truth.trial, sentence=sentence)


def _recordings(ledger: Ledger) -> Iterator[Flaw]:
    sealed = {trial.number: trial.recording for trial in ledger.trials}
    for answer in ledger.answers:
        if answer.trial in sealed and answer.recording != sealed[answer.trial]:
            sentence = f"trial {answer.trial} was answered from files {answer.recording}, made for it were {sealed[answer.trial]}"
            yield Flaw(check="recording", trial=answer.trial, sentence=sentence)


def _answers(ledger: Ledger) -> Iterator[Flaw]:
    for answer in ledger.answers:
        if sha256(answer.text) != answer.sha256:
            sentence = f"the answer of trial {answer.trial} was edited: its text gives {sha256(answer.text)}, stored was {answer.sha256}"
            yield Flaw(check="answer", trial=answer.trial, sentence=sentence)
        if answer.begun < ledger.plan.sealed:
            sentence = f"trial {answer.trial} was begun at {answer.begun} s, before the sealing at {ledger.plan.sealed} s"
            yield Flaw(check="answer", trial=answer.trial, sentence=sentence)


def _chain(ledger: Ledger) -> Iterator[Flaw]:
    """Each answer's hash goes over the one before; the first one's over root and plan."""
    before, name = chain_start(ledger.plan, ledger.trials), "the plan with its root and trials"
    for answer in ledger.answers:
        if answer.previous != before:
            sentence = f"the chain is broken at the answer of trial {answer.trial}: it follows {answer.previous}, but {name} has {before}"
            yield Flaw(check="chain", trial=answer.trial, sentence=sentence)
        if chain_hash(answer) != answer.chain:
            sentence = (
                f"the entry of trial {answer.trial} was edited: it gives the chain hash {chain_hash(answer)}, stored was {answer.chain}"
            )
            yield Flaw(check="chain", trial=answer.trial, sentence=sentence)
        before, name = answer.chain, f"the answer of trial {answer.trial}"


def _stored_scores(ledger: Ledger) -> Iterator[Flaw]:
    """A score for every opened truth."""
    given, opened = {score.trial for score in ledger.scores}, {truth.trial for truth in ledger.truths}
    for number in sorted(opened - given):
        yield Flaw(check="score", trial=number, sentence=f"trial {number} has no score")
    for number in sorted(given - opened):
        yield Flaw(check="score", trial=number, sentence=f"trial {number} has a score, but its truth is not opened")


def _scores(ledger: Ledger, score: Scoring) -> Iterator[Flaw]:
    answers = {answer.trial: answer for answer in ledger.answers}
    truths = {truth.trial: truth for truth in ledger.truths}
    for stored in ledger.scores:
        if stored.trial not in answers or stored.trial not in truths:
            continue
        try:
            computed = score(json.loads(truths[stored.trial].text), answers[stored.trial])
            where = _differs(json.loads(stored.text), computed, "")
        except (ValueError, KeyError, TypeError) as error:
            where = f"it cannot be computed ({type(error).__name__}: {error})"
        if where:
            sentence = f"the score of trial {stored.trial} is not that of truth and answer: {where}"
            yield Flaw(check="score", trial=stored.trial, sentence=sentence)


def _differs(stored: object, computed: object, place: str) -> str:
    """Where two values of JSON are not the same, and how; '' if they are."""
    if isinstance(stored, Mapping) and isinstance(computed, Mapping):
        if set(stored) != set(computed):
            return f"stored are {sorted(stored)}, computed {sorted(computed)} {place}".rstrip()
        return next((found for key in stored if (found := _differs(stored[key], computed[key], f"{place}.{key}".lstrip(".")))), "")
    if isinstance(stored, list | tuple) and isinstance(computed, list | tuple) and len(stored) == len(computed):
        pairs = zip(stored, computed, strict=True)
        return next((found for k, (one, other) in enumerate(pairs) if (found := _differs(one, other, f"{place}[{k}]"))), "")
    if _is_number(stored) and _is_number(computed):
        same = math.isclose(float(str(stored)), float(str(computed)), rel_tol=SAME, abs_tol=1e-12)
    else:
        same = type(stored) is type(computed) and stored == computed
    return "" if same else f"{place or 'it'} is stored as {stored!r}, computed as {computed!r}"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
