"""The vault: truths and nonces in one file that only their owner reads, kept outside every room until the last answer is stored."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

from rille.model import InputRefused
from rille.model.ledger import Truth
from rille.proof.seal import NONCE_BYTES, canonical_json, merkle_root, seal


def write_vault(path: Path, truths: Sequence[Truth]) -> str:
    """Keep truths and nonces; returns the Merkle root of their seals. Written whole and to the disk, or not at all; never twice.

    Write it before the ledger: a plan whose truths are lost could never be opened.

    Raises
    ------
    InputRefused : if there is a file, or a nonce is of another length or used twice.
    """
    path = Path(path)
    if len({truth.nonce for truth in truths}) < len(truths) or any(len(truth.nonce) != NONCE_BYTES for truth in truths):
        raise InputRefused(f"the {len(truths)} truths need a nonce of {NONCE_BYTES} bytes each, no two alike; conceal them anew")
    ordered = sorted(truths, key=lambda truth: truth.trial)
    root = merkle_root([seal(truth) for truth in ordered])
    entries = [{"trial": truth.trial, "truth": truth.text, "nonce": truth.nonce.hex()} for truth in ordered]
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)  # of a program that was killed before the vault was whole
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
            file.write(canonical_json({"root": root, "truths": entries}))
            file.flush()
            os.fsync(file.fileno())
        os.link(part, path)  # fails where a file is; a rename would replace it
    except FileExistsError as error:
        raise InputRefused(f"the vault '{path}' holds the truths of a sealed plan; go on with that plan or name another file") from error
    finally:
        part.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
    return root


def read_vault(path: Path, root: str | None = None) -> tuple[Truth, ...]:
    """The truths in order of their trials. root : of the plan that they must belong to; None: any.

    Raises
    ------
    InputRefused : if the file is missing, damaged, readable by others, or of another plan.
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no vault '{path}'; without its truths the plan cannot be opened, seal a new one")
    mode = path.stat().st_mode & 0o777
    if mode & 0o077:
        raise InputRefused(f"the vault '{path}' has mode {mode:03o}, others may read it (600 is allowed); seal a new plan")
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        truths = tuple(Truth(trial=e["trial"], text=e["truth"], nonce=bytes.fromhex(e["nonce"])) for e in kept["truths"])
        stated = str(kept["root"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputRefused(f"the vault '{path}' is damaged ({error}); restore it from a copy or seal a new plan") from error
    found = merkle_root([seal(truth) for truth in truths])
    if found != stated:
        raise InputRefused(f"the vault '{path}' was changed: its truths have the root {found}, it states {stated}; restore it from a copy")
    if root not in (None, found):
        raise InputRefused(f"the vault '{path}' is of the plan with root {found}, not {root}; name the vault of this plan")
    return truths
