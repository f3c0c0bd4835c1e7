"""Trials of real recordings as files: the model without what is concealed, the recordings, what is asked; the truth apart."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

DATABASES = (".db", ".sqlite")


def make_real_trial(number: int, sheet: Path) -> tuple[int, dict[str, bytes], dict[str, Any]]:
    """The files of the room of a trial of real recordings, and its truth, which is not among them.

    Raises
    ------
    InputRefused : if model or recordings cannot be read; in the words of `rille cad build` and `rille import`.
    """
    import tempfile

    from rille.cli.prove_answering import ASK
    from rille.cli.prove_making import MODEL
    from rille.model.sheet import expand
    from rille.proof.real import read_real, real_truth

    asked = read_real(sheet)
    source = expand(asked.model, sheet.parent)
    with tempfile.TemporaryDirectory(prefix="rille-making-") as place:
        model = Path(place) / MODEL
        if source.suffix in DATABASES and source.is_file():
            shutil.copyfile(source, model)
        else:
            _rille("cad", "build", source, "-o", model)
        _rille("import", *(expand(one, sheet.parent) for one in asked.recordings), "-o", model)
        return number, {MODEL: model.read_bytes(), ASK: json.dumps(asked.ask).encode()}, real_truth(sheet, number)


def _rille(*words: str | Path) -> None:
    """A command of rille."""
    from rille.model import InputRefused

    command = [Path(sys.executable).parent / "rille", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputRefused(f"`rille {' '.join(map(str, words))}` failed: {done.stderr.strip()[-500:]}")
