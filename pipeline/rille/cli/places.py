"""Where results go: looked at before anything is calculated, so that nothing is lost for want of a folder, or by being written over."""

from collections.abc import Iterable
from pathlib import Path


def require_place(*paths: Path | None, reads: Iterable[Path | None] = ()) -> None:
    """Refuse results that could not be written, or would be written over what is needed. None: not asked for.

    reads : files that the verb reads.

    Raises
    ------
    InputRefused : for a folder, a file in a folder that is not there, a database, a file that is read, and two results in one file.
    """
    from rille.model import InputRefused
    from rille.store.database import SQLITE

    read = {path.resolve() for path in reads if path is not None}
    taken: set[Path] = set()
    for path in paths:
        if path is None:
            continue
        require_folder(path)
        place = path.resolve()
        if place in read:
            raise InputRefused(f"'{path}' is what is read, and would be written over; name another file for the result")
        if place in taken:
            raise InputRefused(f"'{path}' is named for two results; give each a file of its own")
        if place.is_file() and place.open("rb").read(len(SQLITE)) == SQLITE:
            raise InputRefused(f"'{path}' is a database, and would be written over; name another file for the result")
        taken.add(place)


def require_folder(path: Path) -> None:
    """Refuse a file for which there is no place.

    Raises
    ------
    InputRefused : for a folder, or a file in a folder that is not there.
    """
    from rille.model import InputRefused

    if path.is_dir():
        raise InputRefused(f"'{path}' cannot be written: it is a folder; name a file")
    if not path.resolve().parent.is_dir():
        raise InputRefused(f"'{path}' cannot be written: there is no folder '{path.parent}'; make it first")


def require_png(picture: Path | None) -> None:
    """Refuse a picture of another kind. None: not asked for.

    Raises
    ------
    InputRefused : if its name does not end in .png.
    """
    from rille.model import InputRefused

    if picture is not None and picture.suffix.lower() != ".png":
        raise InputRefused(f"the picture '{picture}' is no PNG; name it for example {picture.stem or 'picture'}.png")
