"""Seals: what is concealed is fixed before the first answer, and no answer can be changed after it was given.

A commitment by hashing: SHA-256(truth || nonce) tells nothing of the truth without the 32 random bytes of the nonce, and no other truth
opens it. One Merkle root (RFC 6962, section 2.1) stands for all seals; answers are a chain of hashes that begins at root and plan.
"""

import hashlib
import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rille.model import InputRefused
from rille.model.ledger import Answer, AnswerStatus, ProofPlan, SealedTrial, Truth

NONCE_BYTES = 32
LEAF, NODE = b"\x00", b"\x01"  # RFC 6962: a node can never pass for a leaf


def canonical_json(value: Mapping[str, Any]) -> str:
    """The one JSON text of a value: keys sorted, no spaces, shortest digits that give the same float64.

    Raises
    ------
    InputRefused : if a number is not finite, a key is no text, or a value is none of JSON's.
    """
    _check_json(value, "")
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _check_json(value: object, place: str) -> None:
    """Refuse what JSON cannot say, or would say in another way."""
    match value:
        case None | bool() | int() | str():
            return
        case float():
            if value != value or value in (float("inf"), float("-inf")):
                raise InputRefused(f"'{place}' is {value}, which JSON has no number for; give a finite one or null")
        case Mapping():
            for key, part in value.items():
                if not isinstance(key, str):
                    raise InputRefused(f"the key {key!r} in '{place}' is no text; JSON has no other keys, give a text")
                _check_json(part, f"{place}.{key}".lstrip("."))
        case list() | tuple():
            for number, part in enumerate(value):
                _check_json(part, f"{place}[{number}]")
        case _:
            raise InputRefused(f"'{place}' is a {type(value).__name__}, which JSON has no word for; give numbers, texts, lists or mappings")


def sha256(data: bytes | str) -> str:
    """SHA-256 in lower-case hexadecimal; of a text in UTF-8."""
    return hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest()


def fresh_nonce() -> bytes:
    """32 bytes from the system's source of randomness."""
    return secrets.token_bytes(NONCE_BYTES)


def conceal(trial: int, truth: Mapping[str, Any]) -> Truth:
    """A truth with a fresh nonce, ready to be sealed and kept away."""
    return Truth(trial=trial, text=canonical_json(truth), nonce=fresh_nonce())


def seal(truth: Truth) -> str:
    """SHA-256(truth || nonce)."""
    return sha256(truth.text.encode() + truth.nonce)


def merkle_root(seals: Sequence[str]) -> str:
    """Merkle root of seals in the order of their trials: leaf SHA-256(0x00 || seal), node SHA-256(0x01 || left || right).

    The left half of n leaves holds the largest power of two below n (RFC 6962, section 2.1). Of no seal: SHA-256 of nothing.
    """
    return _tree([bytes.fromhex(one) for one in seals]).hex()


def _tree(leaves: Sequence[bytes]) -> bytes:
    if not leaves:
        return hashlib.sha256(b"").digest()
    if len(leaves) == 1:
        return hashlib.sha256(LEAF + leaves[0]).digest()
    half = 1 << ((len(leaves) - 1).bit_length() - 1)
    return hashlib.sha256(NODE + _tree(leaves[:half]) + _tree(leaves[half:])).digest()


def chain_start(plan: ProofPlan, trials: Sequence[SealedTrial]) -> str:
    """What the first answer's hash goes over: the root with the rest of the plan, and the digests of all recordings."""
    stated = asdict(plan) | {"sealed": float(plan.sealed)}
    return sha256(canonical_json({"plan": stated, "trials": [asdict(trial) for trial in trials]}))


def chain_hash(answer: Answer) -> str:
    """SHA-256 over all of an answer but ``chain``; ``previous`` is in it, so no answer before can change."""
    return sha256(canonical_json({name: value for name, value in asdict(answer).items() if name != "chain"}))


def answered(
    previous: str, trial: int, status: AnswerStatus, text: str, recording: str, seconds: float, begun: float, ended: float
) -> Answer:
    """The next answer of the chain. Arguments : as the fields of ``Answer``."""
    fields = {"trial": trial, "status": status, "text": text, "sha256": sha256(text), "recording": recording}
    fields |= {"seconds": float(seconds), "begun": float(begun), "ended": float(ended), "previous": previous}
    return Answer(**fields, chain=sha256(canonical_json(fields)))


def files_digest(folder: Path, suffixes: Sequence[str] = ()) -> str:
    """Digest of the files in a folder and below: SHA-256 of the canonical JSON {path in the folder: SHA-256 of the file}.

    suffixes : only files that end so; () takes all. ``__pycache__`` is left out.

    Raises
    ------
    InputRefused : if there is no such file.
    """
    found = {name: sha256(file.read_bytes()) for name, file in _files(Path(folder)) if not suffixes or file.suffix in suffixes}
    if not found:
        raise InputRefused(f"the folder '{folder}' has no file{' that ends in ' + ', '.join(suffixes) if suffixes else ''}; name another")
    return sha256(canonical_json(found))


def _files(folder: Path) -> Iterator[tuple[str, Path]]:
    for file in sorted(folder.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            yield file.relative_to(folder).as_posix(), file
