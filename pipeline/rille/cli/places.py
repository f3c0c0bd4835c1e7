"""Where results go: looked at before anything is calculated, so that nothing that took minutes is lost for want of a folder."""

from collections.abc import Sequence
from pathlib import Path


def require_place(*paths: Path | None, endings: Sequence[str] = (), makes_folder: bool = False) -> None:
    """Refuse files that could not be written. None: not asked for.

    endings : that they may have (".png"); none given: any. makes_folder : their folder is made with them.

    Raises
    ------
    InputRefused : for a folder, a file in a folder that is not there, or another ending.
    """
    from rille.model import InputRefused

    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise InputRefused(f"'{path}' cannot be written: it is a folder; name a file")
        if not makes_folder and not path.resolve().parent.is_dir():
            raise InputRefused(f"'{path}' cannot be written: there is no folder '{path.parent}'; make it first")
        if endings and path.suffix.lower() not in endings:
            raise InputRefused(f"'{path}' ends in '{path.suffix}'; it must end in {' or '.join(endings)}")
