"""Where results go: looked at before anything is calculated, so that nothing that took minutes is lost for want of a folder."""

from pathlib import Path


def require_place(*paths: Path | None) -> None:
    """Refuse files that could not be written. None: not asked for.

    Raises
    ------
    InputRefused : for a folder, or a file in a folder that is not there.
    """
    from rille.model import InputRefused

    for path in paths:
        if path is not None and path.is_dir():
            raise InputRefused(f"'{path}' cannot be written: it is a folder; name a file")
        if path is not None and not path.resolve().parent.is_dir():
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
