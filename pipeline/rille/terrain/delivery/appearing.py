"""Files that appear complete or not at all."""

import errno
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rille.model import InputRefused


@contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """A folder beside ``path`` to write files into under their own names; at the end they take their places, all of them.

    If anything fails, the folder goes and what was there before stays.

    Raises
    ------
    InputRefused : if the folder of ``path`` is missing or not writable, or the disk is full.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputRefused(f"'{path}' cannot be written: there is no folder '{path.parent}'; create it first")
    if path.is_dir():
        raise InputRefused(f"'{path}' cannot be written: it is a folder; give the name of a file")
    try:
        folder = Path(tempfile.mkdtemp(prefix=".rille-", dir=path.parent))
    except OSError as error:
        raise InputRefused(f"'{path}' cannot be written: {_reason(error)}; choose another folder") from None
    try:
        yield folder
        made = sorted(folder.iterdir(), key=lambda file: file.name == path.name)  # what the others belong to comes last
        for file in made:
            file.replace(path.parent / file.name)
    except OSError as error:
        raise InputRefused(f"'{path}' could not be written: {_reason(error)}; nothing of it was left behind") from None
    except Exception as error:
        if type(error).__module__.startswith("rasterio"):  # GDAL does not pass on the number of the error
            reason = _reason(error.__cause__ or error)
            raise InputRefused(f"'{path}' could not be written: {reason}; nothing of it was left behind") from None
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        return "the disk is full"
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or type(error).__name__
    first = text.splitlines()[0].rstrip(".")
    if "previous exception" in first:  # rasterio's way of saying that it did not keep the reason
        return "GDAL could not write it; is the disk full?"
    return first[:1].lower() + first[1:]
